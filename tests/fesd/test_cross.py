"""The four aggregations of cross complementarity describe one and the same set."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import get_args

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.dcs import Model, StepFunctions, heaviside
from fesd_robot.errors import ModelError
from fesd_robot.fesd import CrossComplementarity
from fesd_robot.fesd.cross import cross_pairs, vanishing_pairs

MODES = get_args(CrossComplementarity)
COMPONENTS = 3
PAIRS = [Complementarity(Label("pair", str(i)), ca.SX.sym("G"), ca.SX.sym("H")) for i in range(COMPONENTS)]


def _products(G: np.ndarray, H: np.ndarray, mode: CrossComplementarity) -> np.ndarray:
    """G H of all pairs of an element; rows are points, with no matter what for H at the left boundary."""
    pairs = cross_pairs(PAIRS, [ca.SX(row) for row in G], [ca.SX(row) for row in [np.full(COMPONENTS, 7.0), *H]], mode)
    return np.array([float(ca.evalf(pair.G * pair.H)) for pair in pairs])


@pytest.mark.parametrize(("mode", "pairs"), [("stage_stage", 6), ("lambda_sum", 2), ("theta_sum", 3), ("sum_sum", 1)])
def test_number_of_pairs(mode: CrossComplementarity, pairs: int) -> None:
    """Two stages and the left boundary give 3 x 2, 2, 3 or 1 pairs a component, each with its place."""
    element = cross_pairs(PAIRS, [ca.SX.sym("G", COMPONENTS)] * 3, [ca.SX.sym("H", COMPONENTS)] * 3, mode)
    assert len(element) == pairs * COMPONENTS
    assert len({pair.label.place for pair in element}) == pairs
    assert len({str(pair.label) for pair in element}) == pairs * COMPONENTS
    assert {pair.label.subject for pair in element} == {"0", "1", "2"}


@pytest.mark.parametrize("seed", range(10))
def test_complementary_points_satisfy_all(seed: int) -> None:
    """Where every component has all G or all H zero, every aggregation holds."""
    rng = np.random.default_rng(seed)
    G, H = rng.uniform(0.1, 1, (3, COMPONENTS)), rng.uniform(0.1, 1, (2, COMPONENTS))
    active = rng.integers(0, 2, COMPONENTS).astype(bool)
    G[:, active], H[:, ~active] = 0, 0
    for mode in MODES:
        assert np.abs(_products(G, H, mode)).max() == 0


@pytest.mark.parametrize(("k", "j"), list(product(range(3), range(2))))
def test_one_violation_violates_all(k: int, j: int) -> None:
    """G at any point, boundary included, and H at any stage cannot both be positive."""
    G, H = np.zeros((3, COMPONENTS)), np.zeros((2, COMPONENTS))
    G[k, 1], H[j, 1] = 0.3, 0.2
    G[:, 0], H[:, 2] = 1, 1
    for mode in MODES:
        assert _products(G, H, mode).max() == pytest.approx(0.06)


def test_same_set_on_every_pattern() -> None:
    """For every pattern of zeros of a two-stage element all aggregations agree whether it is complementary."""
    for pattern in product([0.0, 1.0], repeat=5):
        G, H = (np.tile(np.array(side)[:, None], COMPONENTS) for side in (pattern[:3], pattern[3:]))
        verdicts = {bool(_products(G, H, mode).max() > 0) for mode in MODES}
        assert verdicts == {bool(G.any() and H.any())}


@pytest.mark.parametrize(("k", "j"), list(product(range(3), range(3))))
def test_neither_side_of_a_continuous_pair_is_left_before_it_is_zero(k: int, j: int) -> None:
    """G and H cannot both be positive in an element, at whichever points, its left boundary included."""
    pair = Complementarity(Label("pair"), ca.SX.sym("G"), ca.SX.sym("H"), continuous=True)
    G, H = np.zeros(3), np.zeros(3)
    G[k], H[j] = 0.3, 0.2
    for mode in MODES:
        pairs = cross_pairs([pair], [ca.SX(value) for value in G], [ca.SX(value) for value in H], mode)
        assert len({str(one.label) for one in pairs}) == len(pairs)
        assert max(float(ca.evalf(one.G * one.H)) for one in pairs) == pytest.approx(0.06)


def _vanishing(boundary_only: bool, with_complement: bool, mode: CrossComplementarity) -> ca.Function:
    """(switching function at 3 points, multiplier and complement at 2 stages each) -> G, H."""
    x, z, alpha = ca.SX.sym("x"), ca.SX.sym("z", 2), ca.SX.sym("alpha")
    system = heaviside(
        Model(x),
        StepFunctions(alpha, x),
        alpha,
        lifted=[("multiplier", z[0], ca.SX(0)), ("complement", z[1], ca.SX(0))],
        vanishing=[
            Complementarity(
                Label("no multiplier above zero"),
                x,
                z[0],
                vanishing=True,
                complement=z[1] if with_complement else None,
                level="velocity",
                held_at=HeldAt.LEFT_BOUNDARY if boundary_only else HeldAt.POINTS,
            )
        ],
    )
    switching, multipliers = ca.SX.sym("switching", 3), ca.SX.sym("multiplier", 2)
    complements = ca.SX.sym("complement", 2)
    inner = [(switching[k + 1], ca.vertcat(0, 0, 0, multipliers[k], complements[k])) for k in range(2)]
    conditions = vanishing_pairs(system, [(switching[0], ca.SX.zeros(5)), *inner], 2, mode)
    assert {condition.level for condition in conditions} == {"velocity"}
    assert all(condition.vanishing and condition.complement is None for condition in conditions)
    assert all(str(condition.label).startswith("no multiplier above zero, point ") for condition in conditions)
    G, H = (ca.vertcat(*[getattr(condition, side) for condition in conditions]) for side in "GH")
    return ca.Function("pairs", [switching, multipliers, complements], [G, H])


@pytest.mark.parametrize("boundary_only", [False, True])
@pytest.mark.parametrize("with_complement", [False, True])
def test_vanishing_constraints_hold_between_every_point_and_stage(boundary_only: bool, with_complement: bool) -> None:
    """Where G > 0 at a point, all H or all complements of the element are zero, in every aggregation."""
    functions = [_vanishing(boundary_only, with_complement, mode) for mode in MODES]
    assert functions[0].size1_out(0) == (2 if boundary_only else 6)
    assert functions[2].size1_out(0) == (1 if boundary_only else 3)
    for switching, multipliers, complements in product(
        product([-1, 0, 1], repeat=3), product([0, 1], repeat=2), product([0, 1], repeat=2)
    ):
        seen = switching[:1] if boundary_only else switching
        excluded = max(seen) > 0 and any(multipliers) and (any(complements) or not with_complement)
        for function in functions:
            G, H = (np.asarray(value).ravel() for value in function(switching, multipliers, complements))
            assert (H >= 0).all()
            assert bool((G * H).max() > 0) == excluded


@pytest.mark.parametrize("mode", MODES)
def test_a_switching_function_of_algebraic_variables_holds_at_the_stages(mode: CrossComplementarity) -> None:
    """G = x - w with an algebraic w > x(0): no condition at the left boundary, where no w is the element's own."""
    x, z, alpha = ca.SX.sym("x"), ca.SX.sym("z", 2), ca.SX.sym("alpha")
    label = Label("no multiplier above w")
    system = heaviside(
        Model(x),
        StepFunctions(alpha, x),
        alpha,
        lifted=[("multiplier", z[0], ca.SX(0)), ("w", z[1], ca.SX(0))],
    )
    condition = Complementarity(label, x - z[1], z[0], vanishing=True, held_at=HeldAt.STAGES)
    system = replace(system, complementarities=[*system.complementarities, condition])
    stages = [(ca.SX(x), ca.SX([0, 0, 0, multiplier, w])) for x, multiplier, w in ((2.0, 0.0, 3.0), (4.0, 1.0, 4.0))]
    right_end = (ca.SX(9.0), ca.SX.zeros(5))
    conditions = vanishing_pairs(system, [(ca.SX(9.0), ca.SX.zeros(5)), *stages, right_end], 2, mode)
    assert {condition.label.place.point for condition in conditions} == {1, 2}
    assert max(float(condition.G * condition.H) for condition in conditions) == 0.0
    stages[0] = (stages[0][0], ca.SX([0, 0, 0, 0, 1.0]))  # w < x at the first stage, the second has a multiplier
    violated = vanishing_pairs(system, [(ca.SX(9.0), ca.SX.zeros(5)), *stages, right_end], 2, mode)
    assert max(float(condition.G * condition.H) for condition in violated) > 0


