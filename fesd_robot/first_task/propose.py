"""From a model to a first task that the program takes."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from fesd_robot.errors import FesdRobotError, JointError, RobotError, TaskError
from fesd_robot.first_task.arm import reach
from fesd_robot.first_task.base import Base, base_of
from fesd_robot.first_task.feet import limbs_of
from fesd_robot.first_task.legs import jump
from fesd_robot.first_task.posture import clipped
from fesd_robot.first_task.proposal import Proposal, RobotSection, what_moves
from fesd_robot.first_task.slide import slide
from fesd_robot.first_task.text import task_text
from fesd_robot.ocp import formulate
from fesd_robot.robot import PACKAGE, PREFIX, SAGITTAL_NAMES, Robot, load_robot, propose_sagittal
from fesd_robot.task import Task, load_task

RootChoice = Literal["fixed", "sagittal"]

_LIGHT = 0.1
"""Of the robot's mass: armature for a coordinate that moves none."""

_MASSLESS = 1e-9
"""kg or kg m2; an inertia that is none."""

_TILTED = 0.3
"""rad; a robot whose root pitches further to touch the ground with all feet does not stand."""


def propose_first_task(
    source: str, folder: Path, *, root: RootChoice | None = None, feet: Sequence[str] = (), schema: str | None = None
) -> tuple[str, str]:
    """Return the name and the text of a task for a robot: one with legs jumps, an arm puts its tip to the ground.

    Its contacts are the lowest ends of its limbs; the start is a posture of the model file in which it stands, or one
    that is found; joints that leave the x-z plane are locked, legs beside each other move in unison. The task was
    formulated: names, limits and inverse kinematics fit.

    Args:
        source: a URDF, MJCF or SDF file, ``package://NAME/PATH``, ``example-robot-data:NAME``, or such a NAME alone.
        folder: of the task file, from which its relative paths start.
        root: joint between the world and the first link; default: none for a robot whose file has one, and for arms,
            else sagittal.
        feet: bodies that touch the ground; default: guessed.
        schema: address of the JSON schema for editors, for the first line of the file.

    Raises:
        RobotError: a model that cannot be read, or for which there is no such task; the message says why.
    """
    model = _address(source, folder)
    fixed = _loaded(model, folder, "fixed")
    base = Base() if fixed is None else base_of(fixed)
    chosen = root or ("fixed" if base.up and base.forward else _root_of(model, folder, base, fixed))
    section, robot = _in_plane(model, folder, chosen)
    base = base_of(robot) if chosen == "fixed" else Base(*SAGITTAL_NAMES, names=tuple(robot.root_names))
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", what_moves(section)).strip("_.-") or "robot"
    if base.up and base.forward and set(robot.velocity_names) <= set(base.names):
        proposals = slide(f"{name}_first_slide", robot, section, base)
    elif base.up and base.forward:
        proposals = jump(f"{name}_first_jump", robot, section, base, feet)
    else:
        proposals = reach(f"{name}_first_reach", robot, section, feet)
    failures = []
    for proposal in proposals:
        text = task_text(proposal, schema)
        try:
            return proposal.name, _completed(proposal, text, folder, schema)
        except FesdRobotError as error:
            # The file that it names is a temporary one.
            failures.append(f"{error.key}: {error.message}" if isinstance(error, TaskError) else str(error))
    raise RobotError(
        f"{robot.source}: found no first task for this robot ({failures[-1].rstrip('.')}); expected one "
        "with legs, or a single arm, that moves in the x-z plane: name its feet by --foot, or its root by --root"
    )


def _address(source: str, folder: Path) -> str:
    """Return how a task in a folder names a model: a path from there, or its address in a package."""
    if source.startswith((PREFIX, PACKAGE)):
        return source
    path = Path(source).expanduser()
    if path.is_file():
        relative = os.path.relpath(path.resolve(), folder.resolve())
        # Far away from each other, a relative path says less than the place itself.
        return relative if relative.count("..") <= 3 else str(path.resolve())
    if path.suffix or path.name != source:
        raise RobotError(f"There is no robot file {path}.")
    return f"{PREFIX}{source}"


