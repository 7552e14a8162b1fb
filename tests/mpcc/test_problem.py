"""The MPCC as a value: shapes are checked, residuals are recomputed from a point."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.errors import DimensionError, ModelError
from fesd_robot.mpcc import Block, BlockEquations, Mpcc

W = ca.SX.sym("w", 3)
TWO = [Label("first"), Label("second")]
PAIR, ROW = Label("pair 0"), Label("g[0]")


def _problem() -> Mpcc:
    """min w0 + w1² s.t. w0 + w2 = 1, w0 ⊥ w1, with w2 in [-1, 4]."""
    return Mpcc.from_expressions(
        w=W,
        f=W[0] + W[1] ** 2,
        g=W[0] + W[2] - 1,
        G=W[0],
        H=W[1],
        start=np.zeros(3),
        bounds=(np.array([-np.inf, -np.inf, -1.0]), np.array([np.inf, np.inf, 4.0])),
    )


@pytest.mark.parametrize(
    ("point", "objective", "violation", "product", "natural", "worst", "worst_pair"),
    [
        ([0, 3, 1], 9, 0, 0, 0, None, None),
        ([2, 0.5, -1], 2.25, 0, 1, 0.5, None, PAIR),
        ([3, 0, -2], 3, 1, 0, 0, Label("bound of w[2]"), None),
        ([0, 0, 5], 0, 4, 0, 0, ROW, None),
        ([-2, 5, 3], 23, 2, 0, 0, PAIR, None),
        ([1, -0.25, 0], 1.0625, 0.25, 0, 0, PAIR, None),
    ],
    ids=["feasible", "both positive", "outside a bound", "equality", "G negative", "H negative"],
)
def test_residuals_at_points_made_by_hand(
    point: list[float],
    objective: float,
    violation: float,
    product: float,
    natural: float,
    worst: Label | None,
    worst_pair: Label | None,
) -> None:
    """Cost, largest violation and largest product come from the point alone, and the worst of each has its label."""
    residuals = _problem().residuals(np.array(point, dtype=float))
    assert residuals.objective == pytest.approx(objective, abs=1e-15)
    assert residuals.constraint_violation == pytest.approx(violation, abs=1e-15)
    assert (residuals.complementarity, residuals.natural_residual) == pytest.approx((product, natural), abs=1e-15)
    assert (residuals.worst_constraint, residuals.worst_pair) == (worst, worst_pair)


@pytest.mark.parametrize("entry", [0, 1, 2])
def test_a_point_that_is_no_number_is_not_feasible(entry: int) -> None:
    """A NaN in the point cannot look like a solution."""
    point = np.array([0.0, 3.0, 1.0])
    point[entry] = np.nan
    assert not _problem().residuals(point).constraint_violation <= 1e-8


def _block(**changes: Any) -> Block:
    """Two copies of p w0² + w1, w0 - w1 in [0, 1], w0 ⊥ w1 - p, on the variables (0, 1) and (2, 1)."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")
    of_copies = {
        "places": [Place(name="left"), Place(name="right")],
        "index": np.array([[0, 2], [1, 1]]),
        "values": np.array([[1.0, 2.0]]),
    }
    equations = BlockEquations(
        name="piece",
        variables=w,
        parameters=p,
        cost=p * w[0] ** 2 + w[1],
        rows=w[0] - w[1],
        lower=np.zeros(1),
        upper=np.ones(1),
        constraints=[Label("difference")],
        complementarities=[Complementarity(Label("pair"), w[0], w[1] - p)],
    )
    own = {key: change for key, change in changes.items() if key not in of_copies}
    return Block(replace(equations, **own), **{key: changes.get(key, value) for key, value in of_copies.items()})  # type: ignore[arg-type]


def _mpcc(*blocks: Block) -> Mpcc:
    free = np.full(3, np.inf)
    return Mpcc(lower=-free, upper=free, start=np.zeros(3), blocks=blocks)


