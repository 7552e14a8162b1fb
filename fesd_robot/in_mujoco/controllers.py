"""The controllers that a plan is replayed with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fesd_robot.errors import OptionError, nearest
from fesd_robot.exactness import ROUNDED
from fesd_robot.in_mujoco.driving import HOLD, Controller, OpenLoop
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.tracking import Tracker, proportional_gains, tracking_gains

if TYPE_CHECKING:
    from fesd_robot.replanning import MovedGoal

CONTROLLERS = {
    "open-loop": "the controls of the plan by time",
    "pd": "those, and a proportional and derivative controller at every joint with a motor to itself",
    "lqr": "those, and the gains of a time-varying linear-quadratic regulator",
}
"""Name of a controller that follows a plan -> what it does."""

REPLAN, EVENT_DRIVEN = "replan", "event-driven"

RUNS = {
    **CONTROLLERS,
    REPLAN: "the rest of the plan, solved again from the measured state every period, and the gains of the regulator",
    EVENT_DRIVEN: "the controls of the plan in this program's own integrator, from event to event",
}
"""Name of a run -> what it is: with a controller in MuJoCo, or beside that."""

MakeController = Callable[[], Controller]


@dataclass(frozen=True)
class Replanning:
    """How the controller `REPLAN` plans again.

    Args:
        period: between two updates, s; default: that of `Replanner`.
        real_time: whether a policy counts only once the time has passed that its computation took.
        goals: values of the goal that are others from a time on, in any order.
    """

    period: float | None = None
    real_time: bool = False
    goals: Sequence[MovedGoal] = ()


def controller_of(
    name: str, plan: Plan, motion: MotionProblem, *, hold: float = HOLD, replanning: Replanning | None = None
) -> MakeController:
    """Return what makes a controller of a plan, once for every run; its gains are computed once.

    Args:
        name: a key of `CONTROLLERS`, or `REPLAN`.
        plan: that is followed; all but the first with its finite elements.
        motion: its task, formulated.
        hold: how long a control holds, s.
        replanning: of `REPLAN`.

    Raises:
        OptionError: no such controller, a period below the hold, or a goal that the task does not have.
        PlanFileError: a plan that gains cannot be computed for, or that cannot be solved again.
    """
    if name == REPLAN:
        return _replanning(plan, motion, hold, replanning or Replanning())
    if name not in CONTROLLERS:
        raise OptionError(f"found controller '{name}', expected one of {', '.join(RUNS)}{nearest(name, RUNS)}")
    if name == "open-loop":
        return lambda: OpenLoop(plan, hold)
    if name == "pd":
        gains = proportional_gains(plan, motion=motion)
    elif plan.gains is not None and plan.gains.kind == "lqr":
        gains = plan.gains
    else:
        gains = tracking_gains(plan, motion=motion)
    return lambda: Tracker(plan, gains, hold=hold, motion=motion)


def _replanning(plan: Plan, motion: MotionProblem, hold: float, wanted: Replanning) -> MakeController:
    from fesd_robot.replanning import Replanner, ReplanningController  # the rooms that solve load slowly
    from fesd_robot.replanning.replanner import PERIOD

    if wanted.period is not None and not wanted.period >= hold - ROUNDED:
        raise OptionError(
            f"period: found {wanted.period:g} s, expected a time of at least {hold:g} s, for which controls hold"
        )
    _check_goals(plan, motion, wanted.goals)
    period = PERIOD if wanted.period is None else wanted.period
    replanner = Replanner(plan, period=period)
    return lambda: ReplanningController(replanner, real_time=wanted.real_time, goals=wanted.goals)


def _check_goals(plan: Plan, motion: MotionProblem, goals: Sequence[MovedGoal]) -> None:
    names, end = motion.task.goal.configuration, float(plan.trajectory.time[-1] - plan.trajectory.time[0])
    for each in goals:
        if each.name not in names:
            known = nearest(each.name, names) or " (its goal has none)"
            raise OptionError(
                f"goal: found '{each.name}', expected a configuration coordinate of the task's goal{known}"
            )
        if not 0.0 <= each.time < end:
            raise OptionError(
                f"goal: found a new {each.name} at {each.time:g} s, expected a time before the plan ends, {end:g} s"
            )
