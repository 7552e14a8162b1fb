"""The bounds of the branch NLP: they keep the active factor of every condition at zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, HeldAt
from fesd_robot.exactness import ROUNDED
from fesd_robot.fesd.polishing.conditions import ConditionFactors, Quantity
from fesd_robot.fesd.polishing.element_indices import PointIndices, element_indices
from fesd_robot.mpcc import BranchBounds

if TYPE_CHECKING:
    from fesd_robot.fesd.polishing.transcription import BranchTranscription


ROOM = 1e-10
"""By how much a multiplier of a contact may be negative while the clock stands still. An impact elsewhere that does not
move a contact leaves its multiplier nothing but zero, and an interior-point method needs an interior: without room it
takes hundreds of iterations with multipliers of 1e8 instead of ten."""


class BoundsBuilder:
    """Where the elements of a branch transcription sit, and the bounds that hold a branch there."""

    def __init__(self, branch_transcription: BranchTranscription) -> None:
        transcription = branch_transcription.transcription
        self._conditions = branch_transcription.conditions
        self._n_x, self._n_z = transcription.ocp.system.state.numel(), transcription.ocp.system.algebraic.numel()
        self._problem = branch_transcription.problem
        self._equally_long, self._resting_ends = branch_transcription.equally_long, branch_transcription.resting_ends
        self._rows = branch_transcription.element_rows
        self._copies = transcription.ocp.system.control_copies
        self._idle_rows = self._conditions.vanish_together or bool(self._conditions.jumps or self._copies)
        self._patterns = branch_transcription.row_patterns if self._idle_rows else []
        self._stages = transcription.options.tableau.stages
        self._start_state = transcription.ocp.initial_lower
        self._start_is_free = bool((transcription.ocp.initial_lower < transcription.ocp.initial_upper).any())
        self._start = PointIndices(0, self._n_x, len(transcription.problem.blocks[0].lower))
        self._elements = element_indices(branch_transcription)

    def bounds(self, branch: Branch) -> BranchBounds:
        """Return the bounds on variables and rows."""
        problem = self._problem
        self._lower, self._upper = problem.lower.copy(), problem.upper.copy()
        self._g_lower = np.concatenate([np.tile(block.lower, block.copies) for block in problem.blocks])
        self._g_upper = np.concatenate([np.tile(block.upper, block.copies) for block in problem.blocks])
        self._resting = self._resting_ends(branch)
        for e in self._equally_long(branch):
            row = self._elements[e].step_difference
            self._g_lower[row] = self._g_upper[row] = 0.0
        left: PointIndices = self._start
        before: tuple[ActiveFactor, ...] | None = None
        standing_still: list[tuple[int, PointIndices]] = []
        for e, (factors, without_length) in enumerate(zip(branch.factors, branch.without_length, strict=True)):
            if without_length:
                self._remove(e, factors if before is None else before, factors)
                continue
            frozen = ActiveFactor.COMPLEMENT in factors
            left = self._hold_jump(e, left, factors)
            for i, (member, factor) in enumerate(zip(self._conditions.members, factors, strict=False)):
                if member.spare is not None and factor is ActiveFactor.G:
                    self._hold_spare(e, member.spare, frozen)
                if frozen and member.condition.idle:
                    self._hold_idle(e, i)
                elif frozen and member.condition.rate_share:
                    self._vanish(e, i)
                elif self._conditions.met(i, factors) or self._follows(i, factors, before):
                    continue
                elif member.condition.implied_by and factor is ActiveFactor.G:
                    self._hold_while_moving(e, i, before)
                elif factor is ActiveFactor.G and self._conditions.uses_initial_value(i, factors):
                    self._hold_since_left(e, member, left)
                else:
                    self._hold(e, member, factor, left, None if before is None else before[i])
            if frozen:
                self._make_room(e)
                standing_still.append((e, left))
            left, before = self._elements[e].points[-1], factors
        for e, left in reversed(standing_still):
            self._leave_out_repeated_gaps(e, left)
        if self._idle_rows:
            self._leave_out_idle_rows()
        return BranchBounds(self._lower, self._upper, self._g_lower, self._g_upper)

    def _hold(
        self, e: int, member: ConditionFactors, factor: ActiveFactor, left: PointIndices, before: ActiveFactor | None
    ) -> None:
        """Hold the active factor of a condition in an element, `before` the one of the element before."""
        quantity, vanishing = self._conditions.quantities[member.quantity(factor)], member.condition.vanishing
        if factor is not ActiveFactor.G:
            for point in self._with_H(e, member, left):
                self._clamp(quantity, point, 1, one_side=False)
            return
        if member.condition.held_at is HeldAt.RIGHT_BOUNDARY:
            self._clamp(quantity, self._elements[e].points[-1], member.direction, one_side=True)
            return
        held_here = left is not self._start or bool(left.after_jump) or self._start_is_free or not vanishing
        begins = [left] if held_here and not member.condition.held_at.algebraic else []
        if member.invariant_state is None:
            points = self._elements[e].points
            stages = points[: self._stages] if member.condition.held_at.algebraic and quantity.row is None else points
            for point in [*begins, *stages]:
                self._clamp(quantity, point, member.direction, one_side=vanishing)
            return
        if before in (None, ActiveFactor.H):
            for point in begins:
                self._fix(point.state + member.invariant_state)
        for point in self._elements[e].points:
            self._fix(point.state + member.invariant_state)
        for row in self._elements[e].state_rows[member.invariant_state]:  # index reduction
            self._g_lower[row], self._g_upper[row] = -np.inf, np.inf

    def _hold_spare(self, e: int, variable: int, frozen: bool) -> None:
        """Hold what H has to spare at zero or above, with room where the clock stands still."""
        for point in self._elements[e].points[: self._stages]:
            self._lower[point.algebraic + variable - self._n_x] = -ROOM if frozen else 0.0

    def _hold_since_left(self, e: int, member: ConditionFactors, left: PointIndices) -> None:
        """Hold G and what it was at the left boundary, and G at that boundary itself."""
        rows, first = self._rows, self._elements[e].first_row
        last_only = member.condition.held_at is HeldAt.RIGHT_BOUNDARY
        for point in range(rows.points if last_only else 1, rows.points + 1):
            self._limit(
                first + rows.since_left(point, (member.G, member.condition.initial_value_factor)), member.direction
            )
        if not last_only and (left is not self._start or self._start_is_free):
            self._clamp(self._conditions.quantities[member.G], left, member.direction, one_side=True)

    def _hold_jump(self, e: int, left: PointIndices, factors: tuple[ActiveFactor, ...]) -> PointIndices:
        """Hold the active factors of the jump at the left boundary of an element; return the boundary after it."""
        indices, count = self._elements[e], len(self._conditions.members)
        if not self._conditions.jumping(factors):
            self._no_impulse(e)
            return left
        row = indices.first_row + self._rows.after_jump()
        after = left._replace(row=row, after_jump=indices.jumped)
        for jump, factor in zip(self._conditions.jumps, factors[count:], strict=True):
            if factor is ActiveFactor.H:
                for i in jump.variables:
                    self._fix(indices.jump + i)
            elif jump.law is not None:
                row = indices.first_row + self._rows.law(jump.law)
                self._g_lower[row] = self._g_upper[row] = 0.0
            else:
                assert jump.G is not None, jump.condition.label
                quantity, vanishing = self._conditions.quantities[jump.G], jump.condition.vanishing
                self._clamp(quantity, after, jump.direction, one_side=vanishing)
        return after

    def _no_impulse(self, e: int) -> None:
        for jump in self._conditions.jumps:
            for i in jump.variables:
                self._fix(self._elements[e].jump + i)

    def _follows(self, i: int, factors: tuple[ActiveFactor, ...], before: tuple[ActiveFactor, ...] | None) -> bool:
        """Return whether an impulse, or contact before, has seen to a condition for the left boundary alone."""
        alone = self._conditions.members[i].condition.held_at is HeldAt.LEFT_BOUNDARY and bool(self._conditions.jumps)
        went_on = before is None or before[i] is ActiveFactor.G or self._conditions.jumping(factors)
        return alone and factors[i] is ActiveFactor.G and went_on

    def _hold_while_moving(self, e: int, i: int, before: tuple[ActiveFactor, ...] | None) -> None:
        """Hold G of a condition that rest meets: at all points, between them, and by its slope where rest begins.

        Args:
            e: number of the element.
            i: number of the condition.
            before: active factors of the element before it.
        """
        member, rows, first = self._conditions.members[i], self._rows, self._elements[e].first_row
        row, direction = self._conditions.quantities[member.G].row, member.direction
        assert row is not None, member.condition.label
        stops = (e, i) in self._resting
        starts = self._start_rests(row) if before is None else self._conditions.stopped(i, before)
        for point in range(1, rows.points + (not stops)) if not member.condition.only_at_rest else ():
            self._limit(first + rows.at(point, row), direction)
        variable = self._conditions.vanishing_at_rest[i]
        if stops and variable is not None:
            self._fix(self._elements[e].points[self._stages - 1].algebraic + variable)
        elif stops:
            self._limit(first + rows.at_end(row), -direction)
        if member.condition.held_at is HeldAt.POINTS_AND_STAGES:
            for n, (point, _) in enumerate(rows.pairs):
                if not (point == 0 and starts) and not (point == rows.points and stops):
                    self._limit(first + rows.between(n, row), direction)

    def _start_rests(self, row: int) -> bool:
        """Return whether the start is given, and a quantity is zero there whatever the algebraic variables are."""
        if self._start_is_free:
            return False
        some = np.linspace(1.0, 2.0, self._n_z) ** 2
        return bool(abs(float(self._conditions.rows(self._start_state, some)[row])) <= ROUNDED)

    def _limit(self, row: int, direction: int) -> None:
        """Hold direction * row <= 0."""
        if direction > 0:
            self._g_upper[row] = 0.0
        else:
            self._g_lower[row] = 0.0

    def _leave_out_idle_rows(self) -> None:
        """Free the rows whose variables are all fixed: they hold by themselves and have no gradient."""
        fixed, first = self._lower == self._upper, 0
        for block, pattern in zip(self._problem.blocks, self._patterns, strict=True):
            idle = ~(pattern @ ~fixed[block.index])
            for copy in range(block.copies):
                rows = first + np.flatnonzero(idle[:, copy])
                self._g_lower[rows], self._g_upper[rows] = -np.inf, np.inf
                first += len(block.lower)

    def _leave_out_repeated_gaps(self, e: int, left: PointIndices) -> None:
        """Free the bounds of invariants where the clock stands still: they stay what they are at the left boundary.

        One that is held at the right boundary, where contact begins, is zero at the left one, too: its bound there
        would leave an interior-point method no interior.
        """
        *inner, last = self._elements[e].points
        for member in self._conditions.members:
            if member.invariant_state is None:
                continue
            held = self._is_held(last.state + member.invariant_state)
            for point in [left, *inner] if held else [*inner, last]:
                at = point.state + member.invariant_state
                if not self._is_held(at):
                    self._lower[at] = -np.inf

    def _is_held(self, variable: int) -> bool:
        return bool(self._lower[variable] == self._upper[variable])

    def _make_room(self, e: int) -> None:
        """Give multipliers that may be positive some room below zero where the clock stands still."""
        for member in self._conditions.members:
            for point in self._elements[e].points[: self._stages]:
                for variable in self._conditions.quantities[member.H].variables:
                    at = point.algebraic + variable - self._n_x
                    if variable >= self._n_x and self._lower[at] == 0.0 < self._upper[at]:
                        self._lower[at] = -ROOM

    def _vanish(self, e: int, i: int) -> None:
        """Hold a share of a clock that stands still at zero; the last one is what the row of the sum leaves it."""
        member = self._conditions.members[i]
        quantity = self._conditions.quantities[member.H]
        for point in self._with_H(e, member):
            if i not in self._conditions.rests:
                self._clamp(quantity, point, 1, one_side=False)
                continue
            for variable in quantity.variables:
                at = point.algebraic + variable - self._n_x
                self._lower[at], self._upper[at] = -np.inf, np.inf

    def _hold_idle(self, e: int, i: int) -> None:
        """Hold the variables of a condition at zero that mean nothing while the clock stands still."""
        for point in self._elements[e].points[: self._stages]:
            for variable in self._conditions.idle[i]:
                self._fix(point.algebraic + variable)

    def _hold_going_on(self, e: int, i: int, factor: ActiveFactor) -> None:
        """Hold a condition of what moves on through an element without length, at its stages."""
        member = self._conditions.members[i]
        quantity = self._conditions.quantities[member.quantity(factor)]
        if factor is ActiveFactor.G and (member.condition.only_at_rest or member.condition.vanishes_at_rest is None):
            return
        for point in self._elements[e].points[: self._stages]:
            self._clamp(quantity, point, member.direction, one_side=factor is ActiveFactor.G)

    def _with_H(self, e: int, member: ConditionFactors, left: PointIndices | None = None) -> list[PointIndices]:
        """Points at which H is part of a condition; a pair also has one at the start and at an own right end.

        One whose sides are continuous has one at the left boundary of every element.
        """
        points = self._elements[e].points
        if member.condition.vanishing:
            return points[: self._stages]
        if member.condition.continuous and left is not None:
            return [left, *points]
        return [self._start, *points] if left is self._start else points

    def _remove(self, e: int, factors: tuple[ActiveFactor, ...], following: tuple[ActiveFactor, ...]) -> None:
        """No length, no multipliers, and the states of the left boundary, whose bounds need not be repeated.

        Args:
            e: number of the element.
            factors: active factors of the element before it.
            following: those of its own, with which the motion goes on.
        """
        at = self._elements[e].step
        self._lower[at] = self._upper[at] = 0.0
        self._no_impulse(e)
        for i, (member, factor) in enumerate(zip(self._conditions.members, factors, strict=False)):
            if member.condition.idle:
                if self._conditions.moving(i, factors) and self._conditions.moving(i, following):
                    self._hold_going_on(e, i, factor)
                else:
                    self._hold_idle(e, i)
            elif i not in self._conditions.rests and (member.condition.vanishing or factor is ActiveFactor.H):
                for point in self._with_H(e, member):
                    self._clamp(self._conditions.quantities[member.H], point, 1, one_side=False)
        points = self._elements[e].points
        for point in points[:-1] if e == len(self._elements) - 1 else points:
            where = slice(point.state, point.state + self._n_x)
            self._lower[where], self._upper[where] = -np.inf, np.inf

    def _fix(self, variable: int) -> None:
        self._lower[variable] = self._upper[variable] = 0.0

    def _clamp(self, quantity: Quantity, point: PointIndices, direction: int, *, one_side: bool) -> None:
        """Hold direction * quantity <= 0 (one side), or = 0; a quantity that is never negative is zero either way."""
        if quantity.row is not None:
            for side in (direction,) if one_side else (-1, 1):
                self._limit(point.row + quantity.row, side)
            return
        for i in quantity.variables:
            at = point.after_jump.get(i, point.state + i) if i < self._n_x else point.algebraic + i - self._n_x
            zero = -quantity.offset * quantity.sign
            if direction * quantity.sign > 0 or not one_side:
                self._upper[at] = min(self._upper[at], zero)
            if direction * quantity.sign < 0 or not one_side:
                self._lower[at] = max(self._lower[at], zero)
            if i - self._n_x in self._copies and self._is_held(at):
                self._fix(point.control + self._copies[i - self._n_x])
