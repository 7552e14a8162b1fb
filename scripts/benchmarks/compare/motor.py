"""A linear motor drags a load through a spring, against dry friction in its guide.

State (x1, v1, x2, v2, I): slide, load, current. m1 v1' = k (x2 - x1) + K_F I - F_R sign(v1), m2 v2' = k (x1 - x2),
L I' = u - R I - K_S v1, from rest at 0 to rest at 1 cm in 80 ms with no current, |u| <= 5 V, min int u^2 dt.

Source: nosnoc's example motor_with_friction; Christiansen, Maurer, Zirn, CDC 2008 (the model).
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from scripts.benchmarks.compare import switched

SLIDE, LOAD = 1.03, 0.56  # kg
SPRING, FRICTION = 2.4e3, 2.1  # N/m, N
RESISTANCE, INDUCTANCE, FORCE_CONSTANT, VOLTAGE_CONSTANT = 2.0, 2e-3, 12.0, 12.0  # ohm, H, N/A, V s/m


def describe() -> switched.SwitchedProblem:
    """Return the problem."""
    x, u = ca.SX.sym("x", 5), ca.SX.sym("u")
    x1, v1, x2, v2, current = ca.vertsplit(x)
    stretch = SPRING * (x2 - x1)

    def field(friction: float) -> ca.SX:
        return ca.vertcat(
            v1,
            (stretch + FORCE_CONSTANT * current - friction) / SLIDE,
            v2,
            -stretch / LOAD,
            (u - RESISTANCE * current - VOLTAGE_CONSTANT * v1) / INDUCTANCE,
        )

    return switched.SwitchedProblem(
        name="motor",
        state=x,
        control=u,
        sides=[switched.Side(v1, field(FRICTION), field(-FRICTION))],
        running=u**2,
        terminal=ca.SX(0),
        initial=np.zeros(5),
        target=np.array([0.01, 0, 0.01, 0, 0]),
        state_limit=np.full(5, np.inf),
        control_limit=5.0,
        duration=0.08,
        intervals=30,
        elements=2,
        form="integral",
        equilibration="difference_tanh",
        weight=1.0,
        comp_tol=1e-6,
    )
