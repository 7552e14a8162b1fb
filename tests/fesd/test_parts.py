"""Elements in parts, and bounds that hold between the stages."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fesd_robot.dcs import Model, StepFunctions, heaviside
from fesd_robot.fesd import (
    FesdOptions,
    OptimalControlProblem,
    TrajectoryConstraint,
    Transcription,
    initial_value_problem,
    make_tableau,
)
from fesd_robot.fesd.added_rows import PARTS, SLACK, AddedRows, BoundBetween, bernstein_coefficients
from fesd_robot.fesd.path_between import PathBetween
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import violated_between_stages, with_bounds_between, with_parts, with_stages
from fesd_robot.fesd.refinement.between_stages import _Product, _products
from fesd_robot.mpcc import HomotopyOptions, Run, continue_on_branch, solve

from .systems import scalar

OPTIONS = HomotopyOptions(tolerance=1e-6)
SWITCH = 1 / 3


def test_parts_are_equal_and_the_switch_stays_free() -> None:
    """The parts of an element have one length, their point is the old trajectory, and the switch is found as before."""
    options = FesdOptions(tableau=make_tableau("radau_iia", 2), elements=3)
    transcription = Transcription(initial_value_problem(scalar("crossing"), [-1.0], 0.9), options)
    coarse = solve(transcription.problem, Run(OPTIONS), polisher=BranchTranscription(transcription))
    assert coarse.exact and coarse.branch is not None
    parts = [2, 1, 3]
    start = with_parts(BranchMotion.of(transcription, coarse.w, coarse.branch), parts)
    finer = start.transcription
    assert finer.elements == (6,) and len(start.branch.factors) == 6
    residuals = finer.problem.residuals(start.w)
    assert residuals.constraint_violation <= 1e-9 and residuals.complementarity <= 1e-12
    moved = start.at(start.w + 1e-3 * np.random.default_rng(0).standard_normal(len(start.w)), start.branch)
    fine = continue_on_branch(finer.problem, start.polisher, moved, coarse, Run(OPTIONS))
    assert fine is not None and fine.exact
    steps = np.array([element.step for element in finer.unpack(fine.w)])
    assert steps[0] == pytest.approx(steps[1], abs=1e-9) and np.ptp(steps[3:]) <= 1e-9
    assert min(abs(element.end - SWITCH) for element in finer.unpack(fine.w)) <= 1e-9
    again = with_parts(BranchMotion.of_solution(start.polisher, fine), [1, 2, 1, 1, 1, 1])
    assert _violation(again) <= 1e-8, "parts of parts keep their ratio"
    assert _violation(with_stages(again, 3)) <= 1e-8, "and so they do with more stages"


def _violation(motion: BranchMotion) -> float:
    return motion.transcription.problem.residuals(motion.w).constraint_violation


@pytest.mark.parametrize("stages", [2, 3, 4])
def test_coefficients_enclose_a_polynomial(stages: int) -> None:
    """Between stages a polynomial lies within its coefficients, which come near to it, and reach it at the ends."""
    nodes = make_tableau("radau_iia", stages).nodes
    matrix = bernstein_coefficients(nodes)
    assert matrix.shape == (PARTS * len(nodes), len(nodes))
    for seed in range(20):
        values = np.random.default_rng(seed).standard_normal(len(nodes))
        polynomial = Polynomial.fit(nodes, values, len(nodes) - 1, domain=[0, 1], window=[0, 1])
        dense, coefficients = polynomial(np.linspace(0, 1, 401)), matrix @ values
        assert coefficients.max() >= dense.max() - 1e-9 and coefficients.min() <= dense.min() + 1e-9
        bend = np.abs(polynomial.deriv(2)(np.linspace(0, 1, 401))).max()
        assert max(coefficients.max() - dense.max(), dense.min() - coefficients.min()) <= bend / 4 / PARTS**2 + 1e-9
        assert coefficients[[0, -1]] == pytest.approx(polynomial(np.array([0.0, 1.0])), abs=1e-9)


def ball(*, path: bool, spare: float = 0.0) -> OptimalControlProblem:
    """A ball that is thrown up and caught after a second, below a ceiling at 0.2 m: a limit, or a path constraint.

    Between stages it may be above a path constraint by `spare`, m.
    """
    x, u, alpha = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("alpha")
    system = heaviside(Model(x, control=u), StepFunctions(alpha, x[0] + 10), ca.vertcat(x[1], u))
    below = TrajectoryConstraint(
        "ceiling",
        "path",
        ca.vertcat(system.state, system.control, system.algebraic),
        range(2),
        x[0],
        np.array([-np.inf]),
        np.array([0.2]),
        ["height"],
        spare=spare,
    )
    return OptimalControlProblem(
        system,
        1.0,
        intervals=2,
        initial_lower=np.array([0.0, 1.0]),
        initial_upper=np.array([0.0, 1.0]),
        terminal_lower=np.array([0.0, -np.inf]),
        terminal_upper=np.array([0.0, np.inf]),
        state_upper=np.array([np.inf if path else 0.2, np.inf]),
        running_cost={"control": u**2},
        constraints=[below] if path else [],
    )


@pytest.mark.parametrize("unused", [-3e-10, -5e-11])
def test_a_product_is_held_to_the_square_of_a_force(unused: float) -> None:
    """What is unused of a cone, the square of a small force, may be -1e-10 between the stages, no less."""
    force = ca.SX.sym("force", 1)
    product = _Product(variable=1, missing=ca.Function("missing", [ca.SX.sym("x"), force, ca.SX.sym("p")], [2 * force]))
    found = list(_products([product], 4, np.zeros((5, 1)), np.full((5, 1), -unused), np.zeros(1), n_x=1))
    assert len(found) == (unused < -1e-10)
    if found:
        (one,) = found
        assert one.violation == pytest.approx(-unused)
        assert isinstance(one.bound, BoundBetween) and one.bound.sign == -1 and one.bound.limit > 2 * -unused


@pytest.mark.parametrize("path", [False, True])
def test_a_ceiling_holds_between_the_stages(path: bool) -> None:
    """Held at the stages, the ball is millimetres above its ceiling; between them, too, it is below, and costs more."""
    transcription = Transcription(ball(path=path), FesdOptions(tableau=make_tableau("radau_iia", 2), elements=1))
    polisher = BranchTranscription(transcription)
    coarse = solve(transcription.problem, Run(OPTIONS), polisher=polisher)
    assert coarse.exact and coarse.branch is not None
    assert _highest(transcription, coarse.w) > 0.2 + 1e-3
    motion = BranchMotion.of_solution(polisher, coarse)
    violated = violated_between_stages(motion)
    bounds = [one.bound for one in violated]
    assert bounds == [PathBetween(0, 0) if path else BoundBetween(0, 0, 1, 0.2)]
    start = with_bounds_between(motion, bounds)
    held = start.transcription
    fine = continue_on_branch(held.problem, start.polisher, start, coarse, Run(OPTIONS), freer=True)
    assert fine is not None and fine.exact
    assert 0.2 - 5e-3 <= _highest(held, fine.w) <= 0.2 + (2e-3 if path else 2 * SLACK)
    assert fine.residuals.objective > coarse.residuals.objective
    if path:
        (stricter,) = violated_between_stages(BranchMotion.of_solution(start.polisher, fine))
        assert isinstance(stricter.bound, PathBetween)
        assert 0 < stricter.bound.margin <= 3e-3, "where it is held at places only, it becomes stricter"
    finer = with_parts(BranchMotion.of_solution(start.polisher, fine), [2, 1])
    added = [block for block in finer.transcription.problem.blocks if "between" in block.name]
    assert added, "bounds stay where they are when elements divide"
    for block in added:
        rows = np.asarray(block.evaluate(finer.w)[1]).T
        slack = 2e-3 if path else 1e-9  # at other places than before
        assert (rows <= block.upper + slack).all() and (rows >= block.lower - slack).all()


@pytest.mark.parametrize(("part", "held"), [(0.5, [PathBetween(0, 0)]), (2.0, [])])
def test_what_a_path_constraint_spares_is_left(part: float, held: list[PathBetween]) -> None:
    """A violation between stages is held where it is larger than the constraint spares, and left where it is not."""
    transcription = Transcription(ball(path=True), FesdOptions(tableau=make_tableau("radau_iia", 2), elements=1))
    polisher = BranchTranscription(transcription)
    coarse = solve(transcription.problem, Run(OPTIONS), polisher=polisher)
    assert coarse.branch is not None
    spare = part * (_highest(transcription, coarse.w) - 0.2)
    sparing = Transcription(ball(path=True, spare=spare), transcription.options)
    violated = violated_between_stages(BranchMotion.of(sparing, coarse.w, coarse.branch))
    assert [one.bound for one in violated] == held


def _highest(transcription: Transcription, w: np.ndarray) -> float:
    tableau = transcription.options.tableau
    return max(
        element.at(tableau, np.linspace(element.start, element.end, 201))[:, 0].max()
        for element in transcription.unpack(w)
    )


def test_rows_stay_in_their_intervals() -> None:
    """A row holds in all elements of its interval, the strictest of several, unless it is of a mode."""
    rows = AddedRows(
        (
            *(BoundBetween(e, 4, 1, 2.0) for e in (1, 2)),
            BoundBetween(0, 5, 1, 0.0, end_only=True),
            BoundBetween(0, 6, -1, 1e-6, of_mode=True),
        ),
        (PathBetween(0, 1, 1e-3), PathBetween(0, 2), PathBetween(1, 0, -0.5)),
    )
    moved = rows.in_intervals([2, 1], [3, 2])
    assert moved.bounds == tuple(BoundBetween(e, 4, 1, 2.0) for e in range(5))
    assert set(moved.paths) == {
        *(PathBetween(0, e, 1e-3) for e in range(3)),
        *(PathBetween(0, e) for e in (3, 4)),
        *(PathBetween(1, e, -0.5) for e in range(3)),
    }
