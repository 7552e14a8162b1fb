"""Reading a robot from a file."""

from __future__ import annotations

import logging
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.couple import in_unison
from fesd_robot.robot.followers import LimitNotes, with_followers
from fesd_robot.robot.lock import lock_joints
from fesd_robot.robot.model_file import ModelFile, note
from fesd_robot.robot.paths import locate_robot, package_directories
from fesd_robot.robot.plausible import check_inertias, unit_warnings
from fesd_robot.robot.reader_errors import captured_errors, last_sentence
from fesd_robot.robot.right_angles import SQUARE_AXES, SQUARE_PLACEMENTS, square_axes, square_placements
from fesd_robot.robot.robot import Robot
from fesd_robot.robot.root import (
    ROOT_JOINT,
    ROOTS,
    SAGITTAL_NAMES,
    Root,
    make_root_joint,
    refuse_second_root,
)
from fesd_robot.robot.scaled import ModelScale, scaled_model
from fesd_robot.robot.srdf import read_group_states
from fesd_robot.robot.tree import Tree, build_tree
from fesd_robot.robot.urdf import check_leaders, check_urdf, mimic_joints, refuse_xacro, urdf_notes
from fesd_robot.robot.urdf_elements import check_elements, longest_shape
from fesd_robot.robot.urdf_limits import check_limits, missing_ranges, unread_ranges
from fesd_robot.robot.urdf_model import check_model
from fesd_robot.robot.urdf_tree import read_tree
from fesd_robot.robot.xml_file import read_xml, xml_text

logger = logging.getLogger(__name__)

_FORMATS = ("robot", "mujoco", "sdf")
"""First elements of URDF, MJCF and SDF files."""

_NO_LIMIT_FROM = 1e19
"""Numbers from here on stand for no limit in Pinocchio's models."""


def load_robot(
    source: str | Path,
    *,
    root: Root = "fixed",
    locked: Mapping[str, float] | None = None,
    coupled: Mapping[str, str] | None = None,
    armature: Mapping[str, float] | None = None,
    damping: Mapping[str, float] | None = None,
    dry_friction: Mapping[str, float] | None = None,
    search_path: Path | None = None,
) -> Robot:
    """Return the robot described by a URDF, MJCF or SDF file.

    Args:
        source: a file, ``package://NAME/PATH``, or ``example-robot-data:NAME`` for a robot of that package.
        root: joint between the world and the first link: none, sagittal (x, z, pitch), planar (x, y, turn about z) or
            free.
        locked: name of a joint -> value it is held at, m or rad; it is no coordinate of the robot.
        coupled: name of a joint -> name of the joint it moves in unison with, see `couple_joints`; only the latter
            is a coordinate of the robot.
        armature: name of a joint, or of one of its velocity coordinates -> inertia added to the diagonal of the mass
            matrix, kg or kg m²; replaces what the file says. A joint's armature goes to all of its coordinates.
        damping: the same for the viscous damping d of the force -d v, N s/m or N m s/rad.
        dry_friction: the same for the limit F of the dry friction -F Sgn(v), N or N m.
        search_path: folder that relative paths start from; the working directory if absent. ``package://`` addresses
            are looked up there, too.

    Raises:
        RobotError: if the file is missing or cannot be read as it was meant, if a name is unknown, or if armature,
            damping or dry friction is negative.
        JointError: if a joint cannot be locked or coupled.
    """
    robot = load_scaled(source, ModelScale(), root=root, locked=locked, coupled=coupled, search_path=search_path)
    return with_joint_properties(robot, armature=armature or {}, damping=damping or {}, dry_friction=dry_friction or {})


