"""The jumping hopper as a problem for nosnoc, in the step-function form of the FESD papers.

State (x, y, angle, leg length, their rates, clock), controls (torque, leg force, slack, speed of time). Contact by
time-freezing: gap, normal and tangential foot velocity switch between the motion and an auxiliary field in which the
clock stands still. `Multipliers` says how the steps weigh these fields: `published` as in the example that
accompanies the paper, where the weights do not sum to 1 at the ground, `correct` with weights that do.

Course, reference and `tracking_cost` can be used without nosnoc.

Sources: arXiv 2303.18066 (step functions, the hopper), arXiv 2111.06759 (time-freezing).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

if TYPE_CHECKING:
    from nosnoc import NosnocModel, NosnocOcp, NosnocOpts, NosnocSolver

Multipliers = Literal["published", "correct"]

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

    Args:
        time: s, (n). states: without the clock, (n, 8). controls: torque and leg force per interval, (intervals, 2).
        interval: which interval the piece after each sample but the last belongs to, integers, (n - 1).
    """
    ends = course.reference()[1:]
    reference = ends[interval]
    left, right = (_squares(part - reference, RUNNING) for part in (states[:-1], states[1:]))
    running = np.sum(np.diff(time) * (0.5 * (left + right) + _squares(controls[interval], CONTROL[:2, :2])))
    return float(running + _squares(states[-1:] - ends[-1], TERMINAL)[0])


def _squares(rows: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.sum((rows @ weights) * rows, axis=1)


def build(course: Course, multipliers: Multipliers) -> tuple[NosnocModel, NosnocOcp]:
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
    normal_speed, tangent_speed = normal.T @ v, tangent.T @ v
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
        c=[ca.vertcat(gap_now, normal_speed, tangent_speed)],
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

    opts = nosnoc.NosnocOpts()
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
    opts.print_level = 1
    opts.opts_casadi_nlp["ipopt"].update(
        max_iter=4000, acceptable_tol=1e-6, mu_strategy="adaptive", mu_oracle="quality-function"
    )
    return opts


def prepare(course: Course, multipliers: Multipliers) -> NosnocSolver:
    """Return the solver, started at the reference."""
    from nosnoc import NosnocSolver

    solver = NosnocSolver(options(course), *build(course, multipliers))
    clock = np.linspace(0, course.duration, course.intervals + 1)
    solver.set("x", np.column_stack([course.reference(), clock])[1:])
    return solver


@dataclass(frozen=True)
class Solution:
    """What nosnoc returned.

    Attributes:
        states: initial value and all stage values in order, clock last, (n, 9).
        interval: interval of the piece after each sample but the last, (n - 1).
        interval_ends: clock at the end of every interval, s.
        controls: torque, leg force, slack, speed of time per interval, (intervals, 4).
        weights: the three multipliers at all stages, (n - 1, 3).
        success: nosnoc's own verdict.
        status: IPOPT's word on the last NLP.
        objective: of the NLP, with its step-equilibration term.
        complementarity: largest product of a relaxed pair as nosnoc adds them up.
        stage_complementarity: largest product of single stage values, nosnoc's own residual.
        constraint_violation: largest violation of a constraint of the last NLP or of a bound.
        homotopy: sigma, iterations, seconds, objective and complementarity of every NLP.
    """

    states: np.ndarray
    interval: np.ndarray
    interval_ends: np.ndarray
    controls: np.ndarray
    weights: np.ndarray
    success: bool
    status: str
    objective: float
    complementarity: float
    stage_complementarity: float
    constraint_violation: float
    homotopy: list[dict[str, Any]]


def solve(solver: NosnocSolver) -> Solution:
    """Run nosnoc's homotopy and read the result off all stages."""
    from nosnoc import Status

    results = solver.solve()
    problem, opts, w = solver.problem, solver.opts, results["w_sol"]
    elements = [stages for interval in problem.ind_x for stages in interval]
    per_interval = opts.N_finite_elements * opts.n_s
    stage_states = w[np.array(elements).reshape(-1, 9)]
    algebraic = np.array([stages for interval in problem.ind_z for stages in interval]).reshape(-1, 4)
    homotopy, sigma = [], opts.sigma_0
    for iterations, seconds, point in zip(
        results["nlp_iter"], results["cpu_time_nlp"], results["w_all"][1:], strict=False
    ):
        homotopy.append(
            {"sigma": sigma, "iterations": iterations, "seconds": seconds, **_residuals(solver, point, sigma)}
        )
        sigma = solver.homotopy_sigma_update(sigma)
    last = homotopy[-1]
    return Solution(
        states=np.vstack([solver.model.x0, stage_states]),
        interval=np.repeat(np.arange(opts.N_stages), per_interval),
        interval_ends=stage_states[per_interval - 1 :: per_interval, 8],
        controls=w[np.array(problem.ind_u)],
        weights=w[algebraic[:, :3]],
        success=results["status"] == Status.SUCCESS,
        status=solver.solver.stats()["return_status"],
        objective=last["objective"],
        complementarity=last["complementarity"],
        stage_complementarity=last["stage_complementarity"],
        constraint_violation=last["constraint_violation"],
        homotopy=homotopy,
    )


def _residuals(solver: NosnocSolver, w: np.ndarray, sigma: float) -> dict[str, float]:
    problem = solver.problem
    solver.setup_p_val(sigma, 0.0)
    g = np.asarray(problem.g_fun(w, solver.p_val)).ravel()
    pairs = np.concatenate([rows for interval in problem.ind_comp for element in interval for rows in element])
    excess = np.concatenate([problem.lbg - g, g - problem.ubg, problem.lbw - w, w - problem.ubw])
    return {
        "objective": float(problem.cost_fun(w, solver.p_val)),
        "complementarity": float(g[pairs].max() + sigma),
        "stage_complementarity": float(problem.comp_res(w, solver.p_val)),
        "constraint_violation": max(0.0, float(excess.max())),
    }
