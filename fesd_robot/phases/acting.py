"""Sets of controls of which one acts at a time: which of them a guess shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fesd_robot.ocp import MotionProblem
from fesd_robot.phases.sequence import Phase, Sequence, joined


def set_name(group: str, name: str) -> str:
    """Return the name of a set of controls, as the subject of its condition."""
    return f"{group} {name}"


def groups_of(motion: MotionProblem) -> list[list[str]]:
    """Return the names of the sets of every group of controls of which one acts at a time."""
    groups = motion.dynamics.one_at_a_time
    return [[set_name(group, name) for name in sets] for group, sets in groups.items()]


def acting_along(motion: MotionProblem, state: Callable[[float], np.ndarray], time: float) -> tuple[str, ...]:
    """Return the set of every group that would do most work along a guess at a time.

    That is the one with the fastest point of action: the largest ``b_c . v`` of its controls c, whose generalized
    forces are b_c per unit.

    Args:
        motion: the formulated task.
        state: time, s -> state of the guess, of which configuration and velocity are taken.
        time: s.
    """
    n_q, n_v = len(motion.robot.configuration_names), len(motion.robot.velocity_names)
    x, names = state(time), list(motion.dynamics.control_names)
    speeds = x[n_q : n_q + n_v] @ motion.actuation.numeric(x[:n_q])
    return tuple(
        set_name(group, max(sets, key=lambda one: max(speeds[names.index(control)] for control in sets[one])))
        for group, sets in motion.dynamics.one_at_a_time.items()
    )


def with_acting(motion: MotionProblem, state: Callable[[float], np.ndarray], sequence: Sequence) -> Sequence:
    """Return a sequence in whose phases a set of every group acts: those that say none get that of the guess.

    Args:
        motion, state: as in `acting_along`.
        sequence: with durations.
    """
    if not motion.dynamics.one_at_a_time:
        return sequence
    phases, end = list[Phase](), 0.0
    for phase in sequence.phases:
        begin, end = end, end + phase.duration
        acting = phase.acting or acting_along(motion, state, (begin + end) / 2)
        phases.append(replace(phase, acting=acting))
    return replace(sequence, phases=joined(phases))


def each_alone(motion: MotionProblem, sequence: Sequence) -> list[Sequence]:
    """Return the sequences in which one set of a group acts all the time."""
    found = []
    for sets in groups_of(motion):
        for one in sets:
            phases = (
                replace(phase, acting=tuple(one if other in sets else other for other in phase.acting))
                for phase in sequence.phases
            )
            found.append(replace(sequence, phases=joined(phases)))
    return found
