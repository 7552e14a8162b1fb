"""Which bodies of a robot are its feet, guessed from the model: the lowest ends of its limbs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.first_task.base import leaf_joints
from fesd_robot.first_task.proposal import Contact
from fesd_robot.robot import Outline, Robot, outline_points, touching_outlines

ABOVE_LOWEST = 0.03
"""m; a frame at most this far above the lowest point of its body, as in the middle of a ball, is where it touches."""

WIDE = 0.06
"""m; a foot whose lower side is within this far of its frame, along x, touches in one place."""

LEVEL = 0.1
"""Of the robot's height: ends of limbs this much higher than the lowest one are no feet."""

SAME_FRAME = 1e-3
"""m; frames at most this far apart are equally low, and places one."""

_EXACT = (coal.Sphere, coal.Capsule, coal.Box, coal.Cylinder)
"""Shapes that a contact of a body can take."""


class Limb(NamedTuple):
    """The end of a limb.

    Attributes:
        joint: the last one.
        frame: the body that is lowest, with the lower origin.
        bodies: all bodies on that joint.
        lowest: height of its lowest point or frame, m.
    """

    joint: int
    frame: str
    bodies: tuple[str, ...]
    lowest: float


def limbs_of(robot: Robot, q: np.ndarray) -> list[Limb]:
    """Return the ends of a robot's limbs in a configuration (nq,)."""
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, q)
    limbs = []
    for joint in leaf_joints(model):
        heights = {
            frame.name: float(data.oMf[i].translation[2])
            for i, frame in enumerate(model.frames)
            if frame.parentJoint == joint and frame.type == pin.FrameType.BODY
        }
        if not heights:
            continue
        low = min(heights.values())
        frames = [name for name, height in heights.items() if height <= low + SAME_FRAME]
        # Of several at one place the one that is called a foot, else the last, which the others carry.
        frame = next((name for name in frames if "foot" in name.lower()), frames[-1])
        bottom = min([low, *(float(points[2].min()) for points in _shape_points(robot, data, tuple(heights)))])
        limbs.append(Limb(joint, frame, tuple(heights), bottom))
    return limbs


def feet_of(robot: Robot, q: np.ndarray, names: Sequence[str] = ()) -> list[Contact]:
    """Return the places that touch the ground in a configuration (nq,) in which the robot stands, from front to back.

    Where legs move in unison, one foot stands for all at its place.

    Args:
        names: of bodies that are feet; none to guess.
    """
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, q)
    limbs = limbs_of(robot, q)
    if names:
        frames = {name: model.frames[robot.frame_id(name)].parentJoint for name in names}
        feet = [Limb(joint, name, (name,), 0.0) for name, joint in frames.items()]
    else:
        lowest = min(limb.lowest for limb in limbs)
        height = max(float(pose.translation[2]) for pose in data.oMi) - lowest
        feet = [limb for limb in limbs if limb.lowest <= lowest + max(LEVEL * height, ABOVE_LOWEST)]
    place = {limb.frame: data.oMf[robot.frame_id(limb.frame)].translation for limb in feet}
    feet.sort(key=lambda limb: -round(float(place[limb.frame][0]), 3))
    contacts = [(limb, _places(robot, data, limb)) for limb in feet]
    labels = labels_of([limb.frame for limb in feet], [float(place[limb.frame][0]) for limb in feet])
    return [
        Contact(
            f"{label}_{place.part}" if place.part else label,
            limb.frame,
            place.offset,
            place.shapes,
            place.radius,
            beside=tuple(name for name in limb.bodies if name != limb.frame and _beside(robot, data, name, limb.frame)),
        )
        for label, (limb, places) in zip(labels, contacts, strict=True)
        for place in places
    ]


def lowest_place(robot: Robot, q: np.ndarray, frame: str) -> np.ndarray:
    """Return the lowest place of a body's collision shapes in a configuration (nq,), of a ball its middle.

    Returns:
        in the axes of the body's frame, m, (3,); its origin without shapes.
    """
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    try:
        outlines = [outline_points(shape) for shape in robot.collision_shapes if shape.body == frame]
    except RobotError:  # meshes that are not there
        outlines = []
    down = data.oMf[robot.frame_id(frame)].rotation[2]
    places = [points[:, int(np.argmin(down @ points))] for points, _ in outlines]
    bottoms = [float(down @ place) - radius for place, (_, radius) in zip(places, outlines, strict=True)]
    return places[int(np.argmin(bottoms))] if places else np.zeros(3)


