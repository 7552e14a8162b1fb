"""Bad input beside the task file ends the real command with status 2, one message and nothing written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_a_missing_task_file_is_named(run: Callable[..., Any], tmp_path: Path) -> None:
    """The message names the file that is not there."""
    outcome = run("plan", "none.yaml")
    _assert_refused(outcome, tmp_path)
    assert outcome.err.startswith("error: none.yaml: there is no such file")


def test_a_bad_override_is_quoted(run: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """A mistake on the command line is blamed on the command line."""
    outcome = run("plan", task, "--set", "horizon.interval=3")
    _assert_refused(outcome, tmp_path)
    assert "--set horizon.interval=3" in outcome.err and "'intervals'" in outcome.err


def _assert_refused(outcome: Any, folder: Path) -> None:
    """Exit status 2, nothing on stdout but what it is at, one line without traceback on stderr, nothing written."""
    assert (outcome.code, outcome.said) == (2, "")
    assert outcome.err.count("\n") == 1 and "Traceback" not in outcome.err
    assert not list((folder / "work").iterdir())
