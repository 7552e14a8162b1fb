"""The nearest an MPCC comes to its constraints: its elastic problem, in which rows may be violated at a price."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label
from fesd_robot.mpcc.problem import Block, Mpcc

NOTHING_VIOLATED = 1e-7
"""Sum of the violations up to which a branch is taken for one that holds all constraints, until its NLP says so."""

PAIR_PRICE = 10.0
"""Of the smaller side of a pair, where a violation of a row costs one: rows give way first, and are named."""


@dataclass(frozen=True)
class LeastViolation:
    """Constraints and pairs that are not met together.

    Attributes:
        total: least sum of violations, in the units of the rows and of the smaller sides of pairs.
        rows: label and violation of every row and pair that is violated there, the largest first.
        certified: whether they cannot be met nearby: the LPCC knows no branch on which the sum falls.
        w: the point, (n).
    """

    total: float
    rows: tuple[tuple[Label, float], ...]
    certified: bool
    w: np.ndarray = field(repr=False)

    def __str__(self) -> str:
        """In words."""
        first = ", ".join(f"{label} by {excess:.1e}" for label, excess in self.rows[:5])
        more = f" and {len(self.rows) - 5} more" if len(self.rows) > 5 else ""
        what = (
            "no point nearby meets all constraints"
            if self.certified
            else "no point was found that meets all constraints"
        )
        return f"{what}: {first}{more} at the least sum of violations, {self.total:.1e}"


@dataclass(frozen=True, eq=False)
class ElasticProblem:
    """min sum(s) + `PAIR_PRICE` sum(r) s.t. g_lower - s <= g(w) <= g_upper + s, 0 <= G - r_G _|_ H - r_H >= 0.

    Slacks s, r are not negative. Bounds on variables hold, and vanishing constraints get no slack.

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
            size += _slacks(block) * block.copies
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
            _, g, G, H = block.evaluate(w)
            smaller = np.minimum(G, H) * ~block.vanishing[:, None]
            parts = [block.lower[:, None] - g, g - block.upper[:, None], smaller * (G <= H), smaller * (G > H)]
            slacks.append(np.maximum(np.nan_to_num(np.vstack(parts)), 0.0).ravel(order="F"))
        return np.concatenate([w, *slacks])

    def least_violation(self, point: np.ndarray, *, certified: bool) -> LeastViolation:
        """Return what is violated at a point of the elastic problem.

        Args:
            point: of the elastic problem.
            certified: whether it is B-stationary there.
        """
        first = self.original.size
        rows: list[tuple[Label, float]] = []
        for block in self.original.blocks:
            n_g, count = len(block.lower), _slacks(block)
            slacks = point[first : first + count * block.copies].reshape((count, block.copies), order="F")
            first += slacks.size
            pairs = slacks[2 * n_g :]
            for excess, label in (
                (slacks[:n_g] + slacks[n_g : 2 * n_g], block.constraint_label),
                (pairs[: block.pairs] + pairs[block.pairs :], block.pair_label),
            ):
                found = np.argwhere(excess > NOTHING_VIOLATED)
                rows += [(label(int(row), int(copy)), float(excess[row, copy])) for row, copy in found]
        rows.sort(key=lambda one: -one[1])
        total = float(point[self.original.size :].sum())
        return LeastViolation(total, tuple(rows), certified, point[: self.original.size])


def _slacks(block: Block) -> int:
    """Return the number of slacks of one copy."""
    return 2 * len(block.lower) + 2 * block.pairs


def _elastic(block: Block, first: int) -> Block:
    """Return the block with slacks of its rows and pairs, whose global indices begin at the given one."""
    own, n_g, count = block.equations, len(block.lower), _slacks(block)
    slack = ca.SX.sym("slack", count)
    sides = slack[2 * n_g :]
    conditions = [
        one if one.vanishing else replace(one, G=one.G - sides[i], H=one.H - sides[own.pairs + i])
        for i, one in enumerate(own.complementarities)
    ]
    equations = replace(
        own,
        variables=ca.vertcat(own.variables, slack),
        cost=ca.sum1(slack[: 2 * n_g]) + PAIR_PRICE * ca.sum1(sides) if count else ca.SX(0),
        rows=own.rows + slack[:n_g] - slack[n_g : 2 * n_g],
        complementarities=conditions,
        while_relaxed=ca.SX(0),
        if_exploited=ca.SX(0),
    )
    added = first + np.arange(count * block.copies).reshape((count, block.copies), order="F")
    return replace(block, equations=equations, index=np.vstack([block.index, added]))
