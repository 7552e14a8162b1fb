"""Where the contacts of a plan touch, and which forces act there, along its samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnSurface, ContactGeometry, PointOnSurface
from fesd_robot.contact.ground import LATERAL
from fesd_robot.recovery import closest, tangents_between

if TYPE_CHECKING:
    from fesd_robot.plans import Plan
    from fesd_robot.robot import Robot
    from fesd_robot.task import Task


@dataclass(frozen=True)
class FootMotion:
    """One place of the robot that touches, along n samples.

    Attributes:
        name: of the contact, or of the frame where a contact stands for several feet.
        contact: name of the contact.
        place: where it touches, m, (n, 3).
        path: origin of its frame, m, (n, 3).
        normal, tangent, lateral: directions of the normal, the tangential and the lateral force, (n, 3).
        force: on the robot, N, (n, 3).
        friction: coefficient of Coulomb's law.
        share: of the contact's forces and impulses that acts here.
    """

    name: str
    contact: str
    place: np.ndarray
    path: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    lateral: np.ndarray
    force: np.ndarray
    friction: float
    share: float


def feet_of(plan: Plan, task: Task, robot: Robot, configuration: np.ndarray) -> list[FootMotion]:
    """Return every place that touches, contact by contact.

    Args:
        task, robot: with frames at the contacts, from `load_task_robot`.
        configuration: samples, (n, n_q).
    """
    from fesd_robot.ocp import friction_of, scene_of

    scene = scene_of(task)
    twins = {} if plan.full_model is None else plan.full_model.feet
    known = set(robot.frame_names)
    feet = []
    for name, geometry in scene.geometries.items():
        history = plan.contacts[name]
        frames = [frame for frame, foot in twins.items() if foot.contact == name]
        # Feet that the planned robot has no frame for are drawn as the one that stands for them.
        named = {frame: replace(geometry, frame=frame) for frame in frames} if known.issuperset(frames) else {}
        share = 1.0 / max(len(named), 1)
        for label, own in (named or {name: geometry}).items():
            place, path, normal, tangent, lateral = _along(robot, own, configuration)
            normal_force, tangential_force = share * history.normal_force, share * history.tangential_force
            force = normal_force[:, None] * normal + tangential_force[:, None] * tangent
            if history.lateral_force is not None:
                force = force + share * history.lateral_force[:, None] * lateral
            directions = (normal, tangent, lateral)
            feet.append(FootMotion(label, name, place, path, *directions, force, friction_of(task, name), share))
    return feet


def _along(robot: Robot, geometry: ContactGeometry, configuration: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return place, origin of the frame, normal and both tangents at every sample, (n, 3) each."""
    data, frame = robot.model.createData(), robot.frame_id(geometry.frame)
    result = np.empty((5, len(configuration), 3))
    for sample, q in enumerate(configuration):
        pin.framesForwardKinematics(robot.model, data, q)
        origin = np.array(data.oMf[frame].translation)
        if isinstance(geometry, PointOnSurface):
            normal, (_, tangent, lateral) = geometry.surface.normal(origin), geometry.surface.axes(origin)
            place = origin
        elif isinstance(geometry, CircleOnSurface):
            normal, (outwards, tangent, lateral) = geometry.path.normal(origin), geometry.path.axes(origin)
            place = origin - geometry.radius * outwards
        else:
            other = data.oMf[robot.frame_id(geometry.other_frame)]
            _, normal = closest(geometry, origin, np.array(other.translation), np.array(other.rotation))
            tangent, *rest = tangents_between(geometry, normal)
            lateral = rest[0] if rest else LATERAL
            place = origin - geometry.radius * normal
        result[:, sample] = place, origin, np.ravel(normal), np.ravel(tangent), lateral
    return tuple(result)
