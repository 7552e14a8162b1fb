"""Folders that commands write into: tried before anything is solved, and other files in them stay."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot import Plan, read_plan, write_plan
from fesd_robot.plans import PlanFileError

from .conftest import BARE, settings


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def unsolved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing may be solved."""

    def solve(*_: Any, **__: Any) -> None:
        raise AssertionError("something was solved")

    monkeypatch.setattr("fesd_robot.simulation.simulate_robot", solve)
    monkeypatch.setattr("fesd_robot.planning.planner.plan", solve)


@pytest.mark.usefixtures("unsolved")
@pytest.mark.parametrize("command", ["plan", "simulate"])
def test_a_project_with_a_plan_json_is_no_folder_of_results(
    run: Callable[..., Any], task: Path, tmp_path: Path, command: str
) -> None:
    """Exit status 2 before anything is solved, and no file changes."""
    project = tmp_path / "project"
    (project / "figures").mkdir(parents=True)
    (project / "plan.json").write_text(json.dumps({"my": "own plan"}))
    (project / "figures" / "photo.png").write_text("photo")
    earlier = contents(project)
    outcome = run(command, task, "--out", project)
    assert outcome.code == 2 and "no plan of this program" in outcome.err
    assert outcome.err.count("\n") == 1 and contents(project) == earlier


@pytest.mark.usefixtures("unsolved")
@pytest.mark.parametrize("command", ["plan", "simulate"])
@pytest.mark.parametrize("out", ["x" * 256, "a\nb" * 100, "task.yaml/below", "/proc/none", "/dev/null/run"])
def test_what_cannot_be_a_folder_is_refused_before_a_solve(
    run: Callable[..., Any], task: Path, tmp_path: Path, command: str, out: str
) -> None:
    """Exit status 2, and a sentence that names it."""
    (tmp_path / "work" / "task.yaml").write_text("")
    outcome = run(command, task, "--out", out)
    assert outcome.code == 2 and "cannot hold results" in outcome.err and "choose another --out" in outcome.err
    assert "Traceback" not in outcome.err and [path.name for path in (tmp_path / "work").iterdir()] == ["task.yaml"]


def test_a_folder_that_is_full_at_the_end_costs_no_motion(
    run: Callable[..., Any], short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plan is written beside, one sentence says where, and the exit status is not that of success."""
    plan = write_plan(short_plan, tmp_path / "plan")

    def place(*_: Any) -> None:
        monkeypatch.undo()
        monkeypatch.chdir(tmp_path / "work")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fesd_robot.plans.files.place", place)
    outcome = run("simulate", plan, "--out", tmp_path / "out", "--duration", "0.1", *settings(BARE))
    assert outcome.code == 2 and outcome.err.count("\n") == 1 and not (tmp_path / "out").exists()
    assert "out: cannot be written to (No space left on device); the plan is written to" in outcome.err
    (kept,) = (tmp_path / "work").iterdir()
    assert str(kept) in outcome.err and read_plan(kept).simulation is not None


def test_a_folder_that_becomes_another_one_costs_no_motion(
    run: Callable[..., Any], short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What has come there meanwhile stays."""
    from fesd_robot.simulation import simulate_robot

    plan = write_plan(short_plan, tmp_path / "plan")

    def simulated(*arguments: Any, **options: Any) -> Plan:
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "plan.json").write_text("mine")
        return simulate_robot(*arguments, **options)

    monkeypatch.setattr("fesd_robot.simulation.simulate_robot", simulated)
    outcome = run("simulate", plan, "--out", tmp_path / "out", "--duration", "0.1", *settings(BARE))
    assert outcome.code == 2 and "no plan of this program" in outcome.err and "the plan is written to" in outcome.err
    assert contents(tmp_path / "out") == {"plan.json": b"mine"}


def test_drawing_again_leaves_other_files(run: Callable[..., Any], short_plan: Plan, tmp_path: Path) -> None:
    """Page and figures are replaced; neither a photograph beside them nor the plan changes."""
    folder = write_plan(short_plan, tmp_path / "plan")
    (folder / "figures").mkdir()
    for name in ("figures/photo.png", "figures/positions.png", "notes.txt"):
        (folder / name).write_text("mine")
    earlier = contents(folder)
    assert run("render", folder).code == 0
    changed = {name for name, content in contents(folder).items() if earlier.get(name, content) != content}
    assert changed == {"figures/positions.png"} and not list(folder.rglob(".fesd-robot-*"))
    assert (folder / "plan.html").exists()


def test_drawings_that_cannot_be_made_change_nothing(short_plan: Plan, tmp_path: Path) -> None:
    """Earlier ones stay, and nothing is left."""
    from fesd_robot import render_plan

    folder = write_plan(short_plan, tmp_path / "plan")
    (folder / "plan.html").mkdir()
    earlier = contents(folder)
    with pytest.raises(PlanFileError, match="cannot be written to"):
        render_plan(short_plan, folder, overrides=["output.figures=false"])
    assert contents(folder) == earlier
