"""A body turned in space: its end is the goal's orientation, and what is written about it is in roll, pitch and yaw."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import Plan, load_task, plan, read_plan, write_plan
from fesd_robot.ocp import formulate
from fesd_robot.orientations import roll_pitch_yaw
from fesd_robot.plans.columns import columns_of
from fesd_robot.plans.report_text import report
from tests.bodies_in_space import box, written

AXES = ("vx", "vy", "vz", "wx", "wy", "wz")
ANGLES = ("root_joint.roll", "root_joint.pitch", "root_joint.yaw")
GOAL = (0.3, -0.2, np.pi / 4)
"""Roll, pitch and yaw, rad."""

TASK = (
    "robot:\n  model: model.urdf\n  root: free_flyer\n  actuators:\n"
    + "".join(
        f"    {axis}: {{type: generalized_force, force: {{root_joint.{axis}: 1}}, lower: -40, upper: 40}}\n"
        for axis in AXES
    )
    + "contacts: {corner: {frame: c0}}\n"
    "horizon: {duration: 1, intervals: 6}\n"
    "initial: {configuration: {root_joint.z: 1}}\n"
    "goal: {configuration: {root_joint.z: 1, "
    + ", ".join(f"{name}: {value}" for name, value in zip(ANGLES, GOAL, strict=True))
    + "}}\n"
    "costs: {terminal_configuration: {root_joint.yaw: 0}}\n"
    "method: {compile: never, elements: 1, accuracy: 1.0e-5}\n"
    "solver: {retries: 0, effort: quick}\n"
)


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A box that turns by 45 degrees to its left, and rolls and pitches, in the air."""
    return plan(load_task(written(tmp_path_factory.mktemp("turned"), box(), TASK)))


def quaternions(result: Plan) -> np.ndarray:
    """Return the quaternions of all samples, (n, 4)."""
    return np.column_stack([result.trajectory.configuration[f"root_joint.q{axis}"] for axis in "xyzw"])


def test_it_ends_where_it_should(turned: Plan) -> None:
    """It is solved, and the rotation vector from the goal to the end is within the tolerance, as the outcome says."""
    assert turned.status.solved and turned.status.audit_passed
    end = pin.Quaternion(quaternions(turned)[-1]).toRotationMatrix()
    missed = np.abs(pin.log3(pin.rpy.rpyToMatrix(*GOAL).T @ end))
    assert missed.max() <= 0.01 + 1e-6
    assert missed.max() > 1e-4  # without a weight at the end the tolerance is used
    entries = {entry.name: entry for entry in turned.outcome.goal} if turned.outcome else {}
    for name, goal, miss in zip(ANGLES, GOAL, missed, strict=True):
        assert (entries[name].unit, entries[name].tolerance, entries[name].met) == ("rad", 0.01, True)
        assert entries[name].goal == pytest.approx(goal) and entries[name].missed_by == pytest.approx(miss, abs=1e-12)
    assert not any(name.startswith("root_joint.q") for name in entries)


def test_quaternions_have_length_one(turned: Plan) -> None:
    """At all samples and at any time between them, although the scheme's drift."""
    assert turned.audit.max_quaternion_norm_error is not None
    assert turned.audit.max_quaternion_norm_error <= 1e-14
    np.testing.assert_allclose(np.linalg.norm(quaternions(turned), axis=1), 1.0, atol=1e-14)
    at = turned.at(np.linspace(0, 1, 97)).configuration
    lengths = sum(np.asarray(at[f"root_joint.q{axis}"]) ** 2 for axis in "xyzw")
    np.testing.assert_allclose(lengths, 1.0, atol=1e-14)
    elements = turned.finite_elements
    assert elements is not None
    states = elements.states_at.reshape(-1, len(elements.states))
    drift = np.abs(np.linalg.norm(states[:, 3:7], axis=1) - 1).max()
    assert 1e-14 < drift < 1e-3


