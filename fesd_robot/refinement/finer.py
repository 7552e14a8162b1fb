"""A finer transcription of an exact motion, and the motion that continues it there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from fesd_robot.fesd import BoundBetween, PathBetween
from fesd_robot.fesd.polishing import BranchMotion, OneBranch
from fesd_robot.fesd.refinement import with_bounds_between
from fesd_robot.mpcc import Run, continue_on_branch
from fesd_robot.refinement.repair import repaired
from fesd_robot.refinement.solved_motion import SolvedMotion


class Finer(NamedTuple):
    """A finer transcription, or one with more rows, and where to start.

    Attributes:
        motion: a point of the transcription, and its branch.
        freer: whether IPOPT begins further from it, as where it violates constraints which are new.
        repair: whether other branches near it are looked for, too.
    """

    motion: BranchMotion
    freer: bool = False
    repair: bool = False


def with_bounds(solved: SolvedMotion, bounds: Sequence[BoundBetween | PathBetween]) -> Finer:
    """Return a motion's own transcription with further bounds between stages, from which its start may be far."""
    return Finer(with_bounds_between(solved.on_branch, bounds), freer=True)


def continued(solved: SolvedMotion, finer: Finer, run: Run) -> SolvedMotion | None:
    """Return the solution of a finer transcription on its branch, None if there is none.

    Args:
        solved: the motion that it continues.
        finer: the transcription.
        run: of all NLPs.
    """
    start, polisher = finer.motion, finer.motion.polisher
    if finer.repair:
        found = repaired(start, solved.solution, run)
        return replace(solved.continued(*found), rounds=solved.rounds + 1) if found else None
    solution = continue_on_branch(
        start.transcription.problem,
        OneBranch(polisher, start.branch) if start.transcription.element_blocks else polisher,
        start,
        solved.solution,
        run,
        freer=finer.freer,
    )
    if solution is None:
        return None
    return replace(solved.continued(polisher, solution), rounds=solved.rounds + 1)
