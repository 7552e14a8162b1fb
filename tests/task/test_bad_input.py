"""A corpus of mistakes: each is one error that names the line, the key, what was found and what was expected."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pydantic import ValidationError

from fesd_robot.errors import TaskError
from fesd_robot.task import load_task, validation_error
from fesd_robot.task.fields import Section
from fesd_robot.task.origins import Origins

Write = Callable[[str], Path]

# (text of the valid task, its replacement, line, key, fragments of the message)
EDITS: list[tuple[str, str, int, str, list[str]]] = [
    # unknown keys
    ("    frame: foot", "    fram: foot", 21, "contacts.foot.fram", ["(did you mean 'frame'?)"]),
    ("    frame: foot", "    link: foot", 20, "contacts.foot.frame", ["missing", "; and 1 more error"]),
    (
        "output:",
        "extra: 1\noutput:",
        51,
        "extra",
        ["unknown key", "valid: audit, bodies, constraints"],
    ),
    ("    baumgarte_gain", "    baumgarte", 47, "method.formulation.baumgarte", ["did you mean 'baumgarte_gain'?"]),
    ("    baumgarte_gain: 30", "    gap: integrated", 47, "method.formulation.gap", ["unknown key"]),
    ("      upper: 50", "      uper: 50\n      upper: 50", 14, "robot.actuators.push.uper", ["'upper'"]),
    ("  apex:", "  apx: {}\n  apex:", 35, "reference.apx", ["did you mean 'apex'?"]),
    ("  type: jumps\n", "  type: line\n", 34, "reference.count", ["unknown key", "valid: type", "1 more error"]),
    ("    frame: foot", "    frame: foot\n    rebound: 0.5", 22, "contacts.foot.rebound", ["unknown key"]),
    # restitution
    (
        "    frame: foot",
        "    frame: foot\n    restitution: 1.2",
        22,
        "contacts.foot.restitution",
        ["found 1.2", "a number from 0 to 1"],
    ),
    (
        "  friction: 0.45",
        "  friction: 0.45\n  restitution: -0.1",
        19,
        "ground.restitution",
        ["found -0.1", "a number from 0 to 1"],
    ),
    (
        "  friction: 0.45",
        "  friction: 0.45\n  walls: {end: {x: 2, side: left, restitution: high}}",
        19,
        "ground.walls.end.restitution",
        ["found the text 'high'", "a number from 0 to 1"],
    ),
    # missing keys: the line of the parent
    ("name: hop\n", "", 1, "name", ["missing", "name of the task"]),
    ("  duration: 1.0\n", "", 22, "horizon.duration", ["missing", "length of the motion", ", s"]),
    ("    frame: foot", "    friction: 1", 20, "contacts.foot.frame", ["missing"]),
    ("{type: joint, joint", "{joint", 7, "robot.actuators.torque.type", ["missing", "'joint' or 'generalized_force'"]),
    ("  type: jumps\n", "", 32, "reference.type", ["missing", "'line' or 'jumps'"]),
    # wrong types
    ("intervals: 20", "intervals: ten", 24, "horizon.intervals", ["the text 'ten'", "a whole number"]),
    ("intervals: 20", "intervals: 2.5", 24, "horizon.intervals", ["found 2.5", "a whole number"]),
    ("intervals: 20", "intervals: true", 24, "horizon.intervals", ["found true", "a whole number"]),
    ("duration: 1.0", "duration: '1.0'", 23, "horizon.duration", ["the text '1.0'", "a number"]),
    ("duration: 1.0", "duration: yes", 23, "horizon.duration", ["the text 'yes'", "a number"]),
    ("duration: 1.0", "duration: true", 23, "horizon.duration", ["found true", "a number"]),
    ("duration: 1.0", "duration: [1]", 23, "horizon.duration", ["the list [1]", "a number"]),
    ("duration: 1.0", "duration:", 23, "horizon.duration", ["found nothing", "a number"]),
    ("{leg: 0.5}", "0.5", 26, "initial.configuration", ["found 0.5", "a mapping of names"]),
    ("name: hop", "name: 3", 1, "name", ["found 3", "text"]),
    ("name: hop", "name: hop/hop", 1, "name", ["'hop/hop'", "letters, digits"]),
    ("page: true", "page: off", 52, "output.page", ["'off'", "true or false"]),
    ("page: true", "page: 1", 52, "output.page", ["found 1", "true or false"]),
    ("ground:\n  type: plane\n  slope: 0.1\n  friction: 0.45", "ground: flat", 15, "ground", ["a mapping of keys"]),
    # numbers out of range
    ("duration: 1.0", "duration: .nan", 23, "horizon.duration", ["found NaN", "a finite number"]),
    ("duration: 1.0", "duration: .inf", 23, "horizon.duration", ["found inf", "a finite number"]),
    ("duration: 1.0", "duration: 1e999", 23, "horizon.duration", ["found inf", "a finite number"]),
    ("duration: 1.0", f"duration: 1{'0' * 400}", 23, "horizon.duration", ["a number"]),
    ("duration: 1.0", f"duration: 1{'0' * 9000}", 23, "horizon.duration", ["a number"]),
    ("slope: 0.1", "slope: 90", 17, "ground.slope", ["found 90", "-pi/2 and pi/2"]),
    ("armature: {leg: 0.1}", "armature: {leg: -1}", 5, "robot.armature.leg", ["found -1", "at least 0"]),
    ("{root_x: 100}", "{root_x: -100}", 37, "costs.configuration.root_x", ["found -100", "at least 0"]),
    ("push: 1e-2", "push: a lot", 38, "costs.control.push", ["'a lot'", "a number"]),
    ("{root_x: 0.01}", "{root_x: -1}", 31, "goal.tolerance.configuration.root_x", ["at least 0"]),
    ("count: 1", "count: 0", 34, "reference.count", ["found 0", "at least 1"]),
    ("apex: {leg: 0.1}", "apex: {}", 35, "reference.apex", ["an empty mapping", "at least one entry"]),
    ("tolerance: 1e-8", "tolerance: 0", 50, "solver.tolerance", ["found 0", "greater than 0"]),
    ("tolerance: 1e-8", "sigma_factor: 1", 50, "solver.sigma_factor", ["found 1", "less than 1"]),
    ("stages: 2", "step_freedom: 0", 45, "method.step_freedom", ["found 0", "greater than 0"]),
    ("stages: 2", "auxiliary_force: 0", 45, "method.auxiliary_force", ["found 0", "'auto'"]),
    # choices and union tags
    ("root: fixed", "root: floating", 4, "robot.root", ["'floating'", "'fixed', 'sagittal', 'planar' or 'free_flyer'"]),
    ("type: plane", "type: plan", 16, "ground.type", ["'plan'", "'plane'"]),
    ("type: jumps", "type: jump", 33, "reference.type", ["'jump'", "did you mean 'jumps'?"]),
    ("{type: joint,", "{type: joints,", 7, "robot.actuators.torque.type", ["'joints'", "did you mean 'joint'?"]),
    ("type: mean", "type: median", 48, "method.step_equilibration.type", ["'median'", "'difference'"]),
    ("  tolerance: 1e-8", "  linear_solver: ma57", 50, "solver.linear_solver", ["'ma57'", "'auto', 'fesd' or 'mumps'"]),
    # limits and keys that contradict each other
    ("[0.1, 0.5]", "[0.1]", 41, "limits.position.leg", ["[0.1]", "two numbers"]),
    ("[0.1, 0.5]", "[0.1, .nan]", 41, "limits.position.leg", ["two numbers"]),
    ("[0.1, 0.5]", "0.5", 41, "limits.position.leg", ["found 0.5", "two numbers"]),
    ("velocity: {leg: 5}", "velocity: {leg: -5}", 42, "limits.velocity.leg", ["found -5", "greater than 0"]),
    ("{lower: 0.1, upper: 20}", "{upper: 0.5}", 43, "limits.speed_of_time.upper", ["upper 0.5", "1 in between"]),
    ("lower: -50, upper: 50}", "lower: 5, upper: 5}", 7, "robot.actuators.torque.lower", ["lower 5 and upper 5"]),
    ("      lower: -50", "      lower: 60", 13, "robot.actuators.push.lower", ["lower 60 and upper 50"]),
    ("    torque:", "    time:", 7, "robot.actuators.time", ["cannot be called 'time'"]),
    (
        "    push:",
        "    twin: {type: joint, joint: root_pitch}\n    push:",
        8,
        "robot.actuators.twin.joint",
        ["'torque'"],
    ),
    ("tolerance: 1e-8", "sigma_start: 1e-9", 50, "solver.sigma_start", ["1e-09", "sigma_start > tolerance"]),
    ("type: mean, weight: 1", "type: none, weight: 2", 48, "method.step_equilibration.weight", ["no effect"]),
    # emptiness
    ("contacts:\n  foot:\n    frame: foot", "contacts: {}", 31, "reference.type", ["jumps in a task without contacts"]),
    ("  model: hopper.urdf", "  model: ''", 3, "robot.model", ["relative to the task file"]),
    ("  model: hopper.urdf", "  model: 'example-robot-data:'", 3, "robot.model", ["example-robot-data:NAME"]),
    ("  foot:\n", "  '':\n", 20, "contacts.", ["at least one character"]),
    # expressions
    ("-sin(root_pitch)", "sinh(root_pitch)", 11, "robot.actuators.push.force.root_x", ["'sinh(root_pitch)'"]),
    ("-sin(root_pitch)", "root_pitch^2", 11, "robot.actuators.push.force.root_x", ["write **"]),
    ("-sin(root_pitch)", "sin(", 11, "robot.actuators.push.force.root_x", ["not an arithmetic expression"]),
    ("        leg: 1", "        leg: true", 12, "robot.actuators.push.force.leg", ["found true", "expression"]),
    # YAML
    ("  duration: 1.0", "  duration: 1.0\n  duration: 2.0", 24, "horizon.duration", ["given twice", "line 23"]),
    ("{leg: 0.5}", "{1: 0.5}", 26, "initial.configuration", ["found the key 1", "expected a name"]),
    ("name: hop", "name: !python/object hop", 1, "name", ["YAML tag !python/object"]),
    ("{leg: 0.5}", "&self {leg: *self}", 26, "initial.configuration.leg", ["contains itself"]),
]


@pytest.mark.parametrize(("old", "new", "line", "key", "fragments"), EDITS, ids=lambda value: str(value)[:40])
def test_a_mistake_names_line_and_key(
    base: str, write: Write, old: str, new: str, line: int, key: str, fragments: list[str]
) -> None:
    """One wrong edit of a valid task is one error with the line, the key, what was found and what was expected."""
    assert old in base
    path = write(base.replace(old, new, 1))
    with pytest.raises(TaskError) as caught:
        load_task(path)
    error = caught.value
    assert (error.file, error.line, error.key) == (path, line, key), str(error)
    assert str(error).startswith(f"{path}:{line}: {key}: ")
    assert "\n" not in str(error)
    for fragment in fragments:
        assert fragment in error.message


# (text of the whole file, line, fragments)
FILES: list[tuple[str, int, list[str]]] = [
    ("", 1, ["empty"]),
    ("# only a comment\n", 1, ["empty"]),
    ("- name: hop\n", 1, ["found a list"]),
    ("hop\n", 1, ["found a single value"]),
    ("name: hop\nrobot: [1, 2\n", 3, ["not valid YAML", "','"]),
    ("name: hop\nrobot: @x\n", 2, ["not valid YAML", "'@'"]),
    ("name: hop\nrobot:\t- x\n b: c\n", 2, ["not valid YAML"]),
    ("name: hop\nrobot: a\x01b\n", 2, ["not valid YAML", "not allowed"]),
    ("name: hop\n---\nname: hop\n", 2, ["not valid YAML", "another document"]),
]


@pytest.mark.parametrize(("text", "line", "fragments"), FILES)
def test_a_file_that_is_no_task_names_the_line(write: Write, text: str, line: int, fragments: list[str]) -> None:
    """Text that is no YAML mapping is one error with its line."""
    path = write(text)
    with pytest.raises(TaskError) as caught:
        load_task(path)
    assert (caught.value.file, caught.value.line, caught.value.key) == (path, line, None), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message


@pytest.mark.slow
def test_deep_nesting_is_an_error_not_a_crash(write: Write) -> None:
    """Thousands of brackets are refused as any other mistake."""
    with pytest.raises(TaskError, match="nested too deeply"):
        load_task(write("name: " + "[" * 5000))


def test_repeated_aliases_cannot_blow_up(write: Write) -> None:
    """A file whose aliases would expand to millions of values is refused."""
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 8)]
    with pytest.raises(TaskError, match="alias"):
        load_task(write("\n".join(lines)))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """A path without a file is an error that names it."""
    with pytest.raises(TaskError, match="no such file") as caught:
        load_task(tmp_path / "none.yaml")
    assert caught.value.file == tmp_path / "none.yaml"


def test_a_folder_is_no_task(tmp_path: Path) -> None:
    """A folder in place of a file is an error that says so."""
    with pytest.raises(TaskError, match="folder"):
        load_task(tmp_path)


def test_bytes_that_are_not_utf8_are_located(tmp_path: Path) -> None:
    """A file in another encoding is an error with the line of its first bad byte."""
    path = tmp_path / "task.yaml"
    path.write_bytes(b"name: hop\n# \xe9t\xe9\n")
    with pytest.raises(TaskError, match="UTF-8") as caught:
        load_task(path)
    assert caught.value.line == 2


# (override, key, fragments)
OVERRIDES: list[tuple[str, str | None, list[str]]] = [
    ("horizon.intervals", "horizon.intervals", ["key.path=value"]),
    ("=30", None, ["key.path=value"]),
    ("", None, ["key.path=value"]),
    ("horizon..intervals=30", "horizon..intervals", ["key.path=value"]),
    ("horizon.interval=30", "horizon.interval", ["did you mean 'intervals'?"]),
    ("horizn.intervals=30", "horizn", ["did you mean 'horizon'?"]),
    ("horizon.intervals=ten", "horizon.intervals", ["the text 'ten'", "a whole number"]),
    ("horizon.intervals=", "horizon.intervals", ["found nothing", "a whole number"]),
    ("horizon.duration.s=1", "horizon.duration.s", ["'horizon.duration' holds a value"]),
    ("limits.position.leg.0=1", "limits.position.leg.0", ["'limits.position.leg' holds a value"]),
    ("limits.position.leg=[1", "limits.position.leg", ["not valid YAML"]),
    ("solver={tolerance: 1, tolerance: 2}", "solver", ["given twice"]),
    ("contacts.heel.friction=1", "contacts.heel.frame", ["missing"]),
]


@pytest.mark.parametrize(("override", "key", "fragments"), OVERRIDES)
def test_a_bad_override_is_quoted(
    base: str, write: Write, override: str, key: str | None, fragments: list[str]
) -> None:
    """A mistake in an override is blamed on the override, not on a line of the file."""
    with pytest.raises(TaskError) as caught:
        load_task(write(base), [override])
    assert (caught.value.file, caught.value.line, caught.value.key) == (None, None, key), str(caught.value)
    for fragment in [f"--set {override}", *fragments]:
        assert fragment in caught.value.message


def test_the_first_of_several_errors_is_reported(base: str, write: Write) -> None:
    """Of several mistakes the one nearest the top is reported, and how many more there are."""
    text = base.replace("page: true", "page: 1").replace("intervals: 20", "intervals: 0").replace("hop\n", "'#'\n", 1)
    with pytest.raises(TaskError) as caught:
        load_task(write(text))
    assert caught.value.line == 1
    assert "; and 2 more errors" in caught.value.message


@pytest.mark.parametrize(
    "key", ["solver.polish", "output.page", "goal.soft", "method.accuracy", "method.auxiliary_force"]
)
@pytest.mark.parametrize("value", ["null", "-1", "x", "[]", "{}", "{a: 1}", "[true]", "1e400", ".nan", "!x 1"])
def test_a_switch_or_choice_with_another_value_is_named(base: str, write: Write, key: str, value: str) -> None:
    """Values that are neither are one sentence with the key."""
    with pytest.raises(TaskError, match=rf"^{key}.*(expected|found)"):
        load_task(write(base), [f"{key}={value}"])


class _Search(Section):
    seconds: float


class _Switched(Section):
    search: bool | _Search = True
    names: list[str] | dict[str, int] | None = None


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("search", 1e6, "search: found 1000000.0, expected true or false or a mapping of keys to values"),
        ("search", None, "search: found nothing, expected true or false or a mapping of keys to values"),
        ("names", 3, "names: found 3, expected a list or a mapping of names to values"),
    ],
)
def test_a_switch_that_also_takes_keys(key: str, value: object, sentence: str) -> None:
    """What a union of a switch and a section, or of any types, does not take is one sentence with all that it takes."""
    with pytest.raises(ValidationError) as caught:
        _Switched.model_validate({key: value})
    assert str(validation_error(caught.value, Origins(), _Switched)) == sentence
