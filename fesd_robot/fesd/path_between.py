"""Path constraints at places between the stages of an element."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label
from fesd_robot.fesd.constraints import TrajectoryConstraint
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.mpcc import Block

PATH_SLACK = 2e-7
"""By how much a path constraint may be violated between the stages, in the unit of its rows."""


@dataclass(frozen=True)
class PathBetween:
    """A path constraint at one place of an element.

    Attributes:
        constraint: its number among those of the problem.
        element: number of the element in time order.
        fraction: where in the element, 0 at its left boundary, 1 at its right end.
    """

    constraint: int
    element: int
    fraction: float

    def in_parts(self, parts: Sequence[int], first: Sequence[int]) -> PathBetween:
        """Return the same for elements that are in parts, of which the first have the numbers `first`."""
        place = self.fraction * parts[self.element]
        part = min(int(place), parts[self.element] - 1)
        return replace(self, element=first[self.element] + part, fraction=place - part)


def path_blocks(
    paths: Sequence[PathBetween],
    constraints: Sequence[TrajectoryConstraint],
    indices: TrajectoryIndices,
    tableau: Tableau,
) -> Iterator[Block]:
    """Yield a block for every path constraint that is held between stages.

    A copy reads the states at the left boundary and the stages, the control, and the algebraic variables of the stages;
    the rows are those of the constraint at the values of their polynomials.

    Args:
        paths: where.
        constraints: of the problem.
        indices: where the variables of the trajectory sit.
        tableau: a collocation scheme.
    """
    for number in sorted({one.constraint for one in paths}):
        own = [one for one in paths if one.constraint == number]
        yield _block(own, constraints[number], indices, tableau)


def _block(
    paths: Sequence[PathBetween], constraint: TrajectoryConstraint, indices: TrajectoryIndices, tableau: Tableau
) -> Block:
    layout, s = indices.layout(0), tableau.stages
    x, z = ca.SX.sym("x", layout.n_x, s + 1), ca.SX.sym("z", layout.n_z, s)
    u = ca.SX.sym("u", layout.n_u)
    of_states, of_stages = ca.SX.sym("of_states", s + 1), ca.SX.sym("of_stages", s)
    rows = ca.Function("rows", [constraint.variables, constraint.parameters], [constraint.rows])
    at = ca.vertcat(ca.mtimes(x, of_states), u, ca.mtimes(z, of_stages))
    places = [indices.place(one.element) for one in paths]
    fractions = np.array([one.fraction for one in paths])
    at_states, at_stages = lagrange(tableau.nodes, fractions), lagrange(tableau.c, fractions)
    numbers = [place.interval for place in places if place.interval is not None]
    which = [list(constraint.intervals).index(number) for number in numbers]
    index = []
    for one, number in zip(paths, numbers, strict=True):
        points = np.array([indices.stage(one.element, j) for j in range(s)])
        states = [indices.left_state(one.element), *points[:, : layout.n_x]]
        index.append(np.concatenate([*states, indices.control(number), *points[:, layout.n_x :]]))
    return Block(
        name="path_between_stages",
        places=places,
        variables=ca.vertcat(ca.vec(x), u, ca.vec(z)),
        parameters=ca.vertcat(of_states, of_stages, constraint.parameters),
        cost=ca.SX(0),
        rows=rows(at, constraint.parameters),
        lower=constraint.lower - PATH_SLACK,
        upper=constraint.upper + PATH_SLACK,
        constraints=[Label(f"{name} between stages") for name in constraint.row_names],
        index=np.array(index).T,
        values=np.vstack([at_states.T, at_stages.T, constraint.parameter_values[:, which]]),
    )
