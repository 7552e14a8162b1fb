"""The whole chain on the cart: what a task asks for is planned, audited and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.planning.planner import plan
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
    """The plan takes 2 sqrt(d m / F), its controls stand on the equal intervals, and all of it is audited."""
    fastest = plan(cart(tmp_path, FASTEST, WHEEL))
    shortest = 2 * np.sqrt(1.5 * MASS / FORCE)
    assert fastest.status.solved, fastest.status.message
    assert fastest.trajectory.time[-1] == pytest.approx(shortest, rel=1e-6)
    np.testing.assert_allclose(fastest.controls["time"], shortest * np.arange(4) / 4, rtol=1e-6)
    for entry in ("max_constraint_violation", "max_goal_violation", "max_waypoint_violation", "max_clock_error"):
        assert 0 <= getattr(fastest.audit, entry) <= fastest.audit.tolerances[entry]
    again = read_plan(write_plan(fastest, tmp_path / "run"))
    assert again.task["horizon"]["duration"] == {"lower": 0.5, "upper": 6.0}
    assert "| time | " in report(again) and "| 2 /s |" in report(again)


def test_a_periodic_motion_is_planned(tmp_path: Path) -> None:
    """The plan rolls with stride / T from where the stride begins."""
    text = "horizon: {duration: 2, intervals: 4}\ngoal: {periodic: {stride: {x: 1.5}}}\n"
    repeated = plan(cart(tmp_path, text + "costs: {configuration: {}, velocity: {}, control: {x: 1}}\n", WHEEL))
    assert repeated.status.solved, repeated.status.message
    np.testing.assert_allclose(repeated.trajectory.velocity["x"], 0.75, atol=1e-6)
    assert repeated.audit.max_goal_violation is not None and repeated.audit.max_goal_violation <= 1e-6
