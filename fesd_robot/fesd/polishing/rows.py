"""The rows of an element in a branch NLP: quantities at its points, between its points, and where it ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.fesd.element import ElementPoints
from fesd_robot.fesd.polishing.conditions import ElementConditions
from fesd_robot.fesd.tableau import Tableau


@dataclass(frozen=True)
class ElementRows:
    """The rows of an element, and where among them a quantity stands.

    - ``r(x_k, z_k)`` of every quantity at every point k = 1..n, in this order;
    - ``r(x_k, z_j)`` of those that keep their sign between all points k = 0..n, k != j, and stages j;
    - ``r(x_k) + e r(x_0)`` of those to which an impact with restitution adds the left value, at every point k = 1..n;
    - ``sum_k l_k'(1) r(x_k, z_n)`` of those that are zero where a contact stops, whatever the algebraic variables are:
      their slope at the end, by the derivatives of the Lagrange basis. It takes the place of the value where the
      element ends with that: friction at the end of a slide is against the velocity just before it;
    - where the state may jump, ``r(x_0, z_0)`` at the left boundary after it, and the laws of the impulses.

    Attributes:
        conditions: of the element.
        tableau: of its scheme.
        points: without the left boundary, with a right end that is no stage.
    """

    conditions: ElementConditions
    tableau: Tableau
    points: int

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Point and stage of every crossed quantity."""
        return [(k, j) for k in range(self.points + 1) for j in range(1, self.tableau.stages + 1) if k != j]

    @cached_property
    def ending(self) -> list[int]:
        """Quantities whose slope at the end is a row."""
        known = self.tableau.collocation and self.tableau.ends_at_stage
        return self.conditions.implied_by_rest if known else []

    @property
    def size(self) -> int:
        """Rows of an element."""
        between = len(self.pairs) * len(self.conditions.between_all_points)
        with_initial_value = self.points * len(self.conditions.with_initial_value)
        return self.points * self.conditions.row_count + between + with_initial_value + len(self.ending) + self._of_jump

    @property
    def _of_jump(self) -> int:
        """Rows of the jump at the left boundary."""
        return self.conditions.row_count + self.conditions.laws if self.conditions.jumps else 0

    def after_jump(self) -> int:
        """Index of the first quantity at the left boundary, after the jump."""
        return self.size - self._of_jump

    def law(self, impulse: int) -> int:
        """Index of the law of an impulse."""
        return self.size - self.conditions.laws + impulse

    def at(self, point: int, row: int) -> int:
        """Index of a quantity at a point, from 1."""
        return (point - 1) * self.conditions.row_count + row

    def between(self, pair: int, row: int) -> int:
        """Index of a crossed quantity at one of `pairs`."""
        between_all_points = self.conditions.between_all_points
        return self.points * self.conditions.row_count + pair * len(between_all_points) + between_all_points.index(row)

    def since_left(self, point: int, quantity: tuple[int, float]) -> int:
        """Index of a quantity and what it was at the left boundary, one of `with_initial_value`, at a point, from 1."""
        with_initial_value = self.conditions.with_initial_value
        last = self.points * self.conditions.row_count + len(self.pairs) * len(self.conditions.between_all_points)
        return last + (point - 1) * len(with_initial_value) + with_initial_value.index(quantity)

    def at_end(self, row: int) -> int:
        """Index of the slope of one of `ending`."""
        return self.size - self._of_jump - len(self.ending) + self.ending.index(row)

    def expressions(self, element: ElementPoints) -> ca.SX:
        """Return the rows of an element, (size)."""
        rows, points = self.conditions.rows, [element.left, *element.stages]
        if self.points > self.tableau.stages:
            points.append(element.right)
        own = [rows(x, z) for x, z in points[1:]]
        between = self.pairs if self.conditions.between_all_points else []
        between_all_points = [rows(points[k][0], points[j][1])[self.conditions.between_all_points] for k, j in between]
        with_initial_value, slopes = self._with_initial_value(points), self.slopes(points)
        return ca.vertcat(ca.SX(0, 1), *own, *between_all_points, *with_initial_value, slopes, *self._jump(element))

    def _with_initial_value(self, points: Sequence[tuple[ca.SX, ca.SX]]) -> list[ca.SX]:
        if not self.conditions.with_initial_value:
            return []
        values = [self.conditions.values(x, z) for x, z in points]
        return [own[i] + e * values[0][i] for own in values[1:] for i, e in self.conditions.with_initial_value]

    def _jump(self, element: ElementPoints) -> list[ca.SX]:
        if self.conditions.jump_values is None:
            return []
        return [
            self.conditions.rows(*element.left),
            self.conditions.jump_values(element.before, element.jump)[: self.conditions.laws],
        ]

    def slopes(self, points: Sequence[tuple[ca.SX, ca.SX]]) -> ca.SX:
        """Return the slopes of `ending`.

        Args:
            points: (x, z) at the left boundary, whose z does not matter, and at the stages.
        """
        if not self.ending:
            return ca.SX(0, 1)
        values = [self.conditions.rows(x, points[-1][1])[self.ending] for x, _ in points]
        return ca.horzcat(*values) @ np.asarray(self.tableau.derivative)[-1]
