"""What a valid task file becomes."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from pydantic import ValidationError

from fesd_robot.errors import TaskError
from fesd_robot.task import Jumps, Line, Task, load_task

Write = Callable[[str], Path]
TASKS = sorted((Path(__file__).parents[2] / "tasks").glob("*.yaml"))

TEN_LINES = """\
name: first
robot:
  model: hopper.urdf
contacts:
  foot: {frame: foot}
horizon:
  duration: 1
  intervals: 20
goal:
  configuration: {root_x: 1}
"""


def test_ten_lines_make_a_task(write: Write) -> None:
    """Name, robot, contacts, horizon and goal are enough; everything else has a default."""
    assert TEN_LINES.count("\n") == 10
    task = load_task(write(TEN_LINES))
    assert task.robot.root == "fixed" and task.robot.actuators is None
    assert (task.ground.type, task.ground.height, task.ground.slope, task.ground.friction) == ("plane", 0, 0, 0.8)
    assert task.contacts["foot"].type == "point"
    assert task.reference == Line(type="line")
    assert task.costs.configuration is None
    assert (task.method.scheme, task.method.stages, task.method.elements) == ("radau_iia", 2, 3)
    assert (task.method.formulation.type, task.method.formulation.baumgarte_gain) == ("multipliers", 30)
    assert task.method.auxiliary_force == "auto"
    assert (task.solver.tolerance, task.solver.sigma_start, task.solver.sigma_factor) == (1e-8, 0.1, 0.35)
    assert task.solver.time_limit is None


def test_a_task_survives_json(base: str, write: Write) -> None:
    """Dumped to JSON values and validated again, a task is the same, whether or not limits are open."""
    for text in (base, TEN_LINES, base.replace("[0.1, 0.5]", "[0.1, .inf]")):
        task = load_task(write(text))
        dumped = task.model_dump(mode="json")
        assert Task.model_validate(dumped) == task
        assert Task.model_validate_json(task.model_dump_json()) == task
        assert Task.model_validate(dumped).model_dump(mode="json") == dumped


@pytest.mark.parametrize("path", TASKS, ids=lambda path: path.stem)
def test_a_shipped_task_loads(path: Path) -> None:
    """Every shipped task is valid, survives JSON, finds its robot, points editors at the schema, says its purpose."""
    task = load_task(path)
    assert task.name == path.stem
    assert Task.model_validate(task.model_dump(mode="json")) == task
    assert str(task.locate_model()).startswith("example-robot-data:") or Path(task.locate_model()).is_file()
    schema, purpose = path.read_text(encoding="utf-8").splitlines()[:2]
    assert schema == "# yaml-language-server: $schema=../fesd_robot/task/task.schema.json"
    assert purpose.startswith("# ") and purpose.endswith(".")


def test_five_jumps_is_the_published_benchmark() -> None:
    """The five-jump task holds the numbers of the published hopper problem."""
    task = load_task(next(path for path in TASKS if path.stem == "published_hopper_five_jumps"))
    assert (task.horizon.duration, task.horizon.intervals, task.method.elements, task.method.stages) == (5, 50, 3, 2)
    assert task.reference == Jumps(type="jumps", count=5, apex={"root_z": 1.0, "leg": 0.1}, stance=0)
    assert task.goal.soft
    assert task.goal.configuration == {"root_x": 5, "root_z": 0.5, "root_pitch": 0, "leg": 0.5}
    assert task.costs.configuration == {"root_x": 100, "root_z": 100, "root_pitch": 20, "leg": 50}
    assert task.limits.position["root_pitch"] == (-math.pi, math.pi)
    assert task.limits.velocity["leg"] == (-5, 5)
    assert (task.ground.friction, task.method.auxiliary_force) == (0.45, 100)


@pytest.mark.parametrize(
    ("text", "value"), [("1e-3", 1e-3), ("1E-3", 1e-3), ("2", 2.0), ("1_000.5", 1000.5), ("+.5", 0.5), ("010", 10.0)]
)
def test_numbers_are_read_as_yaml_1_2(base: str, write: Write, text: str, value: float) -> None:
    """Exponents need neither a point nor a sign, and a leading zero does not mean octal."""
    task = load_task(write(base.replace("duration: 1.0", f"duration: {text}")))
    assert task.horizon.duration == value and isinstance(task.horizon.duration, float)


@pytest.mark.parametrize(
    ("text", "bounds"),
    [
        ("[0.1, .inf]", (0.1, math.inf)),
        ("[null, 0.5]", (-math.inf, 0.5)),
        ("[-.inf, ~]", (-math.inf, math.inf)),
        ("[0, 1]", (0.0, 1.0)),
    ],
)
def test_limits_may_be_open(base: str, write: Write, text: str, bounds: tuple[float, float]) -> None:
    """A null or an infinity is no limit on that side, and null in JSON."""
    task = load_task(write(base.replace("[0.1, 0.5]", text)))
    assert task.limits.position["leg"] == bounds
    dumped = task.model_dump(mode="json")["limits"]["position"]["leg"]
    assert dumped == [None if math.isinf(bound) else bound for bound in bounds]


def test_overrides_replace_add_and_switch(base: str, write: Write) -> None:
    """An override sets a value, makes missing parents, replaces whole parts, and the last one wins."""
    task = load_task(
        write(base),
        [
            "horizon.intervals=30",
            "horizon.intervals=40",
            "costs.velocity.leg=1e-3",
            "reference={type: line}",
            "method.formulation={type: steps}",
            "method.formulation.baumgarte_gain=20",
            "robot.actuators=null",
        ],
    )
    assert task.horizon.intervals == 40
    assert task.costs.velocity == {"leg": 1e-3}
    assert task.reference == Line(type="line")
    assert (task.method.formulation.type, task.method.formulation.baumgarte_gain) == ("steps", 20)
    assert task.robot.actuators is None


def test_an_override_may_name_a_coordinate_with_dots(base: str, write: Write) -> None:
    """Below `configuration` and its like the rest of the path is one name, as those of bodies and free roots are."""
    task = load_task(
        write(base),
        [
            "goal.configuration.box.root_joint.x=0.3",
            "limits.position.box.root_z=[0, 1]",
            "goal.tolerance.velocity.leg=1",
        ],
    )
    assert task.goal.configuration == {"root_x": 1.0, "box.root_joint.x": 0.3}
    assert task.limits.position["box.root_z"] == (0.0, 1.0)
    assert task.goal.tolerance.velocity == {"leg": 1.0}


def test_aliases_are_values(base: str, write: Write) -> None:
    """A YAML alias is a copy: overriding one use leaves the other alone."""
    text = base.replace("{leg: 0.5}", "&start {leg: 0.5}").replace("goal:", "goal:\n  velocity: *start")
    task = load_task(write(text), ["goal.velocity.leg=0"])
    assert task.initial.configuration == {"leg": 0.5}
    assert task.goal.velocity == {"leg": 0.0}


def test_a_task_points_at_its_own_lines(base: str, write: Write) -> None:
    """Errors raised later carry the line of a key, of its nearest parent, or the override that set it."""
    path = write(base)
    task = load_task(path, ["horizon.intervals=30"])
    error = task.error("goal.configuration.root_x", "found this, expected that")
    assert isinstance(error, TaskError)
    assert str(error) == f"{path}:29: goal.configuration.root_x: found this, expected that"
    assert task.error(("goal", "configuration", "leg"), "x").line == 28
    assert task.error("costs.velocity.leg", "x").line == 36
    assert task.error("reference", "x").line == 32
    assert str(task.error("horizon.intervals", "x")) == "horizon.intervals: x (from --set horizon.intervals=30)"
    assert task.model_copy().error("reference", "x").line == 32
    assert Task.model_validate(task.model_dump(mode="json")).error("reference", "x").file is None


def test_the_model_is_found_beside_the_task(base: str, write: Write) -> None:
    """A model path counts from the task file; a robot of the example package is handed on as it is."""
    path = write(base)
    with pytest.raises(TaskError, match=r"no file .*hopper\.urdf") as caught:
        load_task(path).locate_model()
    assert caught.value.line == 3
    path.with_name("hopper.urdf").touch()
    assert load_task(path).locate_model() == path.with_name("hopper.urdf")
    task = load_task(path, ["robot.model=example-robot-data:talos"])
    assert task.locate_model() == "example-robot-data:talos"


def test_a_task_is_frozen(base: str, write: Write) -> None:
    """A task cannot be changed after it was checked."""
    task = load_task(write(base))
    with pytest.raises(ValidationError, match="frozen"):
        task.horizon.intervals = 3  # type: ignore[misc]


MERGED = """\
name: first
robot: {model: hopper.urdf}
contacts: {foot: &foot {frame: foot}, hand: {<<: *foot, offset: [0, 0, 1]}}
horizon: {duration: 1, intervals: 20}
initial: &start
  configuration: {root_x: 1}
  velocity: {root_x: 0}
