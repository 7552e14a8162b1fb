"""The picture of the README shows the page as it is today."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .browser import chromium

ROOT = Path(__file__).parents[2]


def test_the_picture_is_not_stale() -> None:
    """The page, drawn again from the same plan, is the picture but for fonts."""
    chromium()
    command = [
        sys.executable,
        "scripts/hero.py",
        "tests/render/plans/hopper_one_jump.json",
        "--tasks",
        "tasks",
        "--check",
    ]
    outcome = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
