"""Problems of peers in their own steps, with all of their pairs: solved, and what a motion is worth in them."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import casadi as ca
import numpy as np

from fesd_robot.mpcc import Attempted, Mpcc, Run, solve_by_attempts
from fesd_robot.plans import Plan
from fesd_robot.running import Deadline
from scripts.benchmarks._peers import cargo_states, push_at, slider_states

FURTHER = 4
"""Homotopies after the first one that ends at a solution; the cheapest solution counts."""

LIMIT = 120.0
"""s, for all of them."""

Motion = tuple[np.ndarray, np.ndarray]
"""States (steps + 1, n) and controls (steps, m)."""


@dataclass(frozen=True)
class Stage:
    """What is true at every step, as expressions of the state x and the control u.

    Attributes:
        rate: difference of the next state and this one, by the step.
        G, H: sides of the pairs.
        zero, positive: what is 0 and what is at least 0.
    """

    rate: ca.SX
    G: ca.SX
    H: ca.SX
    zero: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    positive: ca.SX = field(default_factory=lambda: ca.SX(0, 1))


@dataclass(frozen=True)
class Judged:
    """What a motion is worth, recomputed from the equations alone.

    Attributes:
        objective: of the problem.
        violation: largest of dynamics, start, equations and inequalities, sides of pairs below zero included.
        product: largest |G H|.
        missed: d of the last state, in its own units.
    """

    objective: float
    violation: float
    product: float
    missed: tuple[float, ...]


def _nothing(_: ca.SX) -> ca.SX:
    """Return no rows."""
    return ca.SX(0, 1)


@dataclass(frozen=True)
class Problem:
    """min sum last d(x_N)^2 + sum over k of (weights u_k^2 + tracking d(x_k)^2), 0 <= G and H >= 0 complementary.

    States follow each other by x_k+1 = x_k + step rate(x_k, u_k); d is the distance from the goal.

    Attributes:
        program: the peer's own for this problem.
        words: what it is called with, beside the name of the file of its motion.
        stage: (x, u) -> what is true at every step.
        start, goal: states.
        step: s.
        weights: of the squared controls of a step.
        last: of the squared distances of the last state.
        tracking: of the squared distances of all others.
        distance: (state, goal) -> d; their difference if omitted.
        guess: states that the peer begins from, (steps + 1, n); its controls are zero.
        ends: state -> what is at least 0 in the last state.
        planned: (times, plan) -> motion of a plan of ours, of which the equations hold nearly.
    """

    program: str
    words: Sequence[str]
    stage: Callable[[ca.SX, ca.SX], Stage]
    start: Sequence[float]
    goal: Sequence[float]
    step: float
    weights: Sequence[float]
    last: Sequence[float]
    guess: np.ndarray
    tracking: float = 0.0
    distance: Callable[[ca.SX, ca.DM], ca.SX] = operator.sub
    ends: Callable[[ca.SX], ca.SX] = _nothing
    planned: Callable[[np.ndarray, Plan], Motion] | None = None

    @property
    def steps(self) -> int:
        """How many."""
        return len(self.guess) - 1

    def mpcc(self) -> Mpcc:
        """Return the whole problem, from the peer's guess: states, then controls, step by step."""
        x, u = (
            ca.SX.sym(name, len(size), count)
            for name, size, count in (("x", self.start, self.steps + 1), ("u", self.weights, self.steps))
        )
        stages = [self.stage(x[:, k], u[:, k]) for k in range(self.steps)]
        defects = [x[:, k + 1] - x[:, k] - self.step * one.rate for k, one in enumerate(stages)]
        zero = ca.vertcat(x[:, 0] - ca.DM(list(self.start)), *defects, *(one.zero for one in stages))
        positive = ca.vertcat(*(one.positive for one in stages), self.ends(x[:, -1]))
        away = [self.distance(x[:, k], ca.DM(list(self.goal))) for k in range(self.steps + 1)]
        cost = ca.dot(ca.DM(list(self.last)), away[-1] ** 2) + ca.dot(ca.DM(list(self.weights)), ca.sum2(u**2))
        if self.tracking:
            cost += self.tracking * ca.sumsqr(ca.horzcat(*away[:-1]))
        above = np.concatenate([np.zeros(zero.numel()), np.full(positive.numel(), np.inf)])
        return Mpcc.from_expressions(
            ca.vertcat(ca.vec(x), ca.vec(u)),
            cost,
            start=np.concatenate([self.guess.ravel(), np.zeros(u.numel())]),
            g=ca.vertcat(zero, positive),
            G=ca.vertcat(*(one.G for one in stages)),
            H=ca.vertcat(*(one.H for one in stages)),
            g_bounds=(np.zeros(len(above)), above),
        )

    def parts(self, w: np.ndarray) -> Motion:
        """Return the motion of a point of the MPCC."""
        n = self.guess.size
        return w[:n].reshape(self.steps + 1, -1), w[n:].reshape(self.steps, -1)

    def solved(self, problem: Mpcc, begin: Motion | None = None) -> tuple[Attempted, Judged]:
        """Return what the MPCC solver makes of the problem, and what that is worth.

        Args:
            problem: `mpcc`.
            begin: a motion; the peer's guess if omitted.
        """
        if begin is not None:
            problem = replace(problem, start=np.concatenate([part.ravel() for part in begin]))
        found = solve_by_attempts(problem, Run(deadline=Deadline(LIMIT)), further=FURTHER)
        return found, self.judged(*self.parts(found.solution.w))

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation, a product included, solved from a plan.

        Args:
            plan: of the task, of a problem that has `planned`.
        """
        assert self.planned is not None
        _, end = self.solved(self.mpcc(), self.planned(self.step * np.arange(self.steps + 1), plan))
        return end.objective, max(end.violation, end.product)

    def judged(self, states: np.ndarray, controls: np.ndarray) -> Judged:
        """Return what a motion is worth.

        Args:
            states: (steps + 1, n).
            controls: (steps, m).
        """
        x, u = ca.SX.sym("x", len(self.start)), ca.SX.sym("u", len(self.weights))
        stage = self.stage(x, u)
        outputs = [stage.rate, stage.G, stage.H, stage.zero, stage.positive]
        values = ca.Function("stage", [x, u], outputs).map(self.steps)(states[:-1].T, controls.T)
        rate, G, H, zero, positive = (np.asarray(value).T for value in values)
        of_states = ca.Function("of_states", [x], [self.distance(x, ca.DM(list(self.goal))), self.ends(x)])
        away, ends = (np.asarray(value).T for value in of_states.map(self.steps + 1)(states.T))
        defects = np.diff(states, axis=0) - self.step * rate
        equations = [np.abs(part).max(initial=0.0) for part in (states[0] - np.array(self.start), defects, zero)]
        effort = np.sum(controls**2 @ np.array(self.weights)) + self.tracking * np.sum(away[:-1] ** 2)
        return Judged(
            float(np.dot(self.last, away[-1] ** 2) + effort),
            float(max(*equations, *((-part).max(initial=0.0) for part in (G, H, positive, ends[-1])))),
            float(np.abs(G * H).max()),
            tuple(away[-1].tolist()),
        )


@dataclass(frozen=True)
class Cargo:
    """A cargo that slides on a cart with dry friction, and stays on its bed; the state is x1, x2, v1, v2.

    Controls are friction, force on the cart, and slip forwards and backwards.

    Attributes:
        cargo, cart: kg.
        friction: coefficient.
        bed: half of its length, m.
        ahead: s, of semi-implicit Euler, by which places follow the velocities after a step; 0 for explicit Euler.
    """

    cargo: float
    cart: float
    friction: float = 0.2
    bed: float = 1.0
    ahead: float = 0.0

    def stage(self, x: ca.SX, u: ca.SX) -> Stage:
        """Return what is true at every step."""
        limit = self.friction * self.cargo * 9.81
        friction, force, forwards, backwards = ca.vertsplit(u)
        low, high = friction + limit, limit - friction
        pulls = ca.vertcat(friction / self.cargo, (force - friction) / self.cart)
        return Stage(
            ca.vertcat(x[2:] + self.ahead * pulls, pulls),
            ca.vertcat(forwards, backwards, forwards),
            ca.vertcat(backwards, high, low),
            x[2] - x[3] - forwards + backwards,
            ca.vertcat(low, high, self.ends(x)),
        )

    def planned(self, times: np.ndarray, plan: Plan) -> Motion:
        """Return the motion of a plan, at some times, s."""
        states = cargo_states(plan, times)
        pulls, slip = np.diff(states[:, 2:], axis=0) / np.diff(times)[:, None], states[:-1, 2] - states[:-1, 3]
        friction = self.cargo * pulls[:, 0]
        force = self.cart * pulls[:, 1] + friction
        return states, np.column_stack([friction, force, np.maximum(slip, 0), np.maximum(-slip, 0)])

    def ends(self, x: ca.SX) -> ca.SX:
        """Return the distances from both ends of the bed, m."""
        return ca.vertcat(self.bed + x[0] - x[1], self.bed - x[0] + x[1])


def slid(x: ca.SX, place: ca.SX, along: ca.SX, across: ca.SX, force: float, torque: float) -> ca.SX:
    """Return the velocity of a slider without inertia that is pushed.

    Args:
        x: place, m, and angle, rad.
        place: of the force in the slider's frame, m.
        along, across: the force in that frame, N.
        force, torque: by velocity, N s/m, and by angular velocity, N m s.
    """
    cosine, sine = ca.cos(x[2]), ca.sin(x[2])
    turning = (place[0] * across - place[1] * along) / torque
    return ca.vertcat((cosine * along - sine * across) / force, (sine * along + cosine * across) / force, turning)


def exclusive(forces: Sequence[ca.SX], gaps: Sequence[ca.SX]) -> tuple[ca.SX, ca.SX]:
    """Return sides of pairs: every force with its gap, and with every other force."""
    two = [(forces[i], forces[j]) for i in range(len(forces)) for j in range(i + 1, len(forces))]
    return ca.vertcat(*forces, *(one for one, _ in two)), ca.vertcat(*gaps, *(other for _, other in two))


def pushed_box(width: float, height: float, force: float, torque: float) -> Callable[[ca.SX, ca.SX], Stage]:
    """Return the stage of a box that is pushed at one of its sides at a time.

    Controls are the place of the force in its frame, and what pushes upwards, to the right, down and to the left.

    Args:
        width, height: half of them, m.
        force, torque: by velocity, N s/m, and by angular velocity, N m s.
    """
    return partial(_box, width, height, force, torque)


def _box(width: float, height: float, force: float, torque: float, x: ca.SX, u: ca.SX) -> Stage:
    place, (up, right, down, left) = u[:2], ca.vertsplit(u[2:])
    gaps = [place[1] + height, place[0] + width, height - place[1], width - place[0]]
    return Stage(slid(x, place, right + left, up + down, force, torque), *exclusive([up, right, -down, -left], gaps))


SQUARE, MIDDLE = 0.05, 2.6429
"""Side of the seven squares of a T, m, and how many of them its middle is above its foot."""

AROUND = (
    ((0, 1, 2), 1.0),
    ((0, 2, 3), 1.5),
    ((2, 3, 4), 3.0),
    ((3, 4, 5), 1.0),
    ((2, 4, 5), 3.0),
    ((2, 5, 6), 1.5),
    ((1, 2, 6), 1.0),
)
"""Of each side of a T after the top: the sum of the distances from which lines is how many squares, least, on it."""


def _lines(place: ca.SX | ca.DM) -> ca.SX | ca.DM:
    """Return by how much a place on a T is to the right of, or above, the lines of its sides."""
    x, y = place[0], place[1] + MIDDLE * SQUARE
    return ca.vertcat(x - 2 * SQUARE, y - 4 * SQUARE, y - 3 * SQUARE, x - SQUARE / 2, y, x + SQUARE / 2, x + 2 * SQUARE)


def pushed_t(mass: float) -> Callable[[ca.SX, ca.SX], Stage]:
    """Return the stage of a T of a mass, kg, that is pushed at one of its sides at a time.

    Controls are the place of the force in its frame, eight forces at its sides, and its distances from seven lines:
    to the right or above, and to the left or below.
    """
    return partial(_t, 0.4 * mass * 9.8)


def _t(force: float, x: ca.SX, u: ca.SX) -> Stage:
    distance = u[10:17] + u[17:]
    place, lam = u[:2], u[2:10]
    top, foot = (4 - MIDDLE) * SQUARE, MIDDLE * SQUARE
    gaps = [top - place[1]]
    gaps += [ca.sum1(distance[list(three)]) - squares * SQUARE for three, squares in AROUND]
    inwards = [sign * lam[i] for i, sign in enumerate((-1, -1, 1, -1, 1, 1, 1, 1))]
    G, H = exclusive(inwards, gaps)
    rate = slid(x, place, ca.sum1(lam[1::2]), ca.sum1(lam[::2]), force, force * 0.4 * 2.8 * SQUARE)
    return Stage(
        rate,
        ca.vertcat(u[10:17], G),
        ca.vertcat(u[17:], H),
        u[10:17] - u[17:] - _lines(place),
        ca.vertcat(place[0] + 2 * SQUARE, 2 * SQUARE - place[0], place[1] + foot, top - place[1]),
    )


def box_sides(width: float, height: float) -> Mapping[str, float]:
    """Return sides of a box -> their coordinates across, m, of half of its width and height."""
    return {"bottom": -height, "left": -width, "top": height, "right": width}


def planned_slider(sides: Mapping[str, float], times: np.ndarray, plan: Plan) -> Motion:
    """Return states and controls of a slider: places, then the forces at its sides, in their order.

    Args:
        sides: name of a side -> its coordinate across, m.
        times: s.
        plan: of the task.
    """
    controls = np.zeros((len(times) - 1, 2 + len(sides)))
    for control, time in zip(controls, (times[1:] + times[:-1]) / 2, strict=True):
        push = push_at(plan, float(time))
        along, across = push.direction
        arm = float(np.clip(push.arm, *push.arms))
        control[:2] = (arm / across, sides[push.side]) if across else (sides[push.side], -arm / along)
        control[2 + list(sides).index(push.side)] = push.force * (along + across)
    return slider_states(plan, times), controls


def planned_t(times: np.ndarray, plan: Plan) -> Motion:
    """Return the motion of a plan of a T, at some times, s."""
    names = ("top", "cap_right", "under_right", "stem_right", "bottom", "stem_left", "under_left", "cap_left")
    lines = SQUARE * np.array([4 - MIDDLE, 2, 3 - MIDDLE, 0.5, -MIDDLE, -0.5, 3 - MIDDLE, -2])
    states, pushes = planned_slider(dict(zip(names, lines, strict=True)), times, plan)
    beyond = np.array([np.asarray(ca.DM(_lines(ca.DM(push[:2])))).ravel() for push in pushes])
    return states, np.hstack([pushes, np.maximum(beyond, 0), np.maximum(-beyond, 0)])
