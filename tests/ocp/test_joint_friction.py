"""What a task says about the dry friction of joints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.explanation import explanation
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import Task

MODEL = """
<robot name="arm">
  <link name="base"/><link name="tip"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 2"/>
    <axis xyz="0 1 0"/><limit effort="9" velocity="20"/><dynamics friction="0.5"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="20"/></joint>
  <joint name="end" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0 0 -0.4"/></joint>
</robot>
"""

TASK = """\
name: arm
robot:
  model: arm.urdf
contacts: {tip: {frame: tip}}
horizon: {duration: 1, intervals: 2}
initial: {configuration: {shoulder.cos: 1, shoulder.sin: 0, elbow: 0}}
goal: {configuration: {elbow: 1}, soft: true}
"""

Load = Callable[[str], Task]


@pytest.fixture
def arm(load: Load, tmp_path: Path) -> Callable[..., MotionProblem]:
    """Formulate the task of an arm whose shoulder, which turns without end, has dry friction."""
    (tmp_path / "arm.urdf").write_text(MODEL, encoding="utf-8")

    def problem(robot: str = "", rest: str = "") -> MotionProblem:
        text = TASK.replace("arm.urdf\n", f"arm.urdf\n  {robot}\n") if robot else TASK
        return formulate(load(text + rest))

    return problem


def _joints(motion: MotionProblem) -> list[str | None]:
    return [one.label.joint for one in motion.contact_system.system.complementarities if one.rate_share]


def _said(motion: MotionProblem) -> str:
    return " ".join(explanation(motion, Transcription(motion.ocp, motion.fesd).problem).split())


def test_the_friction_of_the_file_is_planned(arm: Callable[..., MotionProblem]) -> None:
    """Without a word in the task the shoulder has the two conditions of its friction, and `check` says how much."""
    motion = arm()
    assert dict(motion.dynamics.dry_friction) == {"shoulder": 0.5}
    assert _joints(motion) == ["shoulder", "shoulder"]
    assert "Dry friction: shoulder 0.5 (N or N m)." in _said(motion)


def test_a_task_replaces_limits_by_name(arm: Callable[..., MotionProblem]) -> None:
    """Other joints keep theirs; zero is none."""
    motion = arm("dry_friction: {elbow: 0.2}")
    assert dict(motion.dynamics.dry_friction) == {"shoulder": 0.5, "elbow": 0.2}
    assert _joints(arm("dry_friction: {shoulder: 0}")) == []


def test_all_friction_can_be_left_out_openly(arm: Callable[..., MotionProblem]) -> None:
    """`dry_friction: false` plans without it, and what is left out is said with its size."""
    motion = arm("dry_friction: false")
    assert _joints(motion) == []
    said = _said(motion)
    assert "Left out Dry friction of joints (shoulder: 0.5; N or N m)." in said
    assert "Dry friction: shoulder" not in said


@pytest.mark.parametrize(
    ("robot", "rest", "message"),
    [
        ("dry_friction: {sholder: 1}", "", "robot.dry_friction.sholder: .*did you mean 'shoulder'"),
        ("dry_friction: {shoulder: -1}", "", "robot.dry_friction.shoulder: found -1, expected"),
        ("dry_friction: true", "", "robot.dry_friction: found true, expected"),
        ("dry_friction: 3", "", "robot.dry_friction: found 3, expected"),
        (
            "",
            "method: {formulation: {type: steps}}\n",
            "found 'steps' for a robot with dry friction in its joints \\(shoulder 0.5; N or N m\\), expected",
        ),
    ],
)
def test_what_cannot_be_is_an_error_at_its_key(
    arm: Callable[..., MotionProblem], robot: str, rest: str, message: str
) -> None:
    """A joint that there is not, a limit that is none, and the published form of contact, which has no dry friction."""
    with pytest.raises(TaskError, match=message):
        arm(robot, rest)


def test_the_published_form_works_without_it(arm: Callable[..., MotionProblem]) -> None:
    """A robot with friction in its file is planned in the step form when the task leaves that friction out."""
    assert _joints(arm("dry_friction: false", "method: {formulation: {type: steps}}\n")) == []
