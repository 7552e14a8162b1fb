"""Bodies in the ground and in each other, where no contact keeps them out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from fesd_robot.ocp import formulate, load_task_robot
from fesd_robot.ocp.scene import surfaces_of
from fesd_robot.plans.overlaps import overlaps, overlaps_of_motion
from fesd_robot.recovery.motion import States
from fesd_robot.task import Task, load_task

MODEL = """\
<mujoco model="sled">
  <worldbody>
    <body name="base">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="pitch" axis="0 1 0"/>
      <geom name="hull" type="{shape}" mass="1"/>
      <site name="keel" pos="0 0 -0.2"/>
      <body name="left" pos="0 0 0.1">
        <joint name="slide_left" type="slide" axis="1 0 0"/>
        <geom name="ball" type="sphere" size="0.1" pos="0 0 0.5" mass="1"/>
      </body>
      <body name="right" pos="0 0 0.1">
        <joint name="slide_right" type="slide" axis="1 0 0"/>
        <geom name="rod" type="capsule" fromto="{rod}" size="0.05" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="x" ctrlrange="-9 9"/><motor joint="z" ctrlrange="-99 99"/></actuator>
</mujoco>
"""

SHAPES = {
    'sphere" size="0.3': lambda pitch: 0.3,
    'box" size="0.3 0.1 0.2': lambda pitch: 0.3 * abs(np.sin(pitch)) + 0.2 * np.cos(pitch),
    'capsule" size="0.1" fromto="-0.3 0 0 0.3 0 0': lambda pitch: 0.3 * abs(np.sin(pitch)) + 0.1,
    'ellipsoid" size="0.3 0.1 0.2': lambda pitch: np.hypot(0.3 * np.sin(pitch), 0.2 * np.cos(pitch)),
    'cylinder" size="0.2" fromto="0 0 -0.3 0 0 0.3': lambda pitch: 0.2 * abs(np.sin(pitch)) + 0.3 * np.cos(pitch),
}
"""Shape of the base -> its lowest point below its origin, m, by its pitch."""

BALL, APART = 'sphere" size="0.2', "0.5 -0.2 0.5 0.5 0.2 0.5"


def said(folder: Path, q: list[float], *, shape: str = BALL, rod: str = APART, more: str = "") -> list[str]:
    """What is said about one configuration x, z, pitch, slide_left, slide_right of the sled."""
    (folder / "sled.xml").write_text(MODEL.format(shape=shape, rod=rod), encoding="utf-8")
    (folder / "task.yaml").write_text(
        "name: sled\nrobot: {model: sled.xml}\nhorizon: {duration: 1, intervals: 4}\n"
        + (more or "contacts: {ball: {body: left}}\n"),
        encoding="utf-8",
    )
    task, robot = load_task_robot(load_task(folder / "task.yaml"))
    return overlaps(task, robot, surfaces_of(task), [("Now", np.array(q))])


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.partition('"')[0])
@pytest.mark.parametrize("pitch", [0.0, 0.4, -0.9])
def test_the_depth_of_every_shape(tmp_path: Path, shape: str, pitch: float) -> None:
    """A body half a metre above the ground is not in it; one 3 cm too low is in it by 3 cm."""
    lowest = SHAPES[shape](pitch)
    assert said(tmp_path, [0, lowest + 0.5, pitch, 0, 0], shape=shape) == []
    (sentence,) = said(tmp_path, [0, lowest - 0.03, pitch, 0, 0], shape=shape)
    depth = float(sentence.removeprefix("Now body 'base' is ").partition(" m below the ground")[0])
    assert depth == pytest.approx(0.03, abs=2e-3)


GROUNDS = [
    ("ground: {slope: 0.3}\n", 0.2 - 0.15 * np.cos(0.3)),
    ("ground: {type: steps, steps: [{x: -2, height: 0.1}]}\n", 0.05),
    ("ground: {height: -3, walls: {end: {x: -0.15, side: right}}}\n", 0.05),
]


@pytest.mark.parametrize(("ground", "depth"), GROUNDS, ids=[ground[0][9:20] for ground in GROUNDS])
def test_every_ground(tmp_path: Path, ground: str, depth: float) -> None:
    """The depth is measured along the normal of a slope, of a step and of a wall."""
    height = 0.15 if "slope" in ground else 0.25
    (sentence,) = said(tmp_path, [0, height, 0, 0, 0], more=f"{ground}contacts: {{ball: {{frame: left}}}}\n")
    where = "beyond the wall 'end'" if "walls" in ground else "below the ground"
    assert f"Now body 'base' is {depth:.4g} m {where}" in sentence


CONTACTS = [
    ("ball: {body: base}", 0),
    ("ball: {frame: base}", 0),
    ("keel: {frame: keel}", 0),
    ("other: {frame: left}", 1),
]


@pytest.mark.parametrize(("contact", "count"), CONTACTS, ids=[contact[0] for contact in CONTACTS])
def test_what_a_contact_stands_for_is_meant(tmp_path: Path, contact: str, count: int) -> None:
    """A body whose frame touches, or a site of it, may be in the ground; another body's contact does not excuse it."""
    assert len(said(tmp_path, [0, 0.1, 0, 0, 0], more=f"contacts: {{{contact}}}\n")) == count


