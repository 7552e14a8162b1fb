"""`fesd-robot improve` on the plan of one jump."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.plans import read_plan

from .conftest import BARE, ROOT, SMALL


def planned(run: Callable[..., Any], folder: Path, *overrides: str) -> Path:
    """Plan the jump of the hopper quickly, and return the folder of the plan."""
    settings = [word for one in (*BARE, "solver.effort=quick", *overrides) for word in ("--set", one)]
    outcome = run("plan", ROOT / "tasks" / "hopper_one_jump.yaml", "--out", folder, *settings)
    assert outcome.code == 0, outcome.err
    return folder


@pytest.fixture
def folder(run: Callable[..., Any], tmp_path: Path) -> Path:
    """The plan of a hopper that stands still, than which nothing is cheaper."""
    return planned(run, tmp_path / "standing", *SMALL)


def test_a_plan_is_replaced_by_a_cheaper_one(run: Callable[..., Any], tmp_path: Path) -> None:
    """The search begins from the plan, and what is written costs less."""
    folder = planned(run, tmp_path / "jump", "reference.stance=0.2", "method.accuracy=1e-8")
    quick = read_plan(folder)
    assert run("improve", folder).code == 0
    better = read_plan(folder)
    assert better.status.solved and better.statistics.objective < quick.statistics.objective
    search = better.statistics.search
    assert search is not None and search.sequences[0].what == "earlier plan"
    cost = search.sequences[0].cost
    assert cost is not None and cost <= 1.01 * quick.statistics.objective


def test_a_plan_stays_where_nothing_is_cheaper(run: Callable[..., Any], folder: Path) -> None:
    """No byte of it changes, and the program says so."""
    before = (folder / "plan.json").read_bytes()
    outcome = run("improve", folder)
    assert outcome.code == 0 and "no cheaper motion is found" in outcome.sentences
    assert (folder / "plan.json").read_bytes() == before


def test_a_plan_that_was_not_solved_is_replaced(run: Callable[..., Any], folder: Path) -> None:
    """Whatever an unsolved plan costs, one that is solved is better."""
    file = folder / "plan.json"
    record = json.loads(file.read_text(encoding="utf-8"))
    record["status"]["solved"], record["statistics"]["objective"] = False, 0.0
    file.write_text(json.dumps(record), encoding="utf-8")
    assert run("improve", folder).code == 0
    assert read_plan(folder).status.solved


def test_no_plan_is_an_error(run: Callable[..., Any], tmp_path: Path) -> None:
    """A folder without a plan is named."""
    outcome = run("improve", tmp_path)
    assert outcome.code == 2 and str(tmp_path) in outcome.err.replace("\n", "")


def test_a_bad_override_leaves_the_plan(run: Callable[..., Any], folder: Path, tmp_path: Path) -> None:
    """Exit status 2 and one sentence; nothing of the plan is touched."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    outcome = run("improve", folder, "--set", "solver.effort=much")
    assert outcome.code == 2 and "solver.effort: found the text 'much'" in outcome.err
    assert (folder / "plan.json").read_bytes() == (copy / "plan.json").read_bytes()
