"""`fesd-robot plan` on a small real task: files, exit statuses, what it replaces and what it keeps."""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.cli.plan import EARLY
from fesd_robot.phases import SequenceSearch
from fesd_robot.plans import Plan, read_plan
from fesd_robot.render.verdict import verdict_of
from fesd_robot.running.activities import Activity

from .conftest import settings

FILES = ["figures", "plan.html", "plan.json", "report.md", "trajectory.csv", "trajectory.npz"]


def test_a_solved_task_leaves_all_files(finished: Any) -> None:
    """Exit status 0, every promised file, none of them empty, nothing beside them."""
    assert (finished.outcome.code, finished.outcome.err) == (0, "")
    assert sorted(file.name for file in finished.folder.iterdir()) == FILES
    assert all(file.stat().st_size > 0 for file in finished.folder.rglob("*") if file.is_file())
    assert list((finished.folder / "figures").glob("*.png"))
    assert [file.name for file in finished.folder.parent.iterdir()] == ["published_hopper_one_jump"]
    assert read_plan(finished.folder).status.solved


def test_the_run_ends_with_verdict_contacts_effort_and_paths(finished: Any) -> None:
    """After plain lines that say what is done come at most six that say what came of it and where it is."""
    assert all(len(line) < 80 for line in finished.outcome.out.splitlines())
    lines = finished.outcome.sentences.splitlines()
    plan = read_plan(finished.folder)
    doing = [line for line in lines if re.match(r" *\d+ s  ", line)]
    words = [re.sub(r" \d+ (of \d+|tried)$", "", line.partition(" s  ")[2].partition(",")[0]) for line in doing]
    assert [word for word in dict.fromkeys(words) if word != Activity.READING.value] == [
        activity.value for activity in Activity if activity not in (Activity.READING, Activity.IMPROVING)
    ]
    summary = lines[len(doing) :]
    assert 4 <= len(summary) <= 6
    assert summary[0] == f"published_hopper_one_jump: {plan.status.message}"
    assert summary[1].startswith("goal: position missed by ") and " m/s (" in summary[1]
    assert summary[2].startswith("foot: no flight; ")
    assert f"{plan.statistics.variables} variables" in summary[3]
    assert summary[-1] == "written to runs/published_hopper_one_jump: " + ", ".join(
        ["plan.json", "trajectory.csv", "trajectory.npz", "report.md", "plan.html", "figures/"]
    )


def test_a_search_is_shown_while_it_goes_on(run: Callable[..., Any], task: Path, small: list[str]) -> None:
    """On a grid that moves contacts are changed after a motion is found and before it is refined."""
    outcome = run("plan", task, "--out", "moving", *small, "--set", "method.grid=phases")
    assert outcome.code == 0, outcome.err
    places = [
        outcome.out.find(activity.value) for activity in (Activity.SEARCHING, Activity.IMPROVING, Activity.REFINING)
    ]
    assert places == sorted(places) and places[0] > 0


def test_the_page_shows_the_path_of_each_contact(finished: Any) -> None:
    """The page has the task's name, the verdict in words, the goal, and what the contact does."""
    page = (finished.folder / "plan.html").read_text(encoding="utf-8")
    assert "<title>published_hopper_one_jump" in page and "</i>path of foot</li>" in page
    assert verdict_of(read_plan(finished.folder)).sentence in page
    assert "<th>missed by</th>" in page and "<td>no flight; " in page


def test_an_earlier_plan_is_replaced_as_a_whole(
    run: Callable[..., Any], finished: Any, task: Path, small: list[str], tmp_path: Path
) -> None:
    """Files of the earlier plan that the new one does not have are gone; a file of the user's stays."""
    folder = tmp_path / "results"
    shutil.copytree(finished.folder, folder)
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    outcome = run("plan", task, "--out", folder, *small, "--set", "name=second", "--quiet")
    assert outcome == (0, "", "")
    assert sorted(file.name for file in folder.iterdir()) == sorted(
        ["notes.txt", "plan.json", "report.md", "trajectory.csv", "trajectory.npz"]
    )
    assert read_plan(folder).name == "second"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["results", "work"]


