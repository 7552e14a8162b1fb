"""Where the solve of a sequence begins: along another motion, by the clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fesd_robot.fesd import Element, Transcription, at_stages
from fesd_robot.fesd.neighbours import CLOCK, KnownTrajectory
from fesd_robot.ocp import MotionProblem
from fesd_robot.phases.discretised import Discretised

STANDSTILL = 0.01
"""Numerical time of an impact that the other motion does not have."""

NEAR_OF_INTERVAL = 0.2
"""Of an interval: how far away an impact of the other motion may be that an impact begins as."""


States = Callable[[float], np.ndarray]
"""Time, s -> state, (n_x)."""


def start_with(new: Discretised, state: States) -> np.ndarray:
    """Return the start of a sequence from another guess than the task's, (n).

    Args:
        new: the sequence on its grid.
        state: the other guess.
    """
    transcription = new.transcription
    own = replace(transcription.ocp, state_guess=state)
    return Transcription(own, transcription.options, given_grid=transcription.grid).problem.start


def resting(motion: MotionProblem) -> States:
    """Return the guess in which everything rests where the guess of a task begins."""
    first = len(motion.robot.configuration_names)
    guess, clock = motion.ocp.state_guess, list(motion.ocp.system.state_names).index(CLOCK)

    def state(time: float) -> np.ndarray:
        x = np.array(guess(0.0))
        x[first : first + len(motion.robot.velocity_names)] = 0.0
        x[clock] = guess(time)[clock]
        return x

    return state


def start_along(known: KnownTrajectory, new: Discretised) -> np.ndarray:
    """Return the start of a sequence along another motion of the same system, (n)."""
    transcription, tableau = new.transcription, new.transcription.options.tableau
    old = known.tableau
    grid, clock = transcription.grid, known.clock
    fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
    nothing = np.zeros((tableau.stages, transcription.ocp.system.state.numel()))
    stretch = grid.nodes[-1] / known.duration
    hits, jump = list(known.frozen), transcription.ocp.system.jump
    elements: list[Element] = []
    start = 0.0
    for k, count in enumerate(transcription.elements):
        begin, length = float(grid.nodes[k]) / stretch, grid.lengths[k] / stretch
        middle, _ = known.at(begin + 0.5 * length)
        x_left = elements[-1].x[-1] if elements else known.whole[0].x_before
        z_left = elements[-1].z[-1] if elements else known.whole[0].z_left
        last = len(new.sequence.at_end) if k == grid.intervals - 1 and jump is None else 0
        for n in range(count):
            part = n - (count - last - new.parts)
            if 0 <= part < new.parts:
                inside = [known.at(begin + (part + share) / new.parts * length) for share in fractions]
                x = np.vstack([element.at(old, np.array([at])) for element, at in inside])
                x[:, clock] *= stretch
                z = np.vstack([at_stages(element, element.z, at, old) for element, at in inside])
                rate = (middle.x[-1, clock] - middle.x_left[clock]) / middle.step
                step = length * stretch / rate / new.parts
            else:
                at = begin + (length if n >= count - last else 0.0)
                near = [e for e in hits if abs(e.x_left[clock] - at) <= NEAR_OF_INTERVAL * length]
                if near:
                    hits.remove(near[0])
                    x, z, step = _impact(known, near[0], fractions)
                    x[:, clock] *= stretch
                else:
                    x, z = np.tile(x_left, (len(fractions), 1)), np.tile(z_left, (len(fractions), 1))
                    step = STANDSTILL
            elements.append(Element(k, start, step, x_left, z_left, x, z, middle.u, nothing))
            start, x_left, z_left = start + step, x[-1], z[-1]
    return transcription.pack(_with_jumps(elements, transcription))


def _impact(known: KnownTrajectory, one: Element, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return states, algebraic variables and numerical time of an impact of the motion, at fractions of it."""
    if len(one.x) == len(fractions):
        return one.x.copy(), one.z, one.step
    times, tableau = one.start + one.step * fractions, known.tableau
    return one.at(tableau, times), np.vstack([at_stages(one, one.z, at, tableau) for at in times]), one.step


def _with_jumps(elements: list[Element], transcription: Transcription) -> list[Element]:
    """Return the elements with jumps that change nothing, for a system whose state may jump."""
    jump = transcription.ocp.system.jump
    if jump is None:
        return elements
    still = [
        np.concatenate([element.x_left[list(jump.states)], np.zeros(jump.size - len(jump.states))])
        for element in elements
    ]
    return [
        Element(e.interval, e.start, e.step, e.x_left, e.z_left, e.x, e.z, e.u, e.slopes, y, e.x_left)
        for e, y in zip(elements, still, strict=True)
    ]
