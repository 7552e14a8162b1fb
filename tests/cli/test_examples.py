"""`fesd-robot examples`, and tasks by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.examples import shipped_sweeps
from fesd_robot.sweeps import load_sweep

ROOT = Path(__file__).parents[2]


def test_the_list_fits_a_terminal(run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Every task, sweep and model is in it, no line is wider than 80 columns, and what needs the robots says so."""
    monkeypatch.setenv("COLUMNS", "80")
    outcome = run("examples")
    lines = outcome.out.splitlines()
    assert (outcome.code, outcome.err) == (0, "") and all(len(line) < 80 for line in lines)
    for name in ("hopper_one_jump", "solo12_jump", "leg_length", "monoped"):
        assert f"  {name}" in lines
    tasks = [*(ROOT / "tasks").glob("*.yaml")]
    needing = [file.stem for file in tasks if "model: example-robot-data:" in file.read_text("utf-8")]
    needing += [name for name, file in shipped_sweeps().items() if load_sweep(file).task in needing]
    assert " ".join(outcome.out.split()).count("(needs pip install 'fesd-robot[robots]')") == len(needing) > 0


def test_what_is_simulated_is_listed_apart(run: Callable[..., Any]) -> None:
    """Each heading has the tasks of its folder below it, and names the command for them."""
    text = run("examples").out
    planned, simulated = text.split("Tasks without controls (fesd-robot simulate NAME):")
    planned, public = planned.split("Tasks of other planners (fesd-robot plan NAME):")
    assert planned.startswith("Tasks (fesd-robot plan NAME):")
    simulated, models = simulated.split("Models:")
    simulated, sweeps = simulated.split("Sweeps (fesd-robot sweep NAME):")
    parts = {planned: "tasks", public: "tasks/public", simulated: "tasks/simulated", sweeps: "sweeps"}
    for part, folder in ((part, ROOT / name) for part, name in parts.items()):
        names = [line.strip() for line in part.splitlines() if line.startswith("  ") and not line.startswith("   ")]
        assert names == sorted(file.stem for file in folder.glob("*.yaml"))
    assert "  hopper\n" in models


def test_a_copy_can_be_checked(run: Callable[..., Any]) -> None:
    """The files are named, with what to type next, which works."""
    outcome = run("examples", "block_push", "--out", "here")
    assert outcome.code == 0
    assert (
        Path("here/models/block/block.urdf").is_file()
        and "Next: fesd-robot check here/tasks/block_push.yaml" in outcome.out
    )
    assert run("check", "here/tasks/block_push.yaml").out.startswith("block_push: the task fits its robot")


def test_a_copy_of_a_sweep_stands_alone(run: Callable[..., Any]) -> None:
    """It is one file, whose task is found where it lies, and the next command is that of sweeps."""
    outcome = run("examples", "leg_length", "--out", "here")
    copy = Path("here/sweeps/leg_length.yaml")
    assert outcome.code == 0 and f"Next: fesd-robot sweep {copy}" in outcome.out
    assert [path for path in Path("here").rglob("*") if path.is_file()] == [copy]
    assert load_sweep(copy).file_of("hopper_one_jump") == ROOT / "tasks" / "hopper_one_jump.yaml"


def test_a_task_is_planned_by_its_name(run: Callable[..., Any], small: list[str]) -> None:
    """In an empty folder the name of a shipped task is enough; a wrong one ends with the nearest."""
    outcome = run("plan", "published_hopper_one_jump", *small)
    assert outcome.code == 0 and Path("runs/published_hopper_one_jump/plan.json").is_file()
    outcome = run("plan", "publishd_hopper_one_jump")
    assert outcome.code == 2 and "did you mean 'published_hopper_one_jump'?" in outcome.err


@pytest.mark.parametrize("arguments", [["--out", "x"], ["--force"], ["hopper_one_jump", "--all"]])
def test_options_that_would_do_nothing_are_refused(run: Callable[..., Any], arguments: list[str]) -> None:
    """A folder without names, and names beside all, are bad input."""
    outcome = run("examples", *arguments)
    assert outcome.code == 2 and "expected" in outcome.err and not list(Path().iterdir())
