"""Checks of a MuJoCo file for what Pinocchio drops or reads differently, and corrections of its model."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError

_UNREAD = ("include", "frame", "replicate", "attach", "composite", "flexcomp")
_POSES = ("pos", "quat", "euler", "axisangle", "xyaxes", "zaxis")


def check_mjcf(path: Path, root: ElementTree.Element, *, moving_root: bool) -> None:
    """Refuse a file of which Pinocchio would read only a part.

    Args:
        path: the file.
        root: its root element.
        moving_root: whether a root joint is put under the first body.

    Raises:
        RobotError: for elements Pinocchio drops without a word, naming the first one.
    """
    for tag in _UNREAD:
        if root.find(f".//{tag}" if tag == "include" else f"./worldbody//{tag}") is not None:
            raise RobotError(f"{path}: <{tag}> is not supported; write its content out.")
    if root.find("./equality/*") is not None:
        raise RobotError(f"{path}: <equality> constraints are not supported; the robot must be a tree without them.")
    bodies = root.findall("./worldbody/body")
    if len(bodies) != 1:
        raise RobotError(f"{path}: the worldbody must have exactly one body, the robot's first, but has {len(bodies)}.")
    for body in bodies[0].iter("body"):
        if not body.get("name"):
            raise RobotError(f"{path}: every <body> needs a name.")
    if not moving_root:
        _check_fixed_base(path, bodies[0])


def _check_fixed_base(path: Path, base: ElementTree.Element) -> None:
    """Refuse a first body without joint that has a pose in the world, for Pinocchio drops that."""
    if base.find("joint") is not None or base.find("freejoint") is not None:
        return
    for attribute in _POSES:
        if not _is_identity(attribute, base.get(attribute)):
            raise RobotError(
                f"{path}: the pose of body '{base.get('name')}', which is fixed to the world, would be lost; "
                f"remove its attribute '{attribute}' and put this body into one that has a name and no pose."
            )


def composite_names(root: ElementTree.Element) -> dict[str, list[str]]:
    """Return, for each body with several joints, the name Pinocchio gives to their composite -> their own names."""
    result: dict[str, list[str]] = {}
    for body in root.iter("body"):
        joints = body.findall("joint")
        if len(joints) > 1:
            names = [joint.get("name") or f"{body.get('name')}Joint_{k}" for k, joint in enumerate(joints)]
            result[f"Composite_{names[0]}"] = names
    return result


def correct_mjcf_model(path: Path, root: ElementTree.Element, model: pin.Model) -> None:
    """Set in `model` what Pinocchio leaves out: the file's gravity, and the world as origin of an unlimited free joint.

    Raises:
        RobotError: for limits that Pinocchio gets wrong: those of sliding joints in a file with angles in degrees,
            which it converts like angles, and those of joints with a reference position, which it shifts.
    """
    option = root.find("option")
    if option is not None and option.get("gravity"):
        model.gravity.linear = np.array(_numbers(option.get("gravity", "")))
    compiler = root.find("compiler")
    degrees = compiler is None or compiler.get("angle", "degree") == "degree"
    references = {entry.key(): entry.data() for entry in model.referenceConfigurations}.get("qpos0", np.zeros(model.nq))
    for index in range(1, model.njoints):
        joint = model.joints[index]
        if joint.shortname() == "JointModelFreeFlyer":
            model.jointPlacements[index] = pin.SE3.Identity()
            model.lowerPositionLimit[joint.idx_q : joint.idx_q + 3] = -np.inf
            model.upperPositionLimit[joint.idx_q : joint.idx_q + 3] = np.inf
        for part in joint.extract().joints if joint.shortname() == "JointModelComposite" else [joint]:
            limits = [model.lowerPositionLimit[part.idx_q], model.upperPositionLimit[part.idx_q]]
            if part.nq != 1 or not np.isfinite(limits).any():
                continue
            if degrees and part.shortname().startswith("JointModelP"):
                raise RobotError(
                    f"{path}: in a file with angles in degrees Pinocchio scales the range of a sliding joint like an "
                    f"angle ('{model.names[index]}'); write <compiler angle=\"radian\"/> and angles in radians."
                )
            if references[part.idx_q] != 0.0:
                raise RobotError(
                    f"{path}: Pinocchio shifts the range of a joint by its reference position "
                    f"('{model.names[index]}'); remove the joint's attribute 'ref' or its range."
                )


def mjcf_notes(root: ElementTree.Element) -> list[str]:
    """Return what of the file does not enter the robot, one sentence each."""
    notes = []
    if root.find("./actuator/*") is not None:
        notes.append("Actuators are not read; effort limits come from the joints' actuatorfrcrange.")
    if any(any(_numbers(joint.get("stiffness", "0"))) for joint in root.iter("joint")):
        notes.append("Joint springs (stiffness) are not part of the equations of motion.")
    if any(joint.get("type") == "ball" and joint.get("range") for joint in root.iter("joint")):
        notes.append("The range of ball joints is not read.")
    balls = root.find(".//joint[@type='ball']") is not None
    if balls and root.find(".//joint[@damping]") is not None:
        notes.append("The damping of ball joints is not read.")
    for body in root.findall("./worldbody//body"):
        if body.find("site") is not None and body.find("joint") is None and body.find("freejoint") is None:
            notes.append(f"The sites of body '{body.get('name')}', which has no joint, are not read.")
    return notes


def _is_identity(attribute: str, text: str | None) -> bool:
    if text is None:
        return True
    numbers = _numbers(text)
    if attribute == "quat":
        return not any(numbers[1:])
    if attribute == "axisangle":
        return not any(numbers[3:])
    return attribute in ("pos", "euler") and not any(numbers)


def _numbers(text: str) -> list[float]:
    try:
        return [float(number) for number in text.split()]
    except ValueError as error:
        raise RobotError(f"'{text}' is not a list of numbers.") from error
