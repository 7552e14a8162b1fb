"""For every long call: time and effort, the end, activities, and the cores that it may use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "Activity",
    "ActivityCallback",
    "Cores",
    "Deadline",
    "EffortLevel",
    "Identity",
    "InBackground",
    "Kept",
    "Lookahead",
    "OutOfTime",
    "ProgressCallback",
    "SearchEffort",
    "Stop",
    "check_time",
    "cores_for",
    "held_deadline",
    "held_to",
    "in_other_process",
    "kept_with_first",
    "seconds_to_wait",
    "stop_requested",
]

if TYPE_CHECKING:
    from fesd_robot.running.activities import Activity, ActivityCallback, ProgressCallback
    from fesd_robot.running.background import InBackground, in_other_process
    from fesd_robot.running.deadline import (
        Deadline,
        OutOfTime,
        check_time,
        held_deadline,
        held_to,
        seconds_to_wait,
    )
    from fesd_robot.running.effort import EffortLevel, SearchEffort
    from fesd_robot.running.kept import Identity, Kept, kept_with_first
    from fesd_robot.running.lookahead import Lookahead
    from fesd_robot.running.processes import Cores, cores_for
    from fesd_robot.running.stop import Stop, stop_requested
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.running.activities": ["Activity", "ActivityCallback", "ProgressCallback"],
            "fesd_robot.running.background": ["InBackground", "in_other_process"],
            "fesd_robot.running.deadline": [
                "Deadline",
                "OutOfTime",
                "check_time",
                "held_deadline",
                "held_to",
                "seconds_to_wait",
            ],
            "fesd_robot.running.effort": ["EffortLevel", "SearchEffort"],
            "fesd_robot.running.kept": ["Identity", "Kept", "kept_with_first"],
            "fesd_robot.running.lookahead": ["Lookahead"],
            "fesd_robot.running.processes": ["Cores", "cores_for"],
            "fesd_robot.running.stop": ["Stop", "stop_requested"],
        },
    )
