"""The example on the documentation page runs and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "simulation.md"


def executed(number: int) -> dict[str, Any]:
    """Run an example of the page, counted from 0, and return its variables."""
    codes = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(codes[number], str(PAGE), "exec"), names)
    return names


def test_the_controlled_example_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """Forces 1, 0.9, 0.65, 0.4, 0.15, -0.1 N are optimal: linear in time but for the limit; the mass goes forwards."""
    names = executed(1)
    solution, forces = names["solution"], names["transcription"].controls(names["solution"].w)[0]
    assert solution.exact and solution.residuals.complementarity <= 1e-12
    assert forces == pytest.approx([1, 0.9, 0.65, 0.4, 0.15, -0.1], abs=1e-6)
    assert solution.residuals.objective == pytest.approx(0.5 * sum(forces**2))
    assert capsys.readouterr().out.splitlines()[1].startswith("0.000 s ['H', 'G']")


def test_the_example_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """The mass with dry friction turns at π and 2π and sticks at 3π; x(5) and v(5) are those of the closed form."""
    motion = executed(0)["motion"]
    assert motion.switch_times == pytest.approx(np.pi * np.arange(1, 4), abs=1e-8)
    assert motion.at([5.0])[0] == pytest.approx([0.00601420200477445, 0.527408351064726], abs=1e-7)
    printed = capsys.readouterr().out.splitlines()
    assert printed[-2] == "9.424778 to 12.000000: leftwards | rightwards"
