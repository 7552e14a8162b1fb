"""Checks of a URDF file for what Pinocchio reads differently from what it says."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.followers import Follower
from fesd_robot.robot.model_file import note

_UNDRIVEN = ("fixed", "floating", "planar")
"""Types of joints that have no motor of their own."""

_XACRO = re.compile(r"\{https?://(www\.)?ros\.org/wiki/xacro.*\}")


def refuse_xacro(path: Path, root: ElementTree.Element) -> None:
    """Refuse a file that xacro has still to expand.

    Raises:
        RobotError: says how to expand it.
    """
    if any(_XACRO.match(element.tag) for element in root.iter() if isinstance(element.tag, str)):
        raise RobotError(
            f"{path} is written in xacro; expand it first: xacro {path.name} > {path.name.split('.')[0]}.urdf."
        )


def check_urdf(path: Path, root: ElementTree.Element) -> dict[str, str]:
    """Return the mimic joints of a file, each with its leader; refuse files that Pinocchio misreads.

    Raises:
        RobotError: for a planar joint whose plane is not x-y, which Pinocchio takes as x-y all the same, and for a
            continuous joint that follows or leads, whose (cos, sin) does not scale.
    """
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    leaders: dict[str, str] = {}
    for name, joint in joints.items():
        if joint.get("type") == "planar" and _axis(joint) != [0.0, 0.0, 1.0]:
            raise RobotError(
                f"{path}: planar joint '{name}' must move in the x-y plane of its origin: write "
                '<axis xyz="0 0 1"/> and turn the plane with <origin rpy="..."/>.'
            )
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        leader = leaders[name] = mimic.get("joint", "")
        if "continuous" in (joint.get("type"), joints[leader].get("type") if leader in joints else None):
            raise RobotError(
                f"{path}: joint '{name}' mimics '{leader}' and one of them is continuous, which is not supported; "
                "make both revolute."
            )
    return leaders


def mimic_joints(root: ElementTree.Element) -> list[Follower]:
    """Return the joints of a file that follow others, of a file that can be built."""
    mimics = [
        (joint.get("name", ""), joint.find("mimic")) for joint in root.findall("joint") if joint.get("type") != "fixed"
    ]
    return [
        Follower(name, law.get("joint", ""), float(law.get("multiplier", "1")), float(law.get("offset", "0")))
        for name, law in mimics
        if law is not None
    ]


def urdf_notes(root: ElementTree.Element, leaders: Mapping[str, str]) -> list[str]:
    """Return the parts of the file that do not enter the robot, one sentence each."""
    return [
        *_transmission_notes(root, leaders),
        *_follower_notes(root, leaders),
    ]


def _follower_notes(root: ElementTree.Element, leaders: Mapping[str, str]) -> list[str]:
    """Return the resistances of joints that follow others, which are not read, one sentence each."""
    return [
        f"The {what} of joint '{joint.get('name')}', which follows '{leaders[joint.get('name', '')]}', is not read: "
        f"{size} {unit}."
        for joint in root.findall("joint")
        if joint.get("name") in leaders
        for what, key, unit in (
            ("damping", "damping", "N s/m or N m s/rad"),
            ("dry friction", "friction", "N or N m"),
        )
        for dynamics in joint.findall(f"dynamics[@{key}]")
        if _is_some(size := dynamics.get(key, ""))
    ]


def _transmission_notes(root: ElementTree.Element, leaders: Mapping[str, str]) -> list[str]:
    """Return where the transmissions of a file and the controls differ, one sentence each.

    An effort limit, which URDF gives at the joint, makes a control, of whatever reduction; a joint without transmission
    keeps it, since files whose robots are put together often have transmissions for one part only.
    """
    transmissions = {
        each.get("name", ""): [name for one in each if (name := _driven_joint(one))]
        for each in root.iter("transmission")
    }
    moving = {
        joint.get("name", ""): _effort(joint)
        for joint in root.findall("joint")
        if joint.get("type") not in _UNDRIVEN and joint.get("name") not in leaders
    }
    named = {name for joints in transmissions.values() for name in joints}
    if not named & set(moving):
        return []
    several = [f"{name} ({', '.join(joints)})" for name, joints in transmissions.items() if len(set(joints)) > 1]
    return [
        *note(
            "Joints without <transmission>, unlike others of the file, have an effort limit and are driven: {}; name "
            "those without a motor in robot.passive.",
            [name for name, effort in moving.items() if effort > 0 and name not in named],
        ),
        *note(
            "Joints with <transmission> have no effort limit and are not driven: {}; limits.effort drives them.",
            [name for name, effort in moving.items() if effort == 0 and name in named],
        ),
        *note(
            "Transmissions of several joints couple their motors: {}; the plan has a control for every joint, within "
            "the limits of that joint alone.",
            several,
        ),
    ]


def _driven_joint(part: ElementTree.Element) -> str:
    """Return the joint that a part of a transmission moves, ``joint`` or as older files have it, ``rollJoint``."""
    return part.get("name", "") if part.tag.lower().endswith("joint") else ""


def _effort(joint: ElementTree.Element) -> float:
    limit = joint.find("limit")
    try:
        return float(limit.get("effort", "0")) if limit is not None else 0.0
    except ValueError:
        return 0.0


def check_leaders(path: Path, leaders: Mapping[str, str], order: Sequence[str]) -> None:
    """Refuse mimic joints that Pinocchio cannot build.

    Args:
        path: the file.
        leaders: name of a mimic joint -> name of the joint it follows.
        order: all moving joints as Pinocchio orders them: depth first, those on the same link sorted by name.

    Raises:
        RobotError: for a leader that does not exist, mimics itself, or comes after its follower; names both.
    """
    for name, leader in leaders.items():
        if leader not in order:
            raise RobotError(
                f"{path}: joint '{name}' mimics '{leader}', which is no moving joint{nearest(leader, order)}."
            )
        if leader in leaders:
            raise RobotError(
                f"{path}: joint '{name}' mimics '{leader}', which mimics '{leaders[leader]}'; name that one."
            )
        if order.index(leader) > order.index(name):
            raise RobotError(
                f"{path}: joint '{name}' mimics '{leader}', but Pinocchio, which sorts the joints on a link by name, "
                f"reads '{name}' first; rename them, or make '{name}' a fixed joint."
            )


def _is_some(number: str) -> bool:
    """Return whether a number is written and not zero."""
    try:
        return float(number) != 0.0
    except ValueError:
        return True


def _axis(joint: ElementTree.Element) -> list[float]:
    axis = joint.find("axis")
    text = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
    try:
        return [float(number) for number in text.split()]
    except ValueError:
        return []
