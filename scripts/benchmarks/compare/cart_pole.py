"""A cart swings a pole up, with dry friction between cart and rail.

State (x, angle, their rates), angle 0 hanging; cart 1 kg, pole 0.1 kg at 1 m, friction 2 N, |u| <= 30 N, 5 s.

Source: nosnoc's example cart_pole_with_friction.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from scripts.benchmarks.compare import switched

CART, POLE, LENGTH, GRAVITY, FRICTION = 1.0, 0.1, 1.0, 9.81, 2.0  # kg, kg, m, m/s2, N
RUNNING, TERMINAL, CONTROL = ca.DM([10, 100, 1, 1]), ca.DM([500, 100, 10, 10]), 1.0


def describe() -> switched.SwitchedProblem:
    """Return the problem."""
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u")
    angle, v, rate = x[1], x[2], x[3]
    coupling = POLE * LENGTH * ca.cos(angle)
    mass = ca.vertcat(ca.horzcat(CART + POLE, coupling), ca.horzcat(coupling, POLE * LENGTH**2))
    inverse = ca.inv(mass)

    def field(friction: float) -> ca.SX:
        along = u - friction + POLE * LENGTH * rate**2 * ca.sin(angle)
        return ca.vertcat(v, rate, inverse @ ca.vertcat(along, -POLE * GRAVITY * LENGTH * ca.sin(angle)))

    deviation = x - ca.DM([0, np.pi, 0, 0])
    return switched.SwitchedProblem(
        name="cart_pole",
        state=x,
        control=u,
        sides=[switched.Side(v, field(FRICTION), field(-FRICTION))],
        running=ca.dot(RUNNING, deviation**2) + CONTROL * u**2,
        terminal=ca.dot(TERMINAL, deviation**2),
        initial=np.array([1.0, 0, 0, 0]),
        target=np.full(4, np.nan),
        state_limit=np.array([5.0, np.inf, np.inf, np.inf]),
        control_limit=30.0,
        duration=5.0,
        intervals=20,
        elements=2,
        form="integral",
        equilibration="difference",
        weight=1.0,
        comp_tol=1e-8,
    )
