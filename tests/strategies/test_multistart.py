"""Several initial guesses: perturbed by seeds, solved in parallel, the cheapest plan kept; earlier plans as guesses."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot import planner
from fesd_robot.errors import TaskError
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.planner import plan
from fesd_robot.plans import Plan, write_plan
from fesd_robot.plans.report import report
from fesd_robot.strategies import multistart
from fesd_robot.strategies.attempts import NoCoarserMotion, Stop
from fesd_robot.strategies.multistart import starts_of
from fesd_robot.strategies.processes import cores_for
from fesd_robot.strategies.stations import Station
from fesd_robot.task import Task

Load = Callable[..., Task]
Patch = pytest.MonkeyPatch


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


class Started:
    """Notes the seeds of the starts that it is told of."""

    def __init__(self) -> None:
        self.seeds: list[int] = []

    def __call__(self, seed: int, result: Plan) -> None:
        self.seeds.append(seed)


@pytest.fixture
def started() -> Started:
    return Started()


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


def test_two_starts_are_the_default(load_short: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    """A task is solved from two guesses, from one if it begins from an earlier motion, or from as many as it says."""
    monkeypatch.setattr(multistart, "DEFAULT_STARTS", 2)
    assert starts_of(load_short()) == 2 and starts_of(load_short("solver.starts=5")) == 5
    assert starts_of(load_short("solver.warm_start=earlier")) == 1
    assert starts_of(load_short("solver.warm_start=earlier", "solver.starts=3")) == 3


class Costs:
    """In place of `planner.attempt`: plans that are named after when they were begun, with a cost for each seed.

    Args:
        plan: a plan that is solved.
        costs: of the seeds; not solved where there is none, and not a number where the coarser grid leads nowhere.
        seconds: that each seed takes.
    """

    def __init__(self, plan: Plan, costs: Sequence[float | None], seconds: Sequence[float] = (2e-3,) * 3) -> None:
        self._plan, self._costs, self._seconds = plan, costs, seconds

    def __call__(self, task: Task, *, strictly: bool, **_: Any) -> Plan:
        begin, cost = time.monotonic(), self._costs[task.solver.seed]
        assert strictly == (task.solver.seed == 2)
        if cost is not None and np.isnan(cost):
            raise NoCoarserMotion("nowhere")
        time.sleep(self._seconds[task.solver.seed])
        status = self._plan.status.model_copy(update={"solved": cost is not None})
        numbers = self._plan.statistics.model_copy(update={"objective": cost or 2.0})
        return self._plan.model_copy(update={"name": str(begin), "status": status, "statistics": numbers})


@pytest.mark.parametrize("processes", [1, 2, 3])
@pytest.mark.parametrize(
    ("overrides", "costs", "seeds"),
    [
        ([], (1.0, 0.5, 1.0005), [0, 2]),
        ([], (1.0, 0.9, 0.5), [0, 1, 2]),
        ([], (1.0, 0.9, None), [0, 1, 2]),
        ([], (None, 0.9, 0.5), [0, 1, 2]),
        ([], (None, 0.9, None), [0, 1, 2]),
        ([], (1.0, 1.0, np.nan), [0, 1]),
        (["solver.starts=2"], (1.0, 0.9, 0.5), [0, 1]),
        (["solver.coarse_to_fine=false"], (1.0, 0.9, 0.5), [0, 1]),
        (["horizon.intervals=7"], (1.0, 0.9, 0.5), [0, 1]),
    ],
)
def test_a_third_start_is_made_where_two_disagree(
    short_plan: Plan,
    load_short: Load,
    started: Started,
    monkeypatch: Patch,
    overrides: list[str],
    costs: tuple[float | None, ...],
    seeds: list[int],
    processes: int,
) -> None:
    """The second begins on a coarser control grid; where it costs another amount than the first, or one of them is not
    solved, or the coarser grid leads to no motion, another guess is made.

    The coarser grid is not used if the task says how many starts, or if none fits. That is so one after the other and
    beside each other.
    """
    monkeypatch.setattr(multistart, "DEFAULT_STARTS", 2)
    monkeypatch.setattr(planner, "attempt", Costs(short_plan, costs))
    task = load_short("horizon.intervals=8", f"solver.processes={processes}", "solver.retries=0", *overrides)
    result = plan(task, started=started)
    assert sorted(started.seeds) == seeds
    coarse = [one.changes.get("solver.coarse_to_fine", False) for one in result.statistics.attempts]
    assert coarse == [seed == 2 for seed in seeds]
    assert result.statistics.settings_tried == 1


@pytest.mark.parametrize("seconds", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_a_third_start_begins_on_a_free_core(
    short_plan: Plan, load_short: Load, monkeypatch: Patch, seconds: tuple[float, ...]
) -> None:
    """Where one of two starts beside each other has ended, it is begun before the other has, whichever that is."""
    begun: dict[int, float] = {}
    announced: list[int] = []
    monkeypatch.setattr(multistart, "DEFAULT_STARTS", 2)
    monkeypatch.setattr(planner, "attempt", Costs(short_plan, (1.0, 0.9, 0.5), seconds))
    task = load_short("horizon.intervals=8", "solver.processes=2")
    plan(task, starting=announced.append, started=lambda seed, result: begun.update({seed: float(result.name)}))
    assert begun[1] < begun[seconds.index(1.0)] + 1.0 and announced == [2]


@pytest.mark.parametrize(("processes", "share"), [(1, 1), (2, 1), (4, 2)])
def test_starts_divide_the_cores(
    short_plan: Plan, load_short: Load, monkeypatch: Patch, processes: int, share: int
) -> None:
    """While another start works beside it a start has its share of the task's cores, and all of them afterwards."""
    shares: list[int] = []

    def attempt(task: Task, **_: object) -> Plan:
        time.sleep(1.0 if multiprocessing.parent_process() else 0.3)  # the other has begun by then, and has not ended
        shares.append(cores_for(task).share)
        return short_plan

    monkeypatch.setattr(planner, "attempt", attempt)
    task = load_short("solver.starts=2", f"solver.processes={processes}")
    plan(task)
    assert shares[0] == share and cores_for(task).share == processes


