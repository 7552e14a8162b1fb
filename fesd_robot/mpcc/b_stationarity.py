"""B-stationarity: whether a feasible direction descends to first order, on any branch of the biactive pairs.

The linear program with complementarity constraints at w, with d = D s and D the size of the trust region,

    min grad f^T d   s.t.  lower <= w + d <= upper,  g_lower <= g + g' d <= g_upper,  abs(d) <= D,
    G-active: G' d = 0, H + H' d >= 0;   H-active: H' d = 0, G + G' d >= 0;   biactive: 0 <= G' d _|_ H' d >= 0,

has an optimum of zero if and only if w is B-stationary in the linearised sense, which is B-stationarity itself where
the linearised cone is the tangent cone, e.g. under MPCC-MFCQ. Vanishing constraints: G <= 0 <= H where H > 0 or G < 0,
H = 0 where G > 0, and either {H = 0} or {G <= 0 <= H} where both are zero.

Sources: Luo, Pang, Ralph, Mathematical Programs with Equilibrium Constraints (1996); Leyffer, Munson, A globally
convergent filter method for MPECs (2007); Nurkanovic, Leyffer, arXiv 2501.13835.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, Label
from fesd_robot.mpcc.derivatives import Linearisation, active_set, linearise
from fesd_robot.mpcc.linear_program import LinearSolution
from fesd_robot.mpcc.lpcc import G_SIDE, Lpcc, lpcc_at
from fesd_robot.mpcc.problem import Mpcc

NO_DESCENT = 1e-5
"""Slope of the cost, relative to the gradient, that counts as no descent; HiGHS resolves about 1e-6."""

Verdict = Literal["certified", "refuted", "unknown"]


@dataclass(frozen=True)
class BCertificate:
    """Whether a direction descends from a point, by the LPCC there.

    Attributes:
        verdict: ``certified``, ``refuted`` (with a direction), or ``unknown``.
        reason: how that was decided, or why not, in words.
        slope: grad f^T d / (radius max(1, max abs(grad f))) of the best direction that was found, <= 0.
        bound: lower bound on that slope over all branches, minus infinity if none was found.
        direction: d, shape (n,), in the units of the variables; zero unless the verdict is ``refuted``.
        branch: the branch that the direction keeps to, of all pairs of the problem.
        leaving: labels of the biactive pairs that d leaves.
        biactive, unresolved: pairs with both sides zero; with both above the activity, the smaller was taken as zero.
        seconds: time spent.
    """

    verdict: Verdict
    reason: str
    slope: float
    bound: float
    direction: np.ndarray
    branch: Branch
    leaving: tuple[Label, ...]
    biactive: int
    unresolved: int
    seconds: float


def b_stationary(
    problem: Mpcc,
    w: np.ndarray,
    *,
    at: Linearisation | None = None,
    relaxed: LinearSolution | None = None,
    radius: float = 1e-2,
    activity: float = 1e-6,
    bound_activity: float | None = None,
    time_limit: float = 60.0,
) -> BCertificate:
    """Decide by the LPCC at w (head of this module) whether w is B-stationary.

    First the linear program without complementarity (if it has no descent, w is S-stationary and that suffices), then
    the branch nearest to its solution, then a mixed-integer program over all branches. A direction of descent is always
    the solution of the linear program of its branch; where the mixed-integer program claims one that is not, a search
    over linear programs decides.

    Args:
        problem: the MPCC.
        w: a feasible point, shape (n,), in the units of the problem's variables.
        at: expansion of the problem at w, if it is at hand.
        relaxed: solution of the first linear program, `relaxed_solution` with the same args, if it is at hand.
        radius: size of the trust region, abs(d_i) <= radius max(1, abs(w_i)).
        activity: a value counts as zero up to activity max(1, largest entry of its gradient), in the value's unit; keep
            it above `NO_DESCENT` radius, as constraints at a smaller distance can hide a descent.
        bound_activity: the same for the distance from bounds on variables and rows; `activity` if omitted.
        time_limit: seconds.

    Returns:
        Verdict, direction and branch; ``unknown`` if w violates a constraint by more than `activity`, if time is up, or
        if HiGHS gives out.

    Raises:
        DimensionError, SolverError: w of another shape, derivatives that are not finite.
    """
    begin = time.perf_counter()
    at = at or linearise(problem, w)
    active = active_set(at, activity, bound_activity)
    size = radius * np.maximum(1.0, abs(w))
    decision = _Decision("unknown", f"the point violates a constraint by {active.violation:.1e}")
    if active.violation <= activity:
        decision = _decide(lpcc_at(at, active, size, radius), begin + time_limit, relaxed)
    biactive = np.flatnonzero(active.biactive)
    direction, G_zero = np.zeros(problem.size), active.G | (at.vanishing & (at.G < 0))
    if decision.zero is not None and decision.s is not None:
        direction, G_zero[biactive] = decision.s * size, decision.zero[G_SIDE]
    return BCertificate(
        verdict=decision.verdict,
        reason=decision.reason,
        slope=decision.slope,
        bound=min(decision.bound, decision.slope),
        direction=direction,
        branch=Branch.of_pairs(at.pair_labels, [ActiveFactor.G if zero else ActiveFactor.H for zero in G_zero]),
        leaving=_leaving(at, biactive, direction, activity * radius),
        biactive=len(biactive),
        unresolved=int(active.unresolved.sum()),
        seconds=time.perf_counter() - begin,
    )


def relaxed_solution(
    at: Linearisation, *, activity: float, bound_activity: float, radius: float = 1e-2, time_limit: float = 60.0
) -> LinearSolution | None:
    """Return the solution of the linear program that is left of the LPCC without complementarity.

    Where its bound is zero the point is S-stationary: the dual of that program has multipliers of the right sign, and
    minus its optimum is the sum of their residuals, relative to the gradient and weighted by the trust region.

    Args:
        at, activity, bound_activity, radius, time_limit: as in `b_stationary`.

    Returns:
        None on failure, and where the point violates a constraint by more than `activity`.
    """
    deadline, active = time.perf_counter() + time_limit, active_set(at, activity, bound_activity)
    if active.violation > activity:
        return None
    lpcc = lpcc_at(at, active, radius * np.maximum(1.0, abs(at.w)), radius)
    return lpcc.solve(lpcc.undecided, deadline)


@dataclass(frozen=True)
class _Decision:
    verdict: Verdict
    reason: str
    bound: float = -np.inf
    slope: float = 0.0
    s: np.ndarray | None = None
    zero: np.ndarray | None = None


def _decide(lpcc: Lpcc, deadline: float, relaxed: LinearSolution | None) -> _Decision:
    """Return whether any branch has a slope below -`NO_DESCENT`."""
    relaxed = relaxed or lpcc.solve(lpcc.undecided, deadline)
    bound = -np.inf
    if relaxed is not None:
        bound = relaxed.bound
        if bound >= -NO_DESCENT:
            return _Decision("certified", "no descent even without complementarity", bound)
        zero = lpcc.keeping(np.argmin(lpcc.growth(relaxed.s), axis=0))
        nearest = lpcc.solve(zero, deadline)
        if nearest is not None and nearest.value < -NO_DESCENT:
            return _Decision(
                "refuted", "on the branch nearest to the relaxed solution", bound, nearest.value, nearest.s, zero
            )
    for search in (lpcc.mixed_integer, partial(lpcc.depth_first, -NO_DESCENT)):
        proven, branch = search(deadline)
        bound = max(bound, proven)
        if bound >= -NO_DESCENT:
            return _Decision("certified", "no descent on any branch", bound)
        solved = None if branch is None else lpcc.solve(branch, deadline)
        if solved is not None and solved.value < -NO_DESCENT:
            return _Decision("refuted", "found in the search over all branches", bound, solved.value, solved.s, branch)
    late = time.perf_counter() >= deadline
    return _Decision("unknown", "time limit" if late else "HiGHS could not solve a linear program", bound)


def _leaving(at: Linearisation, biactive: np.ndarray, direction: np.ndarray, least: float) -> tuple[Label, ...]:
    """Return the labels of the biactive pairs of which a side changes by more than `least`."""
    changes = np.abs([at.G_jacobian[biactive] @ direction, at.H_jacobian[biactive] @ direction]).max(axis=0)
    return tuple(at.pair_labels[pair] for pair, change in zip(biactive, changes, strict=True) if change > least)
