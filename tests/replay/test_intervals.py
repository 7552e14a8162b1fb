"""A motion compared with its replay, interval by interval."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.plans import Plan
from fesd_robot.recovery import ImpactRecord, PhysicalMotion, SwitchRecord
from fesd_robot.recovery.between import stacked_elements
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.replay.intervals import compare_events, replay_intervals
from fesd_robot.task import Task

from .bodies import GRAVITY, point

HEIGHT, SPEED, FRICTION, STEP = 0.2, 3.0, 0.4, 0.1
LANDING = math.sqrt(2 * HEIGHT / GRAVITY)


def exact(time: float, landed: bool) -> tuple[np.ndarray, np.ndarray]:
    """A point that falls while it moves along, lands, and slides on."""
    if not landed:
        return np.array([SPEED * time, HEIGHT - 0.5 * GRAVITY * time**2]), np.array([SPEED, -GRAVITY * time])
    kept, since = SPEED - FRICTION * GRAVITY * LANDING, time - LANDING
    x = SPEED * LANDING + kept * since - 0.5 * FRICTION * GRAVITY * since**2
    return np.array([x, 0.0]), np.array([kept - FRICTION * GRAVITY * since, 0.0])


def sliding_landing(step: float = STEP) -> PhysicalMotion:
    """The landing in four intervals of `step`, with the impact inside one of them or at the end of one."""
    rows = [(k * step, max(k - 1, 0), k * step > LANDING + 1e-9) for k in range(5)]
    number = int(LANDING / step - 1e-9)
    rows += [(LANDING, number, False)] if abs(number * step + step - LANDING) > 1e-9 else []
    rows += [(LANDING, number + (len(rows) == 5), True)]
    rows.sort(key=lambda row: (row[1], row[0], row[2]))
    states = [exact(time, landed) for time, _, landed in rows]
    after = next(i for i, row in enumerate(rows) if row[2])
    count = len(rows)
    impulse = np.array([[GRAVITY * LANDING, -FRICTION * GRAVITY * LANDING]])
    return PhysicalMotion(
        time=np.array([row[0] for row in rows]),
        configuration=np.array([q for q, _ in states]),
        velocity=np.array([v for _, v in states]),
        acceleration=np.full((count, 2), np.nan),
        weight=np.zeros(count),
        interval=np.array([row[1] for row in rows]),
        control=np.zeros((count, 2)),
        force=np.zeros((count, 1, 2)),
        gap_state=np.zeros((count, 0)),
        mode=np.array([[ContactMode.SLIP if row[2] else ContactMode.FLIGHT] for row in rows], dtype=object),
        impacts=[ImpactRecord(after - 1, after, impulse)],
        switches=[SwitchRecord(LANDING, 0, "touchdown")],
        clock=step * np.arange(1, 5),
        theta_sum_error=0.0,
        between=stacked_elements([], (2, 2, 2, 1)),
    )


@pytest.mark.parametrize("step", [STEP, LANDING / 2])
def test_a_true_motion_has_no_errors(step: float) -> None:
    """A landing in closed form is what the replay says, with the impact within an interval or at the end of one."""
    result = replay_intervals(sliding_landing(step), point(FRICTION))
    assert [interval.interval for interval in result.intervals] == [0, 1, 2, 3]
    assert result.position_errors.max() < 1e-9
    assert result.velocity_errors.max() < 1e-8
    assert max(interval.event_difference for interval in result.intervals) < 1e-9
    assert sum(interval.unmatched for interval in result.intervals) == 0


def test_a_wrong_state_shows_in_both_its_intervals() -> None:
    """A state in flight that is off by 1 mm and 0.1 m/s is an error of the interval before and the one after it."""
    motion = sliding_landing()
    motion.configuration[1, 0] += 1e-3
    motion.velocity[1, 0] += 0.1
    result = replay_intervals(motion, point(FRICTION))
    np.testing.assert_allclose(result.position_errors[0], [1e-3, 0], atol=1e-9)
    np.testing.assert_allclose(result.velocity_errors[0], [0.1, 0], atol=1e-9)
    assert result.position_errors[1, 0] > 1e-3
    assert result.velocity_errors[2:].max() < 1e-9


def test_a_wrong_impact_shows() -> None:
    """A velocity after an impact at the end of an interval that friction does not explain is an error."""
    motion = sliding_landing(LANDING / 2)
    (hit,) = motion.impacts
    motion.velocity[hit.after, 0] += 0.2
    result = replay_intervals(motion, point(FRICTION))
    np.testing.assert_allclose(result.intervals[2].impact_error, [0.2, 0], atol=1e-9)
    assert result.velocity_errors[2, 0] >= 0.2 - 1e-9


def test_events_are_compared_in_turn() -> None:
    """Equal events pair up in order; one inside the interval without an equal counts, one at its edge does not."""
    ours = [SwitchRecord(0.12, 0, "touchdown"), SwitchRecord(0.15, 0, "slip_to_stick")]
    theirs = [SwitchRecord(0.10, 0, "touchdown"), SwitchRecord(0.17, 1, "touchdown")]
    assert compare_events(ours, [theirs[0], ours[1]], (0.1, 0.2)) == (pytest.approx(0.02), 0)
    assert compare_events(ours, theirs, (0.1, 0.2)) == (pytest.approx(0.02), 2)
    assert compare_events([], [theirs[0]], (0.1, 0.2)) == (0.0, 0)
    assert compare_events([], [theirs[0]], (0.0, 0.2)) == (0.0, 1)


def test_a_real_plan_has_no_larger_errors_than_its_scheme(short_plan: Plan, short_task: Task) -> None:
    """The leaning hopper's controls lead from the state at every interval's start to that at its end."""
    physics = numeric_physics(formulate(short_task))
    robot, trajectory = short_plan.units, short_plan.trajectory
    q = np.column_stack([trajectory.configuration[name] for name in robot.configuration])
    v = np.column_stack([trajectory.velocity[name] for name in robot.velocity])
    u = np.column_stack([short_plan.controls[name] for name in robot.controls])
    ends = [int(np.flatnonzero(np.isclose(trajectory.time, time, atol=1e-9))[-1]) for time in (0.0, 0.1, 0.2)]
    for k, (start, end) in enumerate(itertools.pairwise(ends)):
        result = replay_motion(physics, q[start], v[start], u[k], 0.1)
        np.testing.assert_allclose(result.configuration, q[end], atol=1e-3)
        np.testing.assert_allclose(result.velocity, v[end], atol=2e-2)
        assert not result.notes
