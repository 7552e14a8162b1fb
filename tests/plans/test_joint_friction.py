"""A pendulum whose hinge has dry friction: planned at default settings, audited, written down, and spoilt."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import Run, solve
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import names_of
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.plans.audit_record import Audit
from fesd_robot.plans.exports import export
from fesd_robot.plans.report_text import report
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.refinement.solved_motion import SolvedMotion
from fesd_robot.render.figures.contacts import timeline_figure
from fesd_robot.render.figures.look import Look
from fesd_robot.task import Task, load_task

from .test_planted import audited

LIMIT, WEIGHT, LENGTH, INERTIA = 1.0, 9.81, 0.5, 0.27
"""N m, N, m to the centre of mass, and kg m^2 about the hinge."""

MODEL = f"""
<robot name="pendulum">
  <link name="base"/><link name="tip"/>
  <link name="arm"><inertial><origin xyz="0 0 -{LENGTH}"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 2"/><axis xyz="0 -1 0"/>
    <limit lower="-6.3" upper="6.3" effort="4" velocity="20"/><dynamics friction="{LIMIT}"/></joint>
  <joint name="end" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0 0 -0.5"/></joint>
</robot>
"""

TASK = """
name: held_by_friction
robot: {model: pendulum.urdf}
contacts: {tip: {frame: tip}}
horizon: {duration: 1.2, intervals: 8}
initial: {configuration: {hinge: 0}}
waypoints:
  - {time: 0.6, configuration: {hinge: 0.15}}
