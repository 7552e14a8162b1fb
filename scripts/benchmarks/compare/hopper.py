"""The jumping hopper: the shipped task in fesd-robot, the step-function form of the FESD papers in nosnoc.

State (x, y, angle, leg length, their rates, clock), controls (torque, leg force, slack, speed of time). Contact by
time-freezing: gap, normal and tangential foot velocity switch between the motion and an auxiliary field in which the
clock stands still. `Settings.multipliers` says how nosnoc's steps weight these fields: `published` as in the example
that accompanies the paper, where the weights do not sum to 1 at the ground, `correct` with weights that do.

Sources: arXiv 2303.18066 (step functions, the hopper), arXiv 2111.06759 (time-freezing).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from scripts.benchmarks.compare import nosnoc_tool
from scripts.benchmarks.compare.outcome import Outcome, Settings, show_nlp

if TYPE_CHECKING:
    from nosnoc import NosnocModel, NosnocOcp, NosnocOpts

TASKS = Path(__file__).resolve().parents[3] / "tasks"
TOUCHING = 2e-3
"""m; a foot closer to the ground than this is on it."""
CLEARANCE = 0.1
"""m; a flight counts if the foot rises higher than this."""

TOTAL_MASS, LEG_MASS, TOTAL_INERTIA = 1.1, 0.1, 0.275  # kg, kg, kg m2
FRICTION, GRAVITY, AUXILIARY_ACCELERATION = 0.45, 9.81, 100.0  # -, m/s2, m/s2
START_X, STANDING, APEX, LEG_AT_APEX = 0.1, 0.5, 1.0, 0.1  # m
SPEED_OF_TIME = (0.1, 20.0)
RUNNING = np.diag([100, 100, 20, 50, 0.1, 0.1, 0.1, 0.1])
TERMINAL = np.diag([300, 300, 300, 300, 0.1, 0.1, 0.1, 0.1])
CONTROL = np.diag([0.01, 0.01, 1e-5])  # torque, leg force, slack
MASS_MATRIX = np.diag([TOTAL_MASS, TOTAL_MASS, TOTAL_INERTIA, LEG_MASS])


@dataclass(frozen=True)
class Course:
    """Where to, in how many jumps, in how much time: m, -, s, control intervals."""

    goal: float
    jumps: int
    duration: float
    intervals: int

    def reference(self) -> np.ndarray:
        """States at the ends of all intervals, without the clock, first the initial one, (intervals + 1, 8).

        One jump is a spline through its start, apex and end: a parabola.
        """
        length = (self.goal - START_X) / self.jumps
        share = np.linspace(0, 1, self.intervals // self.jumps + 1)[1:]
        start = np.array([START_X, STANDING, 0, STANDING, 0, 0, 0, 0])
        states = start[None]
        for _ in range(self.jumps):
            apex = np.array([start[0] + length / 2, APEX, 0, LEG_AT_APEX, 0, 0, 0, 0])
            end = np.array([start[0] + length, STANDING, 0, STANDING, 0, 0, 0, 0])
            arc = CubicSpline([0, 0.5, 1], [start, apex, end])(share)
            states = np.vstack([states, arc[:-1], end])
            start = end
        return states


COURSES = {"five_jumps": Course(5.0, 5, 5.0, 50), "one_jump": Course(1.0, 1, 1.0, 20)}


def gap(states: np.ndarray) -> np.ndarray:
    """Height of the foot above the ground, m; states have shape (n, 8) or more columns."""
    return states[:, 1] - states[:, 3] * np.cos(states[:, 2])


def tracking_cost(
    course: Course, time: np.ndarray, states: np.ndarray, controls: np.ndarray, interval: np.ndarray
) -> float:
    """Cost of a motion in physical time, by the trapezoidal rule between its samples.

    The reference is that of N equal intervals of time, whatever the intervals of the controls are.

    Args:
        time: s, (n). states: without the clock, (n, 8). controls: torque and leg force per interval, (intervals, 2).
        interval: which interval the piece after each sample but the last belongs to, integers, (n - 1).
    """
    ends, middle = course.reference()[1:], 0.5 * (time[:-1] + time[1:])
    reference = ends[np.clip((middle / course.duration * len(ends)).astype(int), 0, len(ends) - 1)]
    left, right = (_squares(part - reference, RUNNING) for part in (states[:-1], states[1:]))
    running = np.sum(np.diff(time) * (0.5 * (left + right) + _squares(controls[interval], CONTROL[:2, :2])))
    return float(running + _squares(states[-1:] - ends[-1], TERMINAL)[0])


def _squares(rows: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.sum((rows @ weights) * rows, axis=1)


def count_flights(gap: Sequence[float]) -> int:
    """Return how many maximal runs of samples off the ground rise above `CLEARANCE`."""
    flights, highest = 0, 0.0
    for value in [*gap, 0.0]:
        if value > TOUCHING:
            highest = max(highest, value)
        else:
            flights += highest > CLEARANCE
            highest = 0.0
    return flights


def further(final_x: float, gap: Sequence[float], clock_error: float, theta_error: float) -> dict[str, str]:
    """Return what else tells two motions of the hopper apart."""
    return {
        "final x [m]": f"{final_x:.4f}",
        f"flights with more than {CLEARANCE:g} m clearance": f"{count_flights(gap)}",
        "clock error [s]": f"{clock_error:.1e}",
        "max |sum theta - 1|": f"{theta_error:.1e}",
        "min gap [m]": f"{min(gap):.1e}",
    }


def ours(name: str, settings: Settings) -> Outcome:
    """Plan the task file with fesd-robot."""
    from fesd_robot import load_task, plan

    begin, cpu = time.perf_counter(), time.process_time()
    chosen = [f"solver.tolerance={settings.tolerance!r}", f"solver.linear_solver={settings.linear_solver}"]
    chosen += [f"method.grid={settings.grid}", "solver.processes=1"]
    task = load_task(TASKS / f"published_hopper_{name}.yaml", chosen)
    made = plan(task, progress=show_nlp)
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    trajectory, statistic, foot = made.trajectory, made.statistics, made.contacts["foot"]
    states = np.column_stack([*trajectory.configuration.values(), *trajectory.velocity.values()])
    middle = 0.5 * (trajectory.time[:-1] + trajectory.time[1:])
    interval = np.clip(np.searchsorted(made.controls["time"], middle) - 1, 0, None)
    controls = np.column_stack([made.controls["reaction_torque"], made.controls["leg_force"]])
    return Outcome(
        verdict="solved" if made.status.solved else "not solved",
        last_nlp=made.status.nlp,
        wall_seconds=wall,
        cpu_seconds=cpu,
        iterations=sum(attempt.iterations for attempt in statistic.attempts),
        complementarity=made.status.complementarity,
        constraint_violation=made.status.constraint_violation,
        objective=statistic.objective,
        cost=tracking_cost(COURSES[name], trajectory.time, states, controls, interval),
        variables=statistic.variables,
        constraints=statistic.constraints,
        further=further(
            float(trajectory.configuration["root_x"][-1]),
            foot.gap.tolist(),
            made.audit.max_clock_error,
            made.audit.max_theta_sum_error,
        ),
        homotopy=[step.model_dump() for step in statistic.homotopy],
        details={
            "status": made.status.model_dump(),
            "audit": made.audit.model_dump(),
            "attempts": len(statistic.attempts),
            "cost_terms": statistic.cost_terms,
            "build_seconds": statistic.build_seconds,
            "solve_seconds": statistic.solve_seconds,
        },
    )


def nosnoc(name: str, settings: Settings) -> Outcome:
    """Solve the step-function form of the same hopper with nosnoc, started at the reference."""
    begin = time.perf_counter(), time.process_time()
    course = COURSES[name]
    opts, (model, ocp) = options(course), build(course, settings.multipliers)
    clock = np.linspace(0, course.duration, course.intervals + 1)
    solution = nosnoc_tool.run(opts, model, ocp, begin, np.column_stack([course.reference(), clock])[1:])
    problem, w = solution.solver.problem, solution.w
    elements = [stages for interval in problem.ind_x for stages in interval]
    per_interval = opts.N_finite_elements * opts.n_s
    stages = w[np.array(elements).reshape(-1, 9)]
    states = np.vstack([solution.solver.model.x0, stages])
    algebraic = np.array([stages for interval in problem.ind_z for stages in interval]).reshape(-1, 4)
    ends = stages[per_interval - 1 :: per_interval, 8]
    cost = tracking_cost(
        course,
        states[:, 8],
        states[:, :8],
        w[np.array(problem.ind_u)][:, :2],
        np.repeat(np.arange(course.intervals), per_interval),
    )
    return solution.outcome(
        cost,
        further(
            float(states[-1, 0]),
            gap(states).tolist(),
            float(np.abs(ends - clock[1:]).max()),
            float(np.abs(w[algebraic[:, :3]].sum(axis=1) - 1).max()),
        ),
        multipliers=settings.multipliers,
        final_state=states[-1].tolist(),
    )


def build(course: Course, multipliers: str) -> tuple[NosnocModel, NosnocOcp]:
    """Return the hopper's dynamics and its optimal control problem."""
    from nosnoc import NosnocModel, NosnocOcp

    q, v, clock = ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("t")
    force, slack, speed = ca.SX.sym("force", 2), ca.SX.sym("slack"), ca.SX.sym("s")
    steps = ca.SX.sym("alpha", 3)
    weights, frozen = ca.SX.sym("theta", 3), ca.SX.sym("beta")
    tracked = ca.SX.sym("tracked", 8)
    state = ca.vertcat(q, v)
    reference = course.reference()
    inverse_inertia = ca.inv(MASS_MATRIX)

    gap_now = q[1] - q[3] * ca.cos(q[2])
    normal = ca.vertcat(0, 1, q[3] * ca.sin(q[2]), -ca.cos(q[2]))
    tangent = ca.vertcat(1, 0, q[3] * ca.cos(q[2]), ca.sin(q[2]))
    normal_velocity, tangent_speed = normal.T @ v, tangent.T @ v
    weight = np.array([0, -TOTAL_MASS * GRAVITY, 0, 0])
    applied = weight + ca.vertcat(-ca.sin(q[2]) * force[1], ca.cos(q[2]) * force[1], force[0], force[1])
    motion = speed * ca.vertcat(v, inverse_inertia @ applied, 1)
    slide_forward, slide_backward = (
        ca.vertcat(ca.DM.zeros(4), inverse_inertia @ push * AUXILIARY_ACCELERATION, 0)
        for push in (normal - FRICTION * tangent, normal + FRICTION * tangent)
    )
    on_gap, on_normal, on_tangent = ca.vertsplit(steps)
    moving = on_gap + frozen if multipliers == "published" else 1 - frozen
    model = NosnocModel(
        name="hopper",
        x=ca.vertcat(state, clock),
        x0=np.append(reference[0], 0.0),
        u=ca.vertcat(force, slack, speed),
        z=ca.vertcat(weights, frozen),
        z0=np.ones(4),
        g_z=ca.vertcat(
            weights - ca.vertcat(moving, frozen * on_tangent, frozen * (1 - on_tangent)),
            frozen - (1 - on_gap) * (1 - on_normal),
        ),
        alpha=[steps],
        c=[ca.vertcat(gap_now, normal_velocity, tangent_speed)],
        f_x=[weights[0] * motion + weights[1] * slide_forward + weights[2] * slide_backward],
        p_time_var=tracked,
        p_time_var_val=reference[1:],
        t_var=clock,
    )
    effort = ca.vertcat(force, slack)
    ocp = NosnocOcp(
        lbu=np.array([-50, -50, 0, SPEED_OF_TIME[0]]),
        ubu=np.array([50, 50, 100, SPEED_OF_TIME[1]]),
        u_guess=np.array([0, 0, 0, 1]),
        lbx=np.array([0, 0, -np.pi, 0.1, -10, -10, -5, -5, -np.inf]),
        ubx=np.array([course.goal + 0.1, 1.5, np.pi, 0.5, 10, 10, 5, 5, np.inf]),
        f_q=speed * ((state - tracked).T @ RUNNING @ (state - tracked) + effort.T @ CONTROL @ effort),
        f_terminal=(state - reference[-1]).T @ TERMINAL @ (state - reference[-1]),
        g_path_comp=ca.horzcat(ca.vertcat(tangent_speed, -tangent_speed), ca.vertcat(frozen, frozen)),
    )
    return model, ocp


