"""Simulation finds every switch: closed forms, published accuracy, order of convergence, and errors that say where."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import Model, StepFunctions, heaviside
from fesd_robot.errors import DimensionError
from fesd_robot.fesd import FesdOptions, Simulation, SimulationError, SimulationSettings, make_tableau, simulate
from fesd_robot.fesd.tableau import Scheme
from fesd_robot.mpcc import HomotopyOptions

from .systems import driven, leaving, oscillator, scalar

SCHEMES: list[tuple[Scheme, int]] = [
    (scheme, stages) for scheme in ("radau_iia", "gauss_legendre") for stages in (1, 2, 3)
]
each_scheme = pytest.mark.parametrize(("scheme", "stages"), SCHEMES, ids=[f"{s}-{n}" for s, n in SCHEMES])


def _options(scheme: Scheme, stages: int, elements: int = 2) -> FesdOptions:
    return FesdOptions(tableau=make_tableau(scheme, stages), elements=elements)


SETTINGS = SimulationSettings(homotopy=HomotopyOptions(tolerance=1e-10, max_iterations=200))


def _no_control(steps: int) -> np.ndarray:
    return np.zeros((0, steps))


def _alphas(simulation: Simulation, stages: int) -> np.ndarray:
    """alpha at the stages of every element."""
    return np.array([element.z[:stages, 0] for element in simulation.elements])


@each_scheme
@pytest.mark.parametrize("steps", [1, 3])
def test_crossing(scheme: Scheme, stages: int, steps: int) -> None:
    """x' = 2 - sign x from -1 crosses zero at 1/3 and reaches 5/3 at 2; the crossing is an element boundary."""
    simulation = simulate(
        scalar("crossing"),
        np.array([-1.0]),
        _no_control(steps),
        2.0,
        options=_options(scheme, stages),
        settings=SETTINGS,
    )
    assert simulation.states[-1] == pytest.approx([5 / 3], abs=1e-8)
    starts = [element.start for element in simulation.elements]
    assert min(abs(start - 1 / 3) for start in starts) <= 1e-8
    alphas = _alphas(simulation, stages)
    before = np.array(starts) < 1 / 3 - 1e-6
    assert alphas[before] == pytest.approx(0, abs=1e-7)
    assert alphas[~before] == pytest.approx(1, abs=1e-7)


@each_scheme
def test_sliding(scheme: Scheme, stages: int) -> None:
    """x' = -sign x from -1/2 arrives at zero at 1/2 and stays there with alpha = 1/2."""
    simulation = simulate(
        scalar("sliding"), np.array([-0.5]), _no_control(3), 1.0, options=_options(scheme, stages), settings=SETTINGS
    )
    assert simulation.states[1:, 0] == pytest.approx([-0.5 + 1 / 3, 0, 0], abs=1e-8)
    starts = np.array([element.start for element in simulation.elements])
    assert np.abs(starts - 0.5).min() <= 1e-8
    alphas = _alphas(simulation, stages)
    assert alphas[starts < 0.5 - 1e-6] == pytest.approx(0, abs=1e-7)
    assert alphas[starts >= 0.5 - 1e-6] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("scheme", "stages"), [(s, n) for s, n in SCHEMES if (s, n) != ("radau_iia", 1)])
def test_leaving_a_sliding_mode(scheme: Scheme, stages: int) -> None:
    """x' = t - sign x from -1/2 meets zero at √2 - 1, slides with alpha = (1 + t)/2, leaves at 1, and ends at 1/2.

    A scheme with one stage knows alpha as a constant of each element and leaves half a step late: x is off by h²/2.
    """
    simulation = simulate(
        leaving(), np.array([-0.5, 0.0]), _no_control(5), 2.0, options=_options(scheme, stages), settings=SETTINGS
    )
    late = 0.2 if stages == 1 else 0.0
    assert simulation.states[-1] == pytest.approx([0.5 - late**2 / 2, 2.0], abs=1e-12)
    assert simulation.switch_times == pytest.approx([np.sqrt(2) - 1, 1 + late], abs=1e-12)
    for element in simulation.elements:
        if np.sqrt(2) - 1 - 1e-6 <= element.start < 1 + late - 1e-3:
            times = element.start + element.step * make_tableau(scheme, stages).c
            assert element.z[:stages, 0] == pytest.approx((1 + times) / 2, abs=1e-5)


