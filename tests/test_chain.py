"""From the motions that a search yields to the one that is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from fesd_robot import chain
from fesd_robot.chain import Chain
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import MotionProblem, formulate
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


@pytest.mark.parametrize(
    ("costs", "kept", "refined"),
    [
        ([(1.0, 1.0, True), (1.1, 1.1, True)], 1.0, 1),
        ([(1.0, 1.2, True), (1.1, 1.1, True), (1.15, 1.15, True)], 1.1, 2),
        ([(1.0, 1.2, True), (1.1, 1.3, True), (1.4, 1.4, True)], 1.2, 2),
        ([(1.0, 1.2, False), (1.1, 1.3, True), (1.2, 1.2, True)], 1.2, 3),
        ([(1.0, 1.2, True), (1.1, 1.1, False), (1.3, 1.3, True)], 1.2, 2),
        ([(1.0, 1.0, False), (1.1, 1.1, False)], 1.1, 2),
    ],
)
def test_the_cheapest_motion_that_is_true_is_kept(
    load_short: Callable[..., Task],
    monkeypatch: pytest.MonkeyPatch,
    costs: Sequence[tuple[float, float, bool]],
    kept: float,
    refined: int,
) -> None:
    """Candidates come the cheaper ones first; those that cost less than the best that passes are refined, no others.

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

    monkeypatch.setattr(Chain, "_first", lambda *_: chain._First(None, None))  # type: ignore[arg-type]
    monkeypatch.setattr(chain.SolvedMotion, "of", lambda *_: None)
    monkeypatch.setattr(chain, "searched", searched)
    monkeypatch.setattr(chain, "refined", refine)
    own = Chain(Deadline(None), None, None, lambda station: None, lambda done, of: None, [])
    found = own.solved(motion, Transcription(motion.ocp, motion.fesd))
    assert (found.cost, count) == (kept, refined)
