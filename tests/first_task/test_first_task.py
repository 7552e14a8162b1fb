"""First tasks for robots as they are found: feet where the robot has them, standing on the ground, able to move."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.first_task import propose_first_task
from fesd_robot.ocp import formulate
from fesd_robot.ocp.formulation import MotionProblem
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "models"
MUJOCO = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"

FEET = {
    str(MODELS / "hopper" / "hopper.urdf"): {"foot": "foot"},
    str(MODELS / "monoped" / "monoped.urdf"): {"foot": "foot"},
    str(MODELS / "biped" / "biped.urdf"): {"foot": "left_foot"},
    str(MODELS / "block" / "block.urdf"): {"front": "front", "hind": "rear"},
    str(MODELS / "wheel" / "wheel.urdf"): {"rim": "wheel"},
    str(MUJOCO / "hopper.xml"): {"foot_1": "foot", "foot_2": "foot"},
    str(MUJOCO / "walker2d.xml"): {"foot_1": "foot", "foot_2": "foot"},
    str(MUJOCO / "half_cheetah.xml"): {"front": "ffoot", "hind": "bfoot"},
    "solo12": {"front": "FL_FOOT", "hind": "HL_FOOT"},
    "a1": {"front": "FL_foot", "hind": "RL_foot"},
    "go2": {"front": "FL_foot", "hind": "RL_foot"},
    "anymal": {"front": "LF_FOOT", "hind": "LH_FOOT"},
    "bolt": {"foot": "FL_FOOT"},
    "hyq": {"front": "lf_foot", "hind": "lh_foot"},
}
"""Robot -> name of a contact -> its frame."""


def _formulated(robot: str, folder: Path) -> MotionProblem:
    name, text = propose_first_task(robot, folder)
    file = folder / f"{name}.yaml"
    file.write_text(text, encoding="utf-8")
    return formulate(load_task(file))


@pytest.mark.parametrize("robot", FEET, ids=lambda robot: Path(robot).name)
def test_feet_are_found_and_stand(robot: str, tmp_path: Path) -> None:
    """Contacts are the robot's feet, closed at start and goal, where the robot is further on; inside all limits."""
    motion = _formulated(robot, tmp_path)
    contacts = motion.task.single_contacts
    assert {name: contact.frame for name, contact in contacts.items()} == FEET[robot]
    start, goal = motion.task.initial.configuration, motion.task.goal.configuration
    forward = next(name for name in goal if name in ("root_x", "rootx"))
    assert goal[forward] - start.get(forward, 0.0) > 0.02
    for state in (motion.endpoints.initial_configuration, motion.endpoints.goal_configuration):
        assert np.abs(numeric_physics(motion).gaps(state)).max() < 1e-8


def test_a_shank_with_a_ball_at_its_end_is_a_leg(tmp_path: Path) -> None:
    """Where no link is called a foot and the last frame is the knee's, the ball is below the hip, knee bent."""
    body = '<inertial><mass value="{}"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="40" velocity="20"/>'
    (tmp_path / "leg.urdf").write_text(
        f"""<robot name="leg"><link name="trunk">{body.format(3)}</link><link name="thigh">{body.format(0.4)}</link>
        <link name="shank">{body.format(0.2)}
        <collision><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.02"/></geometry></collision></link>
        <joint name="hip" type="revolute"><parent link="trunk"/><child link="thigh"/>{joint}</joint>
        <joint name="knee" type="revolute"><parent link="thigh"/><child link="shank"/><origin xyz="0 0 -0.2"/>{joint}
        </joint></robot>""",
        encoding="utf-8",
    )
    _, text = propose_first_task(str(tmp_path / "leg.urdf"), tmp_path, root="sagittal")
    (tmp_path / "task.yaml").write_text(text, encoding="utf-8")
    start = load_task(tmp_path / "task.yaml").initial.configuration
    hip, both = start["hip"], start["hip"] + start["knee"]
    assert abs(start["knee"]) > 1.0
    assert 0.2 * (np.sin(hip) + np.sin(both)) == pytest.approx(0.0, abs=0.01)
    assert 0.2 * (np.cos(hip) + np.cos(both)) == pytest.approx(0.8 * 0.4, abs=0.01)


