"""Integration of a complementarity system step by step, every switch located exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError, ModelError, OptionError
from fesd_robot.fesd.adaptive.span import StepChoice, StepControl, simulate_span, unknown_choice
from fesd_robot.fesd.mode_sequence import StepInput
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.sensitivity import chain
from fesd_robot.fesd.simulation import Note, Sensitivity, Simulation, SimulationError, StepReport
from fesd_robot.fesd.stepper import SimulationSettings, StepFailure, Stepper
from fesd_robot.fesd.trajectory import Element, element_integrals, interval_elements

if TYPE_CHECKING:
    from typing_extensions import Unpack


@checked
def simulate(
    system: ComplementaritySystem,
    initial: np.ndarray,
    controls: np.ndarray | int | tuple[float, float],
    duration: float | None = None,
    *,
    parameters: np.ndarray | None = None,
    options: FesdOptions | None = None,
    settings: SimulationSettings | None = None,
    progress: Callable[[StepReport], None] | None = None,
    **choice: Unpack[StepChoice],
) -> Simulation:
    """Integrate E x' = f(x, u, z) over a span of time, in steps of its own choice or in equal ones.

    ``simulate(system, x0, (t0, t1), rtol=1e-6)`` goes from switch to switch. Steps are as long as an error estimate
    with one more node allows, and end at a switch where there is one; the mode that follows is chosen among all that
    fit the point. `Simulation.notes` says where there are several.

    ``simulate(system, x0, N, duration)`` takes N equal steps. Each is one control interval of finite elements whose
    lengths are free. Its modes are first looked for from those of the step before, each trial a square system that
    Newton's method solves to round-off (`ModeSearch`); the complementarity products then vanish exactly. Where that
    finds nothing, and for systems with vanishing constraints, the step is solved as an MPCC by homotopy, from several
    starts, and its result is then solved exactly if possible.

    Args:
        system: the dynamics.
        initial: x at the start, (n_x).
        controls: (t0, t1) for steps of its own choice; for equal steps u of every step, (n_u, steps), or the number of
            steps if the system has no control.
        duration: numerical time of all equal steps.
        parameters: values of the system's parameters, (n_p).
        options: of equal steps: elements per step, scheme, form, equilibration; 2 elements of Radau IIA with 2 stages
            if omitted. Left out, the form is the differential one, whose round-off is the smallest.
        settings: bounds of the state; of equal steps also tolerances, homotopy, and whether to compute sensitivities.
        progress: called after every step.
        choice: with (t0, t1), all of `StepChoice`: rtol, atol, max_step, tableau, control.

    Raises:
        DimensionError: an argument of the wrong shape.
        OptionError: an argument of another type, outside its range, or for the other kind of steps.
        ModelError: an empty horizon, values that are not finite, or sensitivities of a system with vanishing
            constraints.
        SimulationError: a step was not solved; the message names its time, state and residual, the exception keeps
            what was computed.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.
    """
    settings = settings or SimulationSettings()
    if isinstance(controls, tuple):
        _refuse_together(controls, duration, options, settings)
        span, u, x, p = _checked_span(system, initial, controls, choice.get("control"), parameters)
        step_control = StepControl.of(system, choice)
        bounds = settings.state_bounds(system.state.numel())
        return simulate_span(system, x, span, u, p, step_control, bounds=bounds, progress=progress)
    for name in choice:
        hint = "belongs to a span of time (t0, t1) in place of a number of steps"
        raise OptionError(f"{name} {hint}" if name in StepChoice.__annotations__ else unknown_choice(name))
    if duration is None:
        raise OptionError("duration is missing: give a number of steps and a duration, or a span of time (t0, t1)")
    u, x, p = _checked(system, initial, controls, duration, parameters)
    return _equal_steps(system, x, u, duration, p, options, settings, progress)


def _refuse_together(
    span: tuple[float, float], duration: float | None, options: FesdOptions | None, settings: SimulationSettings
) -> None:
    """Refuse what is about equal steps."""
    given = {"duration": duration is not None, "options": options is not None, "sensitivities": settings.sensitivities}
    for name, is_given in given.items():
        if is_given:
            raise OptionError(f"{name} belongs to a number of equal steps, found the span of time {span} in its place")


def _equal_steps(
    system: ComplementaritySystem,
    x: np.ndarray,
    controls: np.ndarray,
    duration: float,
    p: np.ndarray,
    options: FesdOptions | None,
    settings: SimulationSettings,
    progress: Callable[[StepReport], None] | None,
) -> Simulation:
    options = (options or FesdOptions(elements=2)).with_form("differential" if system.switches_in_pairs else "integral")
    if not isinstance(options.elements, int):
        raise DimensionError(f"a simulation needs one number of elements for all steps, found {options.elements}")
    if options.step_freedom is None:
        options = replace(options, step_freedom=max(options.elements - 1.0, 1.0))
    if settings.sensitivities and not system.switches_in_pairs:
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
    notes: list[Note] = []
    derivatives = []

    def result(sensitivity: Sensitivity | None = None) -> Simulation:
        quadratures = dict(zip(system.quadratures, np.array(totals).T, strict=True))
        ends = times[: len(states)]
        return Simulation(
            system, options.tableau, elements, modes, ends, np.array(states), quadratures, reports, sensitivity, notes
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
        notes += stepper.ambiguities(new, modes[-len(new) - 1 :], p)
        totals.append(totals[-1] + element_integrals(integrals, options.tableau, new, p))
        end = solved.own[stepper.equations.layout.end(stepper.equations.elements - 1)]
        x, z = end[: len(x)], end[len(x) :]
        states.append(x)
        switches = int((~stepper.equations.goes_on(np.array(modes[-len(new) - 1 :]))).sum())
        how = (solved.method, solved.trials, solved.iterations, solved.residual)
        reports.append(StepReport(k, steps, float(times[k + 1]), *how, switches))
        if progress:
            progress(reports[-1])
    return result(chain(derivatives, len(p)) if settings.sensitivities else None)


def _checked_span(
    system: ComplementaritySystem,
    initial: np.ndarray,
    span: tuple[float, float],
    control: np.ndarray | None,
    parameters: np.ndarray | None,
) -> tuple[tuple[float, float], np.ndarray, np.ndarray, np.ndarray]:
    """Return t_0 and t_1, u on the parts of the span (n_u, parts), x and p."""
    if len(span) != 2 or not np.isfinite(span).all() or not span[0] < span[1]:
        raise ModelError(f"the span of time is {span}, must be (t0, t1) with t0 < t1")
    n_u = system.control.numel()
    u = np.zeros((0, 1)) if control is None and not n_u else np.asarray(control, dtype=float)
    if u.ndim == 1:
        u = u[:, None]
    if u.ndim != 2 or u.shape[0] != n_u or not u.shape[1]:
        shape = "None" if control is None else np.shape(control)
        raise DimensionError(f"control has shape {shape}, expected ({n_u},) or ({n_u}, parts)")
    begin, end = (float(time) for time in span)
    u, x, p = _checked(system, initial, u, end - begin, parameters)
    return (begin, end), u, x, p


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
