"""Contact modes against closed forms: corners of a block, a sliding rod."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.dynamics import ContactDynamics, contact_dynamics
from fesd_robot.replay.mode_motion import ModeMotion
from fesd_robot.replay.modes import is_proper, motion_in_modes, rated_modes

from .bodies import GRAVITY, ROD_LENGTH, block, body, disc, point, rod

BOTH = np.array([True, True])
ONE = np.array([True])
WEIGHT = 2.0 * GRAVITY


def dynamics_of(physics: NumericPhysics, q: list[float], v: list[float], u: list[float]) -> ContactDynamics:
    return contact_dynamics(physics, np.array(q), np.array(v), np.array(u))


def pushed_block(push: float, friction: float = 0.4, speed: float = 0.0) -> ContactDynamics:
    """The block on level ground, pushed along x at its centre."""
    return dynamics_of(block(friction), [0, 0.1, 0], [speed, 0, 0], [push, 0, 0])


def _admissible(dynamics: ContactDynamics, closed: np.ndarray) -> list[ModeMotion]:
    return [choice for choice in rated_modes(dynamics, closed) if choice.admissible]


def test_a_sliding_block_leans_on_its_front_corner() -> None:
    """Friction at height h below the centre shifts f_n by mu m g h / L, and decelerates by mu g."""
    a, force = motion_in_modes(pushed_block(0.0, speed=1.0), (ContactMode.SLIP_FORWARDS,) * 2)
    shift = 0.4 * WEIGHT * 0.1 / 0.3
    np.testing.assert_allclose(a, [-0.4 * GRAVITY, 0, 0], atol=1e-12)
    np.testing.assert_allclose(force[:, 0], [WEIGHT / 2 - shift, WEIGHT / 2 + shift], atol=1e-11)
    np.testing.assert_allclose(force[:, 1], -0.4 * force[:, 0], atol=1e-12)


@pytest.mark.parametrize("part", [0.0, 0.8, 0.99, 1.01, 1.5])
def test_a_block_sticks_up_to_the_limit_of_both_corners_together(part: float) -> None:
    """It sticks if and only if the push is at most mu m g, though equal shares would leave the rear corner's cone."""
    best = _admissible(pushed_block(part * 0.4 * WEIGHT), BOTH)[0]
    assert best.modes == ((ContactMode.STICK if part < 1 else ContactMode.SLIP_FORWARDS),) * 2
    assert best.proper
    np.testing.assert_allclose(best.acceleration[0], max(0.0, (part - 1) * 0.4 * GRAVITY), atol=1e-10)
    assert (np.abs(best.force[:, 1]) <= 0.4 * best.force[:, 0] + 1e-10).all()
    assert best.force.sum(axis=0) == pytest.approx([WEIGHT, -min(part, 1.0) * 0.4 * WEIGHT], abs=1e-10)


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_block_tips_over_its_front_corner(part: float) -> None:
    """With much friction the rear corner lifts where the push times the height exceeds m g L / 2."""
    push = part * WEIGHT * 0.15 / 0.1
    choices = _admissible(pushed_block(push, friction=3.0), BOTH)
    tips = (ContactMode.FLIGHT, ContactMode.STICK)
    assert choices[0].modes == ((ContactMode.STICK, ContactMode.STICK) if part < 1 else tips)
    around_corner = 0.0217 + 2.0 * (0.15**2 + 0.1**2)
    expected = max(0.0, push * 0.1 - WEIGHT * 0.15) / around_corner
    assert choices[0].acceleration[2] == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_a_slope_steeper_than_the_cone_makes_a_point_slip(slope: float) -> None:
    """Along the slope a = -g (sin - mu cos) where tan > mu, else none."""
    physics = point(0.5, slope)
    (best,) = _admissible(dynamics_of(physics, [0, 0], [0, 0], [0, 0]), ONE)
    slides = math.tan(slope) > 0.5
    assert best.modes == ((ContactMode.SLIP_BACKWARDS if slides else ContactMode.STICK),)
    along = best.acceleration @ [math.cos(slope), math.sin(slope)]
    assert along == pytest.approx(-GRAVITY * (math.sin(slope) - 0.5 * math.cos(slope)) if slides else 0.0, abs=1e-12)


def test_a_contact_that_is_pulled_off_flies() -> None:
    """A pull of more than the weight leaves flight as the only mode."""
    (best,) = _admissible(dynamics_of(point(0.5), [0, 0], [0, 0], [0, 1.2 * GRAVITY]), ONE)
    assert best.modes == (ContactMode.FLIGHT,)
    np.testing.assert_allclose(best.acceleration, [0, 0.2 * GRAVITY], atol=1e-12)


def test_a_rolling_disc_keeps_its_curved_contact_closed() -> None:
    """A disc that rolls at constant speed needs the weight and no friction: dJ/dt v is right on its rim."""
    (best,) = _admissible(dynamics_of(disc(0.3), [0, 0.25, 0.7], [2.0, 0, 8.0], [0, 0, 0]), ONE)
    assert best.modes == (ContactMode.STICK,)
    np.testing.assert_allclose(best.acceleration, 0, atol=1e-9)
    np.testing.assert_allclose(best.force, [[3 * GRAVITY, 0]], atol=1e-9)


