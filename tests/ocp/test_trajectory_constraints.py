"""Path, boundary and coupling constraints in the MPCC."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import DimensionError
from fesd_robot.fesd import TrajectoryConstraint, Transcription
from fesd_robot.ocp import formulate
from fesd_robot.task import Task

Load = Callable[[str], Task]


@pytest.mark.parametrize("scheme", ["radau_iia", "gauss_legendre"])
def test_places_are_what_they_say(short: str, load: Load, scheme: str) -> None:
    """Each place reads the states and controls that the unpacked elements have there."""
    motion = formulate(load(short + f"method: {{scheme: {scheme}}}\ncosts: {{control_change: {{leg: 1}}}}\n"))
    x, u, z = (getattr(motion.ocp.system, part) for part in ("state", "control", "algebraic"))
    n = x.numel()
    other = ca.SX.sym("other", n + u.numel())
    p = ca.SX.sym("p")

    def one(kind: str, variables: ca.SX, intervals: range) -> TrajectoryConstraint:
        numbers = np.arange(len(intervals), dtype=float)[None]
        bounds = np.zeros(variables.numel() + 1)
        names = [str(i) for i in range(len(bounds))]
        rows = ca.vertcat(variables, p)
        return TrajectoryConstraint("all", kind, variables, intervals, rows, bounds, bounds, names, {}, p, numbers)  # type: ignore[arg-type]

    constraints = [
        one("path", ca.vertcat(x, u, z), range(1, 3)),
        one("interval_end", x, range(4)),
        one("interval", ca.vertcat(x, other[:n]), range(4)),
        one("coupling", ca.vertcat(x, u, other), range(4)),
        one("boundary", ca.vertcat(x, other[:n]), range(1)),
    ]
    transcription = Transcription(replace(motion.ocp, constraints=constraints), motion.fesd)
    w = np.random.default_rng(0).normal(size=transcription.problem.size)
    stages, ends, intervals, coupling, boundary = (b.evaluate(w)[1] for b in transcription.problem.blocks[-5:])
    elements, controls = transcription.unpack(w), transcription.controls(w)
    nodes = np.array([elements[0].x_left, *(elements[3 * k + 2].x[-1] for k in range(4))])
    np.testing.assert_array_equal(ends, [*nodes[1:].T, range(4)])
    np.testing.assert_array_equal(intervals, [*nodes[:-1].T, *nodes[1:].T, range(4)])
    np.testing.assert_array_equal(
        coupling, [*nodes[1:-1].T, *controls[:, :-1], *nodes[2:].T, *controls[:, 1:], range(3)]
    )
    np.testing.assert_array_equal(boundary.ravel(), [*nodes[0], *nodes[-1], 0])
    points = [(e, state) for e in elements[3:9] for state in e.x]
    np.testing.assert_array_equal(stages[:n], np.array([state for _, state in points]).T)
    np.testing.assert_array_equal(stages[n : n + 3], np.array([e.u for e, _ in points]).T)
    np.testing.assert_array_equal(stages[-1], [e.interval - 1 for e, _ in points])


def test_a_constraint_of_the_wrong_shape() -> None:
    """Bounds, names and parameters have one entry a row or parameter."""
    x = ca.SX.sym("x", 2)
    with pytest.raises(DimensionError, match="upper"):
        TrajectoryConstraint("c", "interval_end", x, (0,), x, np.zeros(2), np.zeros(1), ["a", "b"])
    with pytest.raises(DimensionError, match="values"):
        TrajectoryConstraint("c", "interval_end", x, (0, 1), parameters=ca.SX.sym("p"), values=np.zeros((1, 3)))
