"""Where the variables of a whole trajectory sit among those of its MPCC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import Place
from fesd_robot.fesd.layout import IntervalLayout


@dataclass(frozen=True)
class TrajectoryIndices:
    """Indices of the variables, which are ordered in time: (x, z) at the start, then interval by interval.

    Attributes:
        layouts: order of an interval's own variables by number of elements.
        elements: finite elements of every interval, (N).
    """

    layouts: Mapping[int, IntervalLayout]
    elements: tuple[int, ...]

    @property
    def intervals(self) -> int:
        """Number N of control intervals."""
        return len(self.elements)

    def layout(self, k: int) -> IntervalLayout:
        """Return the order of the own variables of interval k."""
        return self.layouts[self.elements[k]]

    @cached_property
    def _sizes(self) -> tuple[int, int, int]:
        layout = self.layout(0)
        return layout.n_x, layout.n_z, layout.n_u

    @cached_property
    def offsets(self) -> np.ndarray:
        """Index of the first own variable of every interval, (N)."""
        sizes = [self.layouts[count].size for count in self.elements]
        return sum(self._sizes[:2]) + np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)

    def point(self, k: int) -> np.ndarray:
        """Return indices of the (x, z) that interval k starts from, (n_x + n_z); k = N is the end of the horizon."""
        if k == 0:
            return np.arange(sum(self._sizes[:2]))
        layout = self.layout(k - 1)
        return self.offsets[k - 1] + layout.end(layout.elements - 1)

    def state(self, k: int) -> np.ndarray:
        """Return the indices of the state that interval k starts from, (n_x); k = N gives the end of the horizon."""
        return self.point(k)[: self._sizes[0]]

    def control(self, k: int) -> np.ndarray:
        """Return the indices of the control of interval k, (n_u)."""
        return self.offsets[k] + np.arange(self._sizes[2])

    def own(self, k: int) -> np.ndarray:
        """Return the indices of the own variables of interval k."""
        return self.offsets[k] + np.arange(self.layout(k).size)

    def place(self, element: int) -> Place:
        """Return the place of an element, by its number in time order."""
        k = int(np.searchsorted(self._last, element, side="right"))
        return Place(interval=k, element=int(element - (self._last[k - 1] if k else 0)))

    def step(self, element: int) -> int:
        """Return the index of the length of an element, by its number in time order."""
        k, n = self._at(element)
        return int(self.offsets[k]) + self.layout(k).step(n)

    def left_state(self, element: int) -> np.ndarray:
        """Return indices of the state that an element starts from, (n_x), after a jump if it may."""
        k, n = self._at(element)
        layout = self.layout(k)
        state = self.state(k) if n == 0 else self.offsets[k] + layout.end(n - 1)[: self._sizes[0]]
        if layout.jump_size:
            state = state.copy()
            state[list(layout.jump_states)] = self.offsets[k] + layout.jumped(n)
        return state

    def element(self, element: int) -> np.ndarray:
        """Return indices for `layout_of` one element: (x, z) at its left boundary, u, and its own variables."""
        k, n = self._at(element)
        layout, first = self.layout(k), self.offsets[k]
        left = self.point(k) if n == 0 else first + layout.end(n - 1)
        own = first + np.arange(layout.step(n), layout.step(n + 1))
        return np.concatenate([left, self.control(k), own])

    def stage(self, element: int, stage: int) -> np.ndarray:
        """Return the indices of (x, z) at a stage of an element, (n_x + n_z)."""
        k, n = self._at(element)
        x, z = self.layout(k).state(n, stage), self.layout(k).algebraic(n, stage)
        return self.offsets[k] + np.concatenate([np.arange(x.start, x.stop), np.arange(z.start, z.stop)])

    @cached_property
    def _last(self) -> np.ndarray:
        """Number of the first element after every interval, (N)."""
        return np.cumsum(self.elements)

    def _at(self, element: int) -> tuple[int, int]:
        """Return the interval of an element, and its number there."""
        place = self.place(element)
        assert place.interval is not None and place.element is not None
        return place.interval, place.element
