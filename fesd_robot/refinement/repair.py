"""Repair: from a point that no branch fits to an exact motion, by moves that lower what its branch violates."""

from __future__ import annotations

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import Move, intervals_of, moves
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.mpcc import TRIALS, MpccSolution, PolishingReport, Run
from fesd_robot.refinement.neighbourhood import Neighbourhood

LEAST_FALL = 0.7
"""Of the violation: a neighbour that has less than this part of it is the one whose neighbours are tried next."""


class Repair:
    """What is tried where no branch of a point leads to an exact motion.

    The branch was misread, or there are too few elements for its switches. So every interval gets one element more, and
    the branch NLP is solved as far as it goes. As long as it does not converge, its neighbours (`fesd.neighbours`) are
    tried, those first that are nearest to where it violates its constraints most, and the first that violates them
    clearly less takes its place.

    Args:
        transcription: of the point.
        run: of all NLPs.
    """

    def __init__(self, transcription: Transcription, run: Run) -> None:
        self._transcription, self._run = transcription, run
        self._found: tuple[Neighbourhood, PolishingReport] | None = None

    def __call__(self, w: np.ndarray) -> float | None:
        """Look for an exact motion near a point, (n); return what it costs, None if there is none."""
        polisher = BranchTranscription(self._transcription)
        motion = BranchMotion(polisher, w, polisher.branch(w))
        if not _has_lengths(self._transcription, motion.branch):
            return None
        around = Neighbourhood.of(motion, self._run.share(self._run.effort.repair_share))
        end = exact_end(around)
        if end and (self._found is None or end.residuals.objective < self._found[1].residuals.objective):
            self._found = around, end
        return end.residuals.objective if end else None

    def repaired(
        self, polisher: BranchTranscription, solution: MpccSolution
    ) -> tuple[BranchTranscription, MpccSolution]:
        """Return the homotopy's end if that is exact, else the cheapest exact motion that was found, if any.

        Args:
            polisher, solution: of the homotopy.
        """
        if solution.exact or self._found is None:
            return polisher, solution
        around, end = self._found
        return around.without_room(end, solution, self._run)


def repaired(motion: BranchMotion, earlier: MpccSolution, run: Run) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return an exact motion near one on a refined transcription, None if none is found.

    Args:
        motion: of a collocation scheme, on a branch that leads to no exact one; the rows that refinement has added are
            held in all of their intervals.
        earlier: the solution that it continues.
        run: of all NLPs.
    """
    if run.deadline.left <= 0:
        return None
    around = Neighbourhood.of(
        motion,
        run.share(run.effort.repair_share),
        few_evaluations=True,  # elements in parts make large functions: compiling them takes minutes
    )
    end = exact_end(around)
    return around.without_room(end, earlier, run) if end else None


def exact_end(around: Neighbourhood) -> PolishingReport | None:
    """Return the exact end of a neighbour, None if none is found."""
    solver, most = around.solver, around.solver.run.effort.repair_trials
    best: PolishingReport | None = None
    for trial in TRIALS:
        found = solver.tried(around.start, trial)
        if found and _is_better(around, found, best, 1.0):
            best = found
    tried: set[object] = set()
    while best and not solver.ended_early:
        end = solver.exact(best) if _is_promising(best) else None
        if end or len(tried) >= most:
            return end
        following = None
        for move in _nearest_first(around, best):
            modes = (move.branch.factors, move.branch.without_length)
            if modes in tried:
                continue
            tried.add(modes)
            found = solver.tried(move, TRIALS[0])
            if found and _is_better(around, found, best, LEAST_FALL):
                following = found
                break
            if len(tried) >= most or solver.ended_early:
                break
        best = following
    return None


def _is_promising(found: PolishingReport) -> bool:
    """Whether the end of a trial may be near an exact one."""
    return found.residuals.constraint_violation <= TRIALS[-1].violation


def _is_better(around: Neighbourhood, found: PolishingReport, best: PolishingReport | None, part: float) -> bool:
    """Whether a trial violates less than a part of what the best did, and has a length in every interval."""
    if not np.isfinite(found.w).all() or not _has_lengths(around.start.transcription, found.branch):
        return False
    return best is None or found.residuals.constraint_violation < part * best.residuals.constraint_violation


def _has_lengths(transcription: Transcription, branch: Branch) -> bool:
    """Whether every interval has an element with a length."""
    return not any(all(branch.without_length[e] for e in own) for own in intervals_of(transcription.elements))


def _nearest_first(around: Neighbourhood, best: PolishingReport) -> list[Move]:
    """Return the moves from a branch, those first that are nearest to the interval in which most is violated."""
    found = list(moves(around.start.at(best.w, best.branch)))
    worst = best.residuals.worst_constraint
    at = worst.place.interval if worst else None
    if at is not None:
        found.sort(key=lambda move: max(move.intervals.start - at, at - move.intervals.stop + 1, 0))
    return found
