"""A trajectory whose branch is known, by its clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.instants import SAME_PART

CLOCK = "clock"
"""Name of the state that is the physical time."""


@dataclass(frozen=True)
class KnownTrajectory:
    """A trajectory whose branch is known, of any transcription.

    Attributes:
        elements: in time order.
        branch: of the trajectory.
        tableau: of its scheme.
        clock: index of the state that is the physical time. The last control is its speed: an element lasts as long, in
            physical terms, as its length times that.
    """

    elements: Sequence[Element]
    branch: Branch
    tableau: Tableau
    clock: int

    @classmethod
    def of(cls, motion: BranchMotion) -> KnownTrajectory:
        """Return a trajectory without its transcription."""
        ocp = motion.transcription.ocp
        clock = ocp.clock.state if ocp.clock else list(ocp.system.state_names).index(CLOCK)
        return cls(motion.elements, motion.branch, motion.transcription.options.tableau, clock)

    @cached_property
    def whole(self) -> list[Element]:
        """Elements that have a length."""
        own = zip(self.elements, self.branch.without_length, strict=True)
        return [element for element, without in own if not without and element.step > 0]

    @cached_property
    def running(self) -> list[Element]:
        """Elements in which the clock runs."""
        return [element for element in self.whole if self._advance(element) > SAME_PART * self.duration]

    @cached_property
    def frozen(self) -> list[Element]:
        """Elements in which the clock stands still."""
        return [element for element in self.whole if self._advance(element) <= SAME_PART * self.duration]

    @property
    def duration(self) -> float:
        """Physical time at its end."""
        return float(self.whole[-1].x[-1, self.clock])

    def at(self, time: float) -> tuple[Element, float]:
        """Return the element in which the clock shows a physical time, and about where in numerical time."""
        element = self.running[min(int(np.searchsorted(self._ends, time)), len(self.running) - 1)]
        begin, end = element.x_left[self.clock], element.x[-1, self.clock]
        fraction = float(np.clip((time - begin) / (end - begin), 0.0, 1.0))
        return element, element.start + fraction * element.step

    @cached_property
    def _ends(self) -> np.ndarray:
        return np.array([element.x[-1, self.clock] for element in self.running])

    def _advance(self, element: Element) -> float:
        """Return how far the clock goes in an element."""
        return float(element.x[-1, self.clock] - element.x_left[self.clock])
