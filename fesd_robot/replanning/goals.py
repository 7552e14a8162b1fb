"""A goal that moves while the robot is on its way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fesd_robot.instants import SAME_EVENT


@dataclass(frozen=True)
class MovedGoal:
    """A coordinate whose goal is another one from a time on.

    Args:
        time: since the start of the plan, s.
        name: of a configuration coordinate of the task's goal.
        value: m or rad.
    """

    time: float
    name: str
    value: float


def goal_at(moved: Iterable[MovedGoal], time: float) -> dict[str, float]:
    """Return the values of the goal that are others than the task's at a time: of every coordinate the last one.

    Args:
        moved: in any order.
        time: s.
    """
    begun = sorted((each for each in moved if each.time <= time + SAME_EVENT), key=lambda each: each.time)
    return {each.name: each.value for each in begun}
