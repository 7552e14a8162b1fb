"""A plan as the fields of ROS's trajectory_msgs/JointTrajectory."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from fesd_robot.errors import FesdRobotError, nearest
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan

logger = logging.getLogger(__name__)

NANOSECONDS = 1_000_000_000


def joint_trajectory(plan: Plan, joints: Sequence[str] | None = None) -> dict[str, Any]:
    """Return header, joint_names and points with positions, velocities, effort and time_from_start.

    A message has one point at a time, a plan two samples at an impact, before and after: the one after is written,
    where positions are the same. Efforts are the controls on the interval that begins or goes on at a point; they
    are left out if some joint has no control of its own. Accelerations are left out.

    Args:
        joints: names of joints with one degree of freedom; default: those that a control of their own drives.

    Raises:
        FesdRobotError: a joint that the plan does not have, or no joint at all; or times or values that are no motion.
    """
    driven = driven_joints(plan)
    chosen = list(driven) if joints is None else list(joints)
    valid = _single_joints(plan)
    if not chosen:
        raise FesdRobotError(
            f"{plan.name}: no control drives a single joint, choose the joints by --joint (valid: {', '.join(valid)})"
        )
    for name in chosen:
        if name not in valid:
            raise FesdRobotError(f"found '{name}', expected a joint of {plan.name}{nearest(name, valid)}")
    if len(set(chosen)) < len(chosen):
        raise FesdRobotError(f"found a joint twice among {', '.join(chosen)}, expected each once")
    ticks = np.rint(plan.trajectory.time * NANOSECONDS)
    positions = np.column_stack([_position(plan, name) for name in chosen])
    velocities = np.column_stack([plan.trajectory.velocity[name] for name in chosen])
    if not all(np.isfinite(values).all() for values in (ticks, positions, velocities)) or (np.diff(ticks) < 0).any():
        raise FesdRobotError(f"{plan.name}: its clock steps back or a value is not finite, so it cannot be followed")
    last = np.append(np.diff(ticks) > 0, True)
    effort = (
        _efforts(plan, [driven[name] for name in chosen]) if set(chosen) <= set(driven) else np.zeros((len(last), 0))
    )
    _warn(plan, chosen, driven, int((~last).sum()))
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": chosen,
        "points": [
            {
                "positions": positions[i].tolist(),
                "velocities": velocities[i].tolist(),
                "accelerations": [],
                "effort": effort[i].tolist(),
                "time_from_start": dict(zip(("sec", "nanosec"), divmod(int(ticks[i]), NANOSECONDS), strict=True)),
            }
            for i in np.flatnonzero(last)
        ],
    }


def driven_joints(plan: Plan) -> dict[str, str]:
    """Return name of a joint -> name of the control that drives it and nothing else."""
    actuators = plan.task.get("robot", {}).get("actuators")
    controls, joints = [name for name in plan.controls if name != "time"], _single_joints(plan)
    if actuators is None:
        return {name: name for name in controls if name in joints}
    drives = {actuators[name]["joint"]: name for name in controls if actuators[name].get("type") == "joint"}
    return {joint: name for joint, name in drives.items() if joint in joints}


def _single_joints(plan: Plan) -> list[str]:
    """Return the joints with one degree of freedom: one velocity, and one configuration or its cosine and sine."""
    configuration = plan.trajectory.configuration
    return [name for name in plan.trajectory.velocity if name in configuration or f"{name}.cos" in configuration]


def _position(plan: Plan, joint: str) -> np.ndarray:
    configuration: Mapping[str, np.ndarray] = plan.trajectory.configuration
    if joint in configuration:
        return configuration[joint]
    return np.unwrap(np.arctan2(configuration[f"{joint}.sin"], configuration[f"{joint}.cos"]))


def _efforts(plan: Plan, controls: Sequence[str]) -> np.ndarray:
    """Return the controls of the interval that begins or goes on at every sample, (n, number of controls)."""
    interval = np.searchsorted(plan.controls["time"], plan.trajectory.time + 0.5 / NANOSECONDS, side="right") - 1
    return np.column_stack([plan.controls[name][interval] for name in controls])


def _warn(plan: Plan, chosen: Sequence[str], driven: Mapping[str, str], doubled: int) -> None:
    """Warn about what a controller would not expect."""
    if not plan.status.solved:
        logger.warning("%s is not solved: %s", plan.name, plan.status.message)
    if doubled:
        logger.warning("%d impact(s): of each only the point after it is written", doubled)
    several = [name for name in plan.controls if name != "time" and name not in driven.values()]
    if several:
        logger.warning("controls that drive more than one joint are left out: %s", ", ".join(several))
    undriven = [name for name in chosen if name not in driven]
    if undriven:
        logger.warning("efforts are left out, because no control drives %s alone", ", ".join(undriven))
    not_moving = {**plan.task.get("robot", {}).get("locked", {}), **plan.task.get("robot", {}).get("coupled", {})}
    if not_moving:
        logger.warning("locked and coupled joints of the robot are left out: %s", ", ".join(not_moving))


def _as_yaml(plan: Plan, joints: Sequence[str] | None) -> bytes:
    yaml, stream = YAML(typ="safe", pure=True), io.BytesIO()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 4096
    yaml.dump(joint_trajectory(plan, joints), stream)
    return stream.getvalue()


def _as_json(plan: Plan, joints: Sequence[str] | None) -> bytes:
    return (json.dumps(joint_trajectory(plan, joints), indent=1) + "\n").encode()


JOINT_TRAJECTORY = ExportFormat(
    name="joint-trajectory",
    stem="joint_trajectory",
    content="the fields of ROS's trajectory_msgs/JointTrajectory, of every impact the point after it; YAML, or JSON if "
    "the file ends in .json",
    writers={".yaml": _as_yaml, ".json": _as_json},
    joints=True,
)
