"""Small MPCCs and their solutions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Level
from fesd_robot.mpcc import Mpcc

W = ca.SX.sym("w", 3)
X, Y, Z = W[0], W[1], W[2]


def mpcc(f: ca.SX, G: ca.SX, H: ca.SX, start: list[float], **parts: Any) -> Mpcc:
    """An MPCC of the first len(start) variables of `W`."""
    return Mpcc.from_expressions(w=W[: len(start)], f=f, G=G, H=H, start=np.array(start, dtype=float), **parts)


def from_origin(f: ca.SX, G: ca.SX, H: ca.SX, n: int = 2, **parts: Any) -> Mpcc:
    """An MPCC of the first n variables of `W`, started at zero."""
    return mpcc(f, G, H, [0.0] * n, **parts)


def vanishing(problem: Mpcc, level: Level = "position", where: np.ndarray | None = None) -> Mpcc:
    """The same with G of any sign in all pairs, or in those of `where` only, and all pairs of one level."""
    (block,) = problem.blocks
    flags = np.ones(block.pairs, dtype=bool) if where is None else where
    conditions = [
        replace(one, vanishing=bool(flag), level=level)
        for one, flag in zip(block.complementarities, flags, strict=True)
    ]
    return replace(problem, blocks=[replace(block, equations=replace(block.equations, complementarities=conditions))])


def scaled(problem: Mpcc, f: float = 1.0, g: float = 1.0, G: float = 1.0, H: float = 1.0) -> Mpcc:
    """The same with cost, rows and both sides of every pair multiplied by factors; the rows' bounds stay."""
    (block,) = problem.blocks
    conditions = [replace(one, G=G * one.G, H=H * one.H) for one in block.complementarities]
    own = block.equations
    equations = replace(own, cost=f * own.cost, rows=g * own.rows, complementarities=conditions)
    return replace(problem, blocks=[replace(block, equations=equations)])


def upper_rows(*rows: ca.SX) -> dict[str, Any]:
    """Rows <= 0 as parts of `mpcc`."""
    return {"g": ca.vertcat(*rows), "g_bounds": (None, 0.0)}


def lower_rows(*rows: ca.SX) -> dict[str, Any]:
    """Rows >= 0 as parts of `mpcc`."""
    return {"g": ca.vertcat(*rows), "g_bounds": (0.0, None)}


@dataclass(frozen=True)
class Known:
    """A problem and its solutions.

    Args:
        solutions: all local minima that a homotopy may end in; none if the problem is infeasible.
        distance: how far from one of them a product of 1e-8 may leave the point.
    """

    name: str
    problem: Mpcc
    solutions: tuple[tuple[float, ...], ...]
    distance: float = 1e-6

    def error(self, w: np.ndarray) -> float:
        """Largest deviation of w from the nearest solution."""
        return min(float(np.abs(w - solution).max()) for solution in self.solutions)


KNOWN = (
    # The nearer axis wins; the other one has a local minimum of its own.
    Known("near_miss", mpcc((X - 1) ** 2 + (Y - 2) ** 2, X, Y, [0, 0]), ((0, 2), (1, 0))),
    Known("equality", mpcc((X - 2) ** 2 + (Y - 1) ** 2, X, Y, [1, 1], g=X + Y - 2), ((2, 0), (0, 2))),
    # kth1 of MacMPEC: both sides zero with positive multipliers.
    Known("corner", mpcc(X + Y, X, Y, [1, 1]), ((0, 0),), 1.1e-4),
    Known("no_strict_complementarity", mpcc(X**2 + Y**2, X, Y, [1, 1]), ((0, 0),), 1.1e-4),
    Known("half_strict_complementarity", mpcc(X**2 + Y, X, Y, [1, 1]), ((0, 0),), 3e-3),
    # ralph2 of MacMPEC: relaxed solutions are (sqrt(sigma), sqrt(sigma)).
    Known("falling_into_the_corner", mpcc(X**2 + Y**2 - 4 * X * Y, X, Y, [1, 1]), ((0, 0),), 1.1e-4),
    # jr1 of MacMPEC.
    Known("moved_pair", mpcc((Y - 1) ** 2 + X**2, Y, Y - X, [0, 0]), ((0.5, 0.5),)),
    # scholtes4 of MacMPEC (Scheel and Scholtes 2000, example 3): B-stationary, not S-stationary.
    Known("no_multipliers", mpcc(X + Y - Z, X, Y, [0, 0, 0], **upper_rows(Z - 4 * X, Z - 4 * Y)), ((0, 0, 0),), 5e-4),
    # Global minimum, so B-stationary; the multipliers of both sides add up to -1, so it is M- but not S-stationary.
    Known(
        "b_not_s_stationary", mpcc(X**2 + Y - 2 * Z, X, Y, [1, 1, 0], **upper_rows(Z - X, Z - Y)), ((0, 0, 0),), 5e-4
    ),
    Known(
        "redundant_pair",
        mpcc((X - 1) ** 2 + (Y - 2) ** 2, ca.vertcat(X, X), ca.vertcat(Y, Y), [0, 0]),
        ((0, 2), (1, 0)),
    ),
    Known("g_negative", vanishing(mpcc((X + 1) ** 2 + (Y - 1) ** 2, X, Y, [0.5, 0.5])), ((-1, 1),)),
    Known("g_blocked", vanishing(mpcc((X - 1) ** 2 + (Y - 2) ** 2, X, Y, [0.5, 0.5]), "velocity"), ((0, 2), (1, 0))),
    Known("h_blocked", vanishing(mpcc((X - 2) ** 2 + (Y + 1) ** 2, X, Y, [0.5, 0.5])), ((2, 0),)),
    Known("infeasible", mpcc(X**2 + Y**2, X, Y, [1, 1], bounds=(1.0, None)), ()),
)
