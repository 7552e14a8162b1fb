"""Input files from the schema and by mutation: tasks, robots, height maps, controls and plans that are nearly right."""

from __future__ import annotations

import copy
import json
import random
import string
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from arguments import ROOT
from ruamel.yaml import YAML

from fesd_robot.task import task_json_schema

PLANS = ROOT / "tests" / "render" / "plans"
MJCF = ROOT / "tests" / "robot" / "models"

SMALL = ("published_hopper_one_jump", "block_slope", "hopper_wedge", "wheel_hills", "pusher_slider", "gripper_lift")
"""Tasks that are mutated: two with one contact, a joint with friction, profiles, a height map, space, and a body."""

ODD_TEXTS = (
    "", " ", "nonsense", "0,6", "1 m", "<<", "*x", "&x", "null", "true", "~", "é", "\u202e", "a.b", "..", "-", "0x10",
    "1e400", "x" * 300, "'", '"', "{", "[", "#", "%", "\\", "a\tb", "a\nb", "nan", "/etc/passwd", "../../..",
)  # fmt: skip
ODD_NUMBERS = (0, -1, 1, 2, 0.5, -0.5, 1e-300, 1e300, -1e9, 1e9, 10**20, 1e-9, float("nan"), float("inf"), 7, 100)


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


def odd_value(rng: random.Random) -> Any:
    """Return a value that is right in few places."""
    lists: tuple[list[Any], ...] = ([], [None], [[1, 2], [3]], [1, "a"], ["a", "a"])
    return rng.choice((*ODD_TEXTS, *ODD_NUMBERS, *ODD_NUMBERS, *lists, None, True, False, {}, {"a": 1}, {"": None}))


def places(tree: Any) -> list[tuple[Any, Any]]:
    """Return every container of a tree of data with a key or an index in it."""
    if isinstance(tree, dict):
        return [(tree, key) for key in tree] + [place for value in tree.values() for place in places(value)]
    if isinstance(tree, list):
        return [(tree, i) for i in range(len(tree))] + [place for value in tree for place in places(value)]
    return []


