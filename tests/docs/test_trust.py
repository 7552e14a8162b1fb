"""The page of trust: what a run writes and sends, seen by Python's audit events."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from .blocks import SHORT

WATCHED = """
import os, sys

allowed = [os.path.realpath(each) for each in sys.argv[1].split(os.pathsep)]
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT

def watch(event, arguments):
    if event.startswith(("socket.connect", "socket.bind", "socket.send", "urllib", "ftplib", "http")):
        print("SENT", event, arguments, file=sys.stderr)
    if event == "open" and isinstance(arguments[0], (str, bytes)) and arguments[2] & WRITES:
        path = os.path.realpath(os.fsdecode(arguments[0]))
        if not any(path.startswith(each) for each in allowed):
            print("WRITTEN", path, file=sys.stderr)

sys.addaudithook(watch)
sys.argv = ["fesd-robot", *sys.argv[2:]]
from fesd_robot.cli.main import main
main()
"""


@pytest.mark.slow
def test_a_run_writes_into_its_folder_and_sends_nothing(tmp_path: Path) -> None:
    """A plan with page and figures opens no connection, and no file for writing but in its folder, cache and /tmp."""
    work, temporary, cache = (tmp_path / name for name in ("work", "temporary", "cache"))
    for folder in (work, temporary):
        folder.mkdir()
    words = ["plan", "hopper_one_jump", "--out", str(work / "run"), *(w for one in SHORT for w in ("--set", one))]
    allowed = os.pathsep.join(str(each) for each in (work / "run", temporary, cache, "/dev"))
    environment = {
        **os.environ,
        "TMPDIR": str(temporary),
        "FESD_ROBOT_CACHE": str(cache),
        "MPLCONFIGDIR": str(temporary),
    }
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, allowed, *words], cwd=work, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if line.startswith(("SENT", "WRITTEN"))] == []
    assert {each.name for each in work.iterdir()} == {"run"}
