"""Copies of examples: whole, with relative paths that hold, and never over a file of the user's."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.errors import FesdRobotError, TaskError
from fesd_robot.examples import copy_examples, examples_by_name, find_task, shipped_folder, shipped_sweeps
from fesd_robot.ocp import formulate, load_task_robot
from fesd_robot.sweeps import load_sweep
from fesd_robot.task import load_task

TASKS = [name for name, one in examples_by_name().items() if one.kind == "task"]


def test_a_task_comes_with_what_it_names(tmp_path: Path) -> None:
    """Its model, its height map and the schema, and nothing else; the copy can be formulated where it lies."""
    written = copy_examples(["wheel_hills"], tmp_path, schema=b"{}")
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [
        "models/wheel/wheel.urdf",
        "tasks/task.schema.json",
        "tasks/wheel_hills.csv",
        "tasks/wheel_hills.yaml",
    ]
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == written
    task = load_task(tmp_path / "tasks" / "wheel_hills.yaml")
    assert formulate(task).robot.source == tmp_path / "models" / "wheel" / "wheel.urdf"
    first = (tmp_path / "tasks" / "wheel_hills.yaml").read_text(encoding="utf-8").splitlines()[0]
    assert first == "# yaml-language-server: $schema=task.schema.json"


def _schema(task: Path) -> Path:
    """Return the schema that the first line of a task file names."""
    return task.parent / task.read_text(encoding="utf-8").split("$schema=")[1].splitlines()[0]


def test_all_tasks_find_their_models_in_a_copy(tmp_path: Path) -> None:
    """No task names a file that is left behind."""
    copy_examples([], tmp_path, schema=b"{}")
    for name in TASKS:
        file = tmp_path / find_task(name).relative_to(shipped_folder())
        task = load_task(file)
        assert _schema(file).is_file()
        assert "example-robot-data" in task.robot.model or Path(task.locate_model()).is_relative_to(tmp_path)


def test_all_sweeps_find_their_tasks_in_a_copy(tmp_path: Path) -> None:
    """Each is copied alone, with the file of its task where it names one, whose model is there, too."""
    for name, file in shipped_sweeps().items():
        out = tmp_path / name
        written = copy_examples([name], out, schema=b"{}")
        sweep = load_sweep(out / "sweeps" / file.name)
        assert sweep.task is not None
        task = sweep.file_of(sweep.task)
        assert (task.resolve() in [path.resolve() for path in written]) == ("/" in sweep.task)
        assert len(written) > 1 or "/" not in sweep.task
        load_task_robot(load_task(task))


def test_a_file_of_the_user_s_is_kept(tmp_path: Path) -> None:
    """One changed file stops the whole copy and is named; asked to, it is replaced; what is the same is no obstacle."""
    copy_examples(["hopper_one_jump"], tmp_path, schema=b"{}")
    mine = tmp_path / "tasks" / "hopper_one_jump.yaml"
    mine.write_text("mine", encoding="utf-8")
    with pytest.raises(FesdRobotError, match=r"tasks/hopper_one_jump\.yaml with another content"):
        copy_examples(["hopper_one_jump", "wheel_hills"], tmp_path, schema=b"{}")
    assert mine.read_text(encoding="utf-8") == "mine" and not (tmp_path / "models" / "wheel").exists()
    copy_examples(["hopper_one_jump"], tmp_path, schema=b"{}", overwrite=True)
    assert load_task(mine).name == "hopper_one_jump"
    before = mine.stat().st_mtime_ns
    copy_examples(["hopper_wedge"], tmp_path, schema=b"{}")
    assert mine.stat().st_mtime_ns == before


def test_an_unknown_name_names_the_nearest(tmp_path: Path) -> None:
    """The message has what was found and the name that is closest."""
    with pytest.raises(TaskError, match=r"found 'weel_hills'.*did you mean 'wheel_hills'"):
        copy_examples(["weel_hills"], tmp_path, schema=b"{}")
    assert not list(tmp_path.iterdir())
