"""The numbered programs of examples/ run as they are, and come to the numbers that their page says."""

from __future__ import annotations

import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.plans import Plan, write_plan

EXAMPLES = Path(__file__).parents[2] / "examples"
LINES = range(20, 61)

CHECKS: dict[str, Callable[[dict[str, Any]], bool]] = {
    "01_first_plan": lambda names: names["flight"] == pytest.approx(0.858, abs=5e-4),
    "02_own_urdf": lambda names: names["height"] == pytest.approx(0.0, abs=1e-8),
    "03_mujoco_robot": lambda names: names["share"] == pytest.approx(1.0, abs=1e-4),
    "04_sweep": lambda names: names["difference"] < 1e-4,
    "05_tracking_in_mujoco": lambda names: names["ends"]["lqr"] < 0.01 < 0.1 < names["ends"]["open-loop"],
    "06_replanning": lambda names: names["end"] < 0.02,
    "07_optimal_control": lambda names: names["time"] == pytest.approx(12.0166, abs=5e-5),
    "08_nonsmooth_system": lambda names: names["error"] < 1e-9,
    "09_mpcc": lambda names: names["cost"] == pytest.approx(17.0) and names["certificate"].b_stationary == "certified",
    "10_plan_in_pinocchio": lambda names: names["worst"] < 1e-9,
}
"""Program -> whether its variables at the end are what its page says."""

AFTER_THE_FIRST = {"05_tracking_in_mujoco", "06_replanning", "10_plan_in_pinocchio"}


@pytest.mark.parametrize("name", CHECKS)
def test_its_number_is_that_of_its_page(name: str, jump: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program runs in an empty folder, with the plan of the first one where it says so, and its number comes out."""
    monkeypatch.chdir(tmp_path)
    if name in AFTER_THE_FIRST:
        write_plan(jump, "runs/hopper_one_jump")
    assert CHECKS[name](runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__"))


def test_the_page_lists_all_of_them() -> None:
    """Ten numbered programs of 20 to 60 lines are in the folder, in the table of its page and in this test."""
    programs = sorted(EXAMPLES.glob("[0-9]*.py"))
    listed = re.findall(r"^\| \[(\w+)\.py\]", (EXAMPLES / "README.md").read_text(encoding="utf-8"), re.M)
    assert [program.stem for program in programs] == listed == list(CHECKS)
    assert [int(program.stem[:2]) for program in programs] == list(range(1, 11))
    for program in programs:
        assert len(program.read_text(encoding="utf-8").splitlines()) in LINES, program.name
