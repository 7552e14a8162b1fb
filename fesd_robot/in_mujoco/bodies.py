"""The bodies and joints of a robot in MuJoCo's form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.exactness import ROUNDED
from fesd_robot.in_mujoco.coordinates import SUFFIXES, joint_names
from fesd_robot.in_mujoco.impacts import STEPS, rubbing
from fesd_robot.robot import Link, Robot

LEAST = 1e-13
"""kg and kg m²; MuJoCo asks for masses and inertias above 1e-15, also of links that have none."""

WITHOUT_LIMIT = 1e9
"""m or rad; limit of a joint on the side on which it has none."""


@dataclass(frozen=True)
class Bodies:
    """Bodies of a robot in a scene.

    Attributes:
        robot: of the plan.
        links: the body of every link of its tree.
        world: what they stand on.
    """

    robot: Robot
    links: list[mujoco.MjsBody]
    world: mujoco.MjsBody

    def frame(self, name: str) -> tuple[mujoco.MjsBody, pin.SE3]:
        """Return the body to which a frame of the robot is fixed, and its placement there."""
        robot = self.robot
        frame = robot.model.frames[robot.frame_id(name)]
        link = robot.tree.last_link[frame.parentJoint]
        return (self.world if link < 0 else self.links[link]), frame.placement

    def neutral_placement(self, name: str) -> pin.SE3:
        """Return the placement of a frame in the world with every joint at zero."""
        model = self.robot.model
        data = model.createData()
        pin.framesForwardKinematics(model, data, self.robot.neutral)
        return pin.SE3(data.oMf[self.robot.frame_id(name)])


def add_bodies(spec: mujoco.MjSpec, robot: Robot, *, mass: float, time_step: float) -> Bodies:
    """Add the bodies of a robot with their joints to a scene.

    Args:
        spec: the scene.
        robot: of the plan; locked joints are gone in it, and coupled ones are one.
        mass: factor of all masses and inertias.
        time_step: s.

    Raises:
        RobotError: a joint that MuJoCo does not have.
    """
    bodies = Bodies(robot, [], spec.worldbody)
    names = _body_names(robot)
    inertias = {link: robot.model.inertias[joint] for joint, link in enumerate(robot.tree.last_link) if joint}
    leaders = {link.v_indices.start: link for link in robot.tree.links if not link.mimics}
    for index, link in enumerate(robot.tree.links):
        parent = spec.worldbody if link.parent < 0 else bodies.links[link.parent]
        placement = pin.SE3(np.array(link.rotation.full()), np.array(link.translation.full()).ravel())
        _check_free(robot, link, placement)
        body = parent.add_body(name=names[index], pos=placement.translation, quat=quaternion(placement.rotation))
        _set_inertia(body, inertias.get(index, pin.Inertia.Zero()), _turning(robot, index), mass)
        _add_joints(body, robot, link, time_step)
        if link.mimics:
            equality = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_JOINT,
                objtype=mujoco.mjtObj.mjOBJ_JOINT,
                name1=link.name,
                name2=leaders[link.v_indices.start].name,
                solref=[STEPS * time_step, 1.0],
                solimp=STIFF_IMPEDANCE,
            )
            equality.data[:5] = [link.offset, link.multiplier, 0, 0, 0]
        bodies.links.append(body)
    return bodies


STIFF_IMPEDANCE = [0.9999, 0.9999, 0.001, 0.5, 2.0]
"""solimp; the largest that MuJoCo has: constraints give way by a ten thousandth of the acceleration they prevent."""


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion w, x, y, z of a rotation."""
    x, y, z, w = pin.Quaternion(np.asarray(rotation)).coeffs()
    return np.array([w, x, y, z])


def _body_names(robot: Robot) -> list[str]:
    """Return a name for the body of every link: that of its link in the file, or of its joint where that is taken."""
    names: list[str] = []
    of_link: Mapping[int, str] = {
        robot.tree.last_link[frame.parentJoint]: frame.name
        for frame in reversed(list(robot.model.frames))
        if frame.type == pin.FrameType.BODY
    }
    for index, link in enumerate(robot.tree.links):
        name = of_link.get(index, link.name)
        names.append(name if name not in names else link.name)
    return names


def _check_free(robot: Robot, link: Link, placement: pin.SE3) -> None:
    if type(link.joint).__name__ != "FreeFlyer":
        return
    if link.parent >= 0 or not placement.isIdentity(ROUNDED):
        raise RobotError(
            f"{robot.source}: found joint '{link.name}' that floats elsewhere than at the origin of the world, where a "
            "free joint of MuJoCo is; expected one there"
        )


def _turning(robot: Robot, index: int) -> np.ndarray:
    """Return the axes about which a link can turn, in its own axes with every joint at zero, (n, 3)."""
    axes, turn, links = [], np.eye(3), robot.tree.links
    while index >= 0:
        link = links[index]
        angular = np.array(link.angular.full())
        axes += [turn @ column for column in angular.T if np.any(column)]
        turn = turn @ np.array(link.rotation.full()).T
        index = link.parent
    return np.array(axes).reshape(-1, 3)


