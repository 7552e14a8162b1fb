"""Content of every export besides samples: verdict, units, impacts and switches."""

from __future__ import annotations

from typing import Any

from fesd_robot.plans.plan import Plan


def facts(plan: Plan) -> dict[str, Any]:
    """Return name, verdict, units, impulses and switches as plain values.

    Units are by kind and name, of time, lengths and forces they are s, m and N; impulses are in N s.
    """
    return {
        "name": plan.name,
        "solved": plan.status.solved,
        "verdict": plan.status.message,
        "units": plan.units.model_dump(),
        "impulses": [
            each.model_dump(exclude_none=True, include={"time", "contact", "normal", "tangential", "lateral"})
            for each in plan.impulses
        ],
        "switches": [{"time": each.time, "contact": each.contact, "kind": each.kind} for each in plan.switches],
        "joint_switches": [each.model_dump() for each in plan.joint_switches],
    }