def labels_of(frames: list[str], forward: list[float]) -> list[str]:
    """Return a name for the contact of every foot: where it is, if that tells them apart."""
    if len(frames) == 1:
        return ["foot"]
    if len(frames) == 2 and forward[0] - forward[1] > 0.05:
        return ["front", "hind"]
    return frames


class _Place(NamedTuple):
    """A place of a foot that touches.

    Attributes:
        part: of the foot's name, empty where it has one place only.
        offset: from the frame's origin, m.
        shapes: whether all shapes of the body touch.
        radius: of a circle, m; None for a point.
    """

    part: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shapes: bool = False
    radius: float | None = None


def _places(robot: Robot, data: pin.Data, limb: Limb) -> list[_Place]:
    """Return where a foot touches: its frame, the shapes of its body, those of their ends that are low, or a sole's."""
    pose = data.oMf[robot.frame_id(limb.frame)]
    corners = _lowest_points(robot, data, limb)
    # Ends of a sole that are away from the frame are places of their own.
    aside = 0.0 if corners is None else float(np.abs(corners[0] - pose.translation[0]).max())
    if corners is None or (pose.translation[2] - corners[2].min() <= ABOVE_LOWEST and aside <= WIDE):
        return [_Place("")]
    shapes = [shape for shape in robot.collision_shapes if shape.body == limb.frame]
    if shapes and all(isinstance(shape.geometry, _EXACT) for shape in shapes):
        return _ends(touching_outlines(shapes, pose, np.array([0.0, 0.0, -1.0])), pose)
    # A sole that is a mesh: its ends in the plane, straight below the frame.
    ends = [("heel", float(corners[0].min())), ("toe", float(corners[0].max()))]
    if ends[1][1] - ends[0][1] <= ABOVE_LOWEST:
        ends = [("", float(corners[0].mean()))]
    places = [np.array([x, pose.translation[1], corners[2].min()]) for _, x in ends]
    return [_Place(part, _rounded(pose.actInv(place))) for (part, _), place in zip(ends, places, strict=True)]


def _ends(outlines: Sequence[Outline], pose: pin.SE3) -> list[_Place]:
    """Return the places of a body's outlines; without those high up, as the upper end of a shank that is a capsule."""
    centers = np.array([pose.act(outline.place) for outline in outlines])
    bottoms = centers[:, 2] - [outline.radius for outline in outlines]
    lowest = int(np.argmin(bottoms))
    # A sole is less steep than 45 degrees from its lowest end.
    low = np.flatnonzero(bottoms - bottoms[lowest] <= np.abs(centers[:, 0] - centers[lowest, 0]))
    if len(low) == len(outlines):
        return [_Place("", shapes=True)]
    parts = [str(number) for number in range(1, len(low) + 1)] if len(low) > 1 else [""]
    return [
        _Place(part, _rounded(outlines[k].place), radius=outlines[k].radius or None)
        for part, k in zip(parts, low.tolist(), strict=True)
    ]


def _rounded(place: np.ndarray) -> tuple[float, float, float]:
    x, y, z = np.round(place, 4) + 0.0
    return float(x), float(y), float(z)


def _lowest_points(robot: Robot, data: pin.Data, limb: Limb) -> np.ndarray | None:
    """Return the points of a foot's own shapes near its lowest one, m, (3, n); None without shapes."""
    own = [name for name in limb.bodies if _beside(robot, data, name, limb.frame)]
    points = _shape_points(robot, data, (limb.frame, *own)) or _shape_points(robot, data, limb.bodies)
    if not points:
        return None
    cloud = np.hstack(points)
    return np.asarray(cloud[:, cloud[2] <= cloud[2].min() + ABOVE_LOWEST / 3])


def _beside(robot: Robot, data: pin.Data, name: str, frame: str) -> bool:
    """Return whether two bodies are at one place in the x-z plane."""
    apart = data.oMf[robot.frame_id(name)].translation - data.oMf[robot.frame_id(frame)].translation
    return bool(np.abs(apart[[0, 2]]).max() <= SAME_FRAME)


def _shape_points(robot: Robot, data: pin.Data, bodies: tuple[str, ...]) -> list[np.ndarray]:
    """Return points of the lower side of every collision shape of some bodies, m, (3, n) each."""
    try:
        shapes = [shape for shape in robot.collision_shapes if shape.body in bodies]
    except RobotError:  # meshes that are not there; the frames say enough for a first task
        return []
    result = []
    for shape in shapes:
        points, radius = outline_points(shape)
        pose = data.oMf[robot.frame_id(shape.body)]
        result.append(pose.rotation @ points + pose.translation[:, None] - np.array([[0.0], [0.0], [radius]]))
    return result
