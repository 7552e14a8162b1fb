"""Every scheme, in both forms of the switching logic, with and without switch detection."""

from __future__ import annotations

from functools import cache
from typing import get_args

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from fesd_robot.dcs import Model, Subsystem
from fesd_robot.fesd import FesdOptions, Form, Simulation, Tableau, make_tableau, simulate
from fesd_robot.fesd.tableau import Scheme

from .systems import SIGNS, TIME, by_regions, planar_oscillator, relay

SCHEMES: list[tuple[Scheme, int]] = [
    *[("gauss_legendre", n) for n in (1, 2, 3, 4)],
    *[("radau_iia", n) for n in (1, 2, 3, 4)],
    *[("radau_ia", n) for n in (1, 2, 3)],
    *[(scheme, n) for scheme in ("lobatto_iiia", "lobatto_iiib", "lobatto_iiic") for n in (2, 3, 4, 5)],
    ("explicit_euler", 1),
    ("heun_2", 2),
    ("heun_3", 3),
    ("runge_kutta_4", 4),
]  # type: ignore[list-item]
NAMES = [f"{scheme}-{stages}" for scheme, stages in SCHEMES]
each_scheme = pytest.mark.parametrize(("scheme", "stages"), SCHEMES, ids=NAMES)
FORMS = ("stewart", "heaviside")
END = np.array([-1.5974603774506981221, 0.76149362060601145276])


@cache
def _oscillation(form: str, scheme: Scheme, stages: int, steps: int, detect: bool) -> Simulation:
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=2, switch_detection=detect)
    return simulate(planar_oscillator(form), np.array([np.exp(-1), 0.0]), steps, np.pi / 2, options=options)


def _error(form: str, scheme: Scheme, stages: int, steps: int, detect: bool = True) -> float:
    return float(np.abs(_oscillation(form, scheme, stages, steps, detect).states[-1] - END).max())


def _stability(tableau: Tableau, z: complex) -> complex:
    """R(z) = 1 + z bᵀ (1 - z A)⁻¹ 1, what one step does to x' = λ x with z = h λ."""
    ones = np.ones(tableau.stages)
    return complex(1 + z * tableau.b @ np.linalg.solve(np.eye(tableau.stages) - z * tableau.A, ones))


def _ideal(tableau: Tableau, steps: int) -> tuple[complex, float]:
    """End state and switch time of the oscillator, a complex number with x' = (1 ± 2πi) x, by stability functions.

    Two equal elements a step; the step with the switch is split where the numerical solution meets the unit circle.
    """
    inside, outside, h = 1 + 2j * np.pi, 1 - 2j * np.pi, np.pi / 2 / steps
    x, time, crossed = complex(np.exp(-1)), 0.0, 0.0
    for k in range(steps):
        if crossed:
            x *= _stability(tableau, h / 2 * outside) ** 2
            continue
        after = x * _stability(tableau, h / 2 * inside) ** 2
        if abs(after) < 1:
            x = after
            continue
        first = brentq(lambda s, x=x: abs(x * _stability(tableau, s * inside)) - 1, 0.0, h, xtol=1e-15, rtol=1e-15)
        x *= _stability(tableau, first * inside) * _stability(tableau, (h - first) * outside)
        crossed = time + k * h + first
    return x, crossed


@each_scheme
@pytest.mark.parametrize("form", FORMS)
def test_the_oscillator_is_that_of_exact_arithmetic(form: str, scheme: Scheme, stages: int) -> None:
    """End state and switch time agree with the scheme's stability function and a root search for the switch."""
    simulation = _oscillation(form, scheme, stages, 34, True)
    end, crossed = _ideal(make_tableau(scheme, stages), 34)
    assert simulation.states[-1] == pytest.approx([end.real, end.imag], rel=1e-10)
    assert simulation.switch_times.tolist() == pytest.approx([crossed] if crossed else [], abs=1e-12)


@pytest.mark.slow
@each_scheme
def test_order_with_switch_detection(scheme: Scheme, stages: int) -> None:
    """The error falls with the order of the scheme, down to round-off."""
    order = make_tableau(scheme, stages).order
    first, second = (34, 105) if order > 1 else (324, 1001)  # schemes of order one need small steps for this oscillator
    coarse, fine = (_error("heaviside", scheme, stages, steps) for steps in (first, second))
    slope = np.log(coarse / max(fine, 1e-13)) / np.log(second / first)
    assert slope >= order - 0.3 or fine <= 1e-13


