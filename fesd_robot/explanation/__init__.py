"""A task in words: what will be solved, and likely mistakes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "aligned",
    "explanation",
    "task_warnings",
]

if TYPE_CHECKING:
    from fesd_robot.explanation.problem import explanation
    from fesd_robot.explanation.table import aligned
    from fesd_robot.explanation.warnings import task_warnings
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.explanation.problem": ["explanation"],
            "fesd_robot.explanation.table": ["aligned"],
            "fesd_robot.explanation.warnings": ["task_warnings"],
        },
    )
