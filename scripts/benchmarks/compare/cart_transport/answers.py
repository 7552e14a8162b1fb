"""What a tool answers to a measured state of the cart and its cargo, each asked in its own words."""

from __future__ import annotations

import contextlib
import io
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from fesd_robot.replanning.policy import Policy
from fesd_robot.replanning.replanner import Replanner
from scripts.benchmarks.compare import nosnoc_tool, switched
from scripts.benchmarks.compare.cart_transport.law import CARGO, CART, DURATION, FRICTION, GOAL, ridden

INTERVALS, ELEMENTS = 30, 2  # of nosnoc
WARM = 1e-6
"""First relaxation of nosnoc from its undisturbed solution; of 1e-2, 1e-3, 1e-4 and 1e-6 the fastest, all solved."""


@dataclass(frozen=True)
class Answer:
    """What a tool answered.

    Attributes:
        seconds: from the state to the controls.
        before: spent before the state was known, s.
        solved: the tool's own verdict.
        residual: the tool's own: violation of fesd-robot's equations, largest complementarity product of the others.
        own: how far from the goal it ends by the tool's own integration, m; None where it was not read.
        position, velocity: how far from the goal its controls lead under the exact law, m and m/s.
        cost: of the motion under the exact law.
        farthest: largest distance of the cargo from the cart's middle there, m.
    """

    seconds: float
    before: float
    solved: bool
    residual: float
    own: float | None
    position: float
    velocity: float
    cost: float
    farthest: float


def _judged(
    start: np.ndarray,
    controls: Sequence[tuple[float, float]],
    seconds: tuple[float, float],
    solved: bool,
    residual: float,
    own: float | None = None,
) -> Answer:
    ride = ridden(start, controls)
    return Answer(*seconds, solved, residual, own, *ride.errors, float(ride.cost), float(ride.farthest))


