"""A plan that is read fits together: lengths, names, finite numbers, times, and the task in it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.plans import PlanFileError, read_plan, task_of
from fesd_robot.plans.consistency import check_task_and_robot, inconsistencies

PLANS = sorted((Path(__file__).parents[1] / "render" / "plans").glob("*.json"))
JUMP = next(file for file in PLANS if file.stem == "hopper_one_jump")


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.stem)
def test_plans_are_consistent(file: Path) -> None:
    """Plans of the program, also of earlier versions, have nothing that does not fit."""
    assert list(inconsistencies(read_plan(file))) == []


def _set(*path: Any, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(data: Any) -> None:
        for part in path[:-1]:
            data = data[part]
        data[path[-1]] = to(data[path[-1]]) if callable(to) else to

    return change


WRONG: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (
        _set("trajectory", "time", to=lambda time: time[:-1]),
        r"trajectory\.configuration\.\w+: found \d+ entries, expected",
    ),
    (_set("trajectory", "time", to=[]), "trajectory.time: found no number"),
    (_set("trajectory", "time", to=lambda time: time[::-1]), "trajectory.time: found .* s behind .* s at entry 1"),
    (_set("trajectory", "time", to=lambda time: ["NaN", *time[1:]]), "trajectory.time: found nan at entry 0"),
    (_set("trajectory", "time", to=lambda time: ["x", *time[1:]]), "trajectory.time: .*expected a list of numbers"),
    (_set("trajectory", "time", to=lambda time: [10**400, *time[1:]]), "trajectory.time: .*expected a list of numbers"),
    (_set("trajectory", "velocity", to=lambda all: dict([*all.items()][1:])), "units.velocity: found '"),
    (_set("controls", to=lambda all: {n: v for n, v in all.items() if n != "time"}), "controls: found no 'time'"),
    (_set("controls", "time", to=lambda time: [*time[:-1], time[0]]), "controls.time: found .* behind"),
    (_set("units", "controls", to={}), "units.controls: found no '"),
    (
        _set("contacts", to=lambda all: {"paw": next(iter(all.values()))}),
        "contacts: found 'paw', expected a name of task.con",
    ),
    (_set("contacts", "foot", "gap", to=[1.0]), "contacts.foot.gap: found 1 entries"),
    (_set("contacts", "foot", "mode", to=lambda mode: mode[1:]), "contacts.foot.mode: found"),
    (_set("switches", 0, "contact", to="paw"), "switches: found 'paw', expected a name of contacts"),
    (_set("switches", 0, "time", to=99.0), "switches.0.time: found 99 s, expected one from 0 to"),
    (_set("task", "goal", to="there"), "task: goal: found the text 'there'"),
    (_set("task", "costs", to={"control": 3}), "task: costs.control: found 3"),
    (_set("task", to={}), "task: "),
]


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_what_does_not_fit_is_named(change: Callable[[dict[str, Any]], None], message: str, tmp_path: Path) -> None:
    """One sentence with the file, the entry, what was found and what would be valid."""
    data, file = json.loads(JUMP.read_text(encoding="utf-8")), tmp_path / "plan.json"
    change(data)
    file.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(PlanFileError, match=message) as caught:
        read_plan(file)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)


def test_a_failed_solve_may_leave_numbers_that_are_none(tmp_path: Path) -> None:
    """A plan that is not solved is read with them; its lengths and names have to fit all the same."""
    data, file = json.loads(JUMP.read_text(encoding="utf-8")), tmp_path / "plan.json"
    data["status"]["solved"] = False
    data["trajectory"]["time"][1] = "NaN"
    file.write_text(json.dumps(data), encoding="utf-8")
    assert not read_plan(file).status.solved


def test_a_plan_of_another_robot_is_refused() -> None:
    """Coordinates of the robot that the plan does not have are named."""
    from fesd_robot.ocp import load_task_robot
    from fesd_robot.task import load_task

    plan = read_plan(JUMP)
    check_task_and_robot(plan, *load_task_robot(load_task("hopper_one_jump")))
    with pytest.raises(PlanFileError, match=r"hopper_one_jump: trajectory\.configuration: found no '"):
        check_task_and_robot(plan, *load_task_robot(load_task("wheel_hills")))
    assert task_of(plan).name == plan.name
