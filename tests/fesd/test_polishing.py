"""The finish of a transcription: what is read off relaxed elements, and what the smooth problem makes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import FesdOptions, Transcription, make_tableau
from fesd_robot.fesd.polishing import BranchTranscription, Choice, alternatives_of
from fesd_robot.mpcc import BranchNlp, HomotopyOptions, MpccSolution, solve
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import load_task

from .systems import initial_value_problem, leaving, relay, scalar

TASK = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"


def _finished(
    system: ComplementaritySystem, initial: list[float], duration: float, elements: int, **options: Any
) -> tuple[Transcription, MpccSolution]:
    tableau = make_tableau(options.pop("scheme", "radau_iia"), options.pop("stages", 2))
    transcription = Transcription(
        initial_value_problem(system, initial, duration), FesdOptions(tableau=tableau, elements=elements, **options)
    )
    polisher = BranchTranscription(transcription)
    return transcription, solve(transcription.problem, HomotopyOptions(tolerance=1e-6), polisher=polisher)


@pytest.mark.parametrize("form", ["stewart", "heaviside", "step"])
@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 2), ("gauss_legendre", 2), ("radau_iia", 1)])
def test_a_crossing_is_exact(form: str, scheme: str, stages: int) -> None:
    """x' = 2 - sign(x) from -1 switches at 1/3 and ends at 5/3 to round-off, though the homotopy stops at 1e-6."""
    system = scalar("crossing") if form == "step" else relay(form, 3, 1)
    transcription, found = _finished(
        system, [-1.0] if form == "step" else [-1.0, 0.0], 2.0, 3, scheme=scheme, stages=stages
    )
    assert found.solved and found.exact
    assert found.residuals.complementarity <= 1e-12
    elements = transcription.unpack(found.w)
    assert elements[-1].x[-1][0] == pytest.approx(5 / 3, abs=1e-11)
    assert min(abs(element.end - 1 / 3) for element in elements) <= 1e-11


def test_a_sliding_mode_is_exact() -> None:
    """x' = t - sign(x) from -1/2 reaches 0 at sqrt 2 - 1 and stays there; where it leaves is seen at stages only."""
    transcription, found = _finished(leaving(), [-0.5, 0.0], 2.0, 4, stages=3)
    assert found.solved and found.exact and found.residuals.complementarity <= 1e-12
    elements = transcription.unpack(found.w)
    assert min(abs(element.end - (np.sqrt(2) - 1)) for element in elements) <= 1e-11
    sliding = [element for element in elements if 0.42 < element.end <= 1]
    assert sliding and all(np.abs(element.x[:, 0]).max() <= 1e-12 for element in sliding)
    assert elements[-1].x[-1][0] == pytest.approx(0.5, abs=2e-3)


@pytest.fixture(scope="module")
def hopper() -> MotionProblem:
    short = ["horizon.duration=0.2", "horizon.intervals=2", "goal.configuration.root_x=0.12", "reference={type: line}"]
    return formulate(load_task(TASK, short))


def test_alternatives_of_a_contact(hopper: MotionProblem) -> None:
    """A foot with friction: the gap keeps itself at zero, opposite speeds are one quantity, shares variables."""
    found = alternatives_of(hopper.contact_system.system)
    gap, parting, impact, backwards, forwards = found.members
    assert gap.kept == hopper.contact_system.system.state.numel() - 1 and gap.rank == 0
    assert (parting.level, parting.direction) == (impact.level, -impact.direction)
    assert (backwards.level, backwards.direction) == (forwards.level, -forwards.direction)
    assert gap.share == parting.share == impact.share != backwards.share
    assert set(found.quantities[gap.share].variables) == {
        *found.quantities[backwards.share].variables,
        *found.quantities[forwards.share].variables,
    }
    assert found.row_count == 2  # two speeds; the rest of the free motion is a variable


def test_the_rows_are_the_quantities(hopper: MotionProblem) -> None:
    """The extra rows at a point are normal and tangential speed as the contact computes them."""
    found, system = alternatives_of(hopper.contact_system.system), hopper.contact_system.system
    x, z = np.linspace(0.1, 1, system.state.numel()), np.array([0.3, 0.2, 0.4])
    values = np.asarray(found.values(x, z)).ravel()
    rows = np.asarray(found.rows(x, z)).ravel()
    for quantity, value in zip(found.quantities, values, strict=True):
        if quantity.row >= 0:
            assert rows[quantity.row] == value
        else:
            stacked = np.concatenate([x, z])
            parts = sum(stacked[list(quantity.variables)])
            assert quantity.sign * parts + quantity.offset == pytest.approx(value, rel=1e-14)


