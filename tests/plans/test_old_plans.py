"""Plans that an earlier version wrote are read under the names of today."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.errors import PlanFileError, TaskError
from fesd_robot.plans import Plan, read_plan, report, task_of, write_plan
from fesd_robot.plans.origin import GONE, GONE_VALUES
from fesd_robot.plans.plan import Attempt
from fesd_robot.plans.renamed_keys import RENAMED_PLAN_KEYS
from fesd_robot.task.renamed_keys import RENAMED_KEYS


def test_old_keys_are_read_as_those_of_today(plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The task in a plan.json with old keys is the task of today, with one warning that names the file and all keys."""
    file = write_plan(plan, tmp_path / "plan") / "plan.json"
    text = file.read_text(encoding="utf-8")
    for old, name in RENAMED_KEYS.items():
        assert text.count(f'"{name}":') == 1
        text = text.replace(f'"{name}":', f'"{old[-1]}":')
    file.write_text(text, encoding="utf-8")
    assert task_of(read_plan(file)) == task_of(plan)
    (record,) = caplog.records
    for old, name in RENAMED_KEYS.items():
        assert f"'{'.'.join(old)}' is now called '{'.'.join((*old[:-1], name))}'" in record.getMessage()
    assert record.getMessage().startswith(f"{file}: ") and record.levelname == "WARNING"


def test_a_plan_with_both_names_is_refused(plan: Plan, tmp_path: Path) -> None:
    """A key under its old and its new name is an error that names both and the file."""
    file = write_plan(plan, tmp_path / "plan") / "plan.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    data["task"]["solver"]["finish"] = True
    file.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(PlanFileError, match=r"plan\.json: task: found 'solver\.finish' beside 'solver\.polish'"):
        read_plan(file)


def test_old_keys_of_a_plan_are_read_as_those_of_today(
    plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Sigmas, cost terms and attempts with old names are those of today, with one warning that names the new ones."""
    attempt = Attempt(
        changes={"solver.loose_iterations": 66}, solved=True, objective=1.0, iterations=1, seconds=1.0, message=""
    )
    terms = {"regularisation of the step functions": 0.5, "control": 1.0}
    statistics = plan.statistics.model_copy(update={"cost_terms": terms, "attempts": [attempt]})
    today = plan.model_copy(update={"statistics": statistics})
    file = write_plan(today, tmp_path / "plan") / "plan.json"
    text = file.read_text(encoding="utf-8")
    for path, name in RENAMED_PLAN_KEYS.items():
        assert f'"{name}":' in text
        text = text.replace(f'"{name}":', f'"{path[-1]}":')
    file.write_text(text.replace("solver.loose_iterations", "solver.sketch_iterations"), encoding="utf-8")
    assert report(read_plan(file)) == report(today)
    assert read_plan(file).statistics == statistics
    message = caplog.records[0].getMessage()
    for path, name in RENAMED_PLAN_KEYS.items():
        assert message.count(f"'{path[-1]}' is now called '{name}'") == 1
    assert "\n" not in message and message.startswith(f"{file}: ")


def test_settings_that_are_gone_are_left_out(plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The task of a plan of version 0.1.0 is the task without them, in silence; the plan says how it was made."""
    gone: dict[tuple[str, ...], dict[str, Any]] = {
        ("solver",): {
            "starts": 3,
            "coarse_to_fine": True,
            "local_search": False,
            "steering": "direct",
            "schedule": "linear",
        },
        ("method",): {"cross_complementarity": "auto"},
        ("method", "formulation"): {
            "gap": "true",
            "gate": False,
            "step_regularisation_weight": 0.0,
            "step_selection_weight": 0.0,
        },
    }
    assert {path: tuple(keys) for path, keys in gone.items()} == GONE
    file = write_plan(plan, tmp_path / "plan") / "plan.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    for path, keys in gone.items():
        _section(data["task"], path).update(keys)
    file.write_text(json.dumps(data), encoding="utf-8")
    old = read_plan(file)
    assert task_of(old) == task_of(plan) and caplog.records == []
    for path, keys in gone.items():
        assert {key: _section(old.task, path)[key] for key in keys} == keys
    assert task_of(old, overrides=["solver.effort=quick"]).solver.effort == "quick"
    with pytest.raises(TaskError, match=r"solver\.starts: found an unknown key"):
        task_of(old, overrides=["solver.starts=2"])


@pytest.mark.parametrize("relaxation", GONE_VALUES["solver", "relaxation"])
def test_a_relaxation_that_is_gone_is_the_default(
    plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture, relaxation: str
) -> None:
    """A plan of version 0.1.0 says by which relaxation it was made, and its task has that of today's default."""
    file = write_plan(plan, tmp_path / "plan") / "plan.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    data["task"]["solver"]["relaxation"] = relaxation
    file.write_text(json.dumps(data), encoding="utf-8")
    old = read_plan(file)
    assert old.task["solver"]["relaxation"] == relaxation
    assert task_of(old) == task_of(plan) and caplog.records == []
    changed = task_of(old, overrides=["solver.relaxation=fischer_burmeister"])
    assert changed.solver.relaxation == "fischer_burmeister"
    with pytest.raises(TaskError, match=r"solver\.relaxation: found .*expected 'scholtes' or 'fischer_burmeister'"):
        task_of(old, overrides=[f"solver.relaxation={relaxation}"])


def test_a_relaxation_of_today_stays(plan: Plan) -> None:
    """The relaxation that a plan was made with, and that tasks have, is that of its task."""
    task = {**plan.task, "solver": {**plan.task["solver"], "relaxation": "fischer_burmeister"}}
    assert task_of(plan.model_copy(update={"task": task})).solver.relaxation == "fischer_burmeister"


def _section(task: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    for part in path:
        task = task[part]
    return task


def test_a_plan_of_today_is_read_in_silence(plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A plan without old keys is read without a word."""
    read_plan(write_plan(plan, tmp_path / "plan"))
    assert caplog.records == []
