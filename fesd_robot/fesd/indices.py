"""Where the variables of a whole trajectory sit among those of its MPCC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

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
        """Order of the own variables of interval k."""
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
        """Indices of the (x, z) that interval k starts from, (n_x + n_z); k = N gives the end of the horizon."""
        if k == 0:
            return np.arange(sum(self._sizes[:2]))
        layout = self.layout(k - 1)
        return self.offsets[k - 1] + layout.end(layout.elements - 1)

    def state(self, k: int) -> np.ndarray:
        """Indices of the state that interval k starts from, (n_x); k = N gives the end of the horizon."""
        return self.point(k)[: self._sizes[0]]

    def control(self, k: int) -> np.ndarray:
        """Indices of the control of interval k, (n_u)."""
        return self.offsets[k] + np.arange(self._sizes[2])

    def own(self, k: int) -> np.ndarray:
        """Indices of the own variables of interval k."""
        return self.offsets[k] + np.arange(self.layout(k).size)
