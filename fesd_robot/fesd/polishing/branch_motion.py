"""A trajectory on its branch, from which the same problem with other numbers is solved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.polishing.transcription import BranchTranscription
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import BRANCH, BranchNlp, PolishingLimits, PolishingReport, Run
from fesd_robot.nlp import SAME, NlpPoint, Start


@dataclass(frozen=True)
class BranchMotion:
    """A trajectory on its branch.

    Attributes:
        polisher: transcription of the branch NLP.
        point: variables, and multipliers of the branch NLP.
        branch: on which it lies.
    """

    polisher: BranchTranscription
    point: NlpPoint
    branch: Branch

    @classmethod
    def of(
        cls, polisher: BranchTranscription, w: np.ndarray, branch: Branch, point: NlpPoint | None = None
    ) -> BranchMotion:
        """Return the trajectory of a point, (n), with the multipliers that are known."""
        return cls(polisher, point or NlpPoint.without_multipliers(w, polisher.problem.constraints), branch)

    @property
    def transcription(self) -> Transcription:
        """Of the problem with pairs."""
        return self.polisher.transcription

    @property
    def w(self) -> np.ndarray:
        """Variables, (n)."""
        return self.point.x

    @property
    def elements(self) -> list[Element]:
        """In time order."""
        return self.transcription.unpack(self.w)

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
            self.point,
            run,
            settings=replace(BRANCH, start=start),
            limits=PolishingLimits(iterations or run.effort.settled_iterations, updates=0),
        )
