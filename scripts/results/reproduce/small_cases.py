"""Small systems whose solutions have closed forms: switching, sliding, dry friction, impacts by time freezing.

    python scripts/results/reproduce/small_cases.py
    python scripts/results/reproduce/small_cases.py --quick

Every case is written down once, as regions with a vector field each, and integrated in the form of Stewart and with
set-valued step functions. Where solutions are polynomials that the schemes represent, the difference is round-off;
elsewhere the difference is that of the scheme, for which an estimate is printed beside it.
"""

from __future__ import annotations

from scripts.results.reproduce._common import Report, markdown_table, number, plt  # isort: skip  # sets OMP_NUM_THREADS before numpy is imported

import math
from collections.abc import Iterator, Sequence

import numpy as np

from fesd_robot.fesd import FesdOptions, Simulation, SimulationError, make_tableau, simulate
from scripts.results.reproduce._closed_forms import Case, order
from scripts.results.reproduce._switching_cases import (
    crossing,
    leaving,
    mass_spring,
    sliding,
    stick_slip,
    two_coordinates,
)
from scripts.results.reproduce._time_freezing_cases import bouncing_ball, frictional_mass

ROUND_OFF = 1e-9
"""Largest difference where the scheme is exact."""
FORMS_AGREE = 1e-10
"""Largest difference between the two forms."""
MARGIN = 3.0
"""Where the scheme is not exact, a difference may be this many times its estimated error."""
SCHEMES = (("radau_iia", 2), ("radau_iia", 3), ("gauss_legendre", 2), ("gauss_legendre", 3))
TITLES = {"radau_iia": "Radau IIA", "gauss_legendre": "Gauss–Legendre"}
FORMS = ("Stewart", "step functions")


def cases() -> list[Case]:
    """Return all cases."""
    return [
        crossing(),
        sliding(),
        leaving(),
        two_coordinates(),
        mass_spring(),
        stick_slip(),
        frictional_mass(10.0),
        frictional_mass(100.0),
        bouncing_ball(0.8, 1.0, 3.0),
        bouncing_ball(0.5, 0.9, 2.0),
        bouncing_ball(1.0, 0.8, 2.0),
    ]


def run(case: Case, form: str, scheme: str, stages: int) -> Simulation:
    """Simulate a case."""
    return simulate(
        case.systems[form],
        np.array(case.initial),
        case.steps,
        case.duration,
        # One element may take a whole step: in a step with several switches the lengths are far from equal.
        options=FesdOptions(make_tableau(scheme, stages), elements=case.elements, step_freedom=case.elements - 1.0),
    )


def label(scheme: str, stages: int) -> str:
    """Return the name of a scheme with its order."""
    return f"{TITLES[scheme]} {order(scheme, stages)}"


def shown(difference: float) -> str:
    """Return a difference for a table; a dash where there is nothing to compare."""
    return number(difference if math.isfinite(difference) else None, 1)


def try_all(case: Case, schemes: Sequence[tuple[str, int]]) -> Iterator[tuple[str, str, int, Simulation | str]]:
    """Run a case in all forms and schemes; a step that is not solved gives its message."""
    for scheme, stages in schemes:
        for form in FORMS:
            try:
                yield form, scheme, stages, run(case, form, scheme, stages)
            except SimulationError as error:
                yield form, scheme, stages, str(error)


def study(case: Case, schemes: Sequence[tuple[str, int]], report: Report) -> Simulation | None:
    """Compare a case with its closed forms; return a simulation for the figure."""
    simulations: dict[tuple[str, str, int], Simulation] = {}
    notes = []
    for form, scheme, stages, result in try_all(case, schemes):
        which = f"{form}, {label(scheme, stages)}"
        if isinstance(result, str):
            notes.append(f"{which}: {result}.")
            continue
        simulations[form, scheme, stages] = result
        others = [f"step {r.step} by {r.method}" for r in result.reports if r.method != "modes"]
        if others:
            notes.append(f"{which}: {', '.join(others)}.")
    measured = {key: case.measure(simulation) for key, simulation in simulations.items()}
    estimates = {pair: case.estimate(*pair) for pair in schemes}

    def worst(name: str, scheme: str, stages: int) -> float:
        values = [measured[form, scheme, stages][name] for form in FORMS if (form, scheme, stages) in measured]
        return max((math.inf if v != v else abs(v - case.exact[name]) for v in values), default=math.inf)

    def allowed(name: str, scheme: str, stages: int) -> float:
        return ROUND_OFF + MARGIN * estimates[scheme, stages].get(name, 0.0)

    def between_forms(name: str) -> float:
        pairs = [[measured.get((form, *pair), {}).get(name, math.nan) for form in FORMS] for pair in schemes]
        return max(abs(a - b) for a, b in pairs) if np.isfinite(pairs).all() else math.inf

    best = next((key for key in measured if key[1:] == ("radau_iia", 3)), next(iter(measured), None))
    rows = [
        [
            name,
            f"{value:.15g}",
            f"{measured[best][name]:.15g}".replace("nan", "not found") if best else "–",
            *(shown(worst(name, *pair)) for pair in schemes),
            shown(between_forms(name)),
        ]
        for name, value in case.exact.items()
    ]
    inexact = any(any(values.values()) for values in estimates.values())
    if inexact:
        largest = [max(estimates[pair].values()) for pair in schemes]
        rows.append(["largest estimated error", "", "", *(shown(value) for value in largest), ""])
    header = [
        "quantity",
        "closed form",
        f"ours, {label(*best[1:])}" if best else "ours",
        *(label(*pair) for pair in schemes),
        "Stewart – steps",
    ]
    report.add(f"## {case.name}\n\n{case.about}; {case.steps} steps of {case.elements} elements.")
    report.add(markdown_table(header, rows))
    if notes:
        report.add("\n".join(f"- {note}" for note in notes))

    late = [
        (worst(name, *pair), name, pair)
        for pair in schemes
        for name in case.exact
        if not worst(name, *pair) <= allowed(name, *pair)
    ]
    bound = f"{MARGIN:g} times the estimated error" if inexact else f"{ROUND_OFF:g}"
    more = ""
    if late:
        size, name, pair = max(late)
        found_out = f"differs by {size:.1e}" if math.isfinite(size) else "was not found"
        more = f" ({len(late)} are not: {name} {found_out} with {label(*pair)})"
    report.check(f"{case.name}: every difference is within {bound}{more}", not late)
    apart = []
    for pair in schemes:
        one, other = (simulations.get((form, *pair)) for form in FORMS)
        if one is not None and other is not None:
            apart.append(np.abs(one.states - other.states).max())
    gap = max(*(between_forms(name) for name in case.exact), *apart)
    report.check(f"{case.name}: both forms agree to {FORMS_AGREE:g}, found {gap:.0e}", gap <= FORMS_AGREE)
    return simulations[best] if best else None


