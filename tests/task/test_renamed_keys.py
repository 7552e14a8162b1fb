"""Keys under an old name are read as what they are called today, with one line that names both."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from fesd_robot.errors import TaskError
from fesd_robot.task import Task, load_task
from fesd_robot.task.origins import KeyPath
from fesd_robot.task.renamed_keys import RENAMED_KEYS, rename_keys, today

Write = Callable[[str], Path]

# old path -> a value that is not the default, as YAML
VALUES = {
    "method.auxiliary_acceleration": "70",
    "method.formulation.gap_feedback": "12",
    "solver.finish": "false",
    "solver.sketch_iterations": "99",
    "solver.velocity_relaxation": "40",
}


def given(task: Task, path: KeyPath) -> Any:
    """The value of a task at a path."""
    value: Any = task
    for part in path:
        value = getattr(value, part)
    return value


@pytest.fixture
def old(base: str) -> str:
    """A task with all keys under their old names; its own `formulation` is in line 46, `solver` in line 52."""
    text = base.replace("    baumgarte_gain: 30\n", "    type: steps\n    gap_feedback: 12\n").replace(
        "  step_equilibration:", "  auxiliary_acceleration: 70\n  step_equilibration:"
    )
    return text.replace("solver:\n", "solver:\n  finish: false\n  sketch_iterations: 99\n  velocity_relaxation: 40\n")


def test_every_old_key_leads_to_a_key_of_today() -> None:
    """Old names are no keys any more, and new ones are."""
    for path, name in RENAMED_KEYS.items():
        section: Any = Task
        for part in path[:-1]:
            section = section.model_fields[part].annotation
        assert issubclass(section, BaseModel)
        assert path[-1] not in section.model_fields and name in section.model_fields
    assert {".".join(path) for path in RENAMED_KEYS} == set(VALUES)


def test_a_file_with_old_keys(write: Write, old: str, caplog: pytest.LogCaptureFixture) -> None:
    """Each old key counts as the new one, and one warning names file, line, old key and new key."""
    path = write(old)
    task = load_task(path)
    lines = old.splitlines()
    expected = []
    for key in RENAMED_KEYS:
        assert str(given(task, today(key))).lower().removesuffix(".0") == VALUES[".".join(key)]
        (line,) = (number for number, text in enumerate(lines, 1) if text.strip().startswith(f"{key[-1]}:"))
        expected.append(f"{path}:{line}: the key '{'.'.join(key)}' is now called '{'.'.join(today(key))}'")
    assert [record.getMessage() for record in caplog.records] == expected
    assert {record.levelno for record in caplog.records} == {logging.WARNING}


def test_values_of_old_keys_are_checked(write: Write, old: str) -> None:
    """A wrong value under an old key is an error at its line, under the key's new name."""
    with pytest.raises(TaskError) as caught:
        load_task(write(old.replace("sketch_iterations: 99", "sketch_iterations: many")))
    number = old[: old.index("sketch_iterations")].count("\n") + 1
    assert (caught.value.line, caught.value.key) == (number, "solver.loose_iterations")


def test_a_file_with_both_names(write: Write, old: str) -> None:
    """A key that a file gives under both names is an error that names both, at the line of the old one."""
    with pytest.raises(TaskError) as caught:
        load_task(write(old.replace("  finish: false\n", "  polish: true\n  finish: false\n")))
    assert caught.value.key == "solver.finish"
    assert caught.value.line == old[: old.index("finish")].count("\n") + 2
    assert "'solver.finish' beside 'solver.polish'" in caught.value.message


@pytest.mark.parametrize("old_name", list(VALUES))
def test_an_override_under_an_old_name(base: str, write: Write, old_name: str, caplog: Any) -> None:
    """``--set`` takes old names too, with one warning that quotes it, and replaces what the file says."""
    path = today(tuple(old_name.split(".")))
    override = f"{old_name}={VALUES[old_name]}"
    steps = ["method.formulation.type=steps"]
    task = load_task(write(base), [*steps, override])
    assert task == load_task(write(base), [*steps, f"{'.'.join(path)}={VALUES[old_name]}"])
    assert [record.getMessage() for record in caplog.records] == [
        f"--set {override}: the key '{old_name}' is now called '{'.'.join(path)}'"
    ]
    assert f"(from --set {override})" in str(task.error(path, "x"))


def test_overrides_and_files_may_use_either_name(write: Write, old: str) -> None:
    """The last override wins, under whichever name the file and the overrides give the key."""
    path = write(old)
    assert load_task(path, ["solver.loose_iterations=7"]).solver.loose_iterations == 7
    assert load_task(path, ["solver.loose_iterations=7", "solver.sketch_iterations=8"]).solver.loose_iterations == 8
    assert load_task(path, ["solver={sketch_iterations: 9}"]).solver.loose_iterations == 9
    assert load_task(path, ["method={formulation: {gap_feedback: 9}}"]).method.formulation.baumgarte_gain == 9
    with pytest.raises(TaskError, match=r"solver\.finish: found 'solver\.finish' beside 'solver\.polish'.*--set"):
        load_task(path, ["solver={finish: true, polish: true}"])


@pytest.mark.parametrize(
    ("override", "hint"),
    [
        ("solver.sketch_iteration=3", "'loose_iterations'"),
        ("solver.velocity_relax=3", "'velocity_level_ratio'"),
        ("solver.loose_iteration=3", "'loose_iterations'"),
        ("method.gap_feedback=3", "'method.formulation.baumgarte_gain'"),
    ],
)
def test_a_misspelt_old_name(base: str, write: Write, override: str, hint: str) -> None:
    """What is close to an old name, or an old name in the wrong section, is led to the name of today."""
    with pytest.raises(TaskError) as caught:
        load_task(write(base), [override])
    assert f"(did you mean {hint}?)" in caught.value.message


def test_order_and_other_keys_stay() -> None:
    """Renaming changes no order and no other key, also where an old name stands in another section."""
    data = {"solver": {"a": 1, "finish": 2, "b": 3}, "contacts": {"finish": {}}, "method": None}
    rename_keys(data)
    assert list(data["solver"].items()) == [("a", 1), ("polish", 2), ("b", 3)]  # type: ignore[union-attr]
    assert data["contacts"] == {"finish": {}}
