"""A solution, the motion that it is, and what the audit says about that."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import local_errors
from fesd_robot.mpcc import MpccSolution
from fesd_robot.ocp import MotionProblem, motion_audit, motion_outcome, numeric_physics, physical_motion
from fesd_robot.plans import Audit, LocalSearch, Outcome, Refinement
from fesd_robot.ranges import MAX_STAGES
from fesd_robot.recovery import NumericPhysics, PhysicalMotion
from fesd_robot.replay import MotionReplay, replay_intervals


@dataclass(frozen=True)
class SolvedMotion:
    """A solution, the motion that it is, and what the audit says about that.

    Attributes:
        motion: the formulated task, with the discretisation that was solved.
        on_branch: its point, with the multipliers that are known, on its branch.
        solution: how that was found.
        search: how it was searched from the motion that was found first; None if it was not.
        rounds, seconds: of refinement, rounds that found no solution included in the seconds.
    """

    motion: MotionProblem
    on_branch: BranchMotion
    solution: MpccSolution
    search: LocalSearch | None = None
    rounds: int = 0
    seconds: float = 0.0

    @classmethod
    def of(cls, motion: MotionProblem, polisher: BranchTranscription, solution: MpccSolution) -> SolvedMotion:
        """Return the motion of a solution that was not refined."""
        return cls(motion, BranchMotion.of_solution(polisher, solution), solution)

    def continued(self, polisher: BranchTranscription, solution: MpccSolution) -> SolvedMotion:
        """Return the motion of a solution that continues this one, searched and refined as this one was.

        Args:
            polisher, solution: of the solution.
        """
        own = SolvedMotion.of(self.motion, polisher, solution)
        return replace(own, search=self.search, rounds=self.rounds, seconds=self.seconds)

    @property
    def without_shrunk(self) -> SolvedMotion:
        """The same exact motion, on whose branch elements that have shrunk to nothing have no length."""
        own = self.on_branch
        branch = own.polisher.branch_of_exact(own.branch, own.w)
        if branch == own.branch:
            return self
        return replace(self, on_branch=replace(own, branch=branch), solution=replace(self.solution, branch=branch))

    @property
    def cost(self) -> float:
        """Of the solution."""
        return self.solution.residuals.objective

    @property
    def transcription(self) -> Transcription:
        """Of the problem that was solved."""
        return self.on_branch.transcription

    @property
    def stages(self) -> int:
        """Of every element."""
        return self.transcription.options.tableau.stages

    @cached_property
    def physics(self) -> NumericPhysics:
        """Pinocchio's view of the robot."""
        return numeric_physics(self.motion)

    @cached_property
    def physical(self) -> PhysicalMotion:
        """The motion in physical time."""
        motion = replace(self.motion, fesd=self.transcription.options)
        return physical_motion(motion, self.on_branch.elements, self.on_branch.branch)

    @cached_property
    def audit(self) -> Audit:
        """What the audit says."""
        return self._audit_with(self.replay)

    @cached_property
    def outcome(self) -> Outcome:
        """By how much it misses its task's goal, and what its contacts did."""
        return motion_outcome(self.motion, self.physical, self.physics)

    @property
    def passes(self) -> bool:
        """Whether the audit finds no violation; where there is one without the replay, nothing is driven again."""
        return not self._known_audit.violations and not self.audit.violations

    def spares(self, share: float) -> bool:
        """Return whether all entries of the audit are at most this share of their limits; replayed only if need be.

        Velocities after impacts do not count: the law of contacts that hit at once is no question of accuracy.
        """
        if self._known_audit.worst[0] <= share and self.audit.worst[0] <= share:
            return True
        return self.audit_without_replay.worst[0] <= share and self._audit_without_impacts.worst[0] <= share

    @property
    def _known_audit(self) -> Audit:
        """What the audit says, without the replay as long as nobody has asked for it."""
        return self.audit if "audit" in self.__dict__ else self.audit_without_replay

    @cached_property
    def audit_without_replay(self) -> Audit:
        """What the audit says as long as the motion is not driven again."""
        return self._audit_with(None)

    @cached_property
    def _audit_without_impacts(self) -> Audit:
        return self._audit_with(self.replay.without_impacts)

    def _audit_with(self, replay: MotionReplay | None) -> Audit:
        return motion_audit(self.motion, self.physical, self.physics, replay, self._interval_ends)

    @cached_property
    def _interval_ends(self) -> np.ndarray | None:
        """When control intervals should end, s: on a grid that moves where they do, but for its knots."""
        grid = self.transcription.grid
        if not grid.moving:
            return None
        ends = self.physical.clock
        expected, knots = ends.copy(), np.array(grid.knots)
        duration = self.motion.grid.duration(ends)
        expected[knots - 1] = grid.nodes[knots] * duration / grid.nodes[-1]
        return expected

    def counted(self, rounds: int, seconds: float) -> SolvedMotion:
        """Return the same motion with these numbers; its audit and its errors are not worked out again."""
        one = replace(self, rounds=rounds, seconds=seconds)
        one.__dict__.update({**self.__dict__, "rounds": rounds, "seconds": seconds})
        return one

    @cached_property
    def replay(self) -> MotionReplay:
        """The motion driven again, interval by interval."""
        return replay_intervals(self.physical, self.physics)

    def replay_among(self, intervals: Collection[int]) -> MotionReplay:
        """Return some intervals of the motion driven again."""
        if "replay" in self.__dict__:
            return MotionReplay(tuple(one for one in self.replay.intervals if one.interval in intervals))
        return replay_intervals(self.physical, self.physics, intervals)

    @cached_property
    def local_errors(self) -> np.ndarray:
        """Estimated local error of every element, (number of elements); zeros where no scheme has one more stage."""
        if self.stages == MAX_STAGES:
            return np.zeros(sum(self.transcription.elements))
        return local_errors(self.on_branch)

    @property
    def has_errors(self) -> bool:
        """Whether its local errors are known, so that nothing is worked out for them."""
        return "local_errors" in self.__dict__

    @property
    def refinement(self) -> Refinement | None:
        """How it was refined, None if it is not exact."""
        if not self.solution.exact:
            return None
        return Refinement(
            rounds=self.rounds,
            seconds=self.seconds,
            elements=sum(self.transcription.elements),
            largest_local_error=float(self.local_errors.max()),
        )
