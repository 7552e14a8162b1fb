"""The monoped is the published one: mass matrix, forces and foot against an independent derivation by Lagrange."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.robot import Robot, frame_jacobian, frame_placement, load_robot, mass_matrix, nonlinear_effects

MODEL = Path(__file__).parents[2] / "models/monoped/monoped.urdf"

Q, V = ca.SX.sym("q", 4), ca.SX.sym("v", 4)
CONFIGURATION, VELOCITY = [0.3, 0.45, 0.4, -0.7], [0.5, -0.2, 1.1, -0.9]
STANDING = [0, 0.4, 0, 0]

# Values of the Lagrangian of a point hip and two links, and of the published model's own functions (arXiv 2111.06759).
MASS = [
    [6.305, 0.0, -0.1795620156078097, -0.05235243960408322],
    [0.0, 6.305, 0.037588838767890945, -0.016194507325041407],
    [-0.1795620156078097, 0.037588838767890945, 0.048821532745276, 0.017062670372638],
    [-0.05235243960408322, -0.016194507325041407, 0.017062670372638, 0.008680000000000002],
]
STANDING_MASS = [
    [6.305, 0.0, -0.19291200000000006, -0.05480000000000001],
    [0.0, 6.305, 0.0, 0.0],
    [-0.19291200000000006, 0.0, 0.05397619200000003, 0.019640000000000008],
    [-0.05480000000000001, 0.0, 0.019640000000000008, 0.008680000000000002],
]
FORCES = [-0.0644300684794465, -62.00806768454868, -0.3604855760660237, 0.16741147413972757]
FOOT = [0.2812203728705378, 0.07472050337430175]
NORMAL = [0, 1, 0.018779627129462212, -0.059104041332267904]
TANGENT = [1, 0, -0.37527949662569826, -0.19106729782512122]


@pytest.fixture(scope="module")
def monoped() -> Robot:
    return load_robot(MODEL)


def _at(expression: ca.SX, q: list[float] = CONFIGURATION) -> np.ndarray:
    return np.asarray(ca.Function("f", [Q, V], [ca.densify(expression)])(q, VELOCITY).full())


def test_mass_matrix(monoped: Robot) -> None:
    """M(q) is the published one to round-off, bent and standing."""
    mass = mass_matrix(monoped, Q)
    np.testing.assert_allclose(_at(mass), MASS, rtol=0, atol=1e-12)
    np.testing.assert_allclose(_at(mass, STANDING), STANDING_MASS, rtol=0, atol=1e-12)


def test_forces(monoped: Robot) -> None:
    """-h(q, v) = -C v - grad U is the published one to round-off."""
    np.testing.assert_allclose(-_at(nonlinear_effects(monoped, Q, V)).ravel(), FORCES, rtol=0, atol=1e-12)


def test_foot(monoped: Robot) -> None:
    """Place and Jacobian of the foot are the published ones to round-off."""
    _, position = frame_placement(monoped, Q, "foot")
    jacobian = _at(frame_jacobian(monoped, Q, "foot"))
    np.testing.assert_allclose(_at(position).ravel()[[0, 2]], FOOT, rtol=0, atol=1e-12)
    np.testing.assert_allclose(jacobian[[2, 0]], [NORMAL, TANGENT], rtol=0, atol=1e-12)


def test_contact_inertia(monoped: Robot) -> None:
    """Delassus' matrix J M^-1 J' of normal and tangent is the published one."""
    J, M = np.array([NORMAL, TANGENT]), _at(mass_matrix(monoped, Q))
    expected = [[1.6243751757030842, 1.2796519165579077], [1.2796519165579077, 4.230638023574492]]
    np.testing.assert_allclose(J @ np.linalg.solve(M, J.T), expected, rtol=1e-12)
    n, standing = np.array([0, 1, 0, 0]), _at(mass_matrix(monoped, Q), STANDING)
    assert n @ np.linalg.solve(standing, n) == pytest.approx(0.15860428231562254, rel=1e-12)
