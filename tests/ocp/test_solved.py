"""Small motions that are solved and compared with their closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.plans.requirements import requirements

from .cart import FORCE, MASS, cart, puck, solved

TIME_OPTIMAL = """\
horizon: {duration: {lower: 0.5, upper: 6}, intervals: 4}
goal:
  configuration: {x: 1.5}
  tolerance: {configuration: {x: 0}, velocity: {x: 0}}
costs: {configuration: {}, velocity: {}, control: {}, terminal_configuration: {}, terminal_velocity: {}, time: 2}
"""

PERIODIC = """\
horizon: {duration: 2, intervals: 4}
initial: {configuration: {x: 0.2}, velocity: {x: 0.1}}
goal:
  periodic: {stride: {x: 1.5}}
costs: {configuration: {}, velocity: {}, control: {x: 1}}
"""


def missed(motion: MotionProblem, physical: object) -> dict[str, float]:
    ends = motion.endpoints
    found = requirements(
        motion.task,
        motion.robot,
        numeric_physics(motion),
        physical,  # type: ignore[arg-type]
        (ends.initial_configuration, ends.initial_velocity),
        (ends.goal_configuration, ends.goal_velocity),
    )
    return {name: one.value for name, one in found.items()}


def test_the_shortest_time_is_bang_bang(tmp_path: Path) -> None:
    """From rest to rest over d the shortest time is 2 sqrt(d m / F): full push, then full brake, in equal intervals."""
    motion, transcription, solution, physical = solved(cart(tmp_path, TIME_OPTIMAL))
    shortest = 2 * np.sqrt(1.5 * MASS / FORCE)
    assert solution.solved
    np.testing.assert_allclose(physical.clock, shortest * np.arange(1, 5) / 4, rtol=1e-6)
    np.testing.assert_allclose(transcription.controls(solution.w)[0], [3, 3, -3, -3], rtol=1e-5)
    assert transcription.cost_terms(solution.w)["time"] == pytest.approx(2 * shortest, rel=1e-6)
    assert motion.grid.duration(physical.clock) == pytest.approx(shortest, rel=1e-6)
    assert max(missed(motion, physical).values()) <= 1e-6


def test_a_duration_has_bounds(tmp_path: Path) -> None:
    """Where less force is worth more time the longest duration is taken, and its bound holds."""
    text = TIME_OPTIMAL.replace("upper: 6", "upper: 3").replace("control: {}", "control: {x: 1}").replace("2}", "0}")
    _, _, solution, physical = solved(cart(tmp_path, text))
    assert solution.solved and physical.clock[-1] == pytest.approx(3, abs=1e-7)


def test_a_periodic_motion_chooses_its_start(tmp_path: Path) -> None:
    """Without friction a periodic motion costs nothing: it rolls with stride / T, its start where the stride begins."""
    motion, transcription, solution, physical = solved(cart(tmp_path, PERIODIC))
    assert solution.solved and solution.residuals.objective < 1e-12
    np.testing.assert_allclose(physical.velocity[:, 0], 1.5 / 2, atol=1e-6)
    assert physical.configuration[[0, -1], 0] == pytest.approx([0.2, 1.7], abs=1e-7)
    assert "terminal configuration" not in transcription.cost_terms(solution.w)
    assert max(missed(motion, physical).values()) <= 1e-6


def test_a_period_has_rows_of_its_own(tmp_path: Path) -> None:
    """End minus start is the stride, and the integrated gap of a free start is the true gap."""
    ocp = formulate(cart(tmp_path, PERIODIC)).ocp
    period = ocp.constraints[-1]
    from casadi import Function

    rows = Function("rows", [period.variables], [period.rows])
    start, end = np.array([0.3, 0.4, 0, 0.9]), np.array([2.0, 0.5, 2, 0.8])
    np.testing.assert_allclose(np.asarray(rows(np.append(start, end))).ravel(), [0.2, 0.1, -0.1], atol=1e-12)
    np.testing.assert_array_equal(period.upper, [0, 0, 1e-6])
    np.testing.assert_array_equal(period.lower, [0, 0, -1e-6])
    np.testing.assert_array_equal(ocp.initial_lower, [0.2, -20, 0, 0])
    np.testing.assert_array_equal(ocp.initial_upper, [0.2, 20, 0, np.inf])


def test_waypoints_obstacles_and_smoothness_are_met(tmp_path: Path) -> None:
    """Waypoints by coordinate and by frame, and a bound of a frame, hold at the stages of the motion that is returned.

    Between stages, where an unrefined motion has no rows, it passes the wall by less than 1 mm, which is measured.
    """
    text = """\
