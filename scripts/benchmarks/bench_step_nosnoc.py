"""Time one simulation step with fesd-robot and with nosnoc, on the oscillator both use to show their order.

    python scripts/benchmarks/bench_step_nosnoc.py
    python scripts/benchmarks/bench_step_nosnoc.py --repeat 3 --page bench_step_nosnoc.md

The system turns left inside the unit circle and right outside, x' = A x; x(0) = (exp(-1), 0) reaches the circle at
t = 1. Both tools take 34 steps to T = pi/2 in one process and one thread, in turns: step-function form, Radau IIA with
3 stages, 2 finite elements a step. What is built once is timed apart. nosnoc runs with the settings of its authors'
order experiment on this system, and with lighter ones. Needs the extra `bench`.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported

import argparse
import contextlib
import copy
import functools
import importlib.metadata
import importlib.util
import io
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from scripts.tools.arguments import check_counts, machine

OMEGA = 2 * np.pi
STEPS = 34
DURATION = np.pi / 2
START = np.array([np.exp(-1.0), 0.0])
INSIDE = np.array([[1.0, -OMEGA], [OMEGA, 1.0]])
OUTSIDE = np.array([[1.0, OMEGA], [-OMEGA, 1.0]])
SPAN_TOLERANCE = 1e-5
"""Of the simulation with steps of its own choice; its error is then below that of 34 equal steps."""
TOLERANCE = 1e-10
"""Asked of both: of a multiplier's sign in fesd-robot; of complementarity, of the last relaxation and of IPOPT in
nosnoc."""


@dataclass(frozen=True)
class Run:
    """One simulation.

    Attributes:
        build: seconds spent once, before or in the first step.
        seconds: CPU time of every step; the first is NaN where it contains the building.
        iterations: Newton or IPOPT iterations of every step.
        failed: number of steps that the tool itself does not call solved.
        complementarity: largest product G H of a pair in an element.
        end: x(T).
    """

    build: float
    seconds: np.ndarray
    iterations: np.ndarray
    failed: int
    complementarity: float
    end: np.ndarray


@dataclass(frozen=True)
class Setting:
    """A tool with its settings; ``run`` takes x(0)."""

    tool: str
    name: str
    run: Callable[[np.ndarray], Run]
    runs: list[Run] = field(default_factory=list)


def exact(start: np.ndarray) -> np.ndarray:
    """Return x(T): the radius grows as exp(t), the direction of turning changes where it is 1."""
    radius = float(np.hypot(*start))
    angle = np.arctan2(start[1], start[0]) - OMEGA * DURATION - 2 * OMEGA * np.log(radius)
    return radius * np.exp(DURATION) * np.array([np.cos(angle), np.sin(angle)])


def switching_step(start: np.ndarray) -> int:
    """Return the number of the step that contains the switch, from 0."""
    return int(-np.log(np.hypot(*start)) / (DURATION / STEPS))


def run_ours(start: np.ndarray, form: Any = None) -> Run:
    """Simulate with fesd-robot."""
    from fesd_robot.fesd import FesdOptions, SimulationSettings, make_tableau, simulate

    begin = time.process_time()
    system = oscillator.__wrapped__()
    stamps = [begin]
    simulation = simulate(
        system,
        start,
        STEPS,
        DURATION,
        options=FesdOptions(tableau=make_tableau("radau_iia", 3), elements=2, form=form),
        settings=SimulationSettings(tolerance=TOLERANCE),
        progress=lambda _: stamps.append(time.process_time()),
    )
    seconds = np.diff(stamps)
    build = seconds[0] - np.median(seconds[1:])
    seconds[0] = np.nan  # it contains the building
    sides = ca.Function("sides", [system.algebraic], [system.G, system.H])
    products = []
    for element in simulation.elements:
        values = [sides(z) for z in [element.z_left, *element.z]]
        sum_G = sum(np.abs(G.full()) for G, _ in values)
        products += [np.abs(sum_G * H.full()).max() for _, H in values[1:]]
    return Run(
        build=float(build),
        seconds=seconds,
        iterations=np.array([report.iterations for report in simulation.reports]),
        failed=0,  # a step that is not solved raises
        complementarity=float(max(products)),
        end=simulation.states[-1],
    )


def run_span(start: np.ndarray) -> tuple[float, float]:
    """Return CPU seconds and error of fesd-robot's simulation with steps of its own choice, at about nosnoc's error."""
    from fesd_robot.fesd import simulate

    begin = time.process_time()
    end = simulate(oscillator(), start, (0.0, DURATION), rtol=SPAN_TOLERANCE).states[-1]
    return time.process_time() - begin, float(np.abs(end - exact(start)).max())


@functools.cache
def oscillator() -> Any:
    """The system in fesd-robot's step-function form."""
    from fesd_robot.dcs import Model, StepFunctions, heaviside

    x, alpha = ca.SX.sym("x", 2), ca.SX.sym("alpha")
    right_hand_side = ca.mtimes(alpha * ca.DM(OUTSIDE) + (1 - alpha) * ca.DM(INSIDE), x)
    return heaviside(Model(x), StepFunctions(alpha, ca.sumsqr(x) - 1), right_hand_side)