def test_two_bodies_overlap(tmp_path: Path) -> None:
    """A ball and a rod on two slides overlap by their radii less the distance; what carries them is not meant."""
    assert said(tmp_path, [0, 3, 0, 0.2, 0]) == []
    (sentence,) = said(tmp_path, [0, 3, 0, 0.4, 0])
    assert sentence.startswith("Now bodies 'left' and 'right' overlap by 0.05 m")


def test_what_overlaps_by_construction_is_not_said(tmp_path: Path) -> None:
    """Two bodies on one that overlap with all joints at zero do so wherever they are."""
    assert said(tmp_path, [0, 3, 0, 0.02, 0], rod="0 -0.2 0.5 0 0.2 0.5") == []


def test_two_circles_that_touch_may_overlap(tmp_path: Path) -> None:
    """Bodies with a contact between them are kept apart by that contact, as deep as its circles lie."""
    contact = "{type: circle_circle, frame: left, radius: 0.1, other_frame: right, other_radius: 0.05}"
    assert said(tmp_path, [0, 3, 0, 0.4, 0], more=f"contacts: {{pair: {contact}}}\n") == []


URDF = """\
<robot name="cup">
  <link name="cup"><collision><geometry><mesh filename="cup.stl"/></geometry></collision></link>
  <link name="stem">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="ball">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <link name="next">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 5"/><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="x" type="prismatic"><parent link="cup"/><child link="next"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" velocity="9" effort="9"/></joint>
  <joint name="z" type="prismatic"><parent link="next"/><child link="stem"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" velocity="9" effort="9"/></joint>
  <joint name="fixed" type="fixed"><parent link="stem"/><child link="ball"/><origin xyz="0 0 3"/></joint>
</robot>
"""


def test_a_ball_in_a_cup_is_in_its_hull_only(tmp_path: Path) -> None:
    """Inside a hollow mesh nothing overlaps; at its side a ball does."""
    cup = trimesh.creation.annulus(r_min=0.4, r_max=0.5, height=0.6)
    cup.export(tmp_path / "cup.stl")
    (tmp_path / "cup.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "task.yaml").write_text(
        "name: cup\nrobot: {model: cup.urdf}\nground: {height: -9}\nhorizon: {duration: 1, intervals: 4}\n"
        "contacts: {ball: {frame: ball}}\n",
        encoding="utf-8",
    )
    task, robot = load_task_robot(load_task(tmp_path / "task.yaml"))
    for x, count in ((0.0, 0), (0.2, 0), (0.4, 1), (0.7, 0)):
        found = overlaps(task, robot, surfaces_of(task), [("Now", np.array([x, -3.0]))])
        assert len(found) == count and all("'ball' and 'cup' overlap by" in sentence for sentence in found)


