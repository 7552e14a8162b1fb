"""The jumping hopper in the forms of its contact logic: set-valued step functions against Stewart's regions.

    python scripts/results/reproduce/hopper_forms.py
    python scripts/results/reproduce/hopper_forms.py --quick

Three metres in five seconds with three jumps. Gap, normal and tangential velocity of the foot switch between the motion
and the auxiliary fields of a time-freezing contact. Stewart's form needs a multiplier for each of the eight sign
vectors, six of them with the same field; step functions need one step a switching function. The fields of all forms
are the same expressions. Times are those of one IPOPT iteration in the first NLP of the homotopy.
"""

from __future__ import annotations

from scripts.results.reproduce._common import Report, markdown_table, reference  # isort: skip  # sets OMP_NUM_THREADS before numpy is imported

import re
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot import load_task
from fesd_robot.contact import StepOptions
from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.fesd import OptimalControlProblem, Transcription
from fesd_robot.mpcc import HomotopyOptions, Mpcc, Run, solve
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.running import Deadline

TASK = Path(__file__).resolve().parents[3] / "tasks" / "published_hopper_five_jumps.yaml"
INTERVALS = (60, 66, 72, 78, 84, 90, 96, 102, 108)
WHOLE = (60, 84)
"""Intervals of the problems that are solved."""
TIME_LIMIT, LAST_SIGMA = 45.0, 1e-3  # s, of a whole homotopy
ITERATIONS, REPEAT = 40, 3
TARGET = 0.8
"""Largest ratio of the time of an iteration, step functions over Stewart's form."""
PUBLISHED = StepOptions(gap="true", gate=False, regularisation_weight=0.0)
FORMS: Mapping[str, tuple[Literal["multipliers", "steps"], StepOptions]] = {
    "Stewart": ("steps", PUBLISHED),
    "steps": ("steps", PUBLISHED),
    "gated steps": ("steps", StepOptions()),
    "multipliers": ("multipliers", StepOptions()),
}
"""Form of this page -> form of the contact logic and its variant; Stewart's is made from the published steps."""
TITLES = {
    "Stewart": "Stewart, 8 regions",
    "steps": "step functions, published",
    "gated steps": "step functions, gated",
    "multipliers": "multipliers (default)",
}
PARTS = {
    "total": r"OverallAlgorithm\.*: +([\d.]+)",
    "linear solver": r"PDSystemSolverTotal\.*: +([\d.]+)",
    "iterations": r"Number of Iterations\.*: +(\d+)",
}
"""CPU seconds in IPOPT's timing statistics."""


@dataclass
class Form:
    """A form of one problem, ready to be solved.

    Attributes:
        problem, nlp: the MPCC and its relaxation.
        runs: milliseconds an iteration by part.
    """

    problem: Mpcc
    nlp: RelaxedNlp
    runs: list[dict[str, float]] = field(default_factory=list)

    def time(self) -> None:
        """Run the first iterations of the first NLP."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "ipopt.txt"
            ipopt = {"print_timing_statistics": "yes", "output_file": str(file), "file_print_level": 3}
            options = HomotopyOptions(
                tolerance=0.99,
                sigma_start=1.0,
                velocity_level_ratio=1.0,
                max_iterations=ITERATIONS,
                linear_solver="mumps",
                ipopt=ipopt,
            )
            solve(self.problem, Run(options), nlp=self.nlp)
            text = file.read_text(encoding="utf-8")
        values = {part: float(re.findall(pattern, text)[0]) for part, pattern in PARTS.items()}
        self.runs.append({part: 1e3 * values[part] / values["iterations"] for part in ("total", "linear solver")})

    def median(self, part: str) -> float:
        """Return the median over the runs, ms."""
        return float(np.median([run[part] for run in self.runs]))


def transcribe(form: str, intervals: int) -> Transcription:
    """Return the hopper's problem in a form."""
    contact, steps = FORMS[form]
    task = load_task(
        TASK,
        [
            "goal.configuration.root_x=3",
            "limits.position.root_x=[0, 3.1]",
            "reference.count=3",
            f"horizon.intervals={intervals}",
            f"method.formulation.type={contact}",
        ],
    )
    motion = formulate(task, steps=steps)
    ocp = stewart_form(motion) if form == "Stewart" else motion.ocp
    return Transcription(ocp, motion.fesd)


def stewart_form(motion: MotionProblem) -> OptimalControlProblem:
    """Return a problem in the published step functions with its right-hand side at their eight corners as regions.

    The field of the region with signs S is ``f(x, u, alpha)`` at ``alpha = (1 + S) / 2``, and
    ``beta = sum_j beta_j theta_j`` weights the costs.
    """
    old = motion.ocp.system
    contact, v = motion.contacts[0], motion.dynamics.velocity
    signs = np.array(list(product((1, -1), repeat=3)))
    closed = np.array([(1 - at_gap) * (1 - parting) / 4 for at_gap, parting, _ in signs])

    def at(expression: ca.SX, alpha: Sequence[float], beta: ca.SX) -> ca.SX:
        return ca.substitute(expression, old.algebraic, ca.vertcat(*alpha, ca.SX.zeros(6), beta))

    system = stewart(
        Model(
            state=old.state,
            control=old.control,
            parameters=old.parameters,
            mass_matrix=old.mass_matrix,
            state_names=old.state_names,
            control_names=old.control_names,
        ),
        Subsystem(
            switching=ca.vertcat(contact.gap, ca.dot(contact.normal, v), ca.dot(contact.tangents, v)),
            sign_matrix=signs,
            fields=ca.horzcat(
                *[at(old.right_hand_side, (1 + row) / 2, ca.SX(beta)) for row, beta in zip(signs, closed, strict=True)]
            ),
        ),
    )
    frozen = ca.dot(ca.DM(closed), system.algebraic[: len(signs)])
    return replace(
        motion.ocp,
        system=system,
        running_cost={name: at(term, (0, 0, 0), frozen) for name, term in motion.ocp.running_cost.items()},
    )


