"""Motions on sequences: when contacts change is found, not given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.fesd.grid_rows import SHORTEST_PHASE
from fesd_robot.phases import PhaseMotion, PhaseSolver, Sequence

from .sequences import sequence, solver_of

SLIDE = ("waypoints=[]", "goal.configuration.root_x=0.127421", "robot.actuators.push.upper=1e-9")
"""The block without a push, whose slide ends after v^2 / (2 mu g) = 0.127421 m."""


def named(solver: PhaseSolver, own: Sequence) -> Sequence:
    """The sequence with the names of the task's contacts."""
    return replace(own, names=tuple(contact.name for contact in solver.motion.contacts))


@pytest.mark.parametrize("guess", [0.15, 0.4, 0.6])
def test_a_slide_ends_when_friction_has_stopped_it(guess: float) -> None:
    """From any guess the block that slides at 1 m/s stops after v / (mu g) = 0.25484 s: the closed form, to 1e-7."""
    solver = solver_of("block_push", *SLIDE)
    found = solver.from_guess(named(solver, sequence("++ SS", guess, 1.5 - guess)))
    assert found is not None and found.report.exact
    assert found.sequence.durations[0] == pytest.approx(1 / (0.4 * 9.81), abs=1e-7)


@pytest.fixture(scope="module")
def jump() -> tuple[PhaseSolver, PhaseMotion]:
    """The hopper's jump with an impact, from durations that are guessed badly."""
    solver = solver_of("hopper_one_jump")
    found = solver.from_guess(named(solver, sequence("S F !S", 0.3, 0.3, 0.4)))
    assert found is not None
    return solver, found


def test_a_motion_is_exact_and_its_durations_are_free(jump: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Products are zero to round-off, phases last in all as long as the task, intervals of a phase are equal."""
    _, found = jump
    assert found.report.exact and found.report.residuals.complementarity < 1e-11
    durations = found.sequence.durations
    assert durations.sum() == pytest.approx(1.0, abs=1e-9) and durations[1] > 0.4
    lengths = np.diff(found.own.clocks(found.w))
    for own, count in zip(found.own.nodes, found.own.counts, strict=False):
        assert np.ptp(lengths[own : own + count]) < 1e-9


def test_other_guesses_of_durations_lead_to_the_same_motion(jump: tuple[PhaseSolver, PhaseMotion]) -> None:
    """The optimum does not depend on where durations begin, but for how the intervals are shared out."""
    solver, found = jump
    other = solver.from_guess(named(solver, sequence("S F !S", 0.2, 0.6, 0.2)))
    assert other is not None and other.cost == pytest.approx(found.cost, rel=5e-3)
    assert other.sequence.durations == pytest.approx(found.sequence.durations, abs=5e-3)


def test_a_motion_begins_along_another_one(jump: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Begun at itself it is found again at once; below a cost that it does not reach there is none."""
    solver, found = jump
    before = len(solver.reports)
    again = solver.from_known(found.sequence, found.along)
    assert again is not None and again.cost == pytest.approx(found.cost, rel=1e-4)
    assert sum(one.iterations for one in solver.reports[before:]) < 60
    assert solver.from_motion(found.sequence, found.along, 0.5 * found.cost) is None


def test_a_neighbour_is_given_up_by_its_bound(jump: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Where its motion is to cost half of what it does, it ends in less than half of the iterations."""
    solver, found = jump
    stance, flight, last = found.sequence.durations
    other = named(solver, sequence("F S F !S", 0.05, stance - 0.05, flight, last))
    iterations = []
    for below in (np.inf, 0.5 * found.cost):
        before = len(solver.reports)
        motion = solver.from_motion(other, found.along, below)
        assert (motion is not None) == (below == np.inf)
        iterations.append(sum(one.iterations for one in solver.reports[before:]))
    assert iterations[1] < 0.5 * iterations[0]


def test_phases_that_vanish_are_left_out() -> None:
    """A second slide that pays nothing shrinks to nothing, and the block stops where friction stops it."""
    solver = solver_of("block_push", *SLIDE[:2])
    found = solver.from_guess(named(solver, sequence("++ SS ++ SS", 0.25, 0.4, 0.2, 0.65)))
    assert found is not None and str(found.sequence) == "++ SS"
    assert found.sequence.durations[0] == pytest.approx(1 / (0.4 * 9.81), abs=2 * SHORTEST_PHASE)


def test_the_last_digits_are_found_on_demand(jump: tuple[PhaseSolver, PhaseMotion]) -> None:
    """A settled motion costs no more than before, to a millionth, and is exact."""
    solver, found = jump
    settled = solver.settled(found)
    assert settled.report.exact and settled.cost <= found.cost * (1 + 1e-6)
