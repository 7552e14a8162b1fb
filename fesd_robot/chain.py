"""From a formulated task to its motion: the first one, the cheapest nearby, and that refined."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fesd_robot.adapters import homotopy_options, with_promised_goal
from fesd_robot.coarse_start import coarse_start
from fesd_robot.complementarity import Branch
from fesd_robot.determinacy import in_deciding_postures
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.fesd.refinement import local_errors
from fesd_robot.fesd.schemes import MAX_STAGES
from fesd_robot.finer import continued
from fesd_robot.guessed_sequence import guessed_start, needs_guessed_start, stepping_start
from fesd_robot.known_sequence import known_plan, known_start
from fesd_robot.local_search import Depth, Listeners, searched
from fesd_robot.mpcc import BranchBounds, HomotopyOptions, Mpcc, MpccSolution, NlpReport, solve
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.phases import Along, PhaseMotion, PhaseSolver, SequenceSearch, discretised, guessed_sequences, hops
from fesd_robot.plans.plan import LocalSearch, TriedSequence
from fesd_robot.refine import NO_MOTION, refined
from fesd_robot.repair import Repair
from fesd_robot.sagittal_start import sagittal_start
from fesd_robot.simulated_sequence import needs_simulated_start, simulated_start
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import NoCoarserMotion, Stop
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import Overrides, time_left, with_overrides
from fesd_robot.strategies.processes import cores_for
from fesd_robot.strategies.search_steps import SearchSteps
from fesd_robot.strategies.shared import LeastCost
from fesd_robot.strategies.stations import Counted, Reached, Station
from fesd_robot.task import Task
from fesd_robot.task.consistency import coarser_intervals

logger = logging.getLogger(__name__)

SHARE_OF_TIME = 0.5
"""Of what is left: for a motion to begin with, on a coarser control grid or in the plane."""

ORDINARY_LOSS = 0.05
"""Of the cost: refinement of a motion costs one or two hundredths, and of another on the way of its search as much.
Only a motion that costs less by more than this is refined, too, where one has passed."""

SIMPLER = ((0.03, False), (0.0, True), (0.05, True))
"""How sequences of a homotopy that lead to no motion are simplified: without phases that are shorter than this part of
the duration, and with contacts that stick wherever they touch."""

HELD = "held in postures in which Coulomb's law decides the motion"
"""What is said of it among the moves of a search."""

HOLDING_LOSS = 0.01
"""Of the cost: what a motion may lose where it is held in other postures without being searched from again."""

MOST_HOLDS = 3
"""How often a motion is held in other postures and searched from there; a search may end in such postures elsewhere."""


@dataclass(frozen=True)
class Chain:
    """From a formulated task to its motion, and who is told about it.

    Attributes:
        deadline: of the task.
        progress, stop, reached, counted: as in `planner.plan`; `reached` is its `station`.
        reports: NLPs so far.
        strictly: as in `planner.attempt`.
        least: the cost of the cheapest motion that other starts have solved; None if there are no others.
    """

    deadline: Deadline
    progress: Callable[[NlpReport], None] | None
    stop: Stop | None
    reached: Reached
    counted: Counted
    reports: list[NlpReport]
    strictly: bool = False
    least: LeastCost | None = None

    def report(self, nlp: NlpReport) -> None:
        """Note an NLP."""
        self.reports.append(nlp)
        if self.progress:
            self.progress(nlp)

    def beaten(self, motion: SolvedMotion) -> bool:
        """Return whether another start has solved a motion that costs so much less that this one is given up."""
        return self.least is not None and self.least.beats(motion.cost)

    def solved(self, motion: MotionProblem, transcription: Transcription, *, promised: bool = False) -> SolvedMotion:
        """Return the motion of a task: the first one, the cheapest nearby, and that refined.

        Args:
            motion, transcription: the formulated task.
            promised: as in `planner.attempt`.
        """
        return self._before_and_after(motion, transcription, promised=promised).after

    def on_phases(self, motion: MotionProblem, *, promised: bool = False) -> SolvedMotion | None:
        """Return the motion of a task whose control grid moves with its contacts, searched and refined.

        Sequences of phases are those that the guess shows; where none of them leads to a motion, that of a motion on a
        grid that stands still.

        Args:
            motion: the formulated task.
            promised: as in `planner.attempt`.

        Returns:
            None where no sequence leads to a motion.
        """
        options, task = homotopy_options(motion.task), motion.task
        self.reached(Station.SEARCHING)
        solver = PhaseSolver(motion, options, self.deadline, self.stop, self.reports.append)
        search = SequenceSearch(solver, cores_for(task), self.counted, self._cheaper)
        try:
            first = self._searched_on_phases(search, motion)
        finally:
            search.close()
        if search.best is None:
            return None
        best = solver.settled(search.best)
        if promised and task.goal.soft:
            motion = with_promised_goal(motion)
        solution = best.solution(list(self.reports), search.seconds)
        solved = SolvedMotion.of(motion, best.own.polisher, solution)
        return self._refined(replace(solved, search=_summary(search, first)), options, with_spare=True)

    def _searched_on_phases(self, search: SequenceSearch, motion: MotionProblem) -> float:
        """Find a motion, and cheaper ones from it; return the cost of the first."""
        task, solver = motion.task, search.solver
        self._from_plan(search, motion)
        if search.best is None:
            search.guesses(guessed_sequences(motion))
        if search.best is None:
            search.guesses(hops(motion), "hops")
        if search.best is None and not solver.over:
            self._from_uniform(search, motion)
        if search.best and _is_gross(search.best):
            search.divide()
        first = search.cost
        if search.best and task.solver.effort != "quick" and task.solver.local_search is not False:
            self.reached(Station.IMPROVING)
            search.improve(patient=task.solver.effort == "best")
        return first

    def _cheaper(self, found: PhaseMotion) -> None:
        """Show the NLP of a motion that is cheaper than all before."""
        if self.progress:
            self.progress(NlpReport.of_polishing(found.report))

    def _from_plan(self, search: SequenceSearch, motion: MotionProblem) -> None:
        """Solve the sequence of the plan that `solver.warm_start` names, from that plan."""
        if motion.task.solver.warm_start is None:
            return  # before a grid is built for nothing
        sequence = next(guessed_sequences(motion))
        known = known_plan(motion, discretised(motion, sequence).polisher)
        if known is not None:
            along = Along(known.elements, known.branch, known.tableau, known.clock)
            search.note("earlier plan", along.sequence, search.solver.from_known(along.sequence, along))

    def _from_uniform(self, search: SequenceSearch, motion: MotionProblem) -> None:
        """Solve sequences that homotopies show on grids that stand still, until one of them leads to a motion.

        First a loose homotopy on a coarse grid, then one on the task's own, then the exact motion there; that alone
        where contacts bounce, for it begins with the robot that is let go. What is tried is the sequence as it is read,
        from the motion that shows it and from the guess, and simpler ones.
        """
        task, intervals = with_overrides(motion.task, {"method.grid": "uniform"}), coarser_intervals(motion.task)
        loose: list[Overrides] = [{}] if intervals is None else [{"horizon.intervals": intervals}, {}]
        for changes in [] if needs_simulated_start(motion) else loose:
            uniform = formulate(with_overrides(task, changes))
            polisher = BranchTranscription(Transcription(uniform.ocp, uniform.fesd))
            found = self._loose(uniform.task, polisher)
            self._from_branches(search, "coarse homotopy" if changes else "homotopy", polisher, found)
            if search.best is not None or search.solver.over:
                return
        uniform = formulate(task)
        first = self._first(uniform, Transcription(uniform.ocp, uniform.fesd))
        self._from_branches(search, "motion on a uniform grid", first.polisher, first.solution)

    def _loose(self, task: Task, polisher: BranchTranscription) -> MpccSolution:
        """Return the end of a loose homotopy, from which no branch NLP is solved."""
        problem = polisher.transcription.problem
        options = homotopy_options(with_overrides(task, time_left(self.deadline)))
        return solve(
            problem,
            replace(options, polish=True),
            polisher=_Unpolished(polisher),
            progress=self.report,
            stop=self.stop,
            otherwise=lambda w: problem.residuals(w).objective,
        )

    def _from_branches(
        self, search: SequenceSearch, what: str, polisher: BranchTranscription, solution: MpccSolution
    ) -> None:
        """Solve the sequences of the branches on which a point may lie, and simpler ones if these lead to nothing."""
        transcription, w = polisher.transcription, solution.w
        branches = [solution.branch] if solution.branch else list(polisher.candidate_branches(w))
        for branch in branches:
            along = Along.of(transcription, w, branch)
            sequence = along.sequence
            search.note(what, sequence, search.solver.from_known(sequence, along))
            search.guesses([sequence], f"{what}, from the guess")
            for shortest, sticking in SIMPLER if search.best is None else ():
                search.guesses([sequence.simplified(shortest, sticking=sticking)], f"{what}, simplified")

    def _before_and_after(
        self,
        motion: MotionProblem,
        transcription: Transcription,
        *,
        promised: bool = False,
        with_spare: bool = True,
        depth: Depth = Depth.DETOURS,
    ) -> _Refined:
        """Return the motion of a task before and after its refinement; args as in `solved`, `refined`, `searched`."""
        task = motion.task
        options = homotopy_options(task)
        first = self._first(motion, transcription)
        if promised and task.goal.soft:
            motion = with_promised_goal(motion)
        solved = SolvedMotion.of(motion, first.polisher, first.solution)
        wanted = task.solver.local_search
        if first.search if wanted == "auto" else wanted:
            self.reached(Station.IMPROVING)
            searches = self._searched(solved, options, min(depth, first.depth))
        else:
            searches = iter([solved])
        found: _Refined | None = None
        for candidate in searches:  # the cheaper ones first; refined, one may cost more than another
            if found and found.after.passes and not candidate.cost < _clearly_below(found.after.cost):
                break
            finer = candidate if self.beaten(candidate) else self._refined(candidate, options, with_spare=with_spare)
            if not (found and found.after.passes) or (finer.passes and finer.cost < found.after.cost):
                found = _Refined(candidate, finer)
            if self.beaten(candidate):
                break
        return found or _Refined(solved, solved)

    def _searched(self, solved: SolvedMotion, options: HomotopyOptions, depth: Depth) -> Iterator[SolvedMotion]:
        """Yield the cheapest motion near by, then ever earlier ones on the way; args as in `searched`.

        Where Coulomb's law does not decide the cheapest, it is held in postures where it does, and searched from there
        if it costs clearly more: else its neighbours would be those that have been tried.
        """
        listeners = Listeners(self.report, self.counted, self.progress)
        for left in reversed(range(1 + MOST_HOLDS)):
            searches = searched(
                solved, options, self.deadline, listeners, self.stop, cores_for(solved.motion.task), depth=depth
            )
            cheapest = next(searches)
            held = self._held(cheapest, options) if left and not self.beaten(cheapest) else None
            if held is None or held.cost <= cheapest.cost + HOLDING_LOSS * abs(cheapest.cost):
                yield held or cheapest
                yield from searches
                break
            solved = held

    def _held(self, motion: SolvedMotion, options: HomotopyOptions) -> SolvedMotion | None:
        """Return a motion held in postures where Coulomb's law decides it, None if that is not needed or fails.

        Without local errors nobody knows whether these or the postures are why a replay leaves the motion.
        """
        if motion.search is None or not motion.solution.exact or motion.stages == MAX_STAGES:
            return None
        for finer in in_deciding_postures(motion):
            if held := continued(motion, finer, options, self.deadline, self.report, self.stop):
                moves = [*motion.search.moves, f"{HELD}: {held.cost:.6g}"]
                search = motion.search.model_copy(update={"moves": moves})
                return replace(held, rounds=motion.rounds, search=search)
        return None

    def _refined(self, motion: SolvedMotion, options: HomotopyOptions, *, with_spare: bool) -> SolvedMotion:
        """Return a motion as accurate as its task asks for, unless another start beats it meanwhile."""
        accuracy = motion.motion.task.method.accuracy
        if accuracy == "none":
            return motion
        self.reached(Station.REFINING)
        until = self._until_beaten(motion)
        return refined(motion, options, accuracy, self.deadline, self.report, until, with_spare=with_spare)

    def _until_beaten(self, motion: SolvedMotion) -> Stop | None:
        """Return a stop that is also true once another start has solved a motion that costs much less than this one."""
        stop = self.stop
        if self.least is None:
            return stop
        return lambda *reached: (stop is not None and stop(*reached)) or self.beaten(motion)

    def _first(self, motion: MotionProblem, transcription: Transcription) -> _First:
        """Return the motion of an earlier plan, of one on a coarser grid, let go or in the plane, on the contacts of
        the guess, or of a homotopy."""
        options, deadline, stop = homotopy_options(motion.task), self.deadline, self.stop
        steps = SearchSteps(options, self.reached, self.counted)

        def searching(nlp: NlpReport) -> None:
            self.report(nlp)
            steps.nlp(nlp)

        def iterating(iteration: int, objective: float) -> bool:
            steps.iteration()
            return stop is not None and stop(iteration, objective)

        if found := known_start(motion, transcription, options, deadline, searching, iterating):
            return _First(*found, depth=Depth.QUICK)
        if motion.task.solver.coarse_to_fine is True:
            if found := coarse_start(motion, transcription, self._coarse, options, deadline, searching, iterating):
                return _First(*found, depth=Depth.QUICK)
            if self.strictly:
                raise NoCoarserMotion("the coarser control grid leads to no motion of the task")
            logger.warning("solver.coarse_to_fine leads to no motion of the task, which is planned without it")
        if needs_simulated_start(motion) and (
            found := simulated_start(motion, transcription, options, deadline, searching, iterating)
        ):
            return _First(*found)
        if needs_guessed_start(motion):
            if found := stepping_start(motion, transcription, options, deadline, searching, iterating):
                return _First(*found, depth=Depth.QUICK)
            if found := sagittal_start(motion, self._twin, options, deadline, searching, iterating):
                return _First(*found, search=False)
            if found := guessed_start(motion, transcription, options, deadline, searching, iterating):
                return _First(*found, depth=Depth.QUICK)
        repair = Repair(transcription, options, deadline, searching, iterating)
        polisher = BranchTranscription(transcription)
        # What other starts took is gone.
        options = replace(options, time_limit=None if deadline.remaining() is None else max(deadline.left, 0.01))
        solution = solve(
            transcription.problem, options, polisher=polisher, progress=searching, stop=iterating, otherwise=repair
        )
        return _First(*repair.repaired(polisher, solution))

    def _coarse(self, task: Task) -> SolvedMotion:
        """Return the motion of a task on a coarser control grid, within half of the time that is left; detours took a
        third of that, and gained nothing."""
        motion = formulate(task)
        chain = replace(self, deadline=self.deadline.share(SHARE_OF_TIME), least=None)
        coarse = Transcription(motion.ocp, motion.fesd)
        return chain._before_and_after(motion, coarse, with_spare=False, depth=Depth.PATIENT).after

    def _twin(self, task: Task) -> list[SolvedMotion]:
        """Return the motion of a task in the plane, refined and as it was before, within half of the time that is left;
        a deeper search took two thirds of the time on quadrupeds, and found nothing."""
        motion = formulate(task)
        transcription = Transcription(motion.ocp, motion.fesd)
        chain = replace(self, deadline=self.deadline.share(SHARE_OF_TIME), least=None)
        found = chain._before_and_after(motion, transcription, with_spare=False, depth=Depth.QUICK)
        return [found.before] if found.after is found.before else [found.after, found.before]


@dataclass(frozen=True)
class _Unpolished:
    """A polisher of a homotopy whose end is read, and not polished."""

    own: BranchTranscription

    @property
    def problem(self) -> Mpcc:
        """The problem without pairs."""
        return self.own.problem

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """None."""
        return iter(())

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """Nothing."""
        return None

    def bounds(self, branch: Branch) -> BranchBounds:
        """Those of the branch."""
        return self.own.bounds(branch)


def _is_gross(motion: PhaseMotion) -> bool:
    """Whether a local error of a motion is so large that it is none, and its cost means nothing."""
    own = motion.own
    errors = local_errors(own.transcription, own.polisher.conditions, motion.w, own.branch)
    return not bool((errors <= NO_MOTION).all())


def _summary(search: SequenceSearch, first: float) -> LocalSearch:
    """Return what a search over sequences did, of which the first motion had a cost."""
    tried = [
        TriedSequence(
            what=one.what,
            sequence=one.sequence,
            cost=one.cost if np.isfinite(one.cost) else None,
            seconds=one.seconds,
            kept=one.kept,
        )
        for one in search.tried
    ]
    return LocalSearch(
        seconds=search.seconds,
        iterations=search.iterations,
        trials=len(tried),
        cost_before=first,
        moves=[f"{one.what}: {one.sequence}, {one.cost:.6g}" for one in search.tried if one.kept],
        sequences=tried,
    )


class _Refined(NamedTuple):
    """A motion before and after its refinement."""

    before: SolvedMotion
    after: SolvedMotion


class _First(NamedTuple):
    """A first motion, and how cheaper ones are looked for near it.

    Attributes:
        polisher, solution: the motion.
        search: whether they are if the task leaves it open; what was searched in the plane is not searched
            in space again.
        depth: of that search. Of an earlier plan a deep one gains little, and with several feet in space a trial takes
            seconds.
    """

    polisher: BranchTranscription
    solution: MpccSolution
    search: bool = True
    depth: Depth = Depth.DETOURS


def _clearly_below(cost: float) -> float:
    """Return the cost below which refinement is likely to end below a cost."""
    return cost - ORDINARY_LOSS * abs(cost)
