"""The kind of a stationary point, and whether a direction descends from it, in one call."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Branch, Label
from fesd_robot.errors import DimensionError, OptionError
from fesd_robot.mpcc.problem import Mpcc
from fesd_robot.running import SearchEffort

ACTIVITY = 0.1
"""A side of a pair counts as zero up to this times the root of the largest product."""

BOUND_ACTIVITY = 1e-6
"""Distance from a bound up to which it counts as met, at least: an interior-point method stops before it."""

SHARE_OF_DESCENT = 2 / 3
"""Of the time limit, for the answer whether a direction descends. A kind between S and W is found early, if at all."""


@dataclass(frozen=True)
class Certificate:
    """The kind of a stationary point.

    Attributes:
        kind: ``S``, ``M``, ``C``, ``W`` or ``none``, the strongest that holds.
        b_stationary: ``certified`` if no feasible direction descends to first order, ``refuted`` if one does, else
            ``unknown`` (time limit).
        biactive: pairs with both sides zero.
        unresolved: pairs of which no side is small enough to count as zero; their smaller side is taken for it.
        residual: of the stationarity equation, relative to the gradient.
        branch: of all pairs, on which a direction descends; None unless it is refuted.
        direction: that direction, (n); None unless it is refuted.
        slope: of the cost along it, for a step as long as the trust region, relative to the gradient; zero unless it is
            refuted.
        leaving: labels of the biactive pairs that it leaves.
        followed: number of branches on which the direction was followed without gain.
        bound: lower bound on the slope over all branches; minus infinity if none was found in time.
    """

    kind: Literal["S", "M", "C", "W", "none"]
    b_stationary: Literal["certified", "refuted", "unknown"]
    biactive: int
    unresolved: int
    residual: float
    branch: Branch | None = None
    direction: np.ndarray | None = None
    slope: float = 0.0
    leaving: tuple[Label, ...] = ()
    followed: int = 0
    bound: float = -np.inf


@checked
def certify(
    problem: Mpcc,
    w: np.ndarray,
    *,
    tolerance: float = 1e-8,
    time_limit: float = SearchEffort.certificate_seconds,
    without: Callable[[np.ndarray], Mpcc | None] | None = None,
) -> Certificate:
    """Return what kind of stationary point w is, by linear programs (`stationarity`, `b_stationary`).

    The first of them asks for a descent without complementarity: where there is none, w is S- and so B-stationary. Else
    a branch that descends is looked for, and then the kind: where a direction is only one that the caller does not
    want, its kind is not asked for.

    Args:
        problem: the MPCC.
        w: a solution, (n).
        tolerance: largest product of a pair at w.
        time_limit: seconds; the answer whether a direction descends takes `SHARE_OF_DESCENT` of them at most, that of
            which kind w is the rest.
        without: called with a direction of descent, (n); returns the problem without what that gains from, of which it
            is asked again, or None if the direction stands.

    Raises:
        DimensionError: w of another shape.
        OptionError: a tolerance that is not positive.
        SolverError: derivatives that are not finite.

    Source: Scheel & Scholtes, Math. Oper. Res. 25, 2000; Nurkanovic & Leyffer, arXiv 2501.13835.
    """
    # The linear programs take long to import, and few runs need them.
    from fesd_robot.mpcc.b_stationarity import NO_DESCENT, b_stationary, relaxed_solution
    from fesd_robot.mpcc.derivatives import active_set, linearise
    from fesd_robot.mpcc.stationarity import stationarity

    if np.shape(w) != problem.start.shape:
        raise DimensionError(f"w has shape {np.shape(w)}, expected {problem.start.shape}")
    if not tolerance > 0:
        raise OptionError(f"found a tolerance of {tolerance:g}, expected one greater than 0")
    activity = ACTIVITY * tolerance**0.5
    activities = {"activity": activity, "bound_activity": max(activity, BOUND_ACTIVITY)}
    deadline = time.perf_counter() + SHARE_OF_DESCENT * time_limit
    while True:
        at = linearise(problem, w)
        relaxed = relaxed_solution(at, **activities, time_limit=deadline - time.perf_counter())
        if relaxed is not None and relaxed.bound >= -NO_DESCENT:
            active = active_set(at, **activities)
            biactive, unresolved = int(active.biactive.sum()), int(active.unresolved.sum())
            return Certificate("S", "certified", biactive, unresolved, -relaxed.bound)
        # It begins with the same program, which has failed for want of time if none is left.
        left = max(deadline - time.perf_counter(), 0.0)
        b = b_stationary(problem, w, at=at, relaxed=relaxed, **activities, time_limit=left)
        narrower = without(b.direction) if without and b.verdict == "refuted" else None
        if narrower is None:
            break
        problem = narrower
    kind = stationarity(problem, w, at=at, **activities, time_limit=(1 - SHARE_OF_DESCENT) * time_limit)
    if kind.kind == "S":  # Lagrange multipliers of the right sign leave no branch a way down
        return Certificate("S", "certified", kind.biactive, kind.unresolved, kind.residual)
    found = Certificate(kind.kind, b.verdict, kind.biactive, kind.unresolved, kind.residual, bound=b.bound)
    if b.verdict != "refuted":
        return found
    return replace(found, branch=b.branch, direction=b.direction, slope=b.slope, leaving=b.leaving)