def test_its_orientation_is_the_integral_of_its_angular_velocity(turned: Plan) -> None:
    """From sample to sample the turn is that of the mean angular velocity, so that lengths made one change nothing."""
    times = np.linspace(0, 1, 2001)
    at = turned.at(times)
    q = np.column_stack([np.asarray(at.configuration[f"root_joint.q{axis}"]) for axis in "xyzw"])
    omega = np.column_stack([np.asarray(at.velocity[f"root_joint.w{axis}"]) for axis in "xyz"])
    rotation = np.eye(3)
    for k, step in enumerate(np.diff(times)):
        rotation = rotation @ pin.exp3(step * (omega[k] + omega[k + 1]) / 2)
    end = pin.Quaternion(q[-1]).toRotationMatrix()
    np.testing.assert_allclose(pin.log3(rotation.T @ end), 0.0, atol=1e-5)


def test_what_is_written_has_angles(turned: Plan, tmp_path: Path) -> None:
    """Table, page and report show roll, pitch and yaw; the table and the plan keep the quaternion, and both return."""
    columns = columns_of(turned)
    yaw = columns["root_joint.yaw [rad]"]
    assert yaw[0] == 0 and yaw[-1] == pytest.approx(np.pi / 4, abs=0.02)
    assert np.array_equal(columns["root_joint.qw [1]"], turned.trajectory.configuration["root_joint.qw"])
    assert "root_joint.yaw" in report(turned) and "root_joint.qz" not in report(turned).split("## Outcome")[1][:2000]
    again = read_plan(write_plan(turned, tmp_path / "plan"))
    assert np.array_equal(quaternions(again), quaternions(turned))
    with (tmp_path / "plan" / "trajectory.csv").open(encoding="utf-8") as stream:
        assert "root_joint.pitch [rad]" in next(csv.reader(stream))


def test_it_keeps_to_the_limit_of_an_angle(tmp_path: Path) -> None:
    """Where a waypoint asks for more roll than is allowed, the box rolls to its limit and no further."""
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.9, 0.0, 0.4)).coeffs()
    wanted = ", ".join(f"root_joint.q{axis}: {value}" for axis, value in zip("xyzw", turn, strict=True))
    lines = TASK.replace(
        "costs:",
        f"waypoints: [{{configuration: {{{wanted}}}, weight: 1000}}]\n"
        "limits: {position: {root_joint.roll: [-0.1, 0.5]}}\ncosts:",
    )
    result = plan(load_task(written(tmp_path, box(), lines)))
    assert result.status.solved and result.audit.max_position_limit_violation <= 1e-6
    roll = roll_pitch_yaw(quaternions(result))[:, 0]
    assert roll.max() == pytest.approx(0.5, abs=1e-6)


def test_solo12_turns_by_a_yaw(tmp_path: Path) -> None:
    """The goal of a quadruped that jumps and turns is one line: the same task as by its quaternion."""
    legs = ("FL", "FR", "HL", "HR")
    lines = (
        "robot: {model: example-robot-data:solo12, root: free_flyer}\n"
        "contacts:\n" + "".join(f"  {leg}: {{frame: {leg}_FOOT, slipping: forbidden}}\n" for leg in legs) + "horizon: "
        "{duration: 0.5, intervals: 10}\n"
        "initial:\n  configuration: {" + ", ".join(f"{leg}_HFE: 0.7, {leg}_KFE: -1.4" for leg in legs) + "}\n"
        "  stand_on: [FL, FR, HL, HR]\n"
        "reference: {type: jumps, count: 1, apex: {root_joint.z: 0.32}}\n"
    )
    half = 0.39 / 2
    goals = (
        "{root_joint.yaw: 0.39}",
        f"{{root_joint.qx: 0, root_joint.qy: 0, root_joint.qz: {-np.sin(half)}, root_joint.qw: {-np.cos(half)}}}",
    )
    first, second = (
        formulate(load_task(written(tmp_path, "", f"{lines}goal: {{configuration: {goal}}}\n"))) for goal in goals
    )
    np.testing.assert_allclose(first.endpoints.goal_configuration[3:7], [0, 0, np.sin(half), np.cos(half)], atol=1e-15)
    np.testing.assert_allclose(second.endpoints.goal_configuration[3:7], -first.endpoints.goal_configuration[3:7])
    assert first.task.costs == second.task.costs and first.task.goal.tolerance == second.task.goal.tolerance
    for time in (0.2, 0.4, 0.5):
        np.testing.assert_allclose(
            first.reference.configuration(time), second.reference.configuration(time), atol=1e-12
        )