def mutate_tree(tree: Any, rng: random.Random) -> None:
    """Change one to three entries of a tree of data in place."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        every = places(tree)
        if not every:
            return
        owner, key = rng.choice(every)
        change = rng.randrange(7)
        if change == 0:
            del owner[key]
        elif change == 1 and isinstance(owner, dict):
            owner[f"{key}x" if rng.random() < 0.5 else rng.choice(ODD_TEXTS)] = owner.pop(key)
        elif change == 2:
            other, place = rng.choice(every)
            owner[key] = copy.deepcopy(other.get(place) if isinstance(other, dict) else [*other, None][place])
        elif change == 3 and isinstance(owner[key], int | float) and not isinstance(owner[key], bool):
            owner[key] = owner[key] * rng.choice((-1, 0, 10, 1000, 1e-3, 1e6))
        elif change == 4 and isinstance(owner[key], list):
            owner[key] = owner[key] * 2 if rng.random() < 0.5 else owner[key][:-1]
        else:
            owner[key] = odd_value(rng)


def mutate_text(text: str, rng: random.Random) -> bytes:
    """Return a text with a line or some characters changed, cut off, or with bytes that are none of a text."""
    lines, at = text.splitlines(keepends=True) or [""], rng.randrange(max(len(text), 1))
    line, change = rng.randrange(len(lines)), rng.randrange(9)
    if change == 0:
        del lines[line]
    elif change == 1:
        lines.insert(line, lines[rng.randrange(len(lines))])
    elif change == 2:
        return text[:at].encode()
    elif change == 3:
        return (
            text.encode()[:at] + bytes(rng.randrange(256) for _ in range(rng.choice((1, 3, 40)))) + text.encode()[at:]
        )
    elif change == 4:
        return (text[:at] + rng.choice(string.printable) + text[at + 1 :]).encode()
    elif change == 5:
        lines[line] = rng.choice((" ", "\t", "  ")) + lines[line]
    elif change == 6:
        return text.encode("utf-16" if rng.random() < 0.5 else "latin-1", errors="replace")
    else:
        numbers = [i for i, one in enumerate(lines) if any(letter.isdigit() for letter in one)] or [line]
        line = rng.choice(numbers)
        digit = rng.choice([i for i, letter in enumerate(lines[line]) if letter.isdigit()] or [0])
        lines[line] = lines[line][:digit] + str(rng.choice(ODD_NUMBERS)) + lines[line][digit + 1 :]
    return "".join(lines).encode()


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


def as_yaml(data: Any) -> bytes:
    """Return data as YAML, which JSON is, but for numbers that JSON does not have."""
    return json.dumps(data, indent=1, ensure_ascii=False).replace("NaN", ".nan").replace("Infinity", ".inf").encode()


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
    while "properties" in (place := _resolved(place, schema, rng)) and (not path or rng.random() < 0.8):
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


def _resolved(schema: Any, root: Any, rng: random.Random) -> Any:
    """Return one of the alternatives of a schema, without references."""
    while True:
        if "$ref" in schema:
            schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
        elif alternatives := schema.get("anyOf") or schema.get("oneOf"):
            schema = rng.choice(alternatives)
        else:
            return schema


def from_schema(schema: Any, root: Any, rng: random.Random, names: list[str], depth: int = 0) -> Any:
    """Return a value that a JSON schema allows, or, one time in forty, one that it does not."""
    if rng.random() < 1 / 40 or depth > 8:
        return odd_value(rng)
    schema = _resolved(schema, root, rng)
    below: Callable[[Any], Any] = partial(from_schema, root=root, rng=rng, names=names, depth=depth + 1)
    kind = schema.get("type", "number")
    kind = rng.choice(kind) if isinstance(kind, list) else kind
    if "const" in schema or "enum" in schema:
        return schema["const"] if "const" in schema else rng.choice(schema["enum"])
    if kind == "object":
        needed = schema.get("required", [])
        chosen = [key for key in schema.get("properties", {}) if key in needed or rng.random() < 0.4]
        value = {key: below(schema["properties"][key]) for key in chosen}
        if isinstance(extra := schema.get("additionalProperties"), dict):
            value |= {rng.choice(names): below(extra) for _ in range(rng.choice((1, 2)))}
        return value
    if kind == "array":
        items = schema.get("prefixItems") or [schema.get("items", {})] * rng.choice((0, 1, 2, 3))
        return [below(item) for item in items]
    numbers = (0, 1, -1, 0.5, 0.1, 3, 20, 1e-3, *ODD_NUMBERS)
    values: dict[str, Any] = {
        "string": rng.choice((*names, *names, *ODD_TEXTS)),
        "boolean": rng.random() < 0.5,
        "integer": rng.choice((0, 1, 2, 3, 5, 40, -1)),
        "null": None,
    }
    return values.get(kind, rng.choice(numbers))


def mutate_xml(text: str, rng: random.Random) -> bytes:
    """Return a robot with one to three changed elements or attributes."""
    tree = ElementTree.fromstring(text)
    for _ in range(rng.choice((1, 1, 2, 3))):
        owners = [one for one in tree.iter() if len(one)] or [tree]
        every = [*tree.iter()]
        one, change = rng.choice(every), rng.randrange(8)
        named = [each for each in every if each.attrib]
        if change == 0:
            owner = rng.choice(owners)
            owner.remove(rng.choice([*owner])) if len(owner) else None
        elif change == 1:
            rng.choice(owners).append(copy.deepcopy(one))
        elif change == 2:
            one.tag = rng.choice(("joint", "link", "body", "geom", "nonsense", "inertial", "mesh", "limit", "default"))
        elif change == 3 and named:
            one = rng.choice(named)
            del one.attrib[rng.choice([*one.attrib])]
        elif change == 4 and named:
            one = rng.choice(named)
            name = rng.choice([*one.attrib])
            one.attrib[name] = rng.choice([str(each.attrib[a]) for each in named for a in each.attrib])
        elif change == 5:
            one.attrib[rng.choice(("name", "type", "xyz", "value", "filename", "size"))] = _odd_attribute(rng)
        elif named:
            one = rng.choice(named)
            one.attrib[rng.choice([*one.attrib])] = _odd_attribute(rng)
    return ElementTree.tostring(tree)


def _odd_attribute(rng: random.Random) -> str:
    numbers = [str(number) for number in ODD_NUMBERS]
    several = [" ".join(rng.choice(numbers) for _ in range(rng.choice((2, 3, 4)))) for _ in range(6)]
    texts = [text for text in ODD_TEXTS if text.isprintable()]
    return rng.choice([*texts, *numbers, *several, "ball", "fixed", "floating", "planar", "universal", "mesh.stl"])


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


def mutate_bytes(content: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are others, or missing."""
    changed = bytearray(content)
    for _ in range(rng.choice((0, 1, 3))):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed[: rng.choice((len(changed), len(changed), rng.randrange(len(changed))))])


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
    data, models = _plan(rng.choice(("block_push", "hopper_one_jump")))
    tree = copy.deepcopy(data)
    mutate_tree(
        tree if rng.random() < 0.5 else tree[rng.choice([key for key in tree if isinstance(tree[key], dict)])], rng
    )
    content = json.dumps(tree).encode()
    if rng.random() < 0.2:
        content = mutate_text(json.dumps(data, indent=1), rng)
    kinds = ("csv", "npz", "json", "joint-trajectory", "mujoco", "drake", "pinocchio", "mcap", "parquet")
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
def _plan(name: str) -> tuple[Any, Mapping[str, bytes]]:
    """Return a plan as data, and the model beside it that its task names."""
    data = json.loads((PLANS / f"{name}.json").read_text(encoding="utf-8"))
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