def test_an_arm_reaches_the_ground(tmp_path: Path) -> None:
    """The tip of ur5, which is held in the plane, begins in the air and ends on the ground."""
    motion = _formulated("ur5", tmp_path)
    assert list(motion.task.goal.standing.contacts) == ["tip"]
    assert motion.task.robot.locked == {"shoulder_pan_joint": 0, "wrist_2_joint": 0}
    physics = numeric_physics(motion)
    (high,), (low,) = (
        physics.gaps(state) for state in (motion.endpoints.initial_configuration, motion.endpoints.goal_configuration)
    )
    assert high > 0.2 and abs(low) < 1e-8


def test_what_cannot_be_guessed_can_be_given(tmp_path: Path) -> None:
    """Feet by name; and a robot for which there is no task ends in a sentence that names its file and the options."""
    _, text = propose_first_task(str(MODELS / "biped" / "biped.urdf"), tmp_path, feet=["right_foot"])
    assert "frame: right_foot" in text and "left_foot" not in text.partition("contacts:")[2].partition("#")[0]
    with pytest.raises(RobotError, match=r"pushing_arm\.urdf.*--foot.*--root"):
        propose_first_task(str(MODELS / "pushing_arm" / "pushing_arm.urdf"), tmp_path)


def test_a_model_beside_the_task_keeps_a_relative_path(tmp_path: Path) -> None:
    """So that both can be moved; a name of example-robot-data stays one."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "it.urdf").write_bytes((MODELS / "monoped" / "monoped.urdf").read_bytes())
    name, text = propose_first_task(str(tmp_path / "own" / "it.urdf"), tmp_path)
    assert name == "it_first_jump" and "model: own/it.urdf" in text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["own"]


ONE_JOINT = """<robot name="one"><link name="world"/><link name="tip"/>
<link name="body"><inertial><origin xyz="0 0 -0.3"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="moves" type="{kind}"><parent link="world"/><child link="body"/><axis xyz="{axis}"/><origin xyz="0 0 0.4"/>
<limit lower="-1" upper="1" velocity="20" effort="100"/></joint>
<joint name="end" type="fixed"><parent link="body"/><child link="tip"/><origin xyz="0 0 -0.6"/></joint></robot>"""


@pytest.mark.parametrize(
    ("kind", "axis", "refusal"),
    [
        ("prismatic", "0 0 1", None),
        ("revolute", "0 1 0", None),
        ("prismatic", "1 0 0", "found no posture in which tip touches the ground"),
        ("prismatic", "0 1 0", "cannot be held in the x-z plane"),
        ("revolute", "0 0 1", "cannot be held in the x-z plane"),
    ],
)
def test_robots_with_one_coordinate(kind: str, axis: str, refusal: str | None, tmp_path: Path) -> None:
    """One joint that brings the tip to the ground gets a task; others are refused with the reason."""
    model = tmp_path / "one.urdf"
    model.write_text(ONE_JOINT.format(kind=kind, axis=axis), encoding="utf-8")
    if refusal is None:
        assert _formulated(str(model), tmp_path).robot.velocity_names == ["moves"]
        return
    with pytest.raises(RobotError, match=refusal):
        propose_first_task(str(model), tmp_path)


@pytest.mark.parametrize("model", ["point.xml", "inverted_pendulum.xml"])
def test_robots_of_which_the_plane_leaves_one_coordinate(model: str, tmp_path: Path) -> None:
    """A body on a slide, and a cart with a pole above it, have no tip that comes down; the message says so."""
    with pytest.raises(RobotError, match="found no"):
        propose_first_task(str(MUJOCO / model), tmp_path)
