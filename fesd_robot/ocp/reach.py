"""Whether a frame can get to where a task wants it."""

from __future__ import annotations

import numpy as np

from fesd_robot.ocp.points import AXES, Points
from fesd_robot.robot import Robot
from fesd_robot.task import PointTarget, Task

_SLACK = 1e-6
"""m."""


def check_reach(points: Points, frame: str, target: PointTarget, key: tuple[str, ...]) -> None:
    """Raise if a frame cannot come as near to a target as its tolerance asks, whatever its joints do.

    Raises:
        TaskError: at `key`, saying how far it is out of reach.
    """
    if target.position is None:
        return
    lower, upper, radius = reach(points.robot, points.task, frame)
    out = [
        max(low - wanted, wanted - high, 0.0)
        for wanted, low, high in zip(target.position, lower, upper, strict=True)
        if wanted is not None
    ]
    missing = float(np.linalg.norm(out)) - radius - (target.tolerance or 0.0) * np.sqrt(len(out))
    if missing > _SLACK:
        found = ", ".join(f"{a} {w:g}" for a, w in zip(AXES, target.position, strict=True) if w is not None)
        raise points.task.error(
            key, f"found {found}, which is {missing:.3g} m out of reach of frame '{frame}', expected a position within "
            "its joints' limits and the lengths of its links"
        )  # fmt: skip


def reach(robot: Robot, task: Task, frame: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Return a box and a radius: the frame's origin is never further than the radius from the box.

    Along the joints from the world to the frame, lengths and the travel of sliding joints add up: as a box while no
    joint before turns, as a radius afterwards. A joint of another kind, or without limits, reaches everywhere.

    Returns:
        lower and upper corner of the box, m, (3) each, and the radius, m.
    """
    model, found = robot.model, robot.model.frames[robot.frame_id(frame)]
    joints = [] if found.parentJoint == 0 else [j for j in model.supports[found.parentJoint] if j]
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
    last = found.placement.translation
    if turning:
        return lower, upper, radius + float(np.linalg.norm(last))
    return lower + rotation @ last, upper + rotation @ last, radius


def _axis(robot: Robot, joint: int) -> np.ndarray:
    """Direction of a sliding joint in its own frame."""
    data = robot.model.joints[joint].createData()
    robot.model.joints[joint].calc(data, robot.neutral)
    return np.asarray(data.S).ravel()[:3]
