"""Tasks of other contact planners, with the parameters of their files, and plans of them in their own discretisation.

    python scripts/benchmarks/public_tasks.py                    # all
    python scripts/benchmarks/public_tasks.py idto_spinner       # this one anew, the others from the data file
    python scripts/benchmarks/public_tasks.py --redraw           # nothing anew

Writes docs/results/public_tasks.md. Where the peer's problem is a cargo on a cart, a pole between soft walls, a plate
on a table, or a slider that is pushed at one side at a time, it is posed here, too, in the peer's steps and with its
cost, and solved on the sequence of contacts, or of sides, that the plan has. Exit code 1 if one is not solved.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from fesd_robot.plans.outcome_words import miss_words
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.benchmarks._impact import problem_of
from scripts.benchmarks._impact_page import beside_impact
from scripts.benchmarks._peers import cargo_states, optimum, push_at, slider_states
from scripts.benchmarks._soft_walls import SoftWalls, cart_pole, push_bot
from scripts.benchmarks._waiter import Waiter
from scripts.tools.arguments import ROOT, machine
from scripts.tools.table import PROGRAM_IS, Row, Table, solved

GRAVITY = 9.81
STILL = 1e-3
"""m/s; below it the cargo lies still on its cart."""


@dataclass(frozen=True)
class Cart:
    """A peer's problem of a cargo on a cart: x1' = v1, x2' = v2, m1 v1' = f, m2 v2' = u - f, |f| <= mu m1 g.

    Attributes:
        cargo, cart: masses m1 and m2, kg.
        friction: mu.
        step: s.
        steps: how many.
        positions, velocities: weights of the squared distances from the goal at the end.
        control: weight of f^2 + u^2 at every step.
    """

    cargo: float
    cart: float
    friction: float
    step: float
    steps: int
    positions: float
    velocities: float
    control: float

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation on the sequence of stick and slip of a plan.

        The problem is convex where that is given: its optimum is the only one.

        Args:
            plan: of the task, with the goal x1, x2, v1, v2, m and m/s.
        """
        goal = _goal(plan)
        states = cargo_states(plan, self.step * np.arange(self.steps + 1))
        x, f, u = ca.SX.sym("x", 4, self.steps + 1), ca.SX.sym("f", self.steps), ca.SX.sym("u", self.steps)
        limit, h = self.friction * self.cargo * GRAVITY, self.step
        rows, lower, upper = list[ca.SX](), list[float](), list[float]()
        low, high = np.full(self.steps, -limit), np.full(self.steps, limit)
        for k in range(self.steps):
            speeds = x[2:, k] + h * ca.vertcat(f[k] / self.cargo, (u[k] - f[k]) / self.cart)
            places = x[:2, k] + h * speeds
            rows.append(x[:, k + 1] - ca.vertcat(places, speeds))
            lower, upper = lower + [0.0] * 4, upper + [0.0] * 4
            relative = states[k, 2] - states[k, 3]
            slide = float(np.sign(relative)) if abs(relative) > STILL else 0.0
            rows.append(x[2, k] - x[3, k])
            lower.append(0.0 if slide >= 0 else -np.inf)
            upper.append(0.0 if slide <= 0 else np.inf)
            if slide:
                low[k] = high[k] = -slide * limit
        rows.append(x[0, :].T - x[1, :].T)
        lower, upper = lower + [-1.0] * (self.steps + 1), upper + [1.0] * (self.steps + 1)
        end = x[:, -1] - ca.DM(goal)
        cost = self.positions * ca.sumsqr(end[:2]) + self.velocities * ca.sumsqr(end[2:])
        cost += self.control * (ca.sumsqr(f) + ca.sumsqr(u))
        w = ca.vertcat(ca.vec(x), f, u)
        free = np.full(4 * self.steps, np.inf)
        return optimum(
            {"x": w, "f": cost, "g": ca.vertcat(*rows)},
            {
                "lbx": np.concatenate([states[0], -free, low, np.full(self.steps, -np.inf)]),
                "ubx": np.concatenate([states[0], free, high, np.full(self.steps, np.inf)]),
                "lbg": np.array(lower),
                "ubg": np.array(upper),
            },
        )


