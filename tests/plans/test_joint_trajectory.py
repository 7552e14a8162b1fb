"""A plan as a ROS message: one point at a time, all joints by name, efforts if asked for, and what cannot be one."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

from fesd_robot.errors import FesdRobotError, PlanFileError
from fesd_robot.plans import Plan, export, joint_trajectory
from fesd_robot.plans.columns import CONTROL_CONVENTION, columns_of
from fesd_robot.plans.outcome import GoalEntry, Outcome


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


def test_all_joints_of_the_model_have_efforts(plan: Plan) -> None:
    """By default the joints are those of the model file; the effort of each, where asked for, is what controls give."""
    message = joint_trajectory(plan, effort=True)
    assert message["joint_names"] == ["root_x", "root_z", "root_pitch", "leg"]
    starts, pitch = plan.controls["time"], plan.trajectory.configuration["root_pitch"]
    assert np.abs(pitch).max() == 0
    for point in message["points"]:
        interval = max(int(np.searchsorted(starts, seconds(point) - 1e-9)) - 1, 0)
        torque, force = (plan.controls[name][interval] for name in ("reaction_torque", "leg_force"))
        assert point["effort"] == pytest.approx([0, force, torque, force], abs=1e-12)
        assert point["accelerations"] == []


def test_tables_and_message_agree(plan: Plan) -> None:
    """Positions, velocities and efforts are those of the CSV columns at the same samples."""
    columns, message = columns_of(plan), joint_trajectory(plan, effort=True)
    last = np.append(np.diff(plan.trajectory.time) > 0, True)
    for k, name in enumerate(message["joint_names"]):
        unit = plan.units.configuration[name]
        for part, key, of in (
            ("position", "positions", unit),
            ("velocity", "velocities", f"{unit}/s"),
            ("effort", "effort", "N" if unit == "m" else "N m"),
        ):
            assert columns[f"joint {name} {part} [{of}]"][last].tolist() == [p[key][k] for p in message["points"]]


AT_REST, SLOWED = 1.0e-7, 0.008
"""What ROS 2's joint_trajectory_controller takes for rest at the end, and a speed within the tolerance of the goal."""


@pytest.mark.parametrize(
    ("speed", "tolerance", "rests", "words"),
    [
        (0.0, None, True, "the robot ends at rest"),
        (0.3, 0.01, False, "the robot does not end at rest: leg moves at 0.3 m/s"),
        (SLOWED, None, False, "the robot does not end at rest: leg moves at 0.008 m/s"),
        (
            SLOWED,
            0.01,
            True,
            "the robot ends at rest within the tolerance of its goal (leg moves at 0.008 m/s); the last velocities are "
            "written as zero",
        ),
    ],
)
def test_an_end_at_rest_is_one(
    plan: Plan, caplog: pytest.LogCaptureFixture, speed: float, tolerance: float | None, rests: bool, words: str
) -> None:
    """Last velocities are zero where the plan rests within the tolerance of its goal, which the first line of the file
    says; else no number is changed, and a warning says so."""
    stopped = ending_with(plan, speed, tolerance)
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        first, second, *_ = export(stopped, "joint-trajectory").decode().splitlines()
    assert first == f"# drop: {words}" and second == "header:"
    assert ("does not end at rest" in caplog.text) == (not rests)
    last = joint_trajectory(stopped, ["leg"])["points"][-1]["velocities"][0]
    assert last == (0.0 if rests else speed)


def ending_with(plan: Plan, speed: float, tolerance: float | None) -> Plan:
    """Return a plan whose leg moves at a speed at the end, where the goal allows a tolerance if there is one."""
    trajectory, full = plan.trajectory, plan.full_model
    assert full is not None
    velocity = {name: np.append(values[:-1], speed * (name == "leg")) for name, values in trajectory.velocity.items()}
    joints = {
        name: joint.model_copy(update={"velocity": np.append(joint.velocity[:-1], speed * (name == "leg"))})
        for name, joint in full.joints.items()
    }
    entries = [
        GoalEntry(
            name=f"{name} velocity",
            kind="velocity",
            unit="m/s",
            goal=0.0,
            end=float(values[-1]),
            missed_by=float(abs(values[-1])),
            tolerance=tolerance,
        )
        for name, values in velocity.items()
    ]
    return plan.model_copy(
        update={
            "trajectory": trajectory.model_copy(update={"velocity": velocity}),
            "full_model": full.model_copy(update={"joints": joints}),
            "outcome": Outcome(goal=entries, contacts={}),
        }
    )


def test_a_controller_takes_the_message_as_it_is(plan: Plan) -> None:
    """The checks of ROS 2's joint_trajectory_controller with its defaults, of `validate_trajectory_msg`: no efforts,
    times that increase, and no velocity at the end."""
    for message in (joint_trajectory(ending_with(plan, SLOWED, 0.01)), joint_trajectory(ending_with(plan, 0.0, None))):
        joints = len(message["joint_names"])
        assert all(abs(v) <= AT_REST for v in message["points"][-1]["velocities"])
        assert (np.diff([seconds(point) for point in message["points"]]) > 0).all()
        for point in message["points"]:
            assert len(point["positions"]) == len(point["velocities"]) == joints
            assert point["accelerations"] == point["effort"] == []


def test_efforts_come_with_what_they_mean(plan: Plan) -> None:
    """Where efforts are asked for the file says which controls a sample has."""
    text = export(plan, "joint-trajectory", effort=True).decode()
    assert text.splitlines()[1] == f"# {CONTROL_CONVENTION}"
    with pytest.raises(PlanFileError, match=r"found efforts for format 'csv', .*; expected joint-trajectory"):
        export(plan, "csv", effort=True)


def test_what_a_controller_should_know_is_reported(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """A plan that is not solved is warned of."""
    status = plan.status.model_copy(update={"solved": False, "message": "Not solved."})
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        joint_trajectory(plan.model_copy(update={"status": status}))
    assert "drop is not solved" in caplog.text


def test_joints_that_are_none(plan: Plan) -> None:
    """An unknown joint names the nearest one, a joint twice is refused, and a plan that does not say how they move."""
    with pytest.raises(
        FesdRobotError, match=r"found 'legg', expected a joint of the model of drop \(did you mean 'leg'"
    ):
        joint_trajectory(plan, ["legg"])
    with pytest.raises(FesdRobotError, match="a joint twice"):
        joint_trajectory(plan, ["leg", "leg"])
    with pytest.raises(FesdRobotError, match="found a plan without the joints of the model file"):
        joint_trajectory(plan.model_copy(update={"full_model": None}))


def test_a_clock_that_steps_back_cannot_be_followed(plan: Plan) -> None:
    """An unfinished iterate whose times decrease is refused."""
    trajectory = plan.trajectory.model_copy(update={"time": plan.trajectory.time[::-1]})
    with pytest.raises(FesdRobotError, match="its clock steps back"):
        joint_trajectory(plan.model_copy(update={"trajectory": trajectory}))
