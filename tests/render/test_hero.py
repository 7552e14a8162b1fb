"""The pictures of the documentation's first page show the page of a plan as it is today."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from .browser import chromium

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "plan", ["hopper_one_jump.json", "solo12_jump.json --motion docs/images/solo12_jump.gif"], ids=["picture", "motion"]
)
def test_the_picture_is_not_stale(plan: str) -> None:
    """The page, drawn again from the same plan, is the picture but for fonts, and so are some of the moving picture."""
    chromium()
    command = [sys.executable, "scripts/tools/hero.py", *f"tests/render/plans/{plan} --tasks tasks --check".split()]
    outcome = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
