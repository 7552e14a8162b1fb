"""Flights, slides and impacts of motions in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.plans.contact_outcome import _top, contact_outcomes
from fesd_robot.plans.outcome import ContactOutcome, FrictionUse
from fesd_robot.recovery import ImpactRecord, PhysicalMotion
from fesd_robot.recovery.physics import NumericPhysics

from .motions import FRICTION, GRAVITY, STOP, Hit, Segment, drop, motion_of, stance, tumble

STAND = np.array([0.2, 0.4, 0.0, 0.4])
FALL = np.array([0.0, -GRAVITY, 0.0, 0.0])
REST = np.zeros(4)


def outcome_of(motion: PhysicalMotion, physics: NumericPhysics) -> ContactOutcome:
    """Return what the hopper's foot does."""
    return contact_outcomes(motion, physics, ["foot"])["foot"]


def braking(speed: float, interval: int = 0) -> Segment:
    """Return the foot sliding forwards from a speed to rest."""
    brake = np.array([-FRICTION * GRAVITY, 0.0, 0.0, 0.0])
    return Segment(interval, speed / (FRICTION * GRAVITY), brake, "slip", (1.0, -FRICTION))


@pytest.mark.parametrize(("forwards", "upwards"), [(1.7, 2.0), (-0.6, 3.1), (0.0, 0.4)])
def test_a_throw_flies_as_far_and_as_high_as_its_closed_form(
    forwards: float, upwards: float, physics: NumericPhysics
) -> None:
    """A foot thrown from the ground flies |v_x| t, t = 2 v_z / g, and v_z^2 / 2 g high, wherever its samples lie."""
    time = 2 * upwards / GRAVITY
    parts = [Segment(0, 0.3 * time, FALL), Segment(0, 0.7 * time, FALL), Hit(STOP * upwards)]
    motion = motion_of(STAND, np.array([forwards, upwards, 0, 0]), [*parts, Segment(1, 0.1, REST, "stick")])
    outcome = outcome_of(motion, physics)
    (flight,) = outcome.flights
    assert (flight.start, flight.end) == pytest.approx((0, time), abs=1e-12)
    assert flight.length == pytest.approx(abs(forwards) * time, abs=1e-12)
    assert flight.height == pytest.approx(upwards**2 / (2 * GRAVITY), rel=1e-12)
    assert flight.open_start and not flight.open_end, "it begins the motion, and an impact ends it"
    (impact,) = outcome.impacts
    assert impact.time == pytest.approx(time, abs=1e-12)
    assert impact.normal_impulse == pytest.approx(STOP * upwards, rel=1e-12)
    assert impact.approach_velocity == pytest.approx(upwards, rel=1e-12)


def test_a_flight_between_two_stances_is_whole(physics: NumericPhysics) -> None:
    """A flight that begins at the last sample of a stance is cut neither by the start nor by the end."""
    lift = np.array([0.0, 2.0 / 0.1, 0.0, 0.0])
    parts = [Segment(0, 0.1, lift, "stick"), Segment(1, 0.4, FALL), Segment(2, 0.1, REST, "stick")]
    motion = motion_of(STAND, REST, parts)
    (flight,) = outcome_of(motion, physics).flights
    assert (flight.start, flight.end) == pytest.approx((0.1, 0.5), abs=1e-12)
    assert not flight.open_start and not flight.open_end
    assert flight.height == pytest.approx(0.1 + 2.0**2 / (2 * GRAVITY), rel=1e-12)


def test_a_motion_in_the_air_is_open_at_both_ends(physics: NumericPhysics) -> None:
    """A tumble that never touches is one flight, cut by both ends of the motion; nothing slides or hits."""
    outcome = outcome_of(tumble(), physics)
    (flight,) = outcome.flights
    assert (flight.start, flight.end, flight.open_start, flight.open_end) == (0.0, 0.2, True, True)
    assert outcome.slides == [] and outcome.impacts == []


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_slide_to_a_stop_is_as_long_as_its_closed_form(speed: float, physics: NumericPhysics) -> None:
    """A foot that friction stops slides v^2 / (2 mu g), until v / (mu g), and then sticks."""
    motion = motion_of(STAND, np.array([speed, 0, 0, 0]), [braking(speed), Segment(1, 0.2, REST, "stick")])
    outcome = outcome_of(motion, physics)
    (slide,) = outcome.slides
    assert slide.distance == pytest.approx(speed**2 / (2 * FRICTION * GRAVITY), rel=1e-12)
    assert (slide.start, slide.end) == pytest.approx((0, speed / (FRICTION * GRAVITY)), rel=1e-12)
    assert outcome.flights == [] and outcome.slide_distance == slide.distance


def test_to_and_fro_add_up(physics: NumericPhysics) -> None:
    """Sliding forwards and back to where it began is a distance, though nothing has moved."""
    forth = np.array([-4.0, 0.0, 0.0, 0.0])
    parts = [Segment(k, 0.25, forth, "slip", (1.0, -0.45)) for k in range(2)]
    motion = motion_of(STAND, np.array([1.0, 0, 0, 0]), parts)
    assert motion.configuration[-1, 0] == pytest.approx(STAND[0], abs=1e-15)
    (slide,) = outcome_of(motion, physics).slides
    assert slide.distance == pytest.approx(2 * 1.0**2 / (2 * 4.0), rel=1e-12)


