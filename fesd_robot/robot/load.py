"""Reading a robot from a file."""

from __future__ import annotations

import contextlib
import os
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.library import PREFIX, resolve_example
from fesd_robot.robot.mjcf import check_mjcf, composite_names, correct_mjcf_model, mjcf_notes
from fesd_robot.robot.robot import Format, Robot
from fesd_robot.robot.tree import Tree, build_tree
from fesd_robot.robot.urdf import check_leaders, check_urdf

Root = Literal["fixed", "planar", "free_flyer"]

_ROOTS: dict[str, Callable[[], pin.JointModel] | None] = {
    "fixed": None,
    "planar": pin.JointModelPlanar,
    "free_flyer": pin.JointModelFreeFlyer,
}
_FORMATS: dict[str, Format] = {"robot": "urdf", "mujoco": "mjcf", "sdf": "sdf"}
_ROOT_JOINT = "root_joint"
_NO_LIMIT = 1e19
_PACKAGE_LEVELS = 6


def load_robot(
    source: str | Path,
    *,
    root: Root = "fixed",
    armature: Mapping[str, float] | None = None,
    search_path: Path | None = None,
) -> Robot:
    """Return the robot described by a URDF, MJCF or SDF file.

    Args:
        source: a file, or ``example-robot-data:NAME`` for a robot of that package.
        root: joint between the world and the first link: none, planar (x, y, turn about z) or free.
        armature: name of a joint, or of one of its velocity coordinates -> inertia added to the diagonal of the mass
            matrix, kg or kg m²; replaces what the file says. A joint's armature goes to all of its coordinates.
        search_path: folder that relative paths start from; the working directory if absent. ``package://`` addresses
            are looked up there, too.

    Raises:
        RobotError: if the file is missing or cannot be read as it was meant, if a name is unknown, or if the armature
            is negative.
    """
    if root not in _ROOTS:
        raise RobotError(f"There is no root joint '{root}'{nearest(root, _ROOTS)}.")
    path = _locate(source, search_path)
    document = _parse_xml(path)
    file_format = _FORMATS[document.tag]
    composites: dict[str, list[str]] = {}
    notes: list[str] = []
    if file_format == "mjcf":
        check_mjcf(path, document, moving_root=root != "fixed")
        model = _build(path, lambda joint: _build_mjcf(path, joint), root)
        correct_mjcf_model(path, document, model)
        composites = composite_names(document)
        notes += mjcf_notes(document)
    elif file_format == "sdf":
        if not pin.WITH_SDFORMAT:
            raise RobotError(f"{path}: this build of Pinocchio reads no SDF files; convert it to URDF or MJCF.")
        model = _build(path, lambda joint: _build_sdf(path, joint), root)
    else:
        leaders = check_urdf(path, document)
        model = _build(path, lambda joint: _build_urdf(path, joint, leaders), root)
    if model.nv == 0:
        raise RobotError(f"{path}: the robot has no moving joint; if it floats, set root to 'free_flyer'.")
    directories = [path.parent, *path.parent.parents][:_PACKAGE_LEVELS]
    return robot_from_model(
        model,
        source=path,
        file_format=file_format,
        package_directories=(*([search_path.resolve()] if search_path else []), *directories),
        composites=composites,
        notes=notes,
        armature=armature or {},
    )


def robot_from_model(
    model: pin.Model,
    *,
    source: Path,
    file_format: Format,
    package_directories: tuple[Path, ...],
    composites: Mapping[str, Sequence[str]],
    notes: Sequence[str],
    armature: Mapping[str, float],
) -> Robot:
    """Return the robot of a Pinocchio model; `model.armature` is set in place.

    Args:
        model: the model.
        source: the file it was read from.
        file_format: how that file is written.
        package_directories: where ``package://`` addresses are looked up.
        composites: name of a composite joint -> names of the joints it is made of.
        notes: what the file says that the equations of motion leave out.
        armature: name of a joint or of a velocity coordinate -> inertia, kg or kg m².

    Raises:
        RobotError: for a joint type that is not supported, a body without a proper mass, or a wrong armature.
    """
    tree = build_tree(model, composites)
    _check_masses(source, model)
    configuration_names, velocity_names = _coordinate_names(tree, model)
    _set_armature(model, tree, velocity_names, armature)
    lower_position, upper_position = _position_limits(model, tree)
    return Robot(
        name=model.name,
        source=source,
        format=file_format,
        package_directories=package_directories,
        model=model,
        tree=tree,
        configuration_names=configuration_names,
        velocity_names=velocity_names,
        lower_position=lower_position,
        upper_position=upper_position,
        velocity_limit=_without_sentinels(model.velocityLimit),
        effort_limit=_without_sentinels(np.minimum(np.abs(model.lowerEffortLimit), np.abs(model.upperEffortLimit))),
        frame_names=list(dict.fromkeys(frame.name for frame in model.frames)),
        neutral=_frozen(pin.neutral(model)),
        notes=(*notes, *_model_notes(model, velocity_names)),
    )


def _locate(source: str | Path, search_path: Path | None) -> Path:
    if isinstance(source, str) and source.startswith(PREFIX):
        return resolve_example(source.removeprefix(PREFIX))
    path = Path(source).expanduser()
    path = (path if search_path is None else search_path / path).resolve()
    if not path.is_file():
        raise RobotError(f"There is no robot file {path}.")
    return path