def draw(chosen: Sequence[tuple[Case, Simulation]], report: Report) -> None:
    """Draw one panel a case."""
    columns = 3
    lines = math.ceil(len(chosen) / columns)
    figure, axes = plt.subplots(lines, columns, figsize=(11, 2.3 * lines), layout="constrained", squeeze=False)
    for axis in axes.flat[len(chosen) :]:
        axis.remove()
    for axis, (case, simulation) in zip(axes.flat, chosen, strict=False):
        times = np.unique(np.concatenate([np.linspace(0, case.duration, 800), simulation.switch_times]))
        states = simulation.at(times)
        physical, switch = times, simulation.switch_times
        if case.clock is not None:
            physical = states[:, case.clock]
            switch = simulation.at(switch)[:, case.clock]
            moving = np.append(True, np.diff(physical) > 1e-9)
            for index in case.curves.values():  # what happens in frozen time is a jump in physical time
                if index < case.clock // 2:
                    states[~moving, index] = np.interp(physical[~moving], physical[moving], states[moving, index])
        for i, (name, index) in enumerate(case.curves.items()):
            axis.plot(physical, states[:, index], label=name.replace("_", ""), color=f"C{i}", zorder=3)
        for time in np.unique(switch.round(9)):
            axis.axvline(time, color="0.55", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        axis.set_title(case.name, fontsize=9, loc="left")
        axis.set_xlabel("physical time" if case.clock is not None else "time")
        axis.margins(x=0.01)
        if len(case.curves) > 1:
            outside = {"loc": "lower right", "bbox_to_anchor": (1.02, 0.97)} if len(case.curves) == 2 else {}
            axis.legend(ncols=2, handlelength=1.2, columnspacing=0.8, fontsize=8, **outside)
    report.figure(
        figure, "States over time, physical time where it is frozen in between; dashed lines are the switches found."
    )


def main() -> None:
    """Run all cases."""
    report = Report("small_cases", "Small systems with closed forms", __doc__ or "")
    arguments = report.parse()
    schemes = [SCHEMES[1], SCHEMES[2]] if arguments.quick else list(SCHEMES)
    report.add(
        "Every case is one set of regions with a vector field each, integrated in the form of Stewart and with "
        "set-valued step functions. Columns of a scheme (named with its order) show the larger of the two forms' "
        "absolute differences to the closed form, the last column the difference between the forms over all "
        "schemes.\n\n"
        "Where a solution is piecewise polynomial the schemes represent it exactly, and only round-off remains. "
        "Otherwise the difference is the error of the scheme, and its estimate from the leading error term stands "
        "below. The end of a sliding mode is found from the Filippov multipliers at the stages, extrapolated to the "
        "end of the element: exactly where that is a stage, else with an order equal to the number of stages "
        "(stick-slip with Gauss–Legendre).\n\n"
        "Impacts are modelled by time-freezing: during a phase of numerical time the clock stands still and the floor "
        "changes the velocity. In elastic impacts the floor is a damped spring during that phase. The error of "
        "integrating its oscillation remains; with Gauss–Legendre it is in the duration alone if there is no damping. "
        "Impulses at element boundaries would not have this error."
    )
    chosen = []
    for case in cases():
        simulation = study(case, schemes, report)
        if simulation is not None:
            chosen.append((case, simulation))
    draw(chosen, report)
    report.close()


if __name__ == "__main__":
    main()
