"""Tables of a comparison, and the page that is made of them."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scripts.benchmarks.bench_step_nosnoc import markdown
from scripts.benchmarks.compare.outcome import TITLES, Outcome, Settings
from scripts.benchmarks.compare.problems import PROBLEMS
from scripts.tools.arguments import machine

COST_MARGIN = 1.01
"""Our cost may be this many times nosnoc's."""
ROUNDING = 1.01
"""A complementarity may be this many times the one asked for."""
PACKAGES = {"ours": "fesd-robot", "nosnoc": "nosnoc"}

ROWS: list[tuple[str, Callable[[Outcome], str]]] = [
    ("CPU time [s]", lambda run: f"{run.cpu_seconds:.1f}"),
    ("IPOPT iterations", lambda run: f"{run.iterations}"),
    ("complementarity reached", lambda run: f"{run.complementarity:.1e}"),
    ("largest constraint violation", lambda run: f"{run.constraint_violation:.1e}"),
    ("objective, each tool's own", lambda run: f"{run.objective:.6g}"),
    ("cost of the motion, by one rule", lambda run: f"{run.cost:.6g}"),
    ("NLP variables", lambda run: f"{run.variables}"),
    ("NLP constraints", lambda run: f"{run.constraints}"),
    ("the tool's own verdict", lambda run: run.verdict),
    ("last NLP", lambda run: run.last_nlp),
]


@dataclass(frozen=True)
class Comparison:
    """The runs of the tools on one problem.

    Attributes:
        task: name of the problem.
        settings: of the runs.
        runs: tool -> its runs, fesd-robot first.
    """

    task: str
    settings: Settings
    runs: dict[str, list[Outcome]]

    @property
    def title(self) -> str:
        """Name of the problem, with what is chosen where the fields have weights: the hoppers."""
        problem = PROBLEMS[self.task]
        if not problem.weighted:
            return problem.title
        weights = f", {self.settings.multipliers} weights in nosnoc" if "nosnoc" in self.runs else ""
        return f"{problem.title}{weights}"

    def seconds(self, tool: str) -> float:
        """Return the median wall time."""
        return statistics.median(run.wall_seconds for run in self.runs[tool])

    def missed(self) -> str:
        """Return which targets fesd-robot missed in words, nothing if none."""
        ours, theirs = typical(self.runs["ours"]), typical(self.runs["nosnoc"])
        words = []
        if ours.verdict != "solved" or ours.complementarity > ROUNDING * self.settings.tolerance:
            words.append("complementarity")
        if ours.cost > COST_MARGIN * theirs.cost:
            words.append("cost")
        return " and ".join(words)


