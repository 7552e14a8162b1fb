"""The whole chain on a task of two intervals: from the file to a plan that is solved, audited and complete."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.mpcc import NlpReport
from fesd_robot.planner import homotopy_options, plan
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.audit_record import ENTRIES
from fesd_robot.task import Task, load_task

TASK = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"
SMALL = [
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "goal.configuration.root_x=0.12",
    "reference={type: line}",
    "solver.tolerance=1e-6",
]

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


@pytest.fixture(scope="module")
def task() -> Task:
    return load_task(TASK, SMALL)


@pytest.fixture(scope="module")
def reports() -> list[NlpReport]:
    return []


@pytest.fixture(scope="module")
def found(task: Task, reports: list[NlpReport]) -> Plan:
    """The plan, made once; `reports` holds what `progress` was told."""
    return plan(task, progress=reports.append)


def test_it_is_solved(found: Plan) -> None:
    """NLP, complementarity, feasibility and physics agree that the plan can be relied on."""
    status = found.status
    assert status.solved and status.audit_passed and status.nlp == "converged", status.message
    assert status.stationarity != "unknown" and status.b_stationary in ("certified", "refuted")
    assert status.exact and status.complementarity <= 1e-12
    assert status.constraint_violation <= 1e-8
    assert found.audit.violations == []
    assert {**found.audit.tolerances, "max_energy_error": ENTRIES["max_energy_error"].tolerance} == {
        name: entry.tolerance for name, entry in ENTRIES.items()
    }
    assert status.message.startswith("Solved to complementarity")


def test_plan_json_is_complete(found: Plan, tmp_path: Path) -> None:
    """The file holds every key that readers rely on, and reading it gives the plan back."""
    folder = write_plan(found, tmp_path / "run")
    data = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    for path, keys in REQUIRED.items():
        part = data
        for key in filter(None, path.split(".")):
            part = part[key]
        assert set(keys.split()) <= set(part), path
    again = read_plan(folder)
    assert again.trajectory.configuration["leg"].tolist() == found.trajectory.configuration["leg"].tolist()
    assert again.status == found.status


def test_the_motion_keeps_to_the_task(found: Plan, task: Task) -> None:
    """It starts where the task says, ends with the clock, respects limits, and moves towards the goal."""
    trajectory = found.trajectory
    start = {name: values[0] for name, values in trajectory.configuration.items()}
    assert start == pytest.approx({"root_x": 0.1, "root_z": 0.5, "root_pitch": 0, "leg": 0.5}, abs=1e-12)
    assert all(values[0] == 0 for values in trajectory.velocity.values())
    assert trajectory.time[0] == 0 and trajectory.time[-1] == pytest.approx(0.2, abs=1e-8)
    assert (np.diff(trajectory.time) >= 0).all()
    assert trajectory.configuration["root_x"][-1] == pytest.approx(0.12, abs=0.01)
    assert trajectory.configuration["leg"].max() <= 0.5 + 1e-9
    assert found.controls["time"].tolist() == [0, 0.1]
    for name in ("reaction_torque", "leg_force"):
        assert found.controls[name].shape == (2,) and np.abs(found.controls[name]).max() <= 50
    assert found.task == task.model_dump(mode="json") and found.name == "hopper_one_jump"


def test_the_foot_carries_the_robot(found: Plan) -> None:
    """The true gap is not negative, forces push only where the foot touches and stay within the friction cone."""
    foot = found.contacts["foot"]
    touching = np.array([mode in ("stick", "slip") for mode in foot.mode])
    assert len(foot.mode) == len(found.trajectory.time) == len(foot.gap)
    assert foot.gap.min() >= -1e-3
    assert (foot.normal_force >= -1e-2).all()
    assert (foot.normal_force[~touching] == 0).all() and foot.normal_force.max() > 1
    assert (np.abs(foot.tangential_force) <= 0.45 * foot.normal_force + 1e-2).all()


def test_statistics_are_those_of_the_solve(found: Plan, reports: list[NlpReport], task: Task) -> None:
    """Every NLP is reported as it was reported, the cost terms add up to the objective, sizes are counted."""
    statistics = found.statistics
    assert [(s.sigma, s.status, s.iterations) for s in statistics.homotopy] == [
        (r.sigma, r.status, r.iterations) for r in reports
    ]
    relaxed = [(s.sigma, s.velocity_level_sigma) for s in statistics.homotopy if s.sigma > 0]
    assert relaxed == homotopy_options(task).sigmas()[: len(relaxed)]
    assert statistics.iterations == sum(report.iterations for report in reports)
    assert found.status.exact and (statistics.homotopy[-1].sigma, statistics.homotopy[-1].velocity_level_sigma) == (
        0,
        0,
    )
    assert sum(statistics.cost_terms.values()) == pytest.approx(statistics.objective, rel=1e-9)
    # 10 states, 2 shares and what they leave: the start, and twice 3 controls and 3 elements of a step and 2 points.
    assert statistics.variables == 13 + 2 * (3 + 3 * (1 + 2 * 13))
    assert statistics.build_seconds > 0 and statistics.solve_seconds > 0


def test_provenance(found: Plan) -> None:
    """Versions of what the numbers depend on, the state of the sources, and a time with its zone."""
    assert {"python", "casadi", "pin", "numpy", "fesd-robot"} <= set(found.provenance.versions)
    assert found.provenance.git
    assert found.provenance.created.endswith("+00:00")


def test_an_interrupted_plan_is_whole_and_marked(task: Task) -> None:
    """Stopped after a few iterations, the best iterate comes back as a plan of all parts that says it is not solved."""
    stopped = plan(task, stop=lambda iteration, objective: iteration >= 5)
    assert not stopped.status.solved
    assert stopped.status.nlp == "interrupted"
    assert stopped.status.message.startswith("Not solved: interrupted")
    assert len(stopped.trajectory.time) == len(stopped.contacts["foot"].mode) > 0
    assert all(np.isfinite(values).all() for values in stopped.trajectory.configuration.values())
