"""Bodies of a task: what of them becomes of the robot, and what is wrong with them in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot import load_task
from fesd_robot.errors import TaskError
from fesd_robot.explanation.problem import explanation
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate, load_task_robot

MODELS = Path(__file__).parents[2] / "models"

TASK = f"""name: bodies
robot: {{model: {MODELS}/gripper/gripper.urdf, locked: {{box_x: 2, box_z: 1, box_pitch: 0}}}}
bodies:
  crate: {{type: box, size: [0.1, 0.3, 0.2], mass: 0.5, root: sagittal}}
  stop: {{type: ball, radius: 0.1, root: fixed, position: {{x: 1, z: 0.1}}}}
contacts:
  floor: {{body: crate}}
  push: {{type: circle_box, frame: right_finger, radius: 0.03, other_frame: crate}}
  end: {{type: circle_circle, frame: right_finger, radius: 0.03, other_frame: stop}}
horizon: {{duration: 1, intervals: 4}}
initial: {{configuration: {{lift: 0.1, right: 0.05, crate.root_x: 0.2}}, stand_on: [floor]}}
goal: {{configuration: {{crate.root_x: 0.5}}}}
"""


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the task with replacements."""
    text = TASK
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    file = folder / "task.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_body_stands_by_its_own_height_and_pitch(tmp_path: Path) -> None:
    """Contacts of a body bring that body to the ground, and what it is called is known everywhere."""
    motion = formulate(load_task(written(tmp_path), ["method.grid=uniform"]))
    start = dict(zip(motion.robot.configuration_names, motion.endpoints.initial_configuration, strict=True))
    assert start["crate.root_z"] == pytest.approx(0.1) and start["crate.root_pitch"] == 0.0
    assert set(start) == {"lift", "left", "right", "crate.root_x", "crate.root_z", "crate.root_pitch"}
    assert not motion.in_space and motion.actuation.names == ["lift", "left", "right"]
    geometries = motion.scene.geometries
    assert geometries["push"].other_size == (0.1, 0.2) and geometries["end"].other_radius == 0.1
    assert motion.task.costs.terminal_configuration is not None
    words = explanation(motion, Transcription(motion.ocp, motion.fesd).problem)
    assert "Body 'crate': a box of 0.1 x 0.3 x 0.2 m, root sagittal; 0.5 kg." in " ".join(words.split())


@pytest.mark.parametrize(
    ("old", "new", "key", "fragment"),
    [
        (", mass: 0.5, root: sagittal", ", mass: 0.5", "bodies.crate.root", "this key is missing"),
        (", mass: 0.5, root: sagittal", ", root: sagittal", "bodies.crate.mass", "no mass of a body that moves"),
        ("radius: 0.1, root: fixed", "radius: 0.1, mass: 1, root: fixed", "bodies.stop.mass", "does not matter"),
        ("root: sagittal", "root: sagittal, position: {x: 1}", "bodies.crate.position.x", "one along y only"),
        ("root: sagittal", "root: free_flyer, position: {x: 1}", "bodies.crate.position.x", "where the body starts"),
        ("type: ball", "type: bal", "bodies.stop.type", "did you mean 'ball'?"),
        ("[0.1, 0.3, 0.2]", "[0.1, 0.3]", "bodies.crate.size", "three lengths greater than 0"),
        ("  stop:", "  st.op:", "bodies.st.op", "letters, digits and '_'"),
        ("  stop:", "  left:", "bodies.left", "beside a robot with the joint 'left'"),
        ("{type: ball, radius: 0.1, ", "{model: bal.urdf, ", "bodies.stop.model", "there is no file"),
        ("root: sagittal", "root: sagittal, damping: {root_y: 1}", "bodies.crate.damping.root_y", "expected a joint"),
        ("crate.root_x: 0.2", "crat.root_x: 0.2", "initial.configuration.crat.root_x", "did you mean 'crate.root_x'?"),
        ("frame: crate}", "frame: crate.corner}", "contacts.push.other_frame", "expected a frame"),
        ("frame: stop}", "frame: left_finger}", "contacts.end.other_radius", "is no body of type ball"),
        ("frame: crate}", "frame: left_finger}", "contacts.push.other_size", "is no body of type box"),
        ("frame: crate}", "frame: crate, facing: x}", "contacts.push.facing", "has one tangent only"),
        ("frame: crate}", "frame: crate, other_size: [1, 1, 1]}", "contacts.push.other_size", "expected 2"),
        ("crate.root_x: 0.2", "crate.root_x: 0.1", "initial.configuration", "overlapping by 0.03 m"),
    ],
)
def test_a_mistake_is_one_sentence(tmp_path: Path, old: str, new: str, key: str, fragment: str) -> None:
    """File, line and key, what was found, and what would be valid."""
    file = written(tmp_path, (old, new))
    line = next(n for n, text in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1) if new in text)
    with pytest.raises(TaskError) as caught:
        formulate(load_task(file, ["method.grid=uniform"]))
    error = caught.value
    assert (error.file, error.line, error.key) == (file, line, key), str(error)
    assert fragment in error.message and "\n" not in str(error)


def test_what_belongs_to_joints_of_a_body(tmp_path: Path) -> None:
    """Properties that the section of a body gives to its own joints are on the joints beside the robot, alone."""
    section = "root: sagittal, damping: {root_x: 0.3}, dry_friction: {root_pitch: 0.1}"
    _, robot = load_task_robot(load_task(written(tmp_path, ("root: sagittal", section)), ["method.grid=uniform"]))
    damping = dict(zip(robot.velocity_names, robot.model.damping, strict=True))
    assert {name for name, value in damping.items() if value} == {"crate.root_x"}
    assert robot.dry_friction == {"crate.root_pitch": 0.1}


def test_an_articulated_body_has_its_joints_and_motors(tmp_path: Path) -> None:
    """A model file beside the robot: what it locks is no coordinate, what it drives is a control of its name."""
    arm = f"  arm: {{model: {MODELS}/pushing_arm/pushing_arm.urdf, root: fixed, locked: {{box_x: 3, box_z: 3}}}}\n"
    motion = formulate(load_task(written(tmp_path, ("contacts:\n", f"{arm}contacts:\n")), ["method.grid=uniform"]))
    assert motion.actuation.names == ["lift", "left", "right", "arm.shoulder", "arm.elbow"]
    assert motion.robot.configuration_names[-3:] == ["arm.box_pitch", "arm.shoulder", "arm.elbow"]
