"""Sensitivities of the end state: closed forms, differences of simulations, and those of an optimal solution."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs import ComplementaritySystem, Model, StepFunctions, heaviside
from fesd_robot.errors import ModelError
from fesd_robot.fesd import (
    FesdOptions,
    OptimalControlProblem,
    SimulationSettings,
    Transcription,
    end_sensitivity,
    make_tableau,
    simulate,
)
from fesd_robot.fesd.tableau import Scheme
from fesd_robot.mpcc import HomotopyOptions, Run, solve

from .systems import leaving, oscillator, scalar

SENSITIVITIES = SimulationSettings(sensitivities=True)
EXACT = np.array([[21.669465013239469, -2.0699542713808073], [56.637502490103850, -4.3423475157075602]])
"""e^T R_out J R_in of the oscillator from (1/e, 0) to T = π/2, with the jump J = [[1, 0], [-4π, 1]] at the switch."""


def _options(scheme: Scheme, stages: int, **changes: Any) -> FesdOptions:
    return FesdOptions(tableau=make_tableau(scheme, stages), elements=2, **changes)


def _oscillator_error(steps: int, options: FesdOptions) -> float:
    start = np.array([np.exp(-1), 0.0])
    simulation = simulate(oscillator(), start, steps, np.pi / 2, options=options, settings=SENSITIVITIES)
    assert simulation.sensitivity
    return float(np.abs(simulation.sensitivity.initial - EXACT).max())


@pytest.mark.parametrize(
    ("scheme", "stages", "ideal"),
    [
        ("gauss_legendre", 2, 0.0026296799488536456),
        ("gauss_legendre", 3, 1.108896984776637e-06),
        ("radau_iia", 2, 0.171327894607506),
        ("radau_iia", 3, 5.7949904551697824e-05),
        ("lobatto_iiic", 3, 0.003578407963194921),
        ("runge_kutta_4", 4, 0.01830162142072392),
    ],
)
def test_oscillator_sensitivity_has_the_error_of_the_scheme(scheme: Scheme, stages: int, ideal: float) -> None:
    """With the switch free, the largest error of dx(T)/dx(0) in 34 steps is that of exact arithmetic."""
    assert _oscillator_error(34, _options(scheme, stages)) == pytest.approx(ideal, rel=1e-4)


def test_fixed_steps_have_the_wrong_sensitivity() -> None:
    """Without switch detection the jump at the switch is missing: no convergence to the exact matrix."""
    errors = [_oscillator_error(steps, _options("radau_iia", 3, switch_detection=False)) for steps in (34, 105)]
    assert min(errors) > 1.0


def test_crossing_scales_by_the_ratio_of_the_speeds() -> None:
    """dx(2)/dx(0) of x' = 2 - sign x over the switch is f+ / f- = 1/3; without a switch it is 1."""
    for start, ratio in ((-1.0, 1 / 3), (0.5, 1.0)):
        simulation = simulate(scalar("crossing"), np.array([start]), 3, 2.0, settings=SENSITIVITIES)
        assert simulation.sensitivity and simulation.sensitivity.initial == pytest.approx(
            np.array([[ratio]]), abs=1e-12
        )


def test_sliding_forgets_where_it_came_from() -> None:
    """On the surface the state no longer depends on the start; after leaving at time 1 neither does the end."""
    simulation = simulate(leaving(), np.array([-0.5, 0.0]), 5, 2.0, settings=SENSITIVITIES)
    assert simulation.sensitivity
    assert simulation.sensitivity.initial[:, 0] == pytest.approx([0.0, 0.0], abs=1e-12)


def _relay(curvature: float = 1.0) -> ComplementaritySystem:
    """x' = v, v' = p u + c x² - sign(v): a mass with dry friction, a control and a parameter."""
    x, u, p, alpha = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p"), ca.SX.sym("alpha")
    rate = ca.vertcat(x[1], p * u + curvature * x[0] ** 2 - 2 * alpha + 1)
    return heaviside(Model(x, u, p), StepFunctions(alpha, x[1]), rate)


CONTROLS = np.array([[3.0, -2.0, -3.0, 0.5]])


