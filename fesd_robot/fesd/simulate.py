"""Integration of a complementarity system step by step, every switch located exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError, ModelError, OptionError
from fesd_robot.fesd.mode_sequence import StepInput
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.sensitivity import chain
from fesd_robot.fesd.simulation import Sensitivity, Simulation, SimulationError, StepReport
from fesd_robot.fesd.stepper import SimulationSettings, StepFailure, Stepper
from fesd_robot.fesd.trajectory import Element, interval_elements


def simulate(
    system: ComplementaritySystem,
    initial: np.ndarray,
    controls: np.ndarray | int,
    duration: float,
    *,
    parameters: np.ndarray | None = None,
    options: FesdOptions | None = None,
    settings: SimulationSettings | None = None,
    progress: Callable[[StepReport], None] | None = None,
) -> Simulation:
    """Integrate E x' = f(x, u, z) over `duration` in equal simulation steps.

    Each step is one control interval of finite elements whose lengths are free. Its modes are first looked for from
    those of the step before, each trial a square system that Newton's method solves to round-off (`ModeSearch`); the
    complementarity products then vanish exactly. Where that finds nothing, and for systems with vanishing constraints,
    the step is solved as an MPCC by homotopy, from several starts, and its result is then solved exactly if possible.

    Args:
        system: the dynamics.
        initial: x(0), (n_x).
        controls: u of every step, (n_u, steps); or the number of steps if the system has no control.
        duration: numerical time of all steps.
        parameters: values of the system's parameters, (n_p).
        options: elements per step, scheme, form, equilibration; 2 elements of Radau IIA with 2 stages if omitted. Left
            out, the form is the differential one, whose round-off is the smallest.
        settings: tolerances, bounds of the state, homotopy of a step, and whether to compute sensitivities.
        progress: called after every step.

    Raises:
        DimensionError: an argument of the wrong shape.
        OptionError: an argument of another type.
        ModelError: an empty horizon, values that are not finite, or sensitivities of a system with vanishing
            constraints.
        SimulationError: a step was not solved; the message names its time, state and residual, the exception keeps
            what was computed.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.
    """
    for name, value, kind, example in (
        ("system", system, ComplementaritySystem, "as stewart, heaviside and heaviside_from_regions return it"),
        ("options", options, FesdOptions, "such as FesdOptions(make_tableau('radau_iia', 3), elements=2)"),
        ("settings", settings, SimulationSettings, "such as SimulationSettings(tolerance=1e-10)"),
    ):
        if not isinstance(value, kind) and (value is not None or name == "system"):
            raise OptionError(f"{name} is a {type(value).__name__}, must be {kind.__name__}, {example}")
    settings = settings or SimulationSettings()
    options = (options or FesdOptions(elements=2)).with_form("integral" if system.vanishing else "differential")
    controls, x, p = _checked(system, initial, controls, duration, parameters)
    if not isinstance(options.elements, int):
        raise DimensionError(f"a simulation needs one number of elements for all steps, found {options.elements}")
    if options.step_freedom is None:
        options = replace(options, step_freedom=max(options.elements - 1.0, 1.0))
    if settings.sensitivities and system.vanishing:
        raise ModelError("sensitivities need pairs 0 <= G _|_ H >= 0 only; this system has vanishing constraints")
    stepper = Stepper(system, options, duration / controls.shape[1], settings)
    steps = controls.shape[1]
    times = np.linspace(0.0, duration, steps + 1)
    integrals = ca.Function("quadratures", system.arguments, [ca.vertcat(*system.quadratures.values(), ca.SX(0, 1))])
    z = np.asarray(system.guess(x, controls[:, 0], p), dtype=float)
    elements: list[Element] = []
    modes: list[np.ndarray] = []
    states, totals = [x], [np.zeros(len(system.quadratures))]
    reports: list[StepReport] = []
    derivatives = []

    def result(sensitivity: Sensitivity | None = None) -> Simulation:
        quadratures = dict(zip(system.quadratures, np.array(totals).T, strict=True))
        ends = times[: len(states)]
        return Simulation(
            system, options.tableau, elements, modes, ends, np.array(states), quadratures, reports, sensitivity
        )

    for k in range(steps):
        step = StepInput(x, z, controls[:, k], p, stepper.length)
        solved = stepper.solve(step, modes[-1:])
        if isinstance(solved, StepFailure):
            raise SimulationError(
                f"simulation step {k} at time {times[k]:.6g} was not solved ({solved.reason}); "
                f"state {np.array2string(x, precision=6)}, residual {solved.residual:.1e}",
                result(), step=k, time=float(times[k]), state=x, residual=solved.residual,
            )  # fmt: skip
        if settings.sensitivities:
            derivatives.append(stepper.equations.sensitivity(solved.own, solved.modes, x, p, stepper.length))
        new = interval_elements(
            stepper.equations.layout, stepper.search.states, solved.own, np.concatenate([x, z]),
            interval=k, start=float(times[k]),
        )  # fmt: skip
        elements += new
        modes += list(stepper.last_of_elements(solved.modes))
        totals.append(totals[-1] + _integrals(integrals, options, new, p))
        end = solved.own[stepper.equations.layout.end(stepper.equations.elements - 1)]
        x, z = end[: len(x)], end[len(x) :]
        states.append(x)
        switches = int((np.diff(np.array(modes[-len(new) - 1 :]), axis=0) != 0).any(axis=1).sum())
        how = (solved.method, solved.trials, solved.iterations, solved.residual)
        reports.append(StepReport(k, steps, float(times[k + 1]), *how, switches))
        if progress:
            progress(reports[-1])
    return result(chain(derivatives, len(p)) if settings.sensitivities else None)


def _integrals(function: ca.Function, options: FesdOptions, elements: list[Element], p: np.ndarray) -> np.ndarray:
    total = np.zeros(function.size1_out(0))
    if total.size:
        for element in elements:
            for weight, x, z in zip(options.tableau.b, element.x, element.z, strict=False):
                total += element.step * weight * np.asarray(function(x, element.u, z, p)).ravel()
    return total


def _checked(
    system: ComplementaritySystem,
    initial: np.ndarray,
    controls: np.ndarray | int,
    duration: float,
    parameters: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n_x, n_u, n_p = system.state.numel(), system.control.numel(), system.parameters.numel()
    if np.shape(initial) != (n_x,):
        raise DimensionError(f"initial has shape {np.shape(initial)}, expected ({n_x},)")
    if isinstance(controls, int | np.integer):
        if n_u:
            raise DimensionError(f"controls is the number {controls}, expected an array of shape ({n_u}, steps)")
        controls = np.zeros((0, max(int(controls), 0)))
    if np.ndim(controls) != 2 or controls.shape[0] != n_u:
        raise DimensionError(f"controls has shape {np.shape(controls)}, expected ({n_u}, steps)")
    if not controls.shape[1] or not np.isfinite(duration) or duration <= 0:
        raise ModelError(
            f"empty horizon: {controls.shape[1]} steps over a duration of {duration:g}, need at least one step and a "
            "positive duration"
        )
    u, x = np.asarray(controls, dtype=float), np.asarray(initial, dtype=float)
    p = np.zeros(0) if parameters is None else np.asarray(parameters, dtype=float)
    if p.size != n_p:
        raise DimensionError(f"parameters has shape {p.shape}, expected ({n_p},)")
    for what, value, names in (
        ("initial", x, system.state_names),
        ("controls", u, system.control_names),
        ("parameters", p, None),
    ):
        bad = np.argwhere(~np.isfinite(value))
        if bad.size:
            entry = f" of {names[bad[0][0]]}" if names is not None else ""
            where = f"[{', '.join(str(i) for i in bad[0])}]"
            raise ModelError(f"{what}{where}{entry} is {value[tuple(bad[0])]}, must be finite")
    return u, x, p.ravel()
