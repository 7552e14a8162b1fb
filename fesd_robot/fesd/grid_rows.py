"""The rows of a moving control grid: equal intervals in a phase, phases that last, knots at their times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label, Place
from fesd_robot.fesd.grid import ControlGrid
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.mpcc import Block

SHORTEST_PHASE = 1e-3
"""s; a phase that would last shorter is better left out."""

PHASE = "duration of a phase"
"""Kind of the rows whose bounds are those of a phase's duration; the grid has one a phase, in their order."""


def grid_blocks(grid: ControlGrid, indices: TrajectoryIndices, ocp: OptimalControlProblem) -> list[Block]:
    """Return the blocks of the rows of a moving grid, with t_k the clock at the k-th node and s its pace.

    - ``t_{k+2} - 2 t_{k+1} + t_k = 0`` where both intervals are in one phase;
    - ``t_b - t_a >= SHORTEST_PHASE`` for a phase from node a to node b;
    - ``t_k = s T_k`` for a knot k at T_k, s of the nominal duration;
    - ``s_{k+1} = s_k`` if the pace is free.

    Args:
        grid: the control intervals.
        indices: where the variables of the trajectory sit.
        ocp: the problem, with a clock.
    """
    assert ocp.clock is not None
    clock = [int(indices.state(k)[ocp.clock.state]) for k in range(grid.intervals + 1)]
    pace = [int(indices.control(k)[-1]) for k in range(grid.intervals)]
    t = ca.SX.sym("t", 3)
    inside = grid.within_phases
    ends = np.cumsum(grid.phases)
    begins = ends - np.array(grid.phases)
    s, time = ca.SX.sym("s", 2), ca.SX.sym("time")
    knots = np.array(grid.knots, dtype=int)
    phases = _Row(PHASE, t[:2], t[1] - t[0], upper=np.inf, lower=SHORTEST_PHASE)
    rows = [
        (_Row("equal intervals", t, t[2] - 2 * t[1] + t[0]), inside, [clock[k : k + 3] for k in inside]),
        (phases, begins, [[clock[a], clock[b]] for a, b in zip(begins, ends, strict=True)]),
        (
            _Row("knot", ca.vertcat(t[0], s[0]), t[0] - s[0] * time, time, grid.nodes[knots][None, :]),
            knots - 1,
            [[clock[k], pace[k - 1]] for k in knots],
        ),
    ]
    if ocp.control_lower[-1] < ocp.control_upper[-1]:
        pairs = range(grid.intervals - 1)
        rows.append((_Row("one pace", s, s[1] - s[0]), pairs, [[pace[k], pace[k + 1]] for k in pairs]))
    return [row.block(intervals, index) for row, intervals, index in rows if len(intervals)]


@dataclass(frozen=True)
class _Row:
    """One row that holds in several intervals.

    Attributes:
        kind: what it is.
        variables, row: SX symbols, and the row of them.
        parameters, values: SX symbols, (n_p), and their values, (n_p, K).
        lower, upper: bounds of the row.
    """

    kind: str
    variables: ca.SX
    row: ca.SX
    parameters: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    values: np.ndarray | None = None
    lower: float = 0.0
    upper: float = 0.0

    def block(self, intervals: Sequence[int], index: Sequence[Sequence[int]]) -> Block:
        """Return the block of the row, with a copy for each of K intervals, of variables at given indices."""
        count = len(intervals)
        return Block(
            name=self.kind.replace(" ", "_"),
            places=[Place(interval=int(k)) for k in intervals],
            variables=self.variables,
            parameters=self.parameters,
            cost=ca.SX(0),
            rows=self.row,
            lower=np.array([self.lower]),
            upper=np.array([self.upper]),
            constraints=[Label(self.kind)],
            index=np.array(index, dtype=int).reshape(count, self.variables.numel()).T,
            values=np.zeros((0, count)) if self.values is None else self.values,
        )