def load_scaled(
    source: str | Path,
    scale: ModelScale,
    *,
    root: Root = "fixed",
    locked: Mapping[str, float] | None = None,
    coupled: Mapping[str, str] | None = None,
    search_path: Path | None = None,
) -> Robot:
    """Return the robot described by a file, whose masses or lengths are others.

    Args:
        source, root, locked, coupled, search_path: as of `load_robot`.
        scale: factors on what the file says.

    Raises:
        RobotError: as there, and for a link that there is not.
        JointError: as there.
    """
    if root not in ROOTS:
        raise RobotError(f"There is no root joint '{root}'{nearest(root, ROOTS)}.")
    path = locate_robot(source, search_path)
    read = scaled_model(path, _read(path, root), scale)
    model, signs, notes, composites = read.model, dict[str, float](), list(read.notes), dict(read.composites)
    if model.nv == 0:
        raise RobotError(f"{path}: the robot has no moving joint; if it floats, set root to 'free_flyer'.")
    if locked:
        model = lock_joints(model, locked)
    if root == "sagittal":
        composites[ROOT_JOINT] = list(SAGITTAL_NAMES)
    if root in ("fixed", "sagittal"):  # with others nothing stays in a plane
        notes += note(SQUARE_PLACEMENTS, square_placements(model))
    if coupled:
        model, signs = in_unison(model, coupled)
    reduced = read.reduced(model, locked or {}, coupled or {}, signs)
    return robot_from_model(
        replace(reduced, notes=notes, composites=composites),
        source=path,
        package_directories=package_directories(path, search_path),
    )


def _read(path: Path, root: Root) -> ModelFile:
    """Read a model file, with a root joint under its first link."""
    document = _parse_xml(path)
    if document.tag == "mujoco":
        from fesd_robot.robot.mjcf import read_mjcf

        read = read_mjcf(path, root)
    elif document.tag == "sdf":
        if not pin.WITH_SDFORMAT:
            raise RobotError(f"{path}: this build of Pinocchio reads no SDF files; convert it to URDF or MJCF.")
        model = _build(path, lambda joint: _build_sdf(path, joint), root)
        read = ModelFile(model, "sdf", notes=note(SQUARE_AXES, square_axes(model)))
    else:
        read = _read_urdf(path, document, root)
    if read.model.nv:
        longest = longest_shape(document) if read.format == "urdf" else 0.0
        read = replace(read, warnings=[*check_inertias(path, read.model), *unit_warnings(read.model, longest)])
    if root != "fixed":
        refuse_second_root(path, read.model, root)
    return read


def _read_urdf(path: Path, document: ElementTree.Element, root: Root) -> ModelFile:
    refuse_xacro(path, document)
    check_elements(path, document)
    tree = read_tree(path, document)
    leaders = check_urdf(path, document)
    check_limits(path, document)
    text = xml_text(document)
    separate = _build(path, lambda joint: _build_urdf(text, joint), root)
    check_model(path, tree, separate)
    check_leaders(path, leaders, list(separate.names)[1:])
    missing, changed = missing_ranges(document), square_axes(separate)
    model, narrowed = with_followers(path, separate, mimic_joints(document), missing)
    own: LimitNotes = {("position", name): each for name, each in missing.items() if name not in leaders}
    return ModelFile(
        model,
        "urdf",
        notes=[*urdf_notes(document, leaders), *unread_ranges(document), *note(SQUARE_AXES, changed)],
        postures=read_group_states(path, document, model, root),
        limit_notes={**own, **narrowed},
    )


def robot_from_model(read: ModelFile, *, source: Path, package_directories: tuple[Path, ...]) -> Robot:
    """Return the robot of a model.

    Args:
        read: the model, with joints locked and coupled, and what else its file says.
        source: the file it was read from.
        package_directories: where ``package://`` addresses are looked up.

    Raises:
        RobotError: for a joint type that is not supported, or a body without a proper mass.
    """
    model = read.model
    tree = build_tree(model, read.composites)
    _check_masses(source, model)
    configuration_names, velocity_names = _coordinate_names(tree, model)
    lower_position, upper_position = _position_limits(model, tree)
    return Robot(
        name=model.name,
        source=source,
        format=read.format,
        package_directories=package_directories,
        model=model,
        tree=tree,
        configuration_names=configuration_names,
        velocity_names=velocity_names,
        lower_position=lower_position,
        upper_position=upper_position,
        velocity_limit=_without_sentinels(model.velocityLimit),
        lower_effort=_without_sentinels(np.minimum(model.lowerEffortLimit, model.upperEffortLimit)),
        upper_effort=_without_sentinels(np.maximum(model.lowerEffortLimit, model.upperEffortLimit)),
        joint_springs=read.springs,
        drives=read.drives,
        postures=read.postures,
        frame_names=list(dict.fromkeys(frame.name for frame in model.frames)),
        neutral=_frozen(pin.neutral(model)),
        notes=tuple(read.notes),
        warnings=tuple(read.warnings),
        shapes=read.shapes,
        limit_notes=read.limit_notes,
        lengths=read.lengths,
    )


