"""Reach: how far a frame or the centre of mass can get, whatever the joints do."""

from __future__ import annotations

import numpy as np

from fesd_robot.exactness import WRITTEN
from fesd_robot.ocp.points import Points
from fesd_robot.robot import Robot
from fesd_robot.task import PointTarget, Task, along_axes

Reach = tuple[np.ndarray, np.ndarray, float]
"""Lower and upper corner of a box, m, (3) each, and a radius, m: a point is never further than it from the box."""


def check_reach(points: Points, frame: str | None, target: PointTarget, key: tuple[str, ...]) -> None:
    """Raise if a frame cannot come as near to a target as its tolerance asks, whatever its joints do.

    Args:
        frame: name of the frame; None stands for the centre of mass.

    Raises:
        TaskError: at `key`, saying how far it is out of reach.
    """
    if target.position is None:
        return
    lower, upper, radius = (
        reach_of_mass(points.robot, points.task) if frame is None else reach(points.robot, points.task, frame)
    )
    out = [
        max(low - wanted, wanted - high, 0.0)
        for wanted, low, high in zip(target.position, lower, upper, strict=True)
        if wanted is not None
    ]
    missing = float(np.linalg.norm(out)) - radius - (target.tolerance or 0.0) * np.sqrt(len(out))
    if missing > WRITTEN:
        what = "the centre of mass" if frame is None else f"frame '{frame}'"
        raise points.task.error(
            key,
            f"found {along_axes(target.position)}, which is {missing:.3g} m out of reach of {what}, expected a "
            "position within its joints' limits and the lengths of its links",
        )


def reach(robot: Robot, task: Task, frame: str) -> Reach:
    """Return the reach of the origin of a frame.

    Along the joints from the world to the frame, lengths and the travel of sliding joints add up: as a box while no
    joint before turns, as a radius afterwards. A joint of another kind, or without limits, reaches everywhere.
    """
    pinocchio_frame = robot.model.frames[robot.frame_id(frame)]
    return _reach(robot, task, pinocchio_frame.parentJoint, np.asarray(pinocchio_frame.placement.translation))


def reach_of_mass(robot: Robot, task: Task) -> Reach:
    """Return the reach of the centre of mass: the mean of that of the bodies, weighted by their masses."""
    inertias = [(joint, robot.model.inertias[joint]) for joint in range(1, robot.model.njoints)]
    bodies = [(each.mass, _reach(robot, task, joint, each.lever)) for joint, each in inertias if each.mass > 0]
    total = sum(mass for mass, _ in bodies)
    lower = sum((mass / total * one[0] for mass, one in bodies), np.zeros(3))
    upper = sum((mass / total * one[1] for mass, one in bodies), np.zeros(3))
    return lower, upper, sum(mass / total * one[2] for mass, one in bodies)


def _reach(robot: Robot, task: Task, parent: int, last: np.ndarray) -> Reach:
    """Return the reach of a point that is fixed to the body of a joint, at `last` in its axes."""
    model = robot.model
    joints = [] if parent == 0 else [j for j in model.supports[parent] if j]
    lower, upper, radius = np.zeros(3), np.zeros(3), 0.0
    rotation = np.eye(3)
    turning = False
    for joint in joints:
        placement, shape = model.jointPlacements[joint], model.joints[joint].shortname()
        if turning:
            radius += float(np.linalg.norm(placement.translation))
        else:
            lower, upper = lower + rotation @ placement.translation, upper + rotation @ placement.translation
            rotation = rotation @ placement.rotation
        if shape.startswith("JointModelR"):
            turning = True
            continue
        if not shape.startswith("JointModelP") or model.joints[joint].nq != 1:
            return np.full(3, -np.inf), np.full(3, np.inf), np.inf
        index = model.joints[joint].idx_q
        limits = (robot.lower_position[index], robot.upper_position[index])
        low, high = task.limits.position.get(robot.configuration_names[index], limits)
        if turning:
            radius += max(abs(low), abs(high))
            continue
        axis = rotation @ _axis(robot, joint)
        with np.errstate(invalid="ignore"):
            ends = np.nan_to_num(np.outer((low, high), axis), nan=0.0, posinf=np.inf, neginf=-np.inf)
        lower, upper = lower + ends.min(axis=0), upper + ends.max(axis=0)
    if turning:
        return lower, upper, radius + float(np.linalg.norm(last))
    return lower + rotation @ last, upper + rotation @ last, radius


def _axis(robot: Robot, joint: int) -> np.ndarray:
    """Return the direction of a sliding joint in its own frame."""
    data = robot.model.joints[joint].createData()
    robot.model.joints[joint].calc(data, robot.neutral)
    return np.asarray(data.S).ravel()[:3]
