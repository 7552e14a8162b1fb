"""The equations of motion M(q) dv/dt + h(q, v) + D v + K (q - r) = τ and the energies as CasADi expressions.

Damping D v and springs K (q - r) are expressions of their own; the set-valued dry friction of joints is none of them
(`fesd_robot.contact.joint_friction`).
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from fesd_robot.robot.algebra import column, cross, cross_columns, rotate_symmetric, symmetric
from fesd_robot.robot.kinematics import first_moment
from fesd_robot.robot.robot import Robot
from fesd_robot.robot.tree import Link


def rnea(robot: Robot, q: ca.SX, v: ca.SX, a: ca.SX) -> ca.SX:
    """Return the joint forces that produce the acceleration a.

        τ = M(q) a + h(q, v)

    The recursion runs on classical accelerations: with U = [dω/dt]× + [ω]×[ω]×, a point r of a body accelerates by
    a_o + U r. The force a body passes on is M a_o + G with the mass M of all it carries, where G and the moment N about
    its origin follow from the first moment h and the second moment Σ of the augmented body,

        G = U h + Σ_children G_c,   N = h × a_o + axial(U Σ) + Σ_children (N_c + p_c × G_c),

    so that nothing is turned back and forth that need not be, and a child that slides adds M_c times its acceleration
    relative to a_o.

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        v: velocity, shape (nv, 1), m/s and rad/s.
        a: derivative of v, shape (nv, 1), m/s² and rad/s².

    Returns:
        τ, shape (nv, 1), N and N m, including armature · a.

    Raises:
        DimensionError: if q, v or a has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 5.3; Balafoutis, Patel, Misra, Efficient
        modeling and computation of manipulator dynamics using orthogonal Cartesian tensors (1988); Wittenburg,
        Dynamics of Systems of Rigid Bodies (1977), for augmented bodies.
    """
    a = column("a", a, robot.model.nv)
    return ca.sparsify(_inverse_dynamics(robot, q, v, a) + ca.sparsify(ca.DM(robot.model.armature)) * a)


def nonlinear_effects(robot: Robot, q: ca.SX, v: ca.SX) -> ca.SX:
    """Return the joint forces of gravity, Coriolis and centrifugal effects.

        h(q, v) = τ at a = 0

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        v: velocity, shape (nv, 1), m/s and rad/s.

    Returns:
        h, shape (nv, 1), N and N m.

    Raises:
        DimensionError: if q or v has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 5.3.
    """
    return ca.sparsify(_inverse_dynamics(robot, q, v, ca.SX(robot.model.nv, 1)))


def damping_force(robot: Robot, v: ca.SX) -> ca.SX:
    """Return the joint forces that overcome viscous damping.

        D v with the diagonal D of ``model.damping``

    Args:
        robot: the robot.
        v: velocity, shape (nv, 1), m/s and rad/s.

    Returns:
        shape (nv, 1), N and N m.

    Raises:
        DimensionError: if v has the wrong shape.
    """
    return ca.sparsify(ca.sparsify(ca.DM(robot.model.damping)) * column("v", v, robot.model.nv))


def spring_force(robot: Robot, q: ca.SX) -> ca.SX:
    """Return the joint forces that overcome the springs.

        K (q - r) with the diagonal K of stiffnesses and the rest positions r of ``robot.springs``

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.

    Returns:
        shape (nv, 1), N and N m.

    Raises:
        DimensionError: if q has the wrong shape.
    """
    q, result = column("q", q, robot.model.nq), ca.SX(robot.model.nv, 1)
    for v, entry, stiffness, rest in robot.springs:
        result[v] = stiffness * (q[entry] - rest)
    return result


def mass_matrix(robot: Robot, q: ca.SX) -> ca.SX:
    """Return the joint-space inertia matrix by the composite-rigid-body algorithm.

        M_ij = s_iᵀ I_i^c s_j for a joint j that carries joint i, plus the armature on the diagonal

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.

    Returns:
        M, shape (nv, nv), symmetric, with structural zeros; kg, kg m and kg m².

    Raises:
        DimensionError: if q has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.2.
    """
    q = column("q", q, robot.model.nq)
    links = robot.tree.links
    motions = [link.motion(q) for link in links]
    moments = [ca.SX(link.first_moment) for link in links]
    inertias = [ca.SX(link.inertia) for link in links]
    result = ca.SX(ca.diag(ca.sparsify(ca.DM(robot.model.armature))))
    for index in reversed(range(len(links))):
        link = links[index]
        mass, moment, inertia = link.mass, moments[index], inertias[index]
        if mass == 0.0 and moment.nnz() == 0 and inertia.nnz() == 0:
            continue
        force = mass * link.linear - cross_columns(moment, ca.SX(link.angular))
        torque = inertia @ link.angular + cross_columns(moment, ca.SX(link.linear))
        result[link.v_indices, link.v_indices] += link.linear.T @ force + link.angular.T @ torque
        ancestor = link
        ancestor_index = index
        while ancestor.parent >= 0:
            rotation, position = motions[ancestor_index]
            force = rotation @ force
            torque = rotation @ torque + cross_columns(position, force)
            ancestor_index = ancestor.parent
            ancestor = links[ancestor_index]
            block = ancestor.linear.T @ force + ancestor.angular.T @ torque
            result[ancestor.v_indices, link.v_indices] += block
            result[link.v_indices, ancestor.v_indices] += block.T
        if link.parent >= 0:
            rotation, position = motions[index]
            in_parent = link.joint.origin_fixed_in_parent  # whose augmented body has the mass already
            moved, shift = _shift_inertia(0.0 if in_parent else mass, rotation @ moment, position)
            moments[link.parent] = moments[link.parent] + moved
            inertias[link.parent] = inertias[link.parent] + rotate_symmetric(rotation, inertia) + shift
    return ca.sparsify(result)


def kinetic_energy(robot: Robot, q: ca.SX, v: ca.SX) -> ca.SX:
    """Return the kinetic energy, including that of the armatures.

        T = ½ vᵀ M(q) v

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.
        v: velocity, shape (nv, 1), m/s and rad/s.

    Returns:
        a scalar, J.

    Raises:
        DimensionError: if q or v has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 2.13.
    """
    q, v = column("q", q, robot.model.nq), column("v", v, robot.model.nv)
    twice = ca.dot(ca.sparsify(ca.DM(robot.model.armature)) * v, v)
    velocities: list[tuple[ca.SX, ca.SX]] = []
    for link in robot.tree.links:
        rotation, position = link.motion(q)
        parent_linear, angular = velocities[link.parent] if link.parent >= 0 else (ca.SX(3, 1), ca.SX(3, 1))
        own = v[link.v_indices]
        step = cross(angular, position)
        if link.parent_linear is not None:
            step = step + link.parent_linear @ own
            linear = rotation.T @ (parent_linear + step)
            gained = ca.dot(step, 2 * parent_linear + step)
        else:
            linear = rotation.T @ (parent_linear + step) + link.linear @ own
            gained = ca.dot(linear, linear) - ca.dot(parent_linear, parent_linear)
        if not link.joint.origin_fixed_in_parent:
            twice = twice + link.mass * gained
        angular = rotation.T @ angular + link.angular @ own
        velocities.append((linear, angular))
        if not link.turns_nothing:
            twice = twice + 2 * ca.dot(linear, cross(angular, ca.SX(link.first_moment)))
            twice = twice + ca.dot(angular, link.inertia @ angular)
    return twice / 2


def potential_energy(robot: Robot, q: ca.SX) -> ca.SX:
    """Return the potential energy in gravity, zero at the origin of the world, and of the springs.

        V = −gᵀ Σ m_i c_i + ½ Σ k_j (q_j − r_j)²

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad.

    Returns:
        a scalar, J.

    Raises:
        DimensionError: if q has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 2.13.
    """
    stored = [stiffness * (q[entry] - rest) ** 2 / 2 for _, entry, stiffness, rest in robot.springs]
    return ca.dot(ca.sparsify(ca.DM(-robot.model.gravity.linear)), first_moment(robot, q)) + sum(stored)


class _Motion(NamedTuple):
    """How a link moves.

    Attributes:
        rotation, position: its placement in its parent.
        omega, omega_dot: its angular velocity and acceleration.
        acceleration: classical acceleration of its origin, gravity subtracted.
        acceleration_in_parent: the same in parent coordinates.
        relative_acceleration: the same relative to the parent's origin, in parent coordinates.
        field: [dω/dt]× + [ω]×[ω]×.
    """

    rotation: ca.SX
    position: ca.SX
    omega: ca.SX
    omega_dot: ca.SX
    acceleration: ca.SX
    acceleration_in_parent: ca.SX
    relative_acceleration: ca.SX
    field: ca.SX


def _inverse_dynamics(robot: Robot, q: ca.SX, v: ca.SX, a: ca.SX) -> ca.SX:
    """Return τ without armature; structurally zero entries of a cost nothing."""
    q, v = column("q", q, robot.model.nq), column("v", v, robot.model.nv)
    links = robot.tree.links
    zero, unit = ca.SX(3, 1), ca.SX(ca.DM.eye(3))
    minus_gravity = ca.SX(ca.sparsify(ca.DM(-robot.model.gravity.linear)))
    world = _Motion(unit, zero, zero, zero, minus_gravity, minus_gravity, zero, ca.SX(3, 3))
    motions: list[_Motion] = []
    for link in links:
        parent = motions[link.parent] if link.parent >= 0 else world
        motions.append(_accelerate(link, parent, *link.motion(q), v[link.v_indices], a[link.v_indices]))
    forces, moments = [zero] * len(links), [zero] * len(links)
    result = ca.SX(robot.model.nv, 1)
    for index in reversed(range(len(links))):
        link, motion = links[index], motions[index]
        force, moment = forces[index], moments[index]
        if not link.turns_nothing:
            force = force + motion.field @ link.first_moment
            moment = moment + _axial(motion.field @ link.second_moment)
            moment = moment + cross(ca.SX(link.first_moment), motion.acceleration)
        force_in_parent = motion.rotation @ force
        joint_force = link.mass * motion.acceleration_in_parent + force_in_parent
        if link.parent_linear is not None:
            result[link.v_indices] += link.parent_linear.T @ joint_force + link.angular.T @ moment
        else:
            result[link.v_indices] += (
                link.linear.T @ (link.mass * motion.acceleration + force) + link.angular.T @ moment
            )
        if link.parent < 0:
            continue
        if link.joint.origin_fixed_in_parent:
            forces[link.parent] = forces[link.parent] + force_in_parent
            force_of_child = force_in_parent
        else:
            forces[link.parent] = forces[link.parent] + link.mass * motion.relative_acceleration + force_in_parent
            force_of_child = joint_force
        moment_in_parent = motion.rotation @ moment + cross(motion.position, force_of_child)
        moments[link.parent] = moments[link.parent] + moment_in_parent
    return result


def _accelerate(link: Link, parent: _Motion, rotation: ca.SX, position: ca.SX, v: ca.SX, a: ca.SX) -> _Motion:
    """Return how a link moves on a moving parent; v and a are its own joint's."""
    back = rotation.T
    omega_of_parent, omega_of_joint = back @ parent.omega, link.angular @ v
    omega = omega_of_parent + omega_of_joint
    omega_dot = back @ parent.omega_dot + cross(omega_of_parent, omega_of_joint) + link.angular @ a
    relative_acceleration = parent.field @ position
    if link.parent_linear is not None:
        relative_acceleration = (
            relative_acceleration + 2 * cross(parent.omega, link.parent_linear @ v) + link.parent_linear @ a
        )
        acceleration_in_parent = parent.acceleration + relative_acceleration
        acceleration = back @ acceleration_in_parent
    else:
        sliding = cross(omega_of_parent + omega, link.linear @ v) + link.linear @ a
        acceleration = back @ (parent.acceleration + relative_acceleration) + sliding
        relative_acceleration = relative_acceleration + rotation @ sliding
        acceleration_in_parent = parent.acceleration + relative_acceleration
    field = _acceleration_field(omega, omega_dot)
    return _Motion(
        rotation, position, omega, omega_dot, acceleration, acceleration_in_parent, relative_acceleration, field
    )


