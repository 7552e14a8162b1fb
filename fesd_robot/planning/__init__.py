"""From a task to its plan: the chain of steps, fallback settings, and which attempt is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = ["Chain", "attempt", "plan"]

if TYPE_CHECKING:
    from fesd_robot.planning.chain import Chain
    from fesd_robot.planning.planner import attempt, plan
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.planning.chain": ["Chain"],
            "fesd_robot.planning.planner": ["attempt", "plan"],
        },
    )