def _loaded(model: str, folder: Path, root: Literal["fixed", "sagittal"]) -> Robot | None:
    """Return a robot as it is; None for one without a moving joint."""
    try:
        return load_robot(model, root=root, search_path=folder)
    except RobotError as error:
        if "no moving joint" in str(error):
            return None
        raise


def _root_of(model: str, folder: Path, base: Base, fixed: Robot | None) -> RootChoice:
    """Return whether a robot whose file has no root of its own stands on legs or is an arm on the ground."""
    if fixed is None or base.free:
        return "sagittal"
    robot = load_robot(model, root="sagittal", search_path=folder)
    q = clipped(robot, robot.neutral)
    limbs = limbs_of(robot, q)
    if len(limbs) < 2:
        return "fixed"
    return "sagittal" if min(limb.lowest for limb in limbs) < _bottom(robot, q) else "fixed"


def _bottom(robot: Robot, q: np.ndarray) -> float:
    """Return the height of the lowest joint or body of the first link, m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    heights = [float(data.oMf[i].translation[2]) for i, f in enumerate(robot.model.frames) if f.parentJoint == 1]
    return min(heights, default=0.0)


def _in_plane(model: str, folder: Path, root: RootChoice) -> tuple[RobotSection, Robot]:
    """Return the section of a robot that moves in the x-z plane, and the robot."""
    whole = load_robot(model, root=root, search_path=folder)
    try:
        proposal = propose_sagittal(whole.model)
    except JointError as error:
        raise RobotError(f"{whole.source}: cannot be held in the x-z plane: {error}") from error
    reduction: dict[str, Any] = {"root": root, "locked": proposal.locked, "coupled": proposal.coupled}
    try:
        robot = load_robot(model, **reduction, search_path=folder)
    except JointError as error:
        raise RobotError(f"{whole.source}: cannot be held in the x-z plane: {error}") from error
    armature = _armature(robot)
    robot = load_robot(model, **reduction, armature=armature, search_path=folder)
    return RobotSection(model, root, proposal.locked, proposal.coupled, armature), robot


def _armature(robot: Robot) -> dict[str, float]:
    """Return an inertia for every coordinate that moves no mass, kg or kg m2, of a robot of one metre."""
    model = robot.model
    inertia = np.diag(pin.crba(model, model.createData(), robot.neutral)) + model.armature
    return {
        name: float(f"{_LIGHT * pin.computeTotalMass(model):.1g}")
        for name, own in zip(robot.velocity_names, inertia, strict=True)
        if own <= _MASSLESS
    }


def _completed(proposal: Proposal, text: str, folder: Path, schema: str | None) -> str:
    """Return the text of a task with the height of a jump filled in, once the task can be formulated.

    Raises:
        FesdRobotError: if it cannot.
    """
    task = _read(text, folder)
    motion = formulate(task)
    start = motion.task.initial.configuration
    pitch = start.get("root_pitch", 0.0)
    if abs(pitch) > _TILTED:
        raise RobotError(f"{proposal.robot.model}: pitches by {pitch:.2g} rad to stand on all feet")
    if not proposal.apex:
        return text
    apex = {name: round(start[name] + rise, 3) for name, rise in proposal.apex.items()}
    text = task_text(proposal, schema, apex=apex)
    formulate(_read(text, folder))
    return text


def _read(text: str, folder: Path) -> Task:
    """Return the task that a text describes; it has to lie in its folder, for relative paths start there."""
    with tempfile.NamedTemporaryFile("w", suffix=".yaml", prefix=".", dir=folder, encoding="utf-8") as file:
        file.write(text)
        file.flush()
        return load_task(file.name)
