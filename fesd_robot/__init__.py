"""Plan robot motion through contact with finite elements with switch detection (FESD).

from fesd_robot import load_task, plan
result = plan(load_task("tasks/hopper_one_jump.yaml"))
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"
__all__ = ["Plan", "Task", "load_task", "plan", "read_plan"]

_HOME = {
    "load_task": "fesd_robot.task",
    "Task": "fesd_robot.task",
    "plan": "fesd_robot.planner",
    "Plan": "fesd_robot.plans",
    "read_plan": "fesd_robot.plans",
}

if TYPE_CHECKING:
    from fesd_robot.planner import plan
    from fesd_robot.plans import Plan, read_plan
    from fesd_robot.task import Task, load_task


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'fesd_robot' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(_HOME[name]), name)
