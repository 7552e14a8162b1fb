"""A plan from where the running one is going to end, looked for in another process."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping

import numpy as np

from fesd_robot.ocp import MotionProblem
from fesd_robot.planning import plan as planned
from fesd_robot.plans import Plan
from fesd_robot.replanning.followed import Followed
from fesd_robot.running import InBackground
from fesd_robot.task import Task

LOOKS = 0.01
"""s between two looks for a plan that is waited for."""


def with_goal(task: Task, goal: Mapping[str, float]) -> Task:
    """Return a task with other values of configuration coordinates in its goal, m or rad."""
    configuration = {**task.goal.configuration, **goal}
    return task.model_copy(update={"goal": task.goal.model_copy(update={"configuration": configuration})})


class AnotherPlan:
    """Looks for the plan of a task from another start, at rest.

    Args:
        motion: the task, formulated.
        earlier: its plan, whose contacts are tried first.
        configuration: where the robot rests, (n_q).
        formulated: formulates tasks; the other process does with the plan what takes long, for files in the cache.
    """

    def __init__(
        self,
        motion: MotionProblem,
        earlier: Plan,
        configuration: np.ndarray,
        formulated: Callable[[Task], MotionProblem],
    ) -> None:
        names = motion.robot.configuration_names
        values = dict(zip(names, configuration.tolist(), strict=True))
        initial = motion.task.initial.model_copy(update={"configuration": values, "velocity": {}, "stand_on": None})
        self.task = motion.task.model_copy(update={"initial": initial})
        self.plan: Plan | None = None
        self.over = False

        def found() -> Plan:
            result = planned(self.task, earlier=earlier)
            if result.status.solved:
                Followed(result, formulated(self.task))
            return result

        self._search = InBackground(found, self._take)

    def look(self) -> Plan | None:
        """Return the plan if it is there, and solved."""
        self._search.look()
        return self.plan

    def wait(self) -> Plan | None:
        """Return the plan once it is there; None if none is found, or no other process can be had."""
        while not self.over and self._search.working:
            self._search.look()
            clock.sleep(LOOKS)
        return self.plan

    def end(self) -> None:
        """End the search."""
        self._search.end()

    def _take(self, found: Plan) -> None:
        self.over = True
        self.plan = found if found.status.solved else None
