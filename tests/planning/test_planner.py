"""The whole chain on a task of two intervals: from the file to a plan that is solved, audited and complete."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import NlpReport
from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.phases import SequenceSearch
from fesd_robot.planning.chain import Chain
from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.audit_record import ENTRIES
from fesd_robot.task import Task

REQUIRED = {
    "": "schema_version task status audit trajectory controls contacts switches statistics provenance",
    "status": "solved nlp complementarity constraint_violation stationarity",
    "audit": "min_gap max_gap_drift max_clock_error max_theta_sum_error max_friction_cone_violation",
    "trajectory": "time configuration velocity",
    "trajectory.configuration": "root_x root_z root_pitch leg",
    "trajectory.velocity": "root_x root_z root_pitch leg",
    "controls": "time reaction_torque leg_force",
    "contacts": "foot",
    "contacts.foot": "gap normal_force tangential_force mode",
    "statistics": "variables constraints pairs iterations build_seconds solve_seconds homotopy",
    "provenance": "versions git created folder",
}


def test_it_is_solved(short_plan: Plan) -> None:
    """NLP, complementarity, feasibility and physics agree that the plan can be relied on."""
    status = short_plan.status
    assert status.solved and status.audit_passed and status.nlp == "converged", status.message
    assert status.stationarity != "unknown" and status.b_stationary in ("certified", "refuted")
    assert status.exact and status.complementarity <= 1e-12
    assert status.constraint_violation <= 1e-8
    assert short_plan.audit.violations == []
    assert {**short_plan.audit.tolerances, "max_energy_error": ENTRIES["max_energy_error"].tolerance} == {
        name: entry.tolerance for name, entry in ENTRIES.items()
    }
    assert status.message.startswith("Solved to complementarity")


def test_plan_json_is_complete(short_plan: Plan, tmp_path: Path) -> None:
    """The file holds every key that readers rely on, and reading it gives the plan back."""
    folder = write_plan(short_plan, tmp_path / "run")
    data = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    for path, keys in REQUIRED.items():
        part = data
        for key in filter(None, path.split(".")):
            part = part[key]
        assert set(keys.split()) <= set(part), path
    again = read_plan(folder)
    assert again.trajectory.configuration["leg"].tolist() == short_plan.trajectory.configuration["leg"].tolist()
    assert again.status == short_plan.status


def test_the_motion_keeps_to_the_task(short_plan: Plan, short_task: Task) -> None:
    """It starts where the task says, ends with the clock, respects limits, and moves towards the goal."""
    trajectory = short_plan.trajectory
    start = {name: values[0] for name, values in trajectory.configuration.items()}
    assert start == pytest.approx({"root_x": 0.1, "root_z": 0.5, "root_pitch": 0, "leg": 0.5}, abs=1e-12)
    assert all(values[0] == 0 for values in trajectory.velocity.values())
    assert trajectory.time[0] == 0 and trajectory.time[-1] == pytest.approx(0.2, abs=1e-8)
    assert (np.diff(trajectory.time) >= 0).all()
    assert trajectory.configuration["root_x"][-1] == pytest.approx(0.12, abs=0.01)
    assert trajectory.configuration["leg"].max() <= 0.5 + 1e-9
    assert short_plan.controls["time"].tolist() == [0, 0.1]
    for name in ("reaction_torque", "leg_force"):
        assert short_plan.controls[name].shape == (2,) and np.abs(short_plan.controls[name]).max() <= 50
    assert short_plan.task == short_task.model_dump(mode="json") and short_plan.name == "published_hopper_one_jump"


def test_the_foot_carries_the_robot(short_plan: Plan) -> None:
    """The true gap is not negative, forces push only where the foot touches and stay within the friction cone."""
    foot = short_plan.contacts["foot"]
    touching = np.array([mode in ("stick", "slip") for mode in foot.mode])
    assert len(foot.mode) == len(short_plan.trajectory.time) == len(foot.gap)
    assert foot.gap.min() >= -1e-3
    assert (foot.normal_force >= -1e-2).all()
    assert (foot.normal_force[~touching] == 0).all() and foot.normal_force.max() > 1
    assert (np.abs(foot.tangential_force) <= 0.45 * foot.normal_force + 1e-2).all()


def test_statistics_are_those_of_the_solve(short_planned: tuple[Plan, list[NlpReport]], short_task: Task) -> None:
    """Every NLP is reported as it was reported, the cost terms add up to the objective, sizes are counted."""
    short_plan, reports = short_planned
    statistics = short_plan.statistics
    assert [(s.sigma, s.status, s.iterations) for s in statistics.homotopy] == [
        (r.sigma, r.status, r.iterations) for r in reports
    ]
    relaxed = [(s.sigma, s.velocity_level_sigma) for s in statistics.homotopy if s.sigma > 0]
    assert relaxed == homotopy_options(short_task).sigmas()[: len(relaxed)]
    assert statistics.search is None
    assert statistics.iterations == sum(report.iterations for report in reports)
    last = statistics.homotopy[-1]
    assert short_plan.status.exact and last.sigma == last.velocity_level_sigma == 0
    assert sum(statistics.cost_terms.values()) == pytest.approx(statistics.objective, rel=1e-9)
    # 10 states and 3 multipliers: the start, and for both intervals 3 controls; an element has a step and its stages.
    assert statistics.refinement is not None and statistics.stages is not None
    assert statistics.variables == 13 + 2 * 3 + statistics.refinement.elements * (1 + statistics.stages * 13)
    assert statistics.build_seconds > 0 and statistics.solve_seconds > 0


def test_a_search_says_what_it_tried(load_short: Callable[..., Task]) -> None:
    """On a grid that moves: every sequence that was kept costs less than those before, and the plan is of the last."""
    found = plan(load_short("method.grid=phases"))
    search = found.statistics.search
    assert found.status.solved and search is not None and search.trials == len(search.sequences) > 1
    kept = [one.cost for one in search.sequences if one.kept]
    costs = [cost for cost in kept if cost is not None]
    assert len(kept) == len(costs) == len(search.moves) > 1 and costs == sorted(costs, reverse=True)
    assert costs[0] == pytest.approx(search.cost_before) and search.iterations > 0
    assert found.statistics.objective == pytest.approx(costs[-1], rel=1e-3)


def test_a_first_plan_is_there_while_others_are_looked_for(
    load_short: Callable[..., Task], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is solved, audited and whole, has no certificate yet, and the plan in the end costs no more."""
    early: list[Plan] = []
    improve = SequenceSearch.improve

    def slowly(search: SequenceSearch) -> None:
        begin = time.monotonic()
        while not early and time.monotonic() - begin < 60.0:
            search.on_progress(0, None)
            time.sleep(0.05)
        improve(search)

    monkeypatch.setattr(SequenceSearch, "improve", slowly)
    last = plan(load_short("method.grid=phases"), early=early.append)
    (first,) = early
    assert first.status.solved and first.status.audit_passed and first.status.b_stationary == "unknown"
    assert last.status.solved and last.statistics.objective <= first.statistics.objective
    assert first.finite_elements is not None and first.replay is not None


