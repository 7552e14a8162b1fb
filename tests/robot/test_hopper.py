"""The hopper's expressions are the ones written by hand, structure included."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.robot import (
    configuration_derivative,
    frame_jacobian,
    frame_placement,
    frame_velocity,
    kinetic_energy,
    mass_matrix,
    nonlinear_effects,
    rnea,
)

Q, V, A = ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("a", 4)
POINT = np.array([0.3, 0.9, 0.4, 0.35])


def _at(expression: ca.SX) -> np.ndarray:
    return ca.Function("f", [Q, V], [expression])(POINT, [1.0, 2.0, 3.0, 4.0]).full()


def test_names_and_limits(hopper):
    """Coordinates and limits carry the names and numbers of the file."""
    assert hopper.configuration_names == hopper.velocity_names == ["root_x", "root_z", "root_pitch", "leg"]
    assert hopper.lower_position.tolist() == pytest.approx([-100.0, 0.0, -np.pi, 0.1])
    assert hopper.upper_position.tolist() == pytest.approx([100.0, 1.5, np.pi, 0.5])
    assert hopper.velocity_limit.tolist() == [10.0, 10.0, 5.0, 5.0]
    assert hopper.upper_effort.tolist() == [0.0, 0.0, 50.0, 100.0]


def test_mass_matrix_is_constant_and_diagonal(hopper):
    """M = diag(1.1, 1.1, 0.275, 0.1) with structural zeros."""
    mass = mass_matrix(hopper, Q)
    assert mass.is_constant()
    assert mass.sparsity().is_diag()
    assert np.array_equal(ca.evalf(mass).full(), np.diag([1.1, 1.1, 0.275, 0.1]))


def test_nonlinear_effects_are_the_weight(hopper):
    """h = (0, m g, 0, 0), a constant."""
    effects = nonlinear_effects(hopper, Q, V)
    assert effects.is_constant()
    assert ca.evalf(effects).full().ravel() == pytest.approx([0.0, 1.1 * 9.81, 0.0, 0.0])


def test_inverse_dynamics_are_linear(hopper):
    """τ = M a + h has no second derivative and needs no sine."""
    tau = rnea(hopper, Q, V, A)
    assert ca.hessian(ca.dot(ca.SX.sym("l", 4), tau), ca.vertcat(Q, V, A))[0].nnz() == 0
    assert not ca.depends_on(tau, ca.vertcat(Q, V))


def test_kinetic_energy_is_a_sum_of_squares(hopper):
    """T = ½ vᵀ M v without the configuration."""
    energy = kinetic_energy(hopper, Q, V)
    assert not ca.depends_on(energy, Q)
    assert _at(energy).item() == pytest.approx(0.5 * (1.1 * 1 + 1.1 * 4 + 0.275 * 9 + 0.1 * 16))


def test_foot_position(hopper):
    """The foot is at (x + r sin θ, 0, z − r cos θ)."""
    _, position = frame_placement(hopper, Q, "foot")
    x, z, pitch, leg = POINT
    assert _at(position).ravel() == pytest.approx([x + leg * np.sin(pitch), 0.0, z - leg * np.cos(pitch)])
    assert not position.sparsity().has_nz(1, 0)


def test_foot_velocity_stays_in_the_plane(hopper):
    """The y component of the foot's velocity is a structural zero, and x, z do not enter."""
    linear, angular = frame_velocity(hopper, Q, V, "foot")
    assert not linear.sparsity().has_nz(1, 0)
    assert not ca.depends_on(linear, Q[:2])
    assert angular.sparsity().row() == [1]


def test_foot_jacobian(hopper):
    """J_n = (0, 1, r sin θ, −cos θ) and J_t = (1, 0, r cos θ, sin θ)."""
    jacobian = frame_jacobian(hopper, Q, "foot")
    _, _, pitch, leg = POINT
    assert _at(jacobian)[2] == pytest.approx([0.0, 1.0, leg * np.sin(pitch), -np.cos(pitch)])
    assert _at(jacobian)[0] == pytest.approx([1.0, 0.0, leg * np.cos(pitch), np.sin(pitch)])
    assert jacobian.nnz() == 7


def test_foot_velocity_is_the_derivative_of_its_position(hopper):
    """d/dt p(q) = J v for every v."""
    _, position = frame_placement(hopper, Q, "foot")
    linear, _ = frame_velocity(hopper, Q, V, "foot")
    rate = ca.jtimes(position, Q, configuration_derivative(hopper, Q, V))
    assert _at(rate) == pytest.approx(_at(linear))