@dataclass(frozen=True)
class Slider:
    """A peer's problem of a slider without inertia, whose velocity is the force on it divided by a number.

    At every step a normal force acts at a place of one side; positions follow from the state before the step.

    Attributes:
        force, torque: force by velocity, N s/m, and torque by angular velocity, N m s.
        step: s.
        steps: how many.
        control: weight of the squared force at every step.
        positions: weight of the squared distance from the goal at every step.
        sine_and_cosine: whether a distance of angles is that of their sines and cosines.
        terminal: weight of the squared distance from the goal at the end.
    """

    force: float
    torque: float
    step: float
    steps: int
    control: float
    positions: float = 0.0
    sine_and_cosine: bool = False
    terminal: float = 100.0

    def objective(self, plan: Plan, goal: Sequence[float]) -> tuple[float, float]:
        """Return the peer's objective and its largest violation on the sequence of sides of a plan, begun from it.

        Args:
            plan: of the task.
            goal: x, y and angle, m and rad.
        """
        times = self.step * np.arange(self.steps + 1)
        states = slider_states(plan, times)
        pushes = [push_at(plan, float(time)) for time in times[:-1] + self.step / 2]
        x, f, arm = ca.SX.sym("x", 3, self.steps + 1), ca.SX.sym("f", self.steps), ca.SX.sym("arm", self.steps)
        rows, cost = [x[:, 0] - ca.DM(states[0])], self.terminal * self._distance(x[:, -1], goal)
        for k, push in enumerate(pushes):
            cosine, sine = ca.cos(x[2, k]), ca.sin(x[2, k])
            along, across = push.direction
            speed = f[k] / self.force * ca.vertcat(cosine * along - sine * across, sine * along + cosine * across)
            rate = ca.vertcat(speed, f[k] * arm[k] / self.torque)
            rows.append(x[:, k + 1] - x[:, k] - self.step * rate)
            cost += self.control * f[k] ** 2 + self.positions * self._distance(x[:, k], goal)
        arms, zero = np.array([push.arms for push in pushes]), np.zeros(3 * (self.steps + 1))
        free, force = np.full(3 * (self.steps + 1), np.inf), np.array([push.force for push in pushes])
        start = np.clip([push.arm for push in pushes], arms[:, 0], arms[:, 1])
        return optimum(
            {"x": ca.vertcat(ca.vec(x), f, arm), "f": cost, "g": ca.vertcat(*rows)},
            {
                "x0": np.concatenate([states.ravel(), force, start]),
                "lbx": np.concatenate([-free, np.zeros(self.steps), arms[:, 0]]),
                "ubx": np.concatenate([free, np.full(self.steps, np.inf), arms[:, 1]]),
                "lbg": zero,
                "ubg": zero,
            },
        )

    def _distance(self, state: ca.SX, goal: Sequence[float]) -> ca.SX:
        """Return a squared distance."""
        if not self.sine_and_cosine:
            return ca.sumsqr(state - ca.DM(list(goal)))
        turn = ca.vertcat(ca.cos(state[2]) - np.cos(goal[2]), ca.sin(state[2]) - np.sin(goal[2]))
        return ca.sumsqr(state[:2] - ca.DM(list(goal[:2]))) + ca.sumsqr(turn)


TRANSPORT = Cart(1.0, 2.0, 0.2, 0.02, 199, 1e5, 10.0, 1e-4)


def _friction(coefficient: float, mass: float, gravity: float, part: float, radius: float) -> tuple[float, float]:
    """Return force by velocity and torque by angular velocity of a slider."""
    force = coefficient * mass * gravity
    return force, force * part * radius


SLIDERS: Mapping[str, Slider] = {
    "crisp_push_box": Slider(*_friction(0.5, 1, 9.8, 0.4, np.hypot(0.5, 0.25)), 0.02, 99, 1e-3),
    "crisp_push_t": Slider(
        *_friction(0.4, 1, 9.8, 0.4, 2.8 * 0.05), 0.05, 49, 0.01, positions=1.0, sine_and_cosine=True
    ),
}


def cases() -> dict[str, dict[str, object]]:
    """Return name of a case -> its task, and what is changed in it."""
    found: dict[str, dict[str, object]] = {}
    folder = ROOT / "tasks" / "public"
    for before, after in ((0, 0), (-3, 0), (-4, -2)):
        for first in (0, -0.5, 0.5):
            for last in (0, -0.5, 0.5):
                found[f"crisp_transport, {first:g} to {last:g} m, {before:g} to {after:g} m/s"] = {
                    "task": str(folder / "crisp_transport.yaml"),
                    "initial.configuration.cargo": first,
                    "initial.velocity.cart": before,
                    "goal.frames.cargo.position": [last, None, None],
                    "goal.velocity.cart": after,
                    "goal.frames.cargo.velocity": [after, None, None],
                }
    found["impact_cart"] = {"task": str(folder / "impact_cart.yaml")}
    found["impact_cart, both a metre on"] = {
        "task": str(folder / "impact_cart.yaml"),
        "goal.configuration.cart": 1,
        "goal.configuration.cargo": 0,
    }
    found["c3_cart_pole"] = {"task": str(folder / "c3_cart_pole.yaml")}
    found["crisp_push_bot"] = {"task": str(folder / "crisp_push_bot.yaml")}
    found["crisp_waiter"] = {"task": str(folder / "crisp_waiter.yaml")}
    found["ci_mpc_hopper"] = {"task": str(folder / "ci_mpc_hopper.yaml")}
    found["ci_mpc_flamingo"] = {"task": str(folder / "ci_mpc_flamingo.yaml")}
    for k in range(18):
        angle = np.radians(20 * k)
        found[f"crisp_push_box, {20 * k} degrees"] = {
            "task": str(folder / "crisp_push_box.yaml"),
            "goal.configuration.root_x": round(3 * float(np.cos(angle)), 9),
            "goal.configuration.root_z": round(3 * float(np.sin(angle)), 9),
            "goal.configuration.root_pitch": -round(float(angle), 9),
        }
    for name in ("crisp_push_t", "impact_box", "impact_disk", "impact_push_t"):
        found[name] = {"task": str(folder / f"{name}.yaml")}
    found["idto_spinner"] = {"task": str(folder / "idto_spinner.yaml")}
    return found


