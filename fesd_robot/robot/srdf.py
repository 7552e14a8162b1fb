"""Postures of the SRDF file that lies with a URDF file."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.joints import UnboundedRevolute
from fesd_robot.robot.root import ROOT_JOINT, Root, root_values
from fesd_robot.robot.xml_file import read_xml

_FREE_ROOT_VALUES = 7
"""Of a root joint: x, y, z, m, and quaternion x, y, z, w."""


def read_group_states(
    path: Path, document: ElementTree.Element, model: pin.Model, root: Root
) -> dict[str, dict[str, float]]:
    """Return the states of the SRDF file that belongs to a URDF file; nothing without one.

    It lies beside the URDF file, or in a folder ``srdf`` beside the URDF's, and has its name, else the name of its
    robot. Joints that the URDF file does not have are left out; the root takes what of the state's pose it can.

    Args:
        path: of the URDF file.
        document: its content.
        model: built from it.
        root: joint under its first link.

    Returns:
        name of a state -> name of a configuration coordinate -> m or rad.

    Raises:
        RobotError: for a file that is no XML, and for a value that is no number; names file, state and joint.

    Source: the ``group_state`` of ROS's Semantic Robot Description Format.
    """
    found = _srdf_file(path, document.get("name", ""))
    if found is None:
        return {}
    file, semantic = found
    states: dict[str, dict[str, float]] = {}
    for state in semantic.findall("group_state"):
        values = states.setdefault(state.get("name", ""), {})
        for joint in state.findall("joint"):
            values.update(_coordinates(file, state, joint, model, root))
    return states


def _srdf_file(path: Path, robot: str) -> tuple[Path, ElementTree.Element] | None:
    """Return the file that belongs to a URDF file, and its content."""
    near = [*sorted(path.parent.glob("*.srdf")), *sorted((path.parent.parent / "srdf").glob("*.srdf"))]
    own = [file for file in near if file.stem == path.stem]
    for file in own or near:
        try:
            semantic = read_xml(file)
        except RobotError:
            if own:
                raise
            continue
        if own or semantic.get("name") == robot:
            return file, semantic
    return None


def _coordinates(
    file: Path, state: ElementTree.Element, joint: ElementTree.Element, model: pin.Model, root: Root
) -> Iterator[tuple[str, float]]:
    """Yield the coordinates that the value of a joint stands for."""
    name, text = joint.get("name", ""), joint.get("value", "")
    if not model.existJointName(name) and name != ROOT_JOINT:
        return
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        values = []
    if name == ROOT_JOINT and len(values) == _FREE_ROOT_VALUES:
        yield from root_values(ROOT_JOINT, root, pin.XYZQUATToSE3(values)).items()
    elif name != ROOT_JOINT and len(values) == 1 and math.isfinite(values[0]):
        yield from _of_joint(name, values[0], model.joints[model.getJointId(name)])
    else:
        raise RobotError(
            f"{file}: found '{text}' for joint '{name}' in state '{state.get('name', '')}', expected "
            f"{'x y z qx qy qz qw' if name == ROOT_JOINT else 'a number'}."
        )


def _of_joint(name: str, value: float, joint: pin.JointModel) -> Iterator[tuple[str, float]]:
    if joint.nq == 1:
        yield name, value
    elif joint.nv == 1:
        yield from zip(
            (name + suffix for suffix in UnboundedRevolute.position_suffixes),
            (math.cos(value), math.sin(value)),
            strict=True,
        )
