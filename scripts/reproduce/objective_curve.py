"""An objective with fixed steps has spurious minima, with switch detection it has the true one.

    python scripts/reproduce/objective_curve.py

Minimise over x0 the integral of x^2 over [0, 2] plus (x(2) - 5/3)^2, where x' = 2 - sign(x): the problem of
arXiv 2205.05337, section 4.6, eq. (56) and Fig. 9, after Stewart and Anitescu 2010. Gauss-Legendre with two stages, one
control interval of 25 finite elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from _common import Report, markdown_table, number, plt, reference  # first: sets the number of threads

# isort: split
import casadi as ca
import numpy as np
from matplotlib.figure import Figure

from fesd_robot.dcs import ComplementaritySystem, Subsystem, stewart
from fesd_robot.fesd import FesdOptions, SimulationError, make_tableau, simulate
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import HomotopyOptions, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import scholtes

DURATION, ELEMENTS, TARGET = 2.0, 25, 5 / 3
LEFT, RIGHT = -2.0, -0.8
TABLEAU = make_tableau("gauss_legendre", 2)
SIGMA = 1e-9
"""Last, or only, relaxation of the complementarity products."""
SOLVERS = {
    "homotopy": HomotopyOptions(tolerance=SIGMA, sigma_factor=0.1, rank_ratio=1.0),
    "single NLP": HomotopyOptions(tolerance=SIGMA, sigma_start=SIGMA, rank_ratio=1.0),
}


def exact_objective(x0: np.ndarray) -> np.ndarray:
    """V for -6 <= x0 <= 0."""
    return -(x0**3) / 9 + (2 + x0 / 3) ** 3 / 3 + ((1 + x0) / 3) ** 2


def exact_gradient(x0: np.ndarray) -> np.ndarray:
    """Derivative of V for -6 <= x0 <= 0."""
    return -(x0**2) / 3 + (2 + x0 / 3) ** 2 / 3 + 2 * (1 + x0) / 9


def crossing(with_cost: bool) -> ComplementaritySystem:
    """x' = 3 left of zero and 1 right of it; with the integral of x^2 as second state, which makes gradients exact."""
    state = ca.SX.sym("x", 1 + with_cost)
    fields = np.array([[3.0, 1.0]])
    return stewart(
        state=state,
        subsystems=Subsystem(
            fields=np.vstack([fields, np.zeros((int(with_cost), 2))]),
            switching=state[0],
            sign_matrix=np.array([[-1], [1]]),
            region_names=("left", "right"),
        ),
        drift=ca.vertcat(0, state[0] ** 2) if with_cost else None,
    )


@dataclass(frozen=True)
class Point:
    """The objective at one x0: value, derivative, and dx(2)/dx0."""

    value: float
    gradient: float
    end: float


class Objective:
    """V(x0) by simulation, with or without switch detection."""

    def __init__(self, switch_detection: bool, tableau: Tableau = TABLEAU) -> None:
        self.system = crossing(with_cost=True)
        # The lengths of an interval's elements are free, so all of them must be in one interval; fixed steps need not.
        self.steps, elements = (1, ELEMENTS) if switch_detection else (ELEMENTS, 1)
        self.options = FesdOptions(tableau=tableau, elements=elements, switch_detection=switch_detection)

    def __call__(self, x0: float) -> Point:
        """Return value and derivatives."""
        start = np.array([x0, 0.0])
        simulation = simulate(self.system, start, self.steps, DURATION, options=self.options, sensitivities=True)
        (x, cost), sensitivity = simulation.states[-1], simulation.sensitivity.initial
        gradient = sensitivity[1, 0] + 2 * (x - TARGET) * sensitivity[0, 0]
        return Point(cost + (x - TARGET) ** 2, gradient, sensitivity[0, 0])


