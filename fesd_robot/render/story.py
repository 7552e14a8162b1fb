"""The parts of a page beside the moving robot: contacts, events, controls and curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.exactness import ROUNDED
from fesd_robot.instants import SAME_EVENT
from fesd_robot.orientations import columns_with_angles
from fesd_robot.render.palette import series_color
from fesd_robot.render.timeline import mode_spans

if TYPE_CHECKING:
    from fesd_robot.ocp import Actuation
    from fesd_robot.plans import Plan
    from fesd_robot.render.feet import FootMotion

KINDS = {"stick_to_slip": "begins to slip", "slip_to_stick": "sticks", "slip_reversal": "slips the other way"}
"""Names of switches whose own names are not plain."""


def story_of(plan: Plan, feet: Sequence[FootMotion], actuation: Actuation, time: np.ndarray) -> dict[str, Any]:
    """Return the content that the script of the page draws, as values that JSON knows.

    Args:
        feet: of the plan, from `feet_of`.
        actuation: names, limits and units of the controls.
        time: of the samples, s, non-decreasing, (n).
    """
    return {
        "time": _short(time),
        "feet": [_foot(foot, number, plan, time) for number, foot in enumerate(feet)],
        "rows": _rows(plan, time),
        "events": _events(plan),
        "controls": _controls(plan, actuation),
        "curves": _curves(plan),
    }


def _foot(foot: FootMotion, number: int, plan: Plan, time: np.ndarray) -> dict[str, Any]:
    impulses = []
    for one in plan.impulses:
        if one.contact == foot.contact:
            sample = int(np.argmin(np.abs(time - one.time)))
            vector = one.normal * foot.normal[sample] + one.tangential * foot.tangent[sample]
            vector = foot.share * (vector + (one.lateral or 0.0) * foot.lateral[sample])
            impulses.append({"time": one.time, "vector": _short(vector)})
    return {
        "name": foot.name,
        "contact": foot.contact,
        "color": series_color(number),
        "place": _short(foot.place),
        "force": _short(foot.force),
        "normal": _constant(foot.normal / np.linalg.norm(foot.normal, axis=1, keepdims=True)),
        "friction": foot.friction,
        "impulses": impulses,
    }


def _rows(plan: Plan, time: np.ndarray) -> list[dict[str, Any]]:
    """Return the rows of the contact timeline, each with its stretches of one mode."""
    modes: dict[str, Sequence[ContactMode]] = {name: contact.mode for name, contact in plan.contacts.items()}
    modes |= {f"{name} (joint)": joint.mode for name, joint in plan.joint_friction.items()}
    return [
        {"name": name, "spans": [[span.mode, span.start, span.end] for span in mode_spans(time, mode)]}
        for name, mode in modes.items()
    ]


def _events(plan: Plan) -> list[dict[str, Any]]:
    """Return the events in words, with their times; those at the same time are one."""
    hits = {(one.contact, round(one.time, 6)) for one in plan.impulses}
    found: list[tuple[float, str, bool]] = []
    for switch in plan.switches:
        hit = (switch.contact, round(switch.time, 6)) in hits and switch.kind == "touchdown"
        found += [] if hit else [(switch.time, f"{switch.contact} {KINDS.get(switch.kind, switch.kind)}", False)]
    found += [(one.time, f"{one.contact} hits, {one.normal:.3g} N s", True) for one in plan.impulses]
    found += [(one.time, f"{one.joint} {KINDS.get(one.kind, one.kind)}", False) for one in plan.joint_switches]
    events: list[dict[str, Any]] = []
    for moment, words, impact in sorted(found):
        if events and moment - events[-1]["time"] <= SAME_EVENT:
            events[-1] = {**events[-1], "words": f"{events[-1]['words']}; {words}"}
            events[-1]["impact"] = events[-1]["impact"] or impact
        else:
            events.append({"time": moment, "words": words, "impact": impact})
    return events


def _controls(plan: Plan, actuation: Actuation) -> dict[str, Any]:
    bounds = zip(actuation.names, actuation.units, actuation.lower.tolist(), actuation.upper.tolist(), strict=True)
    entries = [
        {
            "name": name,
            "unit": unit,
            "lower": _finite(low),
            "upper": _finite(high),
            "values": _short(plan.controls[name]),
        }
        for name, unit, low, high in bounds
    ]
    return {"start": _short(plan.controls["time"]), "entries": entries}


def _curves(plan: Plan) -> list[dict[str, Any]]:
    """Return the curves over the samples that a reader may choose from; those of controls are steps of their own."""
    trajectory = plan.trajectory
    positions = columns_with_angles(trajectory.configuration)
    curves = [
        {"group": group, "name": name, "unit": units[name], "lines": [{"name": name, "values": _short(values)}]}
        for group, units, entries in (
            ("position", {**dict.fromkeys(positions, "rad"), **plan.units.configuration}, positions),
            ("velocity", plan.units.velocity, trajectory.velocity),
        )
        for name, values in entries.items()
    ]
    for name, contact in plan.contacts.items():
        lines = [
            {"name": "normal", "values": _short(contact.normal_force)},
            {"name": "tangential", "values": _short(contact.tangential_force)},
        ]
        if contact.lateral_force is not None:
            lines.append({"name": "lateral", "values": _short(contact.lateral_force)})
        curves.append({"group": "contact force", "name": name, "unit": "N", "lines": lines})
        gap = [{"name": "gap", "values": _short(contact.gap)}]
        curves.append({"group": "gap", "name": name, "unit": "m", "lines": gap})
    return curves


def _constant(vectors: np.ndarray) -> Any:
    """Return directions, once if they never change."""
    return _short(vectors[:1] if np.ptp(vectors, axis=0).max() < ROUNDED else vectors)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _short(values: np.ndarray) -> Any:
    """Round numbers to six digits after the point, finer than a screen shows."""
    return (np.round(np.asarray(values, dtype=float), 6) + 0.0).tolist()
