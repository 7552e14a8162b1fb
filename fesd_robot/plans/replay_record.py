"""The replay of a plan, as the plan records it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.plans.measured import Measured, Names, largest
from fesd_robot.plans.record import Record
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.replay import IntervalReplay, MotionReplay


class ReplayError(Record):
    """Errors of one coordinate at the ends of the control intervals.

    Attributes:
        median, largest: over all intervals, m, rad, m/s or rad/s.
        interval, time: where it is largest: the number of the interval, and the time of its end, s.
    """

    median: float
    largest: float
    interval: int
    time: float


class ReplaySummary(Record):
    """How far rigid bodies with Coulomb friction come from the plan within single control intervals.

    Attributes:
        position: name of a velocity coordinate -> errors of its displacement, m or rad.
        velocity: the same of the velocity, m/s or rad/s, also directly after impacts.
        event_difference: largest difference in time of a touchdown, takeoff or change between stick and slip, s.
        unmatched_events: those that only the plan or only its replay has.
        gap_drift: largest gap of a contact that was closed, which was left out of account, m.
        velocity_drift: largest normal velocity of such a contact, m/s.
        notes: what was not as it should be -> numbers of the intervals.
    """

    position: dict[str, ReplayError]
    velocity: dict[str, ReplayError]
    event_difference: float
    unmatched_events: int
    gap_drift: float
    velocity_drift: float
    notes: dict[str, list[int]]


def replay_summary(replay: MotionReplay, velocity_names: Sequence[str]) -> ReplaySummary:
    """Return the summary of a replay by the names of the robot's velocity coordinates, (n_v)."""
    intervals = replay.intervals
    notes: dict[str, list[int]] = {}
    for interval in intervals:
        for note in sorted(interval.notes):
            notes.setdefault(note.value, []).append(interval.interval)

    def errors(values: np.ndarray) -> dict[str, ReplayError]:
        worst = values.argmax(axis=0)
        return {
            name: ReplayError(
                median=float(np.median(values[:, i])),
                largest=float(values[k, i]),
                interval=intervals[k].interval,
                time=intervals[k].end,
            )
            for i, (name, k) in enumerate(zip(velocity_names, worst, strict=True))
        }

    return ReplaySummary(
        position=errors(replay.position_errors),
        velocity=errors(replay.velocity_errors),
        event_difference=max(interval.event_difference for interval in intervals),
        unmatched_events=sum(interval.unmatched for interval in intervals),
        gap_drift=max(interval.drift.gap for interval in intervals),
        velocity_drift=max(interval.drift.velocity for interval in intervals),
        notes=notes,
    )


def replay_entries(replay: MotionReplay, motion: PhysicalMotion, names: Names) -> dict[str, Measured]:
    """Return the audit's entries of a replay, each with its place and both numbers.

    Args:
        motion: that was replayed.
        names: of its coordinates.
    """
    turns = [unit == "rad/s" for unit in names.velocity.values()]
    positions = [_positions(one, motion, names) for one in replay.intervals]
    velocities = [_velocities(one, motion, names) for one in replay.intervals]

    def worst(intervals: list[list[Measured]], turning: bool) -> Measured:
        return largest(one for each in intervals for one, turn in zip(each, turns, strict=True) if turn == turning)

    return {
        "max_replay_position_error": worst(positions, False),
        "max_replay_angle_error": worst(positions, True),
        "max_replay_velocity_error": worst(velocities, False),
        "max_replay_angular_velocity_error": worst(velocities, True),
    }


def _positions(one: IntervalReplay, motion: PhysicalMotion, names: Names) -> list[Measured]:
    """Return the error of every coordinate at the end of an interval, with both numbers where it has a name in q."""
    planned = dict(zip(names.configuration, motion.configuration[one.last], strict=True))
    return [
        Measured(
            float(abs(error)),
            one.end,
            one.interval,
            name,
            detail=_both(planned[name], planned[name] - error, names.configuration[name]) if name in planned else "",
        )
        for name, error in zip(names.velocity, one.position_error, strict=True)
    ]


def _velocities(one: IntervalReplay, motion: PhysicalMotion, names: Names) -> list[Measured]:
    """Return the error of every velocity, at the end of an interval or after the impact at its start."""
    found = []
    for i, (name, unit) in enumerate(names.velocity.items()):
        errors = one.velocity_error[i], one.impact_error[i]
        early = int(np.argmax(np.abs(errors)))  # finds the first NaN
        sample, error = (one.first if early else one.last), errors[early]
        planned = float(motion.velocity[sample, i])
        words = _both(planned, planned - error, unit)
        found.append(Measured(float(abs(error)), one.start if early else one.end, one.interval, name, detail=words))
    return found


def _both(planned: float, replayed: float, unit: str) -> str:
    return f"{planned:.5g} {unit} in the plan, {replayed:.5g} {unit} in its replay"
