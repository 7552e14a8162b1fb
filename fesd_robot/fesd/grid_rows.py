"""The rows of a moving control grid: equal intervals in a phase, phases that last, knots at their times."""

from __future__ import annotations

from collections.abc import Sequence

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
    t, nothing = ca.SX.sym("t", 3), ca.SX(0, 1)
    inside = grid.within_phases
    ends = np.cumsum(grid.phases)
    begins = ends - np.array(grid.phases)
    s, time = ca.SX.sym("s", 2), ca.SX.sym("time")
    knots = np.array(grid.knots, dtype=int)
    blocks = [
        _block("equal_intervals", "equal intervals", t, t[2] - 2 * t[1] + t[0], nothing, inside,
               [[clock[k], clock[k + 1], clock[k + 2]] for k in inside]),
        _block("phase", PHASE, t[:2], t[1] - t[0], nothing, begins.tolist(),
               [[clock[a], clock[b]] for a, b in zip(begins, ends, strict=True)], lower=SHORTEST_PHASE, upper=np.inf),
        _block("knot", "knot", ca.vertcat(t[0], s[0]), t[0] - s[0] * time, time, (knots - 1).tolist(),
               [[clock[k], pace[k - 1]] for k in knots], values=grid.nodes[knots][None, :]),
    ]  # fmt: skip
    if ocp.control_lower[-1] < ocp.control_upper[-1]:
        pairs = list(range(grid.intervals - 1))
        index = [[pace[k], pace[k + 1]] for k in pairs]
        blocks.append(_block("pace", "one pace", s, s[1] - s[0], nothing, pairs, index))
    return [block for block in blocks if block.copies]


def _block(
    name: str,
    kind: str,
    variables: ca.SX,
    row: ca.SX,
    parameters: ca.SX,
    intervals: Sequence[int],
    index: Sequence[Sequence[int]],
    *,
    values: np.ndarray | None = None,
    lower: float = 0.0,
    upper: float = 0.0,
) -> Block:
    """Return the block of one row, with a copy for each of the intervals."""
    count = len(intervals)
    return Block(
        name=name,
        places=[Place(interval=int(k)) for k in intervals],
        variables=variables,
        parameters=parameters,
        cost=ca.SX(0),
        rows=row,
        lower=np.array([lower]),
        upper=np.array([upper]),
        constraints=[Label(kind)],
        index=np.array(index, dtype=int).reshape(count, variables.numel()).T,
        values=np.zeros((parameters.numel(), count)) if values is None else values,
    )
