"""How soon a plan says something, and how long it is silent: what the program prints, with the time of every line.

    python scripts/results/progress_times.py                        # five tasks
    python scripts/results/progress_times.py solo12_jump --seconds 60   # stopped after a minute

Targets: the first line within 1 s of the start of the process, no silence above 3 s, no line above 80 columns. Exit
code 1 if one of them is missed.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

TASKS = ("hopper_one_jump", "block_push", "pusher_slider", "wheel_hills", "double_pendulum_wall")
FIRST, SILENCE, COLUMNS = 1.0, 3.0, 80


class Times(NamedTuple):
    """What was seen of one run.

    Attributes:
        first: s until the first line.
        silence: longest time between two lines, or the last one and the end, s.
        before: the line before the longest silence.
        columns: length of the longest line.
        seconds: until the end.
    """

    first: float
    silence: float
    before: str
    columns: int
    seconds: float

    @property
    def kept(self) -> bool:
        """Whether all targets are met."""
        return self.first <= FIRST and self.silence <= SILENCE and self.columns <= COLUMNS


def watched(task: str, seconds: float, overrides: list[str]) -> Times:
    """Plan a task in a process of its own, interrupted after some seconds, and watch what it prints."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "fesd_robot", "plan", task, "--out", f"{folder}/run"]
        command += [word for one in overrides for word in ("--set", one)]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        begin = time.monotonic()
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        assert process.stdout is not None
        seen: list[tuple[float, str]] = []
        interrupted = False
        for line in process.stdout:
            seen.append((time.monotonic() - begin, line.rstrip("\n")))
            if seen[-1][0] > seconds and not interrupted:
                process.send_signal(signal.SIGINT)
                interrupted = True
        process.wait()
        end = time.monotonic() - begin
    times = [at for at, _ in seen]
    waits = [(after - at, line) for (at, line), after in zip(seen, [*times[1:], end], strict=True)]
    silence, before = max(waits)
    return Times(times[0], silence, before.strip(), max(len(line) for _, line in seen), end)


def main() -> int:
    """Watch the tasks of the command line, and print a line about each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("tasks", nargs="*", default=list(TASKS), help="names or files; default: five short ones")
    parser.add_argument("--seconds", type=float, default=600.0, help="after which a plan is interrupted")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    kept = True
    for task in arguments.tasks:
        times = watched(task, arguments.seconds, arguments.set)
        kept = kept and times.kept
        print(
            f"{task}: first line after {times.first:.2f} s, longest silence {times.silence:.2f} s (after "
            f"'{times.before}'), longest line {times.columns} columns, {times.seconds:.0f} s in all"
            f"{'' if times.kept else ': NOT KEPT'}",
            flush=True,
        )
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
