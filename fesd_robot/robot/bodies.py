"""Bodies beside a robot: models of their own, put together to one with the names of the bodies in front."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.body_names import SEPARATOR, frame_on, name_on
from fesd_robot.robot.load import robot_from_model
from fesd_robot.robot.model_file import ModelFile
from fesd_robot.robot.robot import Robot

_UNIVERSE = 0

_JOINT_ARRAYS = ("armature", "damping", "lowerDryFrictionLimit", "upperDryFrictionLimit")


def beside(robot: Robot, bodies: Mapping[str, Robot], places: Mapping[str, np.ndarray]) -> Robot:
    """Return a robot with bodies beside it as one robot, whose coordinates are its own and then those of every body.

    Args:
        robot: stays as it is.
        bodies: name -> the body, with a root of its own.
        places: name of a body -> where its root joint is in the world, m, (3).

    Raises:
        RobotError: a name that both a body and the robot have, or gravity of a body's own.
    """
    if not bodies:
        return robot
    model, springs, drives = robot.model, dict(robot.joint_springs), dict(robot.drives)
    postures, composites = dict(robot.postures), dict(_composites(robot))
    limit_notes = dict(robot.limit_notes)
    parts = [robot, *bodies.values()]
    for name, body in bodies.items():
        _check_names(robot, name)
        if not np.allclose(body.model.gravity.linear, robot.model.gravity.linear):
            raise RobotError(
                f"found gravity {_listed(body.model.gravity.linear)} m/s2 in the file of body '{name}', expected that "
                f"of the robot, {_listed(robot.model.gravity.linear)} m/s2"
            )
        model = _appended(model, name, body.model, places[name])
        springs |= {name_on(name, joint): spring for joint, spring in body.joint_springs.items()}
        for motor, drive in body.drives.items():
            force = {name_on(name, joint): value for joint, value in drive.force.items()}
            drives[name_on(name, motor)] = replace(drive, force=force)
        for posture, values in body.postures.items():
            postures[name_on(name, posture)] = {name_on(name, joint): value for joint, value in values.items()}
        limit_notes |= {(kind, name_on(name, joint)): text for (kind, joint), text in body.limit_notes.items()}
        for joint, made_of in _composites(body):
            composites[name_on(name, joint)] = [name_on(name, part) for part in made_of]
    for array in _JOINT_ARRAYS:  # of which Pinocchio forgets some, as it forgets gravity
        setattr(model, array, np.concatenate([getattr(part.model, array) for part in parts]))
    model.gravity = robot.model.gravity
    merged = robot_from_model(
        ModelFile(
            model,
            robot.format,
            composites=composites,
            springs=springs,
            drives=drives,
            postures=postures,
            limit_notes=limit_notes,
        ),
        source=robot.source,
        package_directories=robot.package_directories,
    )
    return replace(
        merged,
        name=robot.name,
        shapes=robot.shapes,
        notes=(*robot.notes, *(f"Body '{name}': {note}" for name, body in bodies.items() for note in body.notes)),
        warnings=(
            *robot.warnings,
            *(f"Body '{name}': {said}" for name, body in bodies.items() for said in body.warnings),
        ),
        bodies=dict(bodies),
    )


def _appended(model: pin.Model, name: str, body: pin.Model, place: np.ndarray) -> pin.Model:
    """Return a model with another one on the world; frames of one name, which Pinocchio refuses, keep theirs."""
    first, second, names = model.copy(), body.copy(), dict[str, str]()
    for index in range(1, body.njoints):
        second.names[index] = name_on(name, body.names[index])
    for part, prefix in ((first, "first"), (second, "second")):
        for index, frame in enumerate(part.frames):
            if index and frame.type != pin.FrameType.JOINT:
                unique = f"{prefix} {index}"
                names[unique] = frame.name if part is first else frame_on(name, body, index)
                frame.name = unique
            elif index and part is second:
                frame.name = name_on(name, frame.name)
    result = pin.appendModel(first, second, _UNIVERSE, pin.SE3(np.eye(3), place))
    for frame in result.frames:
        frame.name = names.get(frame.name, frame.name)
    return result


def _composites(robot: Robot) -> Iterator[tuple[str, list[str]]]:
    """Yield the name of every joint made of several, and the names of these."""
    tree, names = robot.tree, list(robot.model.names)
    for joint in range(1, robot.model.njoints):
        last = tree.last_link[joint]
        before = max((link for link in tree.last_link[:joint] if link < last), default=-1)
        if last - before > 1:
            yield names[joint], [link.name for link in tree.links[before + 1 : last + 1]]


def _check_names(robot: Robot, name: str) -> None:
    """Refuse a body whose name is in use: nobody would know whose joint is meant."""
    known = {"joint": [*robot.model.names][1:], "coordinate": robot.configuration_names, "frame": robot.frame_names}
    for kind, names in known.items():
        for used in names:
            if used == name or used.startswith(f"{name}{SEPARATOR}"):
                raise RobotError(
                    f"found a body named '{name}' beside a robot with the {kind} '{used}', expected another name"
                )


def _listed(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in vector) + ")"
