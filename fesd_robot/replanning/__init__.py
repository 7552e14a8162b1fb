"""Plans solved again at the rate of a controller, from the states in which the robot is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "ContactEvent",
    "MovedGoal",
    "Policy",
    "Replanner",
    "ReplanningController",
    "Statistics",
    "Update",
    "goal_at",
]

if TYPE_CHECKING:
    from fesd_robot.replanning.controller import ReplanningController
    from fesd_robot.replanning.goals import MovedGoal, goal_at
    from fesd_robot.replanning.policy import ContactEvent, Policy
    from fesd_robot.replanning.replanner import Replanner, Statistics, Update
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.replanning.controller": ["ReplanningController"],
            "fesd_robot.replanning.goals": ["MovedGoal", "goal_at"],
            "fesd_robot.replanning.policy": ["ContactEvent", "Policy"],
            "fesd_robot.replanning.replanner": ["Replanner", "Statistics", "Update"],
        },
    )
