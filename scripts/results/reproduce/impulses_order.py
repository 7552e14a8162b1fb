"""Order of the integration of contact with impulses: bouncing balls, a spring, a bead in a bowl.

    python scripts/results/reproduce/impulses_order.py
    python scripts/results/reproduce/impulses_order.py --quick

The velocity jumps at the boundaries of finite elements by impulses that obey Newton's law of impact. Source: arXiv
2305.17003, section 5.1, Figs. 5 and 6.
"""

from __future__ import annotations

from scripts.results.reproduce._common import Report, legend_below, markdown_table, number, plt, reference  # isort: skip  # first: sets threads

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.figure import Figure

from fesd_robot.fesd import Simulation, SimulationError
from scripts.results.reproduce._impulse_cases import bead, bead_end, bouncing_ball, thrown_mass, two_balls

SCHEMES = tuple(f"{family} {stages}" for family in ("gauss_legendre", "radau_iia") for stages in (1, 2, 3, 4))
TITLES = {"gauss_legendre": "Gauss–Legendre", "radau_iia": "Radau IIA"}
QUICK = (50, 100, 200)
REPRESENTABLE = 1e-11
"""Ideal errors above this are compared digit by digit."""
UNSTABLE = "radau_iia 1"
"""Implicit Euler with steps as long as the spring's period does not converge on this grid."""
READING = 0.03
"""How well a value can be read off the figure."""
BALLS = ((0.8, 1.0, 3.0, 0.53862635070246415, 2.26454211690082138, 4),
         (0.5, 0.9, 2.0, 0.17880625592345556, 0.84540202796172778, 4),
         (1.0, 0.8, 2.0, 0.26074172832705720, -0.16586913583647140, 3))  # fmt: skip
"""Height, restitution, duration, position, velocity and number of impacts of a ball at the end."""
BEAD_STEPS = (10, 20, 40, 80)


def title(scheme: str) -> str:
    """Return a scheme in words."""
    family, stages = scheme.split()
    return f"{TITLES[family]}, {stages}"


def order(scheme: str) -> int:
    """Return the order of a scheme."""
    family, stages = scheme.split()
    return 2 * int(stages) - (family == "radau_iia")


class Experiment:
    """Runs the two balls and keeps the errors, and what was not solved."""

    def __init__(self) -> None:
        self.case, self.known = two_balls(), reference("two_balls")
        self.exact = np.array(self.known["exact"]["end"])
        self.failures: list[str] = []
        self.runs = self.indirect = 0
        self.impacts: dict[tuple[str, int], float] = {}

    def errors(self, scheme: str, grid: Sequence[int]) -> dict[int, float]:
        """Return the error of x(T) by number of steps."""
        errors = {}
        for steps in grid:
            self.runs += 1
            try:
                simulation = self.case.run(scheme, steps)
            except SimulationError as error:
                self.failures.append(f"{title(scheme)}, N = {steps}: {error}")
                continue
            self.indirect += sum(report.method != "modes" for report in simulation.reports)
            errors[steps] = float(np.abs(simulation.states[-1][:4] - self.exact).max())
            times = simulation.switch_times
            if len(times) == len(self.known["exact"]["impacts"]):
                self.impacts[scheme, steps] = float(np.abs(times - self.known["exact"]["impacts"]).max())
        return errors


def table(errors: dict[str, dict[int, float]], known: dict) -> str:
    """Errors beside the ideal and the published ones."""
    rows = []
    for scheme, own in errors.items():
        for i, (steps, error) in enumerate(own.items()):
            ideal, published = (known[key].get(scheme, {}).get(str(steps)) for key in ("ideal", "published"))
            rows.append(
                [
                    *([title(scheme), str(order(scheme))] if not i else ["", ""]),
                    *(str(steps), number(error), number(ideal)),
                    "–" if not ideal else f"{error / ideal:.3f}" if ideal > REPRESENTABLE else "round-off",
                    *(number(published), f"{error / published:.3f}" if published else "–"),
                ]
            )
    header = ["scheme, stages", "p", "N", "x(T)", "ideal", "ours/ideal", "published", "ours/published"]
    return markdown_table(header, rows)