goal: {configuration: {hinge: 0.15}}
"""


@pytest.fixture(scope="session")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """Swing from hanging to 0.15 rad in half of the time, and be there at the end: its friction can hold it there."""
    folder = tmp_path_factory.mktemp("pendulum")
    (folder / "pendulum.urdf").write_text(MODEL, encoding="utf-8")
    (folder / "task.yaml").write_text(TASK, encoding="utf-8")
    return load_task(folder / "task.yaml", ["method.grid=uniform"])


@pytest.fixture(scope="session")
def planned(task: Task) -> Plan:
    return plan(task)


@pytest.fixture(scope="session")
def solved(task: Task) -> SolvedMotion:
    """The same motion before it is refined, with its physics."""
    motion = formulate(task)
    polisher = BranchTranscription(Transcription(motion.ocp, motion.fesd))
    return SolvedMotion.of(
        motion, polisher, solve(polisher.transcription.problem, Run(homotopy_options(task)), polisher=polisher)
    )


def test_a_plan_sticks_and_slides_exactly(planned: Plan) -> None:
    """At default settings it is solved and passes its audit and its replay; while it sticks nothing moves."""
    assert planned.status.solved and planned.status.exact and planned.audit.violations == []
    joint, velocity = planned.joint_friction["hinge"], planned.trajectory.velocity["hinge"]
    sticks = np.array([mode == "stick" for mode in joint.mode])
    assert (joint.limit, joint.unit) == (LIMIT, "N m")
    assert sticks.any() and not sticks.all()
    np.testing.assert_allclose(velocity[sticks], 0, atol=1e-9)
    assert np.abs(joint.force).max() <= LIMIT + 1e-7
    moving = np.abs(velocity) > 1e-3
    np.testing.assert_allclose(joint.force[moving], -LIMIT * np.sign(velocity[moving]), atol=1e-7)
    assert planned.replay is not None
    assert planned.replay.velocity["hinge"].largest < 1e-6 and planned.replay.event_difference < 1e-6
    assert planned.audit.max_joint_friction_violation is not None
    assert planned.audit.max_joint_friction_violation < 1e-7
    assert {switch.joint for switch in planned.joint_switches} == {"hinge"}


def test_friction_takes_what_the_energy_lacks(solved: SolvedMotion) -> None:
    """E(T) - E(0) = work of the motor + work of friction, and that is minus F times the angle that is covered."""
    motion, physics = solved.physical, solved.physics
    energy = [physics.energy(motion.configuration[k], motion.velocity[k]) for k in (0, -1)]
    work = motion.weight @ (motion.control[:, 0] * motion.velocity[:, 0])
    assert motion.joints is not None
    friction = motion.weight @ (motion.joints.force[:, 0] * motion.velocity[:, 0])
    assert friction == pytest.approx(-LIMIT * (motion.weight @ np.abs(motion.velocity[:, 0])), abs=1e-9)
    assert friction < -0.1
    assert energy[1] - energy[0] == pytest.approx(work + friction, abs=1e-3)
    assert solved.audit.max_energy_error < 1e-3


def _spoilt(solved: SolvedMotion, intervals: Sequence[int], torque: float) -> Audit:
    """Return the audit of the motion with another torque of the motor in some intervals, and friction to make up."""
    motion = solved.physical
    joints, dense = motion.joints, motion.between
    assert joints is not None
    here, there = np.isin(motion.interval, intervals), np.isin(dense.interval, intervals)
    control, force, between = motion.control.copy(), joints.force.copy(), dense.control.copy()
    control[here] += torque
    force[here] -= torque
    between[there] += torque
    spoilt: PhysicalMotion = replace(
        motion,
        control=control,
        joints=replace(joints, force=force),
        between=replace(dense, control=between),
    )
    assert audited(motion, solved.physics, names_of(solved.motion)).violations == []
    return audited(spoilt, solved.physics, names_of(solved.motion))


def _intervals(solved: SolvedMotion, *, sliding: bool) -> tuple[list[int], float]:
    """Return intervals in which the joint slides in one direction, or sticks, all of the time, and the direction."""
    motion = solved.physical
    assert motion.joints is not None
    speeds = {k: motion.velocity[motion.interval == k, 0] for k in range(8)}
    if not sliding:
        return [k for k, v in speeds.items() if np.abs(v).max() < 1e-9], 0.0
    forwards = [k for k, v in speeds.items() if v.min() > 1e-2]
    return (forwards, 1.0) if forwards else ([k for k, v in speeds.items() if v.max() < -1e-2], -1.0)


def test_friction_along_the_motion_is_found(solved: SolvedMotion) -> None:
    """A motor that saves twice the friction, which then pushes: the audit says so, and rigid bodies stay behind."""
    intervals, direction = _intervals(solved, sliding=True)
    found = _spoilt(solved, intervals, -2 * LIMIT * direction)
    assert "max_joint_slide_violation" in found.violations
    assert "max_replay_angular_velocity_error" in found.violations
    (words,) = [one for one in found.findings if one.entry == "max_joint_slide_violation"]
    assert words.subject == "hinge" and words.interval in intervals
    assert "joint 'hinge' slides by" in words.sentence and "opposes the motion" in words.sentence


def test_more_friction_than_there_is_is_found(solved: SolvedMotion) -> None:
    """A motor that works against twice the friction of the hinge."""
    intervals, direction = _intervals(solved, sliding=True)
    found = _spoilt(solved, intervals, LIMIT * direction)
    assert {"max_joint_friction_violation", "max_replay_angular_velocity_error"} <= set(found.violations)
    assert found.max_joint_friction_violation == pytest.approx(LIMIT, abs=1e-4)


def test_a_joint_that_sticks_against_too_much_is_found(solved: SolvedMotion) -> None:
    """A motor that pushes with three times the friction at a hinge that is said to stick: in a replay it moves."""
    intervals, _ = _intervals(solved, sliding=False)
    found = _spoilt(solved, intervals, 3 * LIMIT)
    assert {"max_joint_friction_violation", "max_replay_angular_velocity_error"} <= set(found.violations)
    (words,) = [one for one in found.findings if one.entry == "max_joint_friction_violation"]
    assert "joint 'hinge' needs" in words.sentence and "it would slide" in words.sentence


def test_files_hold_the_friction(planned: Plan) -> None:
    """plan.json, CSV, NPZ and JSON have the friction of the joint and its mode at every sample."""
    joint = planned.joint_friction["hinge"]
    again = Plan.model_validate_json(planned.model_dump_json())
    np.testing.assert_array_equal(again.joint_friction["hinge"].force, joint.force)
    assert again.joint_switches == planned.joint_switches
    rows = list(csv.DictReader(io.StringIO(export(planned, "csv").decode())))
    assert [row["hinge dry friction mode"] for row in rows] == joint.mode
    np.testing.assert_allclose([float(row["hinge dry friction [N m]"]) for row in rows], joint.force)
    with np.load(io.BytesIO(export(planned, "npz"))) as arrays:
        np.testing.assert_array_equal(arrays["dry_friction"][:, 0], joint.force)
        assert list(arrays["dry_friction_names"]) == ["hinge"]
    assert '"joint_modes"' in export(planned, "json").decode()


def test_efforts_are_those_of_the_motor_alone(planned: Plan) -> None:
    """Inverse dynamics take the friction off: what is left of the hinge's effort is the control."""
    assert planned.full_model is not None
    effort = planned.full_model.joints["hinge"].effort
    rows = list(csv.DictReader(io.StringIO(export(planned, "csv").decode())))
    np.testing.assert_allclose(effort, [float(row["hinge [N m]"]) for row in rows], atol=1e-9)


def test_report_and_figure_say_where_joints_stick(planned: Plan) -> None:
    """The report has limit, largest friction and work, and says in words when the joint sticks; the timeline a bar."""
    text = report(planned)
    assert "## Dry friction of joints" in text and "| hinge | 1 N m |" in text
    assert any(words in text for words in ("stops and sticks", "breaks away"))
    figure = timeline_figure(planned, "pendulum", Look())
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["tip", "hinge (joint)"]
