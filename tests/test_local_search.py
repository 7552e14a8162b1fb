"""The local search on a real jump: what it finds is cheaper, true, and said in the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest

from fesd_robot import local_search
from fesd_robot.local_search import DETOUR_LOSS, MOST_DETOURS, SAME, Depth, _Search
from fesd_robot.mpcc import BranchPoint, BranchSolver, NlpReport, PolishingReport
from fesd_robot.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.task import load_task

TASK = Path(__file__).parents[1] / "tasks" / "published_hopper_one_jump.yaml"
LAST = len(local_search.TRIALS) - 1
SHORT_JUMP = ("horizon.duration=0.6", "horizon.intervals=8", "goal.configuration.root_x=0.6")


class Searched(NamedTuple):
    """A plan, and what its search said.

    Attributes:
        plan: of half a metre's jump, with search.
        told: the costs of the NLPs that were told while it was made.
    """

    plan: Plan
    told: list[float]


@pytest.fixture(scope="module")
def watched() -> Searched:
    """A search whose NLPs are noted."""
    reports: list[NlpReport] = []
    result = plan(load_task(TASK, ["method.grid=uniform", *list(SHORT_JUMP)]), progress=reports.append)
    return Searched(result, [report.residuals.objective for report in reports])


@pytest.fixture(scope="module")
def searched(watched: Searched) -> Plan:
    """The plan of it."""
    return watched.plan


def test_a_searched_plan_is_cheaper_and_true(searched: Plan) -> None:
    """At least one move was accepted, the last ends at the lowest cost, and the refined plan passes the audit."""
    search = searched.statistics.search
    assert search is not None and search.moves and search.trials >= len(search.moves)
    costs = [float(move.rsplit(": ", 1)[1]) for move in search.moves]
    assert costs[-1] == min(costs) and costs[-1] < 0.98 * search.cost_before
    assert searched.status.solved and searched.audit.violations == []
    assert searched.status.b_stationary != "unknown"


def test_every_cheaper_motion_is_told_while_the_search_goes_on(watched: Searched) -> None:
    """Of the moves that led to the plan, those that ended below all before are among the NLPs that are told."""
    search = watched.plan.statistics.search
    assert search is not None and search.moves
    costs = [move.rsplit(": ", 1)[1] for move in search.moves]
    lowest = [cost for number, cost in enumerate(costs) if float(cost) == min(map(float, costs[: number + 1]))]
    assert set(lowest) <= {f"{cost:.6g}" for cost in watched.told}


def test_processes_change_nothing_but_the_time(searched: Plan) -> None:
    """One process and three give the same moves, the same number of trials and iterations, and the same bits."""
    for processes in (1, 3):
        again = plan(load_task(TASK, ["method.grid=uniform", *SHORT_JUMP, f"solver.processes={processes}"])).statistics
        assert again.search is not None and searched.statistics.search is not None
        assert again.search.moves == searched.statistics.search.moves
        assert again.search.trials == searched.statistics.search.trials
        assert again.iterations == searched.statistics.iterations
        assert again.objective == searched.statistics.objective


def test_detours_end_below_what_they_left(searched: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without detours the same search ends no cheaper, and every cost that is no record is followed by a record."""
    monkeypatch.setattr(local_search, "MOST_DETOURS", 0)
    straight = plan(load_task(TASK, ["method.grid=uniform", *list(SHORT_JUMP)]))
    ours, theirs = searched.statistics.search, straight.statistics.search
    assert ours is not None and theirs is not None
    costs = [[float(move.rsplit(": ", 1)[1]) for move in one.moves] for one in (ours, theirs)]
    assert costs[1] == sorted(costs[1], reverse=True)
    assert costs[0][: len(costs[1])] == costs[1] and costs[0][-1] == min(costs[0])
    assert ours.trials >= theirs.trials