def test_the_smooth_problem_is_the_relaxed_one_without_pairs(hopper: MotionProblem) -> None:
    """Cost and the rows both have agree; what is added is not held until a structure holds it."""
    transcription = Transcription(hopper.ocp, hopper.fesd)
    smooth = BranchTranscription(transcription).problem
    w = transcription.problem.start + 0.01
    assert smooth.pairs == 0 and smooth.size == transcription.problem.size
    for plain, own in zip(transcription.problem.blocks, smooth.blocks, strict=True):
        f, g, _, _ = plain.evaluate(w)
        other_f, other_g, _, _ = own.evaluate(w)
        np.testing.assert_array_equal(f, other_f)
        np.testing.assert_array_equal(g, other_g[: len(g)])
        assert np.isinf(own.lower[len(g) :]).all() and np.isinf(own.upper[len(g) :]).all()


@pytest.fixture(scope="module")
def standing(hopper: MotionProblem) -> tuple[BranchTranscription, MpccSolution]:
    smooth = BranchTranscription(Transcription(hopper.ocp, hopper.fesd))
    return smooth, solve(smooth.transcription.problem, HomotopyOptions(tolerance=1e-6), polisher=smooth)


def test_the_hopper_ends_exactly(standing: tuple[BranchTranscription, MpccSolution]) -> None:
    """Products vanish to round-off, and the structure that is read off an exact point is the one it was solved on."""
    smooth, found = standing
    assert found.solved and found.exact and found.residuals.complementarity <= 1e-12
    first, *_ = smooth.readings(found.w)
    held = smooth.held(first)
    assert (found.w >= held.lower - 1e-9).all() and (found.w <= held.upper + 1e-9).all()
    rows = np.concatenate([b.evaluate(found.w)[1].ravel(order="F") for b in smooth.problem.blocks])
    assert (rows >= held.g_lower - 1e-8).all() and (rows <= held.g_upper + 1e-8).all()


def test_flight_fixes_shares_and_contact_the_gap(standing: tuple[BranchTranscription, MpccSolution]) -> None:
    """Held in flight: no share anywhere; held in contact: the gap at every point, once per boundary."""
    smooth, found = standing
    structure = next(iter(smooth.readings(found.w)))
    flight = tuple(tuple(Choice.SHARE for _ in choices) for choices in structure.choices)
    none = (False,) * len(flight)
    system, transcription = smooth.transcription.ocp.system, smooth.transcription
    held = smooth.held(replace(structure, choices=flight, collapsed=none))
    shares = [
        transcription.indices.offsets[k] + i
        for k, count in enumerate(transcription.elements)
        for n in range(count)
        for j in range(2)
        for i in range(*transcription.layouts[count].algebraic(n, j).indices(10**6))[:2]
    ]
    assert (held.upper[shares] == 0).all() and (held.lower[shares] == 0).all()
    assert np.isinf(held.g_upper).sum() > np.isinf(transcription.problem.blocks[1].upper).sum()
    collapsed = smooth.held(replace(structure, choices=flight, collapsed=(True, *none[1:])))
    step = transcription.indices.offsets[0] + transcription.layouts[transcription.elements[0]].step(0)
    assert held.upper[step] > 0 and collapsed.upper[step] == collapsed.lower[step] == 0
    assert np.isinf(collapsed.upper[transcription.indices.offsets[0] :][: system.state.numel() + 4]).any()


def test_a_wrong_structure_has_no_exact_end(hopper: MotionProblem) -> None:
    """A robot that cannot fly stays where it is: with flight in every element there is no exact point."""
    smooth = BranchTranscription(Transcription(hopper.ocp, hopper.fesd))
    heavy = replace(hopper.ocp, terminal_lower=hopper.ocp.initial_lower, terminal_upper=hopper.ocp.initial_upper)
    smooth = BranchTranscription(Transcription(replace(heavy, control_upper=0 * heavy.control_upper + 1), hopper.fesd))
    problem, reported = smooth.transcription.problem, []
    structure = next(iter(smooth.readings(problem.start)))
    flight = tuple(tuple(Choice.SHARE for _ in choices) for choices in structure.choices)

    class Flying(BranchTranscription):
        def readings(self, w: np.ndarray) -> Any:
            yield replace(structure, choices=flight, collapsed=(False,) * len(flight))

    nlp = BranchNlp.of(Flying(smooth.transcription), "never")
    found = nlp.solve(
        problem, problem.start, options={}, feasibility=1e-8, remaining=lambda: None, report=reported.append
    )
    assert found is None and reported and not any(report.exact for report in reported)
