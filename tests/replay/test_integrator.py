"""Replayed motions against closed forms to 1e-9."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.special import ellipk

from fesd_robot.contact import Scene
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay import Budget
from fesd_robot.replay.contacts import ReplayNote
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.robot import load_robot

from .bodies import GRAVITY, block, body, disc, point, rod

NOTHING = np.zeros(3)


def test_a_block_slides_to_a_stop() -> None:
    """It stops after v / (mu g), having gone v^2 / (2 mu g), and stays there."""
    result = replay_motion(block(0.4), np.array([0, 0.1, 0.0]), np.array([1.0, 0, 0]), NOTHING, 0.5)
    stop = 1.0 / (0.4 * GRAVITY)
    np.testing.assert_allclose(result.configuration, [stop / 2, 0.1, 0], atol=1e-9)
    np.testing.assert_allclose(result.velocity, 0, atol=1e-9)
    assert {(event.contact, event.kind) for event in result.events} == {(0, "slip_to_stick"), (1, "slip_to_stick")}
    np.testing.assert_allclose([event.time for event in result.events], stop, atol=1e-8)
    assert not result.notes


def test_a_slipping_disc_begins_to_roll() -> None:
    """A solid disc that slides with v rolls after v / (3 mu g) with 2 v / 3."""
    result = replay_motion(disc(0.3), np.array([0, 0.25, 0.0]), np.array([1.2, 0, 0]), NOTHING, 0.3, start=2.0)
    begin = 1.2 / (3 * 0.3 * GRAVITY)
    travelled = 1.2 * begin - 0.5 * 0.3 * GRAVITY * begin**2 + 0.8 * (0.3 - begin)
    np.testing.assert_allclose(result.velocity, [0.8, 0, 0.8 / 0.25], atol=1e-9)
    np.testing.assert_allclose(result.configuration[:2], [travelled, 0.25], atol=1e-9)
    (event,) = result.events
    assert (event.kind, event.time) == ("slip_to_stick", pytest.approx(2.0 + begin, abs=1e-8))


def test_a_point_that_slides_up_a_slope_stops_and_comes_back() -> None:
    """Up with -g (sin + mu cos), down with -g (sin - mu cos): one reversal of the slip."""
    slope, mu, speed, duration = 0.5, 0.2, 0.9, 0.4
    along = np.array([math.cos(slope), math.sin(slope)])
    result = replay_motion(point(mu, slope), np.zeros(2), speed * along, np.zeros(2), duration)
    up, down = (GRAVITY * (math.sin(slope) + sign * mu * math.cos(slope)) for sign in (1, -1))
    turn = speed / up
    place = speed**2 / (2 * up) - 0.5 * down * (duration - turn) ** 2
    np.testing.assert_allclose(result.configuration, place * along, atol=1e-9)
    np.testing.assert_allclose(result.velocity, -down * (duration - turn) * along, atol=1e-9)
    assert [(event.kind, round(event.time, 8)) for event in result.events] == [("slip_reversal", round(turn, 8))]


@pytest.mark.parametrize("speed", [0.3, 3.0])
def test_a_point_falls_and_goes_on_along_the_ground(speed: float) -> None:
    """It lands after sqrt(2 h / g) without bounce, and friction takes mu |v_n|, then mu g of its velocity."""
    height, mu, duration = 0.2, 0.4, 0.3
    result = replay_motion(point(mu), np.array([0, height]), np.array([speed, 0]), np.zeros(2), duration)
    landing = math.sqrt(2 * height / GRAVITY)
    kept = max(0.0, speed - mu * GRAVITY * landing)
    left = duration - landing
    assert speed == 0.3 or kept > mu * GRAVITY * left
    braking = mu * GRAVITY if kept else 0.0
    x = speed * landing + kept * left - 0.5 * braking * left**2
    np.testing.assert_allclose(result.configuration, [x, 0], atol=1e-9)
    np.testing.assert_allclose(result.velocity, [kept - braking * left, 0], atol=1e-9)
    (event,) = result.events
    assert (event.kind, event.time) == ("touchdown", pytest.approx(landing, abs=1e-9))


@pytest.mark.parametrize("tilt", [0.0, 1e-9, -2e-8])
def test_feet_that_land_at_once_take_one_impact(tilt: float) -> None:
    """A body with a large inertia about two feet side by side stops dead when both land within 1e-8 m; one after the
    other, the second would throw the first up again."""
    physics = body(1.0, 1.0, {"left": (-0.1, 0.0), "right": (0.1, 0.0)}, friction=0.4)
    result = replay_motion(physics, np.array([0, 0.1, tilt]), np.zeros(3), NOTHING, 0.2)
    landing = math.sqrt(2 * 0.1 / GRAVITY)
    assert [event.kind for event in result.events] == ["touchdown", "touchdown"]
    np.testing.assert_allclose([event.time for event in result.events], landing, atol=1e-8)
    np.testing.assert_allclose(result.velocity, 0, atol=1e-9)
    np.testing.assert_allclose(result.configuration, [0, 0, tilt], atol=1e-8)


@pytest.mark.parametrize("miss", [-1e-6, -1e-10, 0.0, 1e-10, 1e-6])
def test_a_touchdown_at_the_very_end_is_before_or_after(miss: float) -> None:
    """Landing at the end of the replay breaks nothing: the velocity is that before or that after the impact."""
    height = 0.5 * GRAVITY * (0.1 + miss) ** 2
    result = replay_motion(point(0.4), np.array([0, height]), np.zeros(2), np.zeros(2), 0.1)
    assert min(abs(result.velocity[1] + GRAVITY * 0.1), abs(result.velocity[1])) < 1e-9
    assert abs(result.configuration[1]) < 1e-5
    assert not result.notes


def test_a_pendulum_swings_through_in_a_quarter_of_its_period(tmp_path: Path) -> None:
    """T = 4 K(sin^2(theta / 2)) sqrt(I / (m g l)), and its speed there is that of the energy."""
    file, angle, length, inertia = tmp_path / "pendulum.urdf", 1.0, 0.6, 0.12
    file.write_text(
        "<robot name='pendulum'><link name='world'/><link name='bar'><inertial><origin xyz='0 0 -0.6' rpy='0 0 0'/>"
        "<mass value='1'/><inertia ixx='0.12' iyy='0.12' izz='0.12' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='hinge' type='revolute'><parent link='world'/><child link='bar'/><axis xyz='0 1 0'/>"
        "<limit lower='-9' upper='9' velocity='99' effort='1'/></joint></robot>",
        encoding="utf-8",
    )
    physics = NumericPhysics(load_robot(file), Scene({}, {}), {}, lambda _: np.zeros((1, 0)))
    omega_squared = GRAVITY * length / (inertia + length**2)
    quarter = ellipk(math.sin(angle / 2) ** 2) / math.sqrt(omega_squared)
    result = replay_motion(physics, np.array([angle]), np.zeros(1), np.zeros(0), quarter)
    assert result.configuration[0] == pytest.approx(0, abs=1e-9)
    assert result.velocity[0] == pytest.approx(-math.sqrt(2 * omega_squared * (1 - math.cos(angle))), abs=1e-9)


def test_a_push_lifts_a_closed_contact_at_once() -> None:
    """A pull of 1.5 times the weight makes the point fly from the start: no event, and a parabola upwards."""
    result = replay_motion(point(0.4), np.zeros(2), np.zeros(2), np.array([0, 1.5 * GRAVITY]), 0.1)
    np.testing.assert_allclose(result.configuration, [0, 0.25 * GRAVITY * 0.1**2], atol=1e-12)
    assert result.events == ()


def test_drift_is_taken_out_and_reported() -> None:
    """A block that hovers 5 micrometres high, sinking at 0.5 mm/s, slides there as on the ground."""
    result = replay_motion(block(0.4), np.array([0, 0.100005, 0.0]), np.array([1.0, -5e-4, 0]), NOTHING, 0.1)
    assert result.drift.gap == pytest.approx(5e-6, abs=1e-12)
    assert result.drift.velocity == pytest.approx(5e-4, abs=1e-12)
    assert result.configuration[1] == pytest.approx(0.100005, abs=1e-10)
    assert result.events == ()


@pytest.mark.parametrize("flying", [True, False])
def test_a_point_that_flies_a_little_above_the_ground_lands(flying: bool) -> None:
    """9 micrometres high and rising at 0.4 mm/s it comes down after (v + sqrt(v^2 + 2 g h)) / g; else that is drift."""
    q, v = np.array([0, 9e-6]), np.array([0, 4e-4])
    result = replay_motion(point(0.4), q, v, np.zeros(2), 0.01, flying=np.array([flying]))
    landing = (4e-4 + math.sqrt(16e-8 + 2 * GRAVITY * 9e-6)) / GRAVITY
    assert [event.time for event in result.events] == ([pytest.approx(landing, abs=1e-9)] if flying else [])
    assert result.configuration[1] == pytest.approx(0.0 if flying else 9e-6, abs=1e-9)
    assert result.drift.gap == (0.0 if flying else 9e-6)


def test_a_point_on_the_ground_stays_there_whatever_flies() -> None:
    """On the ground and at rest nothing is in the air."""
    result = replay_motion(point(0.4), np.zeros(2), np.zeros(2), np.zeros(2), 0.1, flying=np.array([True]))
    assert result.events == () and np.abs(result.configuration).max() <= 1e-12


def test_a_contact_that_rises_from_below_the_ground_lands_where_it_started() -> None:
    """Pushed down by its weight it is back after 2 v / g, not sinking on."""
    result = replay_motion(point(0.4), np.array([0, -2e-3]), np.array([0, 0.05]), np.zeros(2), 0.05)
    assert [(event.kind, round(event.time, 8)) for event in result.events] == [("touchdown", round(0.1 / GRAVITY, 8))]
    np.testing.assert_allclose(result.configuration, [0, -2e-3], atol=1e-9)


def test_a_block_that_hardly_rocks_comes_to_rest() -> None:
    """A slender block on one foot, the other 2e-12 m above the ground, stays within 1e-9 m and rad, in a few events."""
    slender = body(1.0, 0.05, {"rear": (-0.02, -0.2), "front": (0.02, -0.2)}, friction=1.0)
    start, flying = np.array([0.0, 0.2, -5e-11]), np.array([False, True])
    assert slender.gaps(start)[1] > 0
    result = replay_motion(slender, start, NOTHING, NOTHING, 0.5, flying=flying)
    assert not result.notes and len(result.events) <= 6
    np.testing.assert_allclose(result.configuration, [0, 0.2, 0], atol=1e-9)
    np.testing.assert_allclose(result.velocity, 0, atol=1e-9)


def test_feet_that_throw_each_other_up_come_to_rest() -> None:
    """A wide body that a force presses onto two feet without friction: each that lands throws the other up with 0.8 of
    its velocity, so the hops end."""
    half, inertia = 0.1, 0.09  # m; kg m^2, for which (1 - half^2 / inertia) / (1 + half^2 / inertia) = 0.8
    wide = body(1.0, inertia, {"rear": (-half, -0.1), "front": (half, -0.1)}, friction=0.0)
    start, flying = np.array([0.0, 0.1, -5e-8]), np.array([False, True])
    result = replay_motion(wide, start, NOTHING, np.array([0, -100.0, 0]), 0.01, flying=flying)
    assert not result.notes and 10 < len(result.events) < 40
    np.testing.assert_allclose(result.configuration, [0, 0.1, 0], atol=1e-7)
    np.testing.assert_allclose(result.velocity, 0, atol=1e-9)


def test_a_foot_that_dips_below_the_ground_inside_a_step_touches_it() -> None:
    """The end of a turning arm would pass 0.02 mm below the ground within 2 ms, while its centre flies as a stone: it
    touches down."""
    arm = body(1.0, 0.01, {"tip": (0.0, -0.1)}, friction=0.0)
    lowest, rate = 0.1, 20.0  # s, rad/s
    height = 0.1 - 2e-5 - 0.5 * GRAVITY * lowest**2
    start, turning = np.array([0.0, height, -rate * lowest]), np.array([0.0, GRAVITY * lowest, rate])
    result = replay_motion(arm, start, turning, NOTHING, 2 * lowest)
    assert [event.kind for event in result.events] == ["touchdown", "takeoff"]
    assert result.events[0].time == pytest.approx(lowest, abs=2e-3)
    assert result.velocity[1] > -GRAVITY * lowest + 1e-3


def test_the_cap_on_events_is_reported() -> None:
    """After the last event that is allowed the motion goes on in its modes, with a note."""
    result = replay_motion(
        point(0.4), np.array([0, 0.05]), np.array([0.5, 0]), np.zeros(2), 0.3, budget=Budget(most_events=1)
    )
    assert ReplayNote.MANY_EVENTS in result.notes


def test_steps_that_become_too_short_end_a_replay() -> None:
    """Where steps run out the state is NaN, with a note, so that nothing passes by it, and nothing takes minutes."""
    result = replay_motion(
        point(0.4), np.array([0, 0.05]), np.array([0.5, 0]), np.zeros(2), 3.0, budget=Budget(most_steps=5)
    )
    assert np.isnan(result.velocity).all() and ReplayNote.MANY_STEPS in result.notes


def test_a_state_that_is_no_number_is_reported() -> None:
    """The replay of a state that is not finite is NaN, with a note, so that nothing passes by it."""
    result = replay_motion(point(0.4), np.array([0.0, np.nan]), np.zeros(2), np.zeros(2), 0.1)
    assert np.isnan(result.velocity).all()
    assert result.notes == {ReplayNote.FAILED}


def test_a_rod_in_paradox_is_reported() -> None:
    """A rod whose tip leads in a paradox has no mode: the replay says so, and ends."""
    angle = 1.1
    result = replay_motion(
        rod(2.0), np.array([0, 0.6 * math.sin(angle), -angle]), np.array([-1.0, 0, 0]), NOTHING, 0.01
    )
    assert ReplayNote.NO_MODE in result.notes


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.4, 0.5, 0.6])
def test_a_slide_whose_force_grows_beyond_any_bound_ends_in_an_impact(angle: float) -> None:
    """The force of a slender rod that slides with its tip in front, mu = 2, grows without bound towards the angle at
    which 1 + 3 cos(a) (cos(a) - mu sin(a)) = 0 (Genot and Brogliato): there an impact without a collision ends the
    slide, it takes energy, the tip parts, and the motion goes on."""
    physics, q = rod(2.0), np.array([0, 0.6 * math.sin(angle), -angle])
    v = np.array([0.0, 0.0, -4.0])
    normal, along = physics.contact_jacobian(q) @ v
    v[:2] = -3.0 - along, -normal
    result = replay_motion(physics, q, v, NOTHING, 0.3)
    assert result.notes == {ReplayNote.NO_MODE} and np.isfinite(result.velocity).all()
    (event,) = result.events
    assert event.kind == "takeoff"
    before = replay_motion(physics, q, v, NOTHING, event.time - 1e-7)
    lean = -before.configuration[2]
    assert 1 + 3 * math.cos(lean) * (math.cos(lean) - 2 * math.sin(lean)) == pytest.approx(0.0, abs=1e-3)
    after = replay_motion(physics, q, v, NOTHING, event.time + 1e-7)

    def energy(v: np.ndarray) -> float:
        return 0.5 * float(v @ physics.mass_matrix(q) @ v)

    assert energy(after.velocity) < 0.999 * energy(before.velocity)
    normal, along = physics.contact_jacobian(after.configuration) @ after.velocity
    assert abs(along) < 1e-4 and abs(normal) < 1e-4
    assert physics.gaps(result.configuration)[0] > 1e-3


def test_a_free_flyer_is_integrated_on_its_manifold(tmp_path: Path) -> None:
    """A symmetric top without torque keeps its angular momentum and precesses: as in the closed form of Euler."""
    file = tmp_path / "top.urdf"
    file.write_text(
        "<robot name='top'><link name='top'><inertial><mass value='1'/>"
        "<inertia ixx='0.2' iyy='0.2' izz='0.3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>",
        encoding="utf-8",
    )
    robot = load_robot(file, root="free_flyer")
    physics = NumericPhysics(robot, Scene({}, {}), {}, lambda _: np.zeros((6, 0)))
    v = np.array([0, 0, 0, 0.6, 0.0, 4.0])
    result = replay_motion(physics, robot.neutral, v, np.zeros(0), 0.3)
    turned = (0.3 - 0.2) / 0.2 * 4.0 * 0.3
    np.testing.assert_allclose(result.velocity[3:], [0.6 * math.cos(turned), 0.6 * math.sin(turned), 4.0], atol=1e-9)
    rotation = pin.Quaternion(result.configuration[3:7]).toRotationMatrix()
    inertia = np.diag([0.2, 0.2, 0.3])
    np.testing.assert_allclose(rotation @ inertia @ result.velocity[3:], inertia @ v[3:], atol=1e-9)
    assert result.configuration[2] == pytest.approx(-0.5 * GRAVITY * 0.3**2, abs=1e-9)
