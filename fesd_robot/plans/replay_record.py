"""What a plan says about its replay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.plans.record import Record
from fesd_robot.replay.intervals import MotionReplay


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


def replay_entries(replay: MotionReplay, velocity_units: Sequence[str]) -> dict[str, float]:
    """Return the audit's entries of a replay.

    Args:
        velocity_units: ``m/s`` or ``rad/s`` of every velocity coordinate, (n_v).
    """
    turns = np.array([unit == "rad/s" for unit in velocity_units])
    position, velocity = replay.position_errors, replay.velocity_errors
    return {
        "max_replay_position_error": float(position[:, ~turns].max(initial=0.0)),
        "max_replay_angle_error": float(position[:, turns].max(initial=0.0)),
        "max_replay_velocity_error": float(velocity[:, ~turns].max(initial=0.0)),
        "max_replay_angular_velocity_error": float(velocity[:, turns].max(initial=0.0)),
    }
