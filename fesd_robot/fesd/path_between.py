"""Path constraints at places between the stages of an element."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from fesd_robot.fesd.constraints import REMEMBERED, TrajectoryConstraint
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.mpcc import Block, BlockEquations

PLACES = 8
"""Equal parts of an element at whose inner ends a path constraint is held; one on request, which is not held at the
stages, at the ends of the element, too."""


@dataclass(frozen=True)
class PathBetween:
    """A path constraint that is held between the stages of an element.

    Attributes:
        constraint: its number among those of the problem.
        element: number of the element in time order.
        margin: by how much its bounds are stricter there, so that they hold between those places, too; negative on the
            way to bounds that are far.
    """

    constraint: int
    element: int
    margin: float = 0.0

    def in_parts(self, parts: Sequence[int], first: Sequence[int]) -> list[PathBetween]:
        """Return the same for elements that are in parts, whose first ones have the numbers `first`."""
        start = first[self.element]
        return [replace(self, element=start + i) for i in range(parts[self.element])]


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
    places = [indices.place(one.element) for one in paths]
    numbers = [place.interval for place in places if place.interval is not None]
    which = [list(constraint.numbers).index(number) for number in numbers]
    index = []
    for one, number in zip(paths, numbers, strict=True):
        points = np.array([indices.stage(one.element, j) for j in range(s)])
        at_nodes = [indices.left_state(one.element), *points[:, : layout.n_x]]
        index.append(np.concatenate([*at_nodes, indices.control(number), *points[:, layout.n_x :]]))
    sizes = layout.n_x, layout.n_u, layout.n_z
    return Block(
        equations=_equations(constraint.equations, sizes, tableau, constraint.on_request),
        places=places,
        index=np.array(index).T,
        values=np.vstack([[one.margin for one in paths], constraint.parameter_values[:, which]]),
    )


@lru_cache(maxsize=REMEMBERED)
def _equations(path: BlockEquations, sizes: tuple[int, int, int], tableau: Tableau, on_request: bool) -> BlockEquations:
    """Return the equations of a path constraint between the stages of an element.

    Args:
        path: of the constraint at a point.
        sizes: n_x, n_u, n_z.
        tableau: a collocation scheme.
        on_request: whether it is not held at stages.
    """
    (n_x, n_u, n_z), s = sizes, tableau.stages
    x, z = ca.SX.sym("x", n_x, s + 1), ca.SX.sym("z", n_z, s)
    u, margin = ca.SX.sym("u", n_u), ca.SX.sym("margin")
    inner = np.arange(1 - on_request, PLACES + on_request) / PLACES
    states = ca.mtimes(x, ca.DM(lagrange(tableau.nodes, inner).T))
    algebraic = ca.mtimes(z, ca.DM(lagrange(tableau.c, inner).T))
    function = ca.Function("rows", [path.variables, path.parameters], [path.rows])
    values = [function(ca.vertcat(states[:, k], u, algebraic[:, k]), path.parameters) for k in range(len(inner))]
    lower, upper = (np.flatnonzero(np.isfinite(side)).tolist() for side in (path.lower, path.upper))
    rows = [value[i] - margin for value in values for i in lower] + [
        value[i] + margin for value in values for i in upper
    ]
    least, most = (np.tile(side[at], len(inner)) for side, at in ((path.lower, lower), (path.upper, upper)))
    labels = [path.constraints[i] for at in (lower, upper) for _ in values for i in at]
    return BlockEquations(
        name="path_between_stages",
        variables=ca.vertcat(ca.vec(x), u, ca.vec(z)),
        parameters=ca.vertcat(margin, path.parameters),
        cost=ca.SX(0),
        rows=ca.vertcat(*rows),
        lower=np.append(least, np.full(len(most), -np.inf)),
        upper=np.append(np.full(len(least), np.inf), most),
        constraints=[replace(label, kind=f"{label.kind} between stages") for label in labels],
    )
