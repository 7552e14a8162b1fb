"""A polisher for any MPCC: every pair keeps one of its two sides at zero."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.errors import SolverError
from fesd_robot.mpcc.polishing import BranchBounds
from fesd_robot.mpcc.problem import Block, Mpcc
from fesd_robot.nlp import NlpPoint


@dataclass(frozen=True)
class PairPolisher:
    """The branch NLP with G = 0 (vanishing constraint: G <= 0 <= H) or H = 0 in every pair, pair by pair.

    It uses neither elements nor contacts; `fesd.polishing.BranchTranscription` is better where a problem has them.

    Args:
        with_pairs: the problem to polish.
    """

    with_pairs: Mpcc

    @cached_property
    def problem(self) -> Mpcc:
        """The problem with G and H among its rows."""
        return replace(self.with_pairs, blocks=[_with_sides(block) for block in self.with_pairs.blocks])

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """Return the branch on which the smaller side of every pair is zero, then the one that the LPCC prefers."""
        smaller_G = []
        for block in self.with_pairs.blocks:
            _, _, G, H = block.evaluate(w)
            smaller_G.append((G <= H).ravel(order="F"))
        factors = [ActiveFactor.G if G_zero else ActiveFactor.H for G_zero in np.concatenate(smaller_G)]
        smaller = Branch.of_pairs(self.with_pairs.pair_labels, factors)
        yield smaller
        preferred = self._by_lpcc(w)
        if preferred is not None and preferred != smaller:
            yield preferred

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """Return the branch of a point where the NLP gave up; None if it is the same."""
        preferred = self._by_lpcc(w)
        return None if preferred is None or preferred == branch else preferred

    def whole(self, point: NlpPoint) -> NlpPoint:
        """Return the point: the problem has all rows."""
        return point

    def bounds(self, branch: Branch) -> BranchBounds:
        """Return the bounds that keep the active factors of a branch at zero."""
        lower, upper, first = [], [], 0
        G_active = np.array([factor is ActiveFactor.G for factor in branch.factors[0]], dtype=bool)
        for block in self.with_pairs.blocks:
            count = block.pairs * block.copies
            G_zero = G_active[first : first + count].reshape((block.pairs, block.copies), order="F")
            free = block.vanishing[:, None]
            g_low, g_high = (np.tile(bound[:, None], (1, block.copies)) for bound in (block.lower, block.upper))
            G_low, G_high = np.where(free, -np.inf, 0.0) + 0 * G_zero, np.where(G_zero, 0.0, np.inf)
            H_low, H_high = np.zeros(G_zero.shape), np.where(G_zero, np.inf, 0.0)
            lower.append(np.vstack([g_low, G_low, H_low]).ravel(order="F"))
            upper.append(np.vstack([g_high, G_high, H_high]).ravel(order="F"))
            first += count
        problem = self.with_pairs
        return BranchBounds(problem.lower.copy(), problem.upper.copy(), np.concatenate(lower), np.concatenate(upper))

    def _by_lpcc(self, w: np.ndarray) -> Branch | None:
        from fesd_robot.mpcc.b_stationarity import b_stationary  # the linear programs take long to import

        try:
            certificate = b_stationary(self.with_pairs, w, activity=1e-3, time_limit=5.0)
        except SolverError:
            return None
        return certificate.branch if certificate.verdict != "unknown" else None


def _with_sides(block: Block) -> Block:
    """Return the block without pairs, their sides as rows."""
    own = block.equations
    conditions, free = own.complementarities, np.full(2 * own.pairs, np.inf)
    equations = replace(
        own,
        rows=ca.vertcat(own.rows, *[one.G for one in conditions], *[one.H for one in conditions]),
        lower=np.append(own.lower, -free),
        upper=np.append(own.upper, free),
        constraints=[
            *own.constraints,
            *(replace(one.label, kind=f"{side} of {one.label.kind}") for side in "GH" for one in conditions),
        ],
        complementarities=(),
    )
    return replace(block, equations=equations)
