"""A plan as the fields of ROS's trajectory_msgs/JointTrajectory."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from fesd_robot.errors import FesdRobotError, nearest
from fesd_robot.exactness import ROUNDED
from fesd_robot.plans.columns import CONTROL_CONVENTION
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.full_model import JointMotion
from fesd_robot.plans.plan import Plan

logger = logging.getLogger(__name__)

NANOSECONDS = 1_000_000_000


def joint_trajectory(plan: Plan, joints: Sequence[str] | None = None, *, effort: bool = False) -> dict[str, Any]:
    """Return header, joint_names and points with positions, velocities, effort and time_from_start.

    A message has one point at a time, a plan two samples at an impact, before and after: the one after is written,
    where positions are the same. The last velocities are zero where the plan ends at rest within the tolerance of its
    goal: controllers refuse a message that ends in motion, however slow. Accelerations are left out.

    Args:
        joints: names of joints of the model file with one degree of freedom; default: all of them, locked and coupled
            ones too, without those of a root that is not fixed.
        effort: whether points have efforts, which ROS 2's joint_trajectory_controller refuses where it commands no
            effort interface: what the motors of the joints give, under the controls that
            `fesd_robot.plans.columns.CONTROL_CONVENTION` says, as in the other exports at the same samples.

    Raises:
        FesdRobotError: a joint that the model does not have, or no joint at all; or times or values that are no motion.
    """
    motions = _joints_of(plan)
    chosen = list(motions) if joints is None else list(joints)
    for name in chosen:
        if name not in motions:
            raise FesdRobotError(
                f"found '{name}', expected a joint of the model of {plan.name}{nearest(name, list(motions))}"
            )
    if len(set(chosen)) < len(chosen):
        raise FesdRobotError(f"found a joint twice among {', '.join(chosen)}, expected each once")
    ticks = np.rint(plan.trajectory.time * NANOSECONDS)
    positions, velocities, efforts = (
        np.column_stack([getattr(motions[name], part) for name in chosen])
        for part in ("position", "velocity", "effort")
    )
    values = (ticks, positions, velocities, efforts)
    if not all(np.isfinite(each).all() for each in values) or (np.diff(ticks) < 0).any():
        raise FesdRobotError(f"{plan.name}: its clock steps back or a value is not finite, so it cannot be followed")
    last = np.append(np.diff(ticks) > 0, True)
    _warn(plan, int((~last).sum()))
    if End.of(plan).rests:
        velocities[-1] = 0.0
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": chosen,
        "points": [
            {
                "positions": positions[i].tolist(),
                "velocities": velocities[i].tolist(),
                "accelerations": [],
                "effort": efforts[i].tolist() if effort else [],
                "time_from_start": dict(zip(("sec", "nanosec"), divmod(int(ticks[i]), NANOSECONDS), strict=True)),
            }
            for i in np.flatnonzero(last)
        ],
    }


@dataclass(frozen=True)
class End:
    """How a robot moves at the end of a plan.

    Attributes:
        rests: whether no coordinate moves by more than the tolerance of a goal that wants it to rest, and none without
            such a goal beyond rounding.
        fastest: name of the velocity coordinate that moves most.
        speed: of that one, in its unit.
        unit: ``m/s`` or ``rad/s``.
    """

    rests: bool
    fastest: str
    speed: float
    unit: str

    @classmethod
    def of(cls, plan: Plan) -> End:
        """Return the end of a plan."""
        last = {name: float(abs(values[-1])) for name, values in plan.trajectory.velocity.items()}
        goal = plan.outcome.goal if plan.outcome else []
        wanted = {entry.name: entry.tolerance or 0.0 for entry in goal if entry.kind == "velocity" and entry.goal == 0}
        rests = all(speed <= max(wanted.get(f"{name} velocity", 0.0), ROUNDED) for name, speed in last.items())
        fastest = max(last, key=lambda name: last[name])
        return cls(rests, fastest, last[fastest], plan.units.velocity[fastest])

    @property
    def in_words(self) -> str:
        """Whether the robot is at rest, with its largest velocity if not, and which velocities are written as zero."""
        moves = f"{self.fastest} moves at {self.speed:.3g} {self.unit}"
        if not self.rests:
            return f"the robot does not end at rest: {moves}"
        if self.speed <= ROUNDED:
            return "the robot ends at rest"
        rest = f"the robot ends at rest within the tolerance of its goal ({moves})"
        return f"{rest}; the last velocities are written as zero"


def _joints_of(plan: Plan) -> dict[str, JointMotion]:
    if plan.full_model is None:
        raise FesdRobotError(
            f"{plan.name}: found a plan without the joints of the model file, expected one that has them; "
            "fesd_robot.export_plan adds them to plans of earlier versions"
        )
    if not plan.full_model.joints:
        raise FesdRobotError(
            f"{plan.name}: found a model without a joint of one degree of freedom, expected one that a controller moves"
        )
    return plan.full_model.joints


def _warn(plan: Plan, doubled: int) -> None:
    """Warn about what a controller would not expect."""
    if not plan.status.solved:
        logger.warning("%s is not solved: %s", plan.name, plan.status.message)
    if doubled:
        logger.warning("%d impact(s): of each only the point after it is written", doubled)
    end = End.of(plan)
    logger.log(logging.INFO if end.rests else logging.WARNING, "%s: %s", plan.name, end.in_words)


def _as_yaml(plan: Plan, joints: Sequence[str] | None, effort: bool) -> bytes:
    yaml, stream = YAML(typ="safe", pure=True), io.BytesIO()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 4096
    comments = [f"{plan.name}: {End.of(plan).in_words}", *([CONTROL_CONVENTION] if effort else [])]
    stream.write("".join(f"# {line}\n" for line in comments).encode())
    yaml.dump(joint_trajectory(plan, joints, effort=effort), stream)
    return stream.getvalue()


def _as_json(plan: Plan, joints: Sequence[str] | None, effort: bool) -> bytes:
    return (json.dumps(joint_trajectory(plan, joints, effort=effort), indent=1) + "\n").encode()


JOINT_TRAJECTORY = ExportFormat(
    name="joint-trajectory",
    stem="joint_trajectory",
    content="the fields of ROS's trajectory_msgs/JointTrajectory for all joints of the model file, of every impact the "
    "point after it; efforts with --effort; YAML, or JSON if the file ends in .json",
    writers={".yaml": _as_yaml, ".json": _as_json},
    joints=True,
)
