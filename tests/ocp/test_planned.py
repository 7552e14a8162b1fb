"""The whole chain on the cart: demands are planned, audited and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.planner import plan
from fesd_robot.plans import read_plan, report, write_plan

from .cart import FORCE, WHEEL, cart

FASTEST = """\
horizon: {duration: {lower: 0.5, upper: 6}, intervals: 4}
goal: {configuration: {x: 1.5}, tolerance: {configuration: {x: 0}, velocity: {x: 0}}}
waypoints:
  - {configuration: {x: 0.75}, tolerance: {configuration: {x: 0.01}}, weight: 0}
constraints: {room: {type: frame_limits, frame: cart, x: [-0.1, 1.6]}}
costs: {configuration: {}, velocity: {}, control: {}, terminal_configuration: {}, terminal_velocity: {}, time: 2}
"""

MASS = 2.1
"""kg, of cart and wheel."""


def test_the_fastest_motion_is_planned(tmp_path: Path) -> None:
    """The plan takes 2 sqrt(d m / F), its controls stand on the equal intervals, and every demand is audited."""
    found = plan(cart(tmp_path, FASTEST, WHEEL))
    shortest = 2 * np.sqrt(1.5 * MASS / FORCE)
    assert found.status.solved, found.status.message
    assert found.trajectory.time[-1] == pytest.approx(shortest, rel=1e-6)
    np.testing.assert_allclose(found.controls["time"], shortest * np.arange(4) / 4, rtol=1e-6)
    for entry in ("max_constraint_violation", "max_goal_violation", "max_waypoint_violation", "max_clock_error"):
        assert 0 <= getattr(found.audit, entry) <= found.audit.tolerances[entry]
    again = read_plan(write_plan(found, tmp_path / "run"))
    assert again.task["horizon"]["duration"] == {"lower": 0.5, "upper": 6.0}
    assert "| time | " in report(again) and "| 2 /s |" in report(again)


def test_a_periodic_motion_is_planned(tmp_path: Path) -> None:
    """The plan rolls with stride / T from where the stride begins."""
    text = "horizon: {duration: 2, intervals: 4}\ngoal: {periodic: {stride: {x: 1.5}}}\n"
    found = plan(cart(tmp_path, text + "costs: {configuration: {}, velocity: {}, control: {x: 1}}\n", WHEEL))
    assert found.status.solved, found.status.message
    np.testing.assert_allclose(found.trajectory.velocity["x"], 0.75, atol=1e-6)
    assert found.audit.max_goal_violation is not None and found.audit.max_goal_violation <= 1e-6
