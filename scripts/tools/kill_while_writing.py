"""Commands killed at every call that writes, moves or removes: what is left of plans, and of other files.

    python scripts/tools/kill_while_writing.py                  # all commands
    python scripts/tools/kill_while_writing.py export render

A library that is loaded before the C library counts these calls of the command's process, and kills it before one of
them, each once; the commands are forked from a process that has imported all they need. The folder holds an earlier
plan of another duration with page and figures, and files that no run wrote. The table goes to
docs/results/kill_while_writing.md. Exit code 1 if a plan is not whole, another file is gone or changed, a file is of
another motion than the plan after the folder was read, or the next run leaves anything.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot.cli.main import main as main_of_program
from fesd_robot.plans import Plan, export, read_plan, report, write_plan
from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT

PAGE = ROOT / "docs" / "results" / "kill_while_writing.md"
CALLS = {
    "rename": "const char *a, const char *b", "renameat": "int a, const char *b, int c, const char *d",
    "unlink": "const char *a", "unlinkat": "int a, const char *b, int c", "rmdir": "const char *a",
    "mkdir": "const char *a, mode_t b", "write": "int a, const void *b, size_t c", "fsync": "int a",
    "ftruncate": "int a, off_t b", "chmod": "const char *a, mode_t b", "open": "const char *a, int b, mode_t c",
    "open64": "const char *a, int b, mode_t c",
}  # fmt: skip
"""Functions of the C library, and their parameters; of files that are opened those count that are created."""

SHIM = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <sys/types.h>
#include <unistd.h>
#define O_CREAT 0100 /* of Linux; fcntl.h declares open as variadic */
static long count, last; static pid_t armed;
void arm(long number) { count = 0; last = number; armed = getpid(); }
long counted(void) { return count; }
static void call(void) { if (armed == getpid() && ++count == last) kill(armed, SIGKILL); }
"""
TASK = f"""
name: slide
robot: {{model: {ROOT}/models/block/block.urdf}}
ground: {{type: plane, friction: 0.3}}
contacts: {{rear: {{frame: rear}}, front: {{frame: front}}}}
horizon: {{duration: 0.2, intervals: 4}}
initial: {{configuration: {{root_x: 0, root_z: 0.1, root_pitch: 0}}, velocity: {{root_x: 1}}}}
goal: {{configuration: {{root_x: 0.1}}, soft: true}}
"""
EARLIER, LATER = 0.2, 0.1
"""Durations of the motions, s, by which plans are told apart."""

MOMENT = 0.2
"""Time in which processes that drew end with the one that was killed, s."""

FOREIGN = {"notes.txt": b"mine", "figures/photo.png": b"a photograph", "videos/a.mp4": b"a film"}
OF_LATER = ("slide.yaml", "--out", "out", "-q", "--set", f"horizon.duration={LATER}", "--set", "output.figures=false")
COMMANDS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", *OF_LATER),
    "plan": ("plan", *OF_LATER, "--set", "output.page=false"),
    "render": ("render", "out"),
    "export": ("export", "out", "--format", "json"),
    "export over an earlier file": ("export", "out", "--format", "csv"),
}
COLUMNS = ("command", "calls", "ended before it was killed", "earlier plan", "new plan", "no whole plan",
           "files of another motion", "other files changed", "left after the next run")  # fmt: skip

ABOUT = f"""Written by `scripts/tools/kill_while_writing.py`: every command is killed (SIGKILL) before each of the
calls of {", ".join(CALLS)} by which its process creates, writes, moves or removes a file, over a folder of results
with page, figures and files of others. The plan is read from the bytes of `plan.json`, before anything else looks at
the folder;
then the program reads the folder, and table and report have to be those of its plan; then a plan is written there."""


