"""Two discs swap places round an obstacle; only the first has a drive, the second must be pushed.

q = (q_1, q_2), masses 2 and 1 kg, radii 0.3 and 0.2 m, from (-2, 0) and (2, 0) to each other's place in 4 s; the
obstacle is a disc of radius 1 m at 0, drag is -2 v_i / sqrt(|v_i|^2 + 0.1^2) (the paper writes |v_i + 0.1|, which
vanishes for some velocities), contact is inelastic and without friction. nosnoc for Python had no impulses at element
boundaries (FESD-J) at version 0.2.0, so that both tools freeze time: gap and normal velocity switch between the motion
and an auxiliary field in which the clock stands still. An impact fills an element of its own, hence three elements an
interval instead of the two of FESD-J. The obstacle is the bound of an algebraic variable at every stage, in both tools.

Source: arXiv 2305.17003, section 5.2 (the problem); nosnoc's example disc_switch_places (time-freezing of discs).
"""

from __future__ import annotations

import dataclasses
import time
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.contact import Contact, ContactOptions, MultibodyDynamics, contact_system
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription
from scripts.benchmarks.compare import nosnoc_tool, switched
from scripts.benchmarks.compare.outcome import Outcome, Settings
from scripts.benchmarks.compare.samples import Samples

MASSES, RADII, OBSTACLE = (2.0, 1.0), (0.3, 0.2), 1.0  # kg, m, m
DRAG, DRAG_WIDTH = 2.0, 0.1  # N, m/s
FORCE_LIMIT, PLACE_LIMIT, VELOCITY_LIMIT = 30.0, 10.0, 5.0  # N, m, m/s
PUSH = 100.0
"""a_n of the auxiliary field, N."""
SPEED_OF_TIME = (0.1, 20.0)
DURATION, INTERVALS, ELEMENTS = 4.0, 25, 3
MOMENTS = np.array([0, 1.35, 2.75, 4.0])
"""s; when, in the start of the solvers, the first disc has reached the second, has brought it over, and is back."""
RUNNING, TERMINAL_FACTOR, CONTROL = np.array([10.0] * 4 + [0.01] * 4), 100.0, 0.1
START, GOAL = np.array([-2.0, 0, 2, 0]), np.array([2.0, 0, -2, 0])


class Discs:
    """Symbols and expressions of the problem."""

    def __init__(self) -> None:
        self.q, self.v, self.u = ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("u", 2)
        between = self.q[:2] - self.q[2:]
        distance = ca.sqrt(ca.sumsqr(between))
        self.gap = distance - sum(RADII)
        self.normal = ca.vertcat(between, -between) / distance
        drag = [DRAG * w / ca.sqrt(ca.sumsqr(w) + DRAG_WIDTH**2) for w in (self.v[:2], self.v[2:])]
        self.force = ca.vertcat(self.u - drag[0], -drag[1])
        self.mass = np.diag(np.repeat(MASSES, 2))
        places = (self.q[:2], self.q[2:])
        self.clearance = ca.vertcat(
            *[ca.sumsqr(place) - (OBSTACLE + r) ** 2 for place, r in zip(places, RADII, strict=True)]
        )
        deviation = ca.vertcat(self.q - ca.DM(GOAL), self.v)
        self.running = ca.dot(ca.DM(RUNNING), deviation**2) + CONTROL * ca.sumsqr(self.u)
        self.terminal = TERMINAL_FACTOR * ca.dot(ca.DM(RUNNING), deviation**2)

    @cached_property
    def clearance_function(self) -> ca.Function:
        """q -> clearance of both discs from the obstacle."""
        return ca.Function("clearance", [self.q], [self.clearance])

    def limits(self, others: int) -> np.ndarray:
        """Return the largest magnitudes of the states; `others` follow q and v and are free."""
        return np.concatenate([np.full(4, PLACE_LIMIT), np.full(4, VELOCITY_LIMIT), np.full(others, np.inf)])

    def judge(self, samples: Samples) -> tuple[float, dict[str, str]]:
        """Return the cost in physical time, and what else tells two motions apart."""
        state = ca.vertcat(self.q, self.v)
        whole = ca.vertcat(state, ca.SX.sym("further", samples.points.shape[2] - 8)), ca.vertcat(self.u, ca.SX.sym("s"))
        cost = samples.cost(*whole, self.running, self.terminal, clock=8)
        points = samples.points.reshape(-1, samples.points.shape[2])
        gaps = np.asarray(ca.Function("gap", [self.q], [self.gap]).map(len(points))(points[:, :4].T)).ravel()
        clearances = np.asarray(self.clearance_function.map(len(points))(points[:, :4].T))
        end = points[-1]
        return cost, {
            "disc 1 from its goal [m]": f"{np.hypot(*(end[:2] - GOAL[:2])):.4f}",
            "disc 2 from its goal [m]": f"{np.hypot(*(end[2:4] - GOAL[2:])):.4f}",
            "min gap [m]": f"{gaps.min():.1e}",
            "min clearance of the obstacle [m2]": f"{clearances.min():.1e}",
            "clock at the end [s]": f"{end[8]:.6f}",
        }