def test_two_switches_of_a_product() -> None:
    """Two independent coordinates with x' = -sign x slide one after the other, each on its own step."""
    x, alpha = ca.SX.sym("x", 2), ca.SX.sym("alpha", 2)
    system = heaviside(Model(x), StepFunctions(alpha, x), 1 - 2 * alpha)
    simulation = simulate(system, np.array([0.35, -0.75]), _no_control(4), 1.0, options=_options("radau_iia", 2))
    assert simulation.states == pytest.approx(
        np.array([[0.35, -0.75], [0.1, -0.5], [0, -0.25], [0, 0], [0, 0]]), abs=1e-8
    )
    starts = [element.start for element in simulation.elements]
    assert min(abs(start - 0.35) for start in starts) <= 1e-8


EXACT = np.array([-1.5974603774506981221, 0.76149362060601145276])
IDEAL = {
    ("radau_iia", 1): {10: 1.4582360947024964},
    ("radau_iia", 2): {10: 0.2096410181564187, 34: 0.005272843808821775},
    ("radau_iia", 3): {10: 0.00037527138509184095, 34: 8.805769876722598e-07},
    ("gauss_legendre", 1): {10: 1.3407524990899788, 34: 0.1086213051755523},
    ("gauss_legendre", 2): {10: 0.007740419651690772, 34: 6.302850663401185e-05},
    ("gauss_legendre", 3): {10: 1.7749735346579376e-05, 34: 1.3089660148175503e-08},
}
"""Max-norm error of x(π/2) by number of simulation steps, of each scheme in exact arithmetic with exact switches."""


@cache
def _oscillation(scheme: Scheme, stages: int, steps: int) -> Simulation:
    return simulate(
        oscillator(),
        np.array([np.exp(-1), 0.0]),
        _no_control(steps),
        np.pi / 2,
        options=_options(scheme, stages),
        settings=SimulationSettings(homotopy=HomotopyOptions(tolerance=1e-12, max_iterations=200)),
    )


def _error(scheme: Scheme, stages: int, steps: int) -> float:
    return float(np.abs(_oscillation(scheme, stages, steps).states[-1] - EXACT).max())


@each_scheme
def test_oscillator_error_is_that_of_the_scheme(scheme: Scheme, stages: int) -> None:
    """With two elements a step the oscillator ends as near as the scheme allows with its switch located exactly."""
    for steps, ideal in IDEAL[scheme, stages].items():
        assert _error(scheme, stages, steps) == pytest.approx(ideal, rel=0.01)


@pytest.mark.parametrize(("scheme", "stages"), SCHEMES[1:])
def test_oscillator_converges_with_the_order(scheme: Scheme, stages: int) -> None:
    """The error falls like h^p, up to where the switch falls in its step (implicit Euler needs more steps for it)."""
    slope = np.log(_error(scheme, stages, 10) / _error(scheme, stages, 34)) / np.log(3.4)
    assert slope >= make_tableau(scheme, stages).order - 0.3


@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 3), ("gauss_legendre", 3)])
def test_the_switch_is_found_with_the_order(scheme: Scheme, stages: int) -> None:
    """An element starts where the oscillator crosses the unit circle, at t = 1, and alpha changes nowhere else."""
    simulation = _oscillation(scheme, stages, 34)
    boundary = min(simulation.elements, key=lambda element: abs(element.start - 1))
    assert abs(boundary.start - 1) <= 1e-6
    assert np.linalg.norm(boundary.x_left) == pytest.approx(1, abs=1e-8)
    alphas = _alphas(simulation, stages)
    first = simulation.elements.index(boundary)
    assert alphas[:first] == pytest.approx(0, abs=1e-6) and alphas[first:] == pytest.approx(1, abs=1e-6)


