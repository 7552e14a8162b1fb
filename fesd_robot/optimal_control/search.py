"""The search for the cheapest solution of an optimal control problem: exact ends, moves between branches, descent."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.exactness import SAME_COST, ZERO_PRODUCT
from fesd_robot.fesd import EQUILIBRATION, FesdOptions, OptimalControlProblem, Transcription
from fesd_robot.fesd.neighbours import filled, mode_shifts, with_room, without_room
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription, problem_around
from fesd_robot.mpcc import (
    BranchSolver,
    Certificate,
    MpccSolution,
    NlpReport,
    PolishingLimits,
    PolishingReport,
    Residuals,
    Run,
    assemble,
    certify,
    solve,
)
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.optimal_control.settings import OptimalControlSettings
from fesd_robot.optimal_control.solution import StartReport
from fesd_robot.optimal_control.starts import start_of

UNEVEN = 2.0
"""Ratio of the lengths of neighbouring elements of one mode from which they are not equally long."""

DESCENT_STEPS = (1.0, 0.1, 1e-2, 1e-3)
"""Parts of a direction of descent at whose ends branches are read."""


@dataclass(frozen=True)
class Candidate:
    """A point that may be returned, and the moves that led to it.

    Attributes:
        motion: the point, and its branch.
        residuals: there.
        solved, exact: whether products are at most the tolerance, or zero to round-off.
        cost_terms: name -> part of the cost, without step equilibration.
        moves: in words.
    """

    motion: BranchMotion
    residuals: Residuals
    solved: bool
    exact: bool
    cost_terms: dict[str, float]
    moves: tuple[str, ...] = ()

    @property
    def transcription(self) -> Transcription:
        """Of the point."""
        return self.motion.transcription

    @property
    def w(self) -> np.ndarray:
        """The point, (n)."""
        return self.motion.w

    @property
    def branch(self) -> Branch:
        """On which the point lies."""
        return self.motion.branch

    @property
    def cost(self) -> float:
        """Sum of the cost's terms."""
        return sum(self.cost_terms.values())

    @property
    def rank(self) -> tuple[bool, bool, float]:
        """Solved ones first, then those with even steps, then the cheaper; else that which violates least."""
        return not self.solved, not self._is_even, self.cost if self.solved else self.residuals.constraint_violation

    @property
    def _is_even(self) -> bool:
        """Whether elements of one mode that follow each other in an interval are about equally long.

        Where they are not, an interval is left to fewer elements, whose errors a cost can gain from.
        """
        whole = list(zip(self.motion.elements, self.branch.factors, strict=True))
        return all(
            one.interval != other.interval
            or mode != next_mode
            or max(one.step, other.step) < UNEVEN * min(one.step, other.step)
            for (one, mode), (other, next_mode) in pairwise(whole)
        )


