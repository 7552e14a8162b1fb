"""`fesd-robot export` and `fesd-robot render`: a plan written again, for other programs and for the eye."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from fesd_robot.plans import read_plan

Run = Callable[..., Any]


@pytest.fixture
def plan(finished: Any, tmp_path: Path) -> Path:
    """A copy of the finished run, without what the commands write."""
    folder = tmp_path / "plan"
    shutil.copytree(finished.folder, folder)
    for name in ("trajectory.csv", "trajectory.npz", "plan.html"):
        (folder / name).unlink()
    shutil.rmtree(folder / "figures")
    return folder


@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_tables_are_those_of_the_plan(run: Run, finished: Any, plan: Path, kind: str) -> None:
    """csv and npz are written beside the plan as `plan` wrote them."""
    assert run("export", plan, "--format", kind) == (0, f"written to {plan}/trajectory.{kind}\n", "")
    name = f"trajectory.{kind}"
    if kind == "csv":
        assert (plan / name).read_bytes() == (finished.folder / name).read_bytes()
    else:
        found, expected = np.load(plan / name), np.load(finished.folder / name)
        assert found.files == expected.files
        for key in found.files:
            np.testing.assert_array_equal(found[key], expected[key])


def test_json_holds_every_column(run: Run, plan: Path, tmp_path: Path) -> None:
    """The columns are those of the CSV file, value by value."""
    assert run("export", plan / "plan.json", "--format", "json", "--out", tmp_path / "new" / "motion.json").code == 0
    data = json.loads((tmp_path / "new" / "motion.json").read_text(encoding="utf-8"))
    trajectory = read_plan(plan).trajectory
    assert (data["name"], data["solved"]) == ("published_hopper_one_jump", True)
    assert data["columns"]["time [s]"] == trajectory.time.tolist()
    assert data["columns"]["leg [m]"] == trajectory.configuration["leg"].tolist()
    assert set(data["modes"]) == {"foot"} and len(data["modes"]["foot"]) == len(trajectory.time)


def test_a_pipe_gets_the_content_alone(run: Run, finished: Any, plan: Path) -> None:
    """With ``--out -`` stdout is the file and no file is written."""
    before = sorted(plan.iterdir())
    outcome = run("export", plan, "--format", "csv", "--out", "-")
    assert (outcome.code, outcome.err) == (0, "")
    # The table ends its lines as CSV does, the captured text as Python does.
    assert outcome.out.splitlines() == (finished.folder / "trajectory.csv").read_text(encoding="utf-8").splitlines()
    assert sorted(plan.iterdir()) == before


@pytest.mark.parametrize("name", ["motion.yaml", "motion.json"])
def test_a_joint_trajectory_is_a_message(run: Run, plan: Path, tmp_path: Path, name: str) -> None:
    """The fields of the message as YAML or JSON, for the joints asked for."""
    outcome = run(
        "export", plan, "--format", "joint-trajectory", "--joint", "leg", "--joint", "root_pitch", "--out",
        tmp_path / name,
    )  # fmt: skip
    assert outcome.code == 0
    text = (tmp_path / name).read_text(encoding="utf-8")
    message = json.loads(text) if name.endswith("json") else YAML(typ="safe").load(text)
    assert list(message) == ["header", "joint_names", "points"]
    assert message["joint_names"] == ["leg", "root_pitch"]
    assert message["points"][-1]["time_from_start"] == {"sec": 0, "nanosec": 200_000_000}
    assert message["points"][0]["positions"] == [0.5, 0.0]
    assert message["points"][0]["effort"] == []
    assert run("export", plan, "--format", "joint-trajectory", "--effort", "--joint", "leg", "--out", "-").out.count(
        f"effort: [{read_plan(plan).controls['leg_force'][0]}]"
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--format", "xml"], "found format 'xml', expected one of csv, npz, json, joint-trajectory"),
        (["--format", "csv", "--joint", "leg"], "found joints for format 'csv'"),
        (["--format", "csv", "--effort"], "found efforts for format 'csv'"),
        (["--format", "joint-trajectory", "--joint", "lag"], "did you mean 'leg'?"),
        (["--format", "csv", "--out", "."], "is a folder"),
        (["--format", "csv", "--out", "file/below.csv"], "cannot be written"),
        ([], "Missing option '--format'"),
    ],
)
def test_an_export_that_cannot_be(run: Run, plan: Path, tmp_path: Path, arguments: list[str], words: str) -> None:
    """An unknown format or joint and a file that cannot be written are bad input, and nothing is written."""
    before = sorted(plan.iterdir())
    (tmp_path / "work" / "file").write_text("mine", encoding="utf-8")
    outcome = run("export", plan, *arguments)
    assert outcome.code == 2 and words in outcome.err and "Traceback" not in outcome.err
    assert sorted(plan.iterdir()) == before and [file.name for file in (tmp_path / "work").iterdir()] == ["file"]


def test_the_page_and_figures_are_those_of_the_run(run: Run, finished: Any, plan: Path) -> None:
    """`render` finds model and ground from any folder, and draws what `plan` drew."""
    outcome = run("render", plan)
    assert outcome == (0, f"written to {plan}: plan.html, figures/ (9 files)\n", "")
    assert (plan / "plan.html").read_bytes() == (finished.folder / "plan.html").read_bytes()
    for figure in (finished.folder / "figures").iterdir():
        assert (plan / "figures" / figure.name).read_bytes() == figure.read_bytes()


def test_two_plans_in_one_page(run: Run, plan: Path, tmp_path: Path) -> None:
    """`render PLAN OTHER` writes one page of both and leaves the plan's own drawings alone; a wrong OTHER is named."""
    outcome = run("render", plan, plan, "--out", tmp_path / "drawn")
    assert outcome.code == 0 and "comparison.html" in outcome.out
    assert [file.name for file in (tmp_path / "drawn").iterdir()] == ["comparison.html"]
    outcome = run("render", plan, tmp_path / "nowhere")
    assert outcome.code == 2 and outcome.err.count("\n") == 1 and "nowhere" in outcome.err


