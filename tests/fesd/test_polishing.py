"""Polishing a transcription: the branch that is read off relaxed elements, and what the branch NLP makes of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import Element, FesdOptions, Transcription, initial_value_problem, make_tableau
from fesd_robot.fesd.polishing import BranchTranscription, conditions_of
from fesd_robot.fesd.polishing.reading import read_branch
from fesd_robot.mpcc import (
    BranchNlp,
    HomotopyOptions,
    MpccSolution,
    NlpReport,
    Run,
    solve,
)
from fesd_robot.nlp import NEAR, NlpNumbers, NlpPoint, NlpSettings, prepared
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import load_task

from .systems import leaving, relay, scalar

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"


def _polished(
    system: ComplementaritySystem, initial: list[float], duration: float, elements: int, **options: Any
) -> tuple[Transcription, MpccSolution]:
    tableau = make_tableau(options.pop("scheme", "radau_iia"), options.pop("stages", 2))
    transcription = Transcription(
        initial_value_problem(system, initial, duration), FesdOptions(tableau=tableau, elements=elements, **options)
    )
    polisher = BranchTranscription(transcription)
    return transcription, solve(transcription.problem, Run(HomotopyOptions(tolerance=1e-6)), polisher=polisher)


@pytest.mark.parametrize("form", ["stewart", "heaviside", "step"])
@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 2), ("gauss_legendre", 2), ("radau_iia", 1)])
def test_a_crossing_is_exact(form: str, scheme: str, stages: int) -> None:
    """x' = 2 - sign(x) from -1 switches at 1/3 and ends at 5/3 to round-off, though the homotopy stops at 1e-6."""
    system = scalar("crossing") if form == "step" else relay(form, 3, 1)
    transcription, solution = _polished(
        system, [-1.0] if form == "step" else [-1.0, 0.0], 2.0, 3, scheme=scheme, stages=stages
    )
    assert solution.solved and solution.exact
    assert solution.residuals.complementarity <= 1e-12
    elements = transcription.unpack(solution.w)
    assert elements[-1].x[-1][0] == pytest.approx(5 / 3, abs=1e-11)
    assert min(abs(element.end - 1 / 3) for element in elements) <= 1e-11


def test_a_sliding_mode_is_exact() -> None:
    """x' = t - sign(x) from -1/2 reaches 0 at sqrt 2 - 1 and stays there; where it leaves is seen at stages only."""
    transcription, solution = _polished(leaving(), [-0.5, 0.0], 2.0, 4, stages=3)
    assert solution.solved and solution.exact and solution.residuals.complementarity <= 1e-12
    elements = transcription.unpack(solution.w)
    assert min(abs(element.end - (np.sqrt(2) - 1)) for element in elements) <= 1e-11
    sliding = [element for element in elements if 0.42 < element.end <= 1]
    assert sliding and all(np.abs(element.x[:, 0]).max() <= 1e-12 for element in sliding)
    assert elements[-1].x[-1][0] == pytest.approx(0.5, abs=2e-3)


@pytest.fixture(scope="module")
def hopper() -> MotionProblem:
    short = ["horizon.duration=0.2", "horizon.intervals=2", "goal.configuration.root_x=0.12", "reference={type: line}"]
    return formulate(load_task(TASK, ["method.grid=uniform", *short]))


def test_conditions_of_a_contact(hopper: MotionProblem) -> None:
    """A foot with friction: the gap is an invariant, opposite velocities are one quantity, multipliers variables."""
    conditions = conditions_of(hopper.contact_system.system)
    gap, parting, impact, backwards, forwards = conditions.members
    assert gap.invariant_state == hopper.contact_system.system.state.numel() - 1
    assert [member.condition.level for member in conditions.members] == ["position", *["velocity"] * 4]
    assert all(member.invariant_state is None for member in conditions.members[1:])
    assert (parting.G, parting.direction) == (impact.G, -impact.direction)
    assert (backwards.G, backwards.direction) == (forwards.G, -forwards.direction)
    assert gap.H == parting.H == impact.H != backwards.H
    assert conditions.variables(gap.H) == conditions.variables(backwards.H) | conditions.variables(forwards.H)
    assert conditions.row_count == 2  # two velocities; the complement of the gap's multiplier is a variable
    assert {label.contact for label in conditions.labels} == {"foot"}