@dataclass
class Search:
    """The transcriptions of a problem, whose functions are made once, and what was found on them.

    Attributes:
        problem, options, settings: what is solved, and how.
        run: of all NLPs.
        starts: what became of every start.
        iterations: of IPOPT.
    """

    problem: OptimalControlProblem
    options: FesdOptions
    settings: OptimalControlSettings
    run: Run
    starts: list[StartReport] = field(default_factory=list)
    iterations: int = 0

    def __post_init__(self) -> None:
        self._base = Transcription(self.problem, self.options)
        homotopy = self.run.options
        self._relaxed = assemble(self._base.problem, relaxation_named(homotopy.relaxation), homotopy.compile)
        self._polisher = BranchTranscription(self._base)

    @property
    def is_over(self) -> bool:
        """Whether no time is left."""
        return self.run.deadline.left <= 0

    def candidates(self, number: int) -> list[Candidate]:
        """Return the ends of the two homotopies from a start, exact where they can be made so.

        Args:
            number: of the start, from 0.
        """
        start = Transcription(start_of(self.problem, number, self.settings.seed), self.options).bounds_and_start()[2]
        found: list[Candidate] = []
        for way in ("loose", "converging"):
            if found and self.is_over:
                break
            options = self.settings.homotopy(polish=way == "loose")
            solution = solve(
                replace(self._base.problem, start=start),
                replace(self._own_run, options=options),
                nlp=self._relaxed,
                polisher=self._polisher if way == "loose" else None,
            )
            own = self._of_solution(solution)
            found += [own, *self._exact_ends(own)]
            best = self.best_of(found[-2:])
            self.starts.append(StartReport(number, way, best.solved, best.cost, solution.status, solution.iterations))
        return found

    def best_of(self, candidates: list[Candidate]) -> Candidate:
        """Return the cheapest that is solved; of those that cost the same an exact one, in elements with room."""
        best = min(candidates, key=lambda one: one.rank)
        if not best.solved:
            return best
        same = [one for one in candidates if one.rank[:2] == best.rank[:2] and one.cost <= _above(best.cost)]
        return min(same, key=lambda one: (not self._is_roomy(one), not one.exact, one.cost))

    def finished(self, candidate: Candidate) -> tuple[Candidate, Certificate | None]:
        """Return the candidate from which no move and no direction leads to a cheaper one, and its certificate."""
        for _ in range(self.run.effort.shift_rounds):
            if self.settings.search and self._is_roomy(candidate):
                candidate = self._shifted(candidate)
            certificate = self._certificate(candidate)
            better = self._descended(candidate, certificate)
            if better is None:
                break
            candidate = better
        fewer = self._without_room(candidate)
        return fewer, certificate if fewer is candidate else self._certificate(fewer)

    def _of_solution(self, solution: MpccSolution) -> Candidate:
        motion, costs = BranchMotion.of_solution(self._polisher, solution), _costs(self._base, solution.w)
        return Candidate(motion, solution.residuals, solution.solved, solution.exact, costs)

    def _exact_ends(self, candidate: Candidate) -> list[Candidate]:
        """Return the exact end near a candidate with room for its switches, or nothing if there is none."""
        if not (self._has_room and candidate.solved):
            return []
        branches = [candidate.branch] if candidate.exact else self._polisher.candidate_branches(candidate.w)
        for branch in branches:
            if found := self._exact(with_room(candidate.motion.at(candidate.w, branch)), candidate.moves):
                return [found]
        return []

    def _exact(self, start: BranchMotion, moves: tuple[str, ...], *, freer: bool = False) -> Candidate | None:
        """Return the exact end on a branch with room, None if there is none nearby."""
        limits = PolishingLimits(self.run.effort.shift_iterations, self.run.effort.branch_updates)
        end = self._branch_solver.exact(start, limits=limits, freer=freer)
        if end is None:
            return None
        end = self._filled(end)
        costs = _costs(self._room.transcription, end.w)
        return Candidate(BranchMotion(self._room, end.point, end.branch), end.residuals, True, True, costs, moves)

    def _filled(self, end: PolishingReport) -> PolishingReport:
        """Return an exact end with all elements in use: those that have shrunk to nothing hide where a switch is."""
        room = self._room
        for _ in range(self.run.effort.shift_fillings):
            branch = room.updated_branch(end.branch, end.w) or end.branch
            if not any(branch.without_length):
                break
            again = self._branch_solver.exact(filled(BranchMotion(room, end.w, branch)))
            if again is None or again.residuals.objective > _above(end.residuals.objective):
                break
            end = again
        return end

    def _shifted(self, candidate: Candidate) -> Candidate:
        """Return the candidate from which no shift of a switch leads to a cheaper one."""
        for _ in range(self.run.effort.shift_rounds):
            better = self._one_shifted(candidate)
            if better is None:
                break
            candidate = better
        return candidate

    def _one_shifted(self, candidate: Candidate) -> Candidate | None:
        below = _below(candidate.cost)
        for shift in mode_shifts(candidate.motion):
            if self.is_over:
                return None
            found = self._exact(shift.motion, (*candidate.moves, shift.name), freer=True)
            if found and found.cost < below:
                return found
        return None

    def _certificate(self, candidate: Candidate) -> Certificate | None:
        if not candidate.solved or self.is_over:
            return None
        problem = problem_around(candidate.motion) if candidate.exact else candidate.transcription.problem
        product = ZERO_PRODUCT if candidate.exact else self.settings.tolerance
        seconds = min(self.run.effort.certificate_seconds, 0.75 * self.run.deadline.left)
        return certify(problem, candidate.w, tolerance=product, time_limit=seconds)

    def _descended(self, candidate: Candidate, certificate: Certificate | None) -> Candidate | None:
        """Return a cheaper candidate on a branch that a direction of descent points to, None if there is none."""
        if certificate is None or certificate.direction is None or not self._is_roomy(candidate):
            return None
        polisher, below = candidate.motion.polisher, _below(candidate.cost)
        tried: list[Branch] = [candidate.branch]
        for step in DESCENT_STEPS:
            w = candidate.w + step * certificate.direction
            for branch in polisher.candidate_branches(w):
                if branch in tried or self.is_over:
                    continue
                tried.append(branch)
                own = candidate.motion.at(candidate.w, branch)
                found = self._exact(own, (*candidate.moves, "a direction of descent"), freer=True)
                if found and found.cost < below:
                    return found
        return None

    def _without_room(self, candidate: Candidate) -> Candidate:
        """Return an exact candidate with as many elements as it needs, as it is if that fails."""
        if not candidate.exact or candidate.transcription is self._base:
            return candidate
        fewer = without_room(candidate.motion, self._base.elements)
        end = BranchSolver(fewer.transcription.problem, fewer.polisher, self._own_run).exact(fewer)
        if end is None or end.residuals.objective > _above(candidate.cost):
            return candidate
        motion, costs = BranchMotion(fewer.polisher, end.point, end.branch), _costs(fewer.transcription, end.w)
        return Candidate(motion, end.residuals, True, True, costs, candidate.moves)

    def _is_roomy(self, candidate: Candidate) -> bool:
        """Return whether a candidate is exact in elements with room for its switches."""
        return candidate.exact and candidate.transcription is not self._base

    @property
    def _has_room(self) -> bool:
        """Whether elements can be added between those of a solution."""
        return self.options.tableau.collocation and self.options.switch_detection

    @cached_property
    def _room(self) -> BranchTranscription:
        start = self._base.problem.start
        return with_room(BranchMotion(self._polisher, start, self._polisher.branch(start))).polisher

    @cached_property
    def _branch_solver(self) -> BranchSolver:
        return BranchSolver(
            self._room.transcription.problem,
            self._room,
            self._own_run,
            few_evaluations=False,
        )

    @cached_property
    def _own_run(self) -> Run:
        return replace(self.run, report=self._report)

    def _report(self, report: NlpReport) -> None:
        self.iterations += report.iterations
        self.run.notify(report)


def _costs(transcription: Transcription, w: np.ndarray) -> dict[str, float]:
    terms = transcription.cost_terms(w)
    return {name: value for name, value in terms.items() if name != EQUILIBRATION}


def _above(cost: float) -> float:
    return cost + SAME_COST * max(1.0, abs(cost))


def _below(cost: float) -> float:
    return cost - SAME_COST * max(1.0, abs(cost))
