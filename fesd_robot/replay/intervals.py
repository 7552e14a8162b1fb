"""A planned motion driven again, interval by interval, from its own states."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.instants import SAME_TIME
from fesd_robot.recovery import NumericPhysics, PhysicalMotion, SwitchRecord
from fesd_robot.replay.contacts import CLOSED_GAP, Drift, ReplayNote
from fesd_robot.replay.impact_orders import impacts_in_turn
from fesd_robot.replay.impacts import impact
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.running import check_time

NEARBY = 0.25
"""Part of a control interval within which an event at the end of an interval is looked for."""

LAWFUL = 1e-3
"""Error of a velocity after an impact up to which its contacts hit together: part of the largest change of one by the
impact, and at least of 1 m/s or rad/s. The orders of four feet take half a minute to work out."""

NEARER = 0.1
"""How much nearer to the plan than that of all contacts together an impact in turn is that is taken for it."""


@dataclass(frozen=True)
class IntervalReplay:
    """One control interval driven again.

    Attributes:
        interval: its number.
        start, end: s.
        first, last: the plan's samples that it starts from and that its end is compared with.
        position_error: planned minus replayed configuration at the end, in the tangent space, m and rad, (n_v).
        velocity_error: the same of the velocity, m/s and rad/s, (n_v).
        impact_error: velocity after an impact at the start, planned minus that of `impact`, (n_v); zeros without one.
        event_difference: largest difference in time of a change of mode, of a contact or a joint with dry friction, in
            the replay and the same one in the plan, s.
        unmatched: changes of mode that only one of the two has.
        drift: what was taken out at the start.
        notes: what is not as it should be.
    """

    interval: int
    start: float
    end: float
    first: int
    last: int
    position_error: np.ndarray
    velocity_error: np.ndarray
    impact_error: np.ndarray
    event_difference: float
    unmatched: int
    drift: Drift
    notes: frozenset[ReplayNote]


@dataclass(frozen=True)
class MotionReplay:
    """All control intervals driven again."""

    intervals: tuple[IntervalReplay, ...]

    @property
    def position_errors(self) -> np.ndarray:
        """Absolute errors of the configuration at the end of every interval, m and rad, (N, n_v)."""
        return np.abs([interval.position_error for interval in self.intervals])

    @property
    def velocity_errors(self) -> np.ndarray:
        """Absolute errors of the velocity, at the end of every interval or after an impact, m/s and rad/s, (N, n_v)."""
        return np.abs([[i.velocity_error, i.impact_error] for i in self.intervals]).max(axis=1)

    @cached_property
    def without_impacts(self) -> MotionReplay:
        """The replay without the errors of impacts, in which no time passes: no error of an element grows there."""
        nothing = [np.zeros_like(interval.impact_error) for interval in self.intervals]
        return MotionReplay(
            tuple(replace(one, impact_error=zero) for one, zero in zip(self.intervals, nothing, strict=True))
        )


def replay_intervals(
    motion: PhysicalMotion, physics: NumericPhysics, among: Collection[int] | None = None
) -> MotionReplay:
    """Return every control interval of a motion driven again from its own state at the interval's beginning.

    An interval begins after an impact at its left end, which is compared by itself; where contacts hit at the same
    instant, with the nearest of the orders in which they may do so. Where an impact falls on its right end, the nearer
    of the states before and after counts. A foot that the motion says is in the air is released however
    near the ground it is; if it has to stay, it falls back at once.

    Args:
        motion: in physical time, with controls that are constant on every interval.
        physics: of its robot and contacts.
        among: numbers of the intervals to drive, all if omitted.

    Raises:
        OutOfTime: the time limit comes meanwhile.
    """
    starts = np.flatnonzero(np.append(True, np.diff(motion.interval) > 0))
    ends = np.append(starts[1:] - 1, len(motion.time) - 1)
    return MotionReplay(
        tuple(
            _interval(motion, physics, max(int(first) - 1, 0), int(last))
            for first, last in zip(starts, ends, strict=True)
            if among is None or int(motion.interval[last]) in among
        )
    )


def _interval(motion: PhysicalMotion, physics: NumericPhysics, start: int, end: int) -> IntervalReplay:
    check_time()
    impact_error, in_turn = np.zeros(motion.velocity.shape[1]), False
    for hit in motion.impacts:
        if hit.before == start and motion.time[hit.after] - motion.time[start] < SAME_TIME:
            (impact_error, in_turn), start = _impact_error(motion, physics, hit.before, hit.after), hit.after
    begin, finish = float(motion.time[start]), float(motion.time[end])
    control = motion.control[end]
    q, v, flying = (
        motion.configuration[start],
        motion.velocity[start],
        motion.mode[min(start + 1, end)] == ContactMode.FLIGHT,
    )
    result = replay_motion(physics, q, v, control, finish - begin, begin, flying)
    sides = [end]
    for hit in motion.impacts:
        sides += [hit.after] if hit.before == end else [hit.before] if hit.after == end else []
    ends = [(side, motion.velocity[side] - v) for side in sides for v in (result.velocity, result.arriving)]
    last, velocity_error = min(ends, key=lambda one: _size(one[1]))
    of_joints = motion.joints.switches if motion.joints else []
    of_compliant = motion.compliance.switches if motion.compliance else []
    planned, planned_joints, planned_compliant = (
        tuple(s for s in switches if begin - SAME_TIME < s.time < finish + SAME_TIME)
        for switches in (motion.switches, of_joints, of_compliant)
    )
    difference, unmatched = compare_events(result.events, planned, (begin, finish))
    joint_difference, unmatched_joints = compare_events(result.joint_events, planned_joints, (begin, finish))
    late, unmatched_compliant = compare_events(result.compliant_events, planned_compliant, (begin, finish))
    return IntervalReplay(
        interval=int(motion.interval[end]),
        start=begin,
        end=finish,
        first=start,
        last=last,
        position_error=physics.difference(result.configuration, motion.configuration[end]),
        velocity_error=velocity_error,
        impact_error=impact_error,
        event_difference=max(difference, joint_difference, late),
        unmatched=unmatched + unmatched_joints + unmatched_compliant,
        drift=result.drift,
        notes=result.notes | ({ReplayNote.IN_TURN} if in_turn else set()),
    )


def _impact_error(motion: PhysicalMotion, physics: NumericPhysics, before: int, after: int) -> tuple[np.ndarray, bool]:
    """Return the velocity after an impact, planned minus that of the law, (n_v), and whether its contacts hit in turn.

    They do where that is `NEARER` to the plan than all of them together, which comes first; the first order that is as
    good as the plan is taken.
    """
    q, v = motion.configuration[before], motion.velocity[before]
    touching = physics.gaps(q) <= CLOSED_GAP
    together = motion.velocity[after] - impact(physics, q, v, touching).velocity
    lawful = LAWFUL * max(1.0, _size(motion.velocity[after] - v))
    if _size(together) <= lawful or physics.impacts_at_once:
        return together, False
    nearest = together
    for other in impacts_in_turn(physics, q, v, touching):
        nearest = min(nearest, motion.velocity[after] - other, key=_size)
        if _size(nearest) <= lawful:
            break
    return (nearest, True) if _size(nearest) < NEARER * _size(together) else (together, False)


def _size(error: np.ndarray) -> float:
    size = float(np.abs(error).max(initial=0.0))
    return np.inf if np.isnan(size) else size


def compare_events(
    replayed: Sequence[SwitchRecord], planned: Sequence[SwitchRecord], span: tuple[float, float]
) -> tuple[float, int]:
    """Return the largest difference in time of equal events, s, and how many have no equal.

    The first touchdown of a contact is compared with its first in the plan, and so on. An event of the plan at the very
    ends of the span may belong to a neighbouring interval: it counts only where the replay has it nearby, within
    `NEARBY` of the span.

    Args:
        replayed, planned: in time order.
        span: begin and end of the interval, s.
    """
    largest, unmatched = 0.0, 0
    for key in dict.fromkeys((event.contact, event.kind) for event in [*replayed, *planned]):
        ours, theirs = ([e.time for e in events if (e.contact, e.kind) == key] for events in (replayed, planned))
        near = NEARBY * (span[1] - span[0])
        theirs = [
            time
            for time in theirs
            if min(time - span[0], span[1] - time) > SAME_TIME or any(abs(time - own) < near for own in ours)
        ]
        largest = max([largest, *(abs(a - b) for a, b in zip(ours, theirs, strict=False))])
        unmatched += abs(len(ours) - len(theirs))
    return largest, unmatched
