"""The planar problems of IMPACT as its files pose them, in its own steps: explicit Euler, with all of its pairs.

Source: github.com/JonasPflaume/IMPACT at f56f140, experiments/{cart_transporter,box,push_t,push_circle}; equations and
weights are written here anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

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


@dataclass(frozen=True)
class Stage:
    """What is true at every step, as expressions of the state x and the control u.

    Attributes:
        rate: x'.
        G, H: sides of the pairs.
        zero, positive: what is 0 and what is at least 0.
    """

    rate: ca.SX
    G: ca.SX
    H: ca.SX
    zero: ca.SX
    positive: ca.SX


@dataclass(frozen=True)
class Judged:
    """What a motion is worth, recomputed from the equations alone.

    Attributes:
        objective: of the problem.
        violation: largest of dynamics, start, equations and inequalities, sides of pairs below zero included.
        product: largest |G H|.
        missed: distance of the last state from the goal, in its own units.
    """

    objective: float
    violation: float
    product: float
    missed: tuple[float, ...]


@dataclass(frozen=True)
class Problem:
    """min last |x_N - goal|^2 + weight sum |u_k|^2, x_k+1 = x_k + step rate(x_k, u_k), 0 <= G complementary to H >= 0.

    Attributes:
        program: the peer's own for this problem, in the folder `experiments` of its build.
        words: what it is called with, before the name of the file of its motion.
        planned: (times, plan) -> states (steps + 1, n) and controls (steps, m) of a plan of ours, which its equations
            hold of nearly.
        stage: (x, u) -> what is true at every step.
        start, goal: states.
        controls: how many.
        step: s.
        steps: how many.
        weight, last: of the objective.
        constant: whether the peer begins from the start everywhere, not on the straight line to the goal.
    """

    program: str
    words: str
    planned: Callable[[np.ndarray, Plan], tuple[np.ndarray, np.ndarray]]
    stage: Callable[[ca.SX, ca.SX], Stage]
    start: Sequence[float]
    goal: Sequence[float]
    controls: int
    step: float
    steps: int
    weight: float
    last: float
    constant: bool

    def mpcc(self) -> Mpcc:
        """Return the whole problem, from the peer's guess: states, then controls, step by step."""
        x, u = ca.SX.sym("x", len(self.start), self.steps + 1), ca.SX.sym("u", self.controls, self.steps)
        part = np.zeros(self.steps + 1) if self.constant else np.linspace(0, 1, self.steps + 1)
        guess = np.outer(1 - part, self.start) + np.outer(part, self.goal)
        stages = [self.stage(x[:, k], u[:, k]) for k in range(self.steps)]
        defects = [x[:, k + 1] - x[:, k] - self.step * one.rate for k, one in enumerate(stages)]
        zero, positive = (
            ca.vertcat(x[:, 0] - ca.DM(list(self.start)), *defects, *(one.zero for one in stages)),
            ca.vertcat(*(one.positive for one in stages)),
        )
        return Mpcc.from_expressions(
            ca.vertcat(ca.vec(x), ca.vec(u)),
            self.last * ca.sumsqr(x[:, -1] - ca.DM(list(self.goal))) + self.weight * ca.sumsqr(u),
            start=np.concatenate([guess.ravel(), np.zeros(u.numel())]),
            g=ca.vertcat(zero, positive),
            G=ca.vertcat(*(one.G for one in stages)),
            H=ca.vertcat(*(one.H for one in stages)),
            g_bounds=(
                np.zeros(zero.numel() + positive.numel()),
                np.concatenate([np.zeros(zero.numel()), np.full(positive.numel(), np.inf)]),
            ),
        )

    def parts(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return states (steps + 1, n) and controls (steps, m) of a point of the MPCC."""
        n = len(self.start) * (self.steps + 1)
        return w[:n].reshape(self.steps + 1, -1), w[n:].reshape(self.steps, -1)

    def solved(self, problem: Mpcc, begin: tuple[np.ndarray, np.ndarray] | None = None) -> tuple[Attempted, Judged]:
        """Return what the MPCC solver makes of the problem, and what that is worth.

        Args:
            problem: `mpcc`.
            begin: states and controls; the peer's guess if omitted.
        """
        if begin is not None:
            problem = replace(problem, start=np.concatenate([part.ravel() for part in begin]))
        found = solve_by_attempts(problem, Run(deadline=Deadline(LIMIT)), further=FURTHER)
        return found, self.judged(*self.parts(found.solution.w))

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation, a product included, solved from a plan.

        Args:
            plan: of the task.
        """
        _, end = self.solved(self.mpcc(), self.planned(self.step * np.arange(self.steps + 1), plan))
        return end.objective, max(end.violation, end.product)

    def judged(self, states: np.ndarray, controls: np.ndarray) -> Judged:
        """Return what a motion is worth.

        Args:
            states: (steps + 1, n).
            controls: (steps, m).
        """
        x, u = ca.SX.sym("x", len(self.start)), ca.SX.sym("u", self.controls)
        stage = self.stage(x, u)
        outputs = [stage.rate, stage.G, stage.H, stage.zero, stage.positive]
        values = ca.Function("stage", [x, u], outputs).map(self.steps)(states[:-1].T, controls.T)
        rate, G, H, zero, positive = (np.asarray(value).T for value in values)
        defects = np.diff(states, axis=0) - self.step * rate
        equations = [np.abs(part).max(initial=0.0) for part in (states[0] - np.array(self.start), defects, zero)]
        missed = states[-1] - np.array(self.goal)
        return Judged(
            float(self.last * np.sum(missed**2) + self.weight * np.sum(controls**2)),
            float(max(*equations, *((-part).max(initial=0.0) for part in (G, H, positive)))),
            float(np.abs(G * H).max()),
            tuple(missed.tolist()),
        )


CARGO, CART = 0.1, 0.2
"""kg."""

BOX = (0.3, 0.4)
"""Half of width and height, m."""

SQUARE, MIDDLE = 0.05, 2.6429
"""Side of the seven squares of a T, m, and how many of them its middle is above its foot."""

RADIUS, DRAG = 0.3, 0.1 * 9.81
"""Of the disk, m, and its friction on the table by its velocity, N s/m."""


def _cart(x: ca.SX, u: ca.SX) -> Stage:
    """Cargo and cart; u is friction, force on the cart, and slip forwards and backwards."""
    limit, bed = 0.2 * CARGO * 9.81, 1.0
    friction, force, ahead, back = ca.vertsplit(u)
    low, high, place = friction + limit, limit - friction, x[0] - x[1]
    return Stage(
        ca.vertcat(x[2], x[3], friction / CARGO, (force - friction) / CART),
        ca.vertcat(ahead, back, ahead),
        ca.vertcat(back, high, low),
        x[2] - x[3] - ahead + back,
        ca.vertcat(low, high, bed + place, bed - place),
    )


def _slid(x: ca.SX, place: ca.SX, along: ca.SX, across: ca.SX, force: float, torque: float) -> ca.SX:
    """Return the velocity of a slider without inertia: the force on it in its own frame, and at which place."""
    cosine, sine = ca.cos(x[2]), ca.sin(x[2])
    turning = (place[0] * across - place[1] * along) / torque
    return ca.vertcat((cosine * along - sine * across) / force, (sine * along + cosine * across) / force, turning)


def _exclusive(forces: Sequence[ca.SX], gaps: Sequence[ca.SX]) -> tuple[ca.SX, ca.SX]:
    """Return sides of pairs: every force with its gap, and with every other force."""
    two = [(forces[i], forces[j]) for i in range(len(forces)) for j in range(i + 1, len(forces))]
    return ca.vertcat(*forces, *(one for one, _ in two)), ca.vertcat(*gaps, *(other for _, other in two))


def _box(x: ca.SX, u: ca.SX) -> Stage:
    """A box; u is the place of the force in its frame, and what pushes upwards, to the right, down and to the left."""
    (width, height), force = BOX, 0.5 * 0.1 * 9.81
    place, (up, right, down, left) = u[:2], ca.vertsplit(u[2:])
    G, H = _exclusive(
        [up, right, -down, -left],
        [place[1] + height, place[0] + width, height - place[1], width - place[0]],
    )
    rate = _slid(x, place, right + left, up + down, force, force * 0.5 * float(np.hypot(width, height)))
    return Stage(rate, G, H, ca.SX(0, 1), ca.SX(0, 1))


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


def _t(x: ca.SX, u: ca.SX) -> Stage:
    """A T; u is the place of the force in its frame, eight forces at its sides, distances from its lines."""
    force, distance = 0.4 * 0.1 * 9.8, u[10:17] + u[17:]
    place, lam = u[:2], u[2:10]
    top, foot = (4 - MIDDLE) * SQUARE, MIDDLE * SQUARE
    gaps = [top - place[1]]
    gaps += [ca.sum1(distance[list(three)]) - squares * SQUARE for three, squares in AROUND]
    inwards = [sign * lam[i] for i, sign in enumerate((-1, -1, 1, -1, 1, 1, 1, 1))]
    G, H = _exclusive(inwards, gaps)
    rate = _slid(x, place, ca.sum1(lam[1::2]), ca.sum1(lam[::2]), force, force * 0.4 * 2.8 * SQUARE)
    return Stage(
        rate,
        ca.vertcat(u[10:17], G),
        ca.vertcat(u[17:], H),
        u[10:17] - u[17:] - _lines(place),
        ca.vertcat(place[0] + 2 * SQUARE, 2 * SQUARE - place[0], place[1] + foot, top - place[1]),
    )


def _disk(x: ca.SX, u: ca.SX) -> Stage:
    """A disk and a point that pushes it; u is normal and tangential force, and the velocity of the point."""
    friction, arm = 0.1, x[2:] - x[:2]
    distance = ca.sqrt(ca.sumsqr(arm) + 1e-9)
    normal, tangential = u[0], u[1]
    force = (-normal * arm + tangential * ca.vertcat(-arm[1], arm[0])) / distance
    cone = ca.vertcat(friction * normal - tangential, friction * normal + tangential)
    return Stage(ca.vertcat(force / DRAG, u[2:]), normal, distance - RADIUS, ca.SX(0, 1), cone)


def _planned_cart(times: np.ndarray, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    states = cargo_states(plan, times)
    pulls, slip = np.diff(states[:, 2:], axis=0) / np.diff(times)[:, None], states[:-1, 2] - states[:-1, 3]
    friction = CARGO * pulls[:, 0]
    return states, np.column_stack([friction, CART * pulls[:, 1] + friction, np.maximum(slip, 0), np.maximum(-slip, 0)])


def _planned_slider(times: np.ndarray, plan: Plan, sides: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return states and controls of a slider: places, then the forces at its sides, in their order.

    Args:
        times: s.
        plan: of the task.
        sides: name of a side -> its coordinate across, m.
    """
    controls = np.zeros((len(times) - 1, 2 + len(sides)))
    for control, time in zip(controls, (times[1:] + times[:-1]) / 2, strict=True):
        push = push_at(plan, float(time))
        along, across = push.direction
        arm = float(np.clip(push.arm, *push.arms))
        control[:2] = (arm / across, sides[push.side]) if across else (sides[push.side], -arm / along)
        control[2 + list(sides).index(push.side)] = push.force * (along + across)
    return slider_states(plan, times), controls


def _planned_box(times: np.ndarray, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    width, height = BOX
    return _planned_slider(times, plan, {"bottom": -height, "left": -width, "top": height, "right": width})


def _planned_t(times: np.ndarray, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    names = ("top", "cap_right", "under_right", "stem_right", "bottom", "stem_left", "under_left", "cap_left")
    lines = SQUARE * np.array([4 - MIDDLE, 2, 3 - MIDDLE, 0.5, -MIDDLE, -0.5, 3 - MIDDLE, -2])
    states, pushes = _planned_slider(times, plan, dict(zip(names, lines, strict=True)))
    beyond = np.array([np.asarray(ca.DM(_lines(ca.DM(push[:2])))).ravel() for push in pushes])
    return states, np.hstack([pushes, np.maximum(beyond, 0), np.maximum(-beyond, 0)])


def _planned_disk(times: np.ndarray, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """The finger of the task has a radius, by which the point that pushes is nearer to the disk."""
    at = plan.at(np.minimum(times, plan.trajectory.time[-1])).configuration
    disk, tip = (np.column_stack([at[f"{of}_x"], at[f"{of}_z"]]) for of in ("disk.root", "tip"))
    outwards = tip - disk
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    states = np.hstack([disk, tip - plan.task["contacts"]["push"]["radius"] * outwards])
    rates, (x, y) = np.diff(states, axis=0) / np.diff(times)[:, None], outwards[:-1].T
    force = DRAG * rates[:, :2]
    normal = np.maximum(-(force[:, 0] * x + force[:, 1] * y), 0)
    return states, np.column_stack([normal, force[:, 1] * x - force[:, 0] * y, rates[:, 2:]])


_AWAY = 1.5 * np.cos(np.radians(225))
_BEHIND = _AWAY - RADIUS * np.cos(np.radians(225))

_CART_PROBLEM = Problem(
    program="cart_transporter/cart_transporter_impact_multiple",
    words="0 0 0 0 1 0 0 0",
    planned=_planned_cart,
    stage=_cart,
    start=(0, 0, 0, 0),
    goal=(1, 0, 0, 0),
    controls=4,
    step=0.02,
    steps=300,
    weight=1e-6,
    last=5000.0,
    constant=True,
)

PROBLEMS: Mapping[str, Problem] = {
    "impact_cart": _CART_PROBLEM,
    "impact_cart, both a metre on": replace(_CART_PROBLEM, words="0 0 0 0 1 1 0 0", goal=(1, 1, 0, 0)),
    "impact_box": Problem(
        program="box/box_impact_multiple",
        words="0 0 0 0.1 0.1 1.0",
        planned=_planned_box,
        stage=_box,
        start=(0, 0, 0),
        goal=(0.1, 0.1, 1.0),
        controls=6,
        step=0.05,
        steps=50,
        weight=1e-3,
        last=100.0,
        constant=False,
    ),
    "impact_disk": Problem(
        program="push_circle/push_circle_impact_multiple",
        words="1.5 225 120",
        planned=_planned_disk,
        stage=_disk,
        start=(0, 0, _AWAY, _AWAY),
        goal=(_AWAY, _AWAY, _BEHIND, _BEHIND),
        controls=4,
        step=0.05,
        steps=120,
        weight=1e-2,
        last=100.0,
        constant=True,
    ),
    "impact_push_t": Problem(
        program="push_t/push_t_impact_multiple",
        words="0 0 0 0.05 0.05 1.5708",
        planned=_planned_t,
        stage=_t,
        start=(0, 0, 0),
        goal=(0.05, 0.05, 1.5708),
        controls=24,
        step=0.05,
        steps=50,
        weight=1e-2,
        last=100.0,
        constant=False,
    ),
}


def problem_of(plan: Plan) -> Problem | None:
    """Return the problem of which a plan is, if any."""
    moved = plan.name == "impact_cart" and plan.task["goal"]["configuration"]["cart"] > 0
    return PROBLEMS.get(plan.name + ", both a metre on" * moved)
