"""Compliant contact: a spring and a damper that push and never pull, in plan, replay, audit and simulation."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot import Plan, load_task, plan, simulate
from fesd_robot.complementarity import Branch
from fesd_robot.contact import CompliantContact, Contact, ContactMode, MultibodyDynamics, contact_modes
from fesd_robot.errors import TaskError
from fesd_robot.fesd import Element
from fesd_robot.ocp import formulate, motion_audit, numeric_physics
from fesd_robot.plans import task_of
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.simulation import ControlSchedule
from fesd_robot.simulation.drive import drive
from fesd_robot.simulation.motion import driven_motion
from fesd_robot.tracking import Tracker, feed_forward
from tests.contact.test_joint_friction import FAR, driven

MASS, STIFFNESS, DAMPING, SPEED, WALL = 2.0, 200.0, 8.0, 3.0, 1.0
"""kg, N/m, N s/m, m/s and m: a mass that is thrown against a spring, from 1 m away."""

OMEGA = float(np.sqrt(STIFFNESS / MASS))

MODEL = f"""<robot name="mass">
  <link name="world"/>
  <link name="body">
    <inertial><mass value="{MASS}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="x" type="prismatic">
    <parent link="world"/><child link="body"/><axis xyz="1 0 0"/>
    <limit lower="-5" upper="5" velocity="20" effort="50"/>
  </joint>
</robot>
"""

TASK = f"""name: thrown
robot: {{model: model.urdf}}
ground: {{walls: {{wall: {{x: {WALL}, side: left, friction: 0}}}}}}
contacts:
  nose: {{frame: body, surface: wall, stiffness: {STIFFNESS}}}
horizon: {{duration: 1, intervals: 10}}
initial: {{velocity: {{x: {SPEED}}}}}
goal:
  configuration: {{x: 0}}
  velocity: {{x: -2.9}}
  tolerance: {{configuration: {{x: 0.001}}, velocity: {{x: 0.001}}}}
costs: {{configuration: {{}}, velocity: {{}}, control: {{x: 1}}, terminal_configuration: {{}}, terminal_velocity: {{}}}}
"""


def mass(damping: float) -> tuple[MultibodyDynamics, list[Contact], list[CompliantContact]]:
    """m x'' = u before a spring at x = 1 m, with a rigid wall far to the left."""
    q, v, u = (ca.SX.sym(name) for name in "qvu")
    dynamics = MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=v,
        mass_matrix=MASS * ca.SX.eye(1),
        force=u,
        configuration_names=["x"],
        velocity_names=["x"],
        control_names=["push"],
    )
    nothing = ca.SX(ca.DM.zeros(1))
    spring = CompliantContact(Contact("spring", WALL - q, ca.SX(-1), nothing, 0.0), STIFFNESS, damping)
    return dynamics, [Contact("wall", q + FAR, ca.SX(1), nothing, 0.0)], [spring]


@cache
def thrown(damping: float) -> tuple[PhysicalMotion, Branch, list[Element]]:
    """The mass against the spring and back, for 0.8 s, as the planner finds it."""
    dynamics, contacts, compliant = mass(damping)
    return driven(dynamics, contacts, [0.0, SPEED], [0.0], 0.8, 8, compliant, stages=7)


def contact_of(damping: float) -> tuple[float, float, float]:
    """Return when a spring and damper begin and cease to push the mass, s, and its velocity then, m/s.

    They begin at the distance d v / k, where the relief is zero, and cease where it is zero again.
    """
    begin = (WALL - damping * SPEED / STIFFNESS) / SPEED
    decay = damping / (2 * MASS)
    swing = np.sqrt(OMEGA**2 - decay**2)
    start = -damping * SPEED / STIFFNESS

    def depth(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sine, cosine, fades = np.sin(swing * t), np.cos(swing * t), np.exp(-decay * t)
        b = (SPEED + decay * start) / swing
        value = fades * (start * cosine + b * sine)
        return value, fades * ((b * swing - decay * start) * cosine - (start * swing + decay * b) * sine)

    # The relief k depth + d depth' obeys the oscillator's equation, too, so it is zero again half a swing later.
    end = np.pi / swing
    return begin, begin + end, float(depth(np.array(end))[1])


@pytest.mark.parametrize("damping", [0.0, DAMPING])
def test_a_simulated_mass_stays_at_a_spring_for_half_a_swing(damping: float, tmp_path: Path) -> None:
    """Simulated, contact lasts pi / omega to 1e-8 s, with damping that of the damped oscillator, and the mass leaves at
    its speed to 1e-7 m/s; without damping it is v / omega deep."""
    motion = simulate(
        load_task(task(tmp_path, TASK.replace("stiffness", f"damping: {damping}, stiffness"))), {"x": 0.0}
    )
    begin, end, speed = contact_of(damping)
    first, last = motion.switches
    assert (first.kind, last.kind) == ("touchdown", "takeoff")
    assert [first.time, last.time] == pytest.approx([begin, end], abs=1e-8)
    assert motion.trajectory.velocity["x"][-1] == pytest.approx(speed, abs=1e-7)
    assert motion.outcome is not None
    (push,) = motion.outcome.contacts["nose"].pushes
    if not damping:
        assert end - begin == pytest.approx(np.pi / OMEGA, abs=1e-12)
        assert push.depth == pytest.approx(SPEED / OMEGA, abs=1e-6)
    assert set(motion.audit.violations) <= {"max_goal_violation"}
    assert motion.impulses == []


def test_the_depth_at_a_spring_is_that_of_the_formula(tmp_path: Path) -> None:
    """The simulated mass turns round v / omega deep, to 1e-8 m, where half of the contact's time has passed."""
    half = np.pi / OMEGA / 2 + WALL / SPEED
    own = TASK.replace("duration: 1, intervals: 10", f"duration: {half!r}, intervals: 1")
    motion = simulate(load_task(task(tmp_path, own)), {"x": 0.0})
    assert motion.trajectory.configuration["x"][-1] == pytest.approx(WALL + SPEED / OMEGA, abs=1e-8)
    assert motion.trajectory.velocity["x"][-1] == pytest.approx(0, abs=1e-8)
    assert motion.contacts["nose"].normal_force[-1] == pytest.approx(STIFFNESS * SPEED / OMEGA, abs=1e-6)


