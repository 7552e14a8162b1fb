"""The branch NLP of one branch alone: rows that it does not hold are not even computed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.element_blocks import ELEMENT
from fesd_robot.fesd.polishing.transcription import BranchTranscription
from fesd_robot.mpcc import Block, BlockEquations, BranchBounds, Mpcc
from fesd_robot.nlp import NlpPoint

REMEMBERED = 16
"""Equations with some of the rows that are kept."""


@dataclass(frozen=True)
class OneBranch:
    """A branch transcription whose elements have the rows of one branch only.

    The problem of a `BranchTranscription` serves all branches, with a row for every quantity that one of them holds.
    In space most of its work is for rows that bound nothing: here elements that hold the same rows are a block.

    Attributes:
        own: of all branches.
        branch: whose rows are kept.
    """

    own: BranchTranscription
    branch: Branch

    @property
    def problem(self) -> Mpcc:
        """The problem without pairs, and without the rows that the branch does not hold."""
        return self._reduced[0]

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """The branch."""
        return iter([self.branch])

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """Return that without the elements that have shrunk to nothing, None if it holds rows that are left out."""
        updated = self.own.updated_branch(branch, w)
        return updated if updated is not None and self._has_rows_of(updated) else None

    def whole(self, point: NlpPoint) -> NlpPoint:
        """Return a point with multipliers of all rows, zero where the branch does not hold them."""
        lam_g = np.zeros(self.own.problem.constraints)
        lam_g[self._reduced[1]] = point.lam_g
        return replace(point, lam_g=lam_g)

    def bounds(self, branch: Branch) -> BranchBounds:
        """Return the bounds that keep the active factors of a branch at zero."""
        bounds, rows = self.own.bounds(branch), self._reduced[1]
        return replace(bounds, g_lower=bounds.g_lower[rows], g_upper=bounds.g_upper[rows])

    def _has_rows_of(self, branch: Branch) -> bool:
        held = _held(self.own.bounds(branch))
        held[self._reduced[1]] = False
        return not held.any()

    @cached_property
    def _reduced(self) -> tuple[Mpcc, np.ndarray]:
        """The problem, and which row of the whole one each of its rows is."""
        whole, held = self.own.problem, _held(self.own.bounds(self.branch))
        blocks, rows, first = list[Block](), list[np.ndarray](), 0
        for block in whole.blocks:
            count = len(block.lower)
            numbers = first + np.arange(count)[:, None] + count * np.arange(block.copies)
            first += count * block.copies
            if block.name != ELEMENT:
                blocks.append(block)
                rows.append(numbers.ravel(order="F"))
                continue
            for kept, copies in _alike(held[numbers]):
                blocks.append(_part(block, kept, copies))
                rows.append(numbers[np.ix_(kept, copies)].ravel(order="F"))
        return replace(whole, blocks=blocks), np.concatenate(rows)


def _held(bounds: BranchBounds) -> np.ndarray:
    return np.isfinite(bounds.g_lower) | np.isfinite(bounds.g_upper)


def _alike(held: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the rows that copies hold, and these copies; none that hold nothing.

    Args:
        held: which rows each copy holds, (rows, copies).
    """
    kinds, which = np.unique(held, axis=1, return_inverse=True)
    for number, kind in enumerate(kinds.T):
        if kind.any():
            yield np.flatnonzero(kind), np.flatnonzero(np.ravel(which) == number)


def _part(block: Block, rows: np.ndarray, copies: np.ndarray) -> Block:
    """Return some copies of a block with some of its rows."""
    return Block(
        equations=_with_rows(block.equations, tuple(rows.tolist())),
        places=[block.places[copy] for copy in copies],
        index=block.index[:, copies],
        values=block.values[:, copies],
    )


@lru_cache(maxsize=REMEMBERED)
def _with_rows(equations: BlockEquations, rows: tuple[int, ...]) -> BlockEquations:
    return replace(
        equations,
        rows=equations.rows[list(rows)],
        lower=equations.lower[list(rows)],
        upper=equations.upper[list(rows)],
        constraints=[equations.constraints[row] for row in rows],
    )
