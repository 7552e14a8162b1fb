"""Step equilibration: steps are equal exactly where no switch is between them."""

from __future__ import annotations

from typing import Any, get_args

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs import Model, StepFunctions, heaviside
from fesd_robot.errors import ModelError
from fesd_robot.fesd import FesdOptions, StepEquilibration, Transcription, initial_value_problem, make_tableau
from fesd_robot.fesd.equilibration import indicator
from fesd_robot.mpcc import HomotopyOptions, Run, solve

from .systems import scalar

EXACT = ("difference_tanh", "difference_product", "direct", "linear_complementarity")


def _solved(kind: str, mode: StepEquilibration, stages: int = 2) -> tuple[Transcription, np.ndarray]:
    """Four elements over two seconds, from -1 with a crossing at 1/3, or from -1/2 with sliding from 1/2 on."""
    problem = initial_value_problem(scalar(kind), [-1.0 if kind == "crossing" else -0.5], 2.0)
    options = FesdOptions(tableau=make_tableau("radau_iia", stages), elements=4, step_equilibration=mode)
    transcription = Transcription(problem, options)
    solution = solve(transcription.problem, Run(HomotopyOptions(tolerance=1e-9, sigma_start=1.0, sigma_factor=0.1)))
    assert solution.solved
    return transcription, solution.w


@pytest.mark.parametrize("mode", get_args(StepEquilibration))
@pytest.mark.parametrize(("kind", "switch", "end"), [("crossing", 1 / 3, 5 / 3), ("sliding", 0.5, 0.0)])
def test_every_mode_finds_the_switch(kind: str, switch: float, end: float, mode: StepEquilibration) -> None:
    """The switch is an element boundary and the end exact; modes with the indicator make steps equal elsewhere."""
    transcription, w = _solved(kind, mode)
    elements = transcription.unpack(w)
    assert elements[-1].x[-1] == pytest.approx([end], abs=1e-7)
    ends = np.array([element.end for element in elements])
    assert np.abs(ends - switch).min() <= 1e-7
    if mode in (*EXACT, "mean"):
        before = np.array(
            [element.step for element in elements if element.end <= switch + 1e-6 and element.step > 1e-6]
        )
        after = np.array([element.step for element in elements if element.start >= switch - 1e-6])
        assert np.ptp(before) <= 1e-5 and np.ptp(after) <= 1e-5


def test_biasing_modes_report_their_size() -> None:
    """The quadratic modes leave a term in the cost where a switch makes the steps unequal; the others do not."""
    for mode in get_args(StepEquilibration):
        transcription, w = _solved("crossing", mode)
        term = transcription.cost_terms(w).get("step equilibration", 0.0)
        assert (term > 1e-2) == (mode in ("mean", "difference")), mode


def _eta(before: list[list[float]], after: list[list[float]]) -> float:
    """eta of two elements given ((lambda_n, lambda_p), (alpha, 1 - alpha)) sums."""
    return float(indicator(tuple(map(ca.DM, before)), tuple(map(ca.DM, after))))  # type: ignore[arg-type]


NEGATIVE, SLIDING, POSITIVE = ([2.0, 0.0], [0.0, 2.0]), ([0.0, 0.0], [0.8, 1.2]), ([0.0, 2.0], [2.0, 0.0])


@pytest.mark.parametrize("state", [NEGATIVE, SLIDING, POSITIVE])
def test_indicator_is_positive_without_a_switch(state: Any) -> None:
    """On either side and in a sliding mode, where all multipliers vanish, the Heaviside indicator stays positive."""
    assert _eta(state, state) > 0.1


@pytest.mark.parametrize(
    ("before", "after"),
    [(NEGATIVE, POSITIVE), (POSITIVE, NEGATIVE), (NEGATIVE, SLIDING), (SLIDING, POSITIVE), (SLIDING, NEGATIVE)],
)
def test_indicator_vanishes_at_every_switch(before: Any, after: Any) -> None:
    """Crossing, entering and leaving a sliding mode make a factor zero."""
    assert _eta(before, after) == 0.0


@pytest.mark.parametrize("stages", [1, 2])
def test_auxiliary_variables_start_consistent(stages: int) -> None:
    """The variables of the linear form fit the steps and multipliers of a solution: no pair and no row is violated."""
    transcription, w = _solved("crossing", "linear_complementarity", stages)
    packed = transcription.pack(transcription.unpack(w))
    residuals = transcription.problem.residuals(packed)
    assert residuals.constraint_violation <= 1e-7 and residuals.complementarity <= 1e-7


@pytest.mark.parametrize("mode", EXACT)
def test_switches_outside_the_pairs_are_refused(mode: StepEquilibration) -> None:
    """A system with vanishing constraints has switches that the indicator does not see."""
    x, alpha, free = ca.SX.sym("x"), ca.SX.sym("alpha"), ca.SX.sym("free")
    system = heaviside(
        Model(x), StepFunctions(alpha, x), 1 - alpha, lifted=[("free", free, alpha)],
        vanishing=[Complementarity(Label("none above"), x, free, vanishing=True)],
    )  # fmt: skip
    transcription = Transcription(initial_value_problem(system, [-1.0], 1.0), FesdOptions(step_equilibration=mode))
    with pytest.raises(ModelError, match=rf"'{mode}' needs every switch in a complementarity pair"):
        _ = transcription.problem