@pytest.mark.parametrize("damping", [0.0, DAMPING])
def test_the_planner_s_dynamics_switch_exactly(damping: float) -> None:
    """Their contact begins and ends when the formula says, to 1e-8 s, the mass leaves at its speed to 1e-8 m/s, and the
    force is that of the law at every sample."""
    motion, branch, _ = thrown(damping)
    assert motion.compliance is not None
    begin, end, speed = contact_of(damping)
    first, last = motion.compliance.switches
    assert (first.kind, last.kind) == ("touchdown", "takeoff")
    assert first.time == pytest.approx(begin, abs=1e-8)
    assert last.time == pytest.approx(end, abs=1e-8)
    assert motion.velocity[-1, 0] == pytest.approx(speed, abs=1e-8)
    relief = STIFFNESS * (WALL - motion.configuration[:, 0]) - damping * motion.velocity[:, 0]
    np.testing.assert_allclose(motion.compliance.force[:, 0], np.maximum(-relief, 0), atol=1e-9)
    assert contact_modes(branch, 0)["spring"] is ContactMode.FLIGHT
    assert {contact_modes(branch, e)["spring"] for e in range(len(branch.factors))} == {
        ContactMode.FLIGHT,
        ContactMode.TOUCH,
    }


@cache
def planned(folder: Path, *changes: str) -> Plan:
    """A plan in which the mass comes back from the spring almost as fast as it went there."""
    return plan(load_task(task(folder, TASK), changes))


@pytest.mark.parametrize("changes", [(), ("method.grid=uniform",), ("method.contact=impulses",)])
def test_a_plan_bounces_off_a_spring(changes: tuple[str, ...], tmp_path: Path) -> None:
    """It hardly costs more than the throw alone, is driven again to 1e-6 m and s, and pulls nowhere."""
    found = planned(tmp_path, *changes)
    assert found.status.solved and found.status.b_stationary == "certified"
    assert found.statistics.objective < 0.2
    assert [one.kind for one in found.switches] == ["touchdown", "takeoff"]
    begin, end = (one.time for one in found.switches)
    assert end - begin == pytest.approx(np.pi / OMEGA, rel=0.01)
    nose = found.contacts["nose"]
    assert (nose.normal_force >= 0).all()
    np.testing.assert_allclose(nose.normal_force, np.maximum(-STIFFNESS * nose.gap, 0), atol=1e-6)
    assert found.replay is not None
    assert found.replay.event_difference < 1e-6 and found.replay.unmatched_events == 0
    assert (found.audit.max_compliant_force_error or 0.0) < 1e-8


