"""Pinocchio's model of a URDF file held against the file."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.urdf_elements import MOMENTS
from fesd_robot.robot.urdf_tree import UrdfTree

_SAME = 1e-9
"""Of masses, lengths and inertias, relative to the largest that is summed up."""


def check_model(path: Path, tree: UrdfTree, model: pin.Model) -> None:
    """Refuse a model of Pinocchio that has not the links, joints, places and masses of its file.

    Args:
        path: the file.
        tree: its links.
        model: built from the file, with or without a root joint.

    Raises:
        RobotError: names the joint or link that differs.
    """
    carried: dict[str, tuple[str, pin.SE3]] = {}  # the joint that moves a link, and its pose on it
    bodies: dict[str, np.ndarray] = {}
    for name, link in tree.links.items():
        joint = tree.joints.get(name)
        if joint is None:
            carried[name] = "", pin.SE3.Identity()
        else:
            moving, pose = carried[tree.parent(name)]
            pose, own = pose * _origin_of(joint), joint.get("name", "")
            if joint.get("type") == "fixed":
                carried[name] = moving, pose
            else:
                _check_place(path, model, own, pose)
                carried[name] = own, pin.SE3.Identity()
        moving, pose = carried[name]
        if not model.existFrame(name, pin.FrameType.BODY):
            raise _unlike(path, f"link '{name}'", "nothing")
        bodies[moving] = bodies.get(moving, np.zeros((6, 6))) + _moved(_inertia_of(link), pose)
    root = next((name for name in model.names if name not in ("universe", *bodies)), None)
    first = bodies.pop("")
    if root is not None:
        bodies[root] = first
    if model.njoints - 1 != len(bodies):
        raise _unlike(path, f"{len(bodies)} joints that move", f"{model.njoints - 1}")
    for name, body in bodies.items():
        _check_body(path, name, body, model.inertias[model.getJointId(name)].matrix())


def _check_place(path: Path, model: pin.Model, joint: str, pose: pin.SE3) -> None:
    if not model.existJointName(joint):
        raise _unlike(path, f"joint '{joint}'", "nothing")
    built = model.jointPlacements[model.getJointId(joint)]
    if not built.isApprox(pose, _SAME * (1 + float(np.linalg.norm(pose.translation)))):
        raise _unlike(path, f"joint '{joint}' at {pose.translation}", f"{built.translation}")


def _check_body(path: Path, joint: str, said: np.ndarray, built: np.ndarray) -> None:
    if abs(said[0, 0] - built[0, 0]) > _SAME * abs(said[0, 0]):
        raise _unlike(path, f"{said[0, 0]:.12g} kg on joint '{joint}'", f"{built[0, 0]:.12g} kg")
    if not np.allclose(said, built, rtol=0, atol=_SAME * float(np.abs(said).max())):
        raise _unlike(path, f"a body on joint '{joint}'", "one with another inertia")


def _unlike(path: Path, said: str, built: str) -> RobotError:
    return RobotError(f"{path} is not read as it was meant: it has {said}, but Pinocchio's model has {built}.")


def _origin_of(element: ElementTree.Element) -> pin.SE3:
    """Return the pose that an element's ``<origin>`` says, of a file after `check_elements`."""
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    place = np.array([float(number) for number in origin.get("xyz", "0 0 0").split()])
    if "quat_xyzw" in origin.attrib:
        x, y, z, w = (float(number) for number in origin.get("quat_xyzw", "").split())
        return pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), place)
    return pin.SE3(pin.rpy.rpyToMatrix(*(float(number) for number in origin.get("rpy", "0 0 0").split())), place)


def _mass_of(link: ElementTree.Element) -> float:
    """Return the mass of a link, kg, of a file after `check_elements`."""
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else float(mass.get("value", ""))


def _moments_of(link: ElementTree.Element) -> np.ndarray:
    """Return the inertia of a link about its centre of mass, kg m², (3, 3), of a file after `check_elements`."""
    moments = link.find("inertial/inertia")
    if moments is None:
        return np.zeros((3, 3))
    xx, xy, xz, yy, yz, zz = (float(moments.get(key, "")) for key in MOMENTS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _inertia_of(link: ElementTree.Element) -> np.ndarray:
    """Return the spatial inertia of a link in its own frame, (6, 6)."""
    inertial = link.find("inertial")
    about = np.zeros((6, 6))
    if inertial is None:
        return about
    about[:3, :3], about[3:, 3:] = _mass_of(link) * np.eye(3), _moments_of(link)
    return _moved(about, _origin_of(inertial))


def _moved(inertia: np.ndarray, pose: pin.SE3) -> np.ndarray:
    return np.asarray(pose.toDualActionMatrix() @ inertia @ pose.toActionMatrixInverse())
