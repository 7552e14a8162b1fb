"""Several initial guesses: perturbed by their seeds, solved side by side, the cheapest kept; or an earlier plan."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.planner import plan
from fesd_robot.plans import Plan, write_plan
from fesd_robot.plans.report import report
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"
SMALL = [
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "goal.configuration.root_x=0.12",
    "reference={type: line}",
    "solver.tolerance=1e-6",
]


def _start(*changes: str) -> np.ndarray:
    motion = formulate(load_task(TASK, [*SMALL, *changes]))
    return Transcription(motion.ocp, motion.fesd).problem.start


def test_a_seed_perturbs_the_initial_guess() -> None:
    """Seed 0 changes nothing, every other one the inside of the motion, the same one always alike."""
    plain, one, again, two = (_start(f"solver.seed={seed}") for seed in (0, 1, 1, 2))
    np.testing.assert_array_equal(plain, _start())
    np.testing.assert_array_equal(one, again)
    assert 1e-3 < np.abs(one - plain).max() < 10 and np.abs(two - one).max() > 1e-3
    np.testing.assert_array_equal(one[:8], plain[:8])


@pytest.fixture(scope="module")
def found() -> Plan:
    return plan(load_task(TASK, [*SMALL, "solver.starts=2"]))


def test_the_cheapest_start_is_kept(found: Plan) -> None:
    """Both starts are written down with their seeds, and the plan is the cheaper of those that were solved."""
    attempts = found.statistics.attempts
    assert [one.changes for one in attempts] == [{"solver.seed": 0}, {"solver.seed": 1}]
    costs = [one.objective for one in attempts if one.solved]
    assert found.status.solved and found.statistics.objective == min(costs)
    assert "### Attempts" in report(found) and ("median" in report(found)) == (len(costs) > 1)


def test_a_stop_ends_all_starts() -> None:
    """A stop while the starts run leaves no process behind, and a plan that is not solved or a start that was done."""
    calls: list[float] = []

    def stop(iteration: int, objective: float) -> bool:
        calls.append(objective)
        return True

    stopped = plan(load_task(TASK, [*SMALL, "solver.starts=2", "solver.retries=0"]), stop=stop)
    assert calls and math.isnan(calls[0])
    assert not stopped.status.solved or stopped.statistics.attempts


def test_a_plan_is_an_initial_guess_on_another_grid(found: Plan, tmp_path: Path) -> None:
    """The initial guess follows the earlier motion, stretched to the new duration, with any number of intervals."""
    folder = write_plan(found, tmp_path / "earlier")
    changes = [*SMALL, f"solver.warm_start={folder}", "horizon.intervals=5", "horizon.duration=0.4"]
    motion = formulate(load_task(TASK, changes))
    q, time = found.trajectory.configuration, found.trajectory.time
    for share in (0.25, 0.6):
        wanted = [np.interp(0.2 * share, time, q[name]) for name in ("root_x", "root_z", "root_pitch", "leg")]
        np.testing.assert_allclose(motion.ocp.state_guess(0.4 * share)[:4], wanted, atol=1e-9)
    np.testing.assert_array_equal(motion.reference.configuration(0.4)[0], 0.12)


def test_a_missing_initial_guess_is_an_error(tmp_path: Path) -> None:
    """A file that is not there ends with its key and path."""
    with pytest.raises(TaskError, match=r"solver\.warm_start.*nowhere"):
        formulate(load_task(TASK, [*SMALL, f"solver.warm_start={tmp_path / 'nowhere'}"]))
