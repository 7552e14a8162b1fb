"""A motion with room for switches in every interval, and what solves the branch NLPs of its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fesd_robot.fesd.neighbours import with_room, without_room
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.mpcc import BranchSolver, MpccSolution, PolishingReport, Run, continue_on_branch
from fesd_robot.running import OutOfTime


@dataclass(frozen=True)
class Neighbourhood:
    """A motion with one element more in every interval, any of which may fill it.

    Attributes:
        start: the motion with these elements.
        solver: of branch NLPs there.
        elements: of every interval of the motion, without the room.
    """

    start: BranchMotion
    solver: BranchSolver
    elements: Sequence[int]

    @classmethod
    def of(cls, motion: BranchMotion, run: Run, few_evaluations: bool = False) -> Neighbourhood:
        """Return the neighbourhood of a motion.

        Args:
            motion: whose neighbours are looked for; it need not satisfy anything.
            run: of all NLPs.
            few_evaluations: whether the functions of its NLPs are not worth compiling.
        """
        start = with_room(motion)
        solver = BranchSolver(start.transcription.problem, start.polisher, run, few_evaluations=few_evaluations)
        return cls(start, solver, motion.transcription.elements)

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
        return with_fewer_elements(self.start.polisher, own, self.elements, run)


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
    fewer = without_room(BranchMotion.of_solution(polisher, solution), least)
    try:
        found = continue_on_branch(fewer.transcription.problem, fewer.polisher, fewer, solution, run)
    except OutOfTime:
        return polisher, solution
    return (fewer.polisher, found) if found else (polisher, solution)
