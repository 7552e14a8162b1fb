"""The example on the documentation page runs and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "simulation.md"


def test_the_example_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """The mass with dry friction turns at π and 2π and sticks at 3π; x(5) and v(5) are those of the closed form."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert code
    names: dict[str, object] = {}
    exec(compile(code[1], str(PAGE), "exec"), names)
    motion = names["motion"]
    assert motion.switch_times == pytest.approx(np.pi * np.arange(1, 4), abs=1e-8)  # type: ignore[attr-defined]
    assert motion.at([5.0])[0] == pytest.approx([0.00601420200477445, 0.527408351064726], abs=1e-7)  # type: ignore[attr-defined]
    printed = capsys.readouterr().out.splitlines()
    assert printed[-2] == "9.424778 to 12.000000: leftwards | rightwards"
