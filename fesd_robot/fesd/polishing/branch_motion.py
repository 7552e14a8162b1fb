"""A trajectory on its branch, from which the same problem with other numbers is solved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.polishing.transcription import BranchTranscription
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import BRANCH, BranchNlp, MpccSolution, PolishingLimits, PolishingReport, Run
from fesd_robot.nlp import SAME, NlpPoint, Start


@dataclass(frozen=True)
class BranchMotion:
    """A trajectory on its branch.

    Attributes:
        polisher: transcription of the branch NLP.
        values: variables, (n), or a point with multipliers of the branch NLP where these are known.
        branch: on which it lies.
    """

    polisher: BranchTranscription
    values: np.ndarray | NlpPoint
    branch: Branch

    @classmethod
    def of(
        cls, transcription: Transcription | BranchTranscription, values: np.ndarray | NlpPoint, branch: Branch
    ) -> BranchMotion:
        """Return the trajectory that a point of a transcription is, on a branch."""
        if isinstance(transcription, Transcription):
            transcription = BranchTranscription(transcription)
        return cls(transcription, values, branch)

    @classmethod
    def of_solution(cls, polisher: BranchTranscription, solution: MpccSolution) -> BranchMotion:
        """Return the trajectory of a solution, with the multipliers that it has, on its branch or the likeliest one."""
        branch = solution.branch or polisher.branch(solution.w)
        return cls(polisher, solution.point or solution.w, branch)

    @property
    def transcription(self) -> Transcription:
        """Of the problem with pairs."""
        return self.polisher.transcription

    @property
    def w(self) -> np.ndarray:
        """Variables, (n)."""
        return self.values.x if isinstance(self.values, NlpPoint) else self.values

    @property
    def point(self) -> NlpPoint:
        """Variables, and multipliers of the branch NLP, zero where none are known."""
        if isinstance(self.values, NlpPoint):
            return self.values
        return NlpPoint.without_multipliers(self.values, self.polisher.problem.constraints)

    @property
    def elements(self) -> list[Element]:
        """In time order."""
        return self.transcription.unpack(self.w)

    def at(self, w: np.ndarray, branch: Branch) -> BranchMotion:
        """Return another point of the same transcription, (n), on a branch."""
        return BranchMotion(self.polisher, w, branch)

    def with_numbers(self, ocp: OptimalControlProblem) -> BranchMotion:
        """Return the same point, grid and branch in a problem with the same equations and other numbers."""
        return replace(self, polisher=BranchTranscription(replace(self.transcription, ocp=ocp)))

    def solved(self, run: Run, start: Start = SAME, iterations: int | None = None) -> PolishingReport | None:
        """Return the end of the branch NLP, begun at the point and its multipliers; None if no time is left.

        No function is made where another problem of the same equations was solved on the same grid and branch before.

        Args:
            run: of the NLP.
            start: how near the solution is.
            iterations: most of IPOPT; default: those of the run's effort for last digits.
        """
        return BranchNlp.of(self.polisher, run.options.compile).solve_once(
            self.branch,
            self.transcription.problem,
            self.values,
            run,
            settings=replace(BRANCH, start=start),
            limits=PolishingLimits(iterations or run.effort.settled_iterations, updates=0),
        )
