"""The program as a whole: help, version, schema, report, and what it does not import."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from fesd_robot import __version__
from fesd_robot.task.json_schema import SCHEMA_FILE

LAZY = """
import sys
from fesd_robot.cli.main import main
sys.argv = ["fesd-robot", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert end.code == 0, end.code
heavy = {"casadi", "pinocchio", "numpy", "matplotlib", "meshcat"} & set(sys.modules)
assert not heavy, heavy
"""


@pytest.mark.parametrize(
    "arguments", [["--help"], ["plan", "--help"], ["refine", "--help"], ["--version"], ["schema"], ["examples"]]
)
def test_help_and_schema_import_nothing_heavy(arguments: list[str]) -> None:
    """What needs no robot starts without CasADi, Pinocchio and numpy."""
    done = subprocess.run([sys.executable, "-c", LAZY, *arguments], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_the_schema_is_the_committed_one(run: Callable[..., Any]) -> None:
    """`schema` prints the file that editors use, byte for byte."""
    assert run("schema") == (0, SCHEMA_FILE.read_text(encoding="utf-8"), "")


def test_the_package_runs_as_the_program() -> None:
    """`python -m fesd_robot` is `fesd-robot`, by its name, too."""
    done = subprocess.run([sys.executable, "-m", "fesd_robot", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, f"fesd-robot {__version__}\n"), done.stderr


def test_the_version_is_the_package_s(run: Callable[..., Any]) -> None:
    """`--version` prints it."""
    assert run("--version") == (0, f"fesd-robot {__version__}\n", "")


def test_the_help_names_every_command_and_exit_status(run: Callable[..., Any]) -> None:
    """`--help` lists the commands and what an exit status means."""
    outcome = run("--help")
    assert outcome.code == 0
    commands = ("plan", "refine", "check", "schema", "report", "render", "export", "examples", "new", "robots")
    for word in (*commands, "130 interrupted"):
        assert word in outcome.out


@pytest.mark.parametrize("arguments", [["paln"], ["plan"], ["plan", "a.yaml", "--fast"]])
def test_wrong_usage_exits_with_2(run: Callable[..., Any], arguments: list[str]) -> None:
    """An unknown command, a missing argument and an unknown option are bad input, too."""
    outcome = run(*arguments)
    assert outcome.code == 2 and "Usage" in outcome.err


def test_report_prints_the_report(run: Callable[..., Any], finished: Any) -> None:
    """`report` takes the folder or the file and prints report.md without its picture, as Markdown when piped."""
    expected = (finished.folder / "report.md").read_text(encoding="utf-8")
    expected = expected.replace("![The robot at a few moments](figures/snapshots.png)\n\n", "")
    for path in (finished.folder, finished.folder / "plan.json"):
        outcome = run("report", path)
        assert (outcome.code, outcome.err) == (0, "")
        assert outcome.out.strip() == expected.strip()
