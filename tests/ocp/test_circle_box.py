"""A pusher that puts its round tip to the flat side of a box."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.planning.planner import attempt
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"
BOX = "{type: circle_box, frame: pusher, radius: 0.05, other_frame: slider, other_size: [0.3, 0.2], friction: 0}"


@pytest.mark.slow
def test_a_box_is_pushed_by_its_side() -> None:
    """The plan is exact, its replay follows it, and the tip touches half the box's length from the box's frame."""
    task = load_task(
        TASKS / "pusher_slider.yaml",
        [
            "method.grid=uniform",
            f"contacts.push={BOX}",
            "solver.effort=quick",
            "method.compile=never",
            "output.figures=false",
        ],
    )
    result = attempt(task)
    assert result.status.solved and result.audit.worst[0] <= 0.1
    places, push = result.trajectory.configuration, result.contacts["push"]
    apart, touching = places["slider_x"] - places["pusher_x"], push.normal_force > 1.0
    assert touching.any() and apart[touching] == pytest.approx(0.05 + 0.15, abs=1e-6)
    assert places["slider_x"][-1] == pytest.approx(0.4, abs=0.0101)