def test_what_is_not_solved_is_written_and_marked(
    run: Callable[..., Any], task: Path, small: list[str], tmp_path: Path
) -> None:
    """Exit status 3; the files are there, and each says that it is not solved."""
    outcome = run("plan", task, "--out", "stopped", *small, "--set", "solver.max_iterations=1")
    folder = tmp_path / "work" / "stopped"
    assert outcome.code == 3
    assert "Not solved: iteration limit" in outcome.out
    status = json.loads((folder / "plan.json").read_text(encoding="utf-8"))["status"]
    assert (status["solved"], status["nlp"]) == (False, "iteration limit")
    assert "Not solved" in (folder / "report.md").read_text(encoding="utf-8")
    assert len((folder / "trajectory.csv").read_text(encoding="utf-8").splitlines()) > 2


OUT_OF_REACH = ("horizon.duration=0.1", "horizon.intervals=1", "goal={configuration: {root_x: 1}}", "solver.retries=1")


def test_a_goal_out_of_reach_is_missed_in_so_many_words(
    run: Callable[..., Any], task: Path, small: list[str], tmp_path: Path
) -> None:
    """Exit status 3; the kept motion is audited but for the goal, and what ends where and is allowed is said."""
    outcome = run("plan", task, "--out", "missed", *small, *settings(OUT_OF_REACH))
    assert outcome.code == 3
    assert "Not solved: the goal is missed, root_x ends at 0.1" in outcome.out and "goal.tolerance" in outcome.out
    plan = read_plan(tmp_path / "work" / "missed")
    (x,) = [entry for entry in plan.outcome.goal if entry.name == "root_x"]
    assert (x.goal, x.tolerance, x.met) == (1.0, 0.01, False) and x.missed_by > 0.8
    words = f"root_x ends at {x.end:.4g} m, {x.missed_by:.3g} from 1 (0.01 allowed)"
    assert words in plan.status.message and words in outcome.sentences
    assert not plan.status.solved and plan.status.nlp == "converged" and plan.status.exact
    assert plan.audit.violations == ["max_goal_violation"] and plan.task["goal"]["soft"] is False
    assert [attempt.changes for attempt in plan.statistics.attempts][::2] == [{}, {"goal.soft": True}]
    assert [attempt.kept for attempt in plan.statistics.attempts] == [False, False, True]


def test_quiet_says_only_what_went_wrong(run: Callable[..., Any], task: Path, small: list[str]) -> None:
    """With --quiet stdout stays empty, and a plan that is not solved is reported on stderr."""
    outcome = run("plan", task, "--quiet", *small, "--set", "solver.max_iterations=1")
    assert (outcome.code, outcome.out) == (3, "")
    assert outcome.err.startswith("published_hopper_one_jump: Not solved")


@pytest.mark.parametrize(
    ("out", "words"), [("file", "is a file"), ("file/below", "is a file"), ("full", "holds files but no plan.json")]
)
def test_a_folder_that_cannot_take_results_stops_before_the_solve(
    run: Callable[..., Any], task: Path, small: list[str], tmp_path: Path, out: str, words: str
) -> None:
    """Exit status 2 at once: no activity after the first begins, and what is there stays as it was."""
    work = tmp_path / "work"
    (work / "file").write_text("mine", encoding="utf-8")
    (work / "full").mkdir()
    (work / "full" / "thesis.tex").write_text("mine", encoding="utf-8")
    outcome = run("plan", task, "--out", out, *small)
    assert (outcome.code, outcome.said) == (2, "")
    assert outcome.err.startswith("error: ") and words in outcome.err and "choose another --out" in outcome.err
    assert sorted(file.name for file in work.rglob("*")) == ["file", "full", "thesis.tex"]


def test_the_first_plan_is_written_while_cheaper_ones_are_looked_for(
    run: Callable[..., Any], task: Path, small: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is in the folder before the search ends, without figures, and says what it is; the last replaces it."""
    found: list[Plan] = []
    improve = SequenceSearch.improve

    def slowly(search: SequenceSearch) -> None:
        begin = time.monotonic()
        while not Path("early", "plan.json").exists() and time.monotonic() - begin < 60.0:
            search.on_progress(0, None)
            time.sleep(0.05)
        found.append(read_plan(Path("early")))
        assert not Path("early", "figures").exists()
        improve(search)

    monkeypatch.setattr(SequenceSearch, "improve", slowly)
    outcome = run("plan", task, "--out", "early", *small, "--set", "method.grid=phases")
    assert outcome.code == 0 and "a first plan, of cost " in outcome.out
    assert found[0].status.solved and found[0].status.message.endswith(EARLY)
    assert not read_plan(Path("early")).status.message.endswith(EARLY)
