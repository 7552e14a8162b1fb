"""Optimal control problems with switches, and what is known of their optima."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.fesd import OptimalControlProblem

SIGNS = np.array([[-1], [1]])
LEAST_TIME = 11.8
"""Of the car, s, with controls that may change at any time: 2 s to 10 m/s, 1 s to 25 m/s, and back, 5.8 s between."""


def car(intervals: int, **parts: object) -> OptimalControlProblem:
    """A car that accelerates three times as hard above 10 m/s: 200 m from rest to rest, at most at 25 m/s."""
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    system = stewart(
        Model(x, u, state_names=["position", "speed"]),
        Subsystem(
            switching=x[1] - 10,
            sign_matrix=SIGNS,
            fields=ca.horzcat(ca.vertcat(x[1], u), ca.vertcat(x[1], 3 * u)),
            region_names=["normal", "turbo"],
        ),
    )
    given = {
        "initial_lower": [0, 0],
        "initial_upper": [0, 0],
        "state_lower": [-np.inf, -25],
        "state_upper": [np.inf, 25],
        "terminal_lower": [200, 0],
        "terminal_upper": [200, 0],
        "control_lower": [-5],
        "control_upper": [5],
    }
    return OptimalControlProblem(system, 20, intervals, **{**given, **parts})  # type: ignore[arg-type]


def walk(intervals: int = 4, **parts: object) -> OptimalControlProblem:
    """x' = u left of 0.5, 2 u right of it, from 0 to 1; the integral of 1 + u^2 is least for u = 1, T = 0.75."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    system = stewart(Model(x, u), Subsystem(switching=x - 0.5, sign_matrix=SIGNS, fields=ca.horzcat(u, 2 * u)))
    given = {
        "initial_lower": [0],
        "initial_upper": [0],
        "terminal_lower": [1],
        "terminal_upper": [1],
        "running_cost": {"time": ca.SX(1), "effort": u**2},
    }
    return OptimalControlProblem(system, 2, intervals, **{**given, **parts})  # type: ignore[arg-type]
