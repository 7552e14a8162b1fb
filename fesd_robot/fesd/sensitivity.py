"""Derivatives of the end state, chained over intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import DimensionError, ModelError
from fesd_robot.fesd.modes import ModeEquations
from fesd_robot.fesd.simulation import Sensitivity
from fesd_robot.fesd.transcription import Transcription

Derivatives = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Of the end of an interval by its initial state, its control and the parameters."""


def chain(intervals: Sequence[Derivatives], parameters: int) -> Sensitivity:
    """Return the derivatives of the end state from those of the intervals.

    ``dx_N/dx_0 = S_N ... S_1``, ``dx_N/du_k = S_N ... S_{k+1} U_k``, ``dx_N/dp = sum_k S_N ... S_{k+1} P_k``.

    Args:
        intervals: (S_k, U_k, P_k) in time order.
        parameters: n_p.
    """
    n_x = intervals[0][0].shape[0]
    after, by_parameters = np.eye(n_x), np.zeros((n_x, parameters))
    by_controls = []
    for by_left, by_control, by_parameter in reversed(intervals):
        by_controls.append(after @ by_control)
        by_parameters += after @ by_parameter
        after = after @ by_left
    return Sensitivity(initial=after, parameters=by_parameters, controls=np.array(by_controls[::-1]))


@checked
def end_sensitivity(transcription: Transcription, w: np.ndarray) -> Sensitivity:
    """Return the derivatives of the end state of a solved optimal control problem, its switches moving along.

    With the active sides of all pairs held, every interval is a square system of its own variables; the implicit
    function theorem gives its derivatives by the state it starts from, its control and its parameters. The derivative
    by the parameters is that of parameters which change by the same amount in all intervals.

    Args:
        transcription: the problem.
        w: a solution, (n).

    Raises:
        DimensionError: w of another shape.
        ModelError: the system has vanishing constraints, which the active sides do not cover.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.5, Theorem 19.
    """
    if np.shape(w) != transcription.problem.start.shape:
        raise DimensionError(f"w has shape {np.shape(w)}, expected {transcription.problem.start.shape}")
    system = transcription.ocp.system
    if not system.switches_in_pairs:
        raise ModelError("sensitivities need pairs 0 <= G _|_ H >= 0 only; this system has vanishing constraints")
    n_x, length = system.state.numel(), transcription.ocp.duration / transcription.ocp.intervals
    equations = {count: ModeEquations(system, transcription.options, count) for count in set(transcription.elements)}
    derivatives = []
    for k, count in enumerate(transcription.elements):
        own, left = transcription.interval_variables(w, k)
        p, interval = transcription.ocp.parameters[:, k], equations[count]
        modes = interval.read_modes(own, left[:n_x], p)
        derivatives.append(interval.sensitivity(own, modes, left[:n_x], p, length))
    return chain(derivatives, system.parameters.numel())