PUBLISHED = {
    ("gauss_legendre", 1): 1.3904410699278,
    ("gauss_legendre", 2): 0.007927289405022565,
    ("gauss_legendre", 3): 0.00806646738865658,
    ("gauss_legendre", 4): 0.008066807329613524,
    ("radau_iia", 1): 1.431359891430637,
    ("radau_iia", 2): 0.020677651875419114,
    ("radau_iia", 3): 0.008044571430475956,
    ("radau_iia", 4): 0.008066807329613524,
    ("lobatto_iiia", 3): 0.2346054909900249,
    ("lobatto_iiia", 4): 0.11111038550023464,
    ("lobatto_iiic", 3): 0.2419552976280828,
    ("lobatto_iiic", 4): 0.11468308117729753,
    ("explicit_euler", 1): 8.314707892390386,
    ("heun_2", 2): 3.7679178794627166,
    ("heun_3", 3): 0.6307074522246858,
    ("runge_kutta_4", 4): 0.2300238675928579,
}
"""Errors of fixed steps with N = 11, digitised from Fig. 8 (left column) of arXiv 2205.05337."""


@pytest.mark.slow
@each_scheme
def test_fixed_steps(scheme: Scheme, stages: int) -> None:
    """Without switch detection both forms agree, the error is the published one, and it stays above 1e-3."""
    errors = {steps: _error("heaviside", scheme, stages, steps, detect=False) for steps in (11, 34)}
    if (scheme, stages) in PUBLISHED:
        assert errors[11] == pytest.approx(PUBLISHED[scheme, stages], rel=5e-3)
    assert errors[34] > 1e-3
    both = [_oscillation(form, scheme, stages, 34, False).states for form in FORMS]
    assert np.abs(both[0] - both[1]).max() <= 1e-10


@each_scheme
@pytest.mark.parametrize("form", FORMS)
def test_crossing_times_are_exact(form: str, scheme: Scheme, stages: int) -> None:
    """x' = 2 - sign x from -1 crosses at 1/3; x' = √2 - 2 < 0 from 2 - √2, then -1 crosses at time 1."""
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=2)
    simulation = simulate(relay(form, 3.0, 1.0), np.array([-1.0, 0.0]), 3, 2.0, options=options)
    assert simulation.switch_times == pytest.approx([1 / 3], abs=1e-13)
    assert simulation.states[-1] == pytest.approx([5 / 3, 2.0], abs=1e-13)
    simulation = simulate(relay(form, -1.0, np.sqrt(2) - 2), np.array([2 - np.sqrt(2), 0.0]), 3, 2.0, options=options)
    assert simulation.switch_times == pytest.approx([1.0], abs=1e-13)
    assert simulation.states[-1] == pytest.approx([-1.0, 2.0], abs=1e-13)


SLIDING: list[tuple[Scheme, int]] = [
    *[("radau_iia", n) for n in (1, 2, 3, 4)],
    *[("gauss_legendre", n) for n in (1, 2, 3)],
    *[("lobatto_iiic", n) for n in (2, 3, 4)],
]  # type: ignore[list-item]


@pytest.mark.parametrize(("scheme", "stages"), SLIDING, ids=[f"{scheme}-{stages}" for scheme, stages in SLIDING])
@pytest.mark.parametrize("form", FORMS)
def test_sliding_begins_exactly(form: str, scheme: Scheme, stages: int) -> None:
    """x' = -sign x from √2 arrives at zero at √2 and stays there, with both regions active."""
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=2)
    simulation = simulate(relay(form, 1.0, -1.0), np.array([np.sqrt(2), 0.0]), 3, 2.0, options=options)
    assert simulation.switch_times == pytest.approx([np.sqrt(2)], abs=1e-13)
    assert simulation.states[-1] == pytest.approx([0.0, 2.0], abs=1e-13)
    assert int(simulation.phases[1].mode.sum()) == 2


