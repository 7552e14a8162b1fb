"""Filippov multipliers of the fields: sum, product rule, the fields they weight, and the shape of the system."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import ContactOptions, ContactSystem, StepOptions, contact_system
from fesd_robot.errors import OptionError

from .motions import AUXILIARY_FORCE, FORMS, FRICTION, GRAVITY, point_mass, two_contacts

STEPS = [options for options in FORMS.values() if options.form == "steps"]
each_steps = pytest.mark.parametrize("options", STEPS, ids=[name for name in FORMS if name.startswith("steps")])
each_form = pytest.mark.parametrize("options", FORMS.values(), ids=FORMS.keys())


def _consistent(system: ContactSystem, z: np.ndarray) -> np.ndarray:
    """The same algebraic variables with every lifted product at its definition."""
    parts = system.system
    lifted = [i for i, name in enumerate(parts.algebraic_names) if name.startswith(("beta", "1 - beta", "theta_ODE"))]
    residual = ca.Function("residual", parts.arguments, [parts.residual])
    x, u, p = (np.zeros(part.numel()) for part in (parts.state, parts.control, parts.parameters))
    z = z.copy()
    for _ in lifted:
        z[lifted] -= np.asarray(residual(x, u, z, p)).ravel()[parts.residual.numel() - len(lifted) :]
    return z


def _multipliers(system: ContactSystem, z: np.ndarray) -> tuple[float, np.ndarray, float]:
    """theta_ODE, rows (theta_+, theta_-) of the contacts, and the system's own measure of their error."""
    pairs = ca.vertcat(*[ca.horzcat(*own.sides[0]) for own in system.theta_auxiliary])
    function = ca.Function("multipliers", [system.system.algebraic], [system.theta_ode, pairs, system.theta_error])
    ode, auxiliary, error = function(z)
    return float(ode), np.asarray(ca.DM(auxiliary).full()), float(error)


def _random(system: ContactSystem, seed: int) -> np.ndarray:
    return _consistent(system, np.random.default_rng(seed).uniform(size=system.system.algebraic.numel()))


@each_steps
@pytest.mark.parametrize("seed", range(5))
def test_one_contact_sums_to_one(options: ContactOptions, seed: int) -> None:
    """theta_ODE + theta_+ + theta_- = 1 for any alpha, with theta_ODE = alpha_q + alpha_n - alpha_q alpha_n."""
    system = contact_system(*point_mass(), options)
    z = _random(system, seed)
    q, n, t = z[:3]
    ode, auxiliary, error = _multipliers(system, z)
    assert ode + auxiliary.sum() == pytest.approx(1, abs=1e-15)
    assert ode == pytest.approx(q + n - q * n, abs=1e-15)
    assert auxiliary[0] == pytest.approx((1 - q) * (1 - n) * np.array([t, 1 - t]), abs=1e-15)
    assert error <= 1e-15
    faulty = q + (1 - q) * (1 - n)  # the multiplier of the published script
    assert abs(ode - faulty) > 1e-3


def test_multipliers_as_variables_sum_to_one() -> None:
    """With the multipliers as variables theta_ODE is what the others leave, and never negative, for one contact."""
    system = contact_system(*point_mass(), FORMS["multipliers"])
    assert system.system.algebraic_lower.tolist() == [0, 0, 0]
    for plus, minus in np.random.default_rng(0).uniform(0, 0.5, (5, 2)):
        ode, auxiliary, error = _multipliers(system, _consistent(system, np.array([plus, minus, 0.5])))
        assert auxiliary.tolist() == [[plus, minus]]
        assert ode + plus + minus == pytest.approx(1, abs=1e-15)
        assert error <= 1e-15


