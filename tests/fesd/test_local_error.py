"""The estimated local error of elements against the true one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import FesdOptions, Scheme, Transcription, initial_value_problem, make_tableau
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import local_errors, multiplier_errors, with_parts
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, Run, continue_on_branch, solve

from .systems import OMEGA, leaving, oscillator, pressed

OPTIONS = HomotopyOptions(tolerance=1e-6)


def solved(
    system: ComplementaritySystem, initial: list[float], duration: float, scheme: Scheme, stages: int
) -> tuple[Transcription, BranchTranscription, MpccSolution]:
    """Solve an initial value problem exactly with three elements."""
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=3)
    transcription = Transcription(initial_value_problem(system, initial, duration), options)
    polisher = BranchTranscription(transcription)
    solution = solve(transcription.problem, Run(OPTIONS), polisher=polisher)
    assert solution.exact and solution.branch is not None
    return transcription, polisher, solution


@pytest.mark.parametrize(
    ("scheme", "stages"), [("radau_iia", 1), ("radau_iia", 2), ("radau_iia", 3), ("gauss_legendre", 2)]
)
def test_it_is_the_error_against_an_independent_integrator(scheme: Scheme, stages: int) -> None:
    """Inside the unit circle the oscillator is smooth: every element's error is that of DOP853 within a factor of 2."""
    transcription, polisher, solution = solved(oscillator(), [0.3, 0.1], 0.12, scheme, stages)
    estimated = local_errors(BranchMotion.of_solution(polisher, solution))
    elements = transcription.unpack(solution.w)
    inside = np.array([[1, -OMEGA], [OMEGA, 1]])
    scale = 1 + np.max([np.abs(element.x).max(axis=0) for element in elements], axis=0)
    for element, error in zip(elements, estimated, strict=True):
        exact = solve_ivp(lambda t, x: inside @ x, (0, element.step), element.x_left, rtol=1e-12, atol=1e-13).y[:, -1]
        true = (np.abs(exact - element.x[-1]) / scale).max()
        assert 0.5 * true <= error <= 2 * true, (error, true)


def test_what_a_scheme_integrates_exactly_has_no_error() -> None:
    """Parabola and sliding mode are exact with two stages; with one, the parabola is not and the sliding mode is."""
    for stages in (1, 2):
        transcription, polisher, solution = solved(leaving(), [-0.5, 0.0], 0.9, "radau_iia", stages)
        errors = local_errors(BranchMotion.of_solution(polisher, solution))
        sliding = [
            abs(element.x_left[0]) < 1e-9 and element.step > 1e-6 for element in transcription.unpack(solution.w)
        ]
        assert any(sliding) and errors[sliding].max() <= 1e-9
        assert (errors.max() > 1e-3) if stages == 1 else (errors.max() <= 1e-9)


def test_parts_reduce_it_by_the_order_of_the_scheme() -> None:
    """In two parts an element of Radau IIA with two stages makes errors near a sixteenth of its own each."""
    _, polisher, solution = solved(oscillator(), [0.3, 0.1], 0.12, "radau_iia", 2)
    motion = BranchMotion.of_solution(polisher, solution)
    before, finer = local_errors(motion), with_parts(motion, [2, 2, 2])
    again = continue_on_branch(finer.transcription.problem, finer.polisher, finer, solution, Run(OPTIONS))
    assert again is not None and again.exact
    after = local_errors(BranchMotion.of_solution(finer.polisher, again))
    assert 1 / 24 <= after.max() / before.max() <= 1 / 10


def test_multipliers_near_their_bound_have_errors_at_the_ends() -> None:
    """The step alpha = t^2 leaves its bound in the first element: its error there is estimated, others do not count."""
    transcription, polisher, solution = solved(pressed(), [0.0, 0.0], 0.9, "radau_iia", 2)
    errors = multiplier_errors(BranchMotion.of_solution(polisher, solution))
    first, *others = transcription.unpack(solution.w)
    tableau = transcription.options.tableau
    ends = np.array([np.polyfit(tableau.c, element.z[:2, 0], 1) @ [[0, 1], [1, 1]] for element in (first,)])[0]
    true = np.abs(ends - [0.0, first.step**2]).max()
    assert true > 1e-3 and 0.4 * true <= errors[0] <= 2.5 * true
    assert not errors[1:].any() and len(errors) == 1 + len(others)
