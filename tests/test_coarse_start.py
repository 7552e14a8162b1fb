"""Starts from the motion on a coarser control grid."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.planner import attempt
from fesd_robot.strategies.fallbacks import with_overrides
from fesd_robot.task import load_task
from fesd_robot.task.consistency import coarser_intervals

TASKS = Path(__file__).parents[1] / "tasks"


@pytest.mark.parametrize(
    ("task", "overrides", "intervals"),
    [
        ("double_pendulum_wall", [], 10),
        ("double_pendulum_wall", ["horizon.intervals=15"], 5),
        ("double_pendulum_wall", ["horizon.intervals=17"], None),
        ("double_pendulum_wall", ["horizon.intervals=6"], None),
        ("double_pendulum_wall", ["method.contact=impulses"], None),
        ("double_pendulum_wall", ["solver.warm_start=an earlier plan"], None),
        ("solo12_jump", [], None),
    ],
)
def test_which_grid_is_coarser(task: str, overrides: list[str], intervals: int | None) -> None:
    """It is contained in the task's, has at least four intervals and the times of waypoints, and nothing else is meant.

    The quadruped has a waypoint at an end of its fifteen intervals that is none of five.
    """
    assert coarser_intervals(load_task(TASKS / f"{task}.yaml", ["method.grid=uniform", *overrides])) == intervals


def test_a_motion_begins_on_the_coarser_grid() -> None:
    """The motion on ten intervals is one on twenty: the start from it costs no more, and its contacts are the same."""
    task = load_task(TASKS / "double_pendulum_wall.yaml", ["method.grid=uniform", "solver.local_search=false"])
    coarse = attempt(with_overrides(task, {"horizon.intervals": 10}))
    fine = attempt(with_overrides(task, {"solver.coarse_to_fine": True, "solver.seed": 1}))
    assert coarse.status.solved and fine.status.solved
    assert fine.statistics.objective <= coarse.statistics.objective * (1 + 1e-6)
    assert fine.statistics.objective != pytest.approx(attempt(task).statistics.objective, rel=1e-2)
    flights = [[len(one.flights) for one in plan.outcome.contacts.values()] for plan in (coarse, fine) if plan.outcome]
    assert len(flights) == 2 and flights[0] == flights[1]