def run_nosnoc(start: np.ndarray, **settings: Any) -> Run:
    """Simulate with nosnoc, step by step as its `NosnocSimLooper` does; ``settings`` are fields of `NosnocOpts`."""
    import nosnoc

    begin = time.process_time()
    opts = nosnoc.NosnocOpts()
    opts.opts_casadi_nlp = copy.deepcopy(opts.opts_casadi_nlp)  # nosnoc shares this dictionary between all options
    opts.terminal_time = DURATION / STEPS
    opts.irk_scheme, opts.n_s, opts.N_finite_elements = nosnoc.IrkSchemes.RADAU_IIA, 3, 2
    opts.pss_mode = nosnoc.PssMode.STEP
    opts.print_level = 0
    opts.comp_tol = opts.sigma_N = opts.tol_ipopt = TOLERANCE
    for key, value in settings.items():
        setattr(opts, key, value)
    x = ca.SX.sym("x", 2)
    model = nosnoc.NosnocModel(
        x=x,
        x0=start,
        F=[ca.horzcat(ca.DM(OUTSIDE) @ x, ca.DM(INSIDE) @ x)],
        c=[ca.sumsqr(x) - 1],
        S=[np.array([[1], [-1]])],
    )
    solver = nosnoc.NosnocSolver(opts, model)
    build = time.process_time() - begin
    state, failed = start, 0
    seconds, iterations, products = [], [], []
    for _ in range(STEPS):
        begin = time.process_time()
        solver.set("x0", state)
        results = solver.solve()
        state = results["x_list"][-1]
        seconds.append(time.process_time() - begin)
        iterations.append(sum(count for count in results["nlp_iter"] if count))
        failed += results["status"] != nosnoc.Status.SUCCESS
        products.append(float(solver.problem.comp_res(results["w_sol"], solver.p_val)))
    return Run(build, np.array(seconds), np.array(iterations), failed, max(products), state)


def settings_of_tools() -> list[Setting]:
    """Return what is compared, nosnoc's published settings first among its own."""
    import nosnoc

    published = {"comp_tol": 1e-12, "sigma_N": 1e-12, "tol_ipopt": 1e-12}
    superlinear = {"homotopy_update_rule": nosnoc.HomotopyUpdateRule.SUPERLINEAR}
    fast = {"sigma_0": 1e-2, "homotopy_update_slope": 1e-2}
    warm = {"initialization_strategy": nosnoc.InitializationStrategy.ALL_XCURRENT_WOPT_PREV}
    ours, theirs = "fesd-robot", "nosnoc"
    return [
        Setting(ours, "differential form (default)", run_ours),
        Setting(ours, "integral form", lambda x: run_ours(x, "integral")),
        Setting(theirs, "published, tolerance 1e-12", lambda x: run_nosnoc(x, **published)),
        Setting(theirs, "published, tolerance 1e-10", run_nosnoc),
        Setting(theirs, "superlinear homotopy", lambda x: run_nosnoc(x, **superlinear)),
        Setting(theirs, "sigma 1e-2, factor 0.01", lambda x: run_nosnoc(x, **fast)),
        Setting(theirs, "the same, started warm", lambda x: run_nosnoc(x, **fast, **warm)),
        Setting(theirs, "one NLP at sigma 1e-10", lambda x: run_nosnoc(x, sigma_0=TOLERANCE)),
    ]


def quietly(setting: Setting, start: np.ndarray) -> Run:
    """Run a setting; what nosnoc prints about its NLPs is dropped."""
    with contextlib.redirect_stdout(io.StringIO()):
        return setting.run(start)