class Detours:
    """A search of a motion that costs 10, whose neighbours were rejected at some costs, and which came after others.

    Args:
        costs: of the neighbours; those below 10.2 lead back to the motion, the others to one that costs 9.
        before: of the motions before; one that costs 10.5 has a neighbour at 9.5, which takes the most patience.
        ways: cost of a motion -> of the only neighbour to which a descent goes on; 9 for all that do not lead back if
            omitted.
        iterations: of every descent; the search had taken 100 when the detours began.
    """

    def __init__(
        self,
        costs: Sequence[float],
        before: Sequence[float] = (),
        ways: Mapping[float, float] | None = None,
        iterations: int = 0,
    ) -> None:
        self._ways, self._of_descent = ways, iterations
        self.solved: list[float] = []
        self.begun: list[float] = []
        self.reached: list[float] = []
        self.looked: list[tuple[float, int]] = []
        self._before = [self._at(cost) for cost in (*before, 10.0)]
        self._search: Any = SimpleNamespace(
            _rejected=[(SimpleNamespace(what=f"{cost:g}"), self._at(cost)) for cost in costs],
            _trials=0,
            _iterations=100,
            _moves=[],
            _solver=SimpleNamespace(ended_early=False),
            _around=SimpleNamespace(exact_after=self._exact_after),
            _bounds=_Search._bounds,
            _known=_Search._known,
            _moved=lambda move, end: _Search._moved(self._search, move, end),
            _descent=self._descent,
            _back=lambda before: _Search._back(self._search, before),
            _cheaper_neighbour=self._cheaper_neighbour,
        )

    @staticmethod
    def _at(cost: float) -> Any:
        return SimpleNamespace(residuals=SimpleNamespace(objective=cost))

    def _exact_after(self, trial: Any) -> Any:
        self.solved.append(trial.residuals.objective)
        return self._at(10.0) if trial.residuals.objective < 10.2 else trial

    def _descent(self, start: Any, patience: int, passed: Sequence[float]) -> list[Any]:
        self.begun.append(start.residuals.objective)
        self._search._iterations += self._of_descent
        return _Search._descent(self._search, start, patience, passed)

    def _cheaper_neighbour(self, best: Any, patience: int, last: Any, than: Any = None) -> tuple[Any, Any] | None:
        cost = best.residuals.objective
        if than is None:
            ways = {} if cost <= 10.2 else {cost: 9.0}
            following = (ways if self._ways is None else self._ways).get(cost)
            self.reached += [following] if following else []
            return (SimpleNamespace(what="down", key=("", 0, "")), self._at(following)) if following else None
        assert than.residuals.objective == 10.0
        self.looked.append((cost, patience))
        return (SimpleNamespace(what="left"), self._at(9.5)) if self.looked[-1] == (10.5, LAST) else None

    @property
    def moves(self) -> list[str]:
        """The moves that lead down, in words."""
        return self._search._moves

    def costs(self) -> list[float]:
        """Go on from the neighbours; return the costs of the motions over which that leads down."""
        return [one.residuals.objective for one in _Search._detour(self._search, self._before)]


def test_neighbours_that_lead_back_use_up_no_detours() -> None:
    """More neighbours than there are detours end in the motion that is left: one detour begins there, and the neighbour
    after them is gone on from."""
    detours = Detours([*(10 + 0.01 * k for k in range(MOST_DETOURS + 2)), 10.5])
    assert detours.costs() == [10.5, 9.0] and detours.begun == [10.0, 10.5]
    assert detours.moves == ["10.5: 10.5", "down: 9"]


def test_a_detour_ends_where_one_before_it_has_passed() -> None:
    """The first detour goes down to its end; one after it ends at the first motion at which an earlier one was, be it
    in the middle of its way or at the beginning, although a neighbour leads on from there."""
    detours = Detours([10.4, 10.5, 10.9], ways={10.4: 10.35, 10.35: 10.3, 10.5: 10.35, 10.9: 10.5})
    assert detours.costs() == [] and detours.begun == [10.4, 10.5, 10.9]
    assert detours.reached == [10.35, 10.3, 10.35, 10.5] and detours.moves == []


def test_what_was_left_untried_of_earlier_motions_is_where_no_detour_begins() -> None:
    """Where no neighbour is near enough for a detour, those of earlier motions that are near enough are tried, of the
    last one first, with ever more patience; where a detour has begun, they are not."""
    stuck = Detours([12.0], before=[12.0, 10.5, 11.5, 10.2])
    assert stuck.costs() == [9.5] and stuck.moves == ["left: 9.5"]
    assert stuck.looked == [(cost, patience) for cost in (10.2, 10.5) for patience in range(LAST + 1)]
    assert Detours([12.0]).costs() == [] and not Detours([10.1], before=[10.5]).costs()


