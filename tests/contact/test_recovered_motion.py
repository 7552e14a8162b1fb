"""The way back to physical time on elements made by hand: impacts, impulses, forces, switches, clock."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from fesd_robot.contact import ContactOptions
from fesd_robot.fesd import Element, make_tableau
from fesd_robot.recovery import PhysicalMotion, recover

from .motions import AUXILIARY_FORCE, FORMS, FRICTION, GRAVITY, Motion, branch_of, landing, point_mass

IMPACT_TIME, IMPACT_SPEED = np.sqrt(0.2), np.sqrt(20)
RATE = AUXILIARY_FORCE / (AUXILIARY_FORCE + GRAVITY)
BETA = GRAVITY / (AUXILIARY_FORCE + GRAVITY)

each_form = pytest.mark.parametrize("options", FORMS.values(), ids=FORMS.keys())


def _recover(motion: Motion, elements: Sequence[Element] | None = None) -> PhysicalMotion:
    (dynamics, contacts), system = point_mass(), motion.system()
    chosen = elements or motion.elements
    return recover(chosen, branch_of(system, chosen), motion.tableau, dynamics, contacts, system, AUXILIARY_FORCE)


def _kinds(motion: PhysicalMotion) -> list[tuple[str, float]]:
    return [(switch.kind, round(switch.time, 9)) for switch in motion.switches]


@each_form
def test_both_sides_of_the_impact_are_kept(options: ContactOptions) -> None:
    """The frozen element leaves no sample but two at one time and place, with the velocities before and after."""
    recovered = _recover(landing(options))
    assert len(recovered.time) == 3 + 3
    assert (np.diff(recovered.time) >= -1e-15).all()
    (impact,) = recovered.impacts
    assert impact.after == impact.before + 1
    assert recovered.time[[impact.before, impact.after]] == pytest.approx(IMPACT_TIME, abs=1e-14)
    assert recovered.configuration[impact.before] == pytest.approx(recovered.configuration[impact.after], abs=1e-14)
    assert recovered.velocity[impact.before] == pytest.approx([4, -IMPACT_SPEED])
    assert recovered.velocity[impact.after] == pytest.approx([4 - FRICTION * IMPACT_SPEED, 0], abs=1e-14)
    assert impact.impulse == pytest.approx(np.array([[IMPACT_SPEED, -FRICTION * IMPACT_SPEED]]))


@each_form
def test_forces_and_modes(options: ContactOptions) -> None:
    """Flight carries no force, sliding stance the weight and its friction; the sample before the impact says impact."""
    recovered = _recover(landing(options))
    assert recovered.force[:3] == pytest.approx(0)
    assert recovered.force[3:, 0] == pytest.approx(np.tile([GRAVITY, -FRICTION * GRAVITY], (3, 1)))
    assert recovered.mode[:, 0].tolist() == ["flight", "flight", "impact", "slip", "slip", "slip"]
    assert _kinds(recovered) == [("touchdown", round(IMPACT_TIME, 9))]
    assert recovered.theta_sum_error <= 1e-15


@each_form
def test_accelerations_are_physical(options: ContactOptions) -> None:
    """At stages the acceleration by the clock is that of free fall or of sliding; elsewhere there is none."""
    recovered = _recover(landing(options))
    stages = np.isfinite(recovered.acceleration).all(axis=1)
    assert stages.tolist() == [False, True, True, False, True, True]
    assert recovered.acceleration[1:3] == pytest.approx(np.tile([0, -GRAVITY], (2, 1)), abs=1e-11)
    assert recovered.acceleration[4:] == pytest.approx(np.tile([-FRICTION * GRAVITY, 0], (2, 1)), abs=1e-11)


@each_form
def test_states_between_stages_are_those_of_the_motion(options: ContactOptions) -> None:
    """From the left to the right end of every element in which the clock runs: the fall, then the slide."""
    recovered = _recover(landing(options))
    dense = recovered.between
    assert dense.time.shape == (2, 9) and dense.interval.shape == (2,)
    assert [mode.value for mode in dense.mode[:, 0]] == ["flight", "slip+"]
    assert dense.time[:, [0, -1]] == pytest.approx(recovered.time[[[0, 2], [3, 5]]], abs=1e-14)
    steps = np.diff(dense.time, axis=1)
    assert steps == pytest.approx(np.repeat(steps.mean(axis=1, keepdims=True), 8, axis=1))
    fall, slide = dense.time[0] - dense.time[0, 0], dense.time[1] - dense.time[1, 0]
    assert dense.velocity[0, :, 1] == pytest.approx(-GRAVITY * fall, abs=1e-12)
    drop = dense.configuration[0, :, 1] - dense.configuration[0, 0, 1]
    assert drop == pytest.approx(-0.5 * GRAVITY * fall**2, abs=1e-12)
    assert dense.velocity[1, :, 0] - dense.velocity[1, 0, 0] == pytest.approx(-FRICTION * GRAVITY * slide, abs=1e-12)
    assert len(recovered.states.time) == len(recovered.time) + 2 * 9


@each_form
def test_weights_integrate_physical_time(options: ContactOptions) -> None:
    """Quadrature weights sit at the stages and add up to the time that passed."""
    recovered = _recover(landing(options))
    assert recovered.weight.sum() == pytest.approx(recovered.time[-1] - recovered.time[0], abs=1e-14)
    assert (recovered.weight[np.isnan(recovered.acceleration).any(axis=1)] == 0).all()
    assert recovered.time[-1] == pytest.approx(IMPACT_TIME + 0.2 * RATE)
    distance = recovered.weight @ recovered.velocity
    assert distance == pytest.approx(recovered.configuration[-1] - recovered.configuration[0], abs=1e-13)


def test_gap_states_are_kept_where_there_are_any() -> None:
    """The integrated gap is returned as it was; a form on the true gap has none."""
    recovered = _recover(landing(FORMS["steps"]))
    assert recovered.gap_state[:, 0] == pytest.approx(recovered.configuration[:, 1], abs=1e-15)
    assert _recover(landing(FORMS["steps, true gap"])).gap_state.shape == (6, 0)


@each_form
def test_a_hop(options: ContactOptions) -> None:
    """Stance, flight, landing: a takeoff and a touchdown at their times; the clock at the end of every interval."""
    motion = Motion(options, np.array([0.0, 0.0, 0.0, 0.0, 0.0]))
    motion.add(0.11, plus=BETA / 2, minus=BETA / 2, settled=True)
    motion.interval = 1
    motion.state = np.array([0.0, 0.0, 0.0, 1.0, 0.1])  # kicked off by nothing we look at
    motion.add(0.2, settled=True)
    motion.add(1.0 / AUXILIARY_FORCE, plus=0.5, minus=0.5, settled=True)
    motion.interval = 2
    motion.add(0.11, plus=BETA / 2, minus=BETA / 2, settled=True)
    recovered = _recover(motion)
    assert _kinds(recovered) == [("takeoff", 0.1), ("touchdown", 0.3)]
    assert recovered.clock == pytest.approx([0.1, 0.3, 0.4])
    assert sorted(set(recovered.interval.tolist())) == [0, 1, 2]
    assert [impact.impulse.ravel().tolist() for impact in recovered.impacts] == [pytest.approx([1.0, 0.0])]
    assert recovered.mode[recovered.time > 0.31, 0].tolist() == ["stick", "stick"]
    assert recovered.force[-1, 0] == pytest.approx([GRAVITY, 0])


@each_form
def test_an_impact_at_the_very_end(options: ContactOptions) -> None:
    """A motion that ends in an impact keeps the state after it as its last sample."""
    motion = landing(options)
    recovered = _recover(motion, motion.elements[:2])
    assert len(recovered.time) == 4
    (impact,) = recovered.impacts
    assert (impact.before, impact.after) == (2, 3)
    assert recovered.velocity[-1] == pytest.approx([4 - FRICTION * IMPACT_SPEED, 0], abs=1e-14)
    assert _kinds(recovered) == [("touchdown", round(IMPACT_TIME, 9))]
    assert recovered.clock == pytest.approx([IMPACT_TIME])


@each_form
def test_an_impact_at_the_very_start(options: ContactOptions) -> None:
    """A motion that starts in an impact keeps the velocity that it was given, the impulse, and the velocity after."""
    motion = landing(options)
    recovered = _recover(motion, motion.elements[1:])
    (impact,) = recovered.impacts
    assert recovered.velocity[impact.before] == pytest.approx([4, -IMPACT_SPEED])
    assert recovered.velocity[impact.after] == pytest.approx([4 - FRICTION * IMPACT_SPEED, 0], abs=1e-14)
    assert impact.impulse[0, 0] == pytest.approx(IMPACT_SPEED)


@each_form
def test_an_impact_in_two_elements_is_one(options: ContactOptions) -> None:
    """Frozen elements one after the other give one impact with the sum of their impulses."""
    motion = Motion(options, np.array([0, 1, 4, 0, 0], dtype=float))
    motion.add(IMPACT_TIME, settled=True)
    for part in (0.3, 0.7):
        motion.add(part * IMPACT_SPEED / AUXILIARY_FORCE, plus=1.0, settled=True)
    motion.add(0.1, plus=BETA, settled=True)
    recovered = _recover(motion)
    (impact,) = recovered.impacts
    assert impact.impulse == pytest.approx(np.array([[IMPACT_SPEED, -FRICTION * IMPACT_SPEED]]))
    assert len(recovered.time) == 6


@pytest.mark.parametrize("form", ["multipliers", "steps"])
def test_an_empty_element_is_no_motion(form: str) -> None:
    """An element of no length neither adds samples nor an impact."""
    options = FORMS[form]
    motion = Motion(options, np.array([0, 1, 4, 0, 0], dtype=float))
    motion.add(0.2)
    motion.add(0.0)
    motion.add(0.1)
    recovered = _recover(motion)
    assert (len(recovered.time), recovered.impacts, recovered.switches) == (5, [], [])
    assert recovered.time[-1] == pytest.approx(0.3)


def test_friction_forces_have_the_sign_of_their_multipliers() -> None:
    """Sliding backwards is slowed down by a forward force; sticking carries what its multipliers say."""
    options = FORMS["multipliers"]
    motion = Motion(options, np.array([0, 0, -2, 0, 0], dtype=float))
    motion.add(0.11, minus=BETA, settled=True)
    motion.state = np.array([0, 0, 0, 0, 0.1])
    motion.add(0.11, plus=0.75 * BETA, minus=0.25 * BETA, settled=True)
    recovered = _recover(motion)
    assert recovered.force[1, 0] == pytest.approx([GRAVITY, FRICTION * GRAVITY])
    assert recovered.force[-1, 0] == pytest.approx([GRAVITY, -0.5 * FRICTION * GRAVITY])


@pytest.mark.parametrize("start", [2.0, -2.0])
def test_sliding_that_stops_is_a_switch(start: float) -> None:
    """From slip to stick at the time when the speed is used up, in either direction."""
    options = FORMS["multipliers"]
    motion = Motion(options, np.array([0, 0, start, 0, 0], dtype=float))
    seconds = abs(start) / (FRICTION * GRAVITY)
    motion.add(seconds / RATE, plus=BETA * (start > 0), minus=BETA * (start < 0), settled=True)
    motion.add(0.11, plus=BETA / 2, minus=BETA / 2, settled=True)
    assert _kinds(_recover(motion)) == [("slip_to_stick", round(seconds, 9))]


def test_a_wrong_multiplier_shows_as_theta_error() -> None:
    """A lifted product that is off by 0.01 is an error of the sum of the multipliers of 0.01."""
    motion = landing(FORMS["steps"])
    off = motion.elements[0].z.copy()
    off[1, -1] += 0.01
    element = motion.elements[0]
    wrong = [Element(**{**element.__dict__, "z": off}), *motion.elements[1:]]
    assert _recover(motion, wrong).theta_sum_error == pytest.approx(0.01)


def test_right_ends_that_are_no_stages_are_samples() -> None:
    """Gauss-Legendre stages lie inside; the right end is one more sample without acceleration and weight."""
    motion = Motion(FORMS["multipliers"], np.array([0, 1, 4, 0, 0], dtype=float), make_tableau("gauss_legendre", 2))
    motion.add(0.2)
    motion.add(0.1)
    recovered = _recover(motion)
    assert len(recovered.time) == 1 + 2 * 3
    assert recovered.time[[0, 3, 6]] == pytest.approx([0, 0.2, 0.3])
    assert np.isnan(recovered.acceleration[[0, 3, 6]]).all()
    assert recovered.weight.sum() == pytest.approx(0.3)
