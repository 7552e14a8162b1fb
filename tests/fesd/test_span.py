"""Simulation over a span of time: steps of its own choice, every switch found, what is not unique said."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.errors import DimensionError, ModelError, OptionError
from fesd_robot.fesd import FesdOptions, SimulationError, SimulationSettings, make_tableau, simulate
from scripts.results.random_piecewise_linear import compare

from .systems import SIGNS, TIME, by_regions, driven, oscillator, planar_oscillator, pressed, relay, relays, scalar

ROOT = np.sqrt(2) - 1
EXACT = np.array([-1.5974603774506981221, 0.76149362060601145276])
each_form = pytest.mark.parametrize("form", ["stewart", "heaviside"])


@each_form
def test_a_sliding_mode_begins_and_ends_where_it_does(form: str) -> None:
    """x' = t - sign x slides from √2 - 1 to 1, whatever the lengths of steps before are."""
    system = relay(form, TIME + 1, TIME - 1)
    for step in np.linspace(0.05, 0.25, 21):
        motion = simulate(system, np.array([-0.5, 0.0]), (0.0, 2.0), max_step=float(step))
        assert motion.switch_times == pytest.approx([ROOT, 1.0], abs=1e-11)
        assert motion.states[-1] == pytest.approx([0.5, 2.0], abs=1e-11)
        assert motion.unique and not motion.notes


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_the_error_is_that_asked_for(rtol: float) -> None:
    """The oscillator that crosses the unit circle ends within 10 rtol of the exact state, its switch at 1, too."""
    motion = simulate(planar_oscillator("stewart"), np.array([np.exp(-1), 0.0]), (0.0, np.pi / 2), rtol=rtol)
    assert np.abs(motion.states[-1] - EXACT).max() <= 10 * rtol
    assert motion.switch_times == pytest.approx([1.0], abs=10 * rtol)


def test_smaller_tolerances_take_more_steps() -> None:
    """With one scheme the number of steps grows with 1 / rtol^(1/6), and max_step bounds their length."""
    start, span, tableau = np.array([np.exp(-1), 0.0]), (0.0, np.pi / 2), make_tableau("radau_iia", 5)
    steps = [
        len(simulate(oscillator(), start, span, rtol=rtol, atol=rtol, tableau=tableau).elements)
        for rtol in (1e-4, 1e-10)
    ]
    assert 5 <= steps[1] / steps[0] <= 20
    motion = simulate(oscillator(), start, span, max_step=0.01)
    assert max(element.step for element in motion.elements) <= 0.01 + 1e-12


def test_time_begins_where_it_is_told() -> None:
    """Times, phases and dense output count from t0, and the motion ends at t1 exactly."""
    motion = simulate(scalar("crossing"), np.array([-1.0]), (3.0, 5.0))
    assert motion.times[0] == 3.0 and motion.times[-1] == 5.0
    assert motion.switch_times == pytest.approx([3 + 1 / 3], abs=1e-12)
    assert motion.at([3.0, 3.2, 4.0, 5.0])[:, 0] == pytest.approx([-1.0, -0.4, 2 / 3, 5 / 3], abs=1e-12)
    ends = [element.end for element in motion.elements]
    assert [element.start for element in motion.elements[1:]] == pytest.approx(ends[:-1], abs=1e-13)


def test_controls_on_parts_of_the_span() -> None:
    """2 a' = u + 1 with u = 1, then -1; (1 + a²) b' = -2: both parts begin with steps of their own."""
    motion = simulate(
        driven(), np.array([1.0, 0.0]), (0.0, 0.4), control=np.array([[1.0, -1.0]]), parameters=np.array([-1.0])
    )
    first = -2 * (np.arctan(1.2) - np.arctan(1.0))
    assert motion.states[-1] == pytest.approx([1.2, first - 2 * 0.2 / (1 + 1.2**2)], abs=1e-8)
    assert motion.at([0.2])[0] == pytest.approx([1.2, first], abs=1e-8)
    assert {(element.interval, float(element.u[0])) for element in motion.elements} == {(0, 1.0), (1, -1.0)}
    constant = simulate(
        driven(), np.array([1.0, 0.0]), (0.0, 0.2), control=np.array([1.0]), parameters=np.array([-1.0])
    )
    assert constant.states[-1] == pytest.approx([1.2, first], abs=1e-8)


def test_quadratures_end_at_the_steps() -> None:
    """The integral of x² over the crossing: 1/9 before and (5/3)³/3 after it."""
    system = scalar("crossing")
    motion = simulate(replace(system, quadratures={"square": system.state**2}), np.array([-1.0]), (0.0, 2.0))
    assert motion.quadratures["square"][-1] == pytest.approx(1 / 9 + (5 / 3) ** 3 / 3, abs=1e-12)
    assert motion.quadratures["square"].shape == motion.times.shape


