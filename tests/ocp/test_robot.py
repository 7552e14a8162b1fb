"""What a task says about its robot: plane, locked and coupled joints, drives, damping, and mistakes in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate, load_task_robot
from fesd_robot.robot import Robot, load_scaled
from fesd_robot.task import Task

from .conftest import HOPPER

Load = Callable[[str], Task]

SOLO = """\
name: solo
robot:
  model: example-robot-data:solo12
  root: sagittal
  locked: {FL_HAA: 0, FR_HAA: 0, HL_HAA: 0, HR_HAA: 0}
  coupled:
    FR_HFE: FL_HFE
    FR_KFE: FL_KFE
    HR_HFE: HL_HFE
    HR_KFE: HL_KFE
  damping: {FL_KFE: 0.02}
  passive: [HL_KFE]
contacts:
  front: {frame: FL_FOOT}
  hind: {frame: HL_FOOT}
horizon: {duration: 0.2, intervals: 2}
initial:
  configuration: {root_z: 0.5, FL_HFE: 0.7, FL_KFE: -1.4}
limits:
  effort:
    FL_HFE: 5.4
    FL_KFE: [-2, 3]
"""


def test_a_quadruped_in_the_plane(load: Load) -> None:
    """Solo12 has three coordinates of the root and four of its legs, both feet stay in the plane."""
    problem = formulate(load(SOLO))
    names = ["root_x", "root_z", "root_pitch", "FL_HFE", "FL_KFE", "HL_HFE", "HL_KFE"]
    assert problem.dynamics.configuration_names == problem.dynamics.velocity_names == names
    assert [contact.name for contact in problem.contacts] == ["front", "hind"]
    q = problem.dynamics.configuration
    normals = ca.Function("n", [q], [contact.normal for contact in problem.contacts])
    front, hind = (np.asarray(row).ravel() for row in normals(np.linspace(0.1, 0.7, 7)))
    assert not front[5:].any() and not hind[3:5].any() and front[3] != 0 != hind[6]


def test_drives_and_their_limits(load: Load) -> None:
    """Joints of the legs are driven but the passive one, with the task's limits, the root is not."""
    actuation = formulate(load(SOLO)).actuation
    assert actuation.names == ["FL_HFE", "FL_KFE", "HL_HFE"]
    np.testing.assert_array_equal(actuation.lower, [-5.4, -2, -2000])
    np.testing.assert_array_equal(actuation.upper, [5.4, 3, 2000])
    rows = np.asarray(actuation.matrix(np.zeros(7)).full())
    np.testing.assert_array_equal(rows, np.eye(7)[:, [3, 4, 5]])


def test_damping_acts_against_the_velocity(load: Load) -> None:
    """The generalized force loses d v of the damped joint and of no other."""
    forces = []
    for text in (SOLO, SOLO.replace("  damping: {FL_KFE: 0.02}\n", "")):
        dynamics = formulate(load(text)).dynamics
        arguments = [dynamics.configuration, dynamics.velocity, dynamics.control]
        force = ca.Function("f", arguments, [dynamics.force])
        forces.append(np.asarray(force(np.full(7, 0.2), np.arange(7.0), np.zeros(3))).ravel())
    np.testing.assert_allclose(forces[0] - forces[1], [0, 0, 0, 0, -0.02 * 4, 0, 0], atol=1e-15)


def test_an_effort_limit_drives_a_joint_without_motor(short: str, load: Load) -> None:
    """A joint of the file whose effort limit is zero is driven if the task gives it one."""
    actuation = formulate(load(short + "limits: {effort: {root_pitch: 3}}\n")).actuation
    assert actuation.names == ["root_pitch", "leg"] and list(actuation.upper) == [3, 100]


def test_the_limit_of_a_written_actuator(short: str, load: Load) -> None:
    """An actuator without bounds of its own takes those of limits.effort."""
    text = short.replace("contacts:", "  actuators: {push: {type: joint, joint: root_pitch}}\ncontacts:")
    actuation = formulate(load(text + "limits: {effort: {root_pitch: [-1, 2]}}\n")).actuation
    assert (actuation.names, list(actuation.lower), list(actuation.upper)) == (["push"], [-1], [2])


