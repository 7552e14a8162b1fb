"""The examples that come with the program: found in a checkout, named, and described."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.examples import examples_by_name, find_task, shipped_examples, shipped_folder
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]


def test_every_task_sweep_and_model_of_the_repository_is_an_example() -> None:
    """Names are those of the files and folders, and each has a sentence that says what it is."""
    assert shipped_folder() == ROOT
    examples = shipped_examples()
    files = [file for place in ("", "public/", "simulated/") for file in sorted(ROOT.glob(f"tasks/{place}*.yaml"))]
    assert [one.path for one in examples if one.kind == "task"] == files
    assert [one.name for one in examples if one.kind == "task"] == [one.stem for one in files]
    assert [one.name for one in examples if one.kind == "model"] == sorted(one.name for one in ROOT.glob("models/*"))
    assert [one.path for one in examples if one.kind == "sweep"] == sorted(ROOT.glob("sweeps/*.yaml"))
    assert examples_by_name()["pusher_slider"].kind == "task" and examples_by_name()["hopper"].kind == "model"
    for example in examples:
        assert example.words.endswith(".") and len(example.words) > 10, example.name
        assert example.needs_robot_data == example.name.startswith(("solo12", "go2"))


def test_a_name_is_a_task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name without folder and suffix is that of a shipped task, unless there is a file of that name."""
    monkeypatch.chdir(tmp_path)
    assert find_task("hopper_one_jump") == ROOT / "tasks" / "hopper_one_jump.yaml"
    assert load_task("hopper_one_jump").name == "hopper_one_jump"
    Path("hopper_one_jump").write_text("mine", encoding="utf-8")
    assert find_task("hopper_one_jump") == Path("hopper_one_jump")
    assert find_task("own/task.yaml") == Path("own/task.yaml")


@pytest.mark.parametrize(
    ("given", "hint"),
    [
        ("hoper_one_jump", "did you mean 'hopper_one_jump'?"),
        ("mine", "did you mean 'mine.yaml'?"),
        ("tasks/hopper_one_jump.yaml", "'hopper_one_jump' alone is the task that comes with the program"),
    ],
)
def test_what_is_no_task_names_the_nearest(
    given: str, hint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shipped task with a slip, a file without its suffix, and a path that holds in a checkout only."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text("", encoding="utf-8")
    with pytest.raises(TaskError) as caught:
        find_task(given)
    assert hint in str(caught.value) and given in str(caught.value)


def test_tasks_of_others_name_their_source() -> None:
    """The second line of a public task says what it does, the third where it is from, and all of them load."""
    for file in ROOT.glob("tasks/public/*.yaml"):
        _, purpose, source, *_ = file.read_text(encoding="utf-8").splitlines()
        assert purpose.endswith(".") and re.match(r"# Source: \w+, github.com/\S+ at [0-9a-f]{7}, ", source), file
        assert load_task(file).name == file.stem


def test_no_sweep_has_the_name_of_a_task() -> None:
    """`fesd-robot examples NAME` copies what it stands for, and each can be copied."""
    tasks = {example.name for example in shipped_examples() if example.kind == "task"}
    assert not [example.name for example in shipped_examples() if example.kind == "sweep" and example.name in tasks]
