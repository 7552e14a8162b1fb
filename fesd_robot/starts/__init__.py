"""Exact motions to begin with: that of an earlier plan, and that of the robot that is let go."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "finite_elements_of",
    "kept_motion",
    "known_elements",
    "known_plan",
    "known_start",
    "named_plan",
    "needs_simulated_start",
    "simulated_start",
]

if TYPE_CHECKING:
    from fesd_robot.starts.known import (
        finite_elements_of,
        kept_motion,
        known_elements,
        known_plan,
        known_start,
        named_plan,
    )
    from fesd_robot.starts.simulated import needs_simulated_start, simulated_start
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.starts.known": [
                "finite_elements_of",
                "kept_motion",
                "known_elements",
                "known_plan",
                "known_start",
                "named_plan",
            ],
            "fesd_robot.starts.simulated": ["needs_simulated_start", "simulated_start"],
        },
    )