def _parse_xml(path: Path) -> ElementTree.Element:
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} is not an XML file: {error}.") from error
    if root.tag not in _FORMATS:
        raise RobotError(f"{path} is neither URDF nor MJCF nor SDF: its first element is <{root.tag}>.")
    return root


def _build(path: Path, build: Callable[[pin.JointModel | None], pin.Model], root: Root) -> pin.Model:
    """Return the model that Pinocchio builds, its complaints turned into a RobotError."""
    root_joint = _ROOTS[root]
    with _captured_errors() as complaints:
        try:
            model = build(None if root_joint is None else root_joint())
        except RobotError:
            raise
        except Exception as error:
            said = " ".join([*complaints(), _last_sentence(str(error))])
            raise RobotError(f"{path} cannot be read: {said.removesuffix('.')}.") from error
    if root != "fixed":
        _refuse_second_root(path, model, root)
    return model


def _refuse_second_root(path: Path, model: pin.Model, root: Root) -> None:
    """Raise if the file floats already: a free joint on the world, or on a root that carries nothing itself."""
    for index in range(1, model.njoints):
        parent = model.parents[index]
        on_root = parent == 0 or (model.names[parent] == _ROOT_JOINT and model.inertias[parent].mass == 0.0)
        is_free = model.joints[index].shortname() == "JointModelFreeFlyer"
        if is_free and on_root and model.names[index] != _ROOT_JOINT:
            raise RobotError(
                f"{path} has its own free root joint '{model.names[index]}'; set root to 'fixed' instead of '{root}'."
            )


def _build_urdf(path: Path, root_joint: pin.JointModel | None, leaders: Mapping[str, str]) -> pin.Model:
    if leaders:
        check_leaders(path, leaders, list(pin.buildModelFromUrdf(str(path)).names)[1:])
    options = {"mimic": True} if leaders else {}
    if root_joint is None:
        return pin.buildModelFromUrdf(str(path), **options)
    return pin.buildModelFromUrdf(str(path), root_joint, _ROOT_JOINT, **options)


def _build_mjcf(path: Path, root_joint: pin.JointModel | None) -> pin.Model:
    if root_joint is None:
        return pin.buildModelFromMJCF(str(path))
    return pin.buildModelFromMJCFAndRootJoint(str(path), root_joint, _ROOT_JOINT)


def _build_sdf(path: Path, root_joint: pin.JointModel | None) -> pin.Model:
    model, loops = pin.buildModelsFromSdf(
        str(path), root_joint=root_joint, root_joint_name=_ROOT_JOINT, geometry_types=[]
    )
    if len(loops) > 0:
        raise RobotError(f"{path}: closed loops are not supported; the robot must be a tree.")
    return model


@contextlib.contextmanager
def _captured_errors() -> Iterator[Callable[[], list[str]]]:
    """Collect what C++ code writes to stderr, the only place where the URDF parser says what is wrong."""
    try:
        saved = os.dup(2)
    except OSError:  # a process without stderr
        yield list
        return
    with tempfile.TemporaryFile() as sink:

        def complaints() -> list[str]:
            sink.seek(0)
            lines = [line.decode(errors="replace").strip() for line in sink.readlines()]
            return [line.removeprefix("Error:").strip() + "." for line in lines if line.startswith("Error:")]

        os.dup2(sink.fileno(), 2)
        try:
            yield complaints
        finally:
            os.dup2(saved, 2)
            os.close(saved)


def _last_sentence(text: str) -> str:
    """Return the message of one of Pinocchio's errors without the place in its sources."""
    return " ".join(text.rpartition("message:\n")[2].split())


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


def _set_armature(model: pin.Model, tree: Tree, velocity_names: list[str], armature: Mapping[str, float]) -> None:
    targets: dict[str, slice] = {name: slice(k, k + 1) for k, name in enumerate(velocity_names)}
    targets |= {link.name: link.v_indices for link in tree.links if not link.mimics}
    values = np.array(model.armature)
    for name, value in armature.items():
        if name not in targets:
            raise RobotError(f"There is no joint '{name}' to give an armature to{nearest(name, targets)}.")
        if not (np.isfinite(value) and value >= 0.0):
            raise RobotError(f"The armature of joint '{name}' must be finite and not negative, but is {value}.")
        values[targets[name]] = value
    model.armature = values


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
    huge = np.abs(values) >= _NO_LIMIT
    values[huge] = np.copysign(np.inf, values[huge])
    return _frozen(values)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _model_notes(model: pin.Model, velocity_names: list[str]) -> list[str]:
    lower, upper = np.abs(model.lowerEffortLimit), np.abs(model.upperEffortLimit)
    findings = {
        "Joint damping ({}) is not part of the equations of motion.": model.damping != 0.0,
        "Dry joint friction ({}) is not part of the equations of motion.": model.upperDryFrictionLimit != 0.0,
        "Asymmetric effort limits ({}) are replaced by their smaller side.": lower != upper,
    }
    notes = []
    for sentence, concerned in findings.items():
        names = [name for name, yes in zip(velocity_names, concerned, strict=True) if yes]
        if names:
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            notes.append(sentence.format(", ".join(names[:3]) + more))
    return notes
