"""`fesd-robot refine` on the plan of a small real task."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.plans import read_plan

BARE = ("--set", "output.page=false", "--set", "output.figures=false")


@pytest.fixture
def folder(finished: Any, tmp_path: Path) -> Path:
    """A copy of the finished plan."""
    return Path(shutil.copytree(finished.folder, tmp_path / "jump"))


def test_a_plan_is_refined_beside_it(run: Callable[..., Any], folder: Path) -> None:
    """Twice the control grid, from the plan's contacts: nothing is relaxed, it costs no more, the plan stays."""
    before = (folder / "plan.json").read_bytes()
    outcome = run("refine", folder, "--set", "horizon.intervals=4", *BARE)
    assert outcome.code == 0, outcome.err
    coarse, fine = read_plan(folder), read_plan(folder.with_name("jump_refined"))
    assert fine.status.solved and len(fine.controls["time"]) == 4 and len(coarse.controls["time"]) == 2
    assert all(step.sigma == 0 for step in fine.statistics.homotopy)
    assert fine.statistics.objective <= coarse.statistics.objective * (1 + 1e-6)
    assert (folder / "plan.json").read_bytes() == before
    assert fine.task["solver"]["warm_start"] == str(folder)


OLD = {"seed": 2, "starts": 3, "coarse_to_fine": True, "local_search": "auto"}
"""Settings of a plan of version 0.1.0 that begins on a coarser grid."""


@pytest.mark.parametrize("start", [{"seed": 1}, OLD])
def test_a_plan_from_another_start_keeps_its_contacts_too(
    run: Callable[..., Any], folder: Path, start: dict[str, Any]
) -> None:
    """A plan of another seed, or of version 0.1.0, has in its task where it began; nothing is relaxed all the same."""
    file = folder / "plan.json"
    record = json.loads(file.read_text(encoding="utf-8"))
    record["task"]["solver"].update(start)
    file.write_text(json.dumps(record), encoding="utf-8")
    outcome = run("refine", folder, "--set", "horizon.intervals=4", *BARE)
    assert outcome.code == 0, outcome.err
    fine = read_plan(folder.with_name("jump_refined"))
    assert fine.status.solved and all(step.sigma == 0 for step in fine.statistics.homotopy)


def test_plan_json_and_out_serve_as_well(run: Callable[..., Any], folder: Path, tmp_path: Path) -> None:
    """The plan may be named by its file, and the results may go anywhere."""
    outcome = run("refine", folder / "plan.json", "--out", tmp_path / "here", "--quiet", *BARE)
    assert outcome == (0, "", "")
    assert read_plan(tmp_path / "here").status.solved


@pytest.mark.parametrize(
    ("override", "says"),
    [
        (
            "horizon.intervalls=4",
            "horizon.intervalls: found an unknown key, expected a known one (did you mean 'intervals'?)",
        ),
        ("horizon.intervals", "expected key.path=value"),
    ],
)
def test_bad_overrides_name_the_key(run: Callable[..., Any], folder: Path, override: str, says: str) -> None:
    """Exit status 2 and one sentence, as for a task file; nothing is written."""
    outcome = run("refine", folder, "--set", override)
    assert outcome.code == 2 and says in outcome.err
    assert not folder.with_name("jump_refined").exists()


def test_a_plan_of_an_earlier_version_gives_its_configurations(run: Callable[..., Any], folder: Path) -> None:
    """Without finite elements in the plan a warning says so, and its configurations are the initial guess."""
    content = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    del content["finite_elements"]
    (folder / "plan.json").write_text(json.dumps(content), encoding="utf-8")
    outcome = run("refine", folder, *BARE)
    assert outcome.code == 0 and "only the configurations are taken" in outcome.err
    assert any(step.sigma > 0 for step in read_plan(folder.with_name("jump_refined")).statistics.homotopy)
