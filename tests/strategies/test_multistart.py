"""Several initial guesses: perturbed by seeds, solved in parallel, the cheapest plan kept; earlier plans as guesses."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.planner import plan
from fesd_robot.plans import Plan, write_plan
from fesd_robot.plans.report import report
from fesd_robot.task import Task

Load = Callable[..., Task]


def _initial_guess(task: Task) -> np.ndarray:
    motion = formulate(task)
    return Transcription(motion.ocp, motion.fesd).problem.start


def test_a_seed_perturbs_the_initial_guess(load_short: Load) -> None:
    """Seed 0 changes nothing, any other one the inside of the motion, the same one always alike."""
    plain, one, again, two = (_initial_guess(load_short(f"solver.seed={seed}")) for seed in (0, 1, 1, 2))
    np.testing.assert_array_equal(plain, _initial_guess(load_short()))
    np.testing.assert_array_equal(one, again)
    assert 1e-3 < np.abs(one - plain).max() < 10 and np.abs(two - one).max() > 1e-3
    np.testing.assert_array_equal(one[:8], plain[:8])


@pytest.fixture(scope="module")
def two_starts(load_short: Load) -> Plan:
    return plan(load_short("solver.starts=2"))


def test_the_cheapest_start_is_kept(two_starts: Plan) -> None:
    """Both starts are listed with their seeds, and the plan is the cheaper of those that were solved."""
    attempts = two_starts.statistics.attempts
    assert [one.changes for one in attempts] == [{"solver.seed": 0}, {"solver.seed": 1}]
    costs = [one.objective for one in attempts if one.solved]
    assert two_starts.status.solved and two_starts.statistics.objective == min(costs)
    assert "### Attempts" in report(two_starts) and ("median" in report(two_starts)) == (len(costs) > 1)


def test_a_stop_ends_all_starts(load_short: Load) -> None:
    """A stop while the starts run leaves no process behind, and a plan that is not solved or a start that was done."""
    calls: list[float] = []

    def stop(iteration: int, objective: float) -> bool:
        calls.append(objective)
        return True

    stopped = plan(load_short("solver.starts=2", "solver.retries=0"), stop=stop)
    assert calls and math.isnan(calls[0])
    assert not stopped.status.solved or stopped.statistics.attempts


def test_a_plan_is_an_initial_guess_on_another_grid(two_starts: Plan, load_short: Load, tmp_path: Path) -> None:
    """The initial guess follows the earlier motion, stretched to the new duration, whatever the number of intervals."""
    folder = write_plan(two_starts, tmp_path / "earlier")
    motion = formulate(load_short(f"solver.warm_start={folder}", "horizon.intervals=5", "horizon.duration=0.4"))
    q, time = two_starts.trajectory.configuration, two_starts.trajectory.time
    for fraction in (0.25, 0.6):
        wanted = [np.interp(0.2 * fraction, time, q[name]) for name in ("root_x", "root_z", "root_pitch", "leg")]
        np.testing.assert_allclose(motion.ocp.state_guess(0.4 * fraction)[:4], wanted, atol=1e-9)
    np.testing.assert_array_equal(motion.reference.configuration(0.4)[0], 0.12)


def test_a_missing_initial_guess_is_an_error(load_short: Load, tmp_path: Path) -> None:
    """A file that is not there ends with its key and path."""
    with pytest.raises(TaskError, match=r"solver\.warm_start.*nowhere"):
        formulate(load_short(f"solver.warm_start={tmp_path / 'nowhere'}"))
