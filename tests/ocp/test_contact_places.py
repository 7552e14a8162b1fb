"""Contacts away from frames and on the shapes of bodies: the places that touch, here and wherever a task names them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import CircleContact, PointContact, Task, load_task

ROBOT = """
<mujoco>
  <worldbody>
    <body name="trunk" pos="0 0 0.5">
      <freejoint/>
      <geom name="trunk" type="box" size="0.2 0.1 0.1" mass="2"/>
      <body name="leg" pos="0 0 -0.1">
        <joint name="hip" axis="0 1 0" range="-60 60"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" contype="0" conaffinity="0"/>
        <body name="sole" pos="0 0 -0.3">
          <joint name="ankle" axis="0 1 0" range="-60 60"/>
          <geom name="sole" type="box" size="0.1 0.05 0.02" pos="0.03 0 -0.02" friction="0.6"/>
          <geom name="heel" type="capsule" fromto="-0.05 -0.05 0 -0.05 0.05 0" size="0.01" friction="0.6"/>
          <geom name="mesh" type="ellipsoid" size="0.01 0.01 0.02" contype="0" conaffinity="0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="hip" ctrlrange="-20 20"/><motor joint="ankle" ctrlrange="-20 20"/></actuator>
</mujoco>
"""

TASK = """
name: hop
robot: {model: robot.xml, root: sagittal}
contacts:
  foot: {body: sole}
horizon: {duration: 0.5, intervals: 10}
initial: {configuration: {root_z: 0.6}, stand_on: [foot]}
goal: {configuration: {root_x: 0.1}, stand_on: {contacts: [foot], adjust: [root_z, ankle]}}
constraints:
  hole: {type: forbidden_zone, contact: foot, x: [0.3, 0.4]}
costs: {slipping: {foot: 3}}
"""

Write = Callable[[str], Task]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    (tmp_path / "robot.xml").write_text(ROBOT)

    def load_text(text: str) -> Task:
        (tmp_path / "task.yaml").write_text(text)
        return load_task(tmp_path / "task.yaml", ["method.grid=uniform"])

    return load_text


def _gaps(motion: MotionProblem) -> np.ndarray:
    import casadi as ca

    gaps = ca.Function("gaps", [motion.dynamics.configuration], [ca.vertcat(*[one.gap for one in motion.contacts])])
    draw = np.random.default_rng(0)
    return np.array([gaps(draw.normal(size=motion.robot.model.nq)).full().ravel() for _ in range(3)])


def test_the_soles_corners_are_contacts(write: Write) -> None:
    """A flat foot touches with two corners, and the task names both wherever it names the foot."""
    task = formulate(write(TASK)).task
    assert list(task.contacts) == ["foot_1", "foot_2"]
    assert [one.offset for one in task.contacts.values()] == [(-0.07, 0, -0.04), (0.13, 0, -0.04)]
    assert all(isinstance(one, PointContact) and one.frame == "sole" for one in task.contacts.values())
    assert task.goal.stand_on.contacts == ["foot_1", "foot_2"]
    assert {name: one.contact for name, one in task.constraints.items()} == {"hole_1": "foot_1", "hole_2": "foot_2"}
    assert task.costs.slipping == {"foot_1": 3, "foot_2": 3}


def test_the_robot_stands_flat_on_its_soles(write: Write) -> None:
    """`stand_on` with the name of the body brings all its corners to the ground."""
    motion = formulate(write(TASK))
    ends = motion.endpoints
    height = ends.initial_configuration[motion.robot.configuration_names.index("root_z")]
    assert height == pytest.approx(0.1 + 0.3 + 0.04)


def test_places_of_a_body_are_offsets(write: Write) -> None:
    """Contacts of a body are the same as those with the offsets of its corners written down, and may be read again."""
    body = formulate(write(TASK))
    corners = "back: {frame: sole, offset: [-0.07, 0, -0.04]}\n  front: {frame: sole, offset: [0.13, 0, -0.04]}"
    text = TASK.replace("foot: {body: sole}", corners).replace("contact: foot", "contact: front")
    text = text.replace("[foot]", "[back, front]").replace("foot: 3", "front: 3")
    written = formulate(write(text))
    assert _gaps(body) == pytest.approx(_gaps(written), abs=1e-12)
    again = Task.model_validate(body.task.model_dump(mode="json")).with_origins(body.task.origins)
    assert _gaps(formulate(again)) == pytest.approx(_gaps(body), abs=1e-12)


@pytest.mark.parametrize(
    ("edit", "friction"),
    [("", 0.6), ("ground: {friction: 0.3}\n", 0.3), ("foot: {body: sole, friction: 0.9}", 0.9)],
)
def test_friction_is_the_contacts_the_grounds_or_the_files(write: Write, edit: str, friction: float) -> None:
    """What the task says comes first, then the coefficient of the shape in its file."""
    text = TASK.replace("foot: {body: sole}", edit) if edit.startswith("foot") else TASK + edit
    assert {one.friction for one in formulate(write(text)).contacts} == {friction}


def test_circles_have_offsets_too(write: Write) -> None:
    """A circle at an offset is above the ground by its centre's height less its radius."""
    text = TASK.replace("{body: sole}", "{type: circle, frame: leg, offset: [0, 0, -0.3], radius: 0.05}")
    motion = formulate(write(text))
    assert isinstance(motion.task.contacts["foot"], CircleContact)
    height = motion.endpoints.initial_configuration[motion.robot.configuration_names.index("root_z")]
    assert height == pytest.approx(0.1 + 0.3 + 0.05)


@pytest.mark.parametrize(
    ("edit", "line", "key", "words"),
    [
        (("body: sole", "body: soul"), 5, "contacts.foot.body", "did you mean 'sole'"),
        (("body: sole", "body: leg"), 5, "contacts.foot.body", "without collision shapes, expected one of sole, trunk"),
        (("body: sole", "body: sole, radius: 0.1"), 5, "contacts.foot.radius", "valid: body, damping, friction"),
        (("stand_on: [foot]", "stand_on: [foto]"), 7, "initial.stand_on.0", "did you mean 'foot'"),
        (("{body: sole}", "{body: sole}\n  foot_2: {frame: leg}"), 6, "contacts.foot_2", "one of the places of 'foot'"),
    ],
)
def test_mistakes_are_located(write: Write, edit: tuple[str, str], line: int, key: str, words: str) -> None:
    """Each mistake is one error with file, line and key that says what would be valid."""
    with pytest.raises(TaskError) as caught:
        formulate(write(TASK.replace(*edit)))
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    assert words in caught.value.message


def test_a_swing_clearance_of_a_body_is_that_of_its_places(write: Write) -> None:
    """All corners of a sole keep the height; other keys of `stand_on` stay."""
    text = TASK.replace(
        "constraints:\n", "constraints:\n  up: {type: swing_clearance, contacts: [foot], height: 0.02}\n"
    )
    text = text.replace("adjust: [root_z, ankle]", "adjust: [root_z], prefer: {ankle: 0.0}")
    task = formulate(write(text)).task
    assert task.constraints["up"].contacts == ["foot_1", "foot_2"]
    assert task.goal.stand_on.contacts == ["foot_1", "foot_2"] and task.goal.stand_on.prefer == {"ankle": 0.0}
