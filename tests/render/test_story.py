"""What the page says and draws of a plan, before it is drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import load_task_robot
from fesd_robot.ocp.actuation import build_actuation
from fesd_robot.ocp.scene import friction_of, scene_of
from fesd_robot.plans import Plan, read_plan, task_of
from fesd_robot.plans.plan import SimulationSummary
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.render.feet import feet_of
from fesd_robot.render.story import story_of
from fesd_robot.render.verdict import effort_facts, goal_rows, verdict_of

PLANS = Path(__file__).with_name("plans")
TASKS = Path(__file__).parents[2] / "tasks"


def read(name: str) -> Plan:
    return read_plan(PLANS / f"{name}.json")


def test_feet_are_the_real_ones_and_share_the_force() -> None:
    """Solo12's two contacts are four feet, on the ground where they carry, whose forces add up to the contact's."""
    plan = read("solo12_jump")
    task, robot = load_task_robot(task_of(plan, TASKS))
    q = np.column_stack([plan.trajectory.configuration[name] for name in robot.configuration_names])
    feet = feet_of(plan, task, robot, q)
    assert [foot.name for foot in feet] == ["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"]
    assert np.ptp([foot.place[0, 1] for foot in feet]) > 0.2
    for name, contact in plan.contacts.items():
        own = [foot for foot in feet if foot.contact == name]
        total = sum(foot.force for foot in own)
        np.testing.assert_allclose(total[:, 2], contact.normal_force, atol=1e-9)
        np.testing.assert_allclose(total[:, 0], contact.tangential_force, atol=1e-9)
        carrying = contact.normal_force > 1.0
        assert np.abs(own[0].place[carrying, 2]).max() < 1e-4


def test_forces_push_the_robot_as_the_jacobian_says() -> None:
    """The power of a foot's force on its place is that of the audit's contact rows, for a random velocity."""
    plan = read("hopper_one_jump")
    task, robot = load_task_robot(task_of(plan, TASKS))
    q = np.column_stack([plan.trajectory.configuration[name] for name in robot.configuration_names])
    foot = feet_of(plan, task, robot, q)[0]
    physics = NumericPhysics(robot, scene_of(task), {"foot": friction_of(task, "foot")}, lambda _: np.zeros((4, 0)))
    sample = int(np.argmax(plan.contacts["foot"].normal_force))
    v = np.array([0.3, -0.2, 0.7, 0.5])
    history = plan.contacts["foot"]
    power = v @ physics.contact_jacobian(q[sample]).T @ [history.normal_force[sample], history.tangential_force[sample]]
    step = 1e-6
    moved = [physics.contact_points(q[sample] + sign * step * v)[0] for sign in (1, -1)]
    assert foot.force[sample] @ (moved[0] - moved[1]) / (2 * step) == pytest.approx(power, rel=1e-5)


def test_events_come_in_order_and_once() -> None:
    """Switches of both contacts at one moment are one event; a touchdown with an impact says how hard it is."""
    plan = read("solo12_jump")
    task, robot = load_task_robot(task_of(plan, TASKS))
    q = np.column_stack([plan.trajectory.configuration[name] for name in robot.configuration_names])
    story = story_of(plan, feet_of(plan, task, robot, q), build_actuation(task, robot), plan.trajectory.time)
    times = [event["time"] for event in story["events"]]
    assert times == sorted(set(times))
    takeoff = next(event for event in story["events"] if event["time"] == 0.2)
    assert takeoff["words"] == "front takeoff; hind takeoff"
    hit = next(event for event in story["events"] if event["impact"])
    assert "front hits, 0.303 N s" in hit["words"]


def test_the_verdict_is_a_sentence_that_is_true() -> None:
    """It says reached, soft, missed, or the plan's own message where it is not solved."""
    plan = read("block_push")
    assert plan.outcome is not None
    assert verdict_of(plan).sentence.startswith("The robot reaches its goal")

    def with_goal(**changes: object) -> Plan:
        assert plan.outcome is not None
        first, *others = plan.outcome.goal
        goal = [first.model_copy(update=changes), *others]
        return plan.model_copy(update={"outcome": plan.outcome.model_copy(update={"goal": goal})})

    assert "misses its goal" in verdict_of(with_goal(met=False)).sentence
    assert "its goal is soft" in verdict_of(with_goal(met=None, tolerance=None)).sentence
    assert "reaches" not in verdict_of(plan.model_copy(update={"outcome": None})).sentence
    status = plan.status.model_copy(update={"solved": False, "message": "Too slow."})
    verdict = verdict_of(plan.model_copy(update={"status": status}))
    assert (verdict.solved, verdict.sentence, verdict.badge) == (False, "Too slow.", "not solved")
    simulated = plan.model_copy(update={"simulation": SimulationSummary(events=0, impacts=0, steps=1, notes=[])})
    assert verdict_of(simulated).badge == "simulated" and "goal" not in verdict_of(simulated).sentence


def test_goal_and_peak_are_in_figures() -> None:
    """Rows have goal, end and miss; the control nearest to its limit is named with its share."""
    plan = read("hopper_one_jump")
    task, robot = load_task_robot(task_of(plan, TASKS))
    assert goal_rows(plan)[0] == ("root_x (m)", "1", "0.9914", "0.0086")
    facts = dict(effort_facts(plan, build_actuation(task, robot)))
    assert facts["peak effort"] == "leg_force 72.6 of 100 N, 73 %"
    assert facts["cost"] == f"{plan.statistics.objective:.4g}"
