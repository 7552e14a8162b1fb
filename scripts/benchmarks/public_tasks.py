"""Tasks of other contact planners, with the parameters of their files, and plans of them in their own discretisation.

    python scripts/benchmarks/public_tasks.py                    # all
    python scripts/benchmarks/public_tasks.py idto_spinner       # this one anew, the others from the data file
    python scripts/benchmarks/public_tasks.py --redraw           # nothing anew

Writes docs/results/public_tasks.md. Where the peer's problem is a cargo on a cart, a pole between soft walls, a plate
on a table, a disk, or a slider that is pushed at one side at a time, it is posed here, too, in the peer's steps and
with its cost, and solved from the plan. Exit code 1 if one is not solved.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from functools import partial

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot.plans import Plan
from fesd_robot.plans.outcome_words import miss_words
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.benchmarks import _crisp, _impact
from scripts.benchmarks._peer_page import beside_peers
from scripts.benchmarks._soft_walls import SoftWalls, cart_pole, push_bot
from scripts.benchmarks._waiter import Waiter
from scripts.tools.arguments import ROOT, machine
from scripts.tools.table import PROGRAM_IS, Row, Table, solved


def cases() -> dict[str, dict[str, object]]:
    """Return name of a case -> its task, and what is changed in it."""
    found: dict[str, dict[str, object]] = {}
    folder = ROOT / "tasks" / "public"
    for case, (start, goal) in _crisp.INSTANCES.items():
        found[case] = {
            "task": str(folder / "crisp_transport.yaml"),
            "initial.configuration.cargo": start[0] - start[1],
            "initial.velocity.cart": start[3],
            "goal.frames.cargo.position": [goal[0], None, None],
            "goal.velocity.cart": goal[3],
            "goal.frames.cargo.velocity": [goal[2], None, None],
        }
    found["impact_cart"] = {"task": str(folder / "impact_cart.yaml")}
    found["impact_cart, both a metre on"] = {
        "task": str(folder / "impact_cart.yaml"),
        "goal.configuration.cart": 1,
        "goal.configuration.cargo": 0,
    }
    for name in ("c3_cart_pole", "crisp_push_bot", "crisp_waiter", "ci_mpc_hopper", "ci_mpc_flamingo"):
        found[name] = {"task": str(folder / f"{name}.yaml")}
    for case, (x, y, angle) in _crisp.GOALS.items():
        found[case] = {
            "task": str(folder / "crisp_push_box.yaml"),
            "goal.configuration.root_x": round(x, 9),
            "goal.configuration.root_z": round(y, 9),
            "goal.configuration.root_pitch": -round(angle, 9),
        }
    for name in ("crisp_push_t", "impact_box", "impact_disk", "impact_push_t", "idto_mini_cheetah", "idto_spinner"):
        found[name] = {"task": str(folder / f"{name}.yaml")}
    return found


def measure(result: Plan) -> dict[str, object]:
    """Return by how much the goal is missed, and the peer's objective with its violation where it is posed."""
    assert result.outcome is not None
    missed = (miss_words(result.outcome, kind) for kind in ("position", "velocity"))
    row: dict[str, object] = {"missed": "; ".join(missed), "steps": len(result.controls["time"])}
    peers: Mapping[str, SoftWalls | Waiter] = {
        "c3_cart_pole": cart_pole(),
        "crisp_push_bot": push_bot(),
        "crisp_waiter": Waiter(),
    }
    peer = _impact.problem_of(result) or _crisp.problem_of(result) or peers.get(result.name)
    if result.status.solved and peer is not None:
        row["peer"], row["violation"] = peer.objective(result)
    return row


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
            "is that of the peer's file, at its own steps and with its own cost, with its largest *violation*: of "
            "CRISP's transport and sliders and of IMPACT's tasks an exact solution that the MPCC solver finds from "
            "the plan, of the others what IPOPT finds on the plan's sequence of contacts. C3's cart-pole "
            "has a linear model there, in which its pole leans deeper into the wall, and CRISP's waiter a plate that "
            "only slides. The motions that CI-MPC's controllers follow cost 703 (hopper) and 409 (flamingo) by the "
            "costs here. The peers report no objectives, and did not run here but for [two](#peers-that-ran-here); "
            "their solvers stop at 1e-3 to 1e-5.",
            "",
            f"**{sum(map(solved, rows))} of {len(rows)} solved exactly.**",
            "",
            markdown_table(HEADER, [line(row) for row in rows]),
            beside_peers(rows),
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
