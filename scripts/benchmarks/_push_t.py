"""CRISP's T on a table as its file poses it, in its own steps, on the sides that a plan pushes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from scripts.benchmarks._peers import optimum, push_at, slider_states

STEP, STEPS = 0.05, 49
"""s, and how many."""

FORCE = 0.4 * 1 * 9.8
TORQUE = FORCE * 0.4 * 2.8 * 0.05
"""By velocity, N s/m, and by angular velocity, N m s."""

CONTROL, LAST = 0.01, 100.0
"""Weights of the squared force of every step, and of the squared distance from the goal at the end; 1 at every step."""


@dataclass(frozen=True)
class PushT:
    """A T without inertia, whose velocity is the force on it divided by a number.

    At every step a normal force acts at a place of one side; positions follow from the state before the step.
    """

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation on the sequence of sides of a plan, begun from it.

        Args:
            plan: of the task.
        """
        x, y, pitch = (plan.task["goal"]["configuration"][name] for name in ("root_x", "root_z", "root_pitch"))
        goal = (x, y, -pitch)
        times = STEP * np.arange(STEPS + 1)
        states = slider_states(plan, times)
        pushes = [push_at(plan, float(time)) for time in times[:-1] + STEP / 2]
        x, f, arm = ca.SX.sym("x", 3, STEPS + 1), ca.SX.sym("f", STEPS), ca.SX.sym("arm", STEPS)
        rows, cost = [x[:, 0] - ca.DM(states[0])], LAST * _distance(x[:, -1], goal)
        for k, push in enumerate(pushes):
            cosine, sine = ca.cos(x[2, k]), ca.sin(x[2, k])
            along, across = push.direction
            speed = f[k] / FORCE * ca.vertcat(cosine * along - sine * across, sine * along + cosine * across)
            rate = ca.vertcat(speed, f[k] * arm[k] / TORQUE)
            rows.append(x[:, k + 1] - x[:, k] - STEP * rate)
            cost += CONTROL * f[k] ** 2 + _distance(x[:, k], goal)
        arms, zero = np.array([push.arms for push in pushes]), np.zeros(3 * (STEPS + 1))
        free, force = np.full(3 * (STEPS + 1), np.inf), np.array([push.force for push in pushes])
        start = np.clip([push.arm for push in pushes], arms[:, 0], arms[:, 1])
        return optimum(
            {"x": ca.vertcat(ca.vec(x), f, arm), "f": cost, "g": ca.vertcat(*rows)},
            {
                "x0": np.concatenate([states.ravel(), force, start]),
                "lbx": np.concatenate([-free, np.zeros(STEPS), arms[:, 0]]),
                "ubx": np.concatenate([free, np.full(STEPS, np.inf), arms[:, 1]]),
                "lbg": zero,
                "ubg": zero,
            },
        )


def _distance(state: ca.SX, goal: Sequence[float]) -> ca.SX:
    """Return a squared distance, of angles that of their sines and cosines."""
    turn = ca.vertcat(ca.cos(state[2]) - np.cos(goal[2]), ca.sin(state[2]) - np.sin(goal[2]))
    return ca.sumsqr(state[:2] - ca.DM(list(goal[:2]))) + ca.sumsqr(turn)