def measured(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, v and contacts of the task's robot, whose cargo moves relative to the cart."""
    cart, cargo, cart_speed, cargo_speed = state
    return np.array([cart, cargo - cart, 0.1]), np.array([cart_speed, cargo_speed - cart_speed, 0.0]), np.array([True])


def force(policy: Policy, at: float, state: np.ndarray) -> float:
    """Return the force of a policy, N."""
    return float(policy.action(at, *measured(state))[0])


class Ours:
    """A replanner, asked at the start of its plan.

    Args:
        plan: undisturbed.
        period: s.
    """

    def __init__(self, plan: Plan, period: float) -> None:
        begin = time.perf_counter()
        self.replanner = Replanner(plan, period=period)
        self.made = time.perf_counter() - begin

    def __call__(self, start: np.ndarray) -> Answer:
        """Return the answer to a start."""
        self.replanner.reset()
        policy = self.replanner.update(0.0, *measured(start))
        update = self.replanner.statistics.updates[-1]
        times, values = policy.controls
        controls = list(zip(values[:, 0].tolist(), np.diff(times).tolist(), strict=True))
        seconds = update.feedback_seconds, update.prepare_seconds
        return _judged(start, controls, seconds, update.status == "kept", update.violation)


class Impact:
    """IMPACT's program for this task, with its authors' settings: 300 steps of 0.02 s, from a constant guess.

    Args:
        program: its path.
    """

    STEP = 0.02

    def __init__(self, program: Path) -> None:
        self._program = program.resolve()

    def can_begin_in(self, state: np.ndarray) -> bool:
        """Return whether the cargo stays on the cart for the first step, whatever the control: explicit Euler."""
        return bool(abs(state[1] - state[0] + self.STEP * (state[3] - state[2])) <= 1.0)

    def __call__(self, start: np.ndarray) -> Answer:
        """Return the answer to a start; its time is the one that the program prints, without building the problem."""
        order = [1, 0, 3, 2]  # the cargo comes first there
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "motion.txt"
            words = [*(repr(float(x)) for x in start[order]), *(repr(float(x)) for x in GOAL[order]), str(file)]
            printed = subprocess.run([str(self._program), *words], capture_output=True, text=True, check=True).stdout
            text = file.read_text(encoding="utf-8")
        rows = text.split("# Control Trajectory")[1].splitlines()[1:]
        controls = [(float(row.split()[1]), self.STEP) for row in rows if row.strip()]

        def number(label: str) -> float:
            found = re.search(rf"{label}:\s*(\S+)", printed)
            assert found is not None
            return float(found.group(1))

        seconds = number("Solve time"), 0.0
        return _judged(
            start,
            controls,
            seconds,
            "Converged: YES" in printed,
            *(number(label) for label in ("Complementarity violation", "Position error")),
        )


class Nosnoc:
    """nosnoc with its homotopy, built once, from its default guess or from its undisturbed solution.

    Args:
        sigma: first relaxation from the latter; default: from the default guess, with nosnoc's own.
    """

    def __init__(self, sigma: float | None = None) -> None:
        import nosnoc

        begin = time.perf_counter()
        x, u = ca.SX.sym("x", 4), ca.SX.sym("u")  # cart, cargo on it, and their velocities
        slide = x[3]

        def field(friction: float) -> ca.SX:
            pull = (u - friction) / CART
            return ca.vertcat(x[2], slide, pull, friction / CARGO - pull)

        opts = nosnoc_tool.options()
        opts.print_level = 0
        opts.terminal_time, opts.N_stages, opts.N_finite_elements = DURATION, INTERVALS, ELEMENTS
        opts.irk_scheme, opts.n_s = nosnoc.IrkSchemes.RADAU_IIA, switched.TABLEAU.stages
        opts.irk_representation = nosnoc.IrkRepresentation.INTEGRAL
        opts.step_equilibration = nosnoc.StepEquilibrationMode.L2_RELAXED_SCALED
        opts.comp_tol = 1e-6
        model = nosnoc.NosnocModel(
            name="cart_transport",
            x=x,
            x0=np.zeros(4),
            u=u,
            F=[ca.horzcat(field(-FRICTION), field(FRICTION))],
            c=[slide],
            S=[switched.SIGNS],
        )
        limits = np.array([10.0, 1.0, 20.0, 20.0])
        ocp = nosnoc.NosnocOcp(
            lbu=np.array([-10.0]),
            ubu=np.array([10.0]),
            lbx=-limits,
            ubx=limits,
            f_q=u**2 + slide**2,
            g_terminal=x - ca.DM([0.0, 1.0, 0.0, 0.0]),
        )
        self._solver, self._success = nosnoc.NosnocSolver(opts, model, ocp), nosnoc.Status.SUCCESS
        self._warm = None
        if sigma is not None:
            with contextlib.redirect_stdout(io.StringIO()):
                self._warm = self._solver.solve()["w_sol"]
            opts.sigma_0, opts.initialization_strategy = sigma, nosnoc.InitializationStrategy.EXTERNAL
        self.made = time.perf_counter() - begin

    def __call__(self, start: np.ndarray) -> Answer:
        """Return the answer to a start."""
        cart, cargo, cart_speed, cargo_speed = start
        self._solver.set("x0", np.array([cart, cargo - cart, cart_speed, cargo_speed - cart_speed]))
        if self._warm is not None:
            self._solver.set("w", self._warm.copy())
        begin = time.perf_counter()
        with contextlib.redirect_stdout(io.StringIO()):
            results = self._solver.solve()
        seconds = time.perf_counter() - begin, 0.0
        problem, w = self._solver.problem, results["w_sol"]
        steps = w[np.array(problem.ind_h).ravel()].reshape(INTERVALS, ELEMENTS).sum(axis=1)
        forces = [float(w[np.array(index, dtype=int)][0]) for index in problem.ind_u]
        complementarity = float(problem.comp_res(w, self._solver.p_val))
        controls = list(zip(forces, steps.tolist(), strict=True))
        return _judged(start, controls, seconds, results["status"] == self._success, complementarity)


AnswerTo = Callable[[np.ndarray], Answer]
"""Start -> what a tool answers."""