def moved(plan: Path) -> None:
    """Let the plan say that its task was in a folder that is no more."""
    data = json.loads((plan / "plan.json").read_text(encoding="utf-8"))
    data["provenance"]["folder"] = "/nowhere/tasks"
    (plan / "plan.json").write_text(json.dumps(data), encoding="utf-8")


def test_a_task_that_has_moved(run: Run, plan: Path, task: Path, tmp_path: Path) -> None:
    """Where the model is gone `render` says which file is missing and how to name its new place, which then works."""
    moved(plan)
    outcome = run("render", plan)
    assert outcome.code == 2 and outcome.err.count("\n") == 1
    for words in (f"error: {plan}: ", "robot.model", "/nowhere/tasks/../models/hopper/hopper.urdf", "--folder"):
        assert words in outcome.err
    assert not (plan / "plan.html").exists() and not (plan / "figures").exists()
    assert run("render", plan, "--folder", task.parent, "--out", tmp_path / "drawn").code == 0
    assert sorted(file.name for file in (tmp_path / "drawn").iterdir()) == ["figures", "plan.html"]


@pytest.mark.parametrize("command", [["report"], ["render"], ["export", "--format", "csv"]])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "there is no such file or folder, expected a folder of results"),
        ("{", "not a plan: expected the JSON"),
        ("{}", "not a plan of this version"),
        ('{"schema_version": 99}', "found a plan of schema version 99, expected 2"),
    ],
)
def test_what_is_no_plan_is_refused(
    run: Run, tmp_path: Path, command: list[str], content: str | None, words: str
) -> None:
    """A missing, broken or later plan.json is one message that names the file, for every command that reads one."""
    path = tmp_path / "plan.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    outcome = run(*command, path)
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert outcome.err.startswith(f"error: {path}: {words}")
    assert not list((tmp_path / "work").iterdir())


def test_a_new_plan_takes_the_place_of_exports(run: Run, plan: Path, task: Path, small: list[str]) -> None:
    """What was exported into the folder of a plan goes with it, so that no old motion stays beside a new plan."""
    assert run("export", plan, "--format", "joint-trajectory").code == 0
    assert (plan / "joint_trajectory.yaml").is_file()
    assert run("plan", task, "--out", plan, *small, "--quiet").code == 0
    assert not (plan / "joint_trajectory.yaml").exists()