def measure(result: Plan) -> dict[str, object]:
    """Return by how much the goal is missed, and the peer's objective with its violation where it is posed."""
    assert result.outcome is not None
    missed = (miss_words(result.outcome, kind) for kind in ("position", "velocity"))
    row: dict[str, object] = {"missed": "; ".join(missed), "steps": len(result.controls["time"])}
    peers: Mapping[str, Cart | SoftWalls | Waiter] = {
        "crisp_transport": TRANSPORT,
        "c3_cart_pole": cart_pole(),
        "crisp_push_bot": push_bot(),
        "crisp_waiter": Waiter(),
    }
    if result.status.solved and (peer := problem_of(result) or peers.get(result.name)):
        row["peer"], row["violation"] = peer.objective(result)
    if result.status.solved and result.name in SLIDERS:
        x, y, pitch = (result.task["goal"]["configuration"][name] for name in ("root_x", "root_z", "root_pitch"))
        row["peer"], row["violation"] = SLIDERS[result.name].objective(result, [x, y, -pitch])
    return row


def _goal(plan: Plan) -> list[float]:
    """Return where cargo and cart should be at the end, and how fast, m and m/s."""
    goal = plan.task["goal"]
    cargo, moving = goal["frames"]["cargo"], goal["velocity"]
    return [cargo["position"][0], goal["configuration"]["cart"], cargo["velocity"][0], moving["cart"]]


def line(row: Row) -> list[str]:
    """Return the line of a case."""
    peer = "–" if row["peer"] is None else f"{row['peer']:.5g}"
    violation = "–" if row["violation"] is None else f"{row['violation']:.0e}"
    own = [f"{row['cost']:.5g}", row["missed"] or "", peer, violation, f"{row['seconds']:.1f}", str(row["iterations"])]
    return [row["case"], "yes" if solved(row) else "no", *own, TABLE.program(row)]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# Public tasks",
            "",
            TABLE.made_by(rows),
            "",
            "Tasks of other contact planners, written with the parameters of their files; each file in "
            "[`tasks/public/`](../tasks.md#public-tasks) begins with its source and with what differs. Planned at "
            f"default settings, exactly, and audited, on {machine()} that did other work, too. {PROGRAM_IS}",
            "",
            "*Cost* is that of the task here, whose controls are constant over 20 to 40 intervals. *Peer's objective* "
            "is that of the peer's file, at its own steps and with its own cost, on the sequence of contacts, or of "
            "the sides that are pushed, that the plan has, with its largest *violation*: the optimum of a convex "
            "problem, of `crisp_push_bot`, `crisp_waiter` and CRISP's sliders what IPOPT finds from the plan. Of "
            "IMPACT's tasks it is what the MPCC solver finds from the plan, on whatever sequence. C3's cart-pole "
            "has a linear model there, in which its pole leans deeper into the wall, and CRISP's waiter a plate that "
            "only slides. The motions that CI-MPC's controllers follow cost 703 (hopper) and 409 (flamingo) by the "
            "costs here. The peers report no objectives, and did not run here but for [IMPACT](#beside-impact); their "
            "solvers stop at 1e-3 to 1e-5.",
            "",
            f"**{sum(map(solved, rows))} of {len(rows)} solved exactly.**",
            "",
            markdown_table(HEADER, [line(row) for row in rows]),
            beside_impact(rows),
        ]
    )


HEADER = (
    "case",
    "solved",
    "cost",
    "goal missed by",
    "peer's objective",
    "violation",
    "seconds",
    "iterations",
    "program",
)

TABLE = Table(
    ROOT / "docs" / "results" / "public_tasks.md",
    {"cases": cases()},
    page_of,
    partial(planned, measure=measure),
    {"missed": str, "steps": int, "peer": float, "violation": float},
    by="case",
)

if __name__ == "__main__":
    sys.exit(0 if all(map(solved, TABLE.main(__doc__ or ""))) else 1)
