"""Thousands of inputs that are nearly right: how the program ends, what it says, what it takes and what it leaves.

    python scripts/tools/run_mutated.py                  # 5,000 inputs, an hour on one core
    python scripts/tools/run_mutated.py --count 500 --seed 3 --keep /tmp/bad

Every input (scripts/tools/mutated_inputs.py) is given to the program's entry point in a fork of one process. It must
end with status 0, 2 or 3, say one sentence where it refuses, without a traceback and without words of C++, leave
nothing then, and take less than 5 s of a core and 1 GB. The table goes to docs/results/mutated_inputs.md.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import psutil

from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT
from scripts.tools.mutated_inputs import KINDS, MutatedInput, mutated_inputs, planned_here

PAGE = ROOT / "docs" / "results" / "mutated_inputs.md"

CPU_SECONDS, BYTES = 5.0, 1e9
"""Limits of an input."""

MOST_SECONDS = 30
"""s of wall time; a process that takes longer hangs."""

FOREIGN = re.compile(
    r"\.(cpp|hpp|hxx|cc|h):\d|std::|terminate called|Assertion|0x[0-9a-f]{7}|object at 0x|boost|/src/|[a-z]Error: "
)
"""Words of C++ and of Python that no sentence for users has."""


URDFDOM = re.compile(r"(Error|Warning):   |         at line \d+ in .*urdfdom")
"""Lines that the parser of URDF prints itself, past Python; they are left out of account."""


@dataclass(frozen=True)
class Ended:
    """How the program ended with an input.

    Attributes:
        code: exit status; the negative number of a signal.
        said: on stderr.
        seconds: of a core.
        bytes: most memory, beside that of the process that was forked.
        left: files that were not there before.
        hung: whether it was ended.
    """

    given: MutatedInput
    code: int
    said: str
    seconds: float
    bytes: float
    left: tuple[str, ...]
    hung: bool

    @property
    def faults(self) -> list[str]:
        """What is not as it should be, in words."""
        refused = self.code == 2
        last = self.said.strip().splitlines()[-1] if self.said.strip() else ""
        found = {
            "hang": self.hung,
            "crash": self.code < 0 and not self.hung,
            "traceback": "Traceback" in self.said or self.code == 1,
            "other status": self.code not in (0, 1, 2, 3) and self.code >= 0,
            "words of C++": bool(FOREIGN.search(self.said)) and "Traceback" not in self.said,
            "no sentence": refused and not last.startswith("error: ") and "Usage:" not in self.said,
            "several lines": refused
            and len([line for line in self.said.splitlines() if line.startswith("error: ")]) > 1,
            "no place": refused and last.startswith("error: ") and not self.names_place(last),
            "files left": refused and bool(self.left),
            "slow": self.seconds > CPU_SECONDS,
            "large": self.bytes > BYTES,
        }
        return [name for name, is_so in found.items() if is_so]

    def names_place(self, sentence: str) -> bool:
        """Return whether a sentence names a file of the input, or a key of the command line."""
        return "--" in sentence or any(name in sentence for name in self.given.files)


def ended(given: MutatedInput, folder: Path) -> Ended:
    """Give an input to the program, in a fork, in a folder that is empty."""
    for name, content in given.files.items():
        (folder / name).write_bytes(content)
    log = folder.parent / f"{folder.name}.log"
    before = psutil.Process().memory_info().rss  # a fork begins with all that its parent has
    begin, child = time.monotonic(), os.fork()
    if not child:
        _be_the_program(given, folder, log)
    hung = False
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() - begin > MOST_SECONDS:
            hung = True
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)
    code = os.waitstatus_to_exitcode(status)
    left = tuple(sorted({path.name for path in folder.iterdir()} - set(given.files)))
    said = "".join(line for line in log.open(encoding="utf-8", errors="replace") if not URDFDOM.match(line))
    log.unlink()
    most = max(used.ru_maxrss * 1024.0 - before, 0.0)
    return Ended(given, code, said, used.ru_utime + used.ru_stime, most, left, hung)


def _be_the_program(given: MutatedInput, folder: Path, log: Path) -> None:
    """Run the program's entry point with an input; never returns."""
    from fesd_robot.cli.main import main

    code = 1
    try:
        os.chdir(folder)
        with log.open("w", encoding="utf-8") as stream, open(os.devnull, "w", encoding="utf-8") as nothing:
            os.dup2(stream.fileno(), 2)
            os.dup2(nothing.fileno(), 1)
        resource.setrlimit(resource.RLIMIT_CPU, (2 * MOST_SECONDS, 2 * MOST_SECONDS))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        sys.argv = ["fesd-robot", *given.command]
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="replace", closefd=False)
        main()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
    with contextlib.suppress(Exception):
        sys.stderr.flush()
        sys.stdout.flush()
    os._exit(code)