@pytest.mark.parametrize("ahead", [0.0, 0.5])
def test_directions_of_a_contact_go_together(ahead: float) -> None:
    """A foot that may not slip hits straight down or slides forwards in its impact: no direction is held by itself.

    One that is held lets friction across the slide go free.
    """
    motion = formulate(load_task(TASK.with_name("hopper_in_space.yaml"), ["method.grid=uniform"]))
    system, n_s = motion.ocp.system, motion.fesd.tableau.stages
    conditions = conditions_of(system)
    left = np.zeros(system.state.numel())
    left[[2, 5]] = 0.5  # height of the body and length of the leg
    left[[6, 8]] = ahead, -1.0
    end = left.copy()
    end[[6, 8]] = 0.0
    x = np.linspace(left, end, n_s + 1)[1:]
    friction = motion.contacts[0].friction
    pushed = np.array([(1 - friction) / 2, (1 + friction) / 2, 0.5, 0.0, 0.5, 0.0])  # backwards, with all of the cone
    z = np.tile(pushed, (n_s, 1))
    impact = Element(0, 0.0, 0.1, left, pushed, x, z, np.zeros(system.control.numel()), np.zeros_like(x))
    branch = read_branch(conditions, [impact], np.array([0.1]), 0.0)
    factors: dict[str, set[ActiveFactor]] = {}
    for label, factor in zip(conditions.labels, branch.factors[0], strict=True):
        factors.setdefault(label.kind, set()).add(factor)
    assert factors["motion during impact"] == {ActiveFactor.COMPLEMENT}
    assert len(factors["slipping"]) == 1 and len(factors["sliding inside the friction cone"]) == 1
    if ahead:
        assert factors["slipping"] == {ActiveFactor.COMPLEMENT}
        assert factors["sliding inside the friction cone"] == {ActiveFactor.H}


def test_the_rows_are_the_quantities(hopper: MotionProblem) -> None:
    """The extra rows at a point are normal and tangential velocity as the contact computes them."""
    conditions, system = conditions_of(hopper.contact_system.system), hopper.contact_system.system
    x, z = np.linspace(0.1, 1, system.state.numel()), np.array([0.3, 0.2, 0.4])
    values = np.asarray(conditions.values(x, z)).ravel()
    rows = np.asarray(conditions.rows(x, z)).ravel()
    for quantity, value in zip(conditions.quantities, values, strict=True):
        if quantity.row is not None:
            assert rows[quantity.row] == value
        else:
            stacked = np.concatenate([x, z])
            parts = sum(stacked[list(quantity.variables)])
            assert quantity.sign * parts + quantity.offset == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    "task", ["block_push", "cart_pole_friction", "published_hopper_one_jump", "hopper_in_space", "ball_bat"]
)
def test_an_element_has_as_many_rows_as_are_counted(task: str) -> None:
    """Behind the rows of the relaxed problem are those of every element, and the differences of their lengths."""
    motion = formulate(load_task(TASK.with_stem(task), ["method.grid=uniform"]))
    polisher = BranchTranscription(Transcription(motion.ocp, motion.fesd))
    count, relaxed = motion.fesd.elements, polisher.transcription.problem.blocks[1]
    assert isinstance(count, int)
    rows = len(polisher.problem.blocks[1].lower) - len(relaxed.lower)
    assert rows == count * polisher.element_rows.size + count - 1


def test_the_branch_problem_is_the_relaxed_one_without_pairs(hopper: MotionProblem) -> None:
    """Cost and the rows both have agree; what is added is not held until a branch holds it."""
    transcription = Transcription(hopper.ocp, hopper.fesd)
    problem = BranchTranscription(transcription).problem
    w = transcription.problem.start + 0.01
    assert problem.pairs == 0 and problem.size == transcription.problem.size
    for plain, own in zip(transcription.problem.blocks, problem.blocks, strict=True):
        f, g, _, _ = plain.evaluate(w)
        other_f, other_g, _, _ = own.evaluate(w)
        np.testing.assert_array_equal(f, other_f)
        np.testing.assert_array_equal(g, other_g[: len(g)])
        assert np.isinf(own.lower[len(g) :]).all() and np.isinf(own.upper[len(g) :]).all()