def _axial(matrix: ca.SX) -> ca.SX:
    """Return the vector of the antisymmetric part: ε_ijk A_kj."""
    return ca.vertcat(matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1])


def _acceleration_field(omega: ca.SX, omega_dot: ca.SX) -> ca.SX:
    """Return [dω/dt]× + [ω]×[ω]×."""
    xx, yy, zz = omega[0] * omega[0], omega[1] * omega[1], omega[2] * omega[2]
    xy, xz, yz = omega[0] * omega[1], omega[0] * omega[2], omega[1] * omega[2]
    return ca.blockcat(
        [
            [-(yy + zz), xy - omega_dot[2], xz + omega_dot[1]],
            [xy + omega_dot[2], -(xx + zz), yz - omega_dot[0]],
            [xz - omega_dot[1], yz + omega_dot[0], -(xx + yy)],
        ]
    )


def _shift_inertia(mass: float, moment: ca.SX, position: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the first moment about a point, and the addition to the inertia there, of a body at `position` from it.

    h' = h + m p,   I' − I = 2 (pᵀk) 1 − p kᵀ − k pᵀ   with   k = h + m p / 2
    """
    middle = moment + mass / 2 * position
    px, py, pz = position[0], position[1], position[2]
    kx, ky, kz = middle[0], middle[1], middle[2]
    xx, yy, zz = 2 * (px * kx), 2 * (py * ky), 2 * (pz * kz)
    shift = symmetric(yy + zz, xx + zz, xx + yy, -(px * ky + kx * py), -(px * kz + kx * pz), -(py * kz + ky * pz))
    return moment + mass * position, shift
