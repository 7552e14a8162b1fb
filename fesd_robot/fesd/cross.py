"""Cross complementarity: the pairs that let the active set change only at the boundaries of a finite element."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import casadi as ca

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.options import CrossComplementarity

PairMode = CrossComplementarity | Literal["plain"]


def cross_pairs(
    multipliers: Sequence[ca.SX], partners: Sequence[ca.SX], mode: PairMode
) -> list[tuple[str, ca.SX, ca.SX]]:
    """Return (where, G, H) of one element, four equivalent aggregations of a_k _|_ b_j for all k and j.

    ``stage_stage``: a_k _|_ b_j; ``lambda_sum``: sum_k a_k _|_ b_j; ``theta_sum``: a_k _|_ sum_j b_j;
    ``sum_sum``: sum_k a_k _|_ sum_j b_j. ``plain`` is the scheme without switch detection: a_j _|_ b_j only.

    Args:
        multipliers: a_k at the left boundary and at the stages, k = 0..n_s.
        partners: b_j at the stages, j = 1..n_s.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.2 (cross complementarity and its sparse and dense forms).
    """
    if mode == "plain":
        return [(f"stage {j}", a, b) for j, (a, b) in enumerate(zip(multipliers[1:], partners, strict=True), start=1)]
    if mode == "stage_stage":
        return [(f"stages {k}, {j}", a, b) for k, a in enumerate(multipliers) for j, b in enumerate(partners, start=1)]
    if mode == "lambda_sum":
        total = sum(multipliers[1:], multipliers[0])
        return [(f"stage {j}", total, b) for j, b in enumerate(partners, start=1)]
    sum_b = sum(partners[1:], partners[0])
    if mode == "theta_sum":
        return [(f"stage {k}", a, sum_b) for k, a in enumerate(multipliers)]
    return [("sum", sum(multipliers[1:], multipliers[0]), sum_b)]


def excluded_pairs(
    system: ComplementaritySystem, points: Sequence[tuple[ca.SX, ca.SX]], stages: int, mode: PairMode
) -> list[tuple[str, ca.SX, ca.SX, int]]:
    """Return (where, G, H, rank) of the system's exclusions in one element, with H >= 0 and max(G, 0) H = 0.

    G = level(x_k) sum_j rest_j for every point k, left boundary included, and H = sum_j share_j: the shares of an
    element are zero together, whichever point forbids them. With ``stage_stage`` every stage's share is a pair of its
    own. (A level can have any sign, so levels are never added up.) With ``plain`` a stage forbids its own share only.

    Args:
        points: (x, z) at the left boundary and at the points of the element.
        stages: number of stages among the points.
        mode: aggregation.
    """
    found = []
    for exclusion in system.exclusions:
        level = ca.Function("level", [system.state], [exclusion.level])
        rest = ca.SX(1 / stages) if exclusion.rest is None else exclusion.rest
        parts = ca.Function("parts", [system.algebraic], [exclusion.share, rest])
        values = [parts(z) for _, z in points[1 : stages + 1]]
        if mode == "plain":
            if not exclusion.boundary_only:
                found += [
                    (f"{exclusion.name}, stage {j}", level(x) * values[j - 1][1], values[j - 1][0], exclusion.rank)
                    for j, (x, _) in enumerate(points[1:], start=1)
                ]
            continue
        shares = [share for share, _ in values]
        if mode != "stage_stage":
            shares = [sum(shares[1:], shares[0])]
        rests = sum((rest for _, rest in values[1:]), values[0][1])
        levels = points[:1] if exclusion.boundary_only else points
        found += [
            (f"{exclusion.name}, point {k}, {j}", level(x) * rests, share, exclusion.rank)
            for k, (x, _) in enumerate(levels)
            for j, share in enumerate(shares)
        ]
    return found
