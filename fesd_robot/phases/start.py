"""Where the solve of a sequence begins: along another motion, by the clock."""

from __future__ import annotations

from collections.abc import Sequence as ListOf
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Element, Tableau, Transcription, at_stages
from fesd_robot.instants import SAME_PART
from fesd_robot.phases.discretised import Discretised
from fesd_robot.phases.reading import sequence_of
from fesd_robot.phases.sequence import Sequence

CLOCK = "clock"
"""Name of the state that is the physical time."""

STANDSTILL = 0.01
"""Numerical time of an impact that the other motion does not have."""

NEAR_OF_INTERVAL = 0.2
"""Of an interval: how far away an impact of the other motion may be that an impact begins as."""


@dataclass(frozen=True)
class Along:
    """A motion of the same system, of which another one takes its start.

    Attributes:
        all_elements: of it, in time order.
        branch: on which it lies.
        tableau: of its scheme.
        clock: index of the state that is the physical time.
    """

    all_elements: ListOf[Element]
    branch: Branch
    tableau: Tableau
    clock: int

    @classmethod
    def of(cls, transcription: Transcription, w: np.ndarray, branch: Branch) -> Along:
        """Return the motion that a point of a transcription is, on a branch."""
        clock = transcription.ocp.clock
        state = clock.state if clock else list(transcription.ocp.system.state_names).index(CLOCK)
        return cls(transcription.unpack(w), branch, transcription.options.tableau, state)

    @property
    def sequence(self) -> Sequence:
        """Its phases."""
        return sequence_of(self.branch, self.all_elements, self.clock)

    @cached_property
    def elements(self) -> list[Element]:
        """That have a length."""
        all_of_them = zip(self.all_elements, self.branch.without_length, strict=True)
        return [element for element, without in all_of_them if not without and element.step > 0]

    @cached_property
    def running(self) -> list[Element]:
        """Those in which the clock runs."""
        clock, length = self.clock, SAME_PART * self.duration
        return [element for element in self.elements if element.x[-1, clock] - element.x_left[clock] > length]

    @cached_property
    def frozen(self) -> list[Element]:
        """Those in which it stands still."""
        clock, length = self.clock, SAME_PART * self.duration
        return [element for element in self.elements if element.x[-1, clock] - element.x_left[clock] <= length]

    @property
    def duration(self) -> float:
        """s."""
        return float(self.elements[-1].x[-1, self.clock])

    @cached_property
    def _ends(self) -> np.ndarray:
        return np.array([element.x[-1, self.clock] for element in self.running])

    def at(self, time: float) -> tuple[Element, float]:
        """Return the element in which the clock shows a time, s, and about where in numerical time."""
        element = self.running[min(int(np.searchsorted(self._ends, time)), len(self.running) - 1)]
        begin, end = element.x_left[self.clock], element.x[-1, self.clock]
        fraction = float(np.clip((time - begin) / (end - begin), 0.0, 1.0))
        return element, element.start + fraction * element.step

    def point(self, new: Discretised) -> np.ndarray:
        """Return the start of a sequence along the motion, (n)."""
        transcription, tableau = new.transcription, new.transcription.options.tableau
        old = self.tableau
        grid, clock = transcription.grid, self.clock
        fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
        nothing = np.zeros((tableau.stages, transcription.ocp.system.state.numel()))
        stretch = grid.nodes[-1] / self.duration
        hits, jump = list(self.frozen), transcription.ocp.system.jump
        elements: list[Element] = []
        start = 0.0
        for k, count in enumerate(transcription.elements):
            begin, length = float(grid.nodes[k]) / stretch, grid.lengths[k] / stretch
            middle, _ = self.at(begin + 0.5 * length)
            x_left = elements[-1].x[-1] if elements else self.elements[0].x_before
            z_left = elements[-1].z[-1] if elements else self.elements[0].z_left
            last = len(new.sequence.at_end) if k == grid.intervals - 1 and jump is None else 0
            for n in range(count):
                part = n - (count - last - new.parts)
                if 0 <= part < new.parts:
                    inside = [self.at(begin + (part + share) / new.parts * length) for share in fractions]
                    x = np.vstack([element.at(old, np.array([at])) for element, at in inside])
                    x[:, clock] *= stretch
                    z = np.vstack([at_stages(element, element.z, at, old) for element, at in inside])
                    rate = (middle.x[-1, clock] - middle.x_left[clock]) / middle.step
                    step = length * stretch / rate / new.parts
                else:
                    at = begin + (length if n >= count - last else 0.0)
                    near = [e for e in hits if abs(e.x_left[clock] - at) <= NEAR_OF_INTERVAL * length]
                    if near:
                        hits.remove(near[0])
                        x, z, step = self._impact(near[0], fractions)
                        x[:, clock] *= stretch
                    else:
                        x, z = np.tile(x_left, (len(fractions), 1)), np.tile(z_left, (len(fractions), 1))
                        step = STANDSTILL
                elements.append(Element(k, start, step, x_left, z_left, x, z, middle.u, nothing))
                start, x_left, z_left = start + step, x[-1], z[-1]
        return transcription.pack(_with_jumps(elements, transcription))

    def _impact(self, one: Element, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return states, algebraic variables and numerical time of an impact of the motion, at fractions of it."""
        if len(one.x) == len(fractions):
            return one.x.copy(), one.z, one.step
        times, tableau = one.start + one.step * fractions, self.tableau
        return one.at(tableau, times), np.vstack([at_stages(one, one.z, at, tableau) for at in times]), one.step


def _with_jumps(elements: list[Element], transcription: Transcription) -> list[Element]:
    """Return the elements with jumps that change nothing, for a system whose state may jump."""
    jump = transcription.ocp.system.jump
    if jump is None:
        return elements
    still = [
        np.concatenate([element.x_left[list(jump.states)], np.zeros(jump.size - len(jump.states))])
        for element in elements
    ]
    return [
        Element(e.interval, e.start, e.step, e.x_left, e.z_left, e.x, e.z, e.u, e.slopes, y, e.x_left)
        for e, y in zip(elements, still, strict=True)
    ]