@each_form
@pytest.mark.parametrize("seed", range(3))
def test_two_contacts_multiply(options: ContactOptions, seed: int) -> None:
    """theta_ODE = Π (1 - beta_c): two closed contacts add their fields, each open one leaves the other's alone."""
    system = contact_system(*two_contacts(), options)
    z = _random(system, seed)
    if options.form == "multipliers":
        z[:3] /= 2
        z = _consistent(system, z)
    ode, auxiliary, error = _multipliers(system, z)
    beta = auxiliary.sum(axis=1)
    assert ode == pytest.approx(np.prod(1 - beta), abs=1e-14)
    assert auxiliary[1, 1] == 0  # the wall has no friction
    assert error <= 1e-14
    if options.form == "steps":
        q, n, t, wall_q, wall_n = z[:5]
        assert ode == pytest.approx((q + n - q * n) * (wall_q + wall_n - wall_q * wall_n), abs=1e-14)
        assert auxiliary[0] == pytest.approx((1 - q) * (1 - n) * np.array([t, 1 - t]), abs=1e-14)
        assert auxiliary[1, 0] == pytest.approx((1 - wall_q) * (1 - wall_n), abs=1e-14)


@each_form
def test_an_inconsistent_product_is_an_error(options: ContactOptions) -> None:
    """A lifted product that is off by 0.02 shows in the system's measure of the multipliers."""
    system = contact_system(*two_contacts(), options)
    z = _random(system, 0)
    z[-1] += 0.02
    assert _multipliers(system, z)[2] == pytest.approx(0.02)


@each_steps
def test_an_approach_excludes_all_but_the_impact(options: ContactOptions) -> None:
    """Gated, lambda_n of J_n v excludes 1 - beta, not alpha_n: a half-shut gate smears no impact."""
    system = contact_system(*point_mass(), options)
    z = _random(system, 0)
    q, n, t = z[:3]
    H = ca.Function("H", [system.system.algebraic], [system.system.H])
    beta = (1 - q) * (1 - n)
    excluded = 1 - beta if options.steps.gate else n
    assert np.asarray(H(z)).ravel() == pytest.approx([q, excluded, t, 1 - q, 1 - n, 1 - t])


@each_form
def test_the_fields(options: ContactOptions) -> None:
    """E y' = theta_ODE s f_ODE + theta_+ f_+ + theta_- f_-: free fall with a running clock, and pushes without one."""
    system = contact_system(*point_mass(), options)
    parts = system.system
    right = ca.Function("f", parts.arguments, [parts.right_hand_side, parts.mass_matrix])
    z = _random(system, 1)
    if options.form == "multipliers":
        z /= 2
    ode, ((plus, minus),), _ = _multipliers(system, z)
    x = np.random.default_rng(2).normal(size=parts.state.numel())
    speed = 1.7
    value, mass = (np.asarray(part.full()) for part in right(x, [speed], z, []))
    rate, push = ode * speed, AUXILIARY_FORCE * (plus + minus)
    expected = [rate * x[2], rate * x[3], AUXILIARY_FORCE * FRICTION * (minus - plus), push - rate * GRAVITY, rate]
    if options.steps.gap == "integrated":
        expected.append(rate * (x[3] + options.baumgarte_gain * (x[1] - x[5])))
    assert value.ravel() == pytest.approx(np.array(expected))
    assert np.array_equal(mass, np.eye(len(expected)))
    rate_of_clock = ca.Function("rate", [parts.algebraic, parts.control], [system.clock_rate])
    assert float(rate_of_clock(z, [speed])) == pytest.approx(rate)


@each_form
def test_the_guess_is_consistent(options: ContactOptions) -> None:
    """In flight, on the ground and below it the guess has no residual and complementary sides."""
    system = contact_system(*two_contacts(), options).system
    sides = ca.Function("sides", system.arguments, [system.residual, system.G, system.H])
    rng = np.random.default_rng(3)
    for _ in range(10):
        x = rng.normal(size=system.state.numel())
        z = system.guess(x, np.ones(1), np.zeros(0))
        residual, G, H = (np.asarray(value).ravel() for value in sides(x, [1.0], z, []))
        assert np.abs(residual).max(initial=0) <= 1e-14
        assert np.abs(G * H).max(initial=0) <= 1e-14
        assert G.min(initial=0) >= 0 and H.min(initial=0) >= 0


