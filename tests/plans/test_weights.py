"""The weights of every term of the cost, with units."""

from __future__ import annotations

from typing import Any

import pytest

from fesd_robot.plans import Plan, report
from fesd_robot.plans.weights import weights_of


def asked(plan: Plan, costs: dict[str, Any], **task: Any) -> Plan:
    """The plan of a task with other costs."""
    return plan.model_copy(update={"task": {**plan.task, "costs": {**plan.task["costs"], **costs}, **task}})


CASES: list[tuple[dict[str, Any], str, str]] = [
    ({"configuration": {"root_x": 5, "leg": 5, "root_pitch": 2, "root_z": 0}}, "configuration",
     "root_x, leg 5 /m2/s; root_pitch 2 /rad2/s"),
    ({"velocity": dict.fromkeys(["root_x", "root_pitch", "root_z"], 0.1)}, "velocity",
     "root_x, root_z 0.1 /(m/s)2/s; root_pitch 0.1 /(rad/s)2/s"),
    ({"control": {"reaction_torque": 1}}, "control", "reaction_torque 1 /(N m)2/s"),
    ({"terminal_configuration": {"leg": 3}}, "terminal configuration", "leg 3 /m2"),
    ({"control_change": {"leg_force": 4}}, "control change", "leg_force 4 /N2"),
    ({"acceleration": {"leg": 4, "root_pitch": 1}}, "acceleration", "leg 4 /(m/s2)2/s; root_pitch 1 /(rad/s2)2/s"),
    ({"force": {"foot": 0.5}}, "force", "foot 0.5 /(N s)"),
    ({"center_of_mass": {"x": 1.0, "z": 2.0}}, "center of mass", "x 1 /m2/s; z 2 /m2/s"),
    ({"frames": {"foot": {"z": 2.0}}}, "frame foot", "z 2 /m2/s"),
    ({"time": 7.0}, "time", "7 /s"),
]  # fmt: skip


@pytest.mark.parametrize(("costs", "term", "text"), CASES, ids=[case[1] for case in CASES])
def test_weights_and_units(plan: Plan, costs: dict[str, Any], term: str, text: str) -> None:
    """Names of one weight and unit stand together; names that weigh nothing are left out."""
    assert weights_of(asked(plan, costs))[term] == text


def test_weights_of_targets(plan: Plan) -> None:
    """Goals of points and waypoints tell their own weights; a term without any, as in old plans, has no entry."""
    point = {"position": [0, None, 1], "velocity": [1, None, None], "weight": 7.0, "velocity_weight": 0.0}
    goal = {**plan.task["goal"], "configuration": {"leg": 0.5}, "frames": {"foot": point}, "center_of_mass": None}
    waypoint = {
        "configuration": {"leg": 0.3}, "velocity": {"leg": 0}, "weight": 2.0, "velocity_weight": 1.0,
        "frames": {"foot": point}, "center_of_mass": point,
    }  # fmt: skip
    found = weights_of(asked(plan, {"terminal_configuration": None}, goal=goal, waypoints=[waypoint]))
    assert found["goal: foot"] == "position 7 /m2"
    assert "terminal configuration" not in found
    assert found["waypoint 1"] == "leg 2 /m2; leg 1 /(m/s)2; foot: position 7 /m2; center of mass: position 7 /m2"


def test_the_report_has_share_and_weights(plan: Plan) -> None:
    """A row of the cost table has term, value, share and weights."""
    line = next(line for line in report(plan).splitlines() if line.startswith("| control |"))
    assert line == "| control | 1 | 25.0 % | reaction_torque 0.01 /(N m)2/s; leg_force 0.01 /N2/s |"
