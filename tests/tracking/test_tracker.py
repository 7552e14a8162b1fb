"""The tracker: the plan's own controls on the plan, and a reference that goes by landings."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.errors import OptionError
from fesd_robot.instants import SAME_EVENT
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan, TrackingGains
from fesd_robot.tracking import Tracker, feed_forward


def states_of(plan: Plan, gains: TrackingGains, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    at = plan.at(time)
    return tuple(
        np.column_stack([values[name] for name in names])
        for values, names in (
            (at.configuration, gains.configuration_names),
            (at.velocity, gains.velocity_names),
            (at.controls, gains.control_names),
        )
    )  # type: ignore[return-value]


def landing_of(gains: TrackingGains) -> float:
    """Return the time of the second landing, s."""
    return float(gains.segments[1].time[-1])


def test_on_the_plan_it_gives_the_controls_of_the_plan(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """A robot that moves as planned gets the plan's controls, to 1 % of their limits, as references are cut in 2 ms."""
    tracker = Tracker(jump, gains, hold=0.0, motion=motion)
    landings = [each.time[-1] for each in gains.segments[:-1]]
    switches = np.concatenate([jump.controls["time"], landings])
    time = np.linspace(*gains.span, 1500)
    time = time[np.abs(time[:, None] - switches).min(axis=1) > SAME_EVENT]
    q, v, u = states_of(jump, gains, time)
    modes = jump.at(time).contacts["foot"].mode
    for k, moment in enumerate(time):
        action = tracker.action(moment, q[k], v[k], [modes[k] is not ContactMode.FLIGHT])
        assert action == pytest.approx(u[k], abs=0.01 * gains.upper.max())


def test_a_late_landing_keeps_the_motion_before_it(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """Until the foot touches, the reference falls on at the speed of the impact; after the window it has landed."""
    tracker, landing = Tracker(jump, gains, motion=motion), landing_of(gains)
    tracker.reset(landing - 0.05)
    end = gains.segments[1]
    for late in (0.0, 0.01, 0.025):
        tracker.action(landing + late, end.configuration[-1], end.velocity[-1], [False])
        q, v = tracker.reference(landing + late)
        assert q == pytest.approx(end.configuration[-1] + late * end.velocity[-1])
        assert v == pytest.approx(end.velocity[-1])
    tracker.action(landing + 0.035, end.configuration[-1], end.velocity[-1], [False])
    assert tracker.landings == 2


def test_an_early_landing_begins_the_motion_after_it(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """A foot that touches 20 ms early is followed by the motion after the landing, backwards in time; 40 ms are not."""
    tracker, landing = Tracker(jump, gains, motion=motion), landing_of(gains)
    tracker.reset(landing - 0.06)
    after = gains.segments[2]
    tracker.action(landing - 0.04, after.configuration[0], after.velocity[0], {"foot": True})
    assert tracker.landings == 1
    tracker.action(landing - 0.02, after.configuration[0], after.velocity[0], {"foot": True})
    assert tracker.landings == 2
    q, v = tracker.reference(landing - 0.02)
    assert q == pytest.approx(after.configuration[0] - 0.02 * after.velocity[0])
    assert v == pytest.approx(after.velocity[0])


def test_landings_are_detected_by_gaps(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """Where nobody says what touches, a gap below 0.1 mm does."""
    landing, high = landing_of(gains), motion.robot.configuration_names.index("root_z")
    after = gains.segments[2]
    for height, landings in ((0.0, 2), (1e-3, 1)):
        tracker = Tracker(jump, gains, motion=motion)
        tracker.reset(landing - 0.01)
        q = after.configuration[0].copy()
        q[high] += height
        tracker.action(landing - 0.005, q, after.velocity[0])
        assert tracker.landings == landings


def test_controls_keep_their_limits(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """However far the robot is from its plan, no motor is asked for more than it has."""
    tracker = Tracker(jump, gains, motion=motion)
    far = gains.segments[0].configuration[0] + 5.0
    action = tracker.action(0.0, far, gains.segments[0].velocity[0], [False])
    assert np.all((gains.lower <= action) & (action <= gains.upper))
    assert np.any((action == gains.lower) | (action == gains.upper))


def test_a_held_control_is_the_mean_of_the_plan(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """Over a hold that spans a change of the controls, the feed-forward gives the plan's impulse."""
    landings = np.array([each.time[-1] for each in gains.segments[:-1]])
    starts, sizes = jump.controls["time"][1:], np.abs(np.diff(jump.controls["leg_force"]))
    apart = np.abs(starts[:, None] - landings).min(axis=1) > 5e-3
    change = float(starts[apart][np.argmax(sizes[apart])])
    forward = feed_forward(jump, motion=motion)
    tracker = Tracker(jump, forward, hold=4e-3, motion=motion)
    tracker.reset(change)
    time = change - 1e-3
    before, after = (jump.at(change, side).controls["leg_force"] for side in ("before", "after"))
    q, v, _ = states_of(jump, gains, np.array([time]))
    action = tracker.action(time, q[0], v[0], [True])
    assert action[forward.control_names.index("leg_force")] == pytest.approx(0.25 * before + 0.75 * after, abs=1e-9)


def test_wrong_calls_are_one_sentence(jump: Plan, gains: TrackingGains, motion: MotionProblem) -> None:
    """Wrong lengths, unknown contacts, and gains of another robot name what was found and what is expected."""
    tracker, start = Tracker(jump, gains, motion=motion), gains.segments[0]
    with pytest.raises(OptionError, match="found q of 3 and v of 4 entries, expected 4 and 4"):
        tracker.action(0.0, start.configuration[0][:3], start.velocity[0])
    near = gains.segments[0].time[-1]
    with pytest.raises(OptionError, match="found 'toe', expected names of foot"):
        tracker.action(near, start.configuration[0], start.velocity[0], {"toe": True})
    with pytest.raises(OptionError, match="found 2 values, expected one of foot each"):
        tracker.action(near, start.configuration[0], start.velocity[0], [True, True])
    with pytest.raises(OptionError, match="found the controls hip, expected those of the plan's robot"):
        Tracker(jump, gains.model_copy(update={"control_names": ["hip"]}), motion=motion)
