"""A finer transcription of an exact motion, and the motion that continues it there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from fesd_robot.fesd import BoundBetween, PathBetween, Transcription
from fesd_robot.fesd.polishing import BranchTranscription, OneBranch
from fesd_robot.fesd.refinement import with_bounds_between
from fesd_robot.mpcc import BranchPoint, Run, continue_on_branch
from fesd_robot.refinement.repair import repaired
from fesd_robot.refinement.solved_motion import SolvedMotion


class Finer(NamedTuple):
    """A finer transcription, or one with more rows, and where to start.

    Attributes:
        transcription: the transcription.
        start: a point of it, and its branch.
        repair: whether other branches near it are looked for, too.
    """

    transcription: Transcription
    start: BranchPoint
    repair: bool = False


def with_bounds(solved: SolvedMotion, bounds: Sequence[BoundBetween | PathBetween]) -> Finer:
    """Return a motion's own transcription with further bounds between stages, from which its start may be far."""
    finer = with_bounds_between(solved.transcription, bounds)
    return Finer(finer, BranchPoint(solved.solution.w, solved.branch, freer=True))


def continued(solved: SolvedMotion, finer: Finer, run: Run) -> SolvedMotion | None:
    """Return the solution of a finer transcription on its branch, None if there is none.

    Args:
        solved: the motion that it continues.
        finer: the transcription.
        run: of all NLPs.
    """
    transcription, start, repair = finer
    if repair:
        found = repaired(transcription, start, solved.solution, run)
        return replace(solved.continued(*found), rounds=solved.rounds + 1) if found else None
    polisher = BranchTranscription(transcription)
    solution = continue_on_branch(
        transcription.problem,
        OneBranch(polisher, start.branch) if transcription.apart else polisher,
        start,
        solved.solution,
        run,
    )
    if solution is None:
        return None
    return replace(solved.continued(polisher, solution), rounds=solved.rounds + 1)