def _end(x0: np.ndarray, p: float, controls: np.ndarray) -> np.ndarray:
    return simulate(_relay(), x0, controls, 2.0, parameters=np.array([p])).states[-1]


def test_all_derivatives_match_differences() -> None:
    """By initial state, parameter and every control, with a reversal of the motion on the way."""
    x0, p, step = np.array([0.1, 0.3]), 1.2, 1e-6
    simulation = simulate(_relay(), x0, CONTROLS, 2.0, parameters=np.array([p]), settings=SENSITIVITIES)
    assert len(simulation.switch_times) >= 1 and simulation.sensitivity
    for i in range(2):
        ahead, behind = (_end(x0 + sign * step * np.eye(2)[i], p, CONTROLS) for sign in (1, -1))
        assert simulation.sensitivity.initial[:, i] == pytest.approx((ahead - behind) / (2 * step), abs=1e-6)
    ahead, behind = _end(x0, p + step, CONTROLS), _end(x0, p - step, CONTROLS)
    assert simulation.sensitivity.parameters[:, 0] == pytest.approx((ahead - behind) / (2 * step), abs=1e-6)
    for k in range(4):
        change = np.zeros_like(CONTROLS)
        change[0, k] = step
        ahead, behind = _end(x0, p, CONTROLS + change), _end(x0, p, CONTROLS - change)
        assert simulation.sensitivity.controls[k, :, 0] == pytest.approx((ahead - behind) / (2 * step), abs=1e-6)


@pytest.mark.parametrize("form", ["integral", "differential"])
def test_sensitivity_of_an_optimal_solution(form: Any) -> None:
    """The end of an optimal trajectory moves with initial state, parameter and controls as a simulation of it does.

    Without the quadratic term every scheme is exact, whatever the steps are that the optimum leaves open.
    """
    system = _relay(curvature=0.0)
    x0, p = np.array([0.0, -0.5]), 1.2
    problem = OptimalControlProblem(
        system=system, duration=2.0, intervals=4, parameters=np.full((1, 4), p),
        initial_lower=x0, initial_upper=x0,
        terminal_lower=np.array([0.5, 0.3]), terminal_upper=np.array([0.5, 0.3]),
        control_lower=np.array([-5.0]), control_upper=np.array([5.0]),
        state_guess=lambda t: np.array([t / 4, 0.0]), control_guess=np.ones((1, 4)),
        running_cost={"effort": system.control**2},
    )  # fmt: skip
    options = FesdOptions(elements=2, form=form)
    transcription = Transcription(problem, options)
    solution = solve(transcription.problem, Run(HomotopyOptions(tolerance=1e-10, sigma_factor=0.1)))
    assert solution.solved
    sensitivity = end_sensitivity(transcription, solution.w)
    replay = simulate(
        system, x0, transcription.controls(solution.w), 2.0, parameters=np.array([p]), options=options,
        settings=SENSITIVITIES,
    )  # fmt: skip
    assert replay.sensitivity and len(replay.switch_times) >= 1
    assert replay.states[-1] == pytest.approx([0.5, 0.3], abs=1e-6)
    assert sensitivity.initial == pytest.approx(replay.sensitivity.initial, abs=1e-4)
    assert sensitivity.parameters == pytest.approx(replay.sensitivity.parameters, abs=1e-4)
    assert sensitivity.controls == pytest.approx(replay.sensitivity.controls, abs=1e-4)


def test_vanishing_constraints_are_refused() -> None:
    """Active sides do not cover a system with vanishing constraints, so there is no derivative to give."""
    x, alpha, free = ca.SX.sym("x"), ca.SX.sym("alpha"), ca.SX.sym("free")
    system = heaviside(
        Model(x), StepFunctions(alpha, x), 1 - alpha, lifted=[("free", free, alpha)],
        vanishing=[Complementarity(Label("none above"), x, free, vanishing=True)],
    )  # fmt: skip
    with pytest.raises(ModelError, match=r"sensitivities need pairs 0 <= G _\|_ H >= 0 only"):
        simulate(system, np.array([-1.0]), 1, 1.0, settings=SENSITIVITIES)
