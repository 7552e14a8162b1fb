"""Exact motions to begin with: that of an earlier plan, and that of the robot that is let go."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "earlier_trajectory",
    "finite_elements_of",
    "kept_motion",
    "named_plan",
    "needs_simulated_start",
    "simulated_start",
    "trajectory_of_plan",
    "warm_start",
]

if TYPE_CHECKING:
    from fesd_robot.starts.known import (
        earlier_trajectory,
        finite_elements_of,
        kept_motion,
        named_plan,
        trajectory_of_plan,
        warm_start,
    )
    from fesd_robot.starts.simulated import needs_simulated_start, simulated_start
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.starts.known": [
                "earlier_trajectory",
                "finite_elements_of",
                "kept_motion",
                "named_plan",
                "trajectory_of_plan",
                "warm_start",
            ],
            "fesd_robot.starts.simulated": ["needs_simulated_start", "simulated_start"],
        },
    )
