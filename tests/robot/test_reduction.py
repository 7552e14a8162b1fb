"""Locked and coupled joints: limits, drives, and what cannot be reduced."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import JointError
from fesd_robot.robot import load_robot
from fesd_robot.robot.couple import coupling_signs

SOLO = "example-robot-data:solo12"
WALKER = Path(__file__).parent / "models" / "walker.xml"

LINK = (
    '<link name="{0}"><inertial><origin xyz="0.02 0.01 -0.1"/><mass value="0.5"/><inertia ixx="0.02" iyy="0.03" '
    'izz="0.04" ixy="0" ixz="0.001" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="{1}"><origin xyz="{2}" rpy="0.3 0 0"/><parent link="{3}"/><child link="{4}"/>'
    '<axis xyz="{5}"/><limit lower="{6}" upper="{7}" velocity="{8}" effort="{9}"/><dynamics damping="{10}" '
    'friction="0.2"/></joint>'
)


@pytest.fixture
def pair(tmp_path: Path):
    """Write a robot of two arms on one shaft whose axes may be opposite, and load it."""

    def load(
        other_axis: str,
        *,
        kind: str = "revolute",
        other_kind: str = "",
        offset: str = "0 0.3 0",
        lower: float = -1.0,
        **options,
    ):
        parts = [
            *(LINK.format(name) for name in ("base", "left", "right", "hand")),
            JOINT.format("a", kind, "0 0 0", "base", "left", "0 1 0", -0.5, 2.0, 3.0, 4.0, 0.1),
            JOINT.format("b", other_kind or kind, offset, "base", "right", other_axis, lower, 0.8, 2.0, 1.5, 0.2),
            JOINT.format("grip", "prismatic", "0 0 -0.2", "right", "hand", "0 0 1", -1, 1, 1, 1, 0),
        ]
        file = tmp_path / "pair.urdf"
        file.write_text(f'<robot name="pair">{"".join(parts)}</robot>')
        return load_robot(file, **options)

    return load


ALONG = f"0 {0.3 * np.cos(0.3)} {0.3 * np.sin(0.3)}"
"""A shift along the shaft, which is turned by 0.3 rad about x."""


@pytest.mark.parametrize(("axis", "sign"), [("0 1 0", 1.0), ("0 -1 0", -1.0)])
def test_coupled_joints_are_one_motor(pair, axis, sign, assert_close):
    """Efforts, damping and friction add up, the narrower limits hold, and opposite axes turn by opposite angles."""
    robot, whole = pair(axis, offset=ALONG, coupled={"b": "a"}), pair(axis, offset=ALONG)
    assert robot.joint_names == ["a", "grip"]
    assert coupling_signs(whole.model, {"b": "a"}) == {"b": sign}
    expected = [-0.5, 0.8] if sign > 0 else [-0.5, 1.0]
    assert [robot.lower_position[0], robot.upper_position[0]] == expected
    assert (robot.velocity_limit[0], robot.upper_effort[0], robot.model.upperDryFrictionLimit[0]) == (2.0, 5.5, 0.4)
    assert robot.model.damping[0] == pytest.approx(0.3)
    q, v, a = np.random.default_rng(2).normal(size=(3, 2))
    spread = np.array([[1.0, 0.0], [sign, 0.0], [0.0, 1.0]])
    force = pin.rnea(whole.model, whole.model.createData(), spread @ q, spread @ v, spread @ a)
    assert_close(pin.rnea(robot.model, robot.model.createData(), q, v, a), spread.T @ force)


def test_sliding_joints_are_coupled_beside_each_other(pair, assert_close):
    """Two sliders are one wherever they stand, as long as they are parallel."""
    robot = pair("0 1 0", kind="prismatic", offset="0.4 0 0.1", coupled={"b": "a"})
    whole = pair("0 1 0", kind="prismatic", offset="0.4 0 0.1")
    for name in ("right", "hand"):
        poses = []
        for each, q in ((robot, [0.3, 0.2]), (whole, [0.3, 0.3, 0.2])):
            data = each.model.createData()
            pin.framesForwardKinematics(each.model, data, np.array(q))
            poses.append(data.oMf[each.frame_id(name)].homogeneous)
        assert_close(*poses)


def test_a_leader_may_come_after_its_follower(pair):
    """The order of the joints in the file does not matter; each branch stays whole."""
    robot = pair("0 1 0", offset=ALONG, coupled={"a": "b"})
    assert robot.joint_names == ["b", "grip"] and robot.model.check(robot.model.createData())


def test_a_locked_joint_keeps_its_value(assert_close):
    """The model with a joint held is the whole model at that value, shapes included."""
    held, whole = load_robot(WALKER, locked={"foot_joint": 0.3}), load_robot(WALKER)
    q = np.array([0.1, 1.3, 0.2, -0.4])
    shapes = []
    for robot, at in ((held, q), (whole, np.append(q, 0.3))):
        data, visual = robot.model.createData(), robot.visual_model.createData()
        pin.updateGeometryPlacements(robot.model, data, robot.visual_model, visual, at)
        shapes.append(np.array([pose.homogeneous for pose in visual.oMg]))
    assert_close(*shapes)
    assert held.joint_names == ["rootx", "rootz", "rooty", "thigh_joint"]


LOCKED = [
    (SOLO, "fixed", {"FL_HA": 0.0}, "FL_HA", "did you mean 'FL_HAA'"),
    (SOLO, "fixed", {"FL_HAA": np.inf}, "FL_HAA", "expected a finite value"),
    (SOLO, "fixed", {"FL_KFE": 11.0}, "FL_KFE", r"found 11, expected a value in \[-10, 10\]"),
    (SOLO, "sagittal", {"root_pitch": 0.0}, "root_pitch", "one degree of freedom"),
    (SOLO, "free_flyer", {"root_joint": 0.0}, "root_joint", "one degree of freedom"),
    (WALKER, "fixed", {"root": 0.0}, "root", "did you mean 'root"),
    ("example-robot-data:panda", "fixed", {"panda_finger_joint1": 0.0}, "panda_finger_joint1", "<mimic>"),
    ("example-robot-data:double_pendulum", "fixed", {"joint1": 0.0, "joint2": 0.0}, "joint1", "every joint locked"),
]


@pytest.mark.parametrize(("source", "root", "locked", "joint", "words"), LOCKED)
def test_what_cannot_be_locked_is_named(source, root, locked, joint, words):
    """The error holds the joint and says what would be valid."""
    with pytest.raises(JointError, match=words) as caught:
        load_robot(source, root=root, locked=locked)
    assert (caught.value.option, caught.value.joint) == ("locked", joint)


APART = "move against each other"
COUPLED = [
    ({"FR_HFE": "FL_HF"}, "FR_HFE", "did you mean 'FL_HFE'"),
    ({"FR": "FL_HFE"}, "FR", "one degree of freedom"),
    ({"FR_HFE": "HL_HFE"}, "FR_HFE", APART),
    ({"FR_KFE": "FL_KFE"}, "FR_KFE", "must be locked or coupled, too"),
    ({"FL_HFE": "FL_KFE"}, "FL_HFE", APART),
    ({"FL_KFE": "FL_HFE"}, "FL_KFE", APART),
    ({"FR_HAA": "FL_HAA"}, "FR_HAA", APART),
    ({"FR_HAA": "HR_HAA", "FL_HAA": "FR_HAA"}, "FL_HAA", "which follows another one itself"),
]


@pytest.mark.parametrize(("coupled", "joint", "words"), COUPLED)
def test_what_cannot_be_coupled_is_named(coupled, joint, words):
    """Bodies that would move against each other are not one body, and the error says which joints."""
    with pytest.raises(JointError, match=words) as caught:
        load_robot(SOLO, root="free_flyer", coupled=coupled)
    assert (caught.value.option, caught.value.joint) == ("coupled", joint)


def test_limits_without_a_common_value_are_refused(pair):
    """Two joints that can never stand at equal angles cannot be one."""
    with pytest.raises(JointError, match="share no value"):
        pair("0 -1 0", offset=ALONG, lower=0.6, coupled={"b": "a"})


def test_a_joint_without_limits_follows_but_does_not_lead_one_that_has_some(pair):
    """The (cos, sin) of a continuous joint cannot hold the other one's limits."""
    assert (
        pair("0 1 0", kind="continuous", other_kind="revolute", offset=ALONG, coupled={"a": "b"}).upper_position[0]
        == 0.8
    )
    with pytest.raises(JointError, match="other way round"):
        pair("0 1 0", kind="continuous", other_kind="revolute", offset=ALONG, coupled={"b": "a"})


def test_coupling_a_model_with_mimic_joints_is_refused():
    """What the file couples by <mimic> is not mixed with what the task couples."""
    with pytest.raises(JointError, match="<mimic>"):
        load_robot("example-robot-data:panda", coupled={"panda_joint2": "panda_joint1"})
