"""How stationary a point is: Lagrange multipliers by linear programs, and their signs on pairs with G = H = 0.

At w, with Lagrange multipliers z of bounds, lambda of g, nu of G and xi of H,

    grad f - z_lower + z_upper + g'^T lambda - G'^T nu - H'^T xi = 0,

z >= 0, lambda of the sign of its bound, nu = 0 where G > 0 and xi = 0 where H > 0. On biactive pairs (G = H = 0)

    W: no further condition    C: nu xi >= 0    M: nu xi = 0 or nu, xi > 0    S: nu, xi >= 0.

A vanishing constraint (H >= 0, G H <= 0) has nu = 0 unless G = 0, nu <= 0 if G = 0, xi = 0 if H > 0, xi >= 0 if
H = 0 > G and a free xi if H = 0 < G. Where G = H = 0, W: nu <= 0; C: also nu xi >= 0; M: also nu xi = 0; S: nu = 0 and
xi >= 0. With these signs C, M and S read as for the other pairs. What is C here is known as T-stationary.

S and W do not depend on how a feasible set is written in pairs. M and C do: a pair that is stated twice, or whose side
is also a constraint, can only weaken them.

Sources: Scheel, Scholtes, Math. Oper. Res. 25 (2000); for vanishing constraints Achtziger, Kanzow, Math. Program. 114
(2008) (S), Hoheisel, Kanzow, J. Math. Anal. Appl. 337 (2008) (M, W), Dorsch, Shikhman, Stein, J. Global Optim. 52
(2012) (T).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fesd_robot.mpcc.derivatives import Linearisation, active_set, linearise
from fesd_robot.mpcc.multipliers import Multipliers, StationarityEquation, least_residual, stationarity_equation
from fesd_robot.mpcc.problem import Mpcc

Kind = Literal["S", "M", "C", "W", "none"]

_SIGN_NOISE = 1e-9
"""A scaled Lagrange multiplier below this is zero."""

_SIGN_BOXES: dict[Kind, tuple[tuple[tuple[float, float], tuple[float, float]], ...]] = {
    "M": (((0.0, 0.0), (np.inf, np.inf)), ((0.0, -np.inf), (0.0, np.inf)), ((-np.inf, 0.0), (np.inf, 0.0))),
    "C": (((0.0, 0.0), (np.inf, np.inf)), ((-np.inf, -np.inf), (0.0, 0.0))),
}
"""Boxes (lowest, highest) of (nu, xi) whose union is what M and C allow."""

_Node = tuple[np.ndarray, np.ndarray]
"""Lowest and highest multipliers, (m,) each, in a search over signs."""

_SIGN_COST = 1e-4
"""Price of a wrong sign against a residual while multipliers with few wrong signs are looked for."""


@dataclass(frozen=True)
class Stationarity:
    """The strongest stationarity condition that holds at a point.

    Attributes:
        kind: the strongest condition that holds; ``none`` if there are no multipliers at all.
        residual: largest entry of the stationarity equation for `multipliers`, divided by max(1, max abs(grad f)).
        biactive: number of pairs with both sides zero.
        unresolved: number of pairs with both sides above the activity, the smaller of which was taken as zero.
        violation: of the constraints at the point, relative to max(1, largest entry of the gradient).
        multipliers: Lagrange multipliers with which `kind` holds; those of least residual if it is ``none``.
        worst_pairs: names of biactive pairs whose multipliers are against S, worst first, at most five.
        undecided: conditions stronger than `kind` that are open, for want of time or because HiGHS gave up.
    """

    kind: Kind
    residual: float
    biactive: int
    unresolved: int
    violation: float
    multipliers: Multipliers
    worst_pairs: tuple[str, ...]
    undecided: tuple[Kind, ...] = ()


def stationarity(
    problem: Mpcc,
    w: np.ndarray,
    *,
    at: Linearisation | None = None,
    activity: float = 1e-6,
    bound_activity: float | None = None,
    tolerance: float = 1e-6,
    time_limit: float = 60.0,
) -> Stationarity:
    """Return the strongest of S-, M-, C- and W-stationarity that holds at w (equations at the head of this module).

    S and W are a linear program each, min ||c + A y||_1 over the signs of y. M and C branch over the biactive pairs by
    depth-first search: a node whose box of y leaves a residual is dropped. Of many multipliers small ones are returned;
    ones above 1e7, rows divided by their largest entry, do not count as existing.

    Args:
        problem: the MPCC.
        w: a feasible point, shape (n,), in the units of the problem's variables.
        at: expansion of the problem at w, if it is at hand.
        activity: a value counts as zero up to activity max(1, largest entry of its gradient), in the value's unit.
        bound_activity: the same for the distance from bounds on variables and rows; `activity` if omitted.
        tolerance: largest entry of the stationarity equation, relative to max(1, max abs(grad f)).
        time_limit: seconds; what they do not suffice for is listed in `undecided`.

    Returns:
        Kind, residual, multipliers and the pairs that stand against S. Feasibility of w is reported, not required.

    Raises:
        DimensionError, SolverError: w of another shape, derivatives that are not finite.
    """
    deadline = time.perf_counter() + time_limit
    at = at or linearise(problem, w)
    active = active_set(at, activity, bound_activity)
    equation = stationarity_equation(at, active)
    kind, y, undecided = _strongest(equation, tolerance, deadline)
    against = (-y[equation.pairs]).max(axis=1, initial=-np.inf)
    order = np.argsort(-against)[:5]
    return Stationarity(
        kind=kind,
        residual=equation.residual(y),
        biactive=len(equation.pairs),
        unresolved=int(active.unresolved.sum()),
        violation=active.violation,
        multipliers=equation.unpack(y),
        worst_pairs=tuple(str(at.pair_labels[equation.pair_rows[i]]) for i in order if against[i] > _SIGN_NOISE),
        undecided=undecided,
    )


def _strongest(
    equation: StationarityEquation, tolerance: float, deadline: float
) -> tuple[Kind, np.ndarray, tuple[Kind, ...]]:
    """Return the strongest condition, Lagrange multipliers with which it holds, and what was left open."""
    undecided: list[Kind] = []
    strict = equation.low.copy()
    strict[equation.pairs.ravel()] = 0.0
    y = least_residual(equation, strict, equation.high, deadline)
    if y is not None and equation.residual(y) <= tolerance:
        return "S", y, ()
    undecided += ["S"] if y is None else []
    y = least_residual(equation, equation.low, equation.high, deadline)
    if y is None or equation.residual(y) > tolerance:
        undecided += ["M", "C", "W"] if y is None else []
        return "none", np.zeros(len(equation.low)) if y is None else y, tuple(undecided)
    candidates: tuple[Kind, ...] = ("M", "C")
    for kind in candidates:
        signed, complete = _search(equation, kind, tolerance, deadline)
        if signed is not None:
            return kind, signed, tuple(undecided)
        undecided += [] if complete else [kind]
    fewer = least_residual(equation, equation.low, equation.high, deadline, sign_cost=_SIGN_COST)
    return "W", y if fewer is None or equation.residual(fewer) > tolerance else fewer, tuple(undecided)


def _search(
    equation: StationarityEquation, kind: Kind, tolerance: float, deadline: float
) -> tuple[np.ndarray | None, bool]:
    """Return Lagrange multipliers that satisfy M or C, None if there are none, and whether the search was complete."""
    nodes, complete, together = [(equation.low, equation.high)], True, True
    while nodes:
        if time.perf_counter() >= deadline:
            return None, False
        node = nodes.pop()
        y = None
        for sign_cost in (_SIGN_COST, 0.0):
            y = least_residual(equation, *node, deadline, sign_cost=sign_cost)
            if y is not None and equation.residual(y) <= tolerance:
                break
        else:
            complete &= y is not None
            together = False
            continue
        nu, xi = y[equation.pairs].T
        against = (np.minimum(nu, xi) < 0) if kind == "M" else (nu * xi < 0)
        wrong = np.where(against, np.minimum(abs(nu), abs(xi)), 0.0)
        pairs = [equation.pairs[at] for at in np.argsort(-wrong) if wrong[at] > _SIGN_NOISE]
        if not pairs:
            return y, True
        # Depth first; the branch that is nearest to y comes off the stack first. Before it, as long as that leads on,
        # comes the part of it that is nearest in all wrong pairs: a hundred one after the other take too long.
        nodes += _parts(node, pairs[0], kind, y)
        if together and len(pairs) > 1:
            for pair in pairs:
                *_, node = _parts(node, pair, kind, y)
            nodes.append(node)
    return None, complete


def _parts(node: _Node, pair: np.ndarray, kind: Kind, y: np.ndarray) -> list[_Node]:
    """Return the parts of a node in which a pair has the signs of a kind, the one nearest to y, (m,), last."""
    found: list[_Node] = []
    for least, most in sorted(_SIGN_BOXES[kind], key=lambda box: -float(abs(np.clip(y[pair], *box) - y[pair]).sum())):
        low, high = node[0].copy(), node[1].copy()
        low[pair], high[pair] = np.maximum(low[pair], least), np.minimum(high[pair], most)
        if (low[pair] <= high[pair]).all():
            found.append((low, high))
    return found