def test_fixed_steps_have_no_switch_inside() -> None:
    """Cross complementarity with fixed steps allows a switch on the grid only; elsewhere a step has no solution."""
    options = FesdOptions(elements=2, step_freedom=0.0)
    on_grid = simulate(scalar("crossing"), np.array([-1.0]), _no_control(2), 4 / 3, options=options)
    assert on_grid.states[-1] == pytest.approx([1.0], abs=1e-8)
    with pytest.raises(SimulationError) as caught:
        simulate(scalar("crossing"), np.array([-1.3]), _no_control(3), 1.0, options=options)
    assert "simulation step 1 at time 0.333333 was not solved" in str(caught.value)
    assert len(caught.value.simulation.elements) == 2
    assert caught.value.simulation.elements[-1].x[-1] == pytest.approx([-0.3], abs=1e-8)


def test_elements_are_in_time_order() -> None:
    """Elements carry their step, start where the one before ended, and end in the states of the simulation."""
    simulation = simulate(scalar("crossing"), np.array([-1.0]), _no_control(3), 2.0, options=_options("radau_iia", 2))
    assert [element.interval for element in simulation.elements] == [0, 0, 1, 1, 2, 2]
    assert simulation.states.shape == (4, 1)
    ends = [element.start + element.step for element in simulation.elements]
    assert ends[:-1] == pytest.approx([element.start for element in simulation.elements[1:]], abs=1e-9)
    assert [element.x[-1, 0] for element in simulation.elements[1::2]] == simulation.states[1:, 0].tolist()
    assert [element.x_left[0] for element in simulation.elements[::2]] == pytest.approx(
        simulation.states[:-1, 0], abs=1e-12
    )


def test_controls_parameters_and_mass_matrix() -> None:
    """Each step sees its own control, all see the parameters, and E multiplies the derivative: 2 a' = u + αβ."""
    # a = 1 > 0 and b = 0 > p = -1, so both steps are 1: 2 a' = u + 1, (1 + a²) b' = p - 1 = -2.
    controls = np.array([[1.0, -1.0]])
    simulation = simulate(
        driven(),
        np.array([1.0, 0.0]),
        controls,
        0.4,
        options=_options("gauss_legendre", 2, elements=1),
        parameters=np.array([-1.0]),
    )
    a, b = simulation.states.T
    assert a == pytest.approx([1, 1.2, 1.2], abs=1e-9)
    first = -2 * (np.arctan(1.2) - np.arctan(1.0))
    second = -2 * 0.2 / (1 + 1.2**2)
    assert b == pytest.approx([0, first, first + second], abs=1e-6)
    assert [element.u.tolist() for element in simulation.elements] == controls.T.tolist()


@pytest.mark.parametrize(
    ("initial", "controls", "message"),
    [
        (np.zeros(2), np.zeros((0, 3)), r"initial has shape \(2,\), expected \(1,\)"),
        (np.zeros((1, 1)), np.zeros((0, 3)), r"initial has shape \(1, 1\), expected \(1,\)"),
        (np.zeros(1), np.zeros((1, 3)), r"controls has shape \(1, 3\), expected \(0, steps\)"),
        (np.zeros(1), np.zeros(3), r"controls has shape \(3,\), expected \(0, steps\)"),
    ],
)
def test_wrong_shapes_are_refused(initial: np.ndarray, controls: np.ndarray, message: str) -> None:
    """State and controls of the wrong shape are named with the shape that was expected."""
    with pytest.raises(DimensionError, match=message):
        simulate(scalar("sliding"), initial, controls, 1.0)


def test_a_bound_that_cannot_be_met_is_an_error() -> None:
    """A motion that must pass below its bound is reported with time, state and what was computed before."""
    system = scalar("sliding")
    with pytest.raises(
        SimulationError, match=r"simulation step 1 at time 0\.5 was not solved .*state \[0\.5\]"
    ) as caught:
        simulate(
            system, np.array([1.0]), _no_control(2), 1.0, settings=SimulationSettings(state_lower=np.array([0.25]))
        )
    assert [element.interval for element in caught.value.simulation.elements] == [0, 0]
