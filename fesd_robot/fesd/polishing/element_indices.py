"""Where the elements of a branch transcription sit among its variables and rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fesd_robot.fesd.element import CONTINUITY, DYNAMICS
from fesd_robot.mpcc import Mpcc

if TYPE_CHECKING:
    from fesd_robot.fesd.polishing.transcription import BranchTranscription


class PointIndices(NamedTuple):
    """Where a point of the trajectory sits in the problem.

    Attributes:
        state, algebraic: index of its first state and algebraic variable among the variables.
        row: index of its first row.
        control: index of the first control of its interval; of the start none.
        after_jump: number of a state that may jump at this point -> its index afterwards; empty where none did.
    """

    state: int
    algebraic: int
    row: int
    control: int = -1
    after_jump: Mapping[int, int] = MappingProxyType({})


class ElementIndices(NamedTuple):
    """Where a finite element sits in the problem.

    Attributes:
        step: index of its length among the variables.
        points: its points, without the left boundary.
        first_row: index of the first of its `ElementRows`.
        state_rows: index of a state -> the rows that are its dynamics.
        jump: index of the first variable of the jump at its left boundary.
        jumped: number of a state that may jump -> its index after that.
        step_difference: index of the row that is the length of the next element of the interval minus its own; that of
            the last element is no such row.
    """

    step: int
    jump: int
    jumped: Mapping[int, int]
    points: list[PointIndices]
    first_row: int
    state_rows: dict[int, list[int]]
    step_difference: int


def element_indices(branch_transcription: BranchTranscription) -> list[ElementIndices]:
    """Return the indices of all elements, in time order."""
    transcription, problem = branch_transcription.transcription, branch_transcription.problem
    rows, element_blocks = branch_transcription.element_rows, transcription.element_blocks
    kinds, sizes = len(transcription.intervals), [len(block.lower) * block.copies for block in problem.blocks]
    state_rows = _state_rows(problem, transcription.ocp.system.state_names)
    of_elements = np.concatenate([[0], np.cumsum(transcription.elements)]).astype(int)
    first_of_blocks = sum(sizes[: 1 + kinds])
    elements: list[ElementIndices] = []
    first_row = sizes[0]
    for block, count in zip(problem.blocks[1:], transcription.intervals, strict=False):
        layout = transcription.layouts[count]
        for place in block.places:
            assert place.interval is not None
            offset, end = int(transcription.indices.offsets[place.interval]), first_row + len(block.lower)
            steps = end - (count - 1)
            first = (
                first_of_blocks + int(of_elements[place.interval]) * rows.size
                if element_blocks
                else steps - count * rows.size
            )
            for n in range(count):
                own = first + n * rows.size
                elements.append(
                    ElementIndices(
                        step=offset + layout.step(n),
                        jump=offset + layout.jump(n).start,
                        jumped=dict(zip(layout.jump_states, (offset + layout.jumped(n)).tolist(), strict=True)),
                        points=[
                            PointIndices(
                                offset + layout.state(n, j).start,
                                offset + layout.algebraic(n, j).start,
                                own + rows.at(j + 1, 0),
                                offset,
                            )
                            for j in range(rows.points)
                        ],
                        first_row=own,
                        state_rows=state_rows[place.interval, n],
                        step_difference=steps + n,
                    )
                )
            first_row = end
    return sorted(elements, key=lambda element: element.step)  # blocks may hold intervals out of order


def _state_rows(problem: Mpcc, states: Sequence[str]) -> dict[tuple[int | None, int | None], dict[int, list[int]]]:
    """Return, by interval and element there, the rows that are the dynamics of a state, by its number."""
    number, first = {name: i for i, name in enumerate(states)}, 0
    rows: dict[tuple[int | None, int | None], dict[int, list[int]]] = {}
    for block in problem.blocks:
        own = [(row, label) for row, label in enumerate(block.constraints) if label.kind in (DYNAMICS, CONTINUITY)]
        for place in block.places if own else ():
            for row, label in own:
                where = place.within(label.place)
                of_element = rows.setdefault((where.interval, where.element), {})
                of_element.setdefault(number[label.subject], []).append(first + row)
            first += len(block.lower)
        first += 0 if own else len(block.lower) * block.copies
    return rows
