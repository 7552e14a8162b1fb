"""A start from an earlier plan keeps its contact sequence, on any grid."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import grid, on_grid
from fesd_robot.mpcc import NlpReport
from fesd_robot.ocp import formulate
from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.starts.known import _known
from fesd_robot.task import Task, load_task

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"
SHORT_JUMP = ("horizon.duration=0.6", "goal.configuration.root_x=0.7", "solver.effort=quick", "solver.retries=0")


def short_jump(*overrides: str) -> Task:
    return load_task(TASK, ["method.grid=uniform", *SHORT_JUMP, *overrides])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short jump on eight intervals, without search."""
    result = plan(short_jump("horizon.intervals=8"))
    assert result.status.solved and result.status.exact
    return write_plan(result, tmp_path_factory.mktemp("known") / "jump")


def started(folder: Path, *overrides: str) -> tuple[Plan, list[NlpReport]]:
    """The plan that starts from the one in a folder, and its NLPs."""
    reports: list[NlpReport] = []
    return plan(short_jump(f"solver.warm_start={folder}", *overrides), progress=reports.append), reports


def sequence(result: Plan) -> list[str]:
    """What the foot does one after the other."""
    return [mode for mode, _ in groupby(result.contacts["foot"].mode)]


def test_the_same_task_is_its_own_solution(folder: Path) -> None:
    """From a plan of the same task, nothing is relaxed, and motion and cost come back."""
    again, reports = started(folder, "horizon.intervals=8")
    first = read_plan(folder)
    assert again.status.solved and all(report.sigma == 0 for report in reports)
    assert again.statistics.objective == pytest.approx(first.statistics.objective, rel=1e-3)
    assert sequence(again) == sequence(first)
    assert sum(report.iterations for report in reports) < first.statistics.iterations / 4


@pytest.mark.parametrize("intervals", [16, 24])
def test_a_finer_grid_costs_no_more(folder: Path, intervals: int) -> None:
    """On a grid that contains the plan's, the same contacts cost at most as much, to the accuracy of both."""
    finer, reports = started(folder, f"horizon.intervals={intervals}")
    assert finer.status.solved and all(report.sigma == 0 for report in reports)
    assert finer.statistics.objective <= read_plan(folder).statistics.objective * (1 + 1e-3)
    assert sequence(finer) == sequence(read_plan(folder))
    assert len(finer.controls["time"]) == intervals


def test_other_grids_durations_and_schemes_are_met(folder: Path) -> None:
    """The contact sequence serves a grid that does not contain the plan's, a longer time and more stages as well."""
    other, reports = started(folder, "horizon.intervals=9", "horizon.duration=0.64", "method.stages=3")
    assert other.status.solved and all(report.sigma == 0 for report in reports)
    assert other.trajectory.time[-1] == pytest.approx(0.64)


def test_a_seed_asks_for_another_start(folder: Path) -> None:
    """With a seed the plan is a perturbed initial guess as every file is, and pairs are relaxed."""
    _, reports = started(folder, "horizon.intervals=8", "solver.seed=1", "solver.time_limit=2")
    assert any(report.sigma > 0 for report in reports)


def test_other_states_are_no_start(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A plan whose contact may slip has not the states of a task in which it may not: a warning says what is taken."""
    task = load_task(
        TASK.parent / "hopper_one_jump.yaml",
        ["method.grid=uniform", f"solver.warm_start={folder}", "solver.time_limit=1"],
    )
    reports: list[NlpReport] = []
    plan(task, progress=reports.append)
    assert "only the configurations are taken" in caplog.text
    assert all(report.sigma > 0 for report in reports)


@pytest.mark.parametrize("intervals", [8, 16, 11])
def test_cut_elements_are_on_the_same_polynomials(folder: Path, intervals: int) -> None:
    """On any grid intervals end when the clock says, in states of the plan, and modes keep their order."""
    motion = formulate(short_jump(f"horizon.intervals={intervals}"))
    transcription = Transcription(motion.ocp, motion.fesd)
    record = read_plan(folder).finite_elements
    assert record is not None
    known = _known(record, transcription.ocp.system)
    assert known is not None
    cut = on_grid(known, transcription)
    fitted, elements, clock = cut.transcription, cut.elements, known.clock
    last = np.cumsum(fitted.elements) - 1
    ends = [elements[e].x[-1, clock] for e in last]
    assert ends == pytest.approx(0.6 * np.arange(1, intervals + 1) / intervals, abs=1e-8)
    assert [elements[e].end for e in last] == pytest.approx(0.6 * np.arange(1, intervals + 1) / intervals, abs=1e-9)
    modes = [mode for mode, _ in groupby(cut.branch.factors)]
    used = zip(known.branch.factors, known.branch.without_length, strict=True)
    assert modes == [mode for mode, _ in groupby(factors for factors, without in used if not without)]
    for e in last[:-1]:
        time, state = elements[e].x[-1, clock], elements[e].x[-1]
        own = [one for one in known.elements if one.x_left[clock] - 1e-7 <= time <= one.x[-1, clock] + 1e-7]
        fractions = [grid._fraction(known, one, time) for one in own]
        there = [
            one.at(known.tableau, np.array([one.start + at * one.step]))[0]
            for one, at in zip(own, fractions, strict=True)
        ]
        assert min(np.abs(at - state).max() for at in there) < 1e-6