def fitted(scheme: str, errors: dict[int, float]) -> float:
    """Return the fitted order over h below 4e-3, as in the paper, above round-off."""
    chosen = {steps: error for steps, error in errors.items() if steps >= 125 and error > REPRESENTABLE}
    if len(chosen) < 3:
        chosen = {steps: error for steps, error in errors.items() if error > REPRESENTABLE}
    return float(-np.polyfit(np.log(list(chosen)), np.log(list(chosen.values())), 1)[0])


def draw(errors: dict[str, dict[int, float]], known: dict) -> Figure:
    """Errors over the mean step, a column a family; crosses are published."""
    figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.6), sharey=True, layout="constrained")
    for axis, family in zip(axes, TITLES, strict=True):
        for i, scheme in enumerate(scheme for scheme in errors if scheme.startswith(family)):
            own, published = errors[scheme], known["published"].get(scheme, {})
            label = f"{scheme[-1]}, p = {order(scheme)}"
            axis.loglog([0.5 / n for n in own], list(own.values()), f"C{i}o-", label=label)
            axis.loglog([0.5 / int(n) for n in published], list(published.values()), "kx", markersize=5, zorder=5)
        axis.plot([], [], "kx", markersize=5, label="published")
        axis.set_title(TITLES[family])
        axis.set_xlabel("mean step T/(2N)")
        legend_below(axis, "stages, order", 0.2)
    axes[0].set_ylabel("error of x(T)")
    return figure


def balls_table() -> tuple[str, float]:
    """Bouncing balls and the thrown mass beside their closed forms, and the largest difference of the balls."""
    rows, worst = [], 0.0
    for height, restitution, duration, *end, impacts in BALLS:
        simulation = bouncing_ball(height, restitution, duration).run("radau_iia 2", 20)
        difference = float(np.abs(simulation.states[-1][:2] - end).max())
        worst = max(worst, difference, np.inf if len(simulation.switch_times) != impacts else 0.0)
        what = f"ball from {height:g}, e = {restitution:g}, T = {duration:g}"
        rows.append([what, str(impacts), str(len(simulation.switch_times)), number(difference), _how(simulation)])
    simulation = thrown_mass().run("radau_iia 2", 10, 3)
    difference = abs(float(simulation.states[-1][0]) - 89 / 30)
    hits = sum(float(element.jump[2:].sum()) > 1e-3 for element in simulation.elements)
    rows.append(["mass thrown flat, friction 0.3, e = 0", "1", str(hits), number(difference), _how(simulation)])
    return markdown_table(["motion", "impacts", "found", "error at the end", "steps solved by"], rows), worst


def _how(simulation: Simulation) -> str:
    return " or ".join(sorted({report.method for report in simulation.reports}))


def bead_table(stages: Sequence[int]) -> tuple[str, dict[tuple[str, int], np.ndarray]]:
    """The bead in its bowl: errors and orders of position, velocity and force for both kinds of gap."""
    position, velocity, force = bead_end()
    rows, orders = [], dict[tuple[str, int], np.ndarray]()
    gaps: tuple[Literal["integrated", "true"], ...] = ("integrated", "true")
    for gap in gaps:
        case = bead(gap)
        for s in stages:
            errors = []
            for steps in BEAD_STEPS:
                simulation = case.run(f"radau_iia {s}", steps)
                x, last = simulation.states[-1], simulation.elements[-1].z[-1]
                errors.append(
                    [np.abs(x[:2] - position).max(), np.abs(x[2:4] - velocity).max(), abs(float(last[1]) - force)]
                )
            orders[gap, s] = np.log2(np.array(errors[-2]) / np.array(errors[-1]))
            rows.append([gap, str(s), *(number(e) for e in errors[-1]), *(f"{p:.2f}" for p in orders[gap, s])])
    header = ["gap", "stages", "position", "velocity", "force", "order", "of velocity", "of force"]
    return markdown_table(header, rows), orders