def test_a_foot_that_turns_on_the_spot_does_not_slide(physics: NumericPhysics) -> None:
    """What counts is the velocity of the contact point, not that of the body: leaning over a resting foot is none."""
    lean, rate, length = 0.2, 0.7, 0.4
    q = np.array([-length * np.sin(lean), length * np.cos(lean), lean, length])
    v = np.array([-length * np.cos(lean) * rate, -length * np.sin(lean) * rate, rate, 0.0])
    motion = motion_of(q, v, [Segment(0, 1e-6, REST, "slip", (1.0, 0.0))])
    (slide,) = outcome_of(motion, physics).slides
    assert slide.distance < 1e-12


def test_an_impact_while_sliding_divides_no_slide(physics: NumericPhysics) -> None:
    """A foot that slides on through an impact slides once, and the step before the impact counts."""
    half = np.array([-FRICTION * GRAVITY, 0.0, 0.0, 0.0])
    parts = [Segment(0, 0.1, half, "slip"), Hit(1e-3), Segment(1, 0.1, half, "slip")]
    motion = replace(motion_of(STAND, np.array([2.0, 0, 0, 0]), parts), switches=[])
    outcome = outcome_of(motion, physics)
    (slide,) = outcome.slides
    assert slide.distance == pytest.approx(2.0 * 0.2 - FRICTION * GRAVITY * 0.2**2 / 2, rel=1e-12)
    assert len(outcome.impacts) == 1


def test_a_foot_that_rebounds_flies_twice(physics: NumericPhysics) -> None:
    """A flight ends at its impact, though the foot flies on; where the motion ends right after, nothing is added."""
    begin = np.array([0.0, -1.0, 0.0, 0.0])
    parts = [Segment(0, 0.1, REST), Hit(2 * STOP), Segment(1, 0.1, REST), Hit(STOP)]
    motion = motion_of(STAND + np.array([0, 0.1, 0, 0]), begin, parts)
    outcome = outcome_of(motion, physics)
    assert [(flight.open_start, flight.open_end) for flight in outcome.flights] == [(True, False), (False, False)]
    assert [flight.end for flight in outcome.flights] == pytest.approx([0.1, 0.2], abs=1e-12)
    assert [impact.time for impact in outcome.impacts] == pytest.approx([0.1, 0.2], abs=1e-12)


def test_an_impact_of_others_divides_no_flight(physics: NumericPhysics) -> None:
    """A contact that flies on while another one hits has one flight, open where the motion ends with that impact."""
    motion = tumble()
    after = len(motion.time)
    again = {
        name: np.concatenate([getattr(motion, name), getattr(motion, name)[-1:]])
        for name in ("time", "configuration", "velocity", "mode")
    }
    weight, force = np.append(motion.weight, 0.0), np.concatenate([motion.force, motion.force[-1:]])
    none = np.zeros((1, 2))
    ended = replace(motion, **again, weight=weight, force=force, impacts=[ImpactRecord(after - 1, after, none)])
    (flight,) = outcome_of(ended, physics).flights
    assert flight.open_start and flight.open_end and flight.end == 0.2


def test_the_drop_and_the_stance(physics: NumericPhysics) -> None:
    """The published drop flies 0.2 m high for 0.2019 s and hits once; a resting foot does nothing at all."""
    outcome = outcome_of(drop(), physics)
    (flight,), (impact,) = outcome.flights, outcome.impacts
    assert flight.height == pytest.approx(0.2, abs=1e-12) and flight.length == 0
    assert impact.time == pytest.approx(0.20192751093846089, abs=1e-12)
    assert impact.normal_impulse == pytest.approx(0.18158333421141096, rel=1e-6)
    assert impact.approach_velocity == pytest.approx(1.98090888230630134, abs=1e-12)
    assert outcome_of(stance(), physics) == ContactOutcome(sticking=FrictionUse(share=0.0, time=0.0))


def test_how_much_of_its_friction_a_contact_uses(physics: NumericPhysics) -> None:
    """|f_t| / (mu f_n) where it sticks, and of an impulse after which it does; a slide counts as neither."""
    sticking = outcome_of(stance(0.25 * FRICTION), physics).sticking
    assert sticking is not None and sticking.share == pytest.approx(0.25)
    slide = outcome_of(stance(FRICTION, 0.6), physics)
    assert slide.sticking is None and slide.landing is None
    landing = outcome_of(drop(), physics).landing
    assert landing is not None and (landing.share, landing.time) == (0.0, pytest.approx(0.20192751093846089))


def test_numbers_that_are_none_do_no_harm(physics: NumericPhysics) -> None:
    """The outcome of an iterate that holds a NaN says NaN."""
    motion = tumble()
    broken = motion.configuration.copy()
    broken[-1, 0] = np.nan
    (flight,) = outcome_of(replace(motion, configuration=broken), physics).flights
    assert np.isnan(flight.length)


@pytest.mark.parametrize("rates", [(1e-170, -2e-170), (1e-300, -1e-300), (1e-9, -1e-9), (2.0, -1.0)])
def test_the_top_of_a_step_is_no_lower_than_its_ends(rates: tuple[float, float]) -> None:
    """However slowly a foot rises and falls, the top of its flight is a number, and that of a parabola is exact."""
    top = _top(0.1, (0.0, 0.0), rates)
    assert 0.0 <= top <= 0.1 * max(rates)
    if rates[0] == -rates[1] and rates[0] > 1e-100:
        assert top == pytest.approx(rates[0] * 0.1 / 4, rel=1e-12)
