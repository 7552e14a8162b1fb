"""A task goes to other machines with all files that it names, and needs none of the sender's there."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.examples import shipped_sweeps
from fesd_robot.ocp import load_task_robot
from fesd_robot.sweeps import load_sweep
from fesd_robot.sweeps.content import content_of
from fesd_robot.sweeps.run import checked_tasks
from fesd_robot.task import Task, load_task

ROOT = Path(__file__).parents[2]
MESH = "\n".join(
    ["solid s", "facet normal 0 0 1", "outer loop", "vertex 0 0 0", "vertex 1 0 0", "vertex 0 1 0", "endloop",
     "endfacet", "endsolid s"]
)  # fmt: skip


@pytest.fixture
def sender(tmp_path: Path) -> Path:
    """A folder with a task, its model with a mesh, and a table of its reference."""
    folder = tmp_path / "sender"
    (folder / "tasks").mkdir(parents=True)
    (folder / "robots" / "meshes").mkdir(parents=True)
    urdf = (ROOT / "models" / "hopper" / "hopper.urdf").read_text()
    mesh = '<visual><geometry><mesh filename="meshes/body.stl"/></geometry></visual></link>'
    (folder / "robots" / "hopper.urdf").write_text(urdf.replace("</link>", mesh, 1))
    (folder / "robots" / "meshes" / "body.stl").write_text(MESH)
    text = (ROOT / "tasks" / "hopper_one_jump.yaml").read_text()
    (folder / "tasks" / "own.yaml").write_text(text.replace("../models/hopper/hopper.urdf", "../robots/hopper.urdf"))
    (folder / "tasks" / "motion.csv").write_text("time,root_x,root_z,root_pitch,leg\n0,0.1,0.5,0,0.5\n1,1,0.5,0,0.5\n")
    return folder


def moved(tasks: list[Task], sender: Path, place: Path) -> Task:
    """Return a task on a machine that has not the sender's files."""
    content = content_of({"own": tasks})
    shutil.rmtree(sender)
    return load_task(content.unpacked(place)["own"], content.overrides["own"])


def test_model_meshes_and_tables_go_along(sender: Path, tmp_path: Path) -> None:
    """The robot is read and drawn there, and the reference is found."""
    task = load_task(sender / "tasks" / "own.yaml", ["reference={type: file, path: motion.csv}"])
    content = content_of({"own": [task]})
    assert sorted(content.files) == [
        "robots/hopper.urdf", "robots/meshes/body.stl", "tasks/motion.csv", "tasks/own.yaml",
    ]  # fmt: skip
    there = moved([task], sender, tmp_path / "there")
    _, robot = load_task_robot(there)
    assert any("body.stl" in one.meshPath for one in robot.visual_model.geometryObjects)
    assert str(tmp_path / "there") in str(robot.source)


def test_an_absolute_path_is_found_there(sender: Path, tmp_path: Path) -> None:
    """A path of the sender becomes one beside the task."""
    file = sender / "tasks" / "own.yaml"
    file.write_text(file.read_text().replace("../robots/hopper.urdf", str(sender / "robots" / "hopper.urdf")))
    there = moved([load_task(file)], sender, tmp_path / "there")
    _, robot = load_task_robot(there)
    assert str(tmp_path / "there") in str(robot.source)


def test_files_of_other_rows_go_along(sender: Path) -> None:
    """Models that a sweep varies are all sent."""
    shutil.copy(sender / "robots" / "hopper.urdf", sender / "robots" / "other.urdf")
    file = sender / "tasks" / "own.yaml"
    content = content_of({"own": [load_task(file), load_task(file, ["robot.model=../robots/other.urdf"])]})
    assert {"robots/hopper.urdf", "robots/other.urdf"} <= set(content.files)


@pytest.mark.parametrize("name", list(shipped_sweeps()))
def test_shipped_sweeps_are_valid(name: str) -> None:
    """First and last rows are tasks with a robot, whose task file goes along."""
    sweep = load_sweep(name)
    content, ends = checked_tasks(sweep)
    assert sweep.task and content.tasks[sweep.task] in content.files and ends


def test_the_identity_is_that_of_the_contents(sender: Path) -> None:
    """Another byte in any file is another identity; the folder is not part of it."""
    file = sender / "tasks" / "own.yaml"
    first = content_of({"own": [load_task(file)]}).identity
    assert first == content_of({"own": [load_task(file)]}).identity
    copied = sender.parent / "elsewhere"
    shutil.copytree(sender, copied)
    assert content_of({"own": [load_task(copied / "tasks" / "own.yaml")]}).identity == first
    (copied / "robots" / "meshes" / "body.stl").write_text(MESH + "\n")
    assert content_of({"own": [load_task(copied / "tasks" / "own.yaml")]}).identity != first


def test_a_file_that_is_not_there_is_named(sender: Path) -> None:
    """The key and the file are in the sentence."""
    task = load_task(sender / "tasks" / "own.yaml", ["reference={type: file, path: gone.csv}"])
    with pytest.raises(TaskError, match=r"reference\.path: found 'gone\.csv', but there is no file"):
        content_of({"own": [task]})