def golden_section(function: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Return where a function with one minimum in between has it."""
    part = (np.sqrt(5.0) - 1) / 2
    inner = [high - part * (high - low), low + part * (high - low)]
    values = [function(x) for x in inner]
    while high - low > width:
        if values[0] < values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - part * (high - low)
            values[0] = function(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + part * (high - low)
            values[1] = function(inner[1])
    return 0.5 * (low + high)


def local_minima(objective: Objective, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return x0 and V of the local minima, refined."""
    inside = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1
    where = [golden_section(lambda x: objective(x).value, grid[i - 1], grid[i + 1], 1e-6) for i in inside]
    return np.array([[x, objective(x).value] for x in where])


@dataclass
class Optima:
    """Results of one way to optimise x0 by the start; failed runs are missing in `by_start`."""

    name: str
    published: str
    by_start: dict[float, float] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    iterations: int = 0

    @property
    def values(self) -> np.ndarray:
        """The optima, in the order of the starts."""
        return np.array(list(self.by_start.values()))


class Optimizer:
    """The optimal control problem with x0 free, started from simulations.

    Args:
        switch_detection: or fixed steps.
        equilibration: what makes steps equal where no switch is.
    """

    def __init__(self, switch_detection: bool, equilibration: str) -> None:
        system, free = crossing(with_cost=False), np.array([np.inf])
        x = system.state
        ocp = OptimalControlProblem(
            system=system,
            duration=DURATION,
            intervals=1,
            parameters=np.zeros((0, 1)),
            initial_lower=-free,
            initial_upper=free,
            state_lower=-free,
            state_upper=free,
            terminal_lower=-free,
            terminal_upper=free,
            control_lower=np.zeros(0),
            control_upper=np.zeros(0),
            state_guess=lambda time: np.array([-1.0]),
            control_guess=np.zeros((0, 1)),
            running_cost={"x squared": x**2},
            terminal_cost={"distance at the end": (x - TARGET) ** 2},
        )
        options = FesdOptions(
            tableau=TABLEAU,
            elements=ELEMENTS,
            switch_detection=switch_detection,
            step_equilibration=equilibration,
        )
        self.system, self.options = system, options
        self.transcription = Transcription(ocp, options)
        self.nlp = assemble(self.transcription.problem, scholtes)

    def starts(self, points: Sequence[float]) -> dict[float, np.ndarray]:
        """Return the simulated points of the MPCC by x0."""
        packed = {}
        for x0 in points:
            simulation = simulate(self.system, np.array([x0]), 1, DURATION, options=self.options)
            packed[x0] = self.transcription.pack(simulation.elements)
        return packed

    def run(self, optima: Optima, solver: HomotopyOptions, starts: dict[float, np.ndarray]) -> Optima:
        """Optimise from every start."""
        for x0, start in starts.items():
            solution = solve(replace(self.transcription.problem, start=start), solver, nlp=self.nlp)
            optima.iterations += solution.iterations
            if solution.solved:
                optima.by_start[x0] = float(solution.w[0])
            else:
                optima.failures.append(f"{optima.name} from {x0:.3f}: {solution.status}")
        return optima


def optimise(starts: np.ndarray, published: dict[str, list[float]]) -> list[Optima]:
    """All four ways to optimise, from all starts, and FESD with the quadratic equilibration from some."""
    ways = []
    for detection, equilibration, label in ((True, "difference_product", "fesd"), (False, "none", "fixed-step")):
        optimizer = Optimizer(detection, equilibration)
        simulated = optimizer.starts(starts)
        for mode, solver in SOLVERS.items():
            values = published[f"{label} {mode}"]
            shown = f"{min(values):g} … {max(values):g}" if max(values) > min(values) else f"{values[0]:g}"
            title = f"{'FESD' if detection else 'fixed steps'}, {mode}"
            ways.append(optimizer.run(Optima(title, shown), solver, simulated))
    optimizer = Optimizer(True, "mean")
    quadratic = Optima("FESD, homotopy, quadratic equilibration", ways[0].published)
    ways.append(optimizer.run(quadratic, SOLVERS["homotopy"], optimizer.starts(starts[::5])))
    return ways


def optima_table(ways: Sequence[Optima], optimum: float, starts: int) -> str:
    """One row a way to optimise."""
    rows = []
    for way in ways:
        values = way.values
        runs = len(values) + len(way.failures)
        rows.append(
            [
                way.name,
                f"{runs}",
                f"{len(way.failures)}",
                f"{values.min():.9f}",
                f"{values.max():.9f}",
                number(float(np.abs(values - optimum).max())),
                f"{len(np.unique(values.round(4)))}",
                way.published,
                f"{way.iterations / runs:.0f}",
            ]
        )
    return markdown_table(
        [
            *("optimisation", "starts", "failed", "least x0*", "largest x0*", "max distance", "results", "published"),
            "iterations a run",
        ],
        rows,
    )


def draw(curves: dict[str, tuple[np.ndarray, np.ndarray]], minima: np.ndarray, ways: Sequence[Optima]) -> Figure:
    """The objective on the left, the optimum over the start on the right."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    optimum = reference("objective_curve")["exact"]["optimum"]
    left.plot(*curves["fixed"], color="C1", label="fixed steps")
    left.plot(*minima.T, "v", color="C1", markersize=5, label="its minima")
    left.plot(*curves["exact"], color="0.25", linewidth=2.2, alpha=0.5, label="exact")
    left.plot(*curves["fesd"], "o", color="C0", markersize=3, label="switch detection", clip_on=False)
    left.set(xlabel="x0", ylabel="objective V(x0)", xlim=(LEFT, RIGHT))
    left.legend(loc="upper center")
    right.axhline(optimum, color="0.25", linewidth=2.2, alpha=0.5, label="exact optimum")
    styles = (("C0", "o", 6, "white"), ("C0", ".", 4, "C0"), ("C1", "s", 4, "white"), ("C1", ".", 6, "C1"))
    starts = np.unique(np.concatenate([list(way.by_start) for way in ways[:4]]))
    for way, (color, marker, size, fill) in zip(ways[:4], styles, strict=True):
        values = [way.by_start.get(x0, np.nan) for x0 in starts]  # a failed run is a gap
        style = {"marker": marker, "color": color, "markersize": size, "markerfacecolor": fill}
        right.plot(starts, values, drawstyle="steps-mid", linewidth=0.8, label=way.name, clip_on=False, **style)
    right.set(xlabel="start of x0", ylabel="optimal x0", xlim=(LEFT, RIGHT))
    right.legend(loc="upper left")
    return figure


def main() -> None:
    """Run the experiment."""
    report = Report("objective_curve", "Objective curve of a problem with one switch", __doc__.splitlines()[0])
    options = report.parse()
    known = reference("objective_curve")
    optimum = known["exact"]["optimum"]
    samples = np.linspace(LEFT, RIGHT, 13 if options.quick else 50)
    grid = np.linspace(LEFT, RIGHT, 181 if options.quick else 601)
    listed = np.array(known["fixed_step_minima"])

    with_detection, with_fixed_steps = Objective(True), Objective(False)
    failures = []

    def curve(objective: Objective, points: np.ndarray) -> list[Point]:
        values = []
        for x0 in points:
            try:
                values.append(objective(x0))
            except SimulationError as error:
                failures.append(f"x0 = {x0:.4f}: {error}")
                values.append(Point(np.nan, np.nan, np.nan))
        return values

    fesd = curve(with_detection, samples)
    fixed = curve(with_fixed_steps, grid)
    value_error = np.array([p.value for p in fesd]) - exact_objective(samples)
    gradient_error = np.array([p.gradient for p in fesd]) - exact_gradient(samples)
    end_error = np.array([p.end for p in fesd]) - known["exact"]["derivative_of_end"]
    minima = local_minima(with_fixed_steps, grid, np.array([p.value for p in fixed]))
    ways = optimise(samples, known["published"])

    report.add(
        "min over x0 of ∫₀² x² dt + (x(2) - 5/3)², x' = 2 - sign(x); Gauss–Legendre with 2 stages, 25 finite elements "
        f"of one control interval (h = {DURATION / ELEMENTS:g}), Stewart form. The optimum is x0* = (9 - √417)/8 = "
        f"{optimum:.12f} with V* = {known['exact']['objective']:.12f}. *Published* values are read off Fig. 9 of "
        "arXiv 2205.05337."
    )
    report.figure(
        draw(
            {
                "fixed": (grid, np.array([p.value for p in fixed])),
                "fesd": (samples, np.array([p.value for p in fesd])),
                "exact": (grid, exact_objective(grid)),
            },
            minima,
            ways,
        ),
        "Left: the objective with fixed steps, with switch detection, and exact. Right: where an optimisation ends, "
        "over where it starts.",
    )
    report.add("## The objective")
    rows = []
    for x0 in (-2.0, -1.75, -1.5, -1.25, -1.0, -0.8):
        a, b = with_detection(x0), with_fixed_steps(x0)
        value, gradient = exact_objective(x0), exact_gradient(x0)
        rows.append(
            [
                f"{x0:g}",
                *(f"{value:.9f}", number(a.value - value, 2), f"{b.value:.6f}"),
                *(f"{gradient:.9f}", number(a.gradient - gradient, 2), f"{b.gradient:.6f}"),
                *(number(a.end - known["exact"]["derivative_of_end"], 2), f"{b.end:.4f}"),
            ]
        )
    report.add(
        markdown_table(
            [
                *("x0", "V", "FESD - V", "fixed steps", "V'", "FESD - V'", "fixed steps"),
                *("FESD dx(2)/dx0 - 1/3", "fixed steps"),
            ],
            rows,
        )
    )
    ends = np.unique(np.array([p.end for p in fixed]).round(6))
    report.add(
        f"Over {len(samples)} samples in [{LEFT:g}, {RIGHT:g}] FESD is off by at most "
        f"{np.abs(value_error).max():.1e} in V, {np.abs(gradient_error).max():.1e} in V' and "
        f"{np.abs(end_error).max():.1e} in dx(2)/dx0. With fixed steps dx(2)/dx0 takes values from {ends.min():g} to "
        f"{ends.max():g} ({len(ends)} of them on {len(grid)} points), "
        f"{'never' if np.abs(ends - 1 / 3).min() > 1e-3 else 'also'} 1/3."
    )
    report.add("## Local minima with fixed steps")
    nearest = [minima[np.abs(minima[:, 0] - x).argmin()] for x in listed[:, 0]]
    staircase = known["published"]["fixed-step single NLP"]
    report.add(
        markdown_table(
            ["x0, listed", "ours", "difference", "published", "V, listed", "V, ours"],
            [
                [f"{x:.4f}", f"{our[0]:.5f}", f"{our[0] - x:.1e}", f"{p:g}", f"{v:.6f}", f"{our[1]:.6f}"]
                for (x, v), our, p in zip(listed, nearest, staircase, strict=True)
            ],
        )
    )
    report.add(
        "*Listed* values come from an independent enumeration of the stage conditions on a grid, good to about 2e-4."
    )
    report.add("## The optimum")
    report.add(optima_table(ways, optimum, len(samples)))
    failed = [failure for way in ways for failure in way.failures]
    report.add(
        f"*Homotopy* drives the products from 1 to {SIGMA:g}, *single NLP* solves one at {SIGMA:g}; each starts "
        "from the simulation of its x0. Steps are held equal between switches by the equilibration cost of "
        "neighbouring differences times the switching indicator, which vanishes at the solution. The last row shows "
        "the plain quadratic equilibration cost instead: it stays in the objective and shifts the optimum, by how "
        "much depends on the number of elements that the start puts on each side of the switch."
        + ("" if not failed else "\n\nRuns that failed, gaps in the figure:\n\n" + "\n".join(f"- {f}" for f in failed))
    )

    distances = np.array([our[0] - x for our, x in zip(nearest, listed[:, 0], strict=True)])
    homotopy = ways[0]
    on_staircase = np.array([np.abs(listed[:, 0] - x).min() for x in ways[3].values])
    report.add("## Summary")
    report.check(
        f"V with FESD within 1e-8 on {len(samples)} samples, found {np.abs(value_error).max():.1e}",
        np.abs(value_error).max() < 1e-8,
    )
    report.check(
        f"V' with FESD within 1e-8, found {np.abs(gradient_error).max():.1e}", np.abs(gradient_error).max() < 1e-8
    )
    report.check(
        f"dx(2)/dx0 = 1/3 with FESD within 1e-8, found {np.abs(end_error).max():.1e}", np.abs(end_error).max() < 1e-8
    )
    report.check(f"at least 8 local minima with fixed steps, found {len(minima)}", len(minima) >= 8)
    report.check(
        f"the {len(listed)} listed minima within 2e-3, found {np.abs(distances).max():.1e}",
        np.abs(distances).max() < 2e-3,
    )
    report.check(
        f"FESD with homotopy within 1e-6 of x0* from {len(homotopy.by_start)} starts, found "
        f"{np.abs(homotopy.values - optimum).max():.1e}",
        not homotopy.failures and np.abs(homotopy.values - optimum).max() < 1e-6,
    )
    report.check(
        f"a single NLP with fixed steps ends in a spurious minimum, {np.mean(on_staircase < 2e-3):.0%} of "
        f"{len(on_staircase)} runs within 2e-3 of a listed one",
        np.mean(on_staircase < 2e-3) > 0.9,
    )
    report.check(f"simulations that failed: {len(failures)}", not failures)
    report.finish()


if __name__ == "__main__":
    main()
