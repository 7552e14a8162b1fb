"""The weights of a plan's cost in words, term by term."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fesd_robot.orientations import deviation_names, value_names
from fesd_robot.plans.plan import Plan
from fesd_robot.task import COST_TERMS, NameKind


def weights_of(plan: Plan) -> dict[str, str]:
    """Return the weights of every term of the cost with their units; terms of the method have none."""
    costs, goal, units = plan.task["costs"], plan.task["goal"], plan.units
    axes = dict.fromkeys("xyz", "m")
    positions = {name: units.configuration.get(name, "rad") for name in value_names(units.configuration)}
    named: dict[NameKind | None, Mapping[str, str]] = {
        "configuration coordinate": positions,
        "velocity coordinate": units.velocity,
        "control": units.controls,
        "group of controls": {
            group: units.controls[next(iter(sets.values()))[0]]
            for group, sets in plan.task.get("robot", {}).get("one_at_a_time", {}).items()
        },
        "contact": dict.fromkeys(plan.contacts, ""),
        "axis": axes,
        "frame": axes,
        None: {},
    }
    sentences = {}
    for key, term in COST_TERMS.items():
        if key not in costs:  # a plan of an earlier version
            continue
        for name, _, weights in term.parts(key, costs[key]):
            if weights is None:  # a plan of an earlier version, or of a motion that repeats
                continue
            own = named[term.names] if term.quantity is None else dict.fromkeys(weights, term.quantity)
            sentences[name] = _sentence(weights, own, term.unit)
    for frame, target in goal.get("frames", {}).items():
        sentences[f"goal: {frame}"] = _target(target)
    if goal.get("center_of_mass"):
        sentences["goal: center of mass"] = _target(goal["center_of_mass"])
    for i, waypoint in enumerate(plan.task.get("waypoints", [])):
        sentences[f"waypoint {i + 1}"] = "; ".join(_waypoint(waypoint, positions, units.velocity))
    return {term: text for term, text in sentences.items() if text}


def _sentence(weights: Mapping[str, float], units: Mapping[str, str], form: str) -> str:
    """Return ``a, b 100 /m2/s``, the names of one weight and unit together.

    Args:
        form: of the unit, see `fesd_robot.task.costs.CostTerm.unit`.
    """
    groups: dict[str, list[str]] = {}
    for name, weight in weights.items():
        if weight:
            unit = units.get(name, "")
            rate = f"{unit}2" if unit.endswith("/s") else f"{unit}/s"
            text = form.format(square=_squared(unit), rate=_squared(rate), integral=f"({unit} s)", linear=unit)
            groups.setdefault(f"{weight:g} {text}", []).append(name)
    return "; ".join(f"{', '.join(names)} {weight}".strip() for weight, names in groups.items())


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
        names = deviation_names(waypoint[key])
        found.append(_sentence(dict.fromkeys(names, waypoint[weight]), units, "/{square}"))
    found += [f"{frame}: {_target(target)}" for frame, target in waypoint["frames"].items() if _target(target)]
    if waypoint["center_of_mass"] and _target(waypoint["center_of_mass"]):
        found.append(f"center of mass: {_target(waypoint['center_of_mass'])}")
    return [part for part in found if part]