def with_joint_properties(
    robot: Robot,
    *,
    armature: Mapping[str, float],
    damping: Mapping[str, float],
    dry_friction: Mapping[str, float] | Literal[False],
) -> Robot:
    """Return the same robot with other values for the armature, the damping and the dry friction of some joints.

    Args:
        robot: stays as it is.
        armature: name of a joint or of a velocity coordinate -> inertia, kg or kg m².
        damping: the same for the viscous damping, N s/m or N m s/rad.
        dry_friction: the same for the limit of the dry friction, N or N m; False for none at all.

    Raises:
        RobotError: for an unknown name, and for a value that is negative or not finite.
    """
    model, targets = robot.model.copy(), _coordinates_by_name(robot.tree, robot.velocity_names)
    model.armature = _replaced("armature", model.armature, targets, armature)
    model.damping = _replaced("damping", model.damping, targets, damping)
    limits, notes = robot.dry_friction_limits, robot.notes
    if dry_friction is False:
        sizes = [f"{name}: {size:.4g}" for name, size in robot.dry_friction.items()]
        limits, notes = np.zeros_like(limits), (*notes, *note("Dry friction of joints ({}; N or N m).", sizes))
    else:
        limits = _replaced("dry friction", limits, targets, dry_friction)
    model.lowerDryFrictionLimit, model.upperDryFrictionLimit = -limits, limits
    return replace(robot, model=model, notes=notes)


def with_gravity(robot: Robot, gravity: Sequence[float]) -> Robot:
    """Return the same robot where everything falls with another acceleration.

    Args:
        robot: stays as it is.
        gravity: along the axes of the world, m/s2, (3).
    """
    model = robot.model.copy()
    model.gravity.linear = np.array(gravity, dtype=float)
    return replace(robot, model=model)


def with_limit_surfaces(robot: Robot, surfaces: Mapping[str, Mapping[str, float]]) -> Robot:
    """Return the same robot with limit surfaces under what slides and turns.

    Args:
        robot: stays as it is.
        surfaces: name -> name of a velocity coordinate -> largest friction along it alone, N or N m.
    """
    if not surfaces:
        return robot
    model, limits = robot.model.copy(), robot.dry_friction_limits
    for axes in surfaces.values():
        for name, limit in axes.items():
            limits[robot.velocity_names.index(name)] = limit
    model.lowerDryFrictionLimit, model.upperDryFrictionLimit = -limits, limits
    return replace(robot, model=model, limit_surfaces={name: tuple(axes) for name, axes in surfaces.items()})


def with_frames(robot: Robot, places: Mapping[str, tuple[str, np.ndarray]]) -> Robot:
    """Return the same robot with more frames, each at a place on one that it has.

    Args:
        robot: stays as it is.
        places: name of the new frame -> name of a frame, and the place in its axes, m, (3).
    """
    if not places:
        return robot
    model = robot.model.copy()
    for name, (frame, offset) in places.items():
        own = robot.frame_id(frame)
        on = model.frames[own]
        pose = on.placement * pin.SE3(np.eye(3), offset)
        model.addFrame(pin.Frame(name, on.parentJoint, own, pose, pin.FrameType.OP_FRAME), False)
    return replace(robot, model=model, frame_names=[*robot.frame_names, *places])


