"""The four aggregations of cross complementarity describe one and the same set."""

from __future__ import annotations

from itertools import product
from typing import get_args

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import Exclusion, heaviside
from fesd_robot.fesd import CrossComplementarity
from fesd_robot.fesd.cross import cross_pairs, excluded_pairs

MODES = get_args(CrossComplementarity)
COMPONENTS = 3


def _products(multipliers: np.ndarray, partners: np.ndarray, mode: CrossComplementarity) -> np.ndarray:
    """G H of all pairs of an element; rows of the arguments are points."""
    pairs = cross_pairs([ca.SX(row) for row in multipliers], [ca.SX(row) for row in partners], mode)
    return np.concatenate([np.asarray(ca.evalf(G * H)).ravel() for _, G, H in pairs])


@pytest.mark.parametrize(("mode", "pairs"), [("stage_stage", 6), ("lambda_sum", 2), ("theta_sum", 3), ("sum_sum", 1)])
def test_number_of_pairs(mode: CrossComplementarity, pairs: int) -> None:
    """Two stages and the left boundary give 3 x 2, 2, 3 or 1 pairs a component, each with its place."""
    found = cross_pairs([ca.SX.sym("a", COMPONENTS)] * 3, [ca.SX.sym("b", COMPONENTS)] * 2, mode)
    assert len(found) == pairs
    assert len({where for where, _, _ in found}) == pairs
    assert all(G.numel() == H.numel() == COMPONENTS for _, G, H in found)


@pytest.mark.parametrize("seed", range(10))
def test_complementary_points_satisfy_all(seed: int) -> None:
    """Where every component has all multipliers or all partners zero, every aggregation holds."""
    rng = np.random.default_rng(seed)
    multipliers, partners = rng.uniform(0.1, 1, (3, COMPONENTS)), rng.uniform(0.1, 1, (2, COMPONENTS))
    active = rng.integers(0, 2, COMPONENTS).astype(bool)
    multipliers[:, active], partners[:, ~active] = 0, 0
    for mode in MODES:
        assert np.abs(_products(multipliers, partners, mode)).max() == 0


@pytest.mark.parametrize(("k", "j"), list(product(range(3), range(2))))
def test_one_violation_violates_all(k: int, j: int) -> None:
    """A multiplier at any point, boundary included, and a partner at any stage cannot both be positive."""
    multipliers, partners = np.zeros((3, COMPONENTS)), np.zeros((2, COMPONENTS))
    multipliers[k, 1], partners[j, 1] = 0.3, 0.2
    multipliers[:, 0], partners[:, 2] = 1, 1
    for mode in MODES:
        assert _products(multipliers, partners, mode).max() == pytest.approx(0.06)


def test_same_set_on_every_pattern() -> None:
    """For every pattern of zeros of a two-stage element all aggregations agree whether it is complementary."""
    for pattern in product([0.0, 1.0], repeat=5):
        multipliers, partners = np.array(pattern[:3])[:, None], np.array(pattern[3:])[:, None]
        verdicts = {bool(_products(multipliers, partners, mode).max() > 0) for mode in MODES}
        assert verdicts == {bool(multipliers.any() and partners.any())}


def _exclusions(boundary_only: bool, with_rest: bool, mode: CrossComplementarity) -> ca.Function:
    """(levels at 3 points, shares at 2 stages, rests at 2 stages) -> G, H."""
    x, z, alpha = ca.SX.sym("x"), ca.SX.sym("z", 2), ca.SX.sym("alpha")
    system = heaviside(
        state=x,
        alpha=alpha,
        switching=x,
        right_hand_side=alpha,
        lifted=[("share", z[0], ca.SX(0)), ("rest", z[1], ca.SX(0))],
        exclusions=[Exclusion("no share above zero", x, z[0], z[1] if with_rest else None, boundary_only, rank=1)],
    )
    levels, shares, rests = ca.SX.sym("level", 3), ca.SX.sym("share", 2), ca.SX.sym("rest", 2)
    inner = [(levels[k + 1], ca.vertcat(0, 0, 0, shares[k], rests[k])) for k in range(2)]
    pairs = excluded_pairs(system, [(levels[0], ca.SX.zeros(5)), *inner], 2, mode)
    assert {rank for _, _, _, rank in pairs} == {1}
    assert all(where.startswith("no share above zero, point ") for where, _, _, _ in pairs)
    G, H = ca.vertcat(*[pair[1] for pair in pairs]), ca.vertcat(*[pair[2] for pair in pairs])
    return ca.Function("pairs", [levels, shares, rests], [G, H])


@pytest.mark.parametrize("boundary_only", [False, True])
@pytest.mark.parametrize("with_rest", [False, True])
def test_exclusions_hold_between_every_point_and_stage(boundary_only: bool, with_rest: bool) -> None:
    """A positive level at a point leaves an element all shares zero or all rests zero, in every aggregation."""
    functions = [_exclusions(boundary_only, with_rest, mode) for mode in MODES]
    assert functions[0].size1_out(0) == (2 if boundary_only else 6)
    assert functions[2].size1_out(0) == (1 if boundary_only else 3)
    for levels, shares, rests in product(
        product([-1, 0, 1], repeat=3), product([0, 1], repeat=2), product([0, 1], repeat=2)
    ):
        seen = levels[:1] if boundary_only else levels
        excluded = max(seen) > 0 and any(shares) and (any(rests) or not with_rest)
        for function in functions:
            G, H = (np.asarray(value).ravel() for value in function(levels, shares, rests))
            assert (H >= 0).all()
            assert bool((G * H).max() > 0) == excluded