def warm_up() -> None:
    """Import what all commands import, so that a fork has it."""
    from fesd_robot import explain, load_task

    explain(load_task("published_hopper_one_jump"))
    planned_here()


def all_ended(seed: int, count: int) -> Iterator[Ended]:
    """Yield how the program ends with every input."""
    with tempfile.TemporaryDirectory() as parent:
        for number, given in enumerate(mutated_inputs(seed, count)):
            folder = Path(parent) / str(number)
            folder.mkdir()
            yield ended(given, folder)
            shutil.rmtree(folder)


@dataclass
class Tally:
    """Numbers of one kind of input."""

    count: int = 0
    accepted: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    largest: float = 0.0

    def add(self, one: Ended) -> None:
        """Count an input."""
        self.count += 1
        self.accepted += one.code in (0, 3)
        self.faults.update(one.faults)
        self.slowest, self.largest = max(self.slowest, one.seconds), max(self.largest, one.bytes)

    def cells(self, kind: str) -> list[str]:
        """Return the line of a kind."""
        faults = ", ".join(f"{number} {name}" for name, number in sorted(self.faults.items())) or "none"
        numbers = [str(self.count), str(self.accepted), str(self.count - self.accepted)]
        return [kind, *numbers, faults, f"{self.slowest:.1f}", f"{self.largest / 1e6:.0f}"]


def page(tallies: dict[str, Tally], made: str) -> str:
    """Return the page."""
    total = sum(one.count for one in tallies.values())
    faults = sum((one.faults for one in tallies.values()), Counter[str]())
    header = ("input", "number", "accepted", "refused", "faults", "slowest [s]", "most memory [MB]")
    return "\n".join(
        [
            "# Inputs that are nearly right",
            "",
            f"Made by {made}. Files come from the schema of tasks, and from shipped files by mutation "
            "(`scripts/tools/mutated_inputs.py`); each is given to a command that reads it: `check` with and "
            "without a page, "
            "`robots`, `new`, `simulate`, `render`, `report`, `export`.",
            "",
            f"Of {total}: {faults['traceback']} tracebacks, {faults['crash']} crashes, {faults['hang']} hangs.",
            "",
            markdown_table(header, [tallies[kind].cells(kind) for kind in tallies]),
            "",
            "A fault is an end other than status 0, 2 or 3; a refusal of several lines, without a place, with words of "
            f"C++, or that leaves files; more than {CPU_SECONDS:g} s of a core or {BYTES / 1e9:g} GB.",
            "",
        ]
    )


def main() -> int:
    """Run the inputs and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--page", type=Path, default=PAGE)
    parser.add_argument("--keep", type=Path, help="folder for the inputs with faults")
    arguments = parser.parse_args()
    warm_up()
    tallies = {kind: Tally() for kind in KINDS}
    for number, one in enumerate(all_ended(arguments.seed, arguments.count)):
        tallies[one.given.kind].add(one)
        if one.faults:
            last = one.said.strip().splitlines()[-1:] or [""]
            print(number, one.given.kind, one.faults, " ".join(one.given.command), last[0][:200], flush=True)
            if arguments.keep:
                folder = arguments.keep / str(number)
                folder.mkdir(parents=True, exist_ok=True)
                for name, content in one.given.files.items():
                    (folder / name).write_bytes(content)
                (folder / "said.txt").write_text(f"{one.given.command}\n{one.said}", encoding="utf-8")
    command = f"`python scripts/tools/run_mutated.py --count {arguments.count} --seed {arguments.seed}`"
    arguments.page.write_text(page(tallies, command), encoding="utf-8")
    return int(any(tally.faults for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
