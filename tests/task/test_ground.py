"""The sections ground and contacts: what they accept, what they mean by default, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from PIL import Image

from fesd_robot.contact.ground import HeightField
from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.ocp.scene import surface_of
from fesd_robot.task import (
    CircleBoxContact,
    CircleCircleContact,
    CircleContact,
    HeightMap,
    Plane,
    PointContact,
    Steps,
    load_task,
)
from fesd_robot.task.ground import GroundShape

from .conftest import BASE

Write = Callable[[str], Path]
HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"

STEPS = """\
ground:
  type: steps
  height: 0.1
  steps:
    - {x: 1, height: 0.2}
    - x: 1.5
      height: -0.4
  smoothing: 0.2
  walls:
    end: {x: 3, side: left, friction: 0.2}
"""
CONTACTS = """\
contacts:
  foot: {frame: foot}
  hand: {frame: body, surface: end}
  wheel: {type: circle, frame: leg, radius: 0.05, friction: 0}
  bump: {type: circle_circle, frame: body, radius: 0.1, other_frame: foot, other_radius: 0.02}
  push: {type: circle_box, frame: foot, radius: 0.02, other_frame: body, other_size: [0.2, 0.1]}
"""


SURFACES = """\
ground: {}
surfaces:
  table: {type: box, center: [1, 0, 0.05], size: [0.5, 0.4, 0.1]}
  log: {type: cylinder, center: [2, 0, 0.2], radius: 0.2, length: 1, axis: y, edge_radius: 0.05}
"""


def task_with(ground: str, contacts: str = "contacts:\n  foot: {frame: foot}\n") -> str:
    """Return the base task with another ground, from line 15 on, and other contacts after it."""
    before, after = BASE.split("ground:")[0], BASE[BASE.index("horizon:") :]
    return before + ground + contacts + after


def test_every_shape_is_read(write: Write) -> None:
    """Steps with walls, a height map and contacts of every type load, with the surface's friction by default."""
    task = load_task(write(task_with(STEPS, CONTACTS)))
    ground = task.ground
    assert isinstance(ground, Steps)
    assert [(step.x, step.height) for step in ground.steps] == [(1, 0.2), (1.5, -0.4)]
    assert (ground.height, ground.smoothing, ground.friction, ground.walls["end"].side) == (0.1, 0.2, 0.8, "left")
    kinds = [type(contact) for contact in task.contacts.values()]
    assert kinds == [PointContact, PointContact, CircleContact, CircleCircleContact, CircleBoxContact]
    assert type(task).model_validate(task.model_dump(mode="json")) == task
    task = load_task(write(task_with("ground: {type: height_map, file: hills.csv}\n")))
    assert isinstance(task.ground, HeightMap)
    assert isinstance(load_task(write(task_with("ground: {friction: 0.2}\n"))).ground, Plane)