def _parse_xml(path: Path) -> ElementTree.Element:
    root = read_xml(path)
    if root.tag not in _FORMATS:
        raise RobotError(f"{path} is neither URDF nor MJCF nor SDF: its first element is <{root.tag}>.")
    return root


def _build(path: Path, build: Callable[[pin.JointModel | None], pin.Model], root: Root) -> pin.Model:
    """Return the model that Pinocchio builds, its complaints turned into a RobotError."""
    root_joint = make_root_joint(root)
    with captured_errors() as complaints:
        try:
            model = build(root_joint)
        except RobotError:
            raise
        except Exception as error:
            said = " ".join([*complaints(), last_sentence(str(error))])
            raise RobotError(f"{path} cannot be read: {said.removesuffix('.')}.") from error
        for complaint in complaints():
            logger.info("%s: %s", path, complaint)
    return model


def _build_urdf(text: str, root_joint: pin.JointModel | None) -> pin.Model:
    """Return the model in which mimic joints have coordinates of their own."""
    if root_joint is None:
        return pin.buildModelFromXML(text)
    return pin.buildModelFromXML(text, root_joint, ROOT_JOINT)


def _build_sdf(path: Path, root_joint: pin.JointModel | None) -> pin.Model:
    model, loops = pin.buildModelsFromSdf(
        str(path), root_joint=root_joint, root_joint_name=ROOT_JOINT, geometry_types=[]
    )
    if len(loops) > 0:
        raise RobotError(f"{path}: closed loops are not supported; the robot must be a tree.")
    return model


def _check_masses(path: Path, model: pin.Model) -> None:
    for index in range(1, model.njoints):
        matrix = model.inertias[index].matrix()
        if not np.isfinite(matrix).all() or model.inertias[index].mass < 0.0:
            raise RobotError(
                f"{path}: the body of joint '{model.names[index]}' has a negative or infinite mass or inertia."
            )


def _coordinate_names(tree: Tree, model: pin.Model) -> tuple[list[str], list[str]]:
    positions, velocities = [""] * model.nq, [""] * model.nv
    for link in tree.links:
        if not link.mimics:
            positions[link.q_indices] = [link.name + suffix for suffix in link.joint.position_suffixes]
            velocities[link.v_indices] = [link.name + suffix for suffix in link.joint.velocity_suffixes]
    return positions, velocities


def _coordinates_by_name(tree: Tree, velocity_names: list[str]) -> dict[str, slice]:
    """Return the entries of v that the name of a joint or of a coordinate stands for."""
    single = {name: slice(k, k + 1) for k, name in enumerate(velocity_names)}
    return single | {link.name: link.v_indices for link in tree.links if not link.mimics}


def _replaced(
    what: str, values: np.ndarray, targets: Mapping[str, slice], replacements: Mapping[str, float]
) -> np.ndarray:
    """Return values by coordinate with those of some names replaced."""
    result = np.array(values)
    for name, value in replacements.items():
        if name not in targets:
            raise RobotError(f"There is no joint '{name}' to set the {what} of{nearest(name, targets)}.")
        if not (np.isfinite(value) and value >= 0.0):
            raise RobotError(f"The {what} of joint '{name}' must be finite and not negative, but is {value}.")
        result[targets[name]] = value
    return result


def _position_limits(model: pin.Model, tree: Tree) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit)
    for link in tree.links:
        for entry in link.joint.unit_entries:
            lower[link.q_indices.start + entry] = -np.inf
            upper[link.q_indices.start + entry] = np.inf
    return _without_sentinels(lower), _without_sentinels(upper)


def _without_sentinels(limits: np.ndarray) -> np.ndarray:
    """Return the limits with the huge numbers that stand for none replaced by ±inf."""
    values = np.array(limits, dtype=float)
    huge = np.abs(values) >= _NO_LIMIT_FROM
    values[huge] = np.copysign(np.inf, values[huge])
    return _frozen(values)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
