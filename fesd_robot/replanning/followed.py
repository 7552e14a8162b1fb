"""A plan that is followed: its horizon, what its contacts do, and its gains."""

from __future__ import annotations

from fesd_robot.contact import ContactMode, modes_of
from fesd_robot.errors import PlanFileError
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.replanning.horizon import Horizon
from fesd_robot.replanning.policy import FeedbackGains
from fesd_robot.replanning.strides import STRIDES, Strides
from fesd_robot.starts import kept_motion
from fesd_robot.tracking import gait_gains, tracking_gains


class Followed:
    """A plan made ready to be followed.

    Args:
        plan: exact, on a grid that follows the contacts.
        motion: its task, formulated.
        strides: of a gait that are planned; other plans have none.

    Attributes:
        contacts: their names.
        horizon: the plan as a nonlinear program whose beginning passes.
        modes: what every contact does in every phase, (P) of (n_c).
        gains: of feedback.
        strides: of a gait; None of a plan with a goal.

    Raises:
        PlanFileError: a plan that cannot be followed.
    """

    def __init__(self, plan: Plan, motion: MotionProblem, strides: int = STRIDES) -> None:
        if not plan.status.solved:
            raise PlanFileError(f"{plan.name}: found a plan that is not solved, expected one that can be followed")
        self.plan, self.motion = plan, motion
        self.contacts = [contact.name for contact in motion.contacts]
        whole = _moving_motion(plan, motion)
        self.strides: Strides | None = None
        if motion.task.goal.periodic is None:
            self.horizon, gains = Horizon(whole), tracking_gains(plan, motion=motion)
            ends = self.horizon.phase_ends(whole.w)
            self.gains = FeedbackGains(gains.stacked("time"), gains.stacked("gain"), ends)
        else:
            self.strides = Strides(whole, motion, strides)
            whole, self.horizon = self.strides.motion, self.strides.horizon
            gains = gait_gains(plan, motion, self.strides.image.cost)
            ends = self.horizon.phase_ends(whole.w)[: self.strides.phases + 1]
            self.gains = FeedbackGains(*self.strides.gains(gains.stacked("time"), gains.stacked("gain")), ends)
        self.modes = self._modes_of_phases(whole)

    def _modes_of_phases(self, whole: BranchMotion) -> list[tuple[ContactMode, ...]]:
        run = self.horizon.running
        result = []
        for phase in range(len(whole.transcription.grid.phases)):
            modes = modes_of(whole.branch, int(run.elements[run.first_of(phase)]))
            result.append(tuple(modes[name] for name in self.contacts))
        return result


def _moving_motion(plan: Plan, motion: MotionProblem) -> BranchMotion:
    if plan.finite_elements is None:
        raise PlanFileError(f"{plan.name}: found a plan without its finite elements, expected an exact plan")
    found = kept_motion(plan, motion) if motion.grid.moving else None
    if found is None:
        raise PlanFileError(
            f"{plan.name}: found a plan on a grid that stands still or with impulses between elements, expected one "
            "with method.grid: phases and method.contact: freezing"
        )
    return found
