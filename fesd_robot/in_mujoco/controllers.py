"""The controllers that a plan is replayed with."""

from __future__ import annotations

from collections.abc import Callable

from fesd_robot.errors import OptionError, nearest
from fesd_robot.in_mujoco.driving import HOLD, Controller, OpenLoop
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.tracking import Tracker, proportional_gains, tracking_gains

CONTROLLERS = {
    "open-loop": "the controls of the plan by time",
    "pd": "those, and a proportional and derivative controller at every joint with a motor to itself",
    "lqr": "those, and the gains of a time-varying linear-quadratic regulator",
}
"""Name of a controller -> what it does."""

EVENT_DRIVEN = "event-driven"

RUNS = {**CONTROLLERS, EVENT_DRIVEN: "the controls of the plan in this program's own integrator, from event to event"}
"""Name of a run -> what it is: with a controller in MuJoCo, or beside that."""

MakeController = Callable[[], Controller]


def controller_of(name: str, plan: Plan, motion: MotionProblem, *, hold: float = HOLD) -> MakeController:
    """Return what makes a controller of a plan, once for every run; its gains are computed once.

    Args:
        name: a key of `CONTROLLERS`.
        plan: that is followed; of the last two with its finite elements.
        motion: its task, formulated.
        hold: how long a control holds, s.

    Raises:
        OptionError: no such controller.
        PlanFileError: a plan that gains cannot be computed for.
    """
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