@pytest.mark.parametrize(
    ("name", "states", "algebraics", "pairs", "vanishing"),
    [
        ("multipliers", 6, 3, 0, 5),
        ("steps", 6, 10, 6, 4),
        ("steps, true gap", 5, 10, 6, 4),
        ("steps, no gate", 6, 10, 6, 0),
    ],
)
def test_sizes_and_names(name: str, states: int, algebraics: int, pairs: int, vanishing: int) -> None:
    """One contact with friction: the clock, the gap if integrated, the variables of its logic, all with names."""
    contact = contact_system(*point_mass(), FORMS[name])
    system = contact.system
    assert (system.state.numel(), system.algebraic.numel(), len(system.pairs)) == (states, algebraics, pairs)
    assert len(system.vanishing) == vanishing
    assert {condition.label.contact for condition in system.complementarities} == {"foot"}
    assert system.state_names[:5] == ["x", "z", "x velocity", "z velocity", "clock"]
    assert contact.integrated_gap == (states == 6)
    assert system.state_names[5:] == ["foot integrated gap"][: states - 5]
    assert list(system.control_names) == ["speed of time"]
    assert all("foot" in label for label in system.algebraic_names)


def test_without_friction_there_is_no_tangential_logic() -> None:
    """A contact without friction has neither a tangential step nor a second multiplier, and pushes along its normal."""
    for name, algebraics in (("multipliers", 1), ("steps", 7)):
        system = contact_system(*point_mass(friction=0.0), FORMS[name])
        assert system.system.algebraic.numel() == algebraics
        right = ca.Function("f", system.system.arguments, [system.system.right_hand_side])
        z = _random(system, 0)
        assert float(right(np.zeros(6), [1.0], z, [])[2]) == 0


def test_multipliers_need_the_integrated_gap() -> None:
    """Only the step functions can switch on the true gap."""
    with pytest.raises(OptionError, match=r"found StepOptions\(gap='true'.* needs the form 'steps'"):
        contact_system(*point_mass(), replace(FORMS["multipliers"], steps=StepOptions(gap="true")))
    with pytest.raises(OptionError, match="the transcription 'freezing'"):
        contact_system(*point_mass(), replace(FORMS["steps, no gate"], transcription="impulses"))


def test_a_foot_that_may_not_slip_keeps_a_margin_while_the_clock_runs() -> None:
    """Of its cone it uses 1 - 1e-3 where the clock runs, all of it in an impact; one that may slip uses all of it."""
    dynamics, contacts = point_mass()
    across = ca.SX.zeros(contacts[0].normal.shape)
    for slip_distance, running in ((0.0, 1 - 1e-3), (np.inf, 1.0)):
        one = replace(contacts[0], tangents=ca.horzcat(contacts[0].tangents, across), slip_distance=slip_distance)
        system = contact_system(dynamics, [one], ContactOptions(form="multipliers")).system
        names = list(system.algebraic_names)
        residual = ca.Function("residual", system.arguments, [system.residual])
        x, u, p = (np.zeros(part.numel()) for part in (system.state, system.control, system.parameters))
        for beta, used in ((1e-3, running), (1.0, 1.0)):
            z = np.zeros(len(names))
            z[names.index("theta_-[foot]")] = beta * (1 + used) / 2
            z[names.index("theta_+[foot]")] = beta * (1 - used) / 2
            z[names.index("theta_left[foot]")] = z[names.index("theta_right[foot]")] = beta / 2
            unused = -float(np.asarray(residual(x, u, z, p)).ravel()[-1])
            assert unused / beta**2 == pytest.approx(0, abs=5e-6)
