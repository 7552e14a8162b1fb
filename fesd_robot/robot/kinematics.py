"""Placements, velocities and Jacobians of frames, and the centre of mass, as CasADi expressions."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from fesd_robot.errors import RobotError
from fesd_robot.robot.algebra import clean, column, cross, cross_columns
from fesd_robot.robot.robot import Robot
from fesd_robot.robot.tree import Link


def frame_placement(robot: Robot, q: ca.SX, frame_name: str) -> tuple[ca.SX, ca.SX]:
    """Return the placement of a frame in the world.

        x_world = R x_frame + p

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        frame_name: name of the frame.

    Returns:
        R, shape (3, 3), and p, shape (3, 1), m.

    Raises:
        RobotError: if the robot has no such frame.
        DimensionError: if q has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 4.2.
    """
    frame = robot.model.frames[robot.frame_id(frame_name)]
    steps = _walk(robot, column("q", q, robot.model.nq), frame.parentJoint)
    rotation = steps[-1].rotation if steps else ca.SX(ca.DM.eye(3))
    position = sum((step.shift for step in steps), ca.SX(3, 1)) + rotation @ clean(frame.placement.translation)
    return ca.sparsify(rotation @ clean(frame.placement.rotation)), ca.sparsify(position)


def frame_velocity(robot: Robot, q: ca.SX, v: ca.SX, frame_name: str) -> tuple[ca.SX, ca.SX]:
    """Return the velocity of a frame's origin and its angular velocity, both in world axes (LOCAL_WORLD_ALIGNED).

        v_child = v_parent + ω_parent × (p_child − p_parent) + R s_linear v,   ω_child = ω_parent + R s_angular v

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        v: velocity, shape (nv, 1), m/s and rad/s.
        frame_name: name of the frame.

    Returns:
        linear velocity, shape (3, 1), m/s, and angular velocity, shape (3, 1), rad/s.

    Raises:
        RobotError: if the robot has no such frame.
        DimensionError: if q or v has the wrong shape.

    Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics: Modelling, Planning and Control (2009), section 3.1.
    """
    frame = robot.model.frames[robot.frame_id(frame_name)]
    v = column("v", v, robot.model.nv)
    linear, angular, rotation = ca.SX(3, 1), ca.SX(3, 1), ca.SX(ca.DM.eye(3))
    for step in _walk(robot, column("q", q, robot.model.nq), frame.parentJoint):
        own = v[step.link.v_indices]
        linear = linear + cross(angular, step.shift) + step.linear @ own
        angular = angular + step.angular @ own
        rotation = step.rotation
    offset = rotation @ clean(frame.placement.translation)
    return ca.sparsify(linear + cross(angular, offset)), ca.sparsify(angular)


def frame_jacobian(robot: Robot, q: ca.SX, frame_name: str) -> ca.SX:
    """Return the Jacobian of a frame in world axes at its origin (LOCAL_WORLD_ALIGNED).

        (linear velocity; angular velocity) = J(q) v

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        frame_name: name of the frame.

    Returns:
        J, shape (6, nv), linear rows first.

    Raises:
        RobotError: if the robot has no such frame.
        DimensionError: if q has the wrong shape.

    Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics: Modelling, Planning and Control (2009), section 3.1.
    """
    frame = robot.model.frames[robot.frame_id(frame_name)]
    steps = _walk(robot, column("q", q, robot.model.nq), frame.parentJoint)
    jacobian = ca.SX(6, robot.model.nv)
    arm = steps[-1].rotation @ clean(frame.placement.translation) if steps else ca.SX(3, 1)
    for step in reversed(steps):
        jacobian[:3, step.link.v_indices] += step.linear - cross_columns(arm, step.angular)
        jacobian[3:, step.link.v_indices] += step.angular
        arm = arm + step.shift
    return ca.sparsify(jacobian)


def center_of_mass(robot: Robot, q: ca.SX) -> ca.SX:
    """Return the centre of mass of all moving bodies in the world.

        c = Σ m_i c_i / Σ m_i

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.

    Returns:
        shape (3, 1), m.

    Raises:
        RobotError: if no moving body has mass.
        DimensionError: if q has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 2.13.
    """
    mass = sum(link.mass for link in robot.tree.links if link.parent < 0)
    if mass == 0.0:
        raise RobotError(f"Robot '{robot.name}' has no centre of mass: none of its moving bodies has mass.")
    return ca.sparsify(first_moment(robot, q) / mass)


def first_moment(robot: Robot, q: ca.SX) -> ca.SX:
    """Return Σ m_i c_i over all moving bodies in the world, kg m, shape (3, 1), by recursion from the leaves."""
    q = column("q", q, robot.model.nq)
    links = robot.tree.links
    moments = [ca.SX(link.first_moment) for link in links]
    world = ca.SX(3, 1)
    for index in reversed(range(len(links))):
        link = links[index]
        rotation, position = link.motion(q)
        moved = rotation @ moments[index]
        if link.parent < 0:
            world = world + moved + link.mass * position
        else:
            in_parent = link.joint.origin_fixed_in_parent  # whose augmented body has the mass already
            moments[link.parent] = moments[link.parent] + (moved if in_parent else moved + link.mass * position)
    return world


class _Step(NamedTuple):
    """A link on the way to a frame; all in world axes.

    Attributes:
        link: the link.
        rotation: its orientation.
        shift: its position relative to its parent.
        linear, angular: its motion subspace, 3 × nv each.
    """

    link: Link
    rotation: ca.SX
    shift: ca.SX
    linear: ca.SX
    angular: ca.SX


def _walk(robot: Robot, q: ca.SX, joint: int) -> list[_Step]:
    """Return the links from the world to a Pinocchio joint, with directions taken from whichever side is cheaper."""
    steps: list[_Step] = []
    rotation = ca.SX(ca.DM.eye(3))
    for link in robot.tree.path(robot.tree.last_link[joint]):
        turn, position = link.motion(q)
        shift, turned = rotation @ position, rotation @ turn
        if link.parent_linear is not None and link.parent_angular is not None:
            linear, angular = rotation @ link.parent_linear, rotation @ link.parent_angular
        else:
            linear, angular = turned @ link.linear, turned @ link.angular
        rotation = turned
        steps.append(_Step(link, rotation, shift, linear, angular))
    return steps
