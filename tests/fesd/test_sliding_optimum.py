"""Optimal control along two surfaces, with a rest where they meet, against the closed form of its optimum."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import Model, Subsystem
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription, make_tableau
from fesd_robot.mpcc import HomotopyOptions, Run, solve

from .systems import by_regions

BEGIN, TARGET = np.array([2 * np.pi / 3, np.pi / 3, 0.0, 0.0]), np.array([-np.pi / 6, -np.pi / 4])
FREE = np.full(2, np.inf)
OPTIMUM = 5.592183296579032
"""Over controls constant on six intervals; arcs are polynomials, the switch times roots of polynomials."""


def problem(form: str) -> OptimalControlProblem:
    """q' = -sign(phi(q)) + v, v' = 2 u, from BEGIN to q = TARGET, cost v^2: arXiv 2205.05337, section 5.3."""
    q, v, u = ca.SX.sym("q", 2), ca.SX.sym("v", 2), ca.SX.sym("u", 2)
    surfaces = (q[0] + 0.15 * q[1] ** 2, q[1] - 0.05 * q[0] ** 3)
    subsystems = [
        Subsystem(
            fields=np.outer(np.eye(4)[i], [-1.0, 1.0]),
            switching=surface,
            sign_matrix=np.array([[1], [-1]]),
            name=f"phi{i + 1}",
        )
        for i, surface in enumerate(surfaces)
    ]
    return OptimalControlProblem(
        system=by_regions(form, Model(ca.vertcat(q, v), u), subsystems, ca.vertcat(v, 2 * u)),
        duration=4.0,
        intervals=6,
        initial_lower=BEGIN,
        initial_upper=BEGIN,
        terminal_lower=np.append(TARGET, -FREE),
        terminal_upper=np.append(TARGET, FREE),
        control_lower=np.full(2, -10.0),
        control_upper=np.full(2, 10.0),
        state_guess=lambda time: np.append(BEGIN[:2] + (TARGET - BEGIN[:2]) * time / 4.0, np.zeros(2)),
        running_cost={"cost": ca.sumsqr(v)},
    )


@pytest.mark.parametrize("form", ["stewart", "heaviside"])
def test_optimum_with_sliding_modes(form: str) -> None:
    """From a straight line at rest the homotopy ends in the optimum that is known in closed form."""
    options = FesdOptions(tableau=make_tableau("radau_iia", 3), elements=3, step_equilibration="difference_tanh")
    transcription = Transcription(problem(form), options)
    solution = solve(
        transcription.problem,
        Run(HomotopyOptions(tolerance=1e-9, sigma_factor=0.1, linear_solver="auto", compile="never")),
    )
    assert solution.solved
    assert transcription.cost_terms(solution.w)["cost"] == pytest.approx(OPTIMUM, rel=1e-6)