def test_what_happens_in_an_earlier_plan_is_tried_first(load_short: Callable[..., Task]) -> None:
    """It is solved before all guesses, in the motion of that plan; one without elements is passed over."""
    task = load_short("method.grid=phases")
    first = plan(task)
    again = plan(task, earlier=first).statistics.search
    other = plan(task, earlier=first.model_copy(update={"finite_elements": None})).statistics.search
    assert first.statistics.search and again and other and again.sequences and other.sequences
    assert again.sequences[0].what == "plan that was there" and again.sequences[0].kept
    kept = [one for one in first.statistics.search.sequences or [] if one.kept]
    assert again.sequences[0].sequence == kept[-1].sequence
    assert again.sequences[0].cost == pytest.approx(kept[-1].cost, rel=1e-4)
    assert not any(one.what == "plan that was there" for one in other.sequences)


def test_provenance(short_plan: Plan) -> None:
    """Versions of what the numbers depend on, the state of the sources, and a time with its zone."""
    assert {"python", "casadi", "pin", "numpy", "fesd-robot"} <= set(short_plan.provenance.versions)
    assert short_plan.provenance.git
    assert short_plan.provenance.created.endswith("+00:00")


def test_an_interrupted_plan_is_whole_and_marked(short_task: Task) -> None:
    """Stopped after a few iterations, the best iterate comes back as a plan of all parts that says it is not solved."""
    stopped = plan(short_task, stop=lambda iteration, objective: iteration >= 5)
    assert not stopped.status.solved
    assert stopped.status.nlp == "interrupted"
    assert stopped.status.message.startswith("Not solved: interrupted")
    assert len(stopped.trajectory.time) == len(stopped.contacts["foot"].mode) > 0
    assert all(np.isfinite(values).all() for values in stopped.trajectory.configuration.values())


