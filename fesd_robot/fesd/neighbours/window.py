"""The part of a motion around a move that is solved again to try it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.neighbours.contact_modes import ContactModes
from fesd_robot.fesd.neighbours.patterns import in_flight, intervals_of
from fesd_robot.fesd.polishing import ElementConditions
from fesd_robot.fesd.transcription import Transcription

REACH = 20
"""Intervals on either side of a move that belong to its window at least."""


@dataclass(frozen=True)
class Surroundings:
    """Windows of the moves from a branch: they begin and end where a contact has a force.

    In flight a robot cannot choose where it goes, so that a window that ends there would forbid most moves.

    Attributes:
        transcription: of a collocation scheme.
        conditions: what can vanish in an element.
        branch: the branch.
    """

    transcription: Transcription
    conditions: ElementConditions
    branch: Branch

    @cached_property
    def _intervals(self) -> list[range]:
        return intervals_of(self.transcription.elements)

    @cached_property
    def _in_flight(self) -> list[bool]:
        """Of every interval."""
        modes = [one for one in ContactModes.of(self.conditions, self.branch) if not one.is_joint]
        return [in_flight(modes, self.branch, own) for own in self._intervals]

    def window(self, intervals: range) -> range:
        """Return the intervals around some others."""
        first, last = max(intervals.start - REACH, 0), min(intervals.stop + REACH, len(self._in_flight)) - 1
        while first > 0 and self._in_flight[first]:
            first -= 1
        while last < len(self._in_flight) - 1 and self._in_flight[last]:
            last += 1
        return range(first, last + 1)

    def elements(self, window: range) -> slice:
        """Return which elements are in a window."""
        own = self._intervals
        return slice(own[window.start].start, own[window.stop - 1].stop)

    def variables(self, window: range) -> np.ndarray:
        """Return which variables may move in a window, (n): all but the states that it begins and ends in."""
        indices = self.transcription.indices
        free = np.zeros(self.transcription.problem.size, dtype=bool)
        for k in window:
            free[indices.own(k)] = True
        if window.stop < len(self._in_flight):
            free[indices.point(window.stop)] = False
        if window.start == 0:
            free[indices.point(0)] = True
        return free
