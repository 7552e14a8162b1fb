"""A controller that plans again while it drives: with the time of the simulator, or with that of the clock."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence

import numpy as np

from fesd_robot.instants import SAME_EVENT
from fesd_robot.replanning.goals import MovedGoal, goal_at
from fesd_robot.replanning.policy import Policy
from fesd_robot.replanning.replanner import Replanner, Update


class ReplanningController:
    """Gives a replanner a measurement every period, and follows its last policy in between.

    A contact that touches and bounces off again between two measurements has landed.

    Args:
        replanner: of the plan; it begins again at the start.
        real_time: whether a policy counts only once the time has passed that its computation took, and the next one is
            asked for only once all is prepared for it; else the world waits.
        goals: values of the goal that are others from a time on.
    """

    def __init__(self, replanner: Replanner, *, real_time: bool = False, goals: Sequence[MovedGoal] = ()) -> None:
        self.replanner, self.real_time, self.goals = replanner, real_time, tuple(goals)
        replanner.reset()
        self._first_update = len(replanner.statistics.updates)
        self._next = 0.0
        self._policy: Policy | None = None
        self._touching = self._landed = np.zeros(0, dtype=bool)
        self._coming: tuple[float, Policy] | None = None

    @property
    def updates(self) -> Sequence[Update]:
        """Those that this controller has asked for."""
        return self.replanner.statistics.updates[self._first_update :]

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the controls, N or N m, (n_u).

        Args:
            time: since the start of the plan, s.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order.
            contacts: which contacts touch, (n_c) of bool.
        """
        contacts = np.asarray(contacts, dtype=bool)
        if not len(self._touching):
            self._touching, self._landed = contacts.copy(), np.zeros(len(contacts), dtype=bool)
        self._landed |= contacts & ~self._touching
        self._touching = contacts.copy()
        seen = contacts | self._landed
        if self._coming and time >= self._coming[0] - SAME_EVENT:
            self._policy, self._coming = self._coming[1], None
        if time >= self._next - SAME_EVENT and self._coming is None:
            policy = self._updated(time, configuration, velocity, seen)
            self._landed[:] = False
            spent = self.replanner.statistics.updates[-1].feedback_seconds
            begin = clock.perf_counter()
            self.replanner.search(wait=not self.real_time)
            self.replanner.prepare(time + self._until_next(spent))
            ready = time + spent + clock.perf_counter() - begin
            self._next = time + self.replanner.period
            if self.real_time:
                self._next = max(self._next, ready)
            if self._policy is None or not self.real_time:
                self._policy = policy
            else:
                self._coming = time + spent, policy
        assert self._policy is not None
        return self._policy.action(time, configuration, velocity, seen)

    def _until_next(self, spent: float) -> float:
        """Return how long it takes until the next measurement, s; preparing is taken to last as long as it last did."""
        period = self.replanner.period
        return max(period, spent + self.updates[-1].prepare_seconds) if self.real_time else period

    def _updated(self, time: float, q: np.ndarray, v: np.ndarray, contacts: np.ndarray) -> Policy:
        if not self.goals:
            return self.replanner.update(time, q, v, contacts)
        return self.replanner.update(time, q, v, contacts, goal=goal_at(self.goals, time) or None)
