"""Plans and scenes to run in."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.in_mujoco import MujocoScene, mujoco_scene
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


def formulated(name: str) -> MotionProblem:
    """Return a shipped task, formulated."""
    return formulate(load_task(TASKS / f"{name}.yaml"), driven=False)


@pytest.fixture(scope="session")
def motion(jump: Plan) -> MotionProblem:
    return formulate(task_of(jump), driven=False)


@pytest.fixture(scope="session")
def scene(motion: MotionProblem) -> MujocoScene:
    return mujoco_scene(motion)
