"""From the motions that a search yields to the one that is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import pytest

from fesd_robot import chain
from fesd_robot.chain import HELD, MOST_HOLDS, Chain
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans.plan import LocalSearch
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.task import Task


@dataclass(frozen=True)
class Candidate:
    """In place of a solved motion: a cost before and after refinement, and whether its audit passes then."""

    motion: MotionProblem
    cost: float
    refined_cost: float
    passes: bool = False
    will_pass: bool = True
    search: LocalSearch | None = None
    undecided: bool = False
    rounds: int = 0
    stages: int = 2
    solution: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(exact=True))


def chain_from(first: Candidate, monkeypatch: pytest.MonkeyPatch) -> Chain:
    """A chain that begins with a motion."""
    monkeypatch.setattr(Chain, "_first", lambda *_: chain._First(None, None))  # type: ignore[arg-type]
    monkeypatch.setattr(chain.SolvedMotion, "of", lambda *_: first)
    return Chain(Deadline(None), None, None, lambda station: None, lambda done, of: None, [])


@pytest.mark.parametrize(
    ("costs", "kept", "refined"),
    [
        ([(1.0, 1.0, True), (1.1, 1.1, True)], 1.0, 1),
        ([(1.0, 1.2, True), (1.1, 1.1, True), (1.15, 1.15, True)], 1.1, 2),
        ([(1.0, 1.2, True), (1.1, 1.3, True), (1.4, 1.4, True)], 1.2, 2),
        ([(1.0, 1.2, False), (1.1, 1.3, True), (1.2, 1.2, True)], 1.2, 3),
        ([(1.0, 1.2, True), (1.1, 1.1, False), (1.3, 1.3, True)], 1.2, 2),
        ([(1.0, 1.0, False), (1.1, 1.1, False)], 1.1, 2),
        ([(1.0, 1.03, True), (1.01, 1.01, True)], 1.03, 1),
    ],
)
def test_the_cheapest_motion_that_is_true_is_kept(
    load_short: Callable[..., Task],
    monkeypatch: pytest.MonkeyPatch,
    costs: Sequence[tuple[float, float, bool]],
    kept: float,
    refined: int,
) -> None:
    """Candidates come the cheaper ones first; those that cost clearly less than the best that passes are refined.

    The last is kept where none passes.
    """
    task = load_short("solver.local_search=true", "method.accuracy=1e-7")
    motion = formulate(task)
    count = 0

    def searched(*_: Any, **__: Any) -> Iterator[Candidate]:
        yield from (Candidate(motion, cost, finer, will_pass=passes) for cost, finer, passes in costs)

    def refine(one: Candidate, *_: Any, **__: Any) -> Candidate:
        nonlocal count
        count += 1
        return Candidate(motion, one.refined_cost, one.refined_cost, passes=one.will_pass)

    own = chain_from(Candidate(motion, 2.0, 2.0), monkeypatch)
    monkeypatch.setattr(chain, "searched", searched)
    monkeypatch.setattr(chain, "refined", refine)
    found = own.solved(motion, Transcription(motion.ocp, motion.fesd))
    assert (found.cost, count) == (kept, refined)


@pytest.mark.parametrize(
    ("undecided", "loss", "searches", "holds"),
    [(0, 0.1, 1, 0), (1, 0.1, 2, 1), (9, 0.1, 1 + MOST_HOLDS, MOST_HOLDS), (1, None, 1, 0), (1, 0.001, 1, 1)],
)
def test_a_search_goes_on_from_postures_that_decide_the_motion(
    load_short: Callable[..., Task],
    monkeypatch: pytest.MonkeyPatch,
    undecided: int,
    loss: float | None,
    searches: int,
    holds: int,
) -> None:
    """Where Coulomb's law does not decide what a search ends with, this is held, and searched from there, a few times.

    The record of the search says so. Where that costs little, there is no further search; where it cannot be held, what
    the search has found is taken as it is.
    """
    task = load_short("solver.local_search=true", "method.accuracy=none")
    motion = formulate(task)
    begun: list[float] = []

    def searched(solved: Candidate, *_: Any, **__: Any) -> Iterator[Candidate]:
        begun.append(solved.cost)
        record = solved.search or LocalSearch(seconds=0, iterations=0, trials=0, cost_before=2, moves=[])
        own = replace(solved, search=record, passes=True, undecided=len(begun) <= undecided)
        yield replace(own, cost=solved.cost - 0.5)
        yield own

    def held(one: Candidate, *_: Any) -> Candidate | None:
        return None if loss is None else replace(one, cost=one.cost + loss, rounds=1)

    own = chain_from(Candidate(motion, 2.0, 2.0), monkeypatch)
    monkeypatch.setattr(chain, "searched", searched)
    monkeypatch.setattr(chain, "in_deciding_postures", lambda one: [None] if one.undecided else [])
    monkeypatch.setattr(chain, "continued", held)
    found = own.solved(motion, Transcription(motion.ocp, motion.fesd))
    assert begun == pytest.approx([2.0 - 0.4 * number for number in range(searches)])
    left = 0.0 if loss is None or holds == searches - 1 else loss
    assert found.cost == pytest.approx(begun[-1] - 0.5 + left) and found.rounds == 0
    assert found.search is not None
    assert [move.split(":")[0] for move in found.search.moves] == [HELD] * holds


@pytest.mark.parametrize("which", ["_coarse", "_twin"])
def test_a_motion_to_begin_with_leaves_half_of_the_time(
    load_short: Callable[..., Task], monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    """What is planned on a coarser grid, or in the plane, is over when half of the time that was left is."""
    given: list[Deadline] = []

    def found(own: Chain, *_: Any, **__: Any) -> chain._Refined:
        given.append(own.deadline)
        return chain._Refined(None, None)  # type: ignore[arg-type]

    monkeypatch.setattr(Chain, "_before_and_after", found)
    whole = Deadline(100.0)
    own = Chain(whole, None, None, lambda station: None, lambda done, of: None, [])
    getattr(own, which)(load_short())
    assert given[0].left == pytest.approx(0.5 * whole.left, abs=1.0)
