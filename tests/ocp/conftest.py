"""A short task of the hopper to spoil, and the hopper benchmark formulated once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import Task, load_task

ROOT = Path(__file__).parents[2]
HOPPER = ROOT / "models" / "hopper" / "hopper.urdf"

SHORT = f"""\
name: hop
robot:
  model: {HOPPER}
  armature: {{leg: 0.1}}
contacts:
  foot: {{frame: foot}}
horizon: {{duration: 1, intervals: 4}}
initial: {{configuration: {{root_z: 0.6, leg: 0.5}}}}
goal:
  configuration: {{root_x: 1}}
"""


@pytest.fixture
def short() -> str:
    """A valid task in ten lines."""
    return SHORT


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str], Task]:
    """Write a text to a task file and load it."""

    def load_text(text: str) -> Task:
        path = tmp_path / "task.yaml"
        path.write_text(text, encoding="utf-8")
        return load_task(path, ["method.grid=uniform"])

    return load_text


@pytest.fixture(scope="session")
def hopper() -> MotionProblem:
    """The benchmark as published: five metres in five seconds with five jumps, and slipping is free."""
    return formulate(
        load_task(ROOT / "tasks" / "published_hopper_five_jumps.yaml", ["method.grid=uniform", "costs.slipping={}"])
    )