def prepare(form: str, intervals: int) -> Form:
    """Return a form of the problem, relaxed, with its functions interpreted as in the publication."""
    problem = transcribe(form, intervals).problem
    return Form(problem, assemble(problem, RELAXATIONS["scholtes"]))


def iteration_table(counts: Sequence[int], repeat: int) -> tuple[str, str, dict[int, float]]:
    """Return the sizes, the times of an iteration, and the ratio of step functions to Stewart's form by intervals."""
    sizes, times, ratios = [], [], {}
    for count in counts:
        forms = {form: prepare(form, count) for form in FORMS}
        for _ in range(repeat):
            for form in forms.values():
                form.time()
        total = {name: form.median("total") for name, form in forms.items()}
        ratios[count] = total["steps"] / total["Stewart"]
        problems = [form.problem for form in forms.values()]
        sizes.append([f"{count}", *(f"{one.size} / {one.constraints} / {one.pairs}" for one in problems)])
        times.append(
            [
                f"{count}",
                *(f"{total[name]:.1f} ({form.median('linear solver'):.1f})" for name, form in forms.items()),
                f"{ratios[count]:.2f}",
                f"{100 * (1 - ratios[count]):.0f} %",
                f"{total['gated steps'] / total['Stewart']:.2f}",
                f"{total['multipliers'] / total['Stewart']:.2f}",
            ]
        )
        print("  ".join(times[-1]), flush=True)
    titles = [f"{TITLES[name]}" for name in FORMS]
    header = ["N", *titles, "published / Stewart", "saving", "gated / Stewart", "multipliers / Stewart"]
    return markdown_table(["N", *titles], sizes), markdown_table(header, times), ratios


def whole_table(counts: Sequence[int]) -> str:
    """Return what whole homotopies take."""
    rows = []
    for count in counts:
        for form in FORMS:
            problem = transcribe(form, count).problem
            options = HomotopyOptions(
                tolerance=LAST_SIGMA,
                sigma_start=1.0,
                velocity_level_ratio=1000.0,
                linear_solver="auto",
                compile="never",
            )
            begin = time.process_time()
            solution = solve(problem, Run(options, Deadline(TIME_LIMIT)))
            seconds, iterations = time.process_time() - begin, max(solution.iterations, 1)
            rows.append(
                [
                    f"{count}",
                    TITLES[form],
                    f"{seconds:.1f}",
                    f"{solution.iterations}",
                    f"{1e3 * seconds / iterations:.1f}",
                    f"{solution.reports[-1].sigma:.1e}",
                    f"{solution.residuals.objective:.2f}",
                    "solved" if solution.solved else solution.status,
                ]
            )
            print("  ".join(rows[-1]), flush=True)
    header = ["N", "form", "CPU [s]", "iterations", "ms / iteration", "last sigma", "objective", "end"]
    return markdown_table(header, rows)


def main() -> None:
    """Compare the forms and write the page."""
    report = Report("hopper_forms", "Forms of the contact logic on the jumping hopper", str(__doc__).splitlines()[0])
    arguments = report.parse()
    counts, whole = (INTERVALS[::4], WHOLE[:1]) if arguments.quick else (INTERVALS, WHOLE)
    report.add(
        "The hopper of the FESD papers crosses 3 m in 5 s with three jumps: N control intervals, three finite elements "
        "each, Radau IIA with two stages. One process and one thread, MUMPS, functions interpreted. Stewart's form and "
        "the published step functions have the same fields, costs, bounds and start; the gated steps and the "
        "multipliers switch on the integrated gap, which is one more state."
    )
    sizes, times, ratios = iteration_table(counts, REPEAT)
    stages = [f"{TITLES[form]}: {transcribe(form, counts[0]).ocp.system.algebraic.numel()}" for form in FORMS]
    report.add(f"Variables / constraints / pairs. Algebraic variables at a stage: {', '.join(stages)}.\n\n{sizes}")
    report.add(
        f"CPU milliseconds per IPOPT iteration, in brackets those of the linear solver: first NLP (sigma = 1), "
        f"{ITERATIONS} iterations, median of {REPEAT} runs in which the forms took turns. An iteration whose matrix "
        "has the wrong inertia factorises it more than once.\n\n" + times
    )
    savings, known = [1 - ratio for ratio in ratios.values()], reference("hopper_forms")["saving"]
    report.add(
        f"The published step functions save {100 * min(savings):.0f} to {100 * max(savings):.0f} % of an iteration of "
        f"Stewart's form. In nosnoc 0.2.0, whose step functions have four further variables a stage, they save "
        f"{100 * min(known):.0f} to {100 * max(known):.0f} % on the same grid."
    )
    report.add(
        f"Whole homotopies, sigma from 1 to {LAST_SIGMA:g}, at most {TIME_LIMIT:.0f} s each, with our own linear "
        "solver. Last sigma: of the position level; that of the velocity level is larger in the multiplier form. The "
        "problems are nonconvex: different forms end in different optima, and the numbers of iterations are those of a "
        "single run.\n\n" + whole_table(whole)
    )
    report.check("an iteration with step functions is cheaper at every N", max(ratios.values()) < 1)
    report.check(f"its ratio is below {TARGET:g} at every N", max(ratios.values()) < TARGET)
    report.close()


if __name__ == "__main__":
    main()
