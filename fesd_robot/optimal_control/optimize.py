"""Optimal control of a complementarity system: several starts, exact switches, moves between branches, descent."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription
from fesd_robot.fesd.interval import EQUILIBRATION
from fesd_robot.fesd.neighbours import filled, mode_shifts, with_room, without_room
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import (
    BranchPoint,
    BranchSolver,
    Certificate,
    MpccSolution,
    NlpReport,
    PolishingReport,
    Residuals,
    certify,
    solve,
)
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.polishing import EXACT_PRODUCT
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.optimal_control.end_time import EndTime, with_end_time
from fesd_robot.optimal_control.settings import OptimalControlSettings
from fesd_robot.optimal_control.solution import OptimalControlSolution, StartReport
from fesd_robot.optimal_control.starts import start_of

LEAST_GAIN = 1e-7
"""Of the cost, relative to the larger of it and one; less is no improvement."""

MOST_ROUNDS = 100
"""Improvements of a solution, one after the other."""

MOST_FILLINGS = 2
"""How often elements that have shrunk to nothing are put to use again."""

SHIFT_ITERATIONS = 60
"""IPOPT iterations on the branch of a neighbour."""

DESCENT_STEPS = (1.0, 0.1, 1e-2, 1e-3)
"""Parts of a direction of descent at whose ends branches are read."""


def optimize(
    problem: OptimalControlProblem,
    options: FesdOptions | None = None,
    settings: OptimalControlSettings | None = None,
    *,
    end_time: EndTime | None = None,
    progress: Callable[[NlpReport], None] | None = None,
) -> OptimalControlSolution:
    """Solve an optimal control problem of a system with switches, and locate these exactly.

    From every initial guess two homotopies are followed, one loose and one of converging NLPs; the branch at their ends
    is solved exactly, in elements of which any may fill its control interval. Then switches are moved into neighbouring
    control intervals, and directions that linear programs find are followed, as long as that lowers the cost. What is
    returned costs no more than any solution that was met on the way.

    Args:
        problem: dynamics, bounds, costs and a guess.
        options: of the discretisation; default: Radau IIA with two stages, three elements.
        settings: starts, tolerance and time; default: four starts.
        end_time: if the end time is free.
        progress: called after every NLP.

    Returns:
        the cheapest solution; `solved` says whether it is one, `message` what is known of it.

    Raises:
        ModelError: the guess of the end time lies outside its bounds.
        SolverError: IPOPT could not be started.

    Source: Nurkanovic, Sperl, Albrecht, Diehl, arXiv 2205.05337; Nurkanovic, Leyffer, arXiv 2501.13835 (descent).
    """
    settings, begin = settings or OptimalControlSettings(), time.perf_counter()
    own = with_end_time(problem, end_time) if end_time else problem
    search = _Search(own, options or FesdOptions(), settings, progress, begin)
    candidates: list[_Candidate] = []
    for number in range(settings.starts + settings.more_starts):
        enough = number >= settings.starts and any(one.solved for one in candidates)
        if enough or (number and search.is_over):
            break
        candidates += search.candidates(number)
    best = search.best_of(candidates)
    best, certificate = search.finished(best)
    x_end = best.w[best.transcription.indices.state(own.intervals)]
    return OptimalControlSolution(
        problem=problem,
        transcription=best.transcription,
        w=best.w,
        branch=best.branch,
        solved=best.solved,
        exact=best.exact,
        residuals=best.residuals,
        cost_terms=best.cost_terms,
        end_time=float(x_end[-1]) if end_time else problem.duration,
        certificate=certificate,
        starts=search.starts,
        moves=best.moves,
        iterations=search.iterations,
        seconds=time.perf_counter() - begin,
    )


@dataclass(frozen=True)
class _Candidate:
    """A point that may be returned, and the moves that led to it."""

    transcription: Transcription
    w: np.ndarray
    branch: Branch
    residuals: Residuals
    solved: bool
    exact: bool
    cost_terms: dict[str, float]
    moves: tuple[str, ...] = ()

    @property
    def cost(self) -> float:
        return sum(self.cost_terms.values())

    @property
    def rank(self) -> tuple[bool, float]:
        """Solved ones first, the cheaper one before; else that which violates least."""
        return (not self.solved, self.cost if self.solved else self.residuals.constraint_violation)


@dataclass
class _Search:
    """The transcriptions of a problem, whose functions are made once, and what was found on them."""

    problem: OptimalControlProblem
    options: FesdOptions
    settings: OptimalControlSettings
    progress: Callable[[NlpReport], None] | None
    begin: float
    starts: list[StartReport] = field(default_factory=list)
    iterations: int = 0

    def __post_init__(self) -> None:
        self._base = Transcription(self.problem, self.options)
        homotopy = self.settings.homotopy(None, polish=True)
        self._relaxed = assemble(self._base.problem, relaxation_named(homotopy.relaxation), homotopy.compile)
        self._polisher = BranchTranscription(self._base)
        self._solver: BranchSolver | None = None
        self._roomy: BranchTranscription | None = None

    @property
    def is_over(self) -> bool:
        """Whether no time is left."""
        left = self._seconds_left()
        return left is not None and left <= 0

    def candidates(self, number: int) -> list[_Candidate]:
        """Return the ends of the two homotopies from a start, exact where they can be made so."""
        start = Transcription(start_of(self.problem, number, self.settings.seed), self.options).bounds_and_start()[2]
        found: list[_Candidate] = []
        for way in ("loose", "converging"):
            if found and self.is_over:
                break
            options = self.settings.homotopy(self._seconds_left(), polish=way == "loose")
            solution = solve(
                replace(self._base.problem, start=start),
                options,
                nlp=self._relaxed,
                polisher=self._polisher if way == "loose" else None,
                progress=self._report,
            )
            own = self._of_solution(solution)
            found += [own, *self._exact_ends(own)]
            best = self.best_of(found[-2:])
            self.starts.append(
                StartReport(number, way, best.solved, best.cost, solution.status, solution.iterations)
            )
        return found

    def best_of(self, candidates: list[_Candidate]) -> _Candidate:
        """Return the cheapest that is solved; of those that cost the same an exact one, in elements with room."""
        best = min(candidates, key=lambda one: one.rank)
        if not best.solved:
            return best
        same = [one for one in candidates if one.solved and one.cost <= _above(best.cost)]
        return min(same, key=lambda one: (not self._is_roomy(one), not one.exact, one.cost))

    def finished(self, candidate: _Candidate) -> tuple[_Candidate, Certificate | None]:
        """Return the candidate from which no move and no direction leads to a cheaper one, and its certificate."""
        for _ in range(MOST_ROUNDS):
            if self.settings.search and self._is_roomy(candidate):
                candidate = self._shifted(candidate)
            certificate = self._certificate(candidate)
            better = self._descended(candidate, certificate)
            if better is None:
                break
            candidate = better
        fewer = self._without_room(candidate)
        return fewer, certificate if fewer is candidate else self._certificate(fewer)

    def _of_solution(self, solution: MpccSolution) -> _Candidate:
        branch = solution.branch or self._polisher.branch(solution.w)
        return _Candidate(
            self._base, solution.w, branch, solution.residuals, solution.solved, solution.exact,
            _costs(self._base, solution.w),
        )  # fmt: skip

    def _exact_ends(self, candidate: _Candidate) -> list[_Candidate]:
        """Return the exact end near a candidate with room for its switches, or nothing if there is none."""
        if not (self._has_room and candidate.solved):
            return []
        branches = [candidate.branch] if candidate.exact else self._polisher.candidate_branches(candidate.w)
        for branch in branches:
            _, w, own = with_room(self._base, candidate.w, branch)
            if found := self._exact(w, own, candidate.moves):
                return [found]
        return []

    def _exact(
        self, w: np.ndarray, branch: Branch, moves: tuple[str, ...], *, freer: bool = False
    ) -> _Candidate | None:
        """Return the exact end on a branch with room, None if there is none nearby."""
        solver, transcription = self._branch_solver, self._room.transcription
        end = solver.exact(BranchPoint(w, branch, freer), iterations=SHIFT_ITERATIONS)
        if end is None:
            return None
        end = self._filled(end)
        costs = _costs(transcription, end.w)
        return _Candidate(transcription, end.w, end.branch, end.residuals, True, True, costs, moves)

    def _filled(self, end: PolishingReport) -> PolishingReport:
        """Return an exact end with all elements in use: those that have shrunk to nothing hide where a switch is."""
        room, transcription = self._room, self._room.transcription
        for _ in range(MOST_FILLINGS):
            branch = room.updated_branch(end.branch, end.w) or end.branch
            if not any(branch.without_length):
                break
            again = self._branch_solver.exact(BranchPoint(*filled(transcription, end.w, branch)))
            if again is None or again.residuals.objective > _above(end.residuals.objective):
                break
            end = again
        return end

    def _shifted(self, candidate: _Candidate) -> _Candidate:
        """Return the candidate from which no shift of a switch leads to a cheaper one."""
        for _ in range(MOST_ROUNDS):
            better = self._one_shifted(candidate)
            if better is None:
                break
            candidate = better
        return candidate

    def _one_shifted(self, candidate: _Candidate) -> _Candidate | None:
        below = _below(candidate.cost)
        for shift in mode_shifts(candidate.transcription, candidate.w, candidate.branch):
            if self.is_over:
                return None
            found = self._exact(shift.w, shift.branch, (*candidate.moves, shift.name), freer=True)
            if found and found.cost < below:
                return found
        return None

    def _certificate(self, candidate: _Candidate) -> Certificate | None:
        left = self._seconds_left()
        if not candidate.solved or self.is_over:
            return None
        polisher = BranchTranscription(candidate.transcription)
        problem = polisher.with_equal_steps(candidate.branch) if candidate.exact else candidate.transcription.problem
        product = EXACT_PRODUCT if candidate.exact else self.settings.tolerance
        seconds = 30.0 if left is None else min(30.0, 0.5 * left)
        return certify(problem, candidate.w, tolerance=product, time_limit=seconds)

    def _descended(self, candidate: _Candidate, certificate: Certificate | None) -> _Candidate | None:
        """Return a cheaper candidate on a branch that a direction of descent points to, None if there is none."""
        if certificate is None or certificate.direction is None or not self._is_roomy(candidate):
            return None
        polisher, below = BranchTranscription(candidate.transcription), _below(candidate.cost)
        tried: list[Branch] = [candidate.branch]
        for step in DESCENT_STEPS:
            w = candidate.w + step * certificate.direction
            for branch in polisher.candidate_branches(w):
                if branch in tried or self.is_over:
                    continue
                tried.append(branch)
                found = self._exact(candidate.w, branch, (*candidate.moves, "a direction of descent"), freer=True)
                if found and found.cost < below:
                    return found
        return None

    def _without_room(self, candidate: _Candidate) -> _Candidate:
        """Return an exact candidate with as many elements as it needs, as it is if that fails."""
        if not candidate.exact or candidate.transcription is self._base:
            return candidate
        fewer, w, branch = without_room(
            candidate.transcription, candidate.w, candidate.branch, self._base.elements
        )
        polisher, options = BranchTranscription(fewer), self.settings.homotopy(None, polish=True)
        solver = BranchSolver(fewer.problem, polisher, options, self._seconds_left, progress=self._report)
        end = solver.exact(BranchPoint(w, branch))
        if end is None or end.residuals.objective > _above(candidate.cost):
            return candidate
        return _Candidate(
            fewer, end.w, end.branch, end.residuals, True, True, _costs(fewer, end.w), candidate.moves
        )

    def _is_roomy(self, candidate: _Candidate) -> bool:
        """Whether a candidate is exact in elements with room for its switches."""
        return candidate.exact and candidate.transcription is not self._base

    @property
    def _has_room(self) -> bool:
        """Whether elements can be added between those of a solution."""
        return self.options.tableau.collocation and self.options.switch_detection

    @property
    def _room(self) -> BranchTranscription:
        if self._roomy is None:
            branch = self._polisher.branch(self._base.problem.start)
            self._roomy = BranchTranscription(with_room(self._base, self._base.problem.start, branch)[0])
        return self._roomy

    @property
    def _branch_solver(self) -> BranchSolver:
        if self._solver is None:
            options = self.settings.homotopy(None, polish=True)
            room = self._room
            self._solver = BranchSolver(
                room.transcription.problem, room, options, self._seconds_left, few_evaluations=False,
                progress=self._report,
            )  # fmt: skip
        return self._solver

    def _seconds_left(self) -> float | None:
        limit = self.settings.time_limit
        return None if limit is None else limit - (time.perf_counter() - self.begin)

    def _report(self, report: NlpReport) -> None:
        self.iterations += report.iterations
        if self.progress:
            self.progress(report)


def _costs(transcription: Transcription, w: np.ndarray) -> dict[str, float]:
    terms = transcription.cost_terms(w)
    return {name: value for name, value in terms.items() if name != EQUILIBRATION}


def _above(cost: float) -> float:
    return cost + LEAST_GAIN * max(1.0, abs(cost))


def _below(cost: float) -> float:
    return cost - LEAST_GAIN * max(1.0, abs(cost))