def test_complementarity_is_exact() -> None:
    """Of every pair one side vanishes to round-off at all stages of an element, and no side is negative."""
    system = relay("heaviside", TIME + 1, TIME - 1)
    motion = simulate(system, np.array([-0.5, 0.0]), (0.0, 2.0))
    sides = ca.Function("sides", [system.algebraic], [system.G, system.H])
    for element in motion.elements:
        G, H = (
            np.array([np.asarray(one).ravel() for one in part]) for part in zip(*map(sides, element.z), strict=True)
        )
        assert np.minimum(np.abs(G).sum(axis=0), np.abs(H).sum(axis=0)).max() <= 1e-12
        assert min(G.min(), H.min()) >= -1e-9


@each_form
def test_a_stick_slip_motion_is_that_of_an_event_driven_integrator(form: str) -> None:
    """A mass on a moving belt, friction falling with the sliding speed: sticks end and begin where DOP853 says."""
    x = ca.SX.sym("x", 2)  # position, velocity; the belt moves with 0.3
    speed = x[1] - 0.3

    def friction(relative: Any) -> Any:
        return 1.0 / (1.0 + 2.0 * relative)

    behind, ahead = (ca.vertcat(x[1], -x[0] + sign * friction(sign * -speed)) for sign in (1, -1))
    system = by_regions(
        form, Model(x), [Subsystem(fields=ca.horzcat(behind, ahead), switching=speed, sign_matrix=SIGNS)]
    )
    motion = simulate(system, np.array([0.0, 0.0]), (0.0, 20.0), rtol=1e-8)

    def slip(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -y[0] + friction(0.3 - y[1])])

    def belt(t: float, y: np.ndarray) -> float:
        return float(y[1] - 0.3)

    belt.terminal, belt.direction = True, 1  # type: ignore[attr-defined]
    state, now, switches = np.array([0.0, 0.0]), 0.0, list[float]()
    while len(switches) < 5:
        # After its release the mass is behind the belt for a while in which no event is looked for.
        begun = solve_ivp(slip, (now, now + 0.2), state, "DOP853", rtol=1e-12, atol=1e-13)
        ran = solve_ivp(slip, (now + 0.2, 30.0), begun.y[:, -1], "DOP853", rtol=1e-12, atol=1e-13, events=belt)
        switches.append(float(ran.t[-1]))  # then it is carried along until the spring pulls with 1
        now = switches[-1] + (1.0 - ran.y[0, -1]) / 0.3
        switches.append(now)
        state = np.array([1.0, 0.3])
    switches = [time for time in switches if time < 20.0]
    assert len(switches) >= 5
    assert motion.switch_times == pytest.approx(switches, abs=1e-5)


@each_form
def test_many_independent_switches_take_one_element_each(form: str) -> None:
    """20 relays that cross at 20 times: one element more for each; and so for 8 that begin to slide."""
    for below, above, count in ((2.0, 1.0, 20), (1.0, -1.0, 8)):
        system = relays(form, count, below, above)
        starts = -below * (np.arange(count) + 1) / (count + 2)
        motion = simulate(system, starts, (0.0, 1.0))
        assert motion.switch_times == pytest.approx(-starts / below, abs=1e-9)
        assert len(motion.elements) <= count + 5
        together = simulate(system, np.full(count, -0.5), (0.0, 1.0))
        assert together.switch_times == pytest.approx([0.5 / below], abs=1e-12)


@each_form
def test_what_is_not_unique_is_said(form: str) -> None:
    """From x = 0 the fields of x' = sign x part: of three motions one that leaves is taken, in equal steps, too."""
    system = relay(form, -1.0, 1.0)
    for motion in (
        simulate(system, np.array([0.0, 0.0]), (0.0, 1.0)),
        simulate(system, np.array([0.0, 0.0]), 4, 1.0),
    ):
        assert abs(motion.states[-1, 0]) == pytest.approx(1.0, abs=1e-12)
        assert not motion.unique and motion.notes[0].time == 0.0 and "not unique" in motion.notes[0].text
    attracted = simulate(relay(form, 1.0, -1.0), np.array([0.0, 0.0]), (0.0, 1.0))
    assert attracted.unique and np.abs(attracted.states[:, 0]).max() <= 1e-12


