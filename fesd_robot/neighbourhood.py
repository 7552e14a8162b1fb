"""A motion with room for switches in every interval, and what solves the branch NLPs of its neighbours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import filled, with_room, without_room
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import (
    BranchPoint,
    BranchSolver,
    HomotopyOptions,
    MpccSolution,
    NlpReport,
    PolishingReport,
    continue_on_branch,
)
from fesd_robot.strategies.attempts import Stop
from fesd_robot.strategies.deadline import Deadline

MOST_FILLINGS = 2
"""How often elements that have shrunk to nothing are put to use again."""


@dataclass(frozen=True)
class Neighbourhood:
    """A motion with one element more in every interval, any of which may fill it.

    Attributes:
        polisher: of the transcription with these elements.
        start: the motion, and its branch.
        solver: of branch NLPs there.
        elements: of every interval of the motion, without the room.
        options: of the homotopy.
        stop: called once an IPOPT iteration with (iteration, objective); True ends an NLP.
    """

    polisher: BranchTranscription
    start: BranchPoint
    solver: BranchSolver
    elements: Sequence[int]
    options: HomotopyOptions
    stop: Stop | None

    @classmethod
    def of(
        cls,
        transcription: Transcription,
        w: np.ndarray,
        branch: Branch,
        options: HomotopyOptions,
        deadline: Deadline,
        stop: Stop | None,
        progress: Callable[[NlpReport], None] | None = None,
        few_evaluations: bool = False,
    ) -> Neighbourhood:
        """Return the neighbourhood of a motion.

        Args:
            transcription, w, branch: the motion.
            options: of the homotopy.
            deadline: of all NLPs.
            stop: called once an IPOPT iteration with (iteration, objective); True ends an NLP.
            progress: called after every NLP of the solver.
            few_evaluations: whether the functions of its NLPs are not worth compiling.
        """
        roomy, start, own = with_room(transcription, w, branch)
        polisher = BranchTranscription(roomy)
        solver = BranchSolver(
            roomy.problem,
            polisher,
            options,
            deadline.remaining,
            few_evaluations=few_evaluations,
            stop=stop,
            progress=progress,
        )
        return cls(polisher, BranchPoint(start, own), solver, transcription.elements, options, stop)

    @property
    def transcription(self) -> Transcription:
        """With room."""
        return self.polisher.transcription

    def filled(self, end: PolishingReport | None) -> PolishingReport | None:
        """Return an exact motion with all elements in use, the given one if there is none nearby.

        An element is out of use if its branch says so, and also if the NLP has left it at its least length.
        """
        if end is None:
            return None
        for _ in range(MOST_FILLINGS):
            branch = self.polisher.branch_of_exact(end.branch, end.w)
            if not any(branch.without_length):
                break
            end = self.solver.exact(BranchPoint(*filled(self.transcription, end.w, branch))) or end
        return end

    def exact_after(self, trial: PolishingReport) -> PolishingReport | None:
        """Return the exact motion on the branch of a trial's end, with all elements in use; None if none is nearby.

        Elements that have shrunk to nothing leave multipliers undetermined, and IPOPT without an end although its point
        does not change any more: then they are put to use before, not after.

        Args:
            trial: its end.
        """
        end = self.solver.exact_after(BranchPoint(trial.w, trial.branch))
        if end is None and any(trial.branch.without_length):
            end = self.solver.exact_after(BranchPoint(*filled(self.transcription, trial.w, trial.branch)))
        return self.filled(end)

    def without_room(
        self,
        end: PolishingReport,
        earlier: MpccSolution,
        deadline: Deadline,
        progress: Callable[[NlpReport], None] | None,
    ) -> tuple[BranchTranscription, MpccSolution]:
        """Return an exact motion with as many elements as it needs, as it is if that fails.

        Args:
            end: the motion.
            earlier: the solution that it continues.
            deadline: of the NLP.
            progress: called after it.
        """
        own = replace(self.solver.solution(end, earlier, 0.0), reports=earlier.reports)
        return with_fewer_elements(self.polisher, own, self.elements, self.options, deadline, progress, self.stop)


def with_fewer_elements(
    polisher: BranchTranscription,
    solution: MpccSolution,
    least: Sequence[int],
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution]:
    """Return an exact motion with as many elements as its modes need, as it is if that fails.

    Args:
        polisher, solution: the motion.
        least: elements of every interval that are kept at least, (N).
        options: of the homotopy.
        deadline: of the NLP.
        progress: called after it.
        stop: called once an IPOPT iteration with (iteration, objective); True ends it.
    """
    assert solution.branch is not None
    transcription, w, branch = without_room(polisher.transcription, solution.w, solution.branch, least)
    fewer = BranchTranscription(transcription)
    found = continue_on_branch(
        transcription.problem,
        fewer,
        BranchPoint(w, branch),
        solution,
        options,
        seconds_left=deadline.remaining,
        progress=progress,
        stop=stop,
    )
    return (fewer, found) if found else (polisher, solution)