@pytest.mark.parametrize("mode", MODES)
def test_a_condition_may_add_the_left_boundary(mode: CrossComplementarity) -> None:
    """With an initial value factor e, G at a point is x_k + e x_0; at the right boundary that of the last point."""
    x, z, alpha = ca.SX.sym("x"), ca.SX.sym("z"), ca.SX.sym("alpha")
    system = heaviside(Model(x), StepFunctions(alpha, x), alpha, lifted=[("multiplier", z, ca.SX(0))])
    points = [(ca.SX(value), ca.SX([0, 0, 0, 1.0])) for value in (-2.0, 0.5, 3.0)]

    def values(right_only: bool) -> list[float]:
        label = Label("no faster than it came")
        one = Complementarity(
            label,
            x,
            z,
            vanishing=True,
            initial_value_factor=0.8,
            held_at=HeldAt.RIGHT_BOUNDARY if right_only else HeldAt.POINTS,
        )
        own = replace(system, complementarities=[*system.complementarities, one])
        conditions = vanishing_pairs(own, points, 2, mode)
        assert all(condition.initial_value_factor == 0.0 for condition in conditions)
        return [float(condition.G) for condition in conditions]

    every, last = sorted(set(np.round(values(False), 12))), sorted(set(np.round(values(True), 12)))
    assert every == pytest.approx([-3.6, -1.1, 1.4]) and last == pytest.approx([1.4])
    with pytest.raises(ModelError):
        Complementarity(Label("both"), x, z, vanishing=True, initial_value_factor=0.8, complement=1 - z)
