"""The weights of a plan's cost in words, term by term."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fesd_robot.plans.plan import Plan

_DEFAULTS = {
    "configuration": 1.0,
    "velocity": 0.1,
    "control": 1e-3,
    "terminal_configuration": 100.0,
    "terminal_velocity": 10.0,
}
"""Weight of every name where the task gives no map."""


def weights_of(plan: Plan) -> dict[str, str]:
    """Return the weights of every term of the cost with their units; terms of the method have none."""
    costs, goal = plan.task["costs"], plan.task["goal"]
    units, controls = plan.units, plan.units.controls
    contacts = dict.fromkeys(plan.contacts, "N")
    terms: list[tuple[str, str, Mapping[str, str], str]] = [
        ("configuration", "configuration", units.configuration, "/{0}/s"),
        ("velocity", "velocity", units.velocity, "/{0}/s"),
        ("control", "control", controls, "/{0}/s"),
        ("terminal configuration", "terminal_configuration", units.configuration, "/{0}"),
        ("terminal velocity", "terminal_velocity", units.velocity, "/{0}"),
        ("control change", "control_change", controls, "/{0}"),
        ("acceleration", "acceleration", units.velocity, "/{1}/s"),
        ("force", "force", contacts, "/{2}"),
        ("center of mass", "center_of_mass", dict.fromkeys("xyz", "m"), "/{0}/s"),
    ]
    found = {}
    for term, key, names, unit in terms:
        weights = costs.get(key)
        if weights is None and key in _DEFAULTS:
            only = key == "terminal_configuration" and (goal.get("frames") or goal.get("center_of_mass"))
            weights = dict.fromkeys(goal["configuration"] if only else names, _DEFAULTS[key])
        found[term] = _sentence(weights or {}, names, unit)
    for frame, weights in costs.get("frames", {}).items():
        found[f"frame {frame}"] = _sentence(weights, dict.fromkeys("xyz", "m"), "/{0}/s")
    for frame, target in goal.get("frames", {}).items():
        found[f"goal: {frame}"] = _target(target)
    if goal.get("center_of_mass"):
        found["goal: center of mass"] = _target(goal["center_of_mass"])
    for i, waypoint in enumerate(plan.task.get("waypoints", [])):
        found[f"waypoint {i + 1}"] = "; ".join(_waypoint(waypoint, units.configuration, units.velocity))
    found["time"] = f"{costs.get('time', 0.0):g} /s"
    return {term: text for term, text in found.items() if text}


def _sentence(weights: Mapping[str, float], units: Mapping[str, str], form: str) -> str:
    """Return ``a, b 100 /m2/s``, the names of one weight and unit together.

    Args:
        form: of the unit, from the square, the square of the rate, and the time integral of a name's own.
    """
    groups: dict[str, list[str]] = {}
    for name, weight in weights.items():
        if weight:
            unit = units.get(name, "")
            forms = (_squared(unit), _squared(f"{unit}2" if unit.endswith("/s") else f"{unit}/s"), f"({unit} s)")
            groups.setdefault(f"{weight:g} {form.format(*forms)}", []).append(name)
    return "; ".join(f"{', '.join(names)} {weight}" for weight, names in groups.items())


def _squared(unit: str) -> str:
    return f"({unit})2" if set(unit) & {" ", "/"} else f"{unit}2"


def _target(target: Mapping[str, Any]) -> str:
    parts = (
        ("position", "weight", "/m2"),
        ("velocity", "velocity_weight", "/(m/s)2"),
    )
    return "; ".join(f"{kind} {target[key]:g} {unit}" for kind, key, unit in parts if target[kind] and target[key])


def _waypoint(waypoint: Mapping[str, Any], positions: Mapping[str, str], velocities: Mapping[str, str]) -> list[str]:
    found = []
    for key, weight, units in (("configuration", "weight", positions), ("velocity", "velocity_weight", velocities)):
        found.append(_sentence(dict.fromkeys(waypoint[key], waypoint[weight]), units, "/{0}"))
    found += [f"{frame}: {_target(target)}" for frame, target in waypoint["frames"].items() if _target(target)]
    if waypoint["center_of_mass"] and _target(waypoint["center_of_mass"]):
        found.append(f"center of mass: {_target(waypoint['center_of_mass'])}")
    return [part for part in found if part]