def main() -> None:
    """Run the experiments."""
    report = Report("impulses_order", "Contact with impulses between the elements", __doc__.splitlines()[0])
    options = report.parse()
    experiment = Experiment()
    known = experiment.known
    grid = QUICK if options.quick else known["steps"]
    errors = {scheme: experiment.errors(scheme, grid) for scheme in SCHEMES}
    balls, difference = balls_table()
    stages = (2, 3) if options.quick else (2, 3, 4)
    beads, orders = bead_table(stages)

    report.add(
        "Two balls on a vertical line, a spring of 10⁴ N/m between them, e = 0.8 where the lower one hits the ground: "
        "twice, 19 ms apart. T = 1 s, N steps of two finite elements. Errors are the largest entry of "
        "x(T) - x_exact(T); *ideal* is what the scheme gives in exact arithmetic with exact switch detection, "
        "*published* is read off Fig. 6 of arXiv 2305.17003 (about 1 %). Published values far above the ideal ones are "
        "where that solver stopped; of its runs some 5 % did not converge and are missing. Implicit Euler does not "
        "converge on this grid."
    )
    report.figure(draw(errors, known), "Error of x(T) over the mean step; crosses are the published values.")
    report.add(table(errors, known))
    slopes = {scheme: fitted(scheme, own) for scheme, own in errors.items() if scheme != UNSTABLE}
    report.add("## Fitted order")
    report.add(
        markdown_table(
            ["scheme, stages", "p", "slope"], [[title(s), str(order(s)), f"{v:.2f}"] for s, v in slopes.items()]
        )
    )
    report.add("## Balls and a thrown mass with closed forms")
    report.add(balls)
    report.add("## Contact that lasts")
    report.add(
        "A bead slides in a round bowl for 1.5 s. The contact holds either the gap itself at zero at the stages, as "
        f"published, or the integrated gap p with p' = J_n v + κ (f_c - p). Errors at the end for N = {BEAD_STEPS[-1]} "
        f"steps of two elements of Radau IIA, and the orders from N = {BEAD_STEPS[-2]} to {BEAD_STEPS[-1]}."
    )
    report.add(beads)
    close_by(report, experiment, errors, slopes)
    report.check(f"balls agree with their closed forms to 1e-11, found {difference:.1e}", difference < 1e-11)
    better = all((orders["integrated", s][1:] > orders["true", s][1:] + 0.5).all() for s in stages)
    report.check("velocity and force of lasting contact have a higher order with the integrated gap", better)
    report.close()


def close_by(
    report: Report, experiment: Experiment, errors: dict[str, dict[int, float]], slopes: dict[str, float]
) -> None:
    """Note what the errors must be close to."""
    known, ideal_distances, published_distances, far = experiment.known, [], [], []
    for scheme, own in errors.items():
        for steps, error in own.items():
            ideal = known["ideal"].get(scheme, {}).get(str(steps))
            published = known["published"].get(scheme, {}).get(str(steps))
            if scheme == UNSTABLE:
                continue
            if ideal and ideal > REPRESENTABLE:
                ideal_distances.append(abs(error / ideal - 1))
            if published:
                if abs(error / published - 1) < READING:
                    published_distances.append(abs(error / published - 1))
                else:
                    far.append((title(scheme), steps, error / published))
    worse = [f"{name} at N = {steps} ({ratio:.2f})" for name, steps, ratio in far if ratio > 1]
    lines = [
        f"- {experiment.runs} runs, of which {len(experiment.failures)} were not solved.",
        f"- Steps whose modes were not found directly: {experiment.indirect}.",
        f"- Of {len(published_distances) + len(far)} published errors {len(published_distances)} are met to "
        f"{READING:.0%}; of the others {len(far) - len(worse)} are larger than ours"
        + (f", and smaller are those of {', '.join(worse)}." if worse else "."),
        *(f"  - {failure}" for failure in experiment.failures),
    ]
    report.add("## Summary")
    report.add("\n".join(lines))
    largest = max(ideal_distances)
    report.check(f"{len(ideal_distances)} errors within 2 % of the ideal ones, at most {largest:.2%}", largest < 0.02)
    report.check("every run was solved", not experiment.failures)
    if report.arguments.quick:
        return
    least = min(slope - order(scheme) for scheme, slope in slopes.items())
    report.check(f"every fitted slope at least p - 0.5, the least is p {least:+.2f}", least >= -0.5)


if __name__ == "__main__":
    main()