# (ground, contacts, line, key, fragments)
MISTAKES: list[tuple[str, str | None, int, str, list[str]]] = [
    (STEPS.replace("type: steps", "type: step"), None, 16, "ground.type", ["'step'", "did you mean 'steps'?"]),
    (STEPS.replace("x: 1.5", "x: 0.9"), None, 20, "ground.steps.1.x", ["found x 0.9 after 1", "increasing x"]),
    (STEPS.replace("x: 1.5", "x: 1.1"), None, 20, "ground.steps.1.x", ["0.1 m after", "smoothing, 0.2 m"]),
    (STEPS.replace("-0.4", "-9"), None, 21, "ground.steps.1.height", ["a step of 9.2 m", "at least 0.863 m"]),
    (STEPS.replace("height: 0.2", "hight: 0.2"), None, 19, "ground.steps.0.hight", ["did you mean 'height'?"]),
    (
        STEPS.replace("height: 0.2", "height: 0.2, y: 1"),
        None,
        19,
        "ground.steps.0.y",
        ["valid: height, x"],
    ),
    (STEPS.replace("height: -0.4", "height: low"), None, 21, "ground.steps.1.height", ["the text 'low'", "a number"]),
    (STEPS.replace("smoothing: 0.2", "smoothing: 0"), None, 22, "ground.smoothing", ["greater than 0"]),
    (STEPS.replace("side: left", "side: up"), None, 24, "ground.walls.end.side", ["'up'", "'left' or 'right'"]),
    (STEPS.replace("    end:", "    ground:"), None, 24, "ground.walls.ground", ["cannot be called 'ground'"]),
    (STEPS.replace("friction: 0.2", "friction: -1"), None, 24, "ground.walls.end.friction", ["-1", "at least 0"]),
    ("ground: {type: steps, steps: []}\n", None, 15, "ground.steps", ["an empty list", "at least one"]),
    ("ground: {type: steps, steps: 3}\n", None, 15, "ground.steps", ["found 3", "a list"]),
    (
        STEPS.replace("x: 3, side: left", "x: 3"),
        None,
        24,
        "ground.walls.end",
        ["'side' is missing", "place and facing"],
    ),
    (STEPS.replace("x: 3, side: left, ", ""), None, 24, "ground.walls.end", ["no place for the wall"]),
    (STEPS.replace("side: left", "facing: 1"), None, 24, "ground.walls.end.facing", ["'facing' beside 'x'"]),
    (STEPS.replace("x: 3, side: left", "place: [1], facing: 1"), None, 24, "ground.walls.end.place", ["two numbers"]),
    ("ground: {lateral_slope: 30}\n", None, 15, "ground.lateral_slope", ["found 30", "30 degrees are 0.5236 rad"]),
    ("ground: {type: height_map, file: a.png, size: [1, 1]}\n", None, 15, "ground.file", ["without 'height'"]),
    ("ground: {type: height_map, file: a.csv, height: 1}\n", None, 15, "ground.height", ["for an image (.png) only"]),
    (
        "ground: {type: height_map, file: a.png, size: [1, 0], height: 1}\n",
        None,
        15,
        "ground.size",
        ["[1, 0]", "two lengths [x, y] greater than 0"],
    ),
    (SURFACES.replace("box,", "bocks,"), None, 17, "surfaces.table.type", ["'bocks'", "'box' or 'cylinder'"]),
    (SURFACES.replace("0.1]", "-0.1]"), None, 17, "surfaces.table.size", ["three lengths [x, y, z] greater than 0"]),
    (SURFACES.replace("0.1]", "null]"), None, 17, "surfaces.table.size", ["that along y null"]),
    (SURFACES.replace("0.1]", "0.008]"), None, 17, "surfaces.table.size", ["edge_radius of 0.005 m", "0.004 m"]),
    (SURFACES.replace("edge_radius: 0.05", "edge_radius: 0.2"), None, 18, "surfaces.log.edge_radius", ["0.2 m"]),
    (SURFACES.replace("length: 1, ", ""), None, 18, "surfaces.log.length", ["missing", "null without ends"]),
    (
        SURFACES.replace("length: 1", "underside: true, length: 1"),
        None,
        18,
        "surfaces.log.underside",
        ["beside axis: y", "a standing cylinder only"],
    ),
    (SURFACES.replace("  log:", "  ground:"), None, 18, "surfaces.ground", ["cannot be called 'ground'"]),
    (
        STEPS + SURFACES.replace("log:", "end:").split("\n", 1)[1],
        None,
        27,
        "surfaces.end",
        ["a wall in ground.walls too"],
    ),
    (
        SURFACES,
        CONTACTS.replace("surface: end", "surface: lag"),
        21,
        "contacts.hand.surface",
        ["'lag'", "did you mean 'log'?"],
    ),
    ("ground: {type: height_map}\n", None, 15, "ground.file", ["missing", "CSV file with columns x,z or x,y,z"]),
    (STEPS, CONTACTS.replace("radius: 0.05", "radius: 0"), 28, "contacts.wheel.radius", ["greater than 0"]),
    (STEPS, CONTACTS.replace("friction: 0}", "friction: -1}"), 28, "contacts.wheel.friction", ["at least 0"]),
    (
        STEPS,
        CONTACTS.replace("type: circle,", "type: disc,"),
        28,
        "contacts.wheel.type",
        ["'disc'", "or 'circle'"],
    ),
    (STEPS, CONTACTS.replace("radius: 0.05, ", ""), 28, "contacts.wheel.radius", ["missing"]),
    (STEPS, CONTACTS.replace("other_frame: foot", "other_frame: body"), 29, "contacts.bump.other_frame", ["twice"]),
]