def test_trials_that_end_at_one_cost_are_solved_once() -> None:
    """Of neighbours whose trials ended at the same cost one is solved exactly; another cost is another motion."""
    detours = Detours([10.1, 10.1, 10.1 * (1 + 0.5 * SAME), 10.1 * (1 + 2 * SAME), 10.5])
    assert detours.costs() == [10.5, 9.0] and len(detours.solved) == 3


def test_no_detour_begins_far_above_the_motion() -> None:
    """A neighbour that costs more than `DETOUR_LOSS` above the motion is not gone on from."""
    assert Detours([10 * (1 + 0.9 * DETOUR_LOSS)]).costs() and not Detours([10 * (1 + 1.1 * DETOUR_LOSS)]).costs()


def test_detours_take_no_more_iterations_than_the_search_before_them() -> None:
    """Where they have taken as many, no further one begins, although that would lead down."""
    costs, ways = [10.4, 10.5, 10.6], {10.6: 9.0}
    assert Detours(costs, ways=ways, iterations=49).costs() == [10.6, 9.0]
    spent = Detours(costs, ways=ways, iterations=51)
    assert spent.costs() == [] and spent.begun == [10.4, 10.5]


def test_where_an_impulse_begins_at_zero_the_trial_begins_far_from_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A move that gives an impact to a soft touchdown is tried once, with the patience that begins farthest from all
    bounds; the others are tried with what is asked for, and a quick search tries these alone."""
    branch = SimpleNamespace(factors=("factors",), without_length=(False,))
    found = [SimpleNamespace(key=("", n, ""), hit=n == 1, branch=branch, intervals=n) for n in range(2)]
    monkeypatch.setattr(local_search, "moves", lambda *_: found)
    around: Any = SimpleNamespace(window=lambda intervals: intervals, elements=lambda window: slice(None))
    search: Any = SimpleNamespace(_transcription=None, _conditions=None, _tried=set(), _depth=Depth.QUICK)
    best: Any = SimpleNamespace(w=None, branch=None)
    assert [one.window for one in _Search._untried(search, best, around, 0, None)] == [0]
    search._depth, seen = Depth.DETOURS, []
    for patience in range(LAST + 1):
        untried = list(_Search._untried(search, best, around, patience, None))
        search._tried |= {one.seen for one in untried}
        seen.append([(one.window, one.patience) for one in untried])
    assert seen == [[(0, 0), (1, LAST)], *([(0, patience)] for patience in range(1, LAST + 1))]


def test_a_motion_that_is_lost_with_room_is_searched_from_one_nearby(
    searched: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the first branch NLP with room fails, a motion near by is found, searched from, and as cheap and true."""
    exact = BranchSolver.exact

    def fails_at_first(self: BranchSolver, start: BranchPoint, **limits: int) -> PolishingReport | None:
        return None if limits.get("updates") == local_search.FIRST_UPDATES else exact(self, start, **limits)

    monkeypatch.setattr(BranchSolver, "exact", fails_at_first)
    result = plan(load_task(TASK, ["method.grid=uniform", *list(SHORT_JUMP)]))
    assert result.status.solved and result.statistics.search is not None and result.statistics.search.trials > 0
    assert result.statistics.objective <= 1.02 * searched.statistics.objective


def test_search_can_be_left_out(searched: Plan) -> None:
    """A plan without it does not speak of a search; one with it ends below the motion that it began with."""
    plain = plan(load_task(TASK, ["method.grid=uniform", *SHORT_JUMP, "solver.local_search=false"]))
    assert plain.status.solved and plain.statistics.search is None
    assert searched.statistics.search is not None
    assert searched.statistics.objective <= searched.statistics.search.cost_before


def test_a_time_limit_leaves_time_for_the_rest() -> None:
    """When the search has to stop early, its motion so far is refined and audited all the same. It may take half of the
    time, and what the trial takes that is under way, which is more on a busy machine."""
    limited = plan(load_task(TASK, ["method.grid=uniform", *SHORT_JUMP, "solver.time_limit=60", "solver.retries=0"]))
    assert limited.status.solved and limited.statistics.search is not None
    assert limited.statistics.search.seconds < 60
    refinement = limited.statistics.refinement
    assert refinement is not None and refinement.largest_local_error <= 1e-7
    short = Deadline(10.0).share(0.5)
    assert 4.9 < short.left <= 5.0 and Deadline().share(0.5).remaining() is None
