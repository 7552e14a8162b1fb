"""Path, boundary and coupling constraints of an optimal control problem, and their blocks in its MPCC."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Literal, cast

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Label, Place
from fesd_robot.errors import DimensionError
from fesd_robot.fesd.grid import ControlGrid, Span
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.mpcc import Block, BlockEquations
from fesd_robot.running import Identity, Kept

REMEMBERED = 64
"""Constraints whose equations are kept."""

_KEPT: Kept[BlockEquations] = Kept(REMEMBERED)

ConstraintKind = Literal["path", "interval_end", "interval", "coupling", "boundary"]
"""Which points of a trajectory a constraint is about, see `TrajectoryConstraint`."""


@partial(checked, exact=True)
@dataclass(frozen=True)
class TrajectoryConstraint:
    """A constraint lower <= rows(y, p) <= upper and a cost on some points of the trajectory, once for each place.

    The kinds, where they hold, and what y is there:

    - ``path``: every stage, and the right end of every element that has a state of its own: y = (x, u, z);
    - ``interval_end``: the end of every interval: y = x;
    - ``interval``: every interval: y = (x at its start, x at its end);
    - ``coupling``: every interval but the last of all: y = (x at its end, u, x at the next one's end, next u);
    - ``boundary``: the whole motion: y = (x at the start, x at the end).

    Args:
        name: what it is, for messages.
        kind: where it holds.
        variables: y, SX symbols.
        intervals: numbers of the intervals it holds in, or their span on a moving grid; without meaning for
            ``boundary``.
        rows, lower, upper, row_names: SX (m) in y and p, its bounds and names, (m).
        cost: name -> SX in y and p, added once a place.
        parameters: p, SX symbols (n_p).
        values: p, the same in all intervals, (n_p), or one for each of `intervals`, (n_p, len(intervals)).
        spare: by how much a ``path`` may be violated between stages before a refinement holds it there.
        on_request: whether a ``path`` holds nowhere but where a refinement adds it (`AddedRows.paths`).

    Raises:
        DimensionError: rows, bounds and names, or parameters and values, of different lengths.
    """

    name: str
    kind: ConstraintKind
    variables: ca.SX
    intervals: Sequence[int] | Span = (0,)
    rows: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    lower: np.ndarray = field(default_factory=lambda: np.zeros(0))
    upper: np.ndarray = field(default_factory=lambda: np.zeros(0))
    row_names: Sequence[str] = ()
    cost: Mapping[str, ca.SX] = field(default_factory=dict)
    parameters: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    values: np.ndarray | None = None
    spare: float = 0.0
    on_request: bool = False

    def __post_init__(self) -> None:
        n, count = self.rows.numel(), len(self.numbers)
        for what, shape, expected in (
            ("lower", self.lower.shape, (n,)),
            ("upper", self.upper.shape, (n,)),
            ("row_names", (len(self.row_names),), (n,)),
            ("values", self.parameter_values.shape, (self.parameters.numel(), count)),
        ):
            if shape != expected:
                raise DimensionError(f"constraint '{self.name}': {what} has shape {shape}, expected {expected}")

    @property
    def parameter_values(self) -> np.ndarray:
        """p for each of the intervals, (n_p, len(intervals))."""
        values = np.zeros(0) if self.values is None else self.values
        return np.tile(values[:, None], len(self.numbers)) if values.ndim == 1 else values

    @property
    def equations(self) -> BlockEquations:
        """Those of its block; constraints of the same expressions and bounds have the same ones."""
        parts = Identity(self.variables, self.parameters, self.rows, self.cost)
        return _KEPT.of(
            (parts, tuple(self.row_names), self.lower.tobytes(), self.upper.tobytes()),
            lambda: BlockEquations(
                name="constraint",
                variables=self.variables,
                parameters=self.parameters,
                cost=sum(self.cost.values(), ca.SX(0)),
                rows=self.rows,
                lower=self.lower,
                upper=self.upper,
                constraints=[Label(name) for name in self.row_names],
            ),
        )

    @property
    def numbers(self) -> Sequence[int]:
        """The intervals it holds in; of a span there are none before it is `on` a grid."""
        return () if isinstance(self.intervals, Span) else self.intervals

    def on(self, grid: ControlGrid) -> TrajectoryConstraint:
        """Return the constraint in the intervals of a grid."""
        return replace(self, intervals=grid.between(self.intervals)) if isinstance(self.intervals, Span) else self


def constraint_block(constraint: TrajectoryConstraint, indices: TrajectoryIndices) -> Block:
    """Return the block of a constraint: a copy for each of its places."""
    places = list(_places(constraint, indices))
    which = [list(constraint.numbers).index(k) for k, _, _ in places]
    return Block(
        equations=constraint.equations,
        places=[where for _, where, _ in places],
        index=np.array([index for _, _, index in places], dtype=int).reshape(-1, constraint.variables.numel()).T,
        values=constraint.parameter_values[:, which],
    )


def constraint_costs(constraint: TrajectoryConstraint, block: Block, w: np.ndarray) -> dict[str, float]:
    """Return every term of a constraint's cost at w, summed over its places."""
    if not constraint.cost or not block.copies:
        return {}
    terms = _terms(Identity(constraint.variables, constraint.parameters, constraint.cost))
    values = np.asarray(ca.DM(terms.map(block.copies)(w[block.index], block.values)).full())
    return {name: float(row.sum()) for name, row in zip(constraint.cost, values, strict=True)}


@lru_cache(maxsize=REMEMBERED)
def _terms(parts: Identity) -> ca.Function:
    """Return (y, p) -> terms of a cost, of variables, parameters and the cost."""
    variables, parameters, cost = cast(tuple[ca.SX, ca.SX, Mapping[str, ca.SX]], parts.parts)
    return ca.Function("terms", [variables, parameters], [ca.vertcat(*cost.values())])


def _places(constraint: TrajectoryConstraint, indices: TrajectoryIndices) -> Iterator[tuple[int, Place, np.ndarray]]:
    """Yield (interval, place, indices of the variables) of every place of a constraint."""
    state, control = indices.state, indices.control
    if constraint.kind == "boundary":
        yield constraint.numbers[0], Place(name="the motion"), np.concatenate([state(0), state(indices.intervals)])
        return
    for k in constraint.numbers:
        if constraint.kind == "path":
            yield from ((k, where, index) for where, index in _points(k, indices))
        elif constraint.kind == "interval_end":
            yield k, Place(interval=k), state(k + 1)
        elif constraint.kind == "interval":
            yield k, Place(interval=k), np.concatenate([state(k), state(k + 1)])
        elif k + 1 < indices.intervals:
            both = [state(k + 1), control(k), state(k + 2), control(k + 1)]
            yield k, Place(interval=k, name=f"to interval {k + 1}"), np.concatenate(both)


def _points(k: int, indices: TrajectoryIndices) -> Iterator[tuple[Place, np.ndarray]]:
    """Yield (place, indices of (x, u, z)) of every stage and own right end of an interval."""
    layout, first = indices.layout(k), indices.offsets[k]
    for n in range(layout.elements):
        for j in range(layout.stages + layout.end_state):
            x, z = layout.state(n, j), layout.algebraic(n, j)
            own = [first + np.arange(x.start, x.stop), indices.control(k), first + np.arange(z.start, z.stop)]
            at_stage = j < layout.stages
            place = Place(k, n, stage=j + 1 if at_stage else None, name="" if at_stage else "right end")
            yield place, np.concatenate(own)