def test_every_shape_can_be_built_and_described() -> None:
    """Each shape has a surface of its own, and blames a key that it has where that cannot be built."""
    shapes = GroundShape.__subclasses__()
    assert set(shapes) == set(surface_of.registry) - {object}
    assert all(shape.BUILT_FROM in shape.model_fields for shape in shapes)


@pytest.mark.parametrize(
    ("ground", "contacts", "line", "key", "fragments"), MISTAKES, ids=lambda value: str(value)[:30]
)
def test_a_mistake_names_line_and_key(
    write: Write, ground: str, contacts: str | None, line: int, key: str, fragments: list[str]
) -> None:
    """One mistake in ground or contacts is one error with file, line, key, what was found and what is valid."""
    text = task_with(ground) if contacts is None else task_with(ground, contacts)
    path = write(text)
    with pytest.raises(TaskError) as caught:
        load_task(path)
    error = caught.value
    assert (error.file, error.line, error.key) == (path, line, key), str(error)
    for fragment in fragments:
        assert fragment in error.message, str(error)


SHORT = """\
name: hop
robot: {{model: {model}, armature: {{leg: 0.1}}}}
ground: {ground}
contacts:
  foot: {contact}
horizon: {{duration: 1, intervals: 4}}
initial:
  configuration: {{root_z: {height}, leg: 0.5}}
"""
MAP = "{type: height_map, file: map.csv}"
WHEEL = "{type: circle, frame: foot, radius: 0.1}"
STEP = "{type: steps, steps: [{x: 0.0, height: 0.3}]}"
MANY = f"{{type: steps, steps: [{', '.join(f'{{x: {k}, height: {k % 2}}}' for k in range(601))}]}}"
WALLS = "{walls: {end: {x: 0.2, side: left}}}"
PAIR = "{type: circle_circle, frame: body, radius: 0.4, other_frame: foot, other_radius: 0.2}"
BOX = "{type: circle_box, frame: foot, radius: 0.2, other_frame: body, other_size: [0.4, 0.8]}"

GRID = "x,y,z\n0,0,0\n0,1,0\n1,0,0\n1,1,0.1\n"

