"""The impact law against closed forms, and against itself in small steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.impacts import impact

from .bodies import ROD_LENGTH, block, body, disc, point, rod

ONE = np.array([True])


@pytest.mark.parametrize("speed", [-3.0, -0.5, 0.0, 0.5, 3.0])
def test_a_point_loses_at_most_mu_times_its_normal_velocity(speed: float) -> None:
    """v_n+ = 0 and |v_t+| = max(0, |v_t| - mu |v_n|)."""
    result = impact(point(0.4), np.zeros(2), np.array([speed, -2.0]), ONE)
    kept = math.copysign(max(0.0, abs(speed) - 0.4 * 2.0), speed)
    np.testing.assert_allclose(result.velocity, [kept, 0], atol=1e-12)
    np.testing.assert_allclose(result.impulse, [[2.0, kept - speed]], atol=1e-12)
    assert result.finished


@pytest.mark.parametrize("friction", [0.05, 0.5])
def test_a_dropped_disc_begins_to_roll(friction: float) -> None:
    """Friction stops the rim after P_t = m v / 3, if mu m v_n allows as much."""
    result = impact(disc(friction), np.array([0, 0.25, 0.0]), np.array([1.5, -2.0, 0.0]), ONE)
    tangential = min(friction * 3.0 * 2.0, 3.0 * 1.5 / 3)
    np.testing.assert_allclose(result.impulse, [[6.0, -tangential]], atol=1e-12)
    np.testing.assert_allclose(result.velocity[:2], [1.5 - tangential / 3.0, 0], atol=1e-12)
    assert result.velocity[2] * 0.25 == pytest.approx(tangential * 0.25**2 / (0.5 * 3 * 0.25**2), abs=1e-12)


def test_contacts_that_part_are_left_alone() -> None:
    """Nothing happens to a point that already rises."""
    result = impact(point(0.4), np.zeros(2), np.array([1.0, 0.3]), ONE)
    np.testing.assert_array_equal(result.velocity, [1.0, 0.3])
    np.testing.assert_array_equal(result.impulse, 0)


@pytest.mark.parametrize("inertia", [0.02, 0.09])
def test_a_resting_corner_holds_or_parts(inertia: float) -> None:
    """A plank that comes down on its front end with its rear at rest: the rear parts if and only if I > m l^2.

    Else the centre of percussion is this side of it, and it is pressed to the ground.
    """
    points = {"rear": (-0.15, 0.0), "front": (0.15, 0.0)}
    physics, q = body(2.0, inertia, points, friction=0.0), np.zeros(3)
    v = np.array([0, -0.15, 1.0])
    jacobian = physics.contact_jacobian(q)
    np.testing.assert_allclose(jacobian[0::2] @ v, [0, -0.3], atol=1e-12)
    result = impact(physics, q, v, np.array([True, True]))
    rear, front = jacobian[0::2] @ result.velocity
    coupling, own = 1 / 2.0 - 0.15**2 / inertia, 1 / 2.0 + 0.15**2 / inertia
    assert front == pytest.approx(0, abs=1e-12)
    assert rear == pytest.approx(max(0.0, coupling * 0.3 / own), abs=1e-12)
    assert (result.impulse[0, 0] > 0) == (inertia < 2.0 * 0.15**2)


def _in_small_steps(physics: NumericPhysics, q: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
    """One contact pushes with -mu v_t / (|v_t| + small) until it no longer approaches."""
    jacobian, (mu,) = physics.contact_jacobian(q), physics.friction
    response = np.linalg.solve(physics.mass_matrix(q), jacobian.T)
    while (normal := jacobian[0] @ v) < -1e-12:
        speed = jacobian[1] @ v
        rate = response @ [1.0, -mu * speed / (abs(speed) + 6 * step)]
        v = v + min(step, -normal / max(jacobian[0] @ rate, 1e-3)) * rate
    return v


@pytest.mark.slow
def test_a_rod_that_sticks_or_reverses_within_the_impact() -> None:
    """Any friction below the paradox, angle and velocity: the law in small steps leads to the same velocity."""
    rng, stopped = np.random.default_rng(11), 0
    for _ in range(20):
        angle, friction = rng.uniform(0.2, 1.4), rng.uniform(0.1, 0.8)
        physics, q = rod(friction), np.array([0, ROD_LENGTH / 2 * math.sin(angle), -angle])
        v = rng.normal(size=3) * [0.2, 1.0, 1.0]
        if physics.contact_jacobian(q)[0] @ v >= 0:
            v = -v
        result = impact(physics, q, v, ONE)
        stopped += abs(physics.contact_jacobian(q)[1] @ result.velocity) < 1e-9
        np.testing.assert_allclose(result.velocity, _in_small_steps(physics, q, v, 3e-5), atol=1e-2)
    assert 0 < stopped < 20


def test_two_corners_obey_the_law_and_lose_energy() -> None:
    """M (v+ - v) = J^T P with P in the cones, no corner approaches, and no energy is gained, whatever the velocity."""
    rng, q = np.random.default_rng(2), np.array([0.0, 0.1, 0.0])
    for friction in (0.0, 0.3, 1.5):
        physics = block(friction)
        jacobian, mass = physics.contact_jacobian(q), physics.mass_matrix(q)
        for _ in range(60):
            v = rng.normal(size=3) * [1.0, 1.0, 5.0]
            result = impact(physics, q, v, np.array([True, True]))
            assert result.finished
            normal, tangential = result.impulse.T
            assert (normal >= -1e-10).all()
            assert (np.abs(tangential) <= friction * normal + 1e-10).all()
            assert (jacobian[0::2] @ result.velocity >= -1e-9).all()
            np.testing.assert_allclose(mass @ (result.velocity - v), jacobian.T @ result.impulse.ravel(), atol=1e-10)
            assert result.velocity @ mass @ result.velocity <= v @ mass @ v + 1e-10