def test_no_third_start_begins_after_the_time_limit(
    short_plan: Plan, load_short: Load, started: Started, monkeypatch: Patch
) -> None:
    """Two that disagree and take all the time are the only ones."""
    monkeypatch.setattr(multistart, "DEFAULT_STARTS", 2)
    monkeypatch.setattr(planner, "attempt", Costs(short_plan, (1.0, 0.9, 0.5), (0.2, 0.0, 2.0)))
    plan(load_short("horizon.intervals=8", "solver.processes=1", "solver.time_limit=2.0"), started=started)
    assert started.seeds == [0, 2]


@pytest.mark.parametrize("processes", [1, 2, 4])
def test_how_many_cores_are_free_changes_nothing(
    two_starts: Plan, load_short: Load, processes: int, started: Started
) -> None:
    """One after the other or beside each other: the same attempts, to the last bit, each told of when it is there."""
    again = plan(load_short("solver.starts=2", f"solver.processes={processes}"), started=started)
    costs = [[one.objective for one in each.statistics.attempts] for each in (two_starts, again)]
    assert costs[0] == costs[1] and again.statistics.objective == two_starts.statistics.objective
    assert sorted(started.seeds) == [0, 1] and started.seeds[0] == 0


def test_more_starts_than_cores(load_short: Load, started: Started) -> None:
    """Where there are fewer cores than starts this process makes some more of them, and none is made twice."""
    result = plan(load_short("solver.starts=4", "solver.processes=2", "solver.local_search=false"), started=started)
    assert [one.changes["solver.seed"] for one in result.statistics.attempts] == [0, 1, 2, 3]
    assert sorted(started.seeds) == [0, 1, 2, 3]


def test_a_stop_ends_all_starts(load_short: Load) -> None:
    """A stop while the starts run leaves no process behind, and a plan that is not solved."""
    calls: list[float] = []

    def stop(iteration: int, objective: float) -> bool:
        calls.append(objective)
        return True

    stopped = plan(load_short("solver.starts=2", "solver.retries=0", "solver.processes=2"), stop=stop)
    ended = time.monotonic() + 10.0
    while multiprocessing.active_children() and time.monotonic() < ended:
        time.sleep(0.05)
    assert calls and multiprocessing.active_children() == []
    assert not stopped.status.solved and len(stopped.statistics.attempts) <= 2


def test_a_stop_asks_others_for_what_they_have(load_short: Load, started: Started) -> None:
    """A start in another process sees the stop and hands over the best it has; here that is cheaper, and kept."""

    def slowly(task: Task, *, stop: Stop, **_: Any) -> Plan:
        if not task.solver.seed:
            return own
        for _second in range(600):
            if stop(0, float("nan")):
                break
            time.sleep(0.1)
        return cheaper

    own = plan(load_short("solver.starts=1"))
    cost = own.statistics.model_copy(update={"objective": own.statistics.objective - 1})
    cheaper = own.model_copy(update={"statistics": cost})
    stations: list[Station] = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(planner, "attempt", slowly)
        result = plan(
            load_short("solver.starts=2", "solver.processes=2"),
            stop=lambda *_: Station.WAITING in stations,
            started=started,
            station=stations.append,
        )
    assert started.seeds == [0, 1]
    assert result.status.solved and result.statistics.objective == cheaper.statistics.objective


def test_a_stop_while_others_are_waited_for_keeps_what_is_there(load_short: Load, started: Started) -> None:
    """Once this process has made its own start, others that do not stop in time are ended, and its plan is kept."""

    def slowly(task: Task, **_: Any) -> Plan:
        if task.solver.seed:
            time.sleep(60)
        return own

    own = plan(load_short("solver.starts=1"))
    stations: list[Station] = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(planner, "attempt", slowly)
        patched.setattr(multistart, "PATIENCE", 0.5)
        result = plan(
            load_short("solver.starts=2", "solver.processes=2"),
            stop=lambda *_: Station.WAITING in stations,
            started=started,
            station=stations.append,
        )
    assert result.status.solved and started.seeds == [0] and len(result.statistics.attempts) == 1


def test_no_start_begins_after_the_time_limit(load_short: Load, started: Started, monkeypatch: Patch) -> None:
    """One after the other: where the first takes all the time there is no second."""
    own = plan(load_short("solver.starts=1"))

    def attempt(task: Task, **_: Any) -> Plan:
        assert task.solver.time_limit is not None and task.solver.time_limit <= 0.3
        time.sleep(0.3)
        return own

    monkeypatch.setattr(planner, "attempt", attempt)
    plan(load_short("solver.starts=2", "solver.processes=1", "solver.time_limit=0.3"), started=started)
    assert started.seeds == [0]


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
