"""Input files from the schema and by mutation: tasks, robots, height maps, controls and plans that are nearly right."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML

from fesd_robot.task import task_json_schema
from scripts.tools.arguments import ROOT
from scripts.tools.mutations import (
    ODD_NUMBERS,
    as_yaml,
    from_schema,
    mutate_bytes,
    mutate_text,
    mutate_tree,
    mutate_xml,
    odd_value,
    places,
    resolved,
)

PLANS = ROOT / "tests" / "render" / "plans"
MJCF = ROOT / "tests" / "robot" / "models"

PLANNED = "published_hopper_one_jump"
"""The task that is planned before its plan is mutated."""

SMALL = ("published_hopper_one_jump", "block_slope", "hopper_wedge", "wheel_hills", "pusher_slider", "gripper_lift")
"""Tasks that are mutated: two with one contact, a joint with friction, profiles, a height map, space, and a body."""


class MutatedInput(NamedTuple):
    """Files of one folder, and what is called with them.

    Attributes:
        kind: of file that was made or changed.
        changed: its name.
        files: name -> content.
        command: arguments of the program.
    """

    kind: str
    changed: str
    files: Mapping[str, bytes]
    command: tuple[str, ...]


def mutated_inputs(seed: int, count: int) -> Iterator[MutatedInput]:
    """Yield inputs; the same for the same seed, whatever the count."""
    kinds = [*KINDS]
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        yield KINDS[kinds[number % len(kinds)]](rng)


@cache
def _task(name: str) -> tuple[Any, str, Mapping[str, bytes]]:
    """Return a task as data and as text, with the names of its files beside it, and those files."""
    text = (ROOT / "tasks" / f"{name}.yaml").read_text(encoding="utf-8")
    data = YAML(typ="safe").load(text)
    model = Path(data["robot"]["model"])
    files = {model.name: (ROOT / "tasks" / model).read_bytes()}
    if "file" in data.get("ground", {}):
        files[data["ground"]["file"]] = (ROOT / "tasks" / data["ground"]["file"]).read_bytes()
    return json.loads(json.dumps(data).replace(str(model), model.name)), text.replace(str(model), model.name), files


def _of_task(rng: random.Random) -> tuple[str, ...]:
    return rng.choice(
        (
            ("check", "task.yaml"),
            ("check", "task.yaml"),
            ("check", "task.yaml", "--page", "task.html"),
            ("simulate", "task.yaml", "--duration", "0.02", "--out", "out", "--quiet", *BARE),
        )
    )


BARE = ("--set", "output.page=false", "--set", "output.figures=false")


def mutated_task(rng: random.Random) -> MutatedInput:
    """Return a task with changed entries, or with a changed text."""
    data, text, files = _task(rng.choice(SMALL))
    content = mutate_text(text, rng)
    if rng.random() < 0.7:
        tree = copy.deepcopy(data)
        mutate_tree(tree, rng)
        content = as_yaml(tree)
    return MutatedInput("task, mutated", "task.yaml", {**files, "task.yaml": content}, _of_task(rng))


def task_of_schema(rng: random.Random) -> MutatedInput:
    """Return a task with one to three sections from the JSON schema, some of their values odd."""
    data, _, files = _task(rng.choice(SMALL))
    tree, schema = copy.deepcopy(data), task_json_schema()
    names = [name for name in schema["properties"] if name not in ("name", "robot")]
    for name in rng.sample(names, rng.choice((1, 2, 3))):
        tree[name] = from_schema(schema["properties"][name], schema, rng, _names(data))
    return MutatedInput("task, of the schema", "task.yaml", {**files, "task.yaml": as_yaml(tree)}, _of_task(rng))


def override(rng: random.Random) -> MutatedInput:
    """Return a task as it is with an odd value of one of its keys on the command line."""
    data, text, files = _task(rng.choice(SMALL))
    schema = task_json_schema()
    path, place = list[str](), schema
    while "properties" in (place := resolved(place, schema, rng)) and (not path or rng.random() < 0.8):
        path.append(rng.choice([*place["properties"]]))
        place = place["properties"][path[-1]]
    value = odd_value(rng) if rng.random() < 0.7 else from_schema(place, schema, rng, _names(data))
    word = value if isinstance(value, str) else as_yaml(value).decode().replace("\n", " ")
    given = f"{'.'.join(path)}={word}".replace("\0", "")
    return MutatedInput(
        "override", given[:60], {**files, "task.yaml": text.encode()}, ("check", "task.yaml", "--set", given)
    )


def _names(task: Any) -> list[str]:
    """Return names that a task uses, and some of axes."""
    return [str(key) for owner, key in places(task) if isinstance(owner, dict)] + [
        "x",
        "z",
        "foot",
        "root_x",
        "posture",
    ]


def _robot(kind: str, files: tuple[Path, ...], rng: random.Random) -> MutatedInput:
    source = rng.choice(files)
    text = source.read_text(encoding="utf-8")
    content = mutate_xml(text, rng) if rng.random() < 0.7 else mutate_text(text, rng)
    name = f"robot{source.suffix}"
    command = rng.choice(
        (
            ("robots", name, "--frames", "--shapes"),
            ("robots", name, "--page", "robot.html"),
            ("robots", name, "--sagittal"),
            ("new", name, "--out", "task.yaml"),
            ("new", name, "--out", "task.yaml", "--root", "sagittal"),
        )
    )
    return MutatedInput(kind, name, {name: content}, command)


def mutated_urdf(rng: random.Random) -> MutatedInput:
    """Return a changed URDF."""
    return _robot("URDF", (*sorted((ROOT / "models").glob("*/*.urdf")), MJCF / "zoo.urdf"), rng)


def mutated_mjcf(rng: random.Random) -> MutatedInput:
    """Return a changed MJCF file."""
    return _robot("MJCF", tuple(sorted(MJCF.glob("*.xml"))), rng)


def mutated_height_map(rng: random.Random) -> MutatedInput:
    """Return the task of hills with a changed table, one with y, too, or an image of which bytes are changed."""
    data, _, files = _task("wheel_hills")
    tree, name = copy.deepcopy(data), "wheel_hills.csv"
    content = mutate_text(files[name].decode(), rng)
    if rng.random() < 0.3:
        rows = [f"{x},{y},{0.01 * ((x * y) % 3)}" for x in range(4) for y in range(4)]
        content = mutate_text("\n".join(["x,y,z", *rows]), rng)
    elif rng.random() < 0.4:
        name = rng.choice(("hills.png", "hills.pgm"))
        content = mutate_bytes(_image(name), rng)
        tree["ground"] |= {"file": name, "size": [4, rng.choice((1, 4, 1e-9))], "height": rng.choice(ODD_NUMBERS[:8])}
    return MutatedInput(
        "height map", name, {**files, "task.yaml": as_yaml(tree), name: content}, ("check", "task.yaml")
    )


@cache
def _image(name: str) -> bytes:
    from io import BytesIO

    from PIL import Image

    stream = BytesIO()
    image = Image.new("L", (8, 8))
    image.putdata([(31 * i) % 256 for i in range(64)])
    image.save(stream, "PNG" if name.endswith("png") else "PPM")
    return stream.getvalue()


def mutated_controls(rng: random.Random) -> MutatedInput:
    """Return a task that is simulated with a changed table of controls, or with a changed plan."""
    _, text, files = _task("published_hopper_one_jump")
    names = ["time", "reaction_torque", "leg_force"]
    rows = [f"{0.1 * i:g},{i},{-i}" for i in range(5)]
    content = mutate_text("\n".join([",".join(names), *rows]), rng)
    command = (
        "simulate",
        "task.yaml",
        "--controls",
        "controls.csv",
        "--duration",
        "0.05",
        "--out",
        "out",
        "--quiet",
        *BARE,
    )
    return MutatedInput(
        "controls", "controls.csv", {**files, "task.yaml": text.encode(), "controls.csv": content}, command
    )


def mutated_plan(rng: random.Random) -> MutatedInput:
    """Return a changed plan, with the robot of its task."""
    data, models = _plan(rng.choice(("block_push", "hopper_one_jump", PLANNED)))
    tree = copy.deepcopy(data)
    mutate_tree(
        tree if rng.random() < 0.5 else tree[rng.choice([key for key in tree if isinstance(tree[key], dict)])], rng
    )
    content = json.dumps(tree).encode()
    if rng.random() < 0.2:
        content = mutate_text(json.dumps(data, indent=1), rng)
    kinds = ("csv", "npz", "json", "joint-trajectory", "mujoco", "drake", "pinocchio", "mcap", "parquet", "gains")
    command = rng.choice(
        (
            ("render", "plan.json", "--folder", ".", "--out", "out", "--set", "output.figures=false"),
            ("render", "plan.json", "--folder", ".", "--out", "out"),
            ("export", rng.choice(kinds), "plan.json", "--out", "out.file"),
            ("export", "csv", "plan.json", "--out", "out.file", "--rate", "100"),
            ("report", "plan.json"),
            ("simulate", "plan.json", "--duration", "0.02", "--out", "out", "--quiet", *BARE),
        )
    )
    return MutatedInput("plan", "plan.json", {**models, "plan.json": content}, command)


@cache
def planned_here() -> str:
    """Return the plan of a task that is solved in a second, with finite elements and gains."""
    from fesd_robot import load_task, plan
    from fesd_robot.tracking import with_gains

    task = load_task(
        PLANNED,
        [
            "horizon.duration=0.2",
            "horizon.intervals=2",
            "reference={type: line}",
            "goal.configuration.root_x=0.1",
            "solver.tolerance=1e-6",
        ],
    )
    return with_gains(plan(task)).model_dump_json()


@cache
def _plan(name: str) -> tuple[Any, Mapping[str, bytes]]:
    """Return a plan as data, and the model beside it that its task names."""
    text = planned_here() if name == PLANNED else (PLANS / f"{name}.json").read_text(encoding="utf-8")
    data = json.loads(text)
    model = Path(data["task"]["robot"]["model"])
    data["task"]["robot"]["model"] = model.name
    data["provenance"]["folder"] = None
    return data, {model.name: (ROOT / "models" / model.parent.name / model.name).read_bytes()}


KINDS: Mapping[str, Callable[[random.Random], MutatedInput]] = {
    "task, mutated": mutated_task,
    "plan": mutated_plan,
    "URDF": mutated_urdf,
    "task, of the schema": task_of_schema,
    "MJCF": mutated_mjcf,
    "override": override,
    "height map": mutated_height_map,
    "controls": mutated_controls,
}
"""Kind of input -> what makes one."""
