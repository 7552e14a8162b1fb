"""A plan replayed in MuJoCo with several controllers, as numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.in_mujoco.controllers import (
    CONTROLLERS,
    EVENT_DRIVEN,
    REPLAN,
    MakeController,
    Replanning,
    controller_of,
)
from fesd_robot.in_mujoco.driving import HOLD, Controller, RunRecord, run
from fesd_robot.in_mujoco.measures import Deviation
from fesd_robot.in_mujoco.perturbed import Perturbation, perturbations
from fesd_robot.in_mujoco.replanned import Replanned
from fesd_robot.in_mujoco.scene import MujocoScene, mujoco_scene, sliding_contacts
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning import goal_at

Tell = Callable[[str], None]
"""Takes a sentence about what is being done."""


@dataclass(frozen=True)
class PerturbedRun:
    """A run that differed from the plan, whether it finished, and the largest error of a body at its end, m."""

    what: str
    finished: bool
    base_end: float | None


@dataclass(frozen=True)
class ReplayRun:
    """A plan replayed with a controller.

    Attributes:
        controller: its name.
        record: the run.
        deviation: from the plan.
        perturbed: runs that differ from the plan, none if they were not asked for.
        different: what was different from the plan.
        replanned: how the plan was solved again, if it was.
    """

    controller: str
    record: RunRecord
    deviation: Deviation
    perturbed: Sequence[PerturbedRun] = ()
    different: Perturbation = field(default_factory=Perturbation)
    replanned: Replanned | None = None

    def entry(self) -> dict[str, Any]:
        """Return the run as an entry of ``replay.json``: m, rad and s, None where there is nothing of a kind."""
        found, bodies = self.deviation, self.deviation.bodies
        share, saturated = found.effort

        def worst(name: str) -> float | None:
            return max((getattr(each, name) for each in bodies.values()), default=None)

        return {
            "controller": self.controller,
            "finished": found.finished,
            "base_rms": worst("rms"),
            "base_end": worst("end"),
            "base_angle_rms": worst("angle_rms"),
            "base_angle_end": worst("angle_end"),
            "bodies": {name: asdict(each) for name, each in bodies.items()},
            "joint_rms": found.joint_rms("rad/s"),
            "slide_rms": found.joint_rms("m/s"),
            "touchdown_errors": [each.error for each in found.touchdowns],
            "touchdowns": [asdict(each) for each in found.touchdowns],
            "slip": found.slip,
            "effort": share,
            "saturated": saturated,
            "perturbed": {
                "finished": sum(each.finished for each in self.perturbed),
                "runs": [asdict(each) for each in self.perturbed],
            }
            if self.perturbed
            else None,
            "mass": self.different.mass,
            "friction": self.different.friction,
            "pushes": [asdict(each) for each in self.different.disturbance.pushes],
            "replanning": self.replanned.entry() if self.replanned else None,
        }


@dataclass(frozen=True)
class Replay:
    """A plan replayed in MuJoCo.

    Attributes:
        plan: the plan.
        scene: in which it ran.
        runs: with each controller.
        left_out: controllers that could not be made, and why.
    """

    plan: Plan
    scene: MujocoScene
    runs: Sequence[ReplayRun]
    left_out: Sequence[str] = ()


def replay(
    plan: Plan,
    controllers: Sequence[str] = tuple(CONTROLLERS),
    *,
    perturb: bool = False,
    different: Perturbation | None = None,
    replanning: Replanning | None = None,
    unsolved: bool = False,
    motion: MotionProblem | None = None,
    tell: Tell | None = None,
) -> Replay:
    """Replay a plan in MuJoCo.

    Args:
        plan: from `plan` or `read_plan`.
        controllers: keys of `RUNS`.
        perturb: whether twenty runs that differ from the plan follow each, `perturbations`.
        different: what is different from the plan in all runs, in MuJoCo only.
        replanning: how the controller ``replan`` plans again.
        unsolved: whether a plan that is not solved is replayed, too; in open loop only, for there are no gains for it.
        motion: the task of the plan, formulated; default: it is formulated.
        tell: is told what is being done.

    Raises:
        PlanFileError: a plan that is not solved.
        TaskError: a file that its task names cannot be read any more.
        RobotError: a robot that MuJoCo cannot have.
        OptionError: no such controller, or something different that cannot be.
    """
    if not plan.status.solved and not unsolved:
        raise PlanFileError(
            f"{plan.name}: found a plan that is not solved, expected one that is; --force replays it all the same"
        )
    say = tell or (lambda _: None)
    motion = formulate(task_of(plan), driven=False) if motion is None else motion
    if different is not None and EVENT_DRIVEN in controllers:
        raise OptionError(f"found {EVENT_DRIVEN} with something different from the plan, expected a run in MuJoCo")
    if replanning is not None and REPLAN not in controllers:
        raise OptionError(
            f"found a period, real time or a goal for {', '.join(controllers)}, expected {REPLAN} among the controllers"
        )
    given, moved = different or Perturbation(), replanning.goals if replanning else ()
    runner = _Runner(plan, motion, sliding_contacts(plan), goal_at(moved, float("inf")))
    scene, runs, left_out = runner.scene(given), [], []
    for name in controllers:
        say(f"replaying {plan.name} with {name}")
        if name == EVENT_DRIVEN:
            record = _integrated(plan, motion)
            runs.append(ReplayRun(name, record, Deviation(scene, plan, record)))
            continue
        try:
            make = controller_of(name, plan, motion, replanning=replanning)
        except PlanFileError as error:
            if not unsolved:
                raise
            left_out.append(f"{name} is left out: {error}")
            continue
        controller = make()
        record, deviation = runner.run(scene, controller, given)
        replanned = Replanned.of(controller) if name == REPLAN else None
        perturbed = runner.perturbed(make, given, say) if perturb else ()
        runs.append(ReplayRun(name, record, deviation, perturbed, given, replanned))
    return Replay(plan, scene, runs, left_out)


def _integrated(plan: Plan, motion: MotionProblem) -> RunRecord:
    from fesd_robot.in_mujoco.own_integrator import integrated  # the rooms of simulation load slowly

    return integrated(plan, motion.robot)


@dataclass(frozen=True)
class _Runner:
    """Runs of a plan, each in a scene of its own.

    Args:
        plan, motion: the plan, and its task.
        sliding: contacts that slide nearly all of the time.
        goal: values of the goal that are others at the end of a run.
    """

    plan: Plan
    motion: MotionProblem
    sliding: Sequence[str]
    goal: Mapping[str, float]

    def scene(self, given: Perturbation) -> MujocoScene:
        """Return the scene of runs that differ from the plan."""
        return mujoco_scene(self.motion, mass=given.mass, friction=given.friction, sliding=self.sliding)

    def run(self, scene: MujocoScene, controller: Controller, given: Perturbation) -> tuple[RunRecord, Deviation]:
        """Return a run, and its deviation from the plan."""
        record = run(scene, self.plan, controller, hold=HOLD, disturbance=given.disturbance)
        return record, Deviation(scene, self.plan, record, self.goal)

    def perturbed(self, make: MakeController, given: Perturbation, say: Tell) -> list[PerturbedRun]:
        """Return twenty runs that differ from the plan."""
        result, cases = [], perturbations(self.motion.robot)
        for number, case in enumerate(cases):
            say(f"run {number + 1} of {len(cases)}: {case.what}")
            both = case.beside(given)
            _, found = self.run(self.scene(both), make(), both)
            end = max((each.end for each in found.bodies.values()), default=None)
            result.append(PerturbedRun(case.what, found.finished, end))
        return result