def main() -> int:
    """Kill all commands that are asked for at all of their calls, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help=f"of {', '.join(COMMANDS)}; default: all")
    names = parser.parse_args().commands or list(COMMANDS)
    with tempfile.TemporaryDirectory() as folder:
        if "LD_PRELOAD" not in os.environ:
            environment = {**os.environ, "LD_PRELOAD": str(_shim(Path(folder)))}
            return subprocess.run([sys.executable, *sys.argv], env=environment, check=False).returncode
        template = _template(Path(folder) / "template")
        rows = [killed(name, template, Path(folder)) for name in names]
    PAGE.write_text(f"# Killed while it writes\n\n{ABOUT}\n\n{markdown_table(COLUMNS, rows)}\n", encoding="utf-8")
    print(markdown_table(COLUMNS, rows))
    return 0 if all(row[5:] == ["0"] * 4 for row in rows) else 1


def killed(name: str, template: Path, folder: Path) -> list[str]:
    """Return the row of a command, killed at each of its calls over a copy of a folder of results."""
    counted, calls, work = Counter[str](), folder / "calls", folder / "work"
    shim = ctypes.CDLL(os.environ["LD_PRELOAD"])

    def run(number: int) -> tuple[int, int]:
        """Return status and calls of the command, which is killed before one of them."""
        shutil.rmtree(work, ignore_errors=True)
        shutil.copytree(template, work)
        process = os.fork()
        if not process:
            os.chdir(work)
            with open(os.devnull, "w") as nowhere:
                os.dup2(nowhere.fileno(), 1)
                os.dup2(nowhere.fileno(), 2)
            sys.argv = ["fesd-robot", *COMMANDS[name]]
            shim.arm(number)
            try:
                main_of_program()
            except SystemExit as ended:
                calls.write_text(str(shim.counted()))
                os._exit(int(ended.code or 0))
            finally:
                os._exit(99)
        return os.waitpid(process, 0)[1], int(calls.read_text() or 0) if calls.exists() else 0

    status, count = run(0)
    if status:
        sys.exit(f"{name} ends with status {status}")
    for number in range(1, count + 1):
        status, _ = run(number)
        time.sleep(MOMENT)
        found = what_is_left(work / "out")
        if status == 0:
            found.append("ended")
        counted.update(found)
        if set(found) - {"earlier", "new", "ended"}:
            print(f"{name}, call {number}: {found}", flush=True)
    kinds = ("ended", "earlier", "new", "none", "mixed", "foreign", "leftover")
    return [name, str(count), *(str(counted[kind]) for kind in kinds)]


def what_is_left(out: Path) -> list[str]:
    """Return in words what a killed command has left of a folder of results."""
    found = []
    try:
        plan = Plan.model_validate_json((out / "plan.json").read_bytes())
    except (OSError, ValueError):
        return ["none"]
    found.append("new" if plan.task["horizon"]["duration"] == LATER else "earlier")
    plan = read_plan(out)
    texts = {"trajectory.csv": export(plan, "csv").decode(), "report.md": report(plan)}
    for name, text in texts.items():
        there = (out / name).read_text() if (out / name).exists() else text
        if there.splitlines()[-3:] != text.splitlines()[-3:]:
            found.append("mixed")
    write_plan(plan, out)
    if any((out / name).read_bytes() != content for name, content in FOREIGN.items()):
        found.append("foreign")
    if list(out.rglob(".fesd-robot-*")):
        found.append("leftover")
    return found


def _shim(folder: Path) -> Path:
    """Compile the library that counts calls."""
    source, library = folder / "shim.c", folder / "shim.so"
    functions = []
    for name, parameters in CALLS.items():
        names = ", ".join(re.findall(r"(\w)(?:,|$)", parameters))
        creates = "if (b & O_CREAT) " if name.startswith("open") else ""
        kind = "ssize_t" if name == "write" else "int"
        functions.append(
            f"{kind} {name}({parameters}) {{ static {kind} (*next)({parameters}); {creates}call();"
            f' if (!next) next = dlsym(RTLD_NEXT, "{name}"); return next({names}); }}'
        )
    source.write_text(SHIM + "\n".join(functions))
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"], check=True)
    return library


def _template(folder: Path) -> Path:
    """Make a folder with a task, and in `out` its plan and files that are not its."""
    folder.mkdir()
    (folder / "slide.yaml").write_text(TASK)
    here = Path.cwd()
    os.chdir(folder)
    for words in (("simulate", "slide.yaml", "--out", "out"), ("plan", "slide.yaml", "--out", "warmed up")):
        sys.argv = ["fesd-robot", *words, "-q"]
        with suppress(SystemExit):
            main_of_program()
    os.chdir(here)
    shutil.rmtree(folder / "warmed up")
    for name, content in FOREIGN.items():
        (folder / "out" / name).parent.mkdir(exist_ok=True)
        (folder / "out" / name).write_bytes(content)
    return folder


if __name__ == "__main__":
    sys.exit(main())
