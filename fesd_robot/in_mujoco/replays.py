"""A plan replayed in MuJoCo with several controllers, as numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from fesd_robot.errors import PlanFileError
from fesd_robot.in_mujoco.controllers import CONTROLLERS, EVENT_DRIVEN, MakeController, controller_of
from fesd_robot.in_mujoco.driving import HOLD, RunRecord, run
from fesd_robot.in_mujoco.measures import Deviation
from fesd_robot.in_mujoco.perturbed import Perturbation, perturbations
from fesd_robot.in_mujoco.scene import MujocoScene, mujoco_scene, sliding_contacts
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of

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
    """

    controller: str
    record: RunRecord
    deviation: Deviation
    perturbed: Sequence[PerturbedRun] = ()

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
    unsolved: bool = False,
    motion: MotionProblem | None = None,
    tell: Tell | None = None,
) -> Replay:
    """Replay a plan in MuJoCo.

    Args:
        plan: from `plan` or `read_plan`.
        controllers: keys of `RUNS`.
        perturb: whether twenty runs that differ from the plan follow each, `perturbations`.
        unsolved: whether a plan that is not solved is replayed, too; in open loop only, for there are no gains for it.
        motion: the task of the plan, formulated; default: it is formulated.
        tell: is told what is being done.

    Raises:
        PlanFileError: a plan that is not solved.
        TaskError: a file that its task names cannot be read any more.
        RobotError: a robot that MuJoCo cannot have.
        OptionError: no such controller.
    """
    if not plan.status.solved and not unsolved:
        raise PlanFileError(
            f"{plan.name}: found a plan that is not solved, expected one that is; --force replays it all the same"
        )
    say = tell or (lambda _: None)
    motion = formulate(task_of(plan), driven=False) if motion is None else motion
    sliding = sliding_contacts(plan)
    scene = mujoco_scene(motion, sliding=sliding)
    runs, left_out = [], []
    for name in controllers:
        say(f"replaying {plan.name} with {name}")
        if name == EVENT_DRIVEN:
            record = _integrated(plan, motion)
            runs.append(ReplayRun(name, record, Deviation(scene, plan, record)))
            continue
        try:
            make = controller_of(name, plan, motion)
        except PlanFileError as error:
            if not unsolved:
                raise
            left_out.append(f"{name} is left out: {error}")
            continue
        record = run(scene, plan, make())
        perturbed = _perturbed(plan, motion, sliding, make, say) if perturb else ()
        runs.append(ReplayRun(name, record, Deviation(scene, plan, record), perturbed))
    return Replay(plan, scene, runs, left_out)


def _integrated(plan: Plan, motion: MotionProblem) -> RunRecord:
    from fesd_robot.in_mujoco.own_integrator import integrated  # the rooms of simulation load slowly

    return integrated(plan, motion.robot)


def _perturbed(
    plan: Plan, motion: MotionProblem, sliding: Sequence[str], make: MakeController, say: Tell
) -> list[PerturbedRun]:
    result, cases = [], perturbations(motion.robot)
    for number, case in enumerate(cases):
        say(f"run {number + 1} of {len(cases)}: {case.what}")
        result.append(_perturbed_run(plan, motion, sliding, make, case))
    return result


def _perturbed_run(
    plan: Plan, motion: MotionProblem, sliding: Sequence[str], make: MakeController, case: Perturbation
) -> PerturbedRun:
    scene = mujoco_scene(motion, mass=case.mass, friction=case.friction, sliding=sliding)
    record = run(scene, plan, make(), hold=HOLD, disturbance=case.disturbance)
    found = Deviation(scene, plan, record)
    end = max((each.end for each in found.bodies.values()), default=None)
    return PerturbedRun(case.what, found.finished, end)
