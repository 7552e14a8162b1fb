"""A plan to follow, and what follows it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning import Replanner

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="session")
def motion(jump: Plan) -> MotionProblem:
    return formulate(task_of(jump))


@pytest.fixture(scope="session")
def shared(jump: Plan, motion: MotionProblem) -> Replanner:
    """A replanner of the jump that tests share; `replanner` begins it again."""
    return Replanner(jump, search=False, motion=motion)


@pytest.fixture
def replanner(shared: Replanner) -> Replanner:
    shared.reset()
    shared.statistics.updates.clear()
    return shared