@pytest.fixture(scope="module")
def standing(hopper: MotionProblem) -> tuple[BranchTranscription, MpccSolution]:
    polisher = BranchTranscription(Transcription(hopper.ocp, hopper.fesd))
    return polisher, solve(polisher.transcription.problem, Run(HomotopyOptions(tolerance=1e-6)), polisher=polisher)


def test_the_hopper_ends_exactly(standing: tuple[BranchTranscription, MpccSolution]) -> None:
    """Products vanish to round-off, and the branch that is read off an exact point is the one it was solved on."""
    polisher, solution = standing
    assert solution.solved and solution.exact and solution.residuals.complementarity <= 1e-12
    first, *_ = polisher.candidate_branches(solution.w)
    bounds = polisher.bounds(first)
    assert (solution.w >= bounds.lower - 1e-9).all() and (solution.w <= bounds.upper + 1e-9).all()
    rows = np.concatenate([b.evaluate(solution.w)[1].ravel(order="F") for b in polisher.problem.blocks])
    assert (rows >= bounds.g_lower - 1e-8).all() and (rows <= bounds.g_upper + 1e-8).all()


def _flying(branch: Branch) -> Branch:
    """The branch with flight in every element, all of which have a length."""
    flight = tuple(tuple(ActiveFactor.H for _ in factors) for factors in branch.factors)
    return replace(branch, factors=flight, without_length=(False,) * len(flight))


def test_flight_fixes_multipliers_and_contact_the_gap(standing: tuple[BranchTranscription, MpccSolution]) -> None:
    """Held in flight: no multiplier anywhere; held in contact: the gap at every point, once per boundary."""
    polisher, solution = standing
    flight = _flying(polisher.branch(solution.w))
    system, transcription = polisher.transcription.ocp.system, polisher.transcription
    bounds = polisher.bounds(flight)
    multipliers = [
        transcription.indices.offsets[k] + i
        for k, count in enumerate(transcription.elements)
        for n in range(count)
        for j in range(2)
        for i in range(*transcription.layouts[count].algebraic(n, j).indices(10**6))[:2]
    ]
    assert (bounds.upper[multipliers] == 0).all() and (bounds.lower[multipliers] == 0).all()
    assert np.isinf(bounds.g_upper).sum() > np.isinf(transcription.problem.blocks[1].upper).sum()
    removed = polisher.bounds(replace(flight, without_length=(True, *flight.without_length[1:])))
    step = transcription.indices.offsets[0] + transcription.layouts[transcription.elements[0]].step(0)
    assert bounds.upper[step] > 0 and removed.upper[step] == removed.lower[step] == 0
    assert np.isinf(removed.upper[transcription.indices.offsets[0] :][: system.state.numel() + 4]).any()


def test_a_wrong_branch_has_no_exact_end(hopper: MotionProblem) -> None:
    """A robot that cannot fly stays where it is: with flight in every element there is no exact point."""
    heavy = replace(hopper.ocp, terminal_lower=hopper.ocp.initial_lower, terminal_upper=hopper.ocp.initial_upper)
    transcription = Transcription(replace(heavy, control_upper=0 * heavy.control_upper + 1), hopper.fesd)
    problem = transcription.problem
    reported: list[NlpReport] = []

    branch = _flying(BranchTranscription(transcription).branch(problem.start))

    class Flying(BranchTranscription):
        def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
            yield branch

    nlp = BranchNlp.of(Flying(transcription), "never")
    exact = nlp.solve(problem, problem.start, Run(report=reported.append))
    assert exact is None and reported


