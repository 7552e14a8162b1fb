"""Rows that a refined transcription has besides those of its problem: bounds that hold between the stages, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from math import comb

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label
from fesd_robot.fesd.constraints import TrajectoryConstraint
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.path_between import PathBetween, path_blocks
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.mpcc import Block, BlockEquations

PARTS = 4
"""Parts of an element on each of which the coefficients of its polynomials keep a bound."""

SLACK = 5e-8
"""By how much the coefficients may pass a bound, in the unit of the variable. Without it there would be no interior
where a variable begins at its bound without slope, as the gap of a foot that lifts off gently."""


@dataclass(frozen=True)
class BoundBetween:
    """A bound that a variable keeps in all of an element, sign * value <= sign * limit, not at its stages only.

    Attributes:
        element: its number in time order.
        variable: index into (x, z). The value of a state is that of the collocation polynomial, the value of an
            algebraic variable that of the polynomial through its stages.
        sign, limit: +1 for an upper bound, -1 for a lower one, and the bound.
        end_only: whether it holds at the last stage only.
        of_mode: whether another mode of the element need not keep it.
    """

    element: int
    variable: int
    sign: int
    limit: float
    end_only: bool = False
    of_mode: bool = False

    def in_parts(self, parts: Sequence[int], first: Sequence[int]) -> list[BoundBetween]:
        """Return the same for elements that are in parts, whose first ones have the numbers `first`."""
        after = first[self.element] + parts[self.element]
        numbers = range(after - 1 if self.end_only else first[self.element], after)
        return [replace(self, element=number) for number in numbers]


@dataclass(frozen=True)
class AddedRows:
    """The rows that refinement adds to a transcription; none at first."""

    bounds: tuple[BoundBetween, ...] = ()
    paths: tuple[PathBetween, ...] = ()

    def in_parts(self, parts: Sequence[int]) -> AddedRows:
        """Return the same rows for elements that are in parts.

        Args:
            parts: of every element, (number of elements).
        """
        first = np.concatenate([[0], np.cumsum(parts)[:-1]]).astype(int).tolist()
        bounds = [part for one in self.bounds for part in one.in_parts(parts, first)]
        paths = [part for one in self.paths for part in one.in_parts(parts, first)]
        return AddedRows(tuple(bounds), tuple(paths))

    def in_intervals(self, old: Sequence[int], new: Sequence[int]) -> AddedRows:
        """Return the rows for other elements: rows of one element are held in all of its interval.

        What holds in a mode only, or at its end, is left out, for that may be elsewhere.

        Args:
            old, new: numbers of elements of the intervals, (N).
        """
        interval = np.repeat(np.arange(len(old)), old).tolist()
        first = np.concatenate([[0], np.cumsum(new)]).astype(int).tolist()
        own = [range(*ends) for ends in pairwise(first)]
        bounds = [
            replace(one, element=element)
            for one in self.bounds
            if not (one.end_only or one.of_mode)
            for element in own[interval[one.element]]
        ]
        paths = {
            (one.constraint, element): replace(one, element=element)
            for one in sorted(self.paths, key=lambda one: one.margin)
            for element in own[interval[one.element]]
        }
        return AddedRows(tuple(dict.fromkeys(bounds)), tuple(paths.values()))

    def blocks(
        self, indices: TrajectoryIndices, tableau: Tableau, constraints: Sequence[TrajectoryConstraint]
    ) -> list[Block]:
        """Return the blocks of the rows.

        Args:
            indices: where the variables of the trajectory sit.
            tableau: a collocation scheme.
            constraints: of the problem.
        """
        n_x = indices.layout(0).n_x
        ends = [one for one in self.bounds if one.end_only]
        states = [one for one in self.bounds if one.variable < n_x and not one.end_only]
        algebraic = [one for one in self.bounds if one.variable >= n_x and not one.end_only]
        return [
            *([_bound_block("states_between_stages", states, indices, tableau.nodes)] if states else []),
            *([_bound_block("multipliers_between_stages", algebraic, indices, tableau.c)] if algebraic else []),
            *([_bound_block("multipliers_at_the_end", ends, indices, tableau.c[-1:])] if ends else []),
            *path_blocks(self.paths, constraints, indices, tableau),
        ]


NO_ROWS = AddedRows()
"""The added rows of a transcription before it is refined: none."""


def _bound_block(name: str, bounds: Sequence[BoundBetween], indices: TrajectoryIndices, nodes: np.ndarray) -> Block:
    """Hold the coefficients of the polynomials through the values at `nodes`, where 0 is the left boundary."""
    return Block(
        equations=_bound_equations(name, tuple(nodes.tolist())),
        places=[indices.place(one.element) for one in bounds],
        index=np.array([_at_nodes(one, indices, nodes) for one in bounds]).T,
        values=np.array([[one.sign, one.limit] for one in bounds]).T,
    )


@lru_cache
def _bound_equations(name: str, nodes: tuple[float, ...]) -> BlockEquations:
    coefficients = bernstein_coefficients(np.array(nodes))
    values, sign, limit = ca.SX.sym("x", len(nodes)), ca.SX.sym("sign"), ca.SX.sym("limit")
    rows = sign * (ca.mtimes(ca.DM(coefficients), values) - limit)
    return BlockEquations(
        name=name,
        variables=values,
        parameters=ca.vertcat(sign, limit),
        cost=ca.SX(0),
        rows=rows,
        lower=np.full(rows.numel(), -np.inf),
        upper=np.full(rows.numel(), SLACK),
        constraints=[Label("bound between stages", str(i)) for i in range(rows.numel())],
    )


def _at_nodes(bound: BoundBetween, indices: TrajectoryIndices, nodes: np.ndarray) -> list[int]:
    """Return the indices of a variable at the nodes of its element."""
    left = [int(indices.left_state(bound.element)[bound.variable])] if nodes[0] == 0 else []
    last = indices.layout(0).stages
    stages = range(last - len(nodes) + len(left), last)
    return left + [int(indices.stage(bound.element, j)[bound.variable]) for j in stages]


def bernstein_coefficients(nodes: np.ndarray) -> np.ndarray:
    """Return the map from values at nodes in [0, 1] to Bernstein coefficients of their polynomial on parts of [0, 1].

    A polynomial lies between the smallest and the largest of its coefficients; on m equal parts they come as near to it
    as 1/m^2.

    Args:
        nodes: n different ones.

    Returns:
        (PARTS n, n).

    Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, CAGD 29 (2012).
    """
    degree = len(nodes) - 1
    at = np.linspace(0, 1, degree + 1)
    basis = np.array([comb(degree, k) * at**k * (1 - at) ** (degree - k) for k in range(degree + 1)]).T
    parts = [np.linalg.solve(basis, lagrange(nodes, (i + at) / PARTS)) for i in range(PARTS)]
    return np.vstack(parts)