def measure(settings: Sequence[Setting], repeat: int) -> list[tuple[float, float]]:
    """Run all settings in turns, each turn beginning with another one; the first, untimed turn warms up.

    Returns:
        seconds and error of the simulations with steps of their own choice, one a turn.
    """
    spans = []
    for turn in range(repeat + 1):
        print(f"turn {turn} of {repeat}", flush=True)
        first = turn % len(settings)
        for setting in [*settings[first:], *settings[:first]]:
            run = quietly(setting, START)
            if turn:
                setting.runs.append(run)
        spans.append(run_span(START))
    return spans[1:]


def whole_motion(settings: Sequence[Setting], spans: Sequence[tuple[float, float]]) -> str:
    """Return what the whole motion costs at nosnoc's error, building left out on both sides."""
    seconds, error = (float(np.median(values)) for values in zip(*spans, strict=True))
    rows = [["fesd-robot: steps of its own choice", f"{seconds * 1e3:.1f}", "1.0", f"{error:.1e}"]]
    for setting in settings:
        smooth, switch = typical(setting)
        total = (STEPS - 1) * smooth + switch
        own = float(np.abs(setting.runs[-1].end - exact(START)).max())
        name = f"{setting.tool}: {setting.name}"
        rows.append([name, f"{total * 1e3:.1f}", f"{total / seconds:.1f}", f"{own:.1e}"])
    return markdown(["settings", "whole motion [ms]", "ratio", "error of x(T)"], rows)


def typical(setting: Setting) -> tuple[float, float]:
    """Return seconds of a step without the switch and of the one with it, medians over repetitions and steps."""
    steps = np.median([run.seconds for run in setting.runs], axis=0)
    switch = switching_step(START)
    smooth = np.delete(steps, [0, switch])
    return float(np.median(smooth)), float(steps[switch])


def time_table(settings: Sequence[Setting]) -> str:
    """Return the costs and what they buy; ratios are to fesd-robot's first setting."""
    base = typical(settings[0])
    rows = []
    for setting in settings:
        run, (smooth, switch) = setting.runs[-1], typical(setting)
        at = switching_step(START)
        rows.append(
            [
                f"{setting.tool}: {setting.name}",
                f"{smooth * 1e3:.1f}",
                f"{smooth / base[0]:.1f}",
                f"{switch * 1e3:.1f}",
                f"{switch / base[1]:.1f}",
                f"{((STEPS - 1) * smooth + switch) * 1e3:.0f}",
                f"{np.median(run.iterations):.0f} / {run.iterations[at]}",
                f"{np.median([run.build for run in setting.runs]) * 1e3:.0f}",
                f"{np.abs(run.end - exact(START)).max():.2e}",
                f"{run.complementarity:.0e}",
                f"{run.failed}",
            ]
        )
    header = [
        "settings",
        "step [ms]",
        "ratio",
        "switch step [ms]",
        "ratio",
        "all steps [ms]",
        "iterations",
        "build [ms]",
    ]
    return markdown([*header, "error of x(T)", "complementarity", "failed"], rows)


def other_starts(count: int) -> list[np.ndarray]:
    """Return further initial states inside the circle, from a fixed seed."""
    random = np.random.default_rng(0)
    radius, angle = random.uniform(0.25, 0.9, count), random.uniform(0, 2 * np.pi, count)
    return list(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))


