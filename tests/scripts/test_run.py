"""`scripts/run` says what it takes before it installs anything."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

RUN = Path(__file__).parents[2] / "scripts" / "run"


@pytest.mark.parametrize(("word", "status"), [("--help", 0), ("--set", 2)])
def test_what_is_no_task_is_answered_at_once(word: str, status: int, tmp_path: Path) -> None:
    """Help ends well; an option in the place of the task ends with a sentence that names it. No Python is called."""
    environment = {**os.environ, "PYTHON": str(tmp_path / "none")}
    done = subprocess.run([RUN, word], capture_output=True, text=True, env=environment, timeout=60)
    assert done.returncode == status
    assert "scripts/run [--no-open] [TASK [options" in done.stderr
    assert (f"error: found {word} where a task is expected" in done.stderr) == (status == 2)
