"""Every relaxation beside its own definition, and all, steered in every way, on problems with known solutions."""

from __future__ import annotations

from typing import get_args

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import ModelError, OptionError
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS, Relaxation
from fesd_robot.mpcc.steering import STEERINGS, Steering
from fesd_robot.planning.fallbacks import FALLBACKS
from fesd_robot.task import Task
from fesd_robot.task.method import Solver

from .known import KNOWN, Known, X, Y, mpcc, vanishing

SIGMA = 0.04
ROOT = 0.2
SAME_SET = ["scholtes", "fischer_burmeister", "natural_residual", "chen_chen_kanzow"]
WITHOUT_VANISHING = [name for name, relaxation in RELAXATIONS.items() if not relaxation.vanishing]


def _rows(name: str, G: np.ndarray, H: np.ndarray, sigma: float = SIGMA) -> np.ndarray:
    """Rows of each pair, (n, k)."""
    pair, relaxation = ca.SX.sym("pair", 2), RELAXATIONS[name]
    function = ca.Function("rows", [pair], [relaxation.rows(pair[0], pair[1], ca.SX(sigma))])
    return np.asarray(function.map(np.size(G))(np.vstack([G, H]))).T


def _holds(name: str, G: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Whether the pairs satisfy the rows and, where the relaxation wants them, the signs."""
    within = (_rows(name, G, H) <= 0).all(axis=1)
    return within & (G >= 0) & (H >= 0) if RELAXATIONS[name].signs else within


def _points(low: float = 0.0, high: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    G, H = np.random.default_rng(0).uniform(low, high, (2, 2000))
    return G, H


@pytest.mark.parametrize("sigma", [4.0, 0.04, 1e-6])
@pytest.mark.parametrize("name", RELAXATIONS)
def test_the_root_of_sigma_is_on_the_curve(name: str, sigma: float) -> None:
    """At G = H = sqrt(sigma) a row is zero; a little further out a row is positive."""
    root = np.array([sigma**0.5])
    assert _rows(name, root, root, sigma).max() == pytest.approx(0, abs=1e-12 * max(1, sigma))
    assert _rows(name, 1.01 * root, 1.01 * root, sigma).max() > 0
    assert RELAXATIONS[name].name == name


@pytest.mark.parametrize("name", [name for name in RELAXATIONS if not RELAXATIONS[name].equality])
def test_an_inequality_holds_on_the_axes(name: str) -> None:
    """What is complementary stays feasible; but Kadrani's strips leave out the corner."""
    side = np.linspace(0, 3, 31)
    apart = side >= ROOT if name == "kadrani" else np.ones(31, dtype=bool)
    assert _holds(name, side, 0 * side)[apart].all() and _holds(name, 0 * side, side)[apart].all()
    if name == "kadrani":
        assert not _holds(name, side, 0 * side)[~apart].any()


@pytest.mark.parametrize("name", [name for name in RELAXATIONS if RELAXATIONS[name].bounds_product])
def test_products_are_bounded_by_sigma(name: str) -> None:
    """Where the rows hold, G H <= sigma, and for equalities the rows vanish where G H = sigma."""
    G, H = _points()
    assert (G * H)[_holds(name, G, H)].max() <= SIGMA * (1 + 1e-9)
    if RELAXATIONS[name].equality:
        assert _rows(name, G, SIGMA / G) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("name", [name for name in RELAXATIONS if not RELAXATIONS[name].bounds_product])
def test_the_smaller_side_is_bounded_by_the_root(name: str) -> None:
    """Where the rows hold, the smaller side is within sqrt(sigma) of zero, and the last sigma accounts for it."""
    G, H = _points(-1.0)
    smaller = np.minimum(G, H)[_holds(name, G, H)]
    assert smaller.max() <= ROOT and smaller.min() >= -ROOT
    assert RELAXATIONS[name].last_sigma(1e-8) == pytest.approx(1e-18)


@pytest.mark.parametrize("name", SAME_SET)
def test_one_set_has_several_descriptions(name: str) -> None:
    """Four of the inequalities differ in their derivatives only."""
    G, H = _points()
    assert (_holds(name, G, H) == (G * H <= SIGMA)).all()


@pytest.mark.parametrize("name", [name for name in RELAXATIONS if RELAXATIONS[name].vanishing])
def test_vanishing_constraints_are_left_alone_where_g_is_negative(name: str) -> None:
    """Every H >= 0 is allowed with G <= 0."""
    G, H = _points()
    assert (_rows(name, -G, H) <= 0).all()


@pytest.mark.parametrize("name", ["steffensen_ulbrich_sine", "steffensen_ulbrich_polynomial"])
def test_the_rounded_corner_joins_twice_differentiably(name: str) -> None:
    """Value, gradient and Hessian have no jump where the rounding ends, and beyond it one side is zero."""
    width = 2 * ROOT / (1 - 2 / np.pi) if name.endswith("sine") else 16 / 3 * ROOT
    pair = ca.SX.sym("pair", 2)
    row = RELAXATIONS[name].rows(pair[0], pair[1], ca.SX(SIGMA))
    hessian, gradient = ca.hessian(row, pair)
    function = ca.Function("row", [pair], [row, gradient, hessian])
    for inside, outside in zip(function([width - 1e-9, 0]), function([width + 1e-9, 0]), strict=True):
        assert np.asarray(inside) == pytest.approx(np.asarray(outside), abs=1e-6)
    G, H = _points()
    beyond = np.abs(G - H) > width
    assert beyond.any() and _rows(name, G, H)[beyond, 0] == pytest.approx(2 * np.minimum(G, H)[beyond])


@pytest.mark.parametrize("relaxation", RELAXATIONS.values(), ids=RELAXATIONS)
def test_rows_of_the_nlp(relaxation: Relaxation) -> None:
    """The NLP has the relaxation's rows with its bounds, then the signs if they are held."""
    nlp = assemble(mpcc(X + Y, X, Y, [0, 0]), relaxation)
    point = np.array([0.3, 0.7])
    expected = _rows(relaxation.name, *point[:, None])[0]
    rows = np.asarray(nlp.program.nlp(point, [SIGMA, 1.0])[1]).ravel()
    signs = 2 if relaxation.signs else 0
    assert rows == pytest.approx([*expected, *point[:signs]])
    assert nlp.upper.tolist() == [0.0] * len(expected) + [np.inf] * signs
    assert nlp.lower.tolist() == [0.0 if relaxation.equality else -np.inf] * len(expected) + [0.0] * signs


@pytest.mark.parametrize("name", WITHOUT_VANISHING)
@pytest.mark.parametrize("steering", STEERINGS)
def test_a_relaxation_that_cannot_hold_vanishing_constraints_is_refused(name: str, steering: Steering) -> None:
    """The error names the pair and every relaxation that can."""
    problem = vanishing(mpcc(X + Y, X, Y, [0, 0]))
    with pytest.raises(ModelError) as caught:
        solve(problem, Run(HomotopyOptions(relaxation=name, steering=steering)))
    message = str(caught.value)
    assert f"relaxation '{name}'" in message and "'pair 0' of block 'problem'" in message
    valid = message.split("valid: ")[1].rstrip(")").split(", ")
    assert valid == sorted(set(RELAXATIONS) - set(WITHOUT_VANISHING))


def test_an_unknown_relaxation_is_refused() -> None:
    """The error has the nearest name."""
    with pytest.raises(OptionError, match=r"unknown relaxation 'sholtes' \(did you mean 'scholtes'\?\)"):
        HomotopyOptions(relaxation="sholtes")


FLAT = "its second row is as small as sigma = 1e-18 in the corner, far below IPOPT's accuracy"
DRIFT = "a penalised slack and a side that may be negative by it: the corner has no multipliers, and they diverge"
NO_CORNER = "the strips touch in one point only: no interior for a barrier where both sides want to be zero"
UNSOLVED = {
    ("lin_fukushima", "direct", "corner"): FLAT,
    ("lin_fukushima", "direct", "no_strict_complementarity"): FLAT,
    ("lin_fukushima", "l1", "half_strict_complementarity"): DRIFT,
    ("lin_fukushima", "linf", "half_strict_complementarity"): DRIFT,
    ("kadrani", "l1", "corner"): NO_CORNER,
    ("kadrani", "linf", "corner"): NO_CORNER,
}
"""What is not solved with MUMPS and must not be called solved, and why."""

INACCURATE = {
    ("steffensen_ulbrich_polynomial", "l1", "moved_pair"): 5e-5,
    ("steffensen_ulbrich_polynomial", "linf", "moved_pair"): 5e-5,
    ("steffensen_ulbrich_sine", "l1", "redundant_pair"): 5e-5,
}
"""Distance from the solution where there is no interior beyond the rounded corner: multipliers grow, and with them the
dual error that IPOPT accepts."""


@pytest.mark.parametrize("known", KNOWN, ids=lambda known: known.name)
@pytest.mark.parametrize("steering", STEERINGS)
@pytest.mark.parametrize("name", RELAXATIONS)
def test_known_solutions(name: str, steering: Steering, known: Known) -> None:
    """Solved means near a solution, with residuals to prove it; what cannot be solved says so."""
    options = HomotopyOptions(
        sigma_start=1.0,
        sigma_factor=0.1,
        velocity_level_ratio=100.0,
        relaxation=name,
        steering=steering,
        linear_solver="mumps",
    )
    if known.problem.blocks[0].vanishing.any() and name in WITHOUT_VANISHING:
        with pytest.raises(ModelError, match="is a vanishing constraint"):
            solve(known.problem, Run(options))
        return
    solution = solve(known.problem, Run(options))
    case = (name, steering, known.name)
    assert solution.w.shape == known.problem.start.shape and np.isfinite(solution.w).all()
    assert solution.residuals == known.problem.residuals(solution.w)
    if not known.solutions or case in UNSOLVED:
        assert not solution.solved
        return
    assert solution.solved and solution.feasible and solution.status == "converged"
    assert solution.residuals.complementarity <= 1.01e-8 and solution.residuals.constraint_violation <= 1e-8
    assert known.error(solution.w) <= INACCURATE.get(case, known.distance)


def test_a_task_can_ask_for_relaxations_of_contact() -> None:
    """The names in the task schema are the default and that of a fallback; both hold vanishing constraints."""
    offered = get_args(Solver.model_fields["relaxation"].annotation)
    fallbacks = {changes(Task.model_construct(solver=Solver())).get("solver.relaxation") for changes in FALLBACKS[5:6]}
    assert set(offered) == {Solver().relaxation, *fallbacks}
    assert all(RELAXATIONS[name].vanishing for name in offered)