@each_form
def test_a_zeno_point_is_named(form: str) -> None:
    """Filippov's spiral x' = -sign x + 2 sign y, y' = -2 sign x - sign y reaches zero at (|x| + |y|)/2 and stays."""
    x = ca.SX.sym("x", 2)
    subsystems = [
        Subsystem(fields=ca.DM([[1, -1], [2, -2]]), switching=x[0], sign_matrix=SIGNS, name="x"),
        Subsystem(fields=ca.DM([[-2, 2], [1, -1]]), switching=x[1], sign_matrix=SIGNS, name="y"),
    ]
    motion = simulate(by_regions(form, Model(x), subsystems), np.array([1.0, 0.3]), (0.0, 1.0))
    assert any("Zeno point at 0.65" in note.text for note in motion.notes)
    assert np.abs(motion.at([0.66, 0.8, 1.0])).max() <= 1e-9 and motion.unique


def test_a_tangential_contact_is_no_switch() -> None:
    """x' = 2 t² - 1 - sign x from 0 slides with alpha = t², from its first moment, where alpha is zero."""
    motion = simulate(pressed(), np.array([0.0, 0.0]), (0.0, 0.9))
    assert np.abs(motion.states[:, 0]).max() <= 1e-9
    assert motion.elements[-1].z[-1, 0] == pytest.approx(0.81, abs=1e-6)


@pytest.mark.parametrize("seed", [3, 271, 344])
def test_random_piecewise_linear_systems(seed: int) -> None:
    """Some of the 500 random systems: intersecting surfaces (271), a Zeno point (344)."""
    outcome, _, _, switches = compare(seed)
    assert outcome == "right" and switches >= 1


def test_bounds_of_the_state_are_kept() -> None:
    """A motion that passes a bound ends there, with the name of the state and what was computed."""
    settings = SimulationSettings(state_lower=np.array([0.25]))
    with pytest.raises(SimulationError, match=r"its motion takes x to .*, beyond state_lower 0\.25") as caught:
        simulate(scalar("sliding"), np.array([1.0]), (0.0, 1.0), settings=settings, max_step=0.2)
    assert caught.value.simulation.states[-1, 0] >= 0.25 and len(caught.value.simulation.elements) >= 3


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"rtol": 0.0}, OptionError, "rtol is 0, must be from 1e-13 to below 1"),
        ({"atol": -1.0}, OptionError, "atol is -1.0, must be positive"),
        ({"max_step": 0.0}, OptionError, "max_step is 0, must be positive"),
        ({"rtoll": 1e-3}, OptionError, r"simulate has no argument 'rtoll' \(did you mean 'rtol'"),
        ({"tableau": 3}, OptionError, "tableau is a int, must be a Tableau"),
        (
            {"tableau": make_tableau("gauss_legendre", 3)},
            OptionError,
            "gauss_legendre with 3 stages, .* needs radau_iia",
        ),
        ({"options": FesdOptions()}, OptionError, "options belongs to a number of equal steps, found the span"),
        ({"duration": 1.0}, OptionError, "duration belongs to a number of equal steps"),
        ({"settings": SimulationSettings(sensitivities=True)}, OptionError, "sensitivities belongs to a number of"),
        ({"controls": (1.0, 1.0)}, ModelError, r"the span of time is \(1.0, 1.0\), must be \(t0, t1\) with t0 < t1"),
        ({"controls": (0.0, 1.0, 2.0)}, ModelError, "the span of time is"),
        ({"controls": (0.0, np.inf)}, ModelError, "the span of time is"),
        ({"control": None}, DimensionError, r"control has shape None, expected \(1,\) or \(1, parts\)"),
        ({"control": np.zeros((2, 2))}, DimensionError, r"control has shape \(2, 2\), expected \(1,\)"),
        ({"controls": np.zeros((1, 3)), "control": None}, OptionError, "control belongs to a span of time"),
        ({"controls": np.zeros((1, 3)), "control": ...}, OptionError, "duration is missing: give a number of steps"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], kind: type[Exception], message: str) -> None:
    """Every bad argument ends in our own exception with what was found and what would be valid."""
    arguments: dict[str, Any] = {"controls": (0.0, 1.0), "control": np.zeros(1), "parameters": np.zeros(1), **changes}
    if arguments["control"] is ...:
        del arguments["control"]
    with pytest.raises(kind, match=message):
        simulate(driven(), np.array([1.0, 0.0]), **arguments)


def test_regions_that_meet_in_a_point() -> None:
    """Four regions in the form of Stewart meet at the origin: x' = -sign x, y' = -sign y rests there, uniquely."""
    x = ca.SX.sym("x", 2)
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    motion = simulate(
        stewart(Model(x), Subsystem(switching=x, sign_matrix=signs, fields=ca.DM(-signs.T))),
        np.array([0.3, -0.5]),
        (0.0, 1.0),
    )
    assert motion.switch_times == pytest.approx([0.3, 0.5], abs=1e-9)
    assert np.abs(motion.states[-1]).max() <= 1e-9
    assert motion.unique
