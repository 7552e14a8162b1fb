"""The configuration manifold of a robot as CasADi expressions."""

from __future__ import annotations

import casadi as ca

from fesd_robot.robot.algebra import column
from fesd_robot.robot.robot import Robot


def configuration_derivative(robot: Robot, q: ca.SX, v: ca.SX) -> ca.SX:
    """Return the time derivative of the configuration.

        dq/dt = E(q) v

    with E = 1 for joints whose q simply adds up, (−sin, cos) for an unbounded revolute joint, and for a quaternion
    ½ q ⊗ (ω, 0); velocities of planar and free-flying joints are those of the body, in the body.

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1), m and rad, unit quaternions and unit (cos, sin) pairs.
        v: velocity, shape (nv, 1), m/s and rad/s.

    Returns:
        shape (nq, 1).

    Raises:
        DimensionError: if q or v has the wrong shape.

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), table 4.1 and section 4.5.
    """
    q, v = column("q", q, robot.model.nq), column("v", v, robot.model.nv)
    result = ca.SX(robot.model.nq, 1)
    for link in robot.tree.links:
        if not link.mimics:
            result[link.q_indices] = link.joint.derivative(q[link.q_indices], v[link.v_indices])
    return ca.sparsify(result)


def integrate(robot: Robot, q: ca.SX, dv: ca.SX) -> ca.SX:
    """Return the configuration reached from q by moving for one second with the constant velocity dv.

        q ⊕ dv = q ∘ exp(dv)

    joint by joint, with the exponential of SO(2), SO(3), SE(2) or SE(3). Values and derivatives of every order are
    finite and accurate at and around dv = 0. Unit quaternions and unit (cos, sin) pairs stay so up to rounding; the
    sign of a quaternion follows the motion, where Pinocchio may flip it for turns of a free flyer by more than π.

    Args:
        robot: the robot.
        q: configuration, shape (nq, 1).
        dv: tangent vector at q, shape (nv, 1), m and rad.

    Returns:
        shape (nq, 1).

    Raises:
        DimensionError: if q or dv has the wrong shape.

    Source: Solà, Deray, Atchuthan, A micro Lie theory for state estimation in robotics (2018), appendices A, B, C, D.
    """
    q, dv = column("q", q, robot.model.nq), column("dv", dv, robot.model.nv)
    result = ca.SX(robot.model.nq, 1)
    for link in robot.tree.links:
        if not link.mimics:
            result[link.q_indices] = link.joint.integrate(q[link.q_indices], dv[link.v_indices])
    return result


def difference(robot: Robot, q0: ca.SX, q1: ca.SX) -> ca.SX:
    """Return the tangent vector that leads from q0 to q1, the short way round.

        q1 ⊖ q0 = log(q0⁻¹ ∘ q1),   so that   q0 ⊕ (q1 ⊖ q0) = q1

    Values and derivatives are finite and accurate at and around q0 = q1; rotations by π are where it jumps.

    Args:
        robot: the robot.
        q0, q1: configurations, shape (nq, 1).

    Returns:
        shape (nv, 1), m and rad.

    Raises:
        DimensionError: if q0 or q1 has the wrong shape.

    Source: Solà, Deray, Atchuthan, A micro Lie theory for state estimation in robotics (2018), appendices A, B, C, D.
    """
    q0, q1 = column("q0", q0, robot.model.nq), column("q1", q1, robot.model.nq)
    result = ca.SX(robot.model.nv, 1)
    for link in robot.tree.links:
        if not link.mimics:
            result[link.v_indices] = link.joint.difference(q0[link.q_indices], q1[link.q_indices])
    return result