def _set_inertia(body: mujoco.MjsBody, inertia: pin.Inertia, turning: np.ndarray, factor: float) -> None:
    """Give a body its mass and inertia.

    Of a body that turns about one axis only, as one in the plane, the moments about the others have no effect; they are
    made such that the inertia is that of some body, which MuJoCo asks for.
    """
    matrix = np.array(inertia.inertia) if inertia.mass > 0 else np.zeros((3, 3))
    if not len(turning):
        matrix = max(inertia.mass, LEAST) * np.eye(3)
    elif np.linalg.matrix_rank(turning, tol=ROUNDED) == 1:
        axis = turning[0] / np.linalg.norm(turning[0])
        own = max(float(axis @ matrix @ axis), LEAST)
        matrix = own * np.eye(3)
    else:
        values, directions = np.linalg.eigh(matrix)
        matrix = directions @ np.diag(np.maximum(values, LEAST)) @ directions.T
    body.explicitinertial = True
    body.mass = factor * max(inertia.mass, LEAST)
    body.ipos = inertia.lever if inertia.mass > 0 else np.zeros(3)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = factor * matrix
    body.fullinertia = [xx, yy, zz, xy, xz, yz]


def _add_joints(body: mujoco.MjsBody, robot: Robot, link: Link, time_step: float) -> None:
    model, at, own_kind = robot.model, link.v_indices, type(link.joint).__name__
    kinds = mujoco.mjtJoint
    friction = np.abs(np.array(model.upperDryFrictionLimit))
    own = {"armature": model.armature, "damping": model.damping, "frictionloss": friction}
    values = {name: [0.0] * 6 if link.mimics else np.array(each)[at].tolist() for name, each in own.items()}
    common = {"solref_friction": rubbing(time_step), "solimp_friction": STIFF_IMPEDANCE}
    if own_kind in ("FreeFlyer", "Spherical"):
        _check_even(robot, link, values)
        whole = {name: each[0] for name, each in values.items()}
        free = kinds.mjJNT_FREE if own_kind == "FreeFlyer" else kinds.mjJNT_BALL
        _with_damping(body.add_joint(name=link.name, type=free, **common), whole)
        return
    parts = SUFFIXES.get(own_kind)
    if parts is None:
        turns = own_kind != "Prismatic"
        axis = np.array((link.angular if turns else link.linear).full()).ravel() / link.multiplier
        joint = body.add_joint(
            name=link.name, type=kinds.mjJNT_HINGE if turns else kinds.mjJNT_SLIDE, axis=axis, **common
        )
        _with_damping(joint, {name: each[0] for name, each in values.items()})
        _set_range(joint, robot, link)
        spring = robot.joint_springs.get(link.name)
        if spring is not None and not link.mimics:
            _set_linear(joint, "stiffness", spring.stiffness)
            joint.springref = spring.rest
        return
    for number, (name, (suffix, direction)) in enumerate(zip(joint_names(link), parts, strict=True)):
        kind = kinds.mjJNT_HINGE if suffix == ".theta" else kinds.mjJNT_SLIDE
        joint = body.add_joint(name=name, type=kind, axis=[float(direction == each) for each in "xyz"], **common)
        _with_damping(joint, {name: each[number] for name, each in values.items()})


def _with_damping(joint: mujoco.MjsJoint, values: Mapping[str, float]) -> None:
    joint.armature, joint.frictionloss = values["armature"], values["frictionloss"]
    _set_linear(joint, "damping", values["damping"])


def _set_linear(joint: mujoco.MjsJoint, name: str, value: float) -> None:
    """Set a coefficient that is the first one of several since MuJoCo 4."""
    several = np.size(getattr(joint, name))
    setattr(joint, name, value if several == 1 else [value] + [0.0] * (several - 1))


def _check_even(robot: Robot, link: Link, values: Mapping[str, list[float]]) -> None:
    for name, each in values.items():
        if max(each) - min(each) > ROUNDED:
            raise RobotError(
                f"{robot.source}: found joint '{link.name}' with several values of {name}, of which MuJoCo has one a "
                "joint; expected the same for all of its directions"
            )


def _set_range(joint: mujoco.MjsJoint, robot: Robot, link: Link) -> None:
    if link.mimics or type(link.joint).__name__ == "UnboundedRevolute":
        return
    low, high = robot.lower_position[link.q_indices.start], robot.upper_position[link.q_indices.start]
    if np.isfinite(low) or np.isfinite(high):
        # A plan goes up to a limit, but knows no stop there, at which a joint that is moved would bounce.
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        joint.range = [max(low, -WITHOUT_LIMIT), min(high, WITHOUT_LIMIT)]