def test_copies_read_their_own_variables() -> None:
    """Every copy of a block sees its own variables and parameters, and the worst copy is named."""
    problem = _mpcc(_block())
    residuals = problem.residuals(np.array([2.0, 3.0, 5.0]))
    # left: cost 1·4 + 3, difference -1, product 2·2; right: cost 2·25 + 3, difference 2, product 5·1.
    assert residuals.objective == 60
    assert residuals.constraint_violation == 1.0
    assert (residuals.complementarity, residuals.natural_residual) == (5.0, 2.0)
    assert residuals.worst_pair == Label("pair", place=Place(name="right"))
    assert (problem.size, problem.constraints, problem.pairs) == (3, 2, 2)
    worst = problem.residuals(np.array([3.5, 3.0, 8.0])).worst_constraint
    assert worst == Label("difference", place=Place(name="right")) and str(worst) == "difference, right"
    assert [str(label) for label in problem.pair_labels] == ["pair, left", "pair, right"]


def test_a_vanishing_constraint_lets_g_be_negative() -> None:
    """With G of any sign only H >= 0 and G H <= 0 are asked for."""
    block = _block(lower=-np.full(1, np.inf))
    conditions = [replace(one, vanishing=True) for one in block.complementarities]
    block = replace(block, equations=replace(block.equations, complementarities=conditions))
    assert (block.vanishing.tolist(), block.velocity_level.tolist(), block.pairs) == ([True], [False], 1)
    problem = _mpcc(block)
    residuals = problem.residuals(np.array([-7.0, 3.0, -7.0]))
    assert (residuals.constraint_violation, residuals.complementarity, residuals.natural_residual) == (0, 0, 0)
    assert problem.residuals(np.array([-7.0, 1.0, -7.0])).constraint_violation == 1.0  # H = w1 - p is negative
    assert problem.residuals(np.array([2.0, 3.0, -7.0])).complementarity == 4.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"index": np.zeros((3, 2), dtype=int)}, "index has shape (3, 2), expected (2, 2)"),
        ({"places": [Place()]}, "places has shape (1,), expected (2,)"),
        ({"values": np.zeros((1, 3))}, "values has shape (1, 3), expected (1, 2)"),
        ({"lower": np.zeros(2)}, "lower has shape (2,), expected (1,)"),
        ({"upper": np.zeros(0)}, "upper has shape (0,), expected (1,)"),
        ({"constraints": TWO}, "constraints has shape (2,), expected (1,)"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_a_block_of_wrong_shapes_is_refused(changes: dict[str, Any], message: str) -> None:
    """The error names the block and the part with its shape and the one that was expected."""
    with pytest.raises(DimensionError) as caught:
        _block(**changes)
    assert str(caught.value) == f"block 'piece': {message}"


@pytest.mark.parametrize("part", ["lower", "upper"])
def test_bounds_of_every_shape(part: str) -> None:
    """A bound is one number for all entries, one each, or None for no bound; rows without bounds are equations."""
    side = ("lower", "upper").index(part)
    for given, expected in ((2.0, [2.0] * 3), (np.arange(3.0), [0.0, 1.0, 2.0]), (None, [(-1, 1)[side] * np.inf] * 3)):
        both = (given, None) if side == 0 else (None, given)
        problem = Mpcc.from_expressions(w=W, f=W[0], g=2 * W, start=np.zeros(3), bounds=both, g_bounds=both)
        (block,) = problem.blocks
        assert getattr(problem, part).tolist() == getattr(block, part).tolist() == expected
    (block,) = Mpcc.from_expressions(w=W, f=W[0], g=2 * W, start=np.zeros(3)).blocks
    assert getattr(block, part).tolist() == [0.0] * 3


def test_a_problem_of_wrong_shapes_is_refused() -> None:
    """Bounds and start share one shape, blocks read existing variables, and G, H come in pairs."""
    free = np.full(3, np.inf)
    with pytest.raises(DimensionError, match="lower, upper and start must have one shape"):
        Mpcc(lower=-free, upper=free, start=np.zeros(2), blocks=[])
    for outside in (3, -1):
        with pytest.raises(DimensionError, match=r"'piece' reads variables outside 0\.\.2"):
            _mpcc(_block(index=np.array([[0, outside], [1, 1]])))
    with pytest.raises(DimensionError, match="they form pairs"):
        Mpcc.from_expressions(w=W, f=W[0], G=W[0], H=W[:2], start=np.zeros(3))


def test_a_block_has_no_third_factor() -> None:
    """A complement would be ignored by the relaxation of a pair; it belongs to G."""
    (block,) = _problem().blocks
    third = Complementarity(Label("impact"), W[0], W[1], vanishing=True, complement=W[2])
    with pytest.raises(ModelError, match="'impact' has a complement, expected it as a factor of G"):
        replace(block.equations, complementarities=[third])
