"""The motion on a sequence of phases, by one or a few branch NLPs in which their durations are free."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fesd_robot.fesd import SHORTEST_PHASE
from fesd_robot.fesd.neighbours import KnownTrajectory
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.mpcc import (
    BRANCH,
    BranchNlp,
    MpccSolution,
    NlpReport,
    NlpStatus,
    PolishingLimits,
    PolishingReport,
    Run,
)
from fesd_robot.nlp import AT, AT_REST, FREE, NEAR, Hopeless, Iterate, NlpSettings, Start
from fesd_robot.ocp import AUTOMATIC_AUXILIARY_FORCE, MotionProblem
from fesd_robot.phases.discretised import Discretised, discretised
from fesd_robot.phases.idle import idle_slides
from fesd_robot.phases.reading import sequence_of
from fesd_robot.phases.sequence import Sequence
from fesd_robot.phases.start import States, start_along, start_with

FIXED = NlpSettings(FREE, tolerance=1e-2, violation=1e-5)
"""How an NLP is solved with the durations of the guess, from a point that is no motion: its end is a start, no more."""

NEARLY_FIXED = replace(FIXED, start=NEAR, regularised=True, at_rest=AT_REST)
"""How it goes on where iterations were missing only: how many it takes may double with the last bit of a derivative."""

ROUGH_VIOLATION = 1e-2
"""Violation of constraints above which its end is no start either."""

FREED = NlpSettings(FREE, tolerance=1e-6, violation=1e-12)
"""How an NLP is solved where durations are free, from a motion with given ones. Constraints hold to round-off then, and
the cost is right to a millionth. The last digits of forces that cost nothing, as of feet against each other, take most
of the iterations of a smaller tolerance."""

NEIGHBOUR = replace(FREED, start=Start(1e-2, 1e-3))
"""The same from the motion of another sequence."""

ITERATIONS_AT_ONCE = 50
"""After which an NLP goes on only if it nearly holds its constraints, without the impacts that are none."""

HOPELESS = ((20, 1.0), (30, 0.1))
"""Iterations after which the NLP of a neighbour is given up that has never violated constraints by less. Of those that
ended in a cheaper motion the worst had come to 0.1 by iteration 12; half of the others never come below 1."""

SCREENED_FROM, SCREENED_TIMES = 8, 3
"""First iteration of a neighbour's NLP whose objective and bound by weak duality count, and how many of them, one after
the other."""

SCREENED_GAP = 0.05
"""Part of the cost by which both may differ. The objective alone is several times too high as long as the barrier is,
the bound alone where multipliers are far from those of a solution."""

PROMISING = 1e-2
"""Violation of constraints up to which it does."""

KNOWN = AGAIN = replace(FREED, start=NEAR)
"""How an NLP is solved from a motion of the same sequence on another grid, and where it goes on, only bounds of
durations have moved, or a phase or an impact is left out."""

SETTLED = replace(BRANCH, start=AT)
"""How an NLP is solved for the last digits."""

GOING_ON = replace(AGAIN, regularised=True, at_rest=AT_REST)
"""How it is where an NLP is at its point and does not end."""

KEPT_GRIDS = 6
"""Sequences whose grids are kept, those that were asked for last."""

SHORTER, LONGER = 0.4, 2.2
"""Factors within which durations are free in one NLP. Without bounds a long motion may collapse on the way, phases of a
millisecond beside one that lasts as long as all."""

DURATION_AT_BOUND = 0.02
"""Part of a bound within which a duration is at it."""

VANISHED = 1.5 * SHORTEST_PHASE
"""s; a phase that is this short at the end of an NLP is left out."""

MUCH_LONGER = 1.6
"""Times as long as the mean an interval may be; where one is longer, intervals are shared out again."""

SOFT = 1e-4
"""Part of the largest impulse of a sequence, and at least of the weight in a second, below which an impact is none: it
leaves multipliers undetermined, and an interior-point method without an end although its point is right."""

NEARLY = 1e-3
"""Violation of constraints below which the end of an NLP shows which impacts there are, converged or not."""


@dataclass(frozen=True)
class PhaseMotion:
    """The exact motion on a sequence.

    Attributes:
        own: the sequence, with the durations of the guess, on its grid.
        report: of the NLP that it is the end of.
    """

    own: Discretised
    report: PolishingReport

    @property
    def w(self) -> np.ndarray:
        """The point, (n)."""
        return self.report.w

    @property
    def cost(self) -> float:
        """Of the task."""
        return self.report.residuals.objective

    @property
    def sequence(self) -> Sequence:
        """With the durations that it has."""
        return self.own.solved(self.w)

    @property
    def on_branch(self) -> BranchMotion:
        """The point, with its multipliers, on the branch of the sequence."""
        return BranchMotion(self.own.polisher, self.report.point, self.own.branch)

    @property
    def along(self) -> KnownTrajectory:
        """What the solve of another sequence may begin along."""
        return KnownTrajectory.of(self.on_branch)

    def solution(self, reports: list[NlpReport], seconds: float) -> MpccSolution:
        """Return the solution that it is."""
        return replace(self.report, branch=self.own.branch, status=NlpStatus.CONVERGED).as_solution(reports, seconds)


def _well_shared(motion: PhaseMotion) -> bool:
    """Return whether no phase has intervals that are much longer than they would be if all were shared out again."""
    own, durations = motion.own, motion.sequence.durations
    lengths = durations / np.array(own.counts)
    return bool((lengths <= MUCH_LONGER * durations.sum() / sum(own.counts)).all())


@dataclass
class _Screening:
    """What is to be expected of the NLPs of a neighbour.

    Attributes:
        below: cost that its motion is to stay below.
        origin: key of the sequence that it is a neighbour of.
        hope: part of the cost that may still be gained.
        pruned: whether they lead to no motion, or to one that costs clearly more.
    """

    below: float
    origin: tuple[object, ...]
    hope: float
    pruned: bool = False
    _least: float = np.inf
    _dear: int = 0

    def __call__(self, at: Iterate) -> bool:
        """Look at an iterate; return whether to give up."""
        if at.iteration == 1:
            self._least, self._dear = np.inf, 0
        self._least = min(self._least, at.violation)
        settled = at.iteration >= SCREENED_FROM and at.violation <= PROMISING
        least, cost = min(at.objective, at.bound), abs(self.below)
        dear = settled and least > self.below + self.hope * cost and abs(at.objective - at.bound) <= SCREENED_GAP * cost
        self._dear = self._dear + 1 if dear else 0
        far = any(at.iteration >= iterations and self._least > most for iterations, most in HOPELESS)
        self.pruned = far or self._dear >= SCREENED_TIMES
        return self.pruned


@dataclass
class PhaseSolver:
    """Finds the motions of sequences of one task.

    Attributes:
        motion: the formulated task, on a moving grid.
        run: of all NLPs.
        reports: of all NLPs so far.
        parts: elements of every interval, beside impacts.
    """

    motion: MotionProblem
    run: Run
    reports: list[NlpReport] = field(default_factory=list)
    parts: int = 1
    _grids: dict[tuple[Sequence, int], Discretised] = field(default_factory=dict)

    @property
    def over(self) -> bool:
        """Whether the user ended the last NLP, or no time is left."""
        return self.run.deadline.left <= 0 or any(one.status is NlpStatus.INTERRUPTED for one in self.reports[-1:])

    @property
    def first(self) -> Discretised | None:
        """The sequence on its grid that was asked for before all others that are kept; None if there is none."""
        return next(iter(self._grids.values()), None)

    def from_guess(self, sequence: Sequence, below: float = np.inf, state: States | None = None) -> PhaseMotion | None:
        """Return the motion of a sequence, from the initial guess of the task; None if none is found.

        Args:
            sequence: with durations that are guessed.
            below: cost above which durations are not freed; of a motion with given durations it is hardly reached.
            state: another guess.
        """
        own, effort = self.on_grid(sequence), self.run.effort
        w = own.transcription.problem.start if state is None else start_with(own, state)
        lengths = own.sequence.durations
        if (end := self._end(own, w, lengths, lengths, FIXED, effort.guess_iterations)) is None:
            return None
        if end.residuals.constraint_violation <= ROUGH_VIOLATION and not end.status.converged:
            end = self._end(own, end.w, lengths, lengths, NEARLY_FIXED, effort.guess_iterations) or end
        if end.residuals.constraint_violation <= ROUGH_VIOLATION:
            found = self._freed(own, end.w, FREED, effort.free_iterations, below)
            if found is None and not np.isfinite(below):  # what is lost from far away may be found from near by
                found = self._freed(own, end.w, AGAIN, effort.neighbour_iterations, below)
            return found
        # No motion takes the durations of the guess, or none near to it does.
        shorter, longer = SHORTER * lengths, LONGER * lengths
        end = self._end(own, w, shorter, longer, FREED, effort.freed_iterations)
        if end is None or not end.residuals.constraint_violation <= PROMISING:
            return None
        return self._freed(own, end.w, AGAIN, effort.free_iterations, below)

    def again(self, sequence: Sequence, w: np.ndarray) -> KnownTrajectory:
        """Return what the solve of a sequence may begin along, of a motion that another process has found.

        Args:
            sequence: of the motion, with the durations of its guess.
            w: the motion, (n).
        """
        own = self.on_grid(sequence)
        return KnownTrajectory.of(BranchMotion(own.polisher, w, own.branch))

    def motion_of(self, sequence: Sequence, report: PolishingReport) -> PhaseMotion:
        """Return a motion that another process has found, of a sequence with the durations of its guess."""
        return PhaseMotion(self.on_grid(sequence), report)

    def from_known(self, sequence: Sequence, along: KnownTrajectory) -> PhaseMotion | None:
        """Return the motion of the sequence of another motion, from that; None if none is found.

        Args:
            sequence: of that motion, with its durations.
            along: that motion, on whatever grid.
        """
        own = self.on_grid(sequence)
        w, lengths, iterations = start_along(along, own), own.sequence.durations, self.run.effort.free_iterations
        if found := self._freed(own, w, KNOWN, iterations, np.inf):
            return found
        end = self._end(own, w, lengths, lengths, KNOWN, iterations)
        if end is None or not end.exact:
            return None
        given = None if idle_slides(self.motion, own, end.w) else PhaseMotion(own, end)
        return self._freed(own, end.w, NEIGHBOUR, iterations, np.inf) or given

    def from_motion(self, sequence: Sequence, along: KnownTrajectory, below: float = np.inf) -> PhaseMotion | None:
        """Return the motion of a sequence, from that of another; None if none is found.

        Args:
            sequence: with durations near to those of that motion.
            along: that motion.
            below: cost that it is to stay below; where it does not after one NLP it is given up.
        """
        own, effort = self.on_grid(sequence), self.run.effort
        screening = _Screening(below, sequence_of(along).key_with(self.motion.ocp.knots), effort.hope)
        return self._freed(own, start_along(along, own), NEIGHBOUR, effort.neighbour_iterations, below, screening)

    def nonzeros(self, motion: PhaseMotion) -> int:
        """Return how many numbers the derivatives of the NLP of a motion are."""
        nlp = BranchNlp.of(motion.own.polisher, self.run.options.compile).nlp.program
        return int(nlp.jacobian.nnz_out("jac_g_x") + nlp.hessian.nnz_out(0))

    def settled(self, motion: PhaseMotion) -> PhaseMotion:
        """Return a motion to the last digits, as a certificate asks for them; as it is if that fails."""
        own, nothing = motion.own, np.zeros(len(motion.own.counts))
        end = self._end(own, motion.w, nothing, nothing + np.inf, SETTLED, self.run.effort.settled_iterations)
        return PhaseMotion(own, end) if end and end.exact else motion

    def _freed(
        self,
        own: Discretised,
        w: np.ndarray,
        settings: NlpSettings,
        iterations: int,
        below: float,
        screening: _Screening | None = None,
    ) -> PhaseMotion | None:
        """Return the motion with free durations: their bounds move until none is met, and no phase has vanished.

        Args:
            own, w: the sequence on its grid, and where to begin, (n).
            settings, iterations: of the first NLP.
            below: cost that it is to stay below.
            screening: of a neighbour.
        """
        found: PhaseMotion | None = None
        lengths, hope = own.sequence.durations, self.run.effort.hope
        patience, at_once = iterations // ITERATIONS_AT_ONCE, ITERATIONS_AT_ONCE
        for _ in range(self.run.effort.sequence_rounds + patience):
            end = self._end(own, w, SHORTER * lengths, LONGER * lengths, settings, at_once, screening)
            if end is None or not np.isfinite(end.w).all() or (screening and screening.pruned):
                break
            near, violation = PhaseMotion(own, end), end.residuals.constraint_violation
            if violation <= NEARLY and not end.exact and near.cost > below + hope * abs(below):
                return None
            soft = self._soft(near) if violation <= NEARLY else []
            if not (end.exact or soft):
                digits = end.status.converged and violation <= NEARLY and settings is not SETTLED
                more = end.status is NlpStatus.ITERATION_LIMIT and patience > 0 and violation <= PROMISING
                if not (digits or more):
                    break
                w, settings = end.w, SETTLED if digits else GOING_ON
                patience, at_once = patience - more, iterations
                continue
            idle = idle_slides(self.motion, own, end.w) if violation <= NEARLY else []
            found = near if end.exact and not idle else found
            durations = near.sequence.durations
            vanished = [i for i, duration in enumerate(durations) if duration <= VANISHED and len(durations) > 1]
            at_bound = (durations <= (1 + DURATION_AT_BOUND) * SHORTER * lengths) | (
                durations >= (1 - DURATION_AT_BOUND) * LONGER * lengths
            )
            fits = not (soft or vanished or idle) and self._covered(near) and _well_shared(near)
            moves = not fits or bool(at_bound.any())
            if end.exact and near.cost > below + (hope if moves else 0.0) * abs(below):
                return None
            if end.exact and not moves:
                return near
            settings, at_once = NEIGHBOUR if idle else AGAIN, ITERATIONS_AT_ONCE
            if fits:
                lengths, w = durations, end.w
                continue
            less = near.sequence.sticking(idle) if idle else near.sequence.without_impacts(soft).without(vanished)
            if screening and near.cost > below and less.key_with(self.motion.ocp.knots) == screening.origin:
                break
            own = self.on_grid(less)
            lengths, w = own.sequence.durations, start_along(near.along, own)
        return found if found and found.cost < below else None

    def _soft(self, motion: PhaseMotion) -> list[tuple[int, int]]:
        """Return the impacts that change nothing, by the number of a phase and their number there."""
        steps = motion.own.impact_steps(motion.w)
        weight = 1.0 / AUTOMATIC_AUXILIARY_FORCE
        largest = max([weight, *(step for own in steps for step in own)])
        return [(i, n) for i, own in enumerate(steps) for n, step in enumerate(own) if step <= SOFT * largest]

    def _covered(self, found: PhaseMotion) -> bool:
        """Return whether every interval is compared with the reference at its own times."""
        spline, grid = self.motion.reference_spline, found.own.transcription.grid
        clocks, nodes = found.own.clocks(found.w), grid.nodes
        pace = clocks[-1] / nodes[-1]
        return all(
            spline.covers((nodes[k] + nodes[k + 1]) / 2, clocks[k + side] / pace)
            for k in range(grid.intervals)
            for side in (0, 1)
        )

    def on_grid(self, sequence: Sequence) -> Discretised:
        """Return a sequence on its grid; a few are kept, for all neighbours of a motion begin from its own."""
        asked = sequence.without_knots.lasting(self.motion.grid.nominal), self.parts
        known = self._grids.pop(asked, None)
        self._grids[asked] = known or discretised(self.motion, *asked)
        if len(self._grids) > KEPT_GRIDS:
            del self._grids[next(iter(self._grids))]
        return self._grids[asked]

    def _end(
        self,
        own: Discretised,
        w: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        settings: NlpSettings,
        iterations: int,
        hopeless: Hopeless | None = None,
    ) -> PolishingReport | None:
        """Return the end of the branch NLP with durations between bounds, s, (P); None if no time is left."""
        if self.over:
            return None
        nlp = BranchNlp(own.within(lower, upper), BranchNlp.of(own.polisher, self.run.options.compile).nlp)
        return nlp.solve_once(
            own.branch,
            own.transcription.problem,
            w,
            replace(self.run, report=self._report),
            settings=settings,
            limits=PolishingLimits(iterations, updates=0, hopeless=hopeless),
        )

    def _report(self, nlp: NlpReport) -> None:
        self.reports.append(nlp)
        self.run.notify(nlp)
