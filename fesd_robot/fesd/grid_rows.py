"""The rows of a moving control grid: equal intervals in a phase, phases that last, knots at their times."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label, Place
from fesd_robot.fesd.grid import ControlGrid
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.mpcc import Block, BlockEquations

SHORTEST_PHASE = 1e-3
"""s; a phase that would last shorter is better left out."""

PHASE = "duration of a phase"
"""Kind of the rows whose bounds are those of a phase's duration; the grid has one a phase, in their order."""


def _row(
    kind: str,
    variables: ca.SX,
    row: ca.SX,
    parameters: ca.SX | None = None,
    bounds: tuple[float, float] = (0.0, 0.0),
) -> BlockEquations:
    return BlockEquations(
        name=kind.replace(" ", "_"),
        variables=variables,
        parameters=ca.SX(0, 1) if parameters is None else parameters,
        cost=ca.SX(0),
        rows=row,
        lower=np.array([bounds[0]]),
        upper=np.array([bounds[1]]),
        constraints=[Label(kind)],
    )


_t, _s, _T = ca.SX.sym("t", 3), ca.SX.sym("s", 2), ca.SX.sym("time")
_EQUAL_INTERVALS = _row("equal intervals", _t, _t[2] - 2 * _t[1] + _t[0])
_PHASE = _row(PHASE, _t[:2], _t[1] - _t[0], bounds=(SHORTEST_PHASE, np.inf))
_KNOT = _row("knot", ca.vertcat(_t[0], _s[0]), _t[0] - _s[0] * _T, _T)
_ONE_PACE = _row("one pace", _s, _s[1] - _s[0])


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
    inside = grid.within_phases
    ends = np.cumsum(grid.phases)
    begins = ends - np.array(grid.phases)
    knots = np.array(grid.knots, dtype=int)
    rows = [
        (_EQUAL_INTERVALS, inside, [clock[k : k + 3] for k in inside], None),
        (_PHASE, begins, [[clock[a], clock[b]] for a, b in zip(begins, ends, strict=True)], None),
        (_KNOT, knots - 1, [[clock[k], pace[k - 1]] for k in knots], grid.nodes[knots][None, :]),
    ]
    if ocp.control_lower[-1] < ocp.control_upper[-1]:
        pairs = range(grid.intervals - 1)
        rows.append((_ONE_PACE, pairs, [[pace[k], pace[k + 1]] for k in pairs], None))
    return [
        Block(
            equations=equations,
            places=[Place(interval=int(k)) for k in intervals],
            index=np.array(index, dtype=int).T,
            values=np.zeros((0, len(intervals))) if values is None else values,
        )
        for equations, intervals, index, values in rows
        if len(intervals)
    ]