def typical(runs: Sequence[Outcome]) -> Outcome:
    """Return the run with the median wall time, the faster of the middle two."""
    return sorted(runs, key=lambda run: run.wall_seconds)[(len(runs) - 1) // 2]


def table(one: Comparison, versions: dict[str, str]) -> str:
    """Return a comparison in full, one column per tool, under a heading."""
    shown = {tool: typical(outcomes) for tool, outcomes in one.runs.items()}
    fastest = min(one.seconds(tool) for tool in one.runs)
    repeat = max(len(outcomes) for outcomes in one.runs.values())
    wall = "wall time [s]" if repeat == 1 else f"wall time [s], median of {repeat}"
    lines = [
        ["", *(f"{PACKAGES[tool]} {versions[PACKAGES[tool]]}" for tool in one.runs)],
        [wall, *(f"{one.seconds(tool):.1f}" for tool in one.runs)],
    ]
    if len(one.runs) > 1:
        lines.append(["time ratio", *(f"{one.seconds(tool) / fastest:.2f}" for tool in one.runs)])
    lines += [[label, *(show(shown[tool]) for tool in one.runs)] for label, show in ROWS]
    if len(one.runs) > 1:
        level = shown["nosnoc"].complementarity
        passed = [_objective_at(run, level) for run in shown.values()]
        lines.append([f"own objective at complementarity {level:.0e}", *passed])
    labels = list(dict.fromkeys(label for run in shown.values() for label in run.further))
    lines += [[label, *(run.further.get(label, "") for run in shown.values())] for label in labels]
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    rule = "  ".join("-" * width for width in widths)
    texts = [
        "  ".join([line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    ]
    heading = one.title[0].upper() + one.title[1:]
    if "ours" in one.runs:
        heading += f", fesd-robot to complementarity {one.settings.tolerance:g}"
    return "\n".join([heading, "", texts[0], rule, *texts[1:]])


def _objective_at(run: Outcome, complementarity: float) -> str:
    """Return the objective of the first NLP that was so complementary, which costs of later ones cannot show."""
    steps = [step for step in run.homotopy if step["complementarity"] <= ROUNDING * complementarity]
    return f"{steps[0]['objective']:.6g}" if steps else ""


def summary(comparisons: Sequence[Comparison]) -> str:
    """Return one table of all comparisons, a row a tool."""
    header = [
        "problem",
        "tool",
        "wall [s]",
        "time ratio",
        "iterations",
        "complementarity",
        "cost",
        "cost ratio",
        "target",
    ]
    rows = []
    for one in comparisons:
        costs = {tool: typical(runs).cost for tool, runs in one.runs.items()}
        for tool, runs in one.runs.items():
            run, mine = typical(runs), tool == "ours"
            rows.append(
                [
                    one.title if mine else "",
                    TITLES[tool] + ("" if run.verdict == "solved" else f" ({run.verdict})"),
                    f"{one.seconds(tool):.1f}",
                    "" if mine else f"{one.seconds('nosnoc') / one.seconds('ours'):.2f}",
                    f"{run.iterations}",
                    f"{run.complementarity:.1e}",
                    f"{run.cost:.6g}",
                    "" if mine else f"{costs['ours'] / costs['nosnoc']:.4f}",
                    (f"missed: {one.missed()}" if one.missed() else "met") if mine else "",
                ]
            )
    return markdown(header, rows)


def page(comparisons: Sequence[Comparison], versions: dict[str, str], command: str) -> str:
    """Return the page docs/results/compare_nosnoc.md."""
    packages = ", ".join(f"{name} {number}" for name, number in versions.items() if name != "python")
    tolerance, margin = comparisons[0].settings.tolerance, 100 * (COST_MARGIN - 1)
    tables = "\n\n".join(f"```\n{table(one, versions)}\n```" for one in comparisons)
    return f"""# Optimal control problems compared with nosnoc {versions["nosnoc"]}

Made by `{command}` on {machine()},
one process with one thread per run, one after the other, Python {versions["python"]}, {packages}.
Times are wall times from the description of a problem to its result.

{summary(comparisons)}

Targets: fesd-robot solves the problem with complementarity of at most {tolerance:g}, at a cost at most {margin:.0f} %
above that of nosnoc. Time ratio: nosnoc's over fesd-robot's; cost ratio: fesd-robot's over nosnoc's. Costs are those of
the returned motions, evaluated for both by the same function and without the terms that the tools add for themselves
(equal steps, regularisation of the step functions); complementarity is the largest product of a relaxed pair, as each
tool adds up its stages. A looser complementarity allows a lower cost: where nosnoc stops earlier, the tables below also
give the objective of fesd-robot's homotopy at the same complementarity.

The problems, each written down once in `scripts/benchmarks/compare/`, with the same bounds, costs, control intervals,
finite elements, scheme (Radau IIA with two stages) and start in both tools; nosnoc runs with its authors' settings,
among them the complementarity where it stops.

- *Hoppers*: the tasks `published_hopper_one_jump` and `published_hopper_five_jumps` in fesd-robot, its authors'
  example in nosnoc. fesd-robot runs by its default call on the uniform grid of these tasks, or with `--grid phases`
  on the grid that is the default of others, with refinement (more elements and stages than nosnoc), certificate and
  descents. It has the Filippov multipliers of the vector fields as variables, switches on the integrated gap and
  starts at its reference with consistent velocities; nosnoc has step functions and starts, as published, at the
  reference at rest. With the published weights of the fields the multipliers do not sum to one in contact: such
  motions do not obey the same physics, and their costs cannot be compared. With the correct weights they can.
- *Sliding mode*, *motor with friction*, *cart-pole with friction*: nosnoc's examples, in both tools in Stewart's form
  with the same cross complementarity and the same equal-step term. The best cost known for the sliding-mode problem, in
  closed form, is 5.592183.
- *Two-disc swap*: nosnoc for Python has no impulses at element boundaries in this version, so both tools freeze time,
  with the same auxiliary field; step functions in nosnoc, Filippov multipliers of the fields in fesd-robot.

fesd-robot runs with its own linear solver and compiled functions (the default), nosnoc with MUMPS; compiling the
functions of a large problem, which takes some seconds, counts only where they were not compiled before. All problems
are nonconvex: a result is one local optimum of several, and can change with the last bit of the input.

{tables}
"""
