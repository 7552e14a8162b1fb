"""Impacts with restitution: closed forms of bounces, Newton's law, and that no impact ever gains energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.end import Replay
from fesd_robot.replay.impacts import LEAST_REBOUND, impact
from fesd_robot.replay.integrator import replay_motion

from .bodies import GRAVITY, ROD_LENGTH, block, body, disc, rod

ONE = np.array([True])


def ball(restitution: float, friction: float = 0.3) -> NumericPhysics:
    """A point mass of 1 kg that bounces."""
    points = {"foot": (0.0, 0.0)}
    return body(1.0, 1e-3, points, friction=friction, restitution=restitution, coordinates=("x", "z"))


def dropped(restitution: float, height: float, duration: float) -> Replay:
    """Let it fall without anything else."""
    return replay_motion(ball(restitution), np.array([0.0, height]), np.zeros(2), np.zeros(2), duration)


@pytest.mark.parametrize(
    ("height", "restitution", "duration", "impacts", "position", "velocity"),
    [
        (0.8, 1.0, 3.0, 4, 0.53862635070246415, 2.26454211690082138),
        (0.5, 0.9, 2.0, 4, 0.17880625592345556, 0.84540202796172778),
        (1.0, 0.8, 2.0, 3, 0.26074172832705720, -0.16586913583647140),
    ],
)
def test_a_bouncing_ball_is_where_mechanics_says(
    height: float, restitution: float, duration: float, impacts: int, position: float, velocity: float
) -> None:
    """Closed forms with g = 9.81 m/s^2, to 1e-13: nothing adds up from bounce to bounce."""
    result = dropped(restitution, height, duration)
    assert [event.kind for event in result.events] == ["touchdown", "takeoff"] * impacts
    np.testing.assert_allclose(result.configuration, [0, position], atol=1e-13)
    np.testing.assert_allclose(result.velocity, [0, velocity], atol=1e-13)
    assert not result.notes


@pytest.mark.parametrize("restitution", [0.5, 0.9, 0.99])
def test_ever_smaller_bounces_end_in_rest(restitution: float) -> None:
    """The sum of all flights is t (1 + e) / (1 - e); what is left out are those slower than `LEAST_REBOUND`."""
    height = 1e-3 if restitution > 0.9 else 0.5
    falling = math.sqrt(2 * height / GRAVITY)
    rest = falling * (1 + restitution) / (1 - restitution)
    result = dropped(restitution, height, rest + 0.1)
    np.testing.assert_array_equal(result.velocity, 0)
    np.testing.assert_allclose(result.configuration, 0, atol=1e-13)
    last = result.events[-1]
    left_out = 2 * LEAST_REBOUND / (GRAVITY * (1 - restitution))
    assert last.kind == "touchdown"
    assert rest - left_out <= last.time < rest
    assert not result.notes


@pytest.mark.parametrize("friction", [0.05, 0.5])
def test_a_thrown_disc_with_spin_bounces_as_newton_and_coulomb_say(friction: float) -> None:
    """v_z turns to -e v_z; friction stops the rim, or takes mu m (1 + e) |v_z| of the momentum: three bounces."""
    restitution, radius, mass, speed, spin = 0.7, 0.25, 3.0, 1.5, 4.0
    physics = disc(friction, restitution)
    x, vx, w, rising = 0.0, speed, spin, 2.0
    time = 0.0
    for _ in range(3):
        flight = 2 * rising / GRAVITY
        x, time = x + vx * flight, time + flight
        sliding = vx - radius * w
        impulse = math.copysign(min(friction * mass * (1 + restitution) * rising, mass * abs(sliding) / 3), sliding)
        vx, w, rising = vx - impulse / mass, w + impulse * radius / (0.5 * mass * radius**2), restitution * rising
    start = np.array([speed, 2.0, spin])
    result = replay_motion(physics, np.array([0.0, radius, 0.0]), start, np.zeros(3), time + 0.01)
    np.testing.assert_allclose(result.velocity, [vx, rising - GRAVITY * 0.01, w], atol=1e-12)
    np.testing.assert_allclose(result.configuration[0], x + 0.01 * vx, atol=1e-12)


def test_newton_s_law_at_a_rod_unless_its_force_would_gain_energy() -> None:
    """v_n+ = -e v_n wherever that takes work from the contact's force or none; else this work is zero, and less is
    returned: as where a slide stops inside the impact and the rod becomes softer."""
    rng, spent = np.random.default_rng(5), 0
    for _ in range(300):
        angle, friction, restitution = rng.uniform(0.2, 1.4), rng.uniform(0.1, 0.8), rng.uniform(0.3, 1.0)
        physics, q = rod(friction, restitution), np.array([0, ROD_LENGTH / 2 * math.sin(angle), -angle])
        v = rng.normal(size=3) * [2.0, 1.0, 4.0]
        before = physics.contact_jacobian(q) @ v
        if before[0] >= 0:
            v, before = -v, -before
        result = impact(physics, q, v, ONE)
        after = physics.contact_jacobian(q) @ result.velocity
        assert result.finished
        mass = physics.mass_matrix(q)
        assert result.velocity @ mass @ result.velocity <= v @ mass @ v * (1 + 1e-12)
        if abs(after[0] + restitution * before[0]) <= 1e-10:
            continue
        spent += 1
        assert 0 < after[0] < -restitution * before[0]
    assert 0 < spent < 100


@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.3, 1.5])
def test_two_corners_never_gain_energy(friction: float, restitution: float) -> None:
    """M (v+ - v) = J^T P with P in the cones, no corner approaches, and the energy does not rise, whatever the
    velocity; also where one corner rests, or has another restitution."""
    rng, q = np.random.default_rng(2), np.array([0.0, 0.1, 0.0])
    physics = block(friction, restitution=restitution)
    jacobian, mass = physics.contact_jacobian(q), physics.mass_matrix(q)
    for number in range(60):
        v = rng.normal(size=3) * [1.0, 1.0, 5.0]
        if number % 3 == 1:  # the rear corner rests
            v[1] = -0.15 * v[2]
        physics.restitution[1] = rng.uniform(0, 1) if number % 3 == 2 else restitution
        result = impact(physics, q, v, np.array([True, True]))
        assert result.finished
        normal, tangential = result.impulse.T
        assert (normal >= -1e-10).all()
        assert (np.abs(tangential) <= friction * normal + 1e-10).all()
        assert (jacobian[0::2] @ result.velocity >= -1e-9).all()
        np.testing.assert_allclose(mass @ (result.velocity - v), jacobian.T @ result.impulse.ravel(), atol=1e-10)
        assert result.velocity @ mass @ result.velocity <= v @ mass @ v * (1 + 1e-12)


def test_a_block_that_lands_flat_bounces_flat() -> None:
    """Both corners hit at once with the same velocity, and both part with e times it; its energy falls by e^2."""
    result = impact(
        block(0.4, restitution=0.6), np.array([0, 0.1, 0.0]), np.array([0, -2.0, 0]), np.ones(2, dtype=bool)
    )
    np.testing.assert_allclose(result.velocity, [0, 1.2, 0], atol=1e-12)


def test_a_slow_approach_does_not_bounce() -> None:
    """Of a velocity whose rebound would be slower than `LEAST_REBOUND` nothing is returned, of a faster one all of
    e."""
    for approach, wanted in ((1.9 * LEAST_REBOUND, 0.0), (2.1 * LEAST_REBOUND, 1.05 * LEAST_REBOUND)):
        result = impact(ball(0.5), np.zeros(2), np.array([0.0, -approach]), ONE)
        np.testing.assert_allclose(result.velocity, [0.0, wanted], atol=1e-15)


def test_a_chain_of_three_balls_keeps_its_energy_without_loss() -> None:
    """The first one hits two that touch and rest: with e = 1 the hit contact parts as fast as it met, the two go on
    together, and momentum and energy are those before."""
    result = impact_of_three(1.0)
    np.testing.assert_allclose(result, [-1 / 3, 2 / 3, 2 / 3], atol=1e-12)


def impact_of_three(restitution: float) -> np.ndarray:
    """Return the velocities of three discs of 1 kg on a line after the first one has met the others with 1 m/s."""
    physics = _Chain(restitution)
    return impact(physics, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.ones(2, dtype=bool)).velocity  # type: ignore[arg-type]


class _Chain:
    """Three masses on a line; contacts between neighbours, without friction."""

    rows = 2
    impacts_at_once = False

    def __init__(self, restitution: float) -> None:
        self.friction, self.restitution = np.zeros(2), np.full(2, restitution)

    def contact_jacobian(self, q: np.ndarray) -> np.ndarray:
        """J_n and no tangential motion, of both contacts."""
        return np.array([[-1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 0.0]])

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Of 1 kg each."""
        return np.eye(3)