def test_a_package_beside_the_task(short: str, load: Load, tmp_path: Path) -> None:
    """package://NAME/PATH is found in the folder of the task."""
    (tmp_path / "my_robot").mkdir()
    (tmp_path / "my_robot" / "hopper.urdf").write_bytes(HOPPER.read_bytes())
    _, robot = load_task_robot(load(short.replace(str(HOPPER), "package://my_robot/hopper.urdf")))
    assert robot.source == tmp_path / "my_robot" / "hopper.urdf"


def test_the_file_is_read_once(short: str, load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    """Names are checked and the armature is set on a robot that was read from its file one time."""
    reads = []

    def counted(source: Path, *arguments: Any, **options: Any) -> Robot:
        reads.append(source)
        return load_scaled(source, *arguments, **options)

    monkeypatch.setattr("fesd_robot.ocp.task_robot.load_scaled", counted)
    assert formulate(load(short)).robot.model.armature.tolist() == [0, 0, 0, 0.1]
    assert reads == [HOPPER]


ERRORS = [
    ("locked beyond its limit", ("HR_HAA: 0}", "HR_HAA: 30}"), 5, "robot.locked.HR_HAA", "[-10, 10]"),
    ("coupled across", ("FR_KFE: FL_KFE", "FR_KFE: HL_KFE"), 8, "robot.coupled.FR_KFE", "against each other"),
    (
        "damping of a follower",
        ("{FL_KFE: 0.02}", "{FR_KFE: 0.02}"),
        11,
        "robot.damping.FR_KFE",
        "'FL_KFE' for both",
    ),
    ("limit of a passive joint", ("    FL_HFE: 5.4", "    HL_KFE: 1"), 21, "limits.effort.HL_KFE", "actuator drives"),
    ("endless limit", ("[-2, 3]", "[-2, null]"), 22, "limits.effort.FL_KFE", "expected finite bounds"),
    ("limit of the root", ("    FL_HFE: 5.4", "    root_x: 1"), 21, "limits.effort.root_x", "actuator drives"),
]


@pytest.mark.parametrize(("edit", "line", "key", "fragment"), [e[1:] for e in ERRORS], ids=[e[0] for e in ERRORS])
def test_mistakes_about_the_robot_are_located(
    load: Load, edit: tuple[str, str], line: int, key: str, fragment: str
) -> None:
    """Every mistake names file, line and key, and what would be valid."""
    assert edit[0] in SOLO
    task = load(SOLO.replace(*edit, 1))
    with pytest.raises(TaskError) as caught:
        formulate(task)
    assert (caught.value.file, caught.value.line, caught.value.key) == (task.error("robot", "").file, line, key), (
        caught.value
    )
    assert fragment in caught.value.message


def test_limits_in_two_places_are_refused(short: str, load: Load) -> None:
    """An actuator's own bounds and limits.effort contradict each other, even where they agree."""
    text = short.replace("contacts:", "  actuators: {push: {type: joint, joint: leg, lower: -1, upper: 1}}\ncontacts:")
    with pytest.raises(TaskError, match="whose actuator 'push' has its own") as caught:
        formulate(load(text + "limits: {effort: {leg: 1}}\n"))
    assert caught.value.key == "limits.effort.leg"


def test_a_leg_that_steps_sideways_makes_all_contacts_those_in_space(load: Load) -> None:
    """The plane of the root is not enough: one joint that is not locked lets a foot leave it."""
    coupled = SOLO[SOLO.index("  coupled:") : SOLO.index("  damping:")]
    text = SOLO.replace(coupled, "").replace("FR_HAA: 0, HL_HAA: 0,", "FR_HAA: 0,")
    assert not any(contact.in_space for contact in formulate(load(SOLO)).contacts)
    assert all(contact.in_space for contact in formulate(load(text)).contacts)
