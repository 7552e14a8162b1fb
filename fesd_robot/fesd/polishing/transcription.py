"""The branch NLP of a trajectory: every condition's active factor is held at zero, nothing is relaxed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, Label
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.element import read_elements
from fesd_robot.fesd.layout import layout_of
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.polishing.bounds import BoundsBuilder
from fesd_robot.fesd.polishing.conditions import ElementConditions, conditions_of
from fesd_robot.fesd.polishing.reading import COLLAPSED, GRAZING_FLIGHT, drop_elements, out_of_elements, read_branch
from fesd_robot.fesd.polishing.rows import ElementRows
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import BlockEquations, BranchBounds, Mpcc
from fesd_robot.nlp import NlpPoint
from fesd_robot.running import kept_with_first


@dataclass(frozen=True)
class BranchTranscription:
    """A transcription whose conditions have an active factor instead of being pairs, to polish a homotopy's end.

    One problem serves all branches: a branch sets bounds on variables and on rows, so functions and derivatives are
    made once. What a branch repeats is left out, or an interior-point method finds no interior: G at a boundary belongs
    to the element before it; an invariant is held where contact begins and then kept by the velocities (index
    reduction); an element without length has no bounds on its states, for they are those of its left boundary.
    Neighbouring elements of an interval that are in the same mode have the same length.
    """

    transcription: Transcription

    @cached_property
    def conditions(self) -> ElementConditions:
        """What can vanish in an element."""
        return conditions_of(self.transcription.ocp.system)

    @cached_property
    def problem(self) -> Mpcc:
        """The problem without pairs, and with a row for every quantity that needs one at every point."""
        full, own = self.transcription.problem, self.transcription
        counts = [0, *own.intervals, *([ALONE] if own.element_blocks else [])]
        kinds = dict(enumerate(counts))
        blocks = [
            replace(block, equations=self._equations(block.equations, kinds.get(i)))
            for i, block in enumerate(full.blocks)
        ]
        return replace(full, blocks=blocks)

    def _equations(self, equations: BlockEquations, elements: int | None) -> BlockEquations:
        """Return the equations of a block without pairs, see `_branch_equations`."""
        if elements is None and equations.while_relaxed.is_zero() and equations.if_exploited.is_zero():
            return equations
        system, options = self.transcription.ocp.system, replace(self.transcription.options, elements=1)
        return _branch_equations(equations, system, options, elements, self.transcription.element_blocks)

    @cached_property
    def row_patterns(self) -> list[np.ndarray]:
        """Which rows of every block of `problem` contain which of its variables, (n_g, n_w) of bool each."""
        return [block.equations.row_pattern for block in self.problem.blocks]

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """Return the branches on which a point may lie, the likelier one first."""
        elements = self.transcription.unpack(w)
        branches: list[Branch] = []
        for grazing in (GRAZING_FLIGHT, 0.0):
            branch = read_branch(self.conditions, elements, self._equal_steps, grazing)
            if branch not in branches:
                branches.append(branch)
                yield branch

    def branch(self, w: np.ndarray) -> Branch:
        """Return the likeliest branch on which a point lies."""
        return next(self.candidate_branches(w))

    def out_of_elements(self, w: np.ndarray) -> list[int]:
        """Return the intervals that have no element to spare at w, see `reading.out_of_elements`."""
        return out_of_elements(self.conditions, self.branch(w), self.transcription.unpack(w))

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """Return the branch with the elements that have shrunk to nothing at w; None if there are none.

        On a grid that moves there are none: a phase is as short as its duration says.
        """
        if self.transcription.grid.moving:
            return None
        return drop_elements(branch, self.transcription.unpack(w), self._equal_steps)

    def branch_of_exact(self, branch: Branch, w: np.ndarray) -> Branch:
        """Return the branch of an exact motion, on which elements at their least length have none.

        A switch at such an element is one at the boundary of control intervals, where controls jump.
        """
        return drop_elements(branch, self.transcription.unpack(w), self._equal_steps, COLLAPSED) or branch

    def whole(self, point: NlpPoint) -> NlpPoint:
        """Return the point: the problem has all rows."""
        return point

    def bounds(self, branch: Branch) -> BranchBounds:
        """Return the bounds on variables and rows of `problem` that keep the active factors of a branch at zero."""
        return self._builder.bounds(branch)

    @cached_property
    def _builder(self) -> BoundsBuilder:
        return BoundsBuilder(self)

    def equally_long(self, branch: Branch) -> list[int]:
        """Return the elements whose successor in their interval has a length and the same mode, and so the same length.

        Args:
            branch: whose modes count.
        """
        last = set(np.cumsum(self.transcription.elements) - 1)
        numbers = enumerate(pairwise(zip(branch.factors, branch.without_length, strict=True)))
        goes_on = self.conditions.goes_on
        return [
            e
            for e, (one, other) in numbers
            if e not in last and goes_on(one[0], other[0]) and one[1] == other[1] and not one[1]
        ]

    def resting_ends(self, branch: Branch) -> set[tuple[int, int]]:
        """Return (element, condition) of the conditions whose contact moves in an element and rests in the next one.

        Of those whose slope at the end is one of `element_rows`.

        Args:
            branch: whose modes count.
        """
        conditions, ends = self.conditions, set[tuple[int, int]]()
        whole = [e for e, without in enumerate(branch.without_length) if not without]
        for e, after in pairwise(whole):
            for i, member in enumerate(conditions.members):
                row, own = conditions.quantities[member.G].row, branch.factors[e]
                moves = own[i] is ActiveFactor.G and not conditions.met(i, own)
                known = row in self.element_rows.ending or (
                    self.element_rows.ending and member.condition.vanishes_at_rest is not None
                )
                if known and moves and conditions.stopped(i, branch.factors[after]):
                    ends.add((e, i))
        return ends

    @cached_property
    def _equal_steps(self) -> np.ndarray:
        """Equal part of the interval of every element, numerical time."""
        lengths, counts = self.transcription.grid.lengths, self.transcription.elements
        return np.concatenate([np.full(n, length / n) for length, n in zip(lengths, counts, strict=True)])

    @cached_property
    def element_rows(self) -> ElementRows:
        """The rows of quantities that an element of `problem` has."""
        return _element_rows(self.transcription.ocp.system, replace(self.transcription.options, elements=1))


ALONE = -1
"""Stands for the number of elements of a block that is one element by itself."""


@kept_with_first
def _branch_equations(
    equations: BlockEquations,
    system: ComplementaritySystem,
    options: FesdOptions,
    elements: int | None,
    element_blocks: bool,
) -> BlockEquations:
    """Return equations without pairs, with further rows that no branch holds yet; they are made once.

    What is added to a cost while pairs are relaxed is left out, for here none ever is.

    Args:
        equations: of a block with pairs.
        system: of the problem.
        options: of the discretisation.
        elements: of the block's interval; 0 for the start, `ALONE` for a block that is one element, None for one
            without.
        element_blocks: whether elements have blocks of their own.
    """
    if elements is None:
        return replace(equations, while_relaxed=ca.SX(0), if_exploited=ca.SX(0))
    rows, w, left = list[ca.SX](), equations.variables, system.state.numel() + system.algebraic.numel()
    if elements == 0:
        rows.append(conditions_of(system).rows(w[: system.state.numel()], w[system.state.numel() : left]))
    if elements == ALONE or (elements and not element_blocks):
        layout = layout_of(system, options, abs(elements))
        parts = read_elements(layout, options.tableau, w[:left], w[left:])
        rows += [_element_rows(system, options).expressions(part) for part in parts]
    if elements > 0:
        steps = [w[left + layout_of(system, options, elements).step(n)] for n in range(elements)]
        rows += [after - before for before, after in pairwise(steps)]
    added = ca.vertcat(ca.SX(0, 1), *rows)
    free = np.full(added.numel(), np.inf)
    return replace(
        equations,
        rows=ca.vertcat(equations.rows, added),
        lower=np.append(equations.lower, -free),
        upper=np.append(equations.upper, free),
        constraints=[*equations.constraints, *[Label("active factor", str(i)) for i in range(added.numel())]],
        complementarities=(),
        while_relaxed=ca.SX(0),
        if_exploited=ca.SX(0),
    )


def _element_rows(system: ComplementaritySystem, options: FesdOptions) -> ElementRows:
    layout = layout_of(system, options, 1)
    return ElementRows(conditions_of(system), options.tableau, layout.stages + layout.own_end)
