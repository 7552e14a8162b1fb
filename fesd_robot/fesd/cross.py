"""Cross complementarity: the pairs that let the active set change only at the boundaries of a finite element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import casadi as ca

from fesd_robot.complementarity import Complementarity, HeldAt, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.options import CrossComplementarity

PairMode = CrossComplementarity | Literal["plain"]


def cross_pairs(
    pairs: Sequence[Complementarity], G: Sequence[ca.SX], H: Sequence[ca.SX], mode: PairMode
) -> list[Complementarity]:
    """Return the pairs of one element, four equivalent aggregations of G_k _|_ H_j for all k and j.

    ``stage_stage``: G_k _|_ H_j; ``lambda_sum``: sum_k G_k _|_ H_j; ``theta_sum``: G_k _|_ sum_j H_j;
    ``sum_sum``: sum_k G_k _|_ sum_j H_j. ``plain`` is the scheme without switch detection: G_j _|_ H_j only. Of a pair
    with continuous sides H takes part at the left boundary, too: j = 0..n_s.

    Args:
        pairs: of the system, (n_pairs).
        G, H: values of all G and H at the left boundary and at the points, k = 0..n_s, (n_pairs) each.
        mode: aggregation.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.2 (cross complementarity and its sparse and dense forms).
    """
    groups = [([i for i, pair in enumerate(pairs) if pair.continuous is own], int(not own)) for own in (False, True)]
    return [
        replace(pairs[i], label=pairs[i].label.at(place), G=G_values[i], H=H_values[i])
        for members, first in groups
        if members
        for place, G_values, H_values in _aggregated(G, H, first, mode)
        for i in members
    ]


def _aggregated(G: Sequence[ca.SX], H: Sequence[ca.SX], first: int, mode: PairMode) -> list[tuple[Place, ca.SX, ca.SX]]:
    """Return place, G and H of every pair; H takes part from point `first` on."""
    if mode == "plain":
        return [(Place(stage=j), a, b) for j, (a, b) in enumerate(zip(G[1:], H[1:], strict=True), start=1)]
    H = H[first:]
    if mode == "stage_stage":
        return [(Place(point=k, stage=j), a, b) for k, a in enumerate(G) for j, b in enumerate(H, start=first)]
    if mode == "lambda_sum":
        total = sum(G[1:], G[0])
        return [(Place(stage=j), total, b) for j, b in enumerate(H, start=first)]
    sum_H = sum(H[1:], H[0])
    if mode == "theta_sum":
        return [(Place(point=k), a, sum_H) for k, a in enumerate(G)]
    return [(Place(), sum(G[1:], G[0]), sum_H)]


def vanishing_pairs(
    system: ComplementaritySystem, points: Sequence[tuple[ca.SX, ca.SX]], stages: int, mode: PairMode
) -> list[Complementarity]:
    """Return the system's vanishing constraints in one element, with H >= 0 and max(G, 0) H = 0.

    ``G = g(x_k) sum_j C_j`` for the switching function g at every point k, left boundary included, and
    ``H = sum_j H_j``: the multipliers of an element are zero together, whichever point forbids them. With
    ``stage_stage`` every stage's multiplier is a pair of its own. (A switching function can have any sign, so its
    values are never added up.) With ``plain`` a stage forbids its own multiplier only. A switching function that
    contains algebraic variables takes part at the stages only, or is crossed: g(x_k, z_j) for all points and stages.
    One that adds its value at the left boundary is g(x_k) + e g(x_0). An H that is 0 or larger than a least value takes
    part in a vanishing constraint of its own, `Complementarity.at_least`.

    Args:
        system: the dynamics.
        points: (x, z) at the left boundary and at the points of the element.
        stages: number of stages among the points.
        mode: aggregation.

    Source: the conditions of vanishing constraints are ours; see `contact.multiplier_contact_system`.
    """
    conditions = []
    least = [one.at_least for one in system.vanishing if one.at_least is not None]
    for condition in (*system.vanishing, *least):
        switching = ca.Function("switching", [system.state, system.algebraic], [condition.G])
        complement = ca.SX(1 / stages) if condition.complement is None else condition.complement
        factors = ca.Function("factors", [system.algebraic], [condition.H, complement])
        values = [factors(z) for _, z in points[1 : stages + 1]]

        def at(place: Place, G: ca.SX, H: ca.SX, condition: Complementarity = condition) -> Complementarity:
            return replace(
                condition,
                label=condition.label.at(place),
                G=G,
                H=H,
                complement=None,
                initial_value_factor=0.0,
                spare=None,
            )

        def switched(k: int, condition: Complementarity = condition, switching: ca.Function = switching) -> ca.SX:
            value = switching(*points[k])
            return (
                value + condition.initial_value_factor * switching(*points[0])
                if condition.initial_value_factor
                else value
            )

        if mode == "plain":
            if condition.held_at is not HeldAt.LEFT_BOUNDARY:
                conditions += [
                    at(Place(stage=j), switched(j) * values[j - 1][1], values[j - 1][0])
                    for j in range(_plain_from(condition, len(points)), len(points))
                ]
            continue
        if condition.held_at is HeldAt.POINTS_AND_STAGES:
            conditions += [
                at(Place(point=k, stage=j), switching(points[k][0], points[j][1]), values[j - 1][0])
                for k in range(len(points))
                for j in range(1, stages + 1)
            ]
            continue
        multipliers = [multiplier for multiplier, _ in values]
        if mode != "stage_stage":
            multipliers = [sum(multipliers[1:], multipliers[0])]
        complements = sum((complement for _, complement in values[1:]), values[0][1])
        first, last = _range_of_points(condition, stages, len(points))
        conditions += [
            at(
                Place(point=k, stage=j if len(multipliers) > 1 else None),
                switched(k) * complements,
                multiplier,
            )
            for k in range(first, last)
            for j, multiplier in enumerate(multipliers, start=1)
        ]
    return conditions


def _plain_from(condition: Complementarity, points: int) -> int:
    """Return the first point at which a scheme without switch detection holds a condition."""
    return points - 1 if condition.held_at is HeldAt.RIGHT_BOUNDARY else 1


def _range_of_points(condition: Complementarity, stages: int, points: int) -> tuple[int, int]:
    """Return the first point, 0 is the left boundary, at which G takes part, and the one after the last."""
    if condition.held_at.algebraic:
        return 1, stages + 1
    if condition.held_at is HeldAt.RIGHT_BOUNDARY:
        return points - 1, points
    return 0, 1 if condition.held_at is HeldAt.LEFT_BOUNDARY else points
