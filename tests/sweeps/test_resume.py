"""A sweep that is killed leaves a table that can be read, and goes on where it stopped."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from fesd_robot.errors import SweepError
from fesd_robot.sweeps import SweepSettings, load_sweep, read_sweep, swept
from fesd_robot.sweeps.table import Columns, Journal
from tests.sweeps.stubs import parabola, slow

REPOSITORY = Path(__file__).parents[2]
SWEEP = {"task": "hopper_one_jump", "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": 1000}}}
PROGRAM = f"""
import sys
from pathlib import Path
from fesd_robot.sweeps import SweepSettings, load_sweep, swept
from tests.sweeps.stubs import slow
if __name__ == "__main__":
    swept(load_sweep({SWEEP!r}), Path(sys.argv[1]), SweepSettings(jobs=2, resume=True, keep="solved"), slow)
"""


def begun(out: Path, file: Path) -> subprocess.Popen[bytes]:
    """Return a program that runs the sweep."""
    file.write_text(PROGRAM)
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, str(file), str(out)], env={**os.environ, "PYTHONPATH": path}, cwd=REPOSITORY
    )


def lines_of(out: Path) -> int:
    """Return how many whole lines the table has, with its header."""
    return (out / "rows.csv").read_bytes().count(b"\n") if (out / "rows.csv").is_file() else 0


def descendants(process: subprocess.Popen[bytes]) -> list[psutil.Process]:
    return psutil.Process(process.pid).children(recursive=True)


def test_killed_at_random_times(tmp_path: Path) -> None:
    """SIGKILL ten times, before and after new rows: the table is whole, no row is twice or lost, no process stays."""
    out, draw, before = tmp_path / "out", random.Random(3), 0
    for turn in range(10):
        program, least = begun(out, tmp_path / "program.py"), before + 2 if turn % 3 else 0
        while not descendants(program) or lines_of(out) <= least:
            assert program.poll() is None
            time.sleep(0.02)
        time.sleep(draw.uniform(0.0, 1.0))
        children = descendants(program) if program.poll() is None else []
        program.send_signal(signal.SIGKILL)
        program.wait()
        numbers = read_sweep(out).columns["number"]
        assert len(set(numbers)) == len(numbers) >= before
        assert all(plan and (out / plan / "plan.json").is_file() for plan in read_sweep(out).columns["plan"])
        before = len(numbers)
        psutil.wait_procs(children, timeout=30.0)  # one that still imports the program looks round afterwards
        assert not [child for child in children if child.is_running() and child.status() != psutil.STATUS_ZOMBIE]
    assert 0 < before < 1000
    table = swept(load_sweep(SWEEP), out, SweepSettings(jobs=2, resume=True), slow)
    assert table.columns["number"] == list(range(1000))
    assert table.columns["verdict"] == ["solved"] * 1000


def test_a_killed_program_leaves_no_plan_running(tmp_path: Path) -> None:
    """A process in the middle of a plan ends with the program that ordered it, however that ends."""
    marker, file = tmp_path / "marker", tmp_path / "program.py"
    file.write_text(PROGRAM.replace("slow", "endless").replace("jobs=2", "jobs=1"))
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path, "FESD_ROBOT_TEST_MARKER": str(marker)}
    program = subprocess.Popen([sys.executable, str(file), str(tmp_path / "out")], env=environment, cwd=REPOSITORY)
    while not marker.is_file() or not marker.read_text():
        assert program.poll() is None
        time.sleep(0.02)
    worker = psutil.Process(int(marker.read_text()))
    program.send_signal(signal.SIGKILL)
    program.wait()
    worker.wait(30.0)


def test_an_interrupt_notes_what_ran(tmp_path: Path, python_interrupts: None) -> None:
    """Ctrl-C leaves rows that say that they were interrupted, which --resume does again."""
    out = tmp_path / "out"
    program = begun(out, tmp_path / "program.py")
    while lines_of(out) < 4:
        assert program.poll() is None
        time.sleep(0.02)
    program.send_signal(signal.SIGINT)
    assert program.wait() != 0
    states = read_sweep(out).columns["state"]
    assert 1 <= states.count("interrupted") <= 3
    assert (out / "rows.parquet").is_file()
    table = swept(load_sweep(SWEEP), out, SweepSettings(jobs=2, resume=True), parabola)
    assert table.columns["state"] == ["completed"] * 1000


def test_one_program_at_a_time(tmp_path: Path) -> None:
    """A second program is refused while the first one runs."""
    out = tmp_path / "out"
    program = begun(out, tmp_path / "program.py")
    while not (out / "rows.csv").is_file():
        time.sleep(0.02)
    with pytest.raises(SweepError, match="another program runs this sweep"):
        swept(load_sweep(SWEEP), out, SweepSettings(jobs=1, resume=True), parabola)
    program.kill()
    program.wait()


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    """At whatever byte a table ends, the rows before are read, and the next row begins a line of its own."""
    columns = Columns({"a.b": float, "c.d": str, "e.f": object}, ("end.x",))
    journal = Journal(tmp_path, columns)
    rows = [
        {"number": number, "a.b": 0.1 * number, "c.d": 'a "quoted", text', "e.f": [1, None], "identity": "00",
         "state": "completed", "verdict": "solved", "cost": 1.0 / 3.0, "work": None, "time": 1.0, "flights": 1,
         "slides": 0.0, "iterations": 3, "attempts": 1, "seconds": 0.5, "memory": 9.5, "start": None,
         "abandoned": None, "abandoned_iterations": None, "message": "é", "plan": "", "end.x": -1e-300}
        for number in range(3)
    ]  # fmt: skip
    for row in rows:
        journal.append(row)
    journal.close()
    assert list(journal.rows()) == rows
    whole = journal.file.read_bytes()
    ends = [at + 1 for at, byte in enumerate(whole) if byte == ord("\n")]
    for length in range(len(whole)):
        journal.file.write_bytes(whole[:length])
        count = sum(end <= length for end in ends) - 1
        try:
            assert list(journal.rows()) == rows[: max(count, 0)]
        except UnicodeDecodeError:
            raise AssertionError(f"cut off after {length} bytes") from None
        journal.rewritten(lambda row: row)
        journal.append(rows[2])
        journal.close()
        assert list(journal.rows()) == [*rows[: max(count, 0)], rows[2]]
