"""A polisher for any MPCC: every pair keeps one of its two sides at zero."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.polishing import Held
from fesd_robot.mpcc.problem import Block, Mpcc


@dataclass(frozen=True)
class PairPolisher:
    """The smooth problem with G = 0 (one-sided: G <= 0 <= H) or H = 0 in every pair, pair by pair.

    It knows nothing of elements or contacts; `fesd.finish.BranchTranscription` is better for what it can read.

    Args:
        with_pairs: the problem to finish.
    """

    with_pairs: Mpcc

    @cached_property
    def problem(self) -> Mpcc:
        """The problem with G and H among its rows."""
        full = self.with_pairs
        return Mpcc(lower=full.lower, upper=full.upper, start=full.start, blocks=[_with_sides(b) for b in full.blocks])

    def readings(self, w: np.ndarray) -> Iterator[np.ndarray]:
        """Return which side of every pair is zero, (n_pairs,), True for G: the smaller one; then what the LPCC says."""
        sides = []
        for block in self.with_pairs.blocks:
            _, _, G, H = block.evaluate(w)
            sides.append((G <= H).ravel(order="F"))
        smaller = np.concatenate(sides)
        yield smaller
        decided = self._by_lpcc(w)
        if decided is not None and (decided != smaller).any():
            yield decided

    def revised(self, structure: np.ndarray, w: np.ndarray) -> np.ndarray | None:
        """Return the sides that a point where the NLP gave up means; None if they are the same."""
        decided = self._by_lpcc(w)
        return None if decided is None or (decided == structure).all() else decided

    def held(self, structure: np.ndarray) -> Held:
        """Return the bounds that keep these sides at zero."""
        lower, upper, first = [], [], 0
        for block in self.with_pairs.blocks:
            count = len(block.pair_names) * block.copies
            G_zero = structure[first : first + count].reshape((len(block.pair_names), block.copies), order="F")
            free = block.sign_free[:, None]
            g_low, g_high = (np.tile(bound[:, None], (1, block.copies)) for bound in (block.lower, block.upper))
            G_low, G_high = np.where(free, -np.inf, 0.0) + 0 * G_zero, np.where(G_zero, 0.0, np.inf)
            H_low, H_high = np.zeros(G_zero.shape), np.where(G_zero, np.inf, 0.0)
            lower.append(np.vstack([g_low, G_low, H_low]).ravel(order="F"))
            upper.append(np.vstack([g_high, G_high, H_high]).ravel(order="F"))
            first += count
        problem = self.with_pairs
        return Held(problem.lower.copy(), problem.upper.copy(), np.concatenate(lower), np.concatenate(upper))

    def _by_lpcc(self, w: np.ndarray) -> np.ndarray | None:
        from fesd_robot.mpcc.lpcc import b_stationary  # the linear programs take long to import

        try:
            found = b_stationary(self.with_pairs, w, activity=1e-3, time_limit=5.0)
        except SolverError:
            return None
        return found.G_side if found.verdict != "unknown" else None


def _with_sides(block: Block) -> Block:
    """Return the block without pairs, their sides as rows."""
    w, p = (ca.SX.sym(name, block.function.sparsity_in(i)) for i, name in enumerate("wp"))
    f, g, G, H = block.function(w, p)
    rows, count, nothing = ca.vertcat(g, ca.vec(G), ca.vec(H)), len(block.pair_names), ca.SX(0, 1)
    return Block(
        copy_names=block.copy_names,
        function=ca.Function(block.function.name(), [w, p], [f, rows, nothing, nothing]),
        index=block.index,
        parameters=block.parameters,
        lower=np.append(block.lower, np.full(2 * count, -np.inf)),
        upper=np.append(block.upper, np.full(2 * count, np.inf)),
        constraint_names=[*block.constraint_names, *(f"{side} of {n}" for side in "GH" for n in block.pair_names)],
        pair_names=[],
    )
