"""The bounds that hold a structure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fesd_robot.fesd.polishing.conditions import Alternative, Choice, Quantity
from fesd_robot.fesd.polishing.reading import Structure
from fesd_robot.mpcc import Held

if TYPE_CHECKING:
    from fesd_robot.fesd.polishing.transcription import BranchTranscription


class Point(NamedTuple):
    """A point of the trajectory.

    Attributes:
        state, algebraic: index of its first state and algebraic variable among the variables of the problem.
        row: index of its first row.
    """

    state: int
    algebraic: int
    row: int


class Holding:
    """Where the points of a smooth transcription sit, and the bounds that hold a structure at them."""

    def __init__(self, smooth: BranchTranscription) -> None:
        transcription = smooth.transcription
        self._alternatives = smooth.alternatives
        self._n_x = transcription.ocp.system.state.numel()
        self._problem = smooth.problem
        self._stages = transcription.options.tableau.stages
        self._start_is_free = bool((transcription.ocp.initial_lower < transcription.ocp.initial_upper).any())
        self._start = Point(0, self._n_x, len(transcription.problem.blocks[0].lower))
        self._steps: list[int] = []
        self._points: list[list[Point]] = []
        self._state_rows: list[dict[int, list[int]]] = []
        rows, first_row = self._alternatives.row_count, len(self._problem.blocks[0].lower)
        for block, count in zip(self._problem.blocks[1:], transcription.intervals, strict=False):
            layout = transcription.layouts[count]
            where = [k for k, c in enumerate(transcription.elements) if c == count]
            base = len(block.lower) - count * smooth.points * rows
            named = _state_rows(block.constraint_names[:base], transcription.ocp.system.state_names, count)
            for copy, k in enumerate(where):
                row = first_row + copy * len(block.lower)
                offset = int(transcription.indices.offsets[k])
                for n in range(count):
                    self._steps.append(offset + layout.step(n))
                    self._points.append(
                        [
                            Point(
                                offset + layout.state(n, j).start,
                                offset + layout.algebraic(n, j).start,
                                row + base + (n * smooth.points + j) * rows,
                            )
                            for j in range(smooth.points)
                        ]
                    )
                    self._state_rows.append({i: [row + r for r in found] for i, found in named[n].items()})
            first_row += len(block.lower) * len(where)
        order = np.argsort(self._steps)  # blocks may hold intervals out of order
        self._steps = [self._steps[i] for i in order]
        self._points = [self._points[i] for i in order]
        self._state_rows = [self._state_rows[i] for i in order]

    def held(self, structure: Structure) -> Held:
        """Return the bounds on variables and rows."""
        problem = self._problem
        self._lower, self._upper = problem.lower.copy(), problem.upper.copy()
        self._g_lower = np.concatenate([np.tile(block.lower, block.copies) for block in problem.blocks])
        self._g_upper = np.concatenate([np.tile(block.upper, block.copies) for block in problem.blocks])
        left, before = self._start, None
        for e, (choices, collapsed) in enumerate(zip(structure.choices, structure.collapsed, strict=True)):
            if collapsed:
                self._collapse(e, choices if before is None else before)
                continue
            for i, (alternative, choice) in enumerate(zip(self._alternatives.members, choices, strict=True)):
                self._hold(e, alternative, choice, left, None if before is None else before[i])
            left, before = self._points[e][-1], choices
        return Held(self._lower, self._upper, self._g_lower, self._g_upper)

    def _hold(self, e: int, alternative: Alternative, choice: Choice, left: Point, before: Choice | None) -> None:
        quantities = self._alternatives.quantities
        if choice is not Choice.LEVEL:
            quantity = quantities[alternative.share if choice is Choice.SHARE else alternative.rest]
            for point in self._with_shares(e, alternative, left):
                self._clamp(quantity, point, 1, one_sided=False)
            return
        level = quantities[alternative.level]
        held_here = left is not self._start or self._start_is_free or not alternative.one_sided
        begins = [left] if held_here else []
        if alternative.kept < 0:
            for point in [*begins, *self._points[e]]:
                self._clamp(level, point, alternative.direction, one_sided=alternative.one_sided)
            return
        if before in (None, Choice.SHARE):
            for point in begins:
                self._fix(point.state + alternative.kept)
        for point in self._points[e]:
            self._fix(point.state + alternative.kept)
        for row in self._state_rows[e][alternative.kept]:
            self._g_lower[row], self._g_upper[row] = -np.inf, np.inf

    def _with_shares(self, e: int, alternative: Alternative, left: Point | None = None) -> list[Point]:
        """Points at which a share is part of a condition; a pair also has one at the start and at an own right end."""
        if alternative.one_sided:
            return self._points[e][: self._stages]
        return [self._start, *self._points[e]] if left is self._start else self._points[e]

    def _collapse(self, e: int, choices: tuple[Choice, ...]) -> None:
        """No length, no shares, and the states of the left boundary, whose bounds need not be repeated."""
        at = self._steps[e]
        self._lower[at] = self._upper[at] = 0.0
        for alternative, choice in zip(self._alternatives.members, choices, strict=True):
            if alternative.one_sided or choice is Choice.SHARE:
                for point in self._with_shares(e, alternative):
                    self._clamp(self._alternatives.quantities[alternative.share], point, 1, one_sided=False)
        last = e == len(self._points) - 1
        for point in self._points[e][:-1] if last else self._points[e]:
            where = slice(point.state, point.state + self._n_x)
            self._lower[where], self._upper[where] = -np.inf, np.inf

    def _fix(self, variable: int) -> None:
        self._lower[variable] = self._upper[variable] = 0.0

    def _clamp(self, quantity: Quantity, point: Point, direction: int, *, one_sided: bool) -> None:
        """Hold direction * quantity <= 0; a quantity that is never negative is then zero."""
        if not quantity.variables:
            row = point.row + quantity.row
            if direction > 0 or not one_sided:
                self._g_upper[row] = 0.0
            if direction < 0 or not one_sided:
                self._g_lower[row] = 0.0
            return
        for i in quantity.variables:
            at = point.state + i if i < self._n_x else point.algebraic + i - self._n_x
            zero = -quantity.offset * quantity.sign
            if direction * quantity.sign > 0 or not one_sided:
                self._upper[at] = min(self._upper[at], zero)
            if direction * quantity.sign < 0 or not one_sided:
                self._lower[at] = max(self._lower[at], zero)


def _state_rows(names: Sequence[str], states: Sequence[str], count: int) -> list[dict[int, list[int]]]:
    """Return, per element and state, the rows that are its dynamics."""
    found: list[dict[int, list[int]]] = [{i: [] for i in range(len(states))} for _ in range(count)]
    for row, name in enumerate(names):
        if name.startswith(("dynamics", "continuity")):
            head, state = name.split(": ", 1)
            found[int(head.split("element ")[1].split(",")[0])][list(states).index(state)].append(row)
    return found
