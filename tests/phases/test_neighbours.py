"""Neighbours of sequences, and the search over them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.phases import PhaseMotion, PhaseSolver, SequenceSearch, guessed_sequences
from fesd_robot.phases.gait import gait_images
from fesd_robot.phases.neighbours import neighbours
from fesd_robot.phases.profile import ContactProfile
from fesd_robot.running import Cores, SearchEffort

from .sequences import sequence, solver_of


def motion_of(task: str, words: str, *durations: float) -> tuple[PhaseSolver, PhaseMotion]:
    solver = solver_of(task)
    own = sequence(words, *durations)
    found = solver.from_guess(replace(own, names=tuple(contact.name for contact in solver.motion.contacts)))
    assert found is not None
    return solver, found


@pytest.fixture(scope="module")
def soft() -> tuple[PhaseSolver, PhaseMotion]:
    """The hopper's jump that comes down softly."""
    return motion_of("hopper_one_jump", "S F S", 0.25, 0.5, 0.25)


def with_effort(solver: PhaseSolver, effort: SearchEffort) -> PhaseSolver:
    """The same solver, with other effort."""
    return replace(solver, run=replace(solver.run, effort=effort))


def found_near(solver: PhaseSolver, motion: PhaseMotion) -> list[str]:
    profile = ContactProfile.of(solver.motion, motion.along)
    near = neighbours(motion.sequence, list(solver.motion.contacts), profile, solver.motion.ocp.knots)
    return [str(one.sequence) for one in near]


def test_every_neighbour_does_one_thing_else(soft: tuple[PhaseSolver, PhaseMotion]) -> None:
    """A foot that lands softly may hit, lift off first, touch in the air, or leave out what it does; durations stay."""
    solver, motion = soft
    found = found_near(solver, motion)
    assert {"S F !S", "F S F S", "S F S F S", "F S", "S F"} <= set(found)
    profile = ContactProfile.of(solver.motion, motion.along)
    for one in neighbours(motion.sequence, list(solver.motion.contacts), profile):
        assert one.sequence.durations.sum() == pytest.approx(1.0) and one.sequence.durations.min() > 0
        assert one.sequence.key != motion.sequence.key


def test_a_gait_may_hit_where_it_ends() -> None:
    """A step that hits as its mirror image begins is a motion, and a neighbour of the one that comes down softly."""
    solver = solver_of("biped_walk")
    images, contacts = gait_images(solver.motion), list(solver.motion.contacts)
    assert images == (1, 0)
    hits = next(one for one in guessed_sequences(solver.motion) if str(one) == "SF!")
    step = solver.from_guess(hits)
    assert step is not None and str(step.sequence) == "SF!"
    assert step.own.impact_steps(step.w)[-1][0] > 0.0
    profile = ContactProfile.of(solver.motion, step.along)
    near = [one.sequence for one in neighbours(step.sequence, contacts, profile, (), images)]
    soft = {str(one) for one in near if not one.at_end}
    assert "SF" in soft and all(one == "SF" or one.startswith("FF") for one in soft)  # nothing lands where all fly
    softly = replace(step.sequence, at_end=())
    hit = [one.sequence for one in neighbours(softly, contacts, profile, (), images) if one.sequence.at_end]
    assert step.sequence.key in [one.key for one in hit]
    assert not any(one.sequence.at_end for one in neighbours(softly, contacts, profile))


def test_what_is_put_into_a_phase_is_put_where_it_is_easy() -> None:
    """The block that slides all along stands still between its slide and its push: there it may stick."""
    solver, motion = motion_of("block_push", "++", 1.5)
    profile = ContactProfile.of(solver.motion, motion.along)
    begin, end = profile.slow([0, 1], 0.0, 1.5)
    assert 0.2 < begin < end < 0.55
    sticking = [
        one.sequence
        for one in neighbours(motion.sequence, list(solver.motion.contacts), profile, (0.5,))
        if str(one.sequence) == "++ SS ++"
    ]
    assert any(one.ends[0] < 0.35 and one.ends[1] < 0.6 for one in sticking)


def test_a_switch_crosses_a_knot() -> None:
    """The end of a phase just behind the waypoint of the block may be before it."""
    solver, motion = motion_of("block_push", "++ SS ++", 0.26, 0.24, 1.0)
    plain = motion.sequence.without_knots
    moved = plain.with_durations(plain.durations + np.array([0, 0.05, -0.05]))
    profile = ContactProfile.of(solver.motion, motion.along)
    near = [one for one in neighbours(moved, list(solver.motion.contacts), profile, (0.5,)) if "0.5 s" in one.what]
    assert near and all(one.sequence.key == moved.key for one in near)
    assert any(one.sequence.ends[1] < 0.5 for one in near)


def test_a_search_finds_what_costs_less(soft: tuple[PhaseSolver, PhaseMotion]) -> None:
    """From the soft landing the search finds impacts; what it kept fell in cost, and what it tried is told."""
    solver, motion = soft
    shown: list[float] = []
    search = SequenceSearch(solver, Cores(1), lambda done, of: None, lambda one: shown.append(one.cost))
    search.note("given", motion.sequence, motion)
    search.improve()
    assert search.cost < 0.9 * motion.cost and shown == sorted(shown, reverse=True)
    kept = [one for one in search.tried if one.kept]
    assert [one.cost for one in kept] == shown and "!" in kept[-1].sequence
    assert all(one.cost == math.inf or one.cost >= search.cost for one in search.tried)


def test_a_search_ends_with_its_work(soft: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Where the effort allows no work the first neighbour is the last, and without starts there is none at all."""
    for effort, most in ((SearchEffort(most_work=0.0), 1), (SearchEffort(search_starts=0), 0)):
        search = SequenceSearch(with_effort(soft[0], effort), Cores(1), lambda done, of: None, lambda one: None)
        search.note("given", soft[1].sequence, soft[1])
        search.improve()
        assert len(search.tried) == 1 + most


def test_a_patient_search_goes_from_several_motions(soft: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Beside a motion from which nothing is found it goes from one that is dearer, too, and ends no higher."""
    solver, dearer = with_effort(soft[0], SearchEffort.of("best")), soft[1]
    search = SequenceSearch(solver, Cores(1), lambda done, of: None, lambda one: None)
    search.note("given", dearer.sequence, dearer)
    search.improve()
    cheapest, ends = search.best, list[tuple[float, int]]()
    assert cheapest is not None
    for starts in ([cheapest], [cheapest, dearer]):
        search = SequenceSearch(solver, Cores(1), lambda done, of: None, lambda one: None)
        for start in starts:
            search.note("given", start.sequence, start)
        search.improve()
        ends.append((search.cost, len(search.tried)))
    assert ends[1][0] <= ends[0][0] and ends[1][1] > ends[0][1] + 1


def test_the_result_does_not_depend_on_the_cores(soft: tuple[PhaseSolver, PhaseMotion]) -> None:
    """Two processes lead to the same sequence at the same cost as one."""
    solver, motion = soft
    ends = []
    for cores in (1, 2):
        search = SequenceSearch(solver, Cores(cores), lambda done, of: None, lambda one: None)
        search.note("given", motion.sequence, motion)
        search.improve()
        ends.append((str(search.best and search.best.sequence), round(search.cost, 6), search.iterations))
    assert ends[0] == ends[1]