def test_the_tip_of_a_turning_rod_is_accelerated_towards_its_centre() -> None:
    """d/dt(J) v of a point at distance l from the centre is l omega^2 towards it."""
    angle, omega = 0.8, 3.0
    dynamics = dynamics_of(rod(0.5), [0, 0.5, angle], [0, 0, omega], [0, 0, 0])
    arm = np.array([math.cos(angle), -math.sin(angle)]) * ROD_LENGTH / 2 * omega**2
    np.testing.assert_allclose(dynamics.free, [arm[1] - GRAVITY, arm[0]], atol=1e-8)


def rod_dynamics(friction: float, angle: float, speed: float, omega: float = 0.0) -> ContactDynamics:
    """The rod with its tip on the ground and its centre above and towards +x of it; the tip slides at `speed`."""
    physics, q = rod(friction), np.array([0.0, ROD_LENGTH / 2 * math.sin(angle), -angle])
    upwards, along = physics.contact_jacobian(q) @ np.array([0.0, 0.0, omega])
    return contact_dynamics(physics, q, np.array([speed - along, -upwards, omega]), np.zeros(3))


@pytest.mark.parametrize("friction", [1.0, 1.3, 1.4, 2.0])
def test_a_rod_that_slides_in_the_sense_of_painleve_is_not_proper(friction: float) -> None:
    """m (W_nn - mu s W_nt) = 1 + 3 cos^2 + 3 mu s sin cos decides: negative only where the tip leads, and mu > 4/3."""
    angles = np.linspace(0.05, 1.5, 60)
    found = {1: 0, -1: 0}
    for angle in angles:
        for sign, mode in ((1, ContactMode.SLIP_FORWARDS), (-1, ContactMode.SLIP_BACKWARDS)):
            dynamics = rod_dynamics(friction, angle, float(sign))
            proper = is_proper(dynamics, (mode,))
            cos, sin = math.cos(angle), math.sin(angle)
            expected = 1 + 3 * cos**2 + 3 * friction * sign * sin * cos
            assert proper == (expected > 0)
            found[sign] += not proper
    assert found[1] == 0
    assert (found[-1] > 0) == (friction > 4 / 3)


def test_a_rod_in_paradox_has_no_mode_or_a_proper_flight_and_an_improper_slip() -> None:
    """Without rotation no mode is admissible (inconsistent); turning fast, flight and an improper slip (indeterminate).

    So flight comes first wherever a slip is improper: of one contact, improper modes are never the only ones.
    """
    for omega in np.linspace(0.0, 8.0, 17):
        dynamics = rod_dynamics(2.0, 1.1, -1.0, omega)
        choices = _admissible(dynamics, ONE)
        lifts = ROD_LENGTH / 2 * omega**2 * math.sin(1.1) > GRAVITY
        assert [choice.modes for choice in choices] == (
            [(ContactMode.FLIGHT,), (ContactMode.SLIP_BACKWARDS,)] if lifts else []
        )
        assert [choice.proper for choice in choices] == ([True, False] if lifts else [])


def test_modes_of_random_states_obey_the_law() -> None:
    """Every admissible motion has complementary gaps, forces in the cones, and friction against sliding."""
    rng = np.random.default_rng(5)
    physics, some = block(0.6), 0
    for _ in range(40):
        v = np.array([rng.choice([0.0, 0.5, -0.5]), 0.0, 0.0])
        u = rng.normal(size=3) * [15, 15, 2]
        dynamics = contact_dynamics(physics, np.array([0.3, 0.1, 0.0]), v, u)
        for choice in _admissible(dynamics, BOTH):
            some += 1
            following = dynamics.jacobian @ choice.acceleration
            normal, tangential = choice.force.T
            assert (normal >= -1e-7).all()
            assert (following[0::2] >= -1e-7).all()
            assert np.abs(normal * following[0::2]).max() < 1e-6
            assert (np.abs(tangential) <= 0.6 * normal + 1e-6).all()
            sliding = dynamics.velocity[1::2] + 1e-3 * following[1::2]
            assert (sliding * tangential <= 1e-6).all()
            needed = physics.required_force(np.array([0.3, 0.1, 0.0]), v, choice.acceleration, u)
            np.testing.assert_allclose(dynamics.jacobian.T @ choice.force.ravel(), needed, atol=1e-8)
    assert some >= 40


def test_open_contacts_stay_open() -> None:
    """Contacts that are not closed are in flight in every choice, and a contact without friction has one slip."""
    dynamics = pushed_block(1.0, friction=0.0)
    choices = rated_modes(dynamics, np.array([True, False]))
    assert {choice.modes for choice in choices} == {
        (ContactMode.SLIP, ContactMode.FLIGHT),
        (ContactMode.FLIGHT, ContactMode.FLIGHT),
    }


def test_four_points_on_a_line_share_a_load_that_pulls_at_none() -> None:
    """Redundant normal forces are found non-negative where they can be: the block may stand on more than two points."""
    points = {"a": (-0.15, -0.1), "b": (-0.05, -0.1), "c": (0.05, -0.1), "d": (0.15, -0.1)}
    physics = body(2.0, 0.0217, points, friction=0.4)
    torque = 0.9 * WEIGHT * 0.15
    best = _admissible(dynamics_of(physics, [0, 0.1, 0], [0, 0, 0], [0, 0, torque]), np.full(4, True))[0]
    np.testing.assert_allclose(best.acceleration, 0, atol=1e-9)
    assert best.force[:, 0].min() >= -1e-9
