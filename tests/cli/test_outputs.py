"""Page, figures and summary made from a plan."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.cli.summary import summary
from fesd_robot.plans import read_plan
from fesd_robot.plans.audit_record import Finding
from fesd_robot.render import outputs
from fesd_robot.task import load_task


def test_a_page_that_fails_does_not_cost_the_plan(
    finished: Any, task: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What cannot be drawn is left out with a warning, and the rest is written."""

    def fail(*_: object) -> None:
        raise RuntimeError("no pixels left")

    monkeypatch.setattr(outputs, "write_page", fail)
    with caplog.at_level(logging.WARNING, logger="fesd_robot"):
        outputs.write_optional_files(read_plan(finished.folder), load_task(task), tmp_path)
    assert "plan.html could not be written: no pixels left" in caplog.text
    assert [file.name for file in tmp_path.iterdir()] == ["figures"]


def test_files_that_are_not_asked_for_are_not_written(finished: Any, task: Path, tmp_path: Path) -> None:
    """`output.page` and `output.figures` are obeyed."""
    asked = load_task(task, ["output.page=false", "output.figures=false"])
    outputs.write_optional_files(read_plan(finished.folder), asked, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_page_is_made_of_an_iterate_whose_clock_steps_back(finished: Any, task: Path, tmp_path: Path) -> None:
    """A plan that is not solved may break the clock, and is shown all the same."""
    plan = read_plan(finished.folder)
    time = plan.trajectory.time.copy()
    time[2] = time[3] + 0.01
    broken = plan.model_copy(
        update={
            "trajectory": plan.trajectory.model_copy(update={"time": time}),
            "status": plan.status.model_copy(update={"solved": False}),
        }
    )
    assert outputs.write_page(broken, load_task(task), tmp_path / "plan.html").is_file()


def test_the_summary_says_what_the_replay_notes(finished: Any) -> None:
    """What the audit's replay notes about a solved plan is a line of its own below the verdict."""
    plan = read_plan(finished.folder)
    noted = Finding(entry="replay", time=0.1, interval=1, sentence="From t = 0.1 s on feet hit in turn.")
    audit = plan.audit.model_copy(update={"findings": [noted]})
    lines = summary(plan.model_copy(update={"audit": audit}), finished.folder, Path("there"))
    assert lines[1] == "note: From t = 0.1 s on feet hit in turn."
    assert not any(line.startswith("note:") for line in summary(plan, finished.folder, Path("there")))


def test_the_summary_stays_short_with_many_contacts(finished: Any) -> None:
    """Of many contacts three are shown, and how many more there are."""
    plan = read_plan(finished.folder)
    assert plan.outcome is not None
    foot = plan.outcome.contacts["foot"]
    outcome = plan.outcome.model_copy(update={"contacts": {f"foot {i}": foot for i in range(6)}})
    many = plan.model_copy(update={"outcome": outcome})
    lines = summary(many, finished.folder, Path("there"))
    assert len(lines) == 8 and lines[5] == "and 3 more contacts, see report.md"
    assert lines[-1].startswith("written to there: plan.json, ")
