"""The controller that plans again: when it asks for updates, and from when on it follows them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fesd_robot.replanning import MovedGoal, ReplanningController, goal_at
from fesd_robot.replanning import controller as module


class Clock:
    """Counts seconds as a test says."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def perf_counter(self) -> float:
        return self.seconds


class Replans:
    """Stands for a replanner: a policy says by its number which update it is of."""

    period = 0.01

    def __init__(self, clock: Clock, feedback: float, prepare: float) -> None:
        self._clock, self._feedback, self._prepare = clock, feedback, prepare
        self.statistics = SimpleNamespace(updates=[])
        self.asked: list[tuple[float, Any]] = []
        self.prepared_for: list[float] = []

    def reset(self) -> None:
        self.statistics.updates.append(SimpleNamespace(feedback_seconds=9.0))  # of an earlier run

    def prepare(self, time: float) -> None:
        self.prepared_for.append(round(time, 6))
        self._clock.seconds += self._prepare

    def search(self, *, wait: bool) -> bool:
        return False

    def update(self, time: float, q: Any, v: Any, contacts: Any, goal: Any = None) -> Any:
        number = len(self.asked)
        self.asked.append((round(time, 6), goal))
        times = SimpleNamespace(feedback_seconds=self._feedback, prepare_seconds=self._prepare)
        self.statistics.updates.append(times)
        return SimpleNamespace(action=lambda *_: np.array([float(number)]))


def driven(monkeypatch: pytest.MonkeyPatch, feedback: float, prepare: float, **options: Any) -> tuple[Any, list[int]]:
    """Return the replanner behind 50 ms of control, and which update was followed in every millisecond."""
    clock = Clock()
    monkeypatch.setattr(module, "clock", clock)
    replanner = Replans(clock, feedback, prepare)
    controller = ReplanningController(replanner, **options)  # type: ignore[arg-type]
    followed = [int(controller.action(1e-3 * k, np.zeros(1), np.zeros(1), np.zeros(1))[0]) for k in range(50)]
    assert len(controller.updates) == len(replanner.asked)
    return replanner, followed


def test_the_world_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long an update takes, it counts at once, and one follows every period."""
    replanner, followed = driven(monkeypatch, 0.5, 0.5)
    assert replanner.asked == [(0.01 * k, None) for k in range(5)]
    assert followed == [k // 10 for k in range(50)]


def test_in_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A policy counts once its 3 ms have passed, the first one at once; fast enough, there is one every period."""
    replanner, followed = driven(monkeypatch, 0.003, 0.006, real_time=True)
    assert [time for time, _ in replanner.asked] == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04])
    assert followed == [0] * 13 + [1] * 10 + [2] * 10 + [3] * 10 + [4] * 7


def test_in_real_time_and_too_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where feedback and preparation take 15 ms, the next measurement is taken, and prepared for, 15 ms later."""
    replanner, _ = driven(monkeypatch, 0.005, 0.010, real_time=True)
    assert [time for time, _ in replanner.asked] == pytest.approx([0.0, 0.015, 0.03, 0.045])
    assert replanner.prepared_for == pytest.approx([0.015, 0.03, 0.045, 0.06])


def test_a_goal_that_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """An update knows the values that are others by then, of every coordinate the last one."""
    goals = [MovedGoal(0.03, "x", 3.0), MovedGoal(0.01, "x", 1.0), MovedGoal(0.02, "z", 2.0)]
    replanner, _ = driven(monkeypatch, 0.0, 0.0, goals=goals)
    wanted = [None, {"x": 1.0}, {"x": 1.0, "z": 2.0}, {"x": 3.0, "z": 2.0}, {"x": 3.0, "z": 2.0}]
    assert [goal for _, goal in replanner.asked] == wanted
    assert goal_at(goals, 0.005) == {}