def test_a_motion_that_is_too_coarse_is_refined(load_short: Callable[..., Task]) -> None:
    """With one stage an exact solution fails its audit; refined, it passes with every error as small as was asked."""
    coarse = load_short("method.stages=1", "solver.retries=0")
    fine = plan(coarse)
    assert fine.status.solved and fine.status.exact, fine.status.message
    refinement = fine.statistics.refinement
    assert refinement is not None and refinement.rounds > 0 and refinement.seconds > 0
    assert refinement.largest_local_error <= coarse.method.accuracy
    assert fine.statistics.stages > 1 and len(fine.statistics.attempts) == 1
    assert fine.task["method"]["stages"] == 1, "the task is what was asked for"
    alone = plan(load_short("method.stages=1", "solver.retries=0", "method.accuracy=none"))
    assert alone.status.exact and not alone.status.solved and alone.statistics.stages == 1
    assert alone.audit.violations and "physics audit failed" in alone.status.message
    assert alone.statistics.refinement is not None and alone.statistics.refinement.rounds == 0
    assert alone.statistics.refinement.largest_local_error > 1e-4
    assert fine.statistics.iterations > alone.statistics.iterations
    assert fine.statistics.variables > alone.statistics.variables


def test_accuracy_is_asked_for(load_short: Callable[..., Task]) -> None:
    """A smaller accuracy gives smaller errors, and what is accurate enough is not refined."""
    errors = []
    for accuracy in ("1e-3", "1e-5", "1e-9"):
        fine = plan(load_short(f"method.accuracy={accuracy}"))
        assert fine.status.exact and fine.statistics.refinement is not None, fine.status.message
        errors.append(fine.statistics.refinement.largest_local_error)
        assert errors[-1] <= float(accuracy)
    assert errors[2] < errors[1] < errors[0] or errors[2] < errors[0]


def test_the_start_touches_the_ground(load_short: Callable[..., Task]) -> None:
    """A start whose foot is 6 micrometres off the ground by rounding is moved by that much, so that it touches."""
    lifted = plan(load_short("initial.configuration.root_z=0.500006"))
    assert lifted.status.solved, lifted.status.message
    assert abs(lifted.contacts["foot"].gap[0]) <= 1e-9
    start = {name: values[0] for name, values in lifted.trajectory.configuration.items()}
    assert start["root_z"] == pytest.approx(0.500006, abs=7e-6)


def test_a_grid_that_stands_still_is_searched_once(
    load_short: Callable[..., Task], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no sequence leads to a motion, the end of the search on the task's own grid is not looked for again."""
    first, calls = Chain._first, list[int]()

    def counted(chain: Chain, motion: MotionProblem, transcription: Transcription) -> Any:
        calls.append(transcription.problem.size)
        return first(chain, motion, transcription)

    monkeypatch.setattr(Chain, "_first", counted)
    made = plan(load_short("goal.configuration.root_x=0.9", "goal.soft=false", "solver.retries=0"))
    assert not made.status.solved and len(calls) == 1
    assert made.statistics.iterations > 0 and made.statistics.variables == calls[0]
