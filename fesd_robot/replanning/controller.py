"""A controller that plans again while it drives: with the time of the simulator, or with that of the clock."""

from __future__ import annotations

import numpy as np

from fesd_robot.instants import SAME_EVENT
from fesd_robot.replanning.policy import Policy
from fesd_robot.replanning.replanner import Replanner


class ReplanningController:
    """Gives a replanner a measurement every period, and follows its last policy in between.

    Args:
        replanner: of the plan.
        real_time: whether a policy counts only once the time has passed that its computation took; else the world
            waits for it.
    """

    def __init__(self, replanner: Replanner, *, real_time: bool = False) -> None:
        self.replanner, self._real_time = replanner, real_time
        replanner.reset()
        self._next = 0.0
        self._policy: Policy | None = None
        self._coming: tuple[float, Policy] | None = None

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the controls, N or N m, (n_u).

        Args:
            time: since the start of the plan, s.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order.
            contacts: which contacts touch, (n_c) of bool.
        """
        if self._coming and time >= self._coming[0] - SAME_EVENT:
            self._policy, self._coming = self._coming[1], None
        if time >= self._next - SAME_EVENT and self._coming is None:
            policy = self.replanner.update(time, configuration, velocity, contacts)
            spent = self.replanner.statistics.updates[-1].feedback_seconds if self._real_time else 0.0
            self.replanner.search(wait=not self._real_time)
            self.replanner.prepare()
            self._next = time + self.replanner.period
            if self._policy is None or not self._real_time:
                self._policy = policy
            else:
                self._coming = time + spent, policy
        assert self._policy is not None
        return self._policy.action(time, configuration, velocity, contacts)