def guess(time: float) -> np.ndarray:
    """Return the start of the solvers, (9): below the obstacle to the other disc, with it over the top, and back.

    On a circle of radius 2 at constant angular speeds; started at rest, both tools stay there.
    """
    touching = 2 * np.arcsin(sum(RADII) / 4)
    angles = np.array([[np.pi, 2 * np.pi - touching, 3 * np.pi - touching, 2 * np.pi], [0, 0, np.pi, np.pi]])

    def places(at: float) -> np.ndarray:
        now = [np.interp(at, MOMENTS, row) for row in angles]
        return np.array([part for angle in now for part in (2 * np.cos(angle), 2 * np.sin(angle))])

    before, after = max(time - 0.01, 0.0), min(time + 0.01, DURATION)
    speeds = (places(after) - places(before)) / (after - before)
    return np.concatenate([places(time), np.clip(speeds, -VELOCITY_LIMIT, VELOCITY_LIMIT), [time]])


def ours(settings: Settings) -> Outcome:
    """Solve with fesd-robot: Filippov multipliers as variables, the integrated gap as switching function."""
    begin = time.perf_counter(), time.process_time()
    discs = Discs()
    names = ["x1", "y1", "x2", "y2"]
    contact = contact_system(
        MultibodyDynamics(
            configuration=discs.q,
            velocity=discs.v,
            control=discs.u,
            configuration_derivative=discs.v,
            mass_matrix=ca.SX(ca.DM(discs.mass)),
            force=discs.force,
            configuration_names=names,
            velocity_names=names,
            control_names=["force x", "force y"],
        ),
        [Contact("discs", discs.gap, discs.normal, ca.SX.zeros(4), friction=0.0)],
        ContactOptions(auxiliary_force=PUSH),
        ca.SX.sym("end"),
    )
    system = contact.system
    clearance = ca.SX.sym("clearance", 2)
    bare = system.guess
    system = dataclasses.replace(
        system,
        algebraic=ca.vertcat(system.algebraic, clearance),
        equations=clearance - discs.clearance,
        algebraic_lower=np.append(system.algebraic_lower, np.zeros(2)),
        algebraic_upper=np.append(system.algebraic_upper, np.full(2, np.inf)),
        guess=lambda x, u, p: np.append(bare(x, u, p), np.asarray(discs.clearance_function(x[:4])).ravel()),
        algebraic_names=[*system.algebraic_names, "clearance of disc 1", "clearance of disc 2"],
    )
    gap = ca.Function("gap", [discs.q], [discs.gap])
    first = np.concatenate([START, np.zeros(5), [float(gap(START))]])
    limits = discs.limits(2)
    lower = np.append(-limits[:-1], contact.gap_lower)
    ocp = OptimalControlProblem(
        system=system,
        duration=DURATION,
        intervals=INTERVALS,
        parameters=DURATION * np.arange(1, INTERVALS + 1)[None, :] / INTERVALS,
        initial_lower=first,
        initial_upper=first,
        state_lower=lower,
        state_upper=limits,
        terminal_lower=lower,
        terminal_upper=limits,
        control_lower=np.array([-FORCE_LIMIT, -FORCE_LIMIT, SPEED_OF_TIME[0]]),
        control_upper=np.array([FORCE_LIMIT, FORCE_LIMIT, SPEED_OF_TIME[1]]),
        state_guess=lambda time: np.append(guess(time), max(float(gap(guess(time)[:4])), 0.0)),
        control_guess=np.tile([[0.0], [0.0], [1.0]], INTERVALS),
        running_cost={"running": contact.clock_rate * discs.running},
        terminal_cost={"terminal": discs.terminal},
        interval_end=system.state[8] - system.parameters,
        interval_end_names=("clock",),
    )
    options = FesdOptions(tableau=switched.TABLEAU, elements=ELEMENTS, cross_complementarity="theta_sum")
    return switched.solved(Transcription(ocp, options), settings, begin, discs.judge)


