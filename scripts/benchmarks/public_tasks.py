"""Tasks of other contact planners, with the parameters of their files, and plans of them in their own discretisation.

    python scripts/benchmarks/public_tasks.py                    # all
    python scripts/benchmarks/public_tasks.py idto_spinner       # this one anew, the others from the data file
    python scripts/benchmarks/public_tasks.py --redraw           # nothing anew

Writes docs/results/public_tasks.md. Where the peer's problem is a cargo on a cart, a pole between soft walls or a plate
on a table it is posed here, too, in the peer's steps and with its cost, and solved on the sequence of contacts that the
plan has. Exit code 1 if one is not solved.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from fesd_robot.plans.outcome_words import miss_words
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
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
        semi_implicit: whether positions follow from the velocity after a step, not before it.
        positions, velocities: weights of the squared distances from the goal at the end.
        control: weight of f^2 + u^2 at every step.
        slip: the same of the squared relative velocity.
    """

    cargo: float
    cart: float
    friction: float
    step: float
    steps: int
    semi_implicit: bool
    positions: float
    velocities: float
    control: float
    slip: float = 0.0

    def objective(self, plan: Plan) -> tuple[float, float]:
        """Return the peer's objective and its largest violation on the sequence of stick and slip of a plan.

        The problem is convex where that is given: its optimum is the only one.

        Args:
            plan: of the task, with the goal x1, x2, v1, v2, m and m/s.
        """
        goal = _goal(plan)
        states = _states(plan, self.step * np.arange(self.steps + 1))
        x, f, u = ca.SX.sym("x", 4, self.steps + 1), ca.SX.sym("f", self.steps), ca.SX.sym("u", self.steps)
        limit, h = self.friction * self.cargo * GRAVITY, self.step
        rows, lower, upper = list[ca.SX](), list[float](), list[float]()
        low, high = np.full(self.steps, -limit), np.full(self.steps, limit)
        for k in range(self.steps):
            speeds = x[2:, k] + h * ca.vertcat(f[k] / self.cargo, (u[k] - f[k]) / self.cart)
            places = x[:2, k] + h * (speeds if self.semi_implicit else x[2:, k])
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
        cost += self.control * (ca.sumsqr(f) + ca.sumsqr(u)) + self.slip * ca.sumsqr(x[2, :-1] - x[3, :-1])
        w = ca.vertcat(ca.vec(x), f, u)
        options: dict[str, Any] = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
        solver = ca.nlpsol("peer", "ipopt", {"x": w, "f": cost, "g": ca.vertcat(*rows)}, options)
        free = np.full(4 * self.steps, np.inf)
        result = solver(
            lbx=np.concatenate([states[0], -free, low, np.full(self.steps, -np.inf)]),
            ubx=np.concatenate([states[0], free, high, np.full(self.steps, np.inf)]),
            lbg=lower,
            ubg=upper,
        )
        g = np.asarray(result["g"]).ravel()
        beyond = np.maximum(np.array(lower) - g, g - np.array(upper)).max()
        return float(result["f"]), float(max(beyond, 0.0))


def _states(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Return places and velocities of cargo and cart, m and m/s, (n, 4)."""
    at = plan.at(np.minimum(times, plan.trajectory.time[-1]))
    (cart, cargo), (speed, slide) = (
        [np.asarray(of[name]) for name in ("cart", "cargo")] for of in (at.configuration, at.velocity)
    )
    return np.column_stack([cart + cargo, cart, speed + slide, speed])


TRANSPORT = Cart(1.0, 2.0, 0.2, 0.02, 199, True, 1e5, 10.0, 1e-4)
IMPACT = Cart(0.1, 0.2, 0.2, 0.02, 300, False, 5000.0, 5000.0, 1e-6, 1e-6)


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
    found["idto_spinner"] = {"task": str(folder / "idto_spinner.yaml")}
    return found


def measure(result: Plan) -> dict[str, object]:
    """Return by how much the goal is missed, and the peer's objective with its violation where it is posed."""
    assert result.outcome is not None
    missed = (miss_words(result.outcome, kind) for kind in ("position", "velocity"))
    row: dict[str, object] = {"missed": "; ".join(missed), "steps": len(result.controls["time"])}
    peers: Mapping[str, Cart | SoftWalls | Waiter] = {
        "crisp_transport": TRANSPORT,
        "impact_cart": IMPACT,
        "c3_cart_pole": cart_pole(),
        "crisp_push_bot": push_bot(),
        "crisp_waiter": Waiter(),
    }
    if result.status.solved and result.name in peers:
        row["peer"], row["violation"] = peers[result.name].objective(result)
    return row


def _goal(plan: Plan) -> list[float]:
    """Return where cargo and cart should be at the end, and how fast, m and m/s."""
    goal = plan.task["goal"]
    cart, speed = goal["configuration"].get("cart", 0.0), goal["velocity"].get("cart", 0.0)
    if "cargo" in goal["frames"]:
        own = goal["frames"]["cargo"]
        return [own["position"][0], cart, own["velocity"][0], speed]
    return [cart + goal["configuration"]["cargo"], cart, speed, speed]


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
            "is that of the peer's file, at its own steps and with its own cost, on the sequence of contacts "
            "that the plan has, with its largest *violation*: the optimum of a convex problem, of `crisp_push_bot` and "
            "`crisp_waiter` a local one. C3's cart-pole has a linear model there, in which its pole leans deeper into "
            "the wall, and CRISP's waiter a plate that only slides. The motions that CI-MPC's controllers follow cost "
            "703 (hopper) and 409 (flamingo) by the costs here. The peers report no objectives, and did not run here; "
            "their solvers stop at 1e-3 to 1e-5.",
            "",
            f"**{sum(map(solved, rows))} of {len(rows)} solved exactly.**",
            "",
            markdown_table(HEADER, [line(row) for row in rows]),
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