def test_the_audit_sees_a_force_that_no_spring_has(tmp_path: Path) -> None:
    """A newton more at one sample is found, with its contact and its time."""
    motion = formulate(load_task(task(tmp_path, TASK)), driven=False)
    physics = numeric_physics(motion)
    schedule = ControlSchedule(np.array([0.0, 1.0]), np.zeros((1, 1)))
    ends = motion.endpoints
    driven_mass = drive(physics, ends.initial_configuration, ends.initial_velocity, schedule)
    found = driven_motion(driven_mass, physics, schedule, 1)
    assert found.compliance is not None
    assert (motion_audit(motion, found, physics, None).max_compliant_force_error or 0.0) < 1e-9
    force, sample = found.compliance.force.copy(), int(np.argmax(found.compliance.force[:, 0]))
    force[sample, 0] += 1.0
    audit = motion_audit(motion, replace(found, compliance=replace(found.compliance, force=force)), physics, None)
    assert audit.max_compliant_force_error == pytest.approx(1.0, abs=1e-9)
    (finding,) = [one for one in audit.findings if one.entry == "max_compliant_force_error"]
    assert "nose" in finding.sentence and finding.time == pytest.approx(found.time[sample])


def test_feedback_knows_the_spring(tmp_path: Path) -> None:
    """A mass that is thrown a tenth faster than planned comes back much nearer to the plan with feedback."""
    found = planned(tmp_path)
    motion = formulate(task_of(found))
    physics, errors = numeric_physics(motion), []
    for controller in (
        Tracker(found, motion=motion),
        Tracker(found, feed_forward(found, motion=motion), motion=motion),
    ):
        q, v = motion.endpoints.initial_configuration, 1.1 * motion.endpoints.initial_velocity
        for k in range(100):
            u = controller.action(0.01 * k, q, v, np.zeros(0, dtype=bool))
            end = replay_motion(physics, q, v, u, 0.01)
            q, v = end.configuration, end.velocity
        errors.append(max(abs(q[0]), abs(v[0] + 2.9)))
    assert errors[0] < 0.1 * errors[1]


@pytest.mark.parametrize(
    ("before", "after", "key", "words"),
    [
        ("stiffness: 200.0", "damping: 3", "contacts.nose.damping", "stiffness (N/m) beside it"),
        ("stiffness: 200.0", "stiffness: 0", "contacts.nose.stiffness", "greater than 0"),
        ("stiffness: 200.0", "stiffness: 200, friction: 0.5", "contacts.nose.friction", "expected friction: 0"),
        (
            "stiffness: 200.0",
            "stiffness: 200, restitution: 0.5",
            "contacts.nose.restitution",
            "expected restitution: 0",
        ),
        ("stiffness: 200.0", "stiffness: 200, slipping: forbidden", "contacts.nose.slipping", "has no friction"),
        ("initial: {", "initial: {stand_on: [nose], ", "initial.stand_on", "expected a contact without stiffness"),
        ("horizon:", "method: {formulation: {type: steps}}\nhorizon:", "method.formulation.type", "'multipliers'"),
    ],
)
def test_what_a_compliant_contact_is_not_is_said_in_a_sentence(
    before: str, after: str, key: str, words: str, tmp_path: Path
) -> None:
    """The message names the key, what was found and what would be valid."""
    assert before in TASK
    with pytest.raises(TaskError) as error:
        simulate(load_task(task(tmp_path, TASK.replace(before, after))), {"x": 0.0})
    assert key in str(error.value) and words in str(error.value)


def task(folder: Path, text: str) -> Path:
    """Write a task with the model of a mass on a rail."""
    (folder / "model.urdf").write_text(MODEL, encoding="utf-8")
    path = folder / "task.yaml"
    path.write_text(text, encoding="utf-8")
    return path
