"""A motion with room for switches in every interval, and what solves the branch NLPs of its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import with_room, without_room
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import (
    BranchPoint,
    BranchSolver,
    MpccSolution,
    PolishingReport,
    Run,
    continue_on_branch,
)


@dataclass(frozen=True)
class Neighbourhood:
    """A motion with one element more in every interval, any of which may fill it.

    Attributes:
        polisher: of the transcription with these elements.
        start: the motion, and its branch.
        solver: of branch NLPs there.
        elements: of every interval of the motion, without the room.
    """

    polisher: BranchTranscription
    start: BranchPoint
    solver: BranchSolver
    elements: Sequence[int]

    @classmethod
    def of(
        cls,
        transcription: Transcription,
        w: np.ndarray,
        branch: Branch,
        run: Run,
        few_evaluations: bool = False,
    ) -> Neighbourhood:
        """Return the neighbourhood of a motion.

        Args:
            transcription, w, branch: the motion.
            run: of all NLPs.
            few_evaluations: whether the functions of its NLPs are not worth compiling.
        """
        roomy, start, own = with_room(transcription, w, branch)
        polisher = BranchTranscription(roomy)
        solver = BranchSolver(roomy.problem, polisher, run, few_evaluations=few_evaluations)
        return cls(polisher, BranchPoint(start, own), solver, transcription.elements)

    @property
    def transcription(self) -> Transcription:
        """With room."""
        return self.polisher.transcription

    def without_room(
        self, end: PolishingReport, earlier: MpccSolution, run: Run
    ) -> tuple[BranchTranscription, MpccSolution]:
        """Return an exact motion with as many elements as it needs, as it is if that fails.

        Args:
            end: the motion.
            earlier: the solution that it continues.
            run: of the NLP.
        """
        own = replace(self.solver.solution(end, earlier, 0.0), reports=earlier.reports)
        return with_fewer_elements(self.polisher, own, self.elements, run)


def with_fewer_elements(
    polisher: BranchTranscription, solution: MpccSolution, least: Sequence[int], run: Run
) -> tuple[BranchTranscription, MpccSolution]:
    """Return an exact motion with as many elements as its modes need, as it is if that fails.

    Args:
        polisher, solution: the motion.
        least: elements of every interval that are kept at least, (N).
        run: of the NLP.
    """
    assert solution.branch is not None
    transcription, w, branch = without_room(polisher.transcription, solution.w, solution.branch, least)
    fewer = BranchTranscription(transcription)
    found = continue_on_branch(transcription.problem, fewer, BranchPoint(w, branch), solution, run)
    return (fewer, found) if found else (polisher, solution)
