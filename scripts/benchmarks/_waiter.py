"""CRISP's waiter as its file poses it, in its own steps, on the slides of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan

STEP, STEPS = 0.05, 99
"""s, and how many."""

PLATE, FINGER, LENGTH, SIZE, GRAVITY = 2.0, 1.0, 7.0, 0.1, 9.81
"""kg, kg, m (half of the plate), m and m/s^2."""

ON_TABLE, ON_FINGER = 0.1, 1.0
"""Coefficients of friction."""

WEIGHT, STATE = 1e-4, 100.0
"""Of the squared forces of every step, and of the squared distances from the goal at the end."""

STILL = 1e-3
"""m/s; below it nothing slides."""


@dataclass(frozen=True)
class Waiter:
    """x1'' m1 = f - p, x2'' m2 = u - f: a plate that the finger pulls with f, and the table brakes with p.

    The finger lifts it with n >= 0, |f| <= mu2 n, |p| <= mu1 (m1 g - n); m1 g l >= n (x2 - x1 + l) keeps it on its rear
    end. Positions follow from the velocities after a step.

    Attributes:
        goal: x1, x2, v1, v2, m and m/s.
    """

    goal: tuple[float, float, float, float] = (SIZE, SIZE, 2.0, 2.0)

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation, a local optimum on the slides of a plan.

        Args:
            plan: of the task.
        """
        at = plan.at(np.minimum(STEP * np.arange(STEPS + 1), plan.trajectory.time[-1]))
        states = np.column_stack(
            [of[one] for of in (at.configuration, at.velocity) for one in ("plate.root_x", "finger_x")]
        )
        x, u, f, p, n = ca.SX.sym("x", 4, STEPS + 1), *(ca.SX.sym(name, STEPS) for name in "ufpn")
        rows, lower, upper = list[ca.SX](), list[float](), list[float]()

        def hold(row: ca.SX, low: float, high: float) -> None:
            rows.append(row)
            lower.append(low)
            upper.append(high)

        for k in range(STEPS):
            speeds = x[2:, k] + STEP * ca.vertcat((f[k] - p[k]) / PLATE, (u[k] - f[k]) / FINGER)
            after = ca.vertcat(x[:2, k] + STEP * speeds, speeds)
            for row in ca.vertsplit(x[:, k + 1] - after):
                hold(row, 0.0, 0.0)
            table, finger = ON_TABLE * (PLATE * GRAVITY - n[k]), ON_FINGER * n[k]
            slides = (
                (x[2, k], states[k, 2], p[k], table),
                (x[3, k] - x[2, k], states[k, 3] - states[k, 2], f[k], finger),
            )
            for speed, planned, force, limit in slides:
                side = float(np.sign(planned)) if abs(planned) > STILL else 0.0
                hold(speed, 0.0 if side >= 0 else -np.inf, 0.0 if side <= 0 else np.inf)
                hold(limit - force, 0.0, 0.0 if side > 0 else np.inf)
                hold(limit + force, 0.0, 0.0 if side < 0 else np.inf)
            hold(PLATE * GRAVITY * LENGTH - n[k] * (x[1, k] - x[0, k] + LENGTH), 0.0, np.inf)
            hold(LENGTH - (x[1, k] - x[0, k]), 0.0, np.inf)
        cost = WEIGHT * (ca.sumsqr(u) + ca.sumsqr(n)) + STATE * ca.sumsqr(x[:, -1] - ca.DM(list(self.goal)))
        places = np.tile([-np.inf, SIZE, -np.inf, -np.inf], STEPS)
        free, pull = np.full(3 * STEPS, np.inf), np.full(STEPS, PLATE * GRAVITY)
        options: dict[str, Any] = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
        w = ca.vertcat(ca.vec(x), u, f, p, n)
        solver = ca.nlpsol("peer", "ipopt", {"x": w, "f": cost, "g": ca.vertcat(*rows)}, options)
        result = solver(
            x0=np.concatenate([states.ravel(), np.zeros(4 * STEPS)]),
            lbx=np.concatenate([states[0], places, -free, np.zeros(STEPS)]),
            ubx=np.concatenate([states[0], np.full(4 * STEPS, np.inf), free, pull]),
            lbg=lower,
            ubg=upper,
        )
        g = np.asarray(result["g"]).ravel()
        return float(result["f"]), float(max(np.maximum(np.array(lower) - g, g - np.array(upper)).max(), 0.0))