# (ground, contact, height of the body, text of map.csv, line, key, fragments)
ROBOT_MISTAKES: list[tuple[str, str, float, str | None, int, str, list[str]]] = [
    (MAP, "{frame: foot}", 1, "0,0\n1,2,3\n", 3, "ground.file", ["line 2 of map.csv is '1,2,3'", "two numbers x,z"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n1,high\n", 3, "ground.file", ["line 3", "'1,high'"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n1,nan\n", 3, "ground.file", ["line 3", "'1,nan'"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n", 3, "ground.file", ["has 1 rows", "2 to 998 rows"]),
    (MAP, "{frame: foot}", 1, GRID.replace("1,0,0\n", ""), 3, "ground.file", ["no height at x = 1, y = 0", "missing"]),
    (MAP, "{frame: foot}", 1, GRID + "0,1,2\n", 3, "ground.file", ["line 6 of map.csv", "x = 0, y = 1 again"]),
    (MAP, "{frame: foot}", 1, GRID.replace("1,1,0.1", "1,1,"), 3, "ground.file", ["line 5", "'1,1,'", "three numbers"]),
    (MAP, "{frame: foot}", 1, "0,0,0\n0,1,0\n", 3, "ground.file", ["1 values of x and 2 of y", "at least 2 of each"]),
    (MAP, "{frame: foot}", 1, GRID.replace("0.1", "99"), 3, "ground.file", ["slope of", "at x = ", "a wall"]),
    (MAP, "{frame: foot}", 1, GRID, 5, "contacts.foot.surface", ["varies along y", "a robot that can leave the plane"]),
    (MAP, WHEEL, 1, GRID, 5, "contacts.foot.surface", ["'foot' stays in the x-z plane", "varies along y"]),
    ("{lateral_slope: 0.1}", WHEEL, 1, None, 5, "contacts.foot.surface", ["varies along y"]),
    (
        "{}\nsurfaces: {log: {type: cylinder, axis: y, center: [0, 0, 0.1], radius: 0.3, length: null}}",
        "{frame: foot, surface: log}", 0.8, None, 9, "initial.configuration", ["0.1 m inside 'log'", "it outside"],
    ),
    (MAP, "{frame: foot}", 1, "0,0\n0.01,1\n", 3, "ground.file", ["slope of 100", "at most 20"]),
    (MAP, WHEEL, 1, "0,1\n1,0\n2,1\n3,0\n3.2,2\n", 5, "contacts.foot.radius", ["radius of 0.1 m", "a hollow of"]),
    (MANY, "{frame: foot}", 1, None, 3, "ground.steps", ["a ground of 1201 pieces", "at most 1000"]),
    (STEP, WHEEL, 1, None, 5, "contacts.foot.radius", ["radius of 0.1 m", "a hollow of", "smoother ground"]),
    ("{}", "{frame: toe}", 1, None, 5, "contacts.foot.frame", ["found 'toe', expected a frame"]),
    ("{}", PAIR.replace("foot", "toe"), 1, None, 5, "contacts.foot.other_frame", ["found 'toe', expected a frame"]),
    (STEP, "{frame: foot}", 0.6, None, 8, "initial.configuration", ["'foot' 0.04", "below the ground"]),
    ("{}", WHEEL, 0.55, None, 8, "initial.configuration", ["'foot' 0.05 m below the ground"]),
    (WALLS, WHEEL.replace("radius", "surface: end, radius"), 0.7, None, 8, "", []),
    (
        WALLS.replace("0.2", "-0.2"), "{frame: foot, surface: end}", 0.7, None, 8, "initial.configuration",
        ["'foot' 0.2 m beyond the wall 'end'", "left side"],
    ),
    ("{}", PAIR, 0.7, None, 8, "initial.configuration", ["circles of contact 'foot' overlapping by 0.1 m"]),
    ("{}", BOX, 0.7, None, 8, "initial.configuration", ["circle and the box of contact 'foot' overlapping by 0.1 m"]),
    ("{}", BOX.replace("body", "toe"), 1, None, 5, "contacts.foot.other_frame", ["found 'toe', expected a frame"]),
    ("{}", BOX.replace("body", "foot"), 1, None, 5, "contacts.foot.other_frame", ["found 'foot' twice"]),
    ("{}", BOX.replace("0.8", "0"), 1, None, 5, "contacts.foot.other_size", ["[0.4, 0]", "two lengths"]),
    ("{}", BOX.replace(", 0.8", ""), 1, None, 5, "contacts.foot.other_size", ["[0.4]", "two lengths"]),
]  # fmt: skip


@pytest.mark.parametrize(("ground", "contact", "height", "table", "line", "key", "fragments"), ROBOT_MISTAKES)
def test_what_a_robot_cannot_stand_on_is_reported(
    tmp_path: Path,
    ground: str,
    contact: str,
    height: float,
    table: str | None,
    line: int,
    key: str,
    fragments: list[str],
) -> None:
    """A terrain file, radius, frame or start that cannot be is one error with file, line and key."""
    path = tmp_path / "task.yaml"
    path.write_text(SHORT.format(model=HOPPER, ground=ground, contact=contact, height=height), encoding="utf-8")
    if table is not None:
        (tmp_path / "map.csv").write_text(table, encoding="utf-8")
    if not key:
        formulate(load_task(path))
        return
    with pytest.raises(TaskError) as caught:
        formulate(load_task(path))
    error = caught.value
    assert (error.file, error.line, error.key) == (path, line, key), str(error)
    for fragment in fragments:
        assert fragment in error.message, str(error)


@pytest.mark.parametrize("mode", ["L", "I;16"])
def test_a_grey_image_becomes_the_ground(tmp_path: Path, mode: str) -> None:
    """Black and white have the heights of the task, the first row of pixels is that of the largest y."""
    white = 255 if mode == "L" else 65535
    pixels = np.zeros((3, 4))
    pixels[0, 3], pixels[2, 0] = white, white // 5
    Image.fromarray(pixels.astype(np.uint8 if mode == "L" else np.uint16)).save(tmp_path / "map.png")
    shape = HeightMap(type="height_map", file="map.png", size=(3.0, 2.0), height=0.5)
    field = surface_of(shape, tmp_path)
    assert isinstance(field, HeightField)
    for x, y, z in ((1.5, 1.0, 0.5), (-1.5, -1.0, 0.1), (1.5, -1.0, 0), (-1.5, 1.0, 0), (0.5, 0, 0)):
        assert field.numbers(x, y).h == pytest.approx(z, abs=1e-12)
    moved = surface_of(shape.model_copy(update={"origin": (1.0, 2.0, 3.0)}), tmp_path)
    assert moved.numbers(1.0, 2.0).h == pytest.approx(3.1, abs=1e-12)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("image", "fragments"),
    [
        (np.zeros((2, 3, 3), dtype=np.uint8), ["map.png is an image of mode RGB", "a grey one with 8 or 16 bits"]),
        (np.zeros((1, 5), dtype=np.uint8), ["5 x 1 pixels", "at least 2 x 2"]),
        (np.zeros((200, 100), dtype=np.uint8), ["100 x 200 pixels", "at most 10000 in all"]),
        (b"no image", ["cannot be read as an image", "a grey PNG file"]),
        (None, ["there is no file"]),
    ],
    ids=["colours", "one row", "large", "text", "absent"],
)
def test_an_image_that_cannot_be_a_ground_is_reported(tmp_path: Path, image: object, fragments: list[str]) -> None:
    """Another kind of image, or none, is one error with line and key, and says what is valid."""
    path = tmp_path / "task.yaml"
    ground = "{type: height_map, file: map.png, size: [1, 1], height: 0.1}"
    path.write_text(SHORT.format(model=HOPPER, ground=ground, contact="{frame: foot}", height=1), encoding="utf-8")
    if isinstance(image, bytes):
        (tmp_path / "map.png").write_bytes(image)
    elif image is not None:
        Image.fromarray(image).save(tmp_path / "map.png")
    with pytest.raises(TaskError) as caught:
        formulate(load_task(path))
    assert (caught.value.line, caught.value.key) == (3, "ground.file")
    for fragment in fragments:
        assert fragment in caught.value.message, str(caught.value)


def test_boxes_and_cylinders_are_surfaces(tmp_path: Path) -> None:
    """A robot of the plane stands on a box and a log without ends along y, with the friction of what it touches."""
    path = tmp_path / "task.yaml"
    surfaces = (
        "{}\nsurfaces:\n  step: {type: box, center: [0, 0, 0.05], size: [0.6, null, 0.1], friction: 0.3}\n"
        "  log: {type: cylinder, axis: y, center: [1, 0, 0.2], radius: 0.2, length: null}"
    )
    contacts = "{frame: foot, surface: step}\n  side: {type: circle, frame: foot, radius: 0.1, surface: log}"
    path.write_text(SHORT.format(model=HOPPER, ground=surfaces, contact=contacts, height=0.7), encoding="utf-8")
    task = load_task(path)
    assert type(task).model_validate(task.model_dump(mode="json")) == task
    motion = formulate(task)
    assert [contact.friction for contact in motion.contacts] == [0.3, 0.8]
    assert not motion.contacts[0].in_space
    gaps = ca.Function("gaps", [motion.dynamics.configuration], [contact.gap for contact in motion.contacts])
    found = [float(gap) for gap in gaps(motion.endpoints.initial_configuration)]
    assert found == pytest.approx([0.1, 1.0 - 0.3], abs=1e-12)


def test_a_height_map_becomes_the_ground(tmp_path: Path) -> None:
    """A table with header and comments is the ground of its task; friction and gaps are those of the surfaces."""
    (tmp_path / "map.csv").write_text("x,z  # m\n-1,0\n\n0,0.1\n1, 0.3\n2,0.3\n", encoding="utf-8")
    path = tmp_path / "task.yaml"
    contacts = "{frame: foot}\n  rim: {type: circle, frame: body, radius: 0.1, surface: end}"
    ground = "{type: height_map, file: map.csv, friction: 0.3, walls: {end: {x: 2, side: left, friction: 0}}}"
    path.write_text(SHORT.format(model=HOPPER, ground=ground, contact=contacts, height=0.7), encoding="utf-8")
    motion = formulate(load_task(path))
    assert [contact.friction for contact in motion.contacts] == [0.3, 0]
    profile = motion.scene.surfaces["ground"].profile  # type: ignore[attr-defined]
    assert [profile.numbers(float(x))[0] for x in (-1, 0, 1, 2)] == pytest.approx([0, 0.1, 0.3, 0.3])
    assert motion.ocp.initial_lower[-1] == pytest.approx(1.9)
    assert 0.05 < motion.ocp.initial_lower[-2] <= 0.1
