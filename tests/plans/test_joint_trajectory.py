"""A plan as a ROS message: one point at a time, joints and efforts by name, and what cannot be one."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

from fesd_robot.errors import FesdRobotError
from fesd_robot.plans import Plan, joint_trajectory


def seconds(point: dict[str, Any]) -> float:
    time = point["time_from_start"]
    assert isinstance(time["sec"], int) and 0 <= time["nanosec"] < 1_000_000_000
    return float(time["sec"] + 1e-9 * time["nanosec"])


def test_points_are_the_samples_after_impacts(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """Times increase; the impact, which has two samples in the plan, has one point with the velocity after it."""
    time, velocity = plan.trajectory.time, plan.trajectory.velocity["leg"]
    (twice,) = np.flatnonzero(np.diff(time) == 0)
    assert velocity[twice] != velocity[twice + 1]
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        message = joint_trajectory(plan, ["leg", "root_z"])
    points = message["points"]
    assert message["joint_names"] == ["leg", "root_z"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    times = np.array([seconds(point) for point in points])
    assert (np.diff(times) > 0).all()
    np.testing.assert_allclose(times, np.unique(time), atol=1e-9)
    impact = points[twice]
    assert impact["velocities"] == [velocity[twice + 1], plan.trajectory.velocity["root_z"][twice + 1]]
    assert impact["positions"] == [plan.trajectory.configuration[name][twice + 1] for name in ("leg", "root_z")]
    assert "1 impact(s): of each only the point after it is written" in caplog.text


def test_joints_with_controls_of_their_own_have_efforts(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """By default the joints are those that a joint actuator drives; each point carries the control from then on."""
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        message = joint_trajectory(plan)
    assert message["joint_names"] == ["root_pitch"]
    starts, values = plan.controls["time"], plan.controls["reaction_torque"]
    for point in message["points"]:
        expected = [value for start, value in zip(starts, values, strict=True) if start <= seconds(point) + 1e-9][-1]
        assert point["effort"] == [expected]
    assert "left out: leg_force" in caplog.text


def test_a_joint_without_control_leaves_no_efforts(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """Efforts are for all joints or for none, as the message asks."""
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        message = joint_trajectory(plan, ["root_pitch", "leg"])
    assert all(point["effort"] == [] and point["accelerations"] == [] for point in message["points"])
    assert "no control drives leg alone" in caplog.text


def test_default_controls_are_called_like_their_joints(plan: Plan) -> None:
    """Without actuators in the task every control drives the joint of its name."""
    robot = {**plan.task["robot"], "actuators": None}
    controls = {"time": plan.controls["time"], "leg": plan.controls["leg_force"]}
    found = joint_trajectory(plan.model_copy(update={"task": {**plan.task, "robot": robot}, "controls": controls}))
    assert found["joint_names"] == ["leg"] and found["points"][0]["effort"] == [controls["leg"][0]]


def test_a_wheel_without_limits_turns_on(plan: Plan) -> None:
    """A joint written as cosine and sine becomes an angle that does not jump."""
    angle = np.linspace(0, 9, len(plan.trajectory.time))
    configuration = {"wheel.cos": np.cos(angle), "wheel.sin": np.sin(angle)}
    velocity = {"wheel": np.ones_like(angle)}
    update = {"configuration": configuration, "velocity": velocity}
    rolling = plan.model_copy(update={"trajectory": plan.trajectory.model_copy(update=update)})
    positions = [point["positions"][0] for point in joint_trajectory(rolling, ["wheel"])["points"]]
    assert positions[0] == pytest.approx(0) and positions[-1] == pytest.approx(9)
    assert max(np.diff(positions)) < np.pi


def test_what_a_controller_should_know_is_reported(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """A plan that is not solved, and joints that are no coordinates of it, are warned of."""
    status = plan.status.model_copy(update={"solved": False, "message": "Not solved."})
    robot = {**plan.task["robot"], "locked": {"neck": 0.0}, "coupled": {"right": "left"}}
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        joint_trajectory(plan.model_copy(update={"status": status, "task": {**plan.task, "robot": robot}}))
    assert "drop is not solved" in caplog.text and "left out: neck, right" in caplog.text


def test_joints_that_are_none(plan: Plan) -> None:
    """An unknown joint names the nearest one, a joint twice and no joint at all are refused."""
    with pytest.raises(FesdRobotError, match=r"found 'legg', expected a joint of drop \(did you mean 'leg'\?\)"):
        joint_trajectory(plan, ["legg"])
    with pytest.raises(FesdRobotError, match="a joint twice"):
        joint_trajectory(plan, ["leg", "leg"])
    force = {"type": "generalized_force"}
    robot = {**plan.task["robot"], "actuators": {"reaction_torque": force, "leg_force": force}}
    with pytest.raises(FesdRobotError, match=r"a single joint, .*valid: root_x, root_z, root_pitch, leg"):
        joint_trajectory(plan.model_copy(update={"task": {**plan.task, "robot": robot}}))


def test_a_clock_that_steps_back_cannot_be_followed(plan: Plan) -> None:
    """An unfinished iterate whose times decrease is refused."""
    trajectory = plan.trajectory.model_copy(update={"time": plan.trajectory.time[::-1]})
    with pytest.raises(FesdRobotError, match="its clock steps back"):
        joint_trajectory(plan.model_copy(update={"trajectory": trajectory}))
