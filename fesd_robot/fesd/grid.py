"""Control intervals of a trajectory: of equal length at fixed times, or moving with its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import DimensionError
from fesd_robot.instants import SAME_NODE


@checked
@dataclass(frozen=True)
class Span:
    """A part of the horizon, s of its nominal duration: the control intervals between its ends.

    Where both ends are one time it is the interval that ends there.
    """

    begin: float
    end: float


@checked
@dataclass(frozen=True)
class ControlGrid:
    """Control intervals, in the order of time.

    A **uniform** grid has intervals of one length, and nothing moves. On a **moving** grid the lengths are variables
    of the problem: those of one phase are equal, the durations of phases are free, and what happens at a given time
    has a node there, a **knot**.

    Args:
        lengths: of the intervals, s, (N); where the solver starts if they are variables.
        phases: number of intervals of every phase; of a uniform grid one for all of them.
        moving: whether the lengths are variables.
        knots: numbers of the nodes, 1 .. N, that stay at their times; the last node is one of them.

    Raises:
        DimensionError: phases that do not add up, or a knot that is no node.
    """

    lengths: tuple[float, ...]
    phases: tuple[int, ...]
    moving: bool
    knots: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.lengths)
        if sum(self.phases) != count or min(self.phases, default=0) < 1:
            raise DimensionError(f"phases of {self.phases} intervals, expected positive numbers with the sum {count}")
        if any(not 1 <= knot <= count for knot in self.knots):
            raise DimensionError(f"knots {self.knots}, expected numbers from 1 to {count}")

    @classmethod
    def uniform(cls, duration: float, intervals: int) -> ControlGrid:
        """Return the grid of intervals of one length.

        Args:
            duration: sum of all lengths, s.
            intervals: number N of them.
        """
        return cls((duration / intervals,) * intervals, (intervals,), moving=False)

    @property
    def intervals(self) -> int:
        """Number N of control intervals."""
        return len(self.lengths)

    @cached_property
    def nodes(self) -> np.ndarray:
        """Ends of intervals, the start first, (N + 1), s; of a moving grid where the solver starts."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def within_phases(self) -> list[int]:
        """Numbers of the intervals whose successor is in the same phase."""
        last = set(np.cumsum(self.phases) - 1)
        return [k for k in range(self.intervals) if k not in last]

    def between(self, where: Sequence[int] | Span) -> Sequence[int]:
        """Return the numbers of the intervals of a part of the horizon.

        Args:
            where: numbers, as they are, or a span.

        Raises:
            DimensionError: a span that ends where the grid has no node.
        """
        if not isinstance(where, Span):
            return where
        first, last = self._node(where.begin), self._node(where.end)
        return range(first - 1, first) if first == last else range(first, last)

    def _node(self, time: float) -> int:
        node = int(np.argmin(np.abs(self.nodes - time)))
        if abs(self.nodes[node] - time) > SAME_NODE * self.nodes[-1]:
            raise DimensionError(f"the grid has no node at {time:g} s, the nearest is at {self.nodes[node]:g} s")
        return node