@pytest.mark.parametrize("stages", [2, 3, 4])
@pytest.mark.parametrize("form", FORMS)
def test_leaving_a_sliding_mode_exactly(form: str, stages: int) -> None:
    """x' = t - sign x from -1/2 meets zero at √2 - 1, slides, and leaves at time 1."""
    options = FesdOptions(tableau=make_tableau("radau_iia", stages), elements=2)
    simulation = simulate(relay(form, TIME + 1, TIME - 1), np.array([-0.5, 0.0]), 5, 2.0, options=options)
    assert simulation.switch_times == pytest.approx([np.sqrt(2) - 1, 1.0], abs=1e-12)
    assert simulation.states[-1] == pytest.approx([0.5, 2.0], abs=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_a_product_of_two_relays(form: str) -> None:
    """x1' = -sign x1 and x2' = -sign x2 slide one after the other, each with multipliers of its own."""
    x = ca.SX.sym("x", 2)
    first = Subsystem(fields=ca.DM([[1, -1], [0, 0]]), switching=x[0], sign_matrix=SIGNS, name="first")
    second = Subsystem(fields=ca.DM([[0, 0], [1, -1]]), switching=x[1], sign_matrix=SIGNS, name="second")
    simulation = simulate(by_regions(form, Model(x), [first, second]), np.array([0.35, -0.75]), 4, 1.0)
    assert simulation.states == pytest.approx(
        np.array([[0.35, -0.75], [0.1, -0.5], [0, -0.25], [0, 0], [0, 0]]), abs=1e-12
    )
    assert simulation.switch_times == pytest.approx([0.35, 0.75], abs=1e-12)


QUADRANTS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


@pytest.mark.parametrize("form", FORMS)
def test_two_switches_in_one_step(form: str) -> None:
    """A path through three quadrants in one step of three elements: switches at 1/4 and 3/4."""
    x = ca.SX.sym("x", 2)
    fields = ca.DM([[-1, -1, -1, 0], [-1, -1, 0, 0]])
    system = by_regions(form, Model(x), [Subsystem(fields=fields, switching=x, sign_matrix=QUADRANTS)])
    simulation = simulate(system, np.array([0.25, 0.75]), 1, 1.0, options=FesdOptions(elements=3))
    assert simulation.switch_times == pytest.approx([0.25, 0.75], abs=1e-13)
    assert simulation.states[-1] == pytest.approx([-0.75, 0.0], abs=1e-13)
    assert simulation.reports[0].switches == 2


@pytest.mark.parametrize("form", FORMS)
def test_crossing_a_surface_while_sliding_on_another(form: str) -> None:
    """Sliding on x2 = 0 with speed 1, x1 changes sign at 1/2 and from then on the speed is 2."""
    x = ca.SX.sym("x", 2)
    fields = ca.DM([[2, 1, 1, 2], [-1, -1, 1, 1]])
    system = by_regions(form, Model(x), [Subsystem(fields=fields, switching=x, sign_matrix=QUADRANTS)])
    simulation = simulate(system, np.array([-0.75, 0.25]), 4, 1.5)
    assert simulation.states[-1] == pytest.approx([1.5, 0.0], abs=1e-12)
    assert simulation.switch_times == pytest.approx([0.25, 0.75], abs=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_the_scheme_agree(form: str) -> None:
    """Integral, differential and lifted form describe one scheme: same switch, same states."""
    simulations = [
        simulate(
            planar_oscillator(form), np.array([np.exp(-1), 0.0]), 10, np.pi / 2,
            options=FesdOptions(tableau=make_tableau("radau_iia", 3), elements=3, form=variables),
        )
        for variables in get_args(Form)
    ]  # fmt: skip
    for other in simulations[1:]:
        assert other.states == pytest.approx(simulations[0].states, abs=1e-12)
        assert other.switch_times == pytest.approx(simulations[0].switch_times, abs=1e-13)


@pytest.mark.parametrize("variables", get_args(Form))
def test_forms_agree_by_homotopy(variables: Form) -> None:
    """Steps that a cost chooses are found by relaxed problems, in every form, as accurate as these are."""
    options = FesdOptions(
        tableau=make_tableau("radau_iia", 3), elements=4, form=variables, step_equilibration="difference"
    )
    simulation = simulate(planar_oscillator("stewart"), np.array([np.exp(-1), 0.0]), 10, np.pi / 2, options=options)
    assert {report.method.split(",")[0] for report in simulation.reports} == {"homotopy"}
    assert simulation.states[-1] == pytest.approx(END, abs=1e-4)
    assert simulation.switch_times == pytest.approx([1.0], abs=1e-5)


def test_unequal_steps_are_left_to_the_homotopy() -> None:
    """Steps that are not equal between switches, as a cost on differences wants them, need relaxed problems."""
    options = FesdOptions(elements=4, step_equilibration="difference")
    simulation = simulate(relay("heaviside", 3.0, 1.0), np.array([-1.0, 0.0]), 1, 2.0, options=options)
    assert simulation.reports[0].method.startswith("homotopy")
    assert simulation.states[-1] == pytest.approx([5 / 3, 2.0], abs=1e-7)
