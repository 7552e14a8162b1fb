"""Plans to follow."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot import plan
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, TrackingGains, task_of
from fesd_robot.task import load_task
from fesd_robot.tracking import tracking_gains

TASKS = Path(__file__).parents[2] / "tasks"
QUICK = ("solver.effort=quick", "output.page=false")


@pytest.fixture(scope="session")
def jump() -> Plan:
    """The hopper's jump in the plane: two landings."""
    found = plan(load_task(TASKS / "hopper_one_jump.yaml", [*QUICK, "output.gains=true"]))
    assert found.status.solved
    return found


@pytest.fixture(scope="session")
def motion(jump: Plan) -> MotionProblem:
    return formulate(task_of(jump), driven=False)


@pytest.fixture(scope="session")
def gains(jump: Plan) -> TrackingGains:
    return tracking_gains(jump)
