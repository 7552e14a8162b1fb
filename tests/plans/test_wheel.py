"""A planned motion on uneven ground: the shipped wheel on its hills."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import formulate
from fesd_robot.planning.planner import plan
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "wheel_hills.yaml"


@pytest.mark.slow
def test_a_driven_wheel_rolls_over_a_hill() -> None:
    """From rest the plan drives a wheel without slipping: what it turns is the path of its centre over its radius."""
    task = load_task(
        TASK,
        [
            "method.compile=never",
            "horizon.duration=0.4",
            "horizon.intervals=4",
            "goal.configuration={root_x: 0.3, root_z: 0.25}",
            "goal.soft=true",
        ],
    )
    found = plan(task)
    assert found.status.solved, found.status.message
    x, z, turn = (found.trajectory.configuration[name] for name in ("root_x", "root_z", "turn"))
    assert x[-1] > 0.1
    assert set(found.contacts["rim"].mode) == {"stick"}
    path = formulate(task).scene.geometries["rim"].path.profile  # type: ignore[union-attr]
    along = np.linspace(x[0], x[-1], 20_001)
    length = np.hypot(np.diff(along), np.diff(path.derivatives(along)[0])).sum()
    assert 0.2 * (turn[-1] - turn[0]) == pytest.approx(length, abs=1e-4)
    assert z == pytest.approx(path.derivatives(x)[0], abs=1e-5)