def reliability_table(settings: Sequence[Setting], starts: Sequence[np.ndarray]) -> str:
    """Return how often each setting fails from other initial states."""
    rows = []
    for setting in settings:
        print(f"{len(starts)} further initial states, {setting.tool}: {setting.name}", flush=True)
        runs = [quietly(setting, start) for start in starts]
        errors = [np.abs(run.end - exact(start)).max() for run, start in zip(runs, starts, strict=True)]
        failed = sum(run.failed for run in runs)
        rows.append(
            [
                f"{setting.tool}: {setting.name}",
                f"{failed} of {STEPS * len(starts)}",
                f"{np.median(errors):.1e}",
                f"{max(errors):.1e}",
                f"{max(run.complementarity for run in runs):.0e}",
            ]
        )
    header = ["settings", "steps that failed", "median error of x(T)", "largest error", "largest complementarity"]
    return markdown(header, rows)


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table with aligned columns, the first one to the left."""
    widths = [max(len(line[i]) for line in [header, *rows]) for i in range(len(header))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [header, rule, *rows]
    return "\n".join(
        "| " + " | ".join([c[0].ljust(widths[0]), *(t.rjust(w) for t, w in zip(c[1:], widths[1:], strict=True))]) + " |"
        for c in lines
    )


def page(settings: Sequence[Setting], spans: Sequence[tuple[float, float]], arguments: argparse.Namespace) -> str:
    """Return all results as a page."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("fesd-robot", "nosnoc", "casadi"))
    command = f"python scripts/benchmarks/bench_step_nosnoc.py --repeat {arguments.repeat} --starts {arguments.starts}"
    default, published = typical(settings[0]), typical(next(s for s in settings if s.tool == "nosnoc"))
    same = typical(next(s for s in settings if s.name == "published, tolerance 1e-10"))
    lightest = typical(settings[-1])
    return f"""# One simulation step compared with nosnoc

Made by `{command}` on {machine()}, one process and one thread, Python {platform.python_version()}, {versions}.

Planar oscillator, x(0) = (exp(-1), 0), {STEPS} steps to T = pi/2, Radau IIA with 3 stages, 2 finite elements a step,
step-function form. Times are CPU time of the process, the median over the steps and over {arguments.repeat}
repetitions in which all settings took turns; the first step, in which functions are built, is left out. Ratios are to
fesd-robot's default.

{time_table(settings)}

A step without a switch takes {default[0] * 1e3:.1f} ms in fesd-robot and {same[0] * 1e3:.1f} ms in nosnoc with its
published settings at the same tolerance, {same[0] / default[0]:.1f} times as long ({published[0] / default[0]:.1f} at
the published 1e-12); the step with the switch {default[1] * 1e3:.1f} ms and {same[1] * 1e3:.1f} ms,
{same[1] / default[1]:.1f} times as long. nosnoc's lightest setting, a single NLP already at the final relaxation and
so without a homotopy, takes {lightest[0] * 1e3:.1f} ms ({lightest[0] / default[0]:.1f} times) and
{lightest[1] * 1e3:.1f} ms ({lightest[1] / default[1]:.1f} times).

A simulation need not take equal steps. With steps of its own choice and rtol {SPAN_TOLERANCE:g}, the whole motion at
the same error or less, ratios to that:

{whole_motion(settings, spans)}

Settings. fesd-robot looks for the modes of a step and solves each trial by Newton's method; no NLP is involved unless
that fails, which it did in no step here, and products vanish to round-off. nosnoc solves a homotopy of NLPs by IPOPT
with MUMPS: sum of multipliers with every step function, Scholtes relaxation, heuristic equal steps, integral form, its
defaults. "Published" is the setting of its authors' order experiment on this oscillator: sigma from 1 by factors of
0.1, comp_tol = sigma_N = tol_ipopt; the rows below it change only what they name and have tolerance 1e-10. "Warm"
starts a step at the solution of the one before. Building: fesd-robot's first step less a typical one, or the
construction of `NosnocSolver`. Iterations: Newton or IPOPT, median / step with the switch. Failed: steps that the tool
itself reports as not solved.

The same from {arguments.starts} further initial states inside the circle (fixed seed):

{reliability_table(settings, other_starts(arguments.starts))}
"""


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(
        description="Time one simulation step with fesd-robot and with nosnoc.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--repeat", type=int, default=8, help="timed runs of each setting, in turns")
    parser.add_argument("--starts", type=int, default=12, help="further initial states that count failures")
    parser.add_argument("--page", type=Path, metavar="FILE", help="also write the results to this file")
    arguments = parser.parse_args(words)
    check_counts(parser, arguments, "repeat", "starts")
    if arguments.page and not arguments.page.parent.is_dir():
        parser.error(f"argument --page: there is no folder {arguments.page.parent}")
    return arguments


def main(words: Sequence[str] | None = None) -> None:
    """Run the benchmark."""
    arguments = parse(words)
    if importlib.util.find_spec("nosnoc") is None:
        raise SystemExit("nosnoc is not installed. Install it with the extra 'bench': pip install 'fesd-robot[bench]'")
    settings = settings_of_tools()
    spans = measure(settings, arguments.repeat)
    text = page(settings, spans, arguments)
    print(f"\n{text}")
    if arguments.page:
        arguments.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