def test_a_missing_mesh_is_said(tmp_path: Path) -> None:
    """Where the shapes cannot be read a plan is made all the same, and says that it does not know."""
    (tmp_path / "cup.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "task.yaml").write_text(
        "name: cup\nrobot: {model: cup.urdf}\nhorizon: {duration: 1, intervals: 4}\ncontacts: {ball: {frame: ball}}\n",
        encoding="utf-8",
    )
    task, robot = load_task_robot(load_task(tmp_path / "task.yaml"))
    (sentence,) = overlaps(task, robot, surfaces_of(task), [])
    assert sentence.startswith(f"Whether bodies overlap is not known: {tmp_path / 'cup.urdf'}: link 'cup'")


def test_the_deepest_moment_of_a_motion(tmp_path: Path) -> None:
    """Of a motion that dips into the ground, in samples of no order, the deepest one is told with its time."""
    said(tmp_path, [0, 3, 0, 0, 0])
    task, robot = load_task_robot(load_task(tmp_path / "task.yaml"))
    time = np.random.default_rng(0).permutation(np.linspace(0, 1, 401))
    q = np.zeros((401, 5))
    q[:, 1] = 0.5 - 0.4 * np.sin(np.pi * time)
    states = States(time, np.zeros(401, dtype=int), q, np.zeros_like(q))
    motion = SimpleNamespace(states=states)
    (sentence,) = overlaps_of_motion(task, robot, surfaces_of(task), motion)  # type: ignore[arg-type]
    assert sentence.startswith("At t = 0.5 s body 'base' is 0.1 m below the ground")


def test_a_body_in_a_box_or_in_a_hill(tmp_path: Path) -> None:
    """A ball of 0.2 m that is 5 cm deep in the top of a box is, beside it is not; so it is with a map over x and y."""
    contacts = "contacts: {ball: {body: left}}\n"
    box = f"{contacts}surfaces: {{step: {{type: box, center: [0, 0, 0.1], size: [2, 1, 0.2]}}}}\n"
    assert said(tmp_path, [0, 0.35, 0, 0, 0], more=box) == [
        "Now body 'base' is 0.05 m inside 'step': no contact keeps it out there, and the motion passes through."
    ]
    assert said(tmp_path, [0, 0.41, 0, 0, 0], more=box) == said(tmp_path, [1.3, 0.21, 0, 0, 0], more=box) == []
    rows = "".join(f"{x},{y},{0.1 * y}\n" for x in (-1, 1) for y in (-1, 1))
    (tmp_path / "map.csv").write_text(rows, encoding="utf-8")
    hill = "ground: {type: height_map, file: map.csv, walls: {wall: {x: 5, side: left}}}\n"
    hill += "contacts: {ball: {frame: left, surface: wall}}\n"
    (sentence,) = said(tmp_path, [0, 0.18, 0, 0, 0], more=hill)
    depth = 0.2 - 0.18 / np.hypot(1, 0.1)
    assert sentence.startswith(f"Now body 'base' is {depth:.4g} m below the ground")


def test_a_table_has_no_ground(load_short: Callable[..., Task]) -> None:
    """Without gravity, and without a contact on it, nothing falls on the ground, and nothing can be below it."""
    public = Path(__file__).parents[2] / "tasks" / "public"
    assert load_task(public / "impact_push_t.yaml").has_untouched_ground
    assert not load_short().has_untouched_ground and not load_short("gravity=[0, 0, 0]").has_untouched_ground
    motion = formulate(load_task(public / "impact_push_t.yaml"))
    moments = [("Once", np.array([0.0, -1.0, 0.0]))]
    assert overlaps(motion.task, motion.robot, motion.scene.surfaces, moments) == []
