"""A first task for a robot: which feet it has, how it stands, and a short motion, as a task file with comments."""

from __future__ import annotations

from fesd_robot.first_task.propose import propose_first_task

__all__ = ["propose_first_task"]
