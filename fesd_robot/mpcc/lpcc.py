"""The LPCC at a point: a linear program in which every biactive pair keeps one of its two sides at zero."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from fesd_robot.mpcc.derivatives import ActiveSet, Linearisation, row_scales
from fesd_robot.mpcc.linear_program import LinearSolution, solve_linear_program
from fesd_robot.mpcc.quiet import silent_highs

_RELATIVE_GAP = 0.9
"""Relative gap at which the mixed-integer program stops; any gap below 1 leaves a direction of descent."""

_SIDE_NOISE = 1e-8
"""A side that grows by less, relative to the trust region and its gradient, stays zero."""

G_SIDE, H_SIDE = 0, 1
"""Rows of arrays that have one entry for each side of a biactive pair."""


@dataclass(frozen=True)
class Lpcc:
    """min cost^T s, low <= s <= high, row_low <= A s <= row_high, and G s <= 0 or H s <= 0 for biactive pairs.

    Attributes:
        cost, low, high: of s = d / D, (n,).
        matrix, row_low, row_high: of g, then all G, then all H; rows divided by their largest entry.
        sides: rows of G and H of the k biactive pairs, shape (2, k).
    """

    cost: np.ndarray
    low: np.ndarray
    high: np.ndarray
    matrix: sparse.csr_array
    row_low: np.ndarray
    row_high: np.ndarray
    sides: np.ndarray

    def growth(self, s: np.ndarray) -> np.ndarray:
        """Return by how much the sides G and H of the biactive pairs grow, shape (2, k)."""
        return (self.matrix[self.sides.ravel()] @ s).reshape(self.sides.shape)

    @property
    def undecided(self) -> np.ndarray:
        """No side of a biactive pair has to stay at zero, (2, k)."""
        return np.zeros(self.sides.shape, dtype=bool)

    def keeping(self, side: np.ndarray) -> np.ndarray:
        """Return the booleans (2, k) in which every biactive pair keeps the given side, (k,), at zero."""
        return np.array([side == G_SIDE, side == H_SIDE])

    def solve(self, zero: np.ndarray, deadline: float) -> LinearSolution | None:
        """Return the solution of the linear program in which some sides stay at zero; None on failure.

        Args:
            zero: which sides of the biactive pairs may not grow (of a vanishing constraint: G <= 0), (2, k); of a pair
                with none both may.
            deadline: in the time of `time.perf_counter`.
        """
        row_high = self.row_high.copy()
        row_high[self.sides[zero]] = 0.0
        seconds = deadline - time.perf_counter()
        return solve_linear_program(self.cost, self.matrix, self.row_low, row_high, self.low, self.high, seconds)

    def mixed_integer(self, deadline: float) -> tuple[float, np.ndarray | None]:
        """Return a lower bound over all branches and the zero sides of a good one, None if there is none.

        Binaries z with G s <= z max(G s) and H s <= (1 - z) max(H s), maxima over the box of s: no constant is guessed.
        HiGHS's tolerance of 1e-6 in z lets both sides grow a little, so that the bound may be too low, never too high.
        """
        n, k = len(self.cost), self.sides.shape[1]
        rows = self.matrix[self.sides.ravel()]
        reach = np.maximum(rows.maximum(0.0) @ self.high + rows.minimum(0.0) @ self.low, 0.0)
        choice = sparse.diags_array(reach) @ sparse.vstack([-sparse.eye_array(k), sparse.eye_array(k)])
        plain = sparse.hstack([self.matrix, sparse.csr_array((len(self.row_low), k))])
        remaining = deadline - time.perf_counter()
        if remaining <= 0:
            return -np.inf, None
        with silent_highs():
            result = milp(
                np.append(self.cost, np.zeros(k)),
                integrality=np.append(np.zeros(n), np.ones(k)),
                bounds=Bounds(np.append(self.low, np.zeros(k)), np.append(self.high, np.ones(k))),
                constraints=[
                    LinearConstraint(sparse.csr_array(plain), self.row_low, self.row_high),
                    LinearConstraint(
                        sparse.csr_array(sparse.hstack([rows, choice])), -np.inf, np.append(np.zeros(k), reach[k:])
                    ),
                ],
                options={"time_limit": remaining, "mip_rel_gap": _RELATIVE_GAP},
            )
        bound = -np.inf if result.mip_dual_bound is None else float(result.mip_dual_bound)
        return bound, None if result.x is None else self.keeping(np.where(result.x[n:] < 0.5, G_SIDE, H_SIDE))

    def depth_first(self, threshold: float, deadline: float) -> tuple[float, np.ndarray | None]:
        """Return the zero sides of a branch below the threshold, or else a lower bound over all branches.

        Every node is a linear program without binaries, exact to its tolerance; it is dropped above the threshold.
        """
        nodes, bound = [self.undecided], 0.0
        while nodes:
            zero = nodes.pop()
            solved = self.solve(zero, deadline)
            if solved is None:
                return -np.inf, None
            if solved.bound >= threshold:
                bound = min(bound, solved.bound)
                continue
            undecided = ~zero.any(axis=0)
            if not undecided.any():
                return -np.inf, zero
            growth = self.growth(solved.s)
            smaller = np.where(undecided, growth.min(axis=0), -np.inf)
            at = int(np.argmax(smaller))
            if smaller[at] <= _SIDE_NOISE:
                nearest = np.where(undecided, self.keeping(np.argmin(growth, axis=0)), zero)
                leaf = self.solve(nearest, deadline)
                if leaf is None or leaf.bound < threshold:
                    return -np.inf, None if leaf is None else nearest
            # The side that grows less is kept first.
            for side in (int(np.argmax(growth[:, at])), int(np.argmin(growth[:, at]))):
                child = zero.copy()
                child[side, at] = True
                nodes.append(child)
        return bound, None


def lpcc_at(at: Linearisation, active: ActiveSet, size: np.ndarray, radius: float) -> Lpcc:
    """Return the LPCC in s = d / D, active constraints moved to exactly zero.

    Args:
        at: expansion at the point.
        active: what counts as zero there.
        size: D, the trust region, in the units of the variables, (n,).
        radius: by which, and by max(1, max abs(grad f)), the cost is divided.
    """
    blocks, lows, highs = [], [], []
    vanishing, free = at.vanishing, np.inf
    G_low = np.where(vanishing, -free, np.where(active.G, 0.0, -at.G))
    G_high = np.where(active.G, 0.0, np.where(vanishing & (at.G < 0), -at.G, free))
    H_low = np.where(active.H, 0.0, -at.H)
    H_high = np.where(active.H & (~vanishing | (at.G > 0)), 0.0, free)
    G_high[active.biactive] = H_high[active.biactive] = free
    for jacobian, low, high in (
        (
            at.g_jacobian,
            np.where(active.g_lower, 0.0, at.g_lower - at.g),
            np.where(active.g_upper, 0.0, at.g_upper - at.g),
        ),
        (at.G_jacobian, G_low, G_high),
        (at.H_jacobian, H_low, H_high),
    ):
        matrix = sparse.csr_array(jacobian @ sparse.diags_array(size))
        scale = row_scales(matrix)
        blocks.append(sparse.diags_array(1.0 / scale) @ matrix)
        lows.append(low / scale)
        highs.append(high / scale)
    where, first = np.flatnonzero(active.biactive), len(at.g)
    return Lpcc(
        cost=at.gradient * size / (radius * max(1.0, float(abs(at.gradient).max(initial=0.0)))),
        low=np.maximum(-1.0, np.where(active.lower, 0.0, (at.lower - at.w) / size)),
        high=np.minimum(1.0, np.where(active.upper, 0.0, (at.upper - at.w) / size)),
        matrix=sparse.csr_array(sparse.vstack(blocks)),
        row_low=np.concatenate(lows),
        row_high=np.concatenate(highs),
        sides=np.array([first + where, first + len(at.G) + where]),
    )