def nosnoc(settings: Settings) -> Outcome:
    """Solve with nosnoc: step functions of gap and normal velocity."""
    import nosnoc

    begin = time.perf_counter(), time.process_time()
    discs = Discs()
    clock, speed = ca.SX.sym("t"), ca.SX.sym("s")
    steps, frozen, clearance = ca.SX.sym("alpha", 2), ca.SX.sym("beta"), ca.SX.sym("clearance", 2)
    inverse = ca.DM(np.linalg.inv(discs.mass))
    motion = speed * ca.vertcat(discs.v, inverse @ discs.force, 1)
    impact = ca.vertcat(ca.SX.zeros(4), inverse @ discs.normal * PUSH, 0)
    model = nosnoc.NosnocModel(
        name="two_discs",
        x=ca.vertcat(discs.q, discs.v, clock),
        x0=np.concatenate([START, np.zeros(5)]),
        u=ca.vertcat(discs.u, speed),
        z=ca.vertcat(frozen, clearance),
        z0=np.append(0.0, np.asarray(discs.clearance_function(START)).ravel()),
        lbz=np.array([-np.inf, 0, 0]),
        g_z=ca.vertcat(frozen - (1 - steps[0]) * (1 - steps[1]), clearance - discs.clearance),
        alpha=[steps],
        c=[ca.vertcat(discs.gap, ca.dot(discs.normal, discs.v))],
        f_x=[(1 - frozen) * motion + frozen * impact],
        t_var=clock,
    )
    limits = discs.limits(1)
    ocp = nosnoc.NosnocOcp(
        lbu=np.array([-FORCE_LIMIT, -FORCE_LIMIT, SPEED_OF_TIME[0]]),
        ubu=np.array([FORCE_LIMIT, FORCE_LIMIT, SPEED_OF_TIME[1]]),
        u_guess=np.array([0, 0, 1]),
        lbx=-limits,
        ubx=limits,
        f_q=speed * discs.running,
        f_terminal=discs.terminal,
    )
    opts = nosnoc_tool.options()
    opts.terminal_time = DURATION
    opts.N_stages, opts.N_finite_elements = INTERVALS, ELEMENTS
    opts.irk_scheme, opts.n_s = nosnoc.IrkSchemes.RADAU_IIA, switched.TABLEAU.stages
    opts.pss_mode = nosnoc.PssMode.STEP
    opts.step_equilibration = nosnoc.StepEquilibrationMode.HEURISTIC_MEAN
    opts.time_freezing, opts.equidistant_control_grid, opts.time_freezing_tolerance = True, True, 0.0
    opts.initialization_strategy = nosnoc.InitializationStrategy.EXTERNAL
    # Seven NLPs, to sigma 1e-6, as in the authors' example; with two more it ends at IPOPT's limit and a higher cost.
    opts.sigma_0, opts.homotopy_update_slope, opts.max_iter_homotopy = 1.0, 0.1, 7
    opts.nlp_max_iter = 1000
    ends = DURATION * np.arange(1, INTERVALS + 1) / INTERVALS
    solution = nosnoc_tool.run(opts, model, ocp, begin, np.array([guess(end) for end in ends]))
    return solution.outcome(*discs.judge(solution.samples(switched.TABLEAU)))