goal:
  <<: [*start, {soft: true, velocity: {root_x: 9}}]
  configuration: {root_x: "one"}
"""


def test_merge_keys_are_read(write: Write) -> None:
    """Own keys come before those of a merge key, and of a list of mappings the first; every key keeps its line."""
    task = load_task(write(MERGED.replace('"one"', "2")))
    assert task.contacts["hand"].frame == "foot" and task.contacts["hand"].offset == (0, 0, 1)
    assert task.goal.configuration == {"root_x": 2} and task.goal.soft and task.goal.velocity == {"root_x": 0}
    assert task.initial.configuration == {"root_x": 1}
    with pytest.raises(TaskError, match=r"goal\.configuration\.root_x: found the text 'one'") as caught:
        load_task(write(MERGED))
    assert caught.value.line == 10
    with pytest.raises(TaskError, match=r"velocity\.root_x: found the text 'fast'") as caught:
        load_task(write(MERGED.replace("velocity: {root_x: 0}", 'velocity: {root_x: "fast"}')))
    assert caught.value.line == 7


def test_merge_keys_do_not_blow_up(write: Write) -> None:
    """Lists of mappings that each merge nine of the ones before stay as small as what they stand for."""
    lists = [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}], k{i}: 1}}" for i in range(1, 30)]
    with pytest.raises(TaskError, match="found an unknown key"):
        load_task(write("\n".join([TEN_LINES + "a0: &a0 {k0: 1}", *lists])))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("goal: &a {<<: 3}", "found a merge key .* of something else"),
        ("goal: {<<: [{soft: true}, 3]}", "found a merge key .* of something else"),
        ("goal: {<<: {soft: true}, <<: {soft: false}}", "found two merge keys"),
        ("goal: {<<: {soft: true, soft: false}}", "this key is given twice"),
        ("goal: {<<: *nowhere}", "undefined alias"),
        (
            "horizon: {duration: 0,6, intervals: 12}",
            "horizon.duration: found 0,6, expected a number with .* written 0.6",
        ),
        ("horizon: {intervals: 12, duration: 1,5e1}", "horizon.duration: found 1,5e1, .* written 1.5e1"),
        ("horizon: {duration: -0,06 s}", "horizon.duration: found -0,06 s, .* written -0.06"),
        ("horizon: {12, duration: 1}", "horizon: found the key 12, expected a name"),
    ],
)
def test_wrong_merges_and_decimal_commas_are_named(write: Write, text: str, message: str) -> None:
    """What cannot be merged, and a decimal comma between braces, is said in words."""
    with pytest.raises(TaskError, match=message) as caught:
        load_task(write(f"name: first\n{text}\n"))
    assert caught.value.line == 2


def test_a_task_with_impulses_is_one_as_a_plan_keeps_it(write: Write) -> None:
    """Defaults that have no effect may be written out, as they are in a plan."""
    task = load_task(write(TEN_LINES + "method: {contact: impulses}\n"))
    assert Task.model_validate(task.model_dump(mode="json")) == task