def test_an_impact_that_leaves_another_contact_alone_has_bounded_multipliers() -> None:
    """A pusher hits a slider along the ground: the ground's impulse is zero, and multipliers stay below 1e4."""
    overrides = (
        "horizon={duration: 0.6, intervals: 6}",
        "initial={configuration: {pusher_x: -0.35, slider_x: 0, slider_z: 0.1}, velocity: {pusher_x: 1}}",
        "goal={soft: true, configuration: {slider_x: 0.2}}",
        "waypoints=[]",
        "reference={type: line}",
        "costs.velocity={pusher_x: 0.06, slider_x: 0.06, slider_z: 0.06}",
        "costs.terminal_configuration={pusher_x: 1250, slider_x: 1250, slider_z: 1250}",
        "costs.terminal_velocity={pusher_x: 0.36, slider_x: 0.36, slider_z: 0.36}",
        "method.elements=3",
    )
    motion = formulate(load_task(TASK.with_name("pusher_slider.yaml"), ["method.grid=uniform", *overrides]))
    transcription = Transcription(motion.ocp, motion.fesd)
    polisher = BranchTranscription(transcription)
    g, h, c = ActiveFactor.G, ActiveFactor.H, ActiveFactor.COMPLEMENT
    flight, impact, push = (g, g, g, g, g, h, h, h), (g, g, g, g, h, g, g, c), (g, g, g, g, h, g, g, g)
    factors = [flight] * 6 + [impact] + [push] * 11
    bounds = polisher.bounds(Branch(polisher.conditions.labels, tuple(factors), (False,) * len(factors)))
    nlp = BranchNlp.of(polisher, "never").nlp
    start = np.clip(transcription.problem.start, bounds.lower, bounds.upper)
    result = prepared(nlp.program, NlpSettings(NEAR, tolerance=1e-9, linear_solver="mumps")).solve(
        NlpNumbers(bounds.lower, bounds.upper, bounds.g_lower, bounds.g_upper, nlp.parameters((0.0, 0.0))),
        NlpPoint.without_multipliers(start, nlp.program.rows),
    )
    assert result.converged
    assert transcription.problem.residuals(result.point.x).constraint_violation <= 1e-9
    assert np.abs(result.point.lam_g).max() < 1e4, "without room for the ground's multiplier they reach 1e8"


def test_what_touches_after_an_impact_elsewhere_has_no_bound_at_its_beginning() -> None:
    """A gap keeps its value in an impact: held at the end, it has no bound inside the impact nor where that begins.

    A bound that equations make active leaves an interior-point method no interior. A contact that goes on flying has
    the bound where the impact begins, and nowhere else in it.
    """
    motion = formulate(load_task(TASK.with_name("solo12_jump.yaml"), ["method.grid=uniform"]))
    transcription = Transcription(motion.ocp, motion.fesd)
    polisher = BranchTranscription(transcription)
    members, names = polisher.conditions.members, [contact.name for contact in motion.contacts]
    g, h, c = ActiveFactor.G, ActiveFactor.H, ActiveFactor.COMPLEMENT

    def factors(**modes: str) -> tuple[ActiveFactor, ...]:
        kinds = {"flight": lambda _: h, "stick": lambda _: g, "impact": lambda one: g if one.complement is None else c}
        return tuple(kinds[modes[str(m.condition.label.contact)]](m.condition) for m in members)

    front, hind = names
    flight = factors(**{front: "flight", hind: "flight"})
    hit = factors(**{front: "impact", hind: "flight"})
    for follows, bounded in (("stick", [False, False, False]), ("flight", [True, False, False])):
        after = factors(**{front: "stick", hind: follows})
        own = [flight] * 30 + [hit] + [after] * (sum(transcription.elements) - 31)
        bounds = polisher.bounds(Branch(polisher.conditions.labels, tuple(own), (False,) * len(own)))
        gap = next(m.invariant_state for m in members if m.condition.label.contact == hind and m.condition.invariant)
        assert gap is not None
        inner = [int(transcription.indices.stage(30, j)[gap]) for j in range(motion.fesd.tableau.stages)]
        at = [int(transcription.indices.left_state(30)[gap]), *inner]
        free = bounds.lower[at] < bounds.upper[at]
        assert [bool(low == 0) for low in bounds.lower[at][free]] == np.array(bounded)[free].tolist()
        assert free.tolist() == [True, True, follows == "flight"]