def options(course: Course) -> NosnocOpts:
    """Return the settings of the published run."""
    import nosnoc

    opts = nosnoc_tool.options()
    opts.terminal_time = course.duration
    opts.N_stages, opts.N_finite_elements = course.intervals, 3
    opts.irk_scheme, opts.n_s = nosnoc.IrkSchemes.RADAU_IIA, 2
    opts.irk_representation = nosnoc.IrkRepresentation.INTEGRAL
    opts.pss_mode = nosnoc.PssMode.STEP
    opts.cross_comp_mode = nosnoc.CrossComplementarityMode.SUM_LAMBDAS_COMPLEMENT_WITH_EVERY_THETA
    opts.step_equilibration, opts.rho_h = nosnoc.StepEquilibrationMode.HEURISTIC_MEAN, 1.0
    opts.time_freezing, opts.equidistant_control_grid = True, True
    opts.time_freezing_tolerance = 1e-3
    opts.mpcc_mode = nosnoc.MpccMode.SCHOLTES_INEQ
    opts.sigma_0, opts.comp_tol = 100.0, 1e-9  # nosnoc derives IPOPT's tolerance 1e-11 from comp_tol
    opts.homotopy_update_rule, opts.homotopy_update_slope = nosnoc.HomotopyUpdateRule.LINEAR, 0.1
    opts.max_iter_homotopy = 6
    opts.initialization_strategy = nosnoc.InitializationStrategy.EXTERNAL
    opts.opts_casadi_nlp["ipopt"].update(
        max_iter=4000, acceptable_tol=1e-6, mu_strategy="adaptive", mu_oracle="quality-function"
    )
    return opts
