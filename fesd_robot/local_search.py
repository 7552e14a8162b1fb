"""Local search from an exact motion: its contacts are changed one by one, as long as that lowers the cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from enum import IntEnum
from itertools import product
from typing import NamedTuple

import numpy as np

from fesd_robot.fesd.neighbours import Move, Surroundings, moves
from fesd_robot.mpcc import TRIALS, BranchPoint, HomotopyOptions, NlpReport, PolishingReport
from fesd_robot.neighbourhood import Neighbourhood
from fesd_robot.plans.plan import LocalSearch
from fesd_robot.repair import exact_end
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import Stop
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.lookahead import Lookahead
from fesd_robot.strategies.shared import Cores
from fesd_robot.strategies.stations import Counted

GAIN = 1e-3
"""Least gain of a move, relative to one plus the cost; smaller ones are not worth their NLPs."""

SHARE_OF_TIME = 0.5
"""Share of the time that a task has left which the search may take: refinement and certificate need some, too."""

DETOUR_LOSS = 0.1
"""Of the cost: a neighbour that costs at most so much more is worth going on from, where none is cheaper; seventeen
detours that ended below their motion began at most 0.092 above it."""

MOST_DETOURS = 10
"""How many of them are, the cheapest first; those that end where another has begun do not count."""

SAME = 1e-4
"""Of the cost: what ends nearer to a motion is that motion again, in other elements. These have neighbours that its own
did not have, so that one detour may begin or end there; further ones tried much the same neighbours anew, for half a
per cent in one search of eleven and a third of all iterations in another."""

MOST_TRIALS = 300
"""Trials after which no detour is begun; long motions need as many without any."""

FIRST_UPDATES = 3
"""How often elements that shrink to nothing are taken out before the search begins."""


class Depth(IntEnum):
    """How far a search goes on.

    Attributes:
        QUICK: until no quick trial of a neighbour is cheaper: enough for a motion that was searched from before.
        PATIENT: until no trial with more iterations is, either.
        DETOURS: and not over costlier neighbours.
    """

    QUICK = 0
    PATIENT = 1
    DETOURS = 2


class Listeners(NamedTuple):
    """Who is told of a search, beside the trials, which are too many.

    Attributes:
        ended: called with every branch NLP of a motion that is yielded.
        tried: called with the number of neighbours that were tried, and None for how many there will be.
        cheaper: called with the NLP of every motion that costs less than all before.
    """

    ended: Callable[[NlpReport], None]
    tried: Counted
    cheaper: Callable[[NlpReport], None] | None


def searched(
    solved: SolvedMotion,
    options: HomotopyOptions,
    deadline: Deadline,
    listeners: Listeners,
    stop: Stop | None,
    cores: Cores,
    *,
    depth: Depth = Depth.DETOURS,
) -> Iterator[SolvedMotion]:
    """Yield a motion none of whose neighbours is found to be cheaper, then ever earlier ones on the way to it.

    First elements may have any length in their intervals; where the motion has no exact one on its branch then, one is
    looked for on the branches near by (`repair.exact_end`). Then neighbours (`fesd.neighbours.moves`) are tried one
    after the other: a branch NLP of a few iterations in a window around the move, and if that ends with a lower cost,
    the branch NLP of the whole motion. The first neighbour that is cheaper by `GAIN` becomes the motion, and the search
    goes on from there with the same kind of move; a move that failed is tried again only if something has changed in
    its window. Where no neighbour is cheaper, the search goes on from the cheapest of them, one after the other, until
    one of these detours ends below the motion that it left; and where there is none to go on from, with the neighbours
    of earlier motions that were left untried.

    Args:
        solved: the motion to start from; the only one if it is not exact.
        options: of the homotopy.
        deadline: of the task.
        listeners: who is told.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the search.
        cores: on which neighbours are tried at once; the result does not depend on them.
        depth: how far the search goes on where no quick trial of a neighbour is cheaper.
    """
    if not solved.solution.exact:
        yield solved
        return
    yield from _Search(solved, options, deadline, listeners, stop, cores, depth).run()


class _Untried(NamedTuple):
    """A move that was not tried yet.

    Attributes:
        move: the move.
        window: intervals in which the motion may change with it.
        patience: which of `TRIALS`; the last, which begins farthest from its bounds, where an impulse begins at zero.
        seen: what there is in its window.
    """

    move: Move
    window: range
    patience: int
    seen: object


class _Candidate(NamedTuple):
    """A trial.

    Attributes:
        start: where it begins.
        patience: which of `TRIALS`.
        free: variables that may move, (n).
        reach: cost above which it does not go on.
    """

    start: BranchPoint
    patience: int
    free: np.ndarray
    reach: float


class _Search:
    """Where a search is, and what it has tried."""

    def __init__(
        self,
        solved: SolvedMotion,
        options: HomotopyOptions,
        deadline: Deadline,
        listeners: Listeners,
        stop: Stop | None,
        cores: Cores,
        depth: Depth,
    ) -> None:
        self._begin, self._depth = time.perf_counter(), depth
        self._solved, self._deadline, self._told = solved, deadline, listeners
        self._around = Neighbourhood.of(
            solved.transcription, solved.solution.w, solved.branch, options, deadline.share(SHARE_OF_TIME), stop
        )
        self._solver, self._transcription = self._around.solver, self._around.transcription
        self._conditions = self._around.polisher.conditions
        self._tried: set[object] = set()
        self._trials, self._least = 0, solved.cost
        self._moves: list[str] = []
        self._rejected: list[tuple[Move, PolishingReport]] = []
        self._ahead = Lookahead(self._outcome, cores, stop, self._alone)

    def run(self) -> Iterator[SolvedMotion]:
        """Search until no neighbour is cheaper; yield the best motion, ever earlier ones on the way, and the first.

        The first comes with all its elements in use, too: one without length may let a certificate see a descent that
        ends there.
        """
        try:
            trail = self._trail()
        finally:
            self._ahead.close()
        costs = [one.residuals.objective for one in trail]
        lows = [number for number, cost in enumerate(costs) if cost <= min(costs[: number + 1])]
        back = 1
        while back <= len(lows):
            number = lows[-back]
            yield self._without_room(trail[number], self._moves[:number])
            back *= 2
        yield replace(self._solved, search=self._summary([]))

    def _trail(self) -> list[PolishingReport]:
        """Return the motions that were accepted one after the other; none if none is found near the first with room."""
        found = self._solver.exact(self._around.start, updates=FIRST_UPDATES) or exact_end(self._around)
        first = self._around.filled(found)
        patience = 1 if self._depth is Depth.QUICK else len(TRIALS)
        trail = [first, *self._descent(first, patience)] if first else []
        while trail and self._depth is Depth.DETOURS and (further := self._detour(trail)):
            trail += further
            trail += self._descent(trail[-1], patience)
        return trail

    def _descent(self, best: PolishingReport, patience: int, passed: Sequence[float] = ()) -> list[PolishingReport]:
        """Return ever cheaper motions, each a neighbour of the one before, until there is none, or one is passed again.

        Args:
            best: where to begin.
            patience: how many of `TRIALS` are tried with the neighbours of the last.
            passed: costs of motions from which others went on.
        """
        trail: list[PolishingReport] = []
        level, last = 0, None
        self._rejected = []
        while level < patience and not self._solver.ended_early:
            found = self._cheaper_neighbour(best, level, last)
            if found is None:
                level, last = level + 1, None
                continue
            move, best = found
            level, last, self._rejected = 0, move.key, []
            trail.append(best)
            self._moved(move, best)
            if self._known(best, passed):
                break
        return trail

    def _detour(self, before: Sequence[PolishingReport]) -> list[PolishingReport]:
        """Return motions that lead to a cheaper one over a neighbour that costs a little more; none if none does.

        Of trials that ended at one cost, as those of one move with more or less patience do, one is solved exactly.
        A detour ends where one before it has passed: what is there was tried. None begins once they have taken as many
        iterations as the search before them.

        Args:
            before: the motions that were accepted; the last is the one to leave.
        """
        below, reach = self._bounds(before[-1])
        most = 2 * self._iterations
        ended: list[float] = []
        passed: list[float] = []
        left = MOST_DETOURS
        for move, trial in sorted(self._rejected, key=lambda one: one[1].residuals.objective):
            far, spent = trial.residuals.objective > reach, self._iterations > most or self._trials > MOST_TRIALS
            if far or spent or not left or self._solver.ended_early:
                break
            if self._known(trial, ended):
                continue
            ended.append(trial.residuals.objective)
            start, moves = self._around.exact_after(trial), len(self._moves)
            if start and self._known(start, passed):
                continue
            left -= 1
            if start is None:
                continue
            self._moved(move, start)
            trail = [start, *self._descent(start, 1, passed)]
            if trail[-1].residuals.objective < below:
                return trail
            passed += [motion.residuals.objective for motion in trail]
            del self._moves[moves:]
        return [] if passed else self._back(before)

    def _back(self, before: Sequence[PolishingReport]) -> list[PolishingReport]:
        """Return a motion that is cheaper than the last of some, a neighbour of an earlier one; none if there is none.

        The neighbours of a motion are tried until one is cheaper; those after it, and those that take more patience,
        are tried where the last motion has none that a detour could begin at.

        Args:
            before: the motions that were accepted.
        """
        _, reach = self._bounds(before[-1])
        near = [motion for motion in reversed(before[:-1]) if motion.residuals.objective <= reach]
        for motion, patience in product(near, range(len(TRIALS))):
            if self._trials > MOST_TRIALS or self._solver.ended_early:
                break
            if found := self._cheaper_neighbour(motion, patience, None, than=before[-1]):
                move, end = found
                self._moved(move, end)
                return [end]
        return []

    @property
    def _iterations(self) -> int:
        """IPOPT iterations of the search so far."""
        return sum(report.iterations for report in self._solver.reports)

    def _moved(self, move: Move, end: PolishingReport) -> None:
        self._moves.append(f"{move.what}: {end.residuals.objective:.6g}")

    @staticmethod
    def _known(motion: PolishingReport, costs: Sequence[float]) -> bool:
        """Return whether a motion of this cost is among those of some costs."""
        return any(abs(motion.residuals.objective - cost) <= SAME * abs(cost) for cost in costs)

    @staticmethod
    def _bounds(best: PolishingReport) -> tuple[float, float]:
        """Return the costs below which a neighbour is cheaper, and above which it is not worth going on from."""
        objective = best.residuals.objective
        return objective - GAIN * abs(objective), objective + DETOUR_LOSS * abs(objective)

    def _cheaper_neighbour(
        self,
        best: PolishingReport,
        patience: int,
        last: tuple[str, int, str] | None,
        than: PolishingReport | None = None,
    ) -> tuple[Move, PolishingReport] | None:
        """Return the first move that gains enough, and where it leads.

        Args:
            best: the motion whose neighbours are tried.
            patience: which of `TRIALS`.
            last: the kind of move to begin with.
            than: the motion that it has to be cheaper than, `best` if omitted.
        """
        below, reach = self._bounds(than or best)
        around = Surroundings(self._transcription, self._conditions, best.branch)
        untried = list(self._untried(best, around, patience, last))
        candidates = [
            _Candidate(BranchPoint(one.move.w, one.move.branch), one.patience, around.variables(one.window), reach)
            for one in untried
        ]
        for one, (found, reports) in zip(untried, self._ahead.results(candidates), strict=False):
            move = one.move
            self._trials += 1
            self._told.tried(self._trials, None)
            self._tried.add(one.seen)
            self._solver.reports += reports
            if found and found.residuals.constraint_violation <= TRIALS[one.patience].violation:
                if not found.residuals.objective < below:
                    self._rejected.append((move, found))
                elif (end := self._around.exact_after(found)) and end.residuals.objective < below:
                    self._note(end)
                    return move, end
            if self._solver.ended_early:
                break
        return None

    def _note(self, end: PolishingReport) -> None:
        """Say so if a motion is the cheapest so far."""
        cost = end.residuals.objective
        if cost < self._least:
            self._least = cost
            if self._told.cheaper:
                self._told.cheaper(NlpReport.of_polishing(end))

    def _untried(
        self, best: PolishingReport, around: Surroundings, patience: int, last: tuple[str, int, str] | None
    ) -> Iterator[_Untried]:
        """Yield the moves that were not tried yet with what there is in their windows."""
        found = list(moves(self._transcription, self._conditions, best.w, best.branch))
        if len(found) > TRIALS[patience].most_branches:
            return
        first, listed = next((i for i, move in enumerate(found) if move.key == last), 0), set(self._tried)
        for move in found[first:] + found[:first]:
            if move.hit and self._depth is Depth.QUICK:
                continue  # these take the most patient trials
            window = around.window(move.intervals)
            elements = around.elements(window)
            own = len(TRIALS) - 1 if move.hit else patience
            seen = (own, window, move.branch.factors[elements], move.branch.without_length[elements])
            if seen not in listed:
                listed.add(seen)
                yield _Untried(move, window, own, seen)

    def _outcome(self, candidate: _Candidate) -> tuple[PolishingReport | None, list[NlpReport]]:
        """Return what a trial ends with, and its NLPs, which are not counted yet."""
        solver, before = self._solver, len(self._solver.reports)
        window = solver.window(candidate.free)
        found = solver.tried(candidate.start, TRIALS[candidate.patience], window, candidate.reach)
        reports = solver.reports[before:]
        del solver.reports[before:]
        return found, reports

    def _alone(self) -> None:
        self._solver.stop = None

    def _without_room(self, best: PolishingReport, moves: list[str]) -> SolvedMotion:
        """Return a motion with as many elements as it needs, as it is if that fails."""
        polisher, found = self._around.without_room(best, self._solved.solution, self._deadline, self._told.ended)
        return replace(self._solved.continued(polisher, found), search=self._summary(moves))

    def _summary(self, moves: list[str]) -> LocalSearch:
        """Return what was done, by a search before this one, too, and which moves lead to a motion."""
        earlier = self._solved.search or LocalSearch(
            seconds=0.0, iterations=0, trials=0, cost_before=self._solved.cost, moves=[]
        )
        return LocalSearch(
            seconds=earlier.seconds + time.perf_counter() - self._begin,
            iterations=earlier.iterations + self._iterations,
            trials=earlier.trials + self._trials,
            cost_before=earlier.cost_before,
            moves=[*earlier.moves, *moves],
        )