horizon: {duration: 4, intervals: 6}
goal: {frames: {cart: {position: {x: 0.5}, velocity: {x: 0}, tolerance: 1e-3, velocity_tolerance: 0}}}
waypoints:
  - {configuration: {x: 0.6}, tolerance: {configuration: {x: 0}}}
  - {center_of_mass: {position: {x: 0.9}, tolerance: 0.01}, velocity: {x: 0}}
reference: {type: waypoints}
constraints:
  wall: {type: frame_limits, frame: cart, x: [null, 0.91]}
costs: {control_change: {x: 0.1}, acceleration: {x: 0.01}}
"""
    motion, _, solution, physical = solved(cart(tmp_path, text))
    assert solution.solved
    assert physical.configuration[:, 0].max() <= 0.91 + 1e-7
    found = missed(motion, physical)
    beyond = physical.states.configuration[:, 0].max() - 0.91
    assert found.pop("max_constraint_violation") == pytest.approx(beyond, abs=1e-9) and 1e-6 < beyond < 1e-3
    assert found == pytest.approx(dict.fromkeys(found, 0.0), abs=1e-6)


def test_a_forbidden_zone_is_crossed_without_force(tmp_path: Path) -> None:
    """A puck that slides from 0 to 1 m rests on the ground with its weight outside the zone and not at all inside."""
    text = """\
horizon: {duration: 1, intervals: 6}
goal: {configuration: {x: 1}}
costs: {control: {x: 0.01, z: 0.01}, configuration: {x: 1, z: 1}}
constraints:
  ditch: {type: forbidden_zone, contact: foot, x: [0.3, 0.7]}
"""
    motion, _, solution, physical = solved(puck(tmp_path, text))
    assert solution.solved
    x, force = physical.configuration[:, 0], physical.force[:, 0, 0]
    inside = (x > 0.3 + 1e-5) & (x < 0.7 - 1e-5)
    assert 4 <= inside.sum() < len(x) / 2
    np.testing.assert_allclose(force[inside], 0, atol=1e-3)
    np.testing.assert_allclose(force[(x < 0.3 - 1e-5) | (x > 0.71)], 9.81, atol=1e-3)
    assert missed(motion, physical)["max_constraint_violation"] == 0


def test_contact_windows_are_kept(tmp_path: Path) -> None:
    """A puck that need not leave the ground does so while touching is forbidden, and is back when it is required."""
    text = """\
horizon: {duration: 1, intervals: 5}
costs: {control: {x: 0.01, z: 0.01}, configuration: {x: 1, z: 1}}
constraints:
  up: {type: contact_window, contact: foot, times: [0.4, 0.6], touch: forbidden, clearance: 0.05}
  down: {type: contact_window, contact: foot, times: [0.8, 1], touch: required}
"""
    motion, _, solution, physical = solved(puck(tmp_path, text))
    assert solution.solved
    z, time = physical.configuration[:, 1], physical.time
    assert z[(time > 0.4 + 1e-6) & (time < 0.6 + 1e-6)].min() == pytest.approx(0.05, abs=1e-6)
    assert z[time > 0.8 - 1e-6].max() <= 1e-3 + 1e-6
    assert missed(motion, physical)["max_constraint_violation"] <= 1e-6


ERRORS = [
    (TIME_OPTIMAL.replace("0.5, upper: 6", "0.01, upper: 60"), "horizon.duration", "a ratio of 6000"),
    (PERIODIC.replace("stride: {x: 1.5}", "stride: {x: 15}"), "goal.periodic.stride.x", "from 0.2 to 15.2"),
]


@pytest.mark.parametrize(("text", "key", "fragment"), ERRORS, ids=[error[1] for error in ERRORS])
def test_what_a_horizon_or_stride_cannot_be(tmp_path: Path, text: str, key: str, fragment: str) -> None:
    """Bounds of time that its speed cannot reach, and a stride out of the limits, are errors at their line."""
    with pytest.raises(TaskError) as caught:
        formulate(cart(tmp_path, text))
    assert caught.value.key == key and fragment in caught.value.message, caught.value
