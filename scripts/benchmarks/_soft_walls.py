"""A cart-pole between two soft walls as other planners pose it, in their own steps, on the touches of a plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.linalg import solve_discrete_are

from fesd_robot.contact import ContactMode
from fesd_robot.plans import Plan

Step = Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
"""State, control and forces of the walls -> the next state; all of it SX."""


WALLS = ("left", "right")

SHIFTS = 8
"""Steps by which touches may end otherwise than in the plan: the peer's model and its steps are others."""

VIOLATION = 1e-6
"""Of rows, up to which a point is an optimum."""


@dataclass(frozen=True)
class SoftWalls:
    """A peer's problem: x = (cart, pole, and their velocities), 0 <= f complementary to gap(x) + f / k >= 0.

    Attributes:
        step: s.
        steps: how many.
        following: the scheme and the dynamics.
        gaps: state -> gap of the left and the right wall, m, SX (2).
        stiffness: k, N/m.
        state: weights of x^2 at every step, (4); control: that of u^2.
        last: matrix of the quadratic cost of the last state, (4, 4).
    """

    step: float
    steps: int
    following: Step
    gaps: Callable[[ca.SX], ca.SX]
    stiffness: float
    state: np.ndarray
    control: float
    last: np.ndarray

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation where walls push about when they do in a plan.

        The best of local optima from the plan, of a linear model the only ones, with touches that end up to `SHIFTS`
        steps earlier or later.

        Args:
            plan: of the task.
        """
        count = self.steps + 1
        at = plan.at(np.minimum(self.step * np.arange(count), plan.trajectory.time[-1]))
        states = np.column_stack([of[name] for of in (at.configuration, at.velocity) for name in ("cart", "pole")])
        pushes = np.column_stack([at.contacts[name].normal for name in WALLS])[:-1]
        touches = np.column_stack(
            [np.array([one is ContactMode.TOUCH for one in at.contacts[name].mode]) for name in WALLS]
        )
        shifts = range(-SHIFTS, SHIFTS + 1) if touches.any() else (0,)
        found = [
            self._optimum(states, pushes, touches[np.clip(np.arange(count) - shift, 0, count - 1)]) for shift in shifts
        ]
        return min((one for one in found if one[1] < VIOLATION), default=found[0])

    def _optimum(self, states: np.ndarray, pushes: np.ndarray, touches: np.ndarray) -> tuple[float, float]:
        """Return objective and violation from states, (steps + 1, 4), and forces, (steps, 2), with given touches."""
        x, f, u = ca.SX.sym("x", 4, self.steps + 1), ca.SX.sym("f", 2, self.steps), ca.SX.sym("u", self.steps)
        rows, upper, cost = list[ca.SX](), list[float](), ca.bilin(ca.DM(self.last), x[:, -1], x[:, -1])
        for k in range(self.steps):
            rows += [
                x[:, k + 1] - self.following(x[:, k], u[k], f[:, k]),
                self.gaps(x[:, k]) + f[:, k] / self.stiffness,
            ]
            upper += [0.0] * 4 + [0.0 if one else np.inf for one in touches[k]]
            cost += ca.dot(ca.DM(self.state), x[:, k] ** 2) + self.control * u[k] ** 2
        w, free = ca.vertcat(ca.vec(x), ca.vec(f), u), np.full(4 * self.steps, np.inf)
        options: dict[str, Any] = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
        solver = ca.nlpsol("peer", "ipopt", {"x": w, "f": cost, "g": ca.vertcat(*rows)}, options)
        most, g_upper = np.where(touches[:-1], np.inf, 0.0).ravel(), np.array(upper)
        result = solver(
            x0=np.concatenate([states.ravel(), pushes.ravel(), np.zeros(self.steps)]),
            lbx=np.concatenate([states[0], -free, np.zeros(2 * self.steps), np.full(self.steps, -np.inf)]),
            ubx=np.concatenate([states[0], free, most, np.full(self.steps, np.inf)]),
            lbg=np.zeros(len(g_upper)),
            ubg=g_upper,
        )
        g = np.asarray(result["g"]).ravel()
        return float(result["f"]), float(max(np.maximum(-g, g - g_upper).max(), 0.0))


def push_bot() -> SoftWalls:
    """Return CRISP's push-bot: 99 steps of 0.02 s, positions from the velocity after a step."""
    step, cart, bob, length = 0.02, 1.0, 0.1, 0.8

    def following(x: ca.SX, u: ca.SX, f: ca.SX) -> ca.SX:
        push, sine, cosine = f[0] - f[1], ca.sin(x[1]), ca.cos(x[1])
        mass = ca.vertcat(
            ca.horzcat(cart + bob, bob * length * cosine), ca.horzcat(bob * length * cosine, bob * length**2)
        )
        force = ca.vertcat(
            u + push + bob * length * x[3] ** 2 * sine, 9.8 * bob * length * sine + push * length * cosine
        )
        v = x[2:] + step * ca.solve(mass, force)
        return ca.vertcat(x[:2] + step * v, v)

    def gaps(x: ca.SX) -> ca.SX:
        tip = x[0] + length * ca.sin(x[1])
        return ca.vertcat(1 + tip, 1 - tip)

    return SoftWalls(step, 99, following, gaps, 200.0, np.zeros(4), 1e-3, 100 * np.eye(4))


def cart_pole() -> SoftWalls:
    """Return C3's cart-pole: 200 explicit steps of 0.01 s of its linear model, with the cost of its regulator after."""
    step, cart, pole, length, com, g = 0.01, 0.978, 0.411, 0.6, 0.4267, 9.81
    drift = np.zeros((4, 4))
    drift[0, 2] = drift[1, 3] = 1.0
    drift[2, 1], drift[3, 1] = g * pole / cart, g * (cart + pole) / (com * cart)
    drive = np.array([0.0, 0.0, 1 / cart, 1 / (com * cart)])
    turning = -1 / (cart * com) + length * (cart + pole) / (cart * pole * com**2)
    right = np.array([0.0, 0.0, -1 / cart + length / (cart * com), turning])
    A, B, weights = np.eye(4) + step * drift, step * drive, np.array([10.0, 2.0, 1.0, 1.0])

    def following(x: ca.SX, u: ca.SX, f: ca.SX) -> ca.SX:
        return ca.mtimes(ca.DM(A), x) + ca.DM(B) * u + step * ca.DM(right) * (f[1] - f[0])

    def gaps(x: ca.SX) -> ca.SX:
        tip = x[0] - length * x[1]
        return ca.vertcat(0.35 + tip, 0.35 - tip)

    last = solve_discrete_are(A, B[:, None], np.diag(weights), np.eye(1))
    return SoftWalls(step, 200, following, gaps, 100.0, weights, 1.0, last)
