"""The nearest an MPCC comes to its constraints: its elastic problem, in which rows may be violated at a price."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label
from fesd_robot.mpcc.problem import Block, Mpcc

NOTHING_VIOLATED = 1e-7
"""Sum of the violations up to which a branch is taken for one that holds all constraints, until its NLP says so."""


@dataclass(frozen=True)
class LeastViolation:
    """Constraints that cannot be met together near a point, on no branch of the pairs that are zero there.

    Attributes:
        total: least sum of violations, in the units of the rows.
        rows: label and violation of every row that is violated there, the largest first.
        w: the point, (n).
    """

    total: float
    rows: tuple[tuple[Label, float], ...]
    w: np.ndarray = field(repr=False)

    def __str__(self) -> str:
        """In words."""
        first = ", ".join(f"{label} by {excess:.1e}" for label, excess in self.rows[:5])
        more = f" and {len(self.rows) - 5} more" if len(self.rows) > 5 else ""
        return f"no point nearby meets all constraints: {first}{more} at the least sum of violations, {self.total:.1e}"


@dataclass(frozen=True, eq=False)
class ElasticProblem:
    """min sum(s) over w and s >= 0, s.t. g_lower - s <= g(w) <= g_upper + s, the bounds and the pairs of an MPCC.

    Args:
        original: the MPCC.
        problem: the elastic one; w comes first in its variables.

    Source: the feasibility problem of Fletcher, Leyffer 2002, with complementarity.
    """

    original: Mpcc
    problem: Mpcc

    @classmethod
    def of(cls, original: Mpcc) -> ElasticProblem:
        """Return the elastic problem of an MPCC."""
        blocks, size = [], original.size
        for block in original.blocks:
            blocks.append(_elastic(block, size))
            size += 2 * len(block.lower) * block.copies
        added = size - original.size
        problem = Mpcc(
            lower=np.append(original.lower, np.zeros(added)),
            upper=np.append(original.upper, np.full(added, np.inf)),
            start=np.append(original.start, np.zeros(added)),
            blocks=blocks,
        )
        return cls(original, problem)

    def at(self, w: np.ndarray) -> np.ndarray:
        """Return w with the least slacks that it needs."""
        slacks = [np.zeros(0)]
        for block in self.original.blocks:
            _, g, _, _ = block.evaluate(w)
            both = np.vstack([block.lower[:, None] - g, g - block.upper[:, None]])
            slacks.append(np.maximum(np.nan_to_num(both), 0.0).ravel(order="F"))
        return np.concatenate([w, *slacks])

    def least_violation(self, point: np.ndarray) -> LeastViolation:
        """Return what is violated at a point of the elastic problem."""
        w, first = point[: self.original.size], self.original.size
        rows: list[tuple[Label, float]] = []
        for block in self.original.blocks:
            n_g = len(block.lower)
            slacks = point[first : first + 2 * n_g * block.copies].reshape((2 * n_g, block.copies), order="F")
            first += slacks.size
            excess = slacks[:n_g] + slacks[n_g:]
            found = np.argwhere(excess > NOTHING_VIOLATED)
            rows += [(block.constraint_label(row, copy), float(excess[row, copy])) for row, copy in found]
        rows.sort(key=lambda one: -one[1])
        return LeastViolation(float(point[self.original.size :].sum()), tuple(rows), w)


def _elastic(block: Block, first: int) -> Block:
    """Return the block with slacks of its rows, whose global indices begin at the given one."""
    own, n_g = block.equations, len(block.lower)
    slack = ca.SX.sym("slack", 2 * n_g)
    equations = replace(
        own,
        variables=ca.vertcat(own.variables, slack),
        cost=ca.sum1(slack) if n_g else ca.SX(0),
        rows=own.rows + slack[:n_g] - slack[n_g:],
        while_relaxed=ca.SX(0),
        if_exploited=ca.SX(0),
    )
    added = first + np.arange(2 * n_g * block.copies).reshape((2 * n_g, block.copies), order="F")
    return replace(block, equations=equations, index=np.vstack([block.index, added]))
