"""The sections ground and contacts: what they accept, what they mean by default, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

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
from fesd_robot.task.ground import Shape

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
    shapes = Shape.__subclasses__()
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

# (ground, contact, height of the body, text of map.csv, line, key, fragments)
ROBOT_MISTAKES: list[tuple[str, str, float, str | None, int, str, list[str]]] = [
    (MAP, "{frame: foot}", 1, "0,0\n1,2,3\n", 3, "ground.file", ["line 2 of map.csv is '1,2,3'", "two numbers x,z"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n1,high\n", 3, "ground.file", ["line 3", "'1,high'"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n1,nan\n", 3, "ground.file", ["line 3", "'1,nan'"]),
    (MAP, "{frame: foot}", 1, "x,z\n0,0\n", 3, "ground.file", ["has 1 rows", "2 to 998 rows"]),
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
