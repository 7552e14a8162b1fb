"""Postures of SRDF files."""

from __future__ import annotations

import math
from pathlib import Path

import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import load_robot

BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
URDF = """
<robot name="{robot}">
  <link name="trunk">{body}</link>
  <link name="leg">{body}</link>
  <link name="wheel">{body}</link>
  <joint name="hip" type="revolute">
    <parent link="trunk"/><child link="leg"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="9" velocity="9"/>
  </joint>
  <joint name="axle" type="continuous"><parent link="leg"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
</robot>
"""
STATE = '<group_state name="crouch" group="all">{}</group_state>'
VALUES = '<joint name="hip" value="0.5"/><joint name="axle" value="2.0"/><joint name="tail" value="1"/>'
PITCH = 0.3
ROOT = f'<joint name="root_joint" value="0.1 0 0.6 0 {math.sin(PITCH / 2)} 0 {math.cos(PITCH / 2)}"/>'


def written(folder: Path, states: str, *, robot: str = "one", srdf: str = "srdf/one.srdf", of: str = "one") -> Path:
    """Write urdf/one.urdf of a robot and an SRDF file of another or the same; return the first."""
    urdf, semantic = folder / "urdf" / "one.urdf", folder / srdf
    for file in (urdf, semantic):
        file.parent.mkdir(parents=True, exist_ok=True)
    urdf.write_text(URDF.format(robot=robot, body=BODY), encoding="utf-8")
    semantic.write_text(f'<robot name="{of}">{states}</robot>', encoding="utf-8")
    return urdf


def test_a_state_is_a_posture(tmp_path: Path) -> None:
    """Joints by name, a continuous one as cosine and sine; those that the URDF does not have are left out."""
    robot = load_robot(written(tmp_path, STATE.format(VALUES + ROOT)))
    expected = {"hip": 0.5, "axle.cos": math.cos(2.0), "axle.sin": math.sin(2.0)}
    assert robot.postures == {"crouch": pytest.approx(expected)}


def test_a_root_takes_the_pose_of_the_state(tmp_path: Path) -> None:
    """A sagittal root has its place and pitch, a free one position and quaternion."""
    file = written(tmp_path, STATE.format(ROOT))
    sagittal = load_robot(file, root="sagittal").postures["crouch"]
    assert sagittal == pytest.approx({"root_x": 0.1, "root_z": 0.6, "root_pitch": PITCH})
    free = load_robot(file, root="free_flyer")
    values = [free.postures["crouch"][name] for name in free.configuration_names[:7]]
    half = PITCH / 2
    assert values == pytest.approx([0.1, 0, 0.6, 0, math.sin(half), 0, math.cos(half)])


@pytest.mark.parametrize(
    ("srdf", "of", "belongs"),
    [
        ("srdf/one.srdf", "other", True),
        ("urdf/one.srdf", "other", True),
        ("srdf/two.srdf", "one", True),
        ("srdf/two.srdf", "other", False),
    ],
)
def test_which_file_belongs_to_a_robot(tmp_path: Path, srdf: str, of: str, belongs: bool) -> None:
    """One of the URDF's name, beside it or in the folder srdf, else one of the robot's name."""
    robot = load_robot(written(tmp_path, STATE.format(VALUES), srdf=srdf, of=of))
    assert list(robot.postures) == ["crouch"] * belongs


@pytest.mark.parametrize(
    ("joint", "expected"),
    [
        ('<joint name="hip" value="up"/>', "found 'up' for joint 'hip' in state 'crouch', expected a number."),
        (
            '<joint name="root_joint" value="1 2"/>',
            "found '1 2' for joint 'root_joint' in state 'crouch', expected x y z",
        ),
    ],
)
def test_values_that_are_none_are_refused(tmp_path: Path, joint: str, expected: str) -> None:
    """The message names file, joint and state."""
    with pytest.raises(RobotError, match=r"one\.srdf: ") as caught:
        load_robot(written(tmp_path, STATE.format(joint)))
    assert expected in str(caught.value)


def test_an_example_robot_stands_in_its_posture() -> None:
    """Pinocchio's own reader finds the same values in the posture of the robot a1."""
    robot = load_robot("example-robot-data:a1", root="free_flyer")
    assert robot.source is not None
    model = pin.buildModelFromUrdf(str(robot.source), pin.JointModelFreeFlyer())
    pin.loadReferenceConfigurations(model, str(robot.source.parent.parent / "srdf" / "a1.srdf"), False)
    known = dict(zip(robot.configuration_names, model.referenceConfigurations["standing"].tolist(), strict=True))
    assert robot.postures["standing"] == pytest.approx(known)
