"""From a MuJoCo file to a model of Pinocchio and what the file says beyond it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from fesd_robot.robot.followers import Follower, with_followers
from fesd_robot.robot.mjcf.bodies import build_bodies, root_body
from fesd_robot.robot.mjcf.compiled import compiled_mjcf, disabled, name_of
from fesd_robot.robot.mjcf.drives import read_actuators
from fesd_robot.robot.mjcf.equalities import joint_equalities, move_to_leaders
from fesd_robot.robot.mjcf.keyframes import read_keyframes
from fesd_robot.robot.mjcf.shapes import read_shapes
from fesd_robot.robot.model_file import ModelFile, Spring, note, on_leaders
from fesd_robot.robot.right_angles import SQUARE_AXES, square_axes
from fesd_robot.robot.root import Root, make_root_joint


def read_mjcf(path: Path, root: Root) -> ModelFile:
    """Return the robot of a MuJoCo file, as MuJoCo's compiler understands it.

    Bodies, joints, springs, damping, armature, dry friction, limits, motors, keyframes, shapes and linear equalities
    of joints are read; what else acts on the motion is refused.

    Args:
        path: the file; what it includes is looked up as MuJoCo does.
        root: joint that is put under the robot's first body, in place of a free joint; ``fixed`` for none.

    Raises:
        RobotError: a file that MuJoCo cannot read, or one that says what is not supported.
    """
    compiled = compiled_mjcf(path)
    body = None if root == "fixed" else root_body(path, compiled)
    actuators, followers = read_actuators(compiled), joint_equalities(path, compiled)
    model = build_bodies(compiled, actuators.efforts, body, make_root_joint(root))
    springs = dict(_springs(compiled))
    changed = square_axes(model)
    springs = move_to_leaders(path, model, springs, followers)
    model, limit_notes = with_followers(path, model, followers)
    drives = on_leaders(actuators.drives, followers)
    without = [name for name in actuators.drives if name not in drives]
    return ModelFile(
        model=model,
        format="mjcf",
        notes=[
            *actuators.notes,
            *note(
                "Motors that push a joint and one that follows it against each other, and so nothing: {}.",
                without,
            ),
            *note(SQUARE_AXES, changed),
            *_notes(compiled, followers),
        ],
        springs=springs,
        drives=drives,
        limit_notes=limit_notes,
        postures=read_keyframes(compiled, root, body, {one.name for one in followers}),
        shapes=read_shapes(compiled),
    )


def _springs(model: mujoco.MjModel) -> Iterator[tuple[str, Spring]]:
    if disabled(model, "SPRING"):
        return
    for joint in np.flatnonzero(model.jnt_stiffness):
        rest = float(model.qpos_spring[model.jnt_qposadr[joint]])
        yield name_of(model, "joint", int(joint)), Spring(float(model.jnt_stiffness[joint]), rest)


def _notes(model: mujoco.MjModel, followers: list[Follower]) -> Iterator[str]:
    balls = model.jnt_type == mujoco.mjtJoint.mjJNT_BALL
    if np.any(model.jnt_limited[balls]):
        yield "The range of ball joints is not read."
    world = [name_of(model, "geom", int(geom)) for geom in np.flatnonzero(model.geom_bodyid == 0)]
    yield from note("The world's shapes ({}) are not read: the task's 'ground' says what the robot can touch.", world)
    for one in followers:
        yield f"Joint '{one.name}' follows '{one.leader}' exactly; MuJoCo's equality between them gives way."
