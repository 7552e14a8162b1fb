"""From a formulated task to its motion: found, searched from, and refined."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import KnownTrajectory
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import local_errors
from fesd_robot.mpcc import BranchBounds, Mpcc, MpccSolution, NlpReport, Run, begun, solve
from fesd_robot.nlp import NEAR, SAME, NlpPoint
from fesd_robot.ocp import MotionProblem, formulate, with_hard_goal
from fesd_robot.phases import (
    PhaseMotion,
    PhaseSolver,
    SequenceSearch,
    guessed_sequences,
    hops,
    pushings,
    resting,
    sequence_of,
)
from fesd_robot.planning.fallbacks import Overrides, with_overrides
from fesd_robot.planning.search_steps import SearchSteps
from fesd_robot.plans import LocalSearch, Plan, TriedSequence
from fesd_robot.refinement import NO_MOTION, Repair, SolvedMotion, refined
from fesd_robot.running import (
    Activity,
    ActivityCallback,
    Deadline,
    InBackground,
    OutOfTime,
    ProgressCallback,
    check_time,
    cores_for,
    held_to,
)
from fesd_robot.starts import (
    earlier_trajectory,
    kept_motion,
    named_plan,
    needs_simulated_start,
    simulated_start,
    trajectory_of_plan,
    warm_start,
)
from fesd_robot.task import coarser_intervals

EARLY_AFTER = 2.0
"""s of search after which another process refines the cheapest motion so far, for those who wait; a search that is over
by then has all cores for itself."""

SEARCH_SHARE = 0.6
"""Of the time that is left after the first motion, for cheaper ones; refinement and audit need the rest."""

SIMPLER = ((0.03, False), (0.0, True), (0.05, True))
"""How sequences of a homotopy that lead to no motion are simplified: without phases that are shorter than this part of
the duration, and with contacts that stick wherever they touch."""


class UniformMotion(NamedTuple):
    """The end of the search for a motion on a control grid that stands still, exact or not.

    Attributes:
        motion: the task on that grid.
        polisher, solution: the end, on its branch if it has one.
    """

    motion: MotionProblem
    polisher: BranchTranscription
    solution: MpccSolution


class NoSequence(Exception):
    """No sequence of phases led to a motion of a task whose control grid moves.

    Attributes:
        uniform: how the search on a grid that stands still ended, None where there was none.
    """

    def __init__(self, uniform: UniformMotion | None) -> None:
        super().__init__("no sequence of phases leads to a motion of the task")
        self.uniform = uniform


@dataclass(frozen=True)
class Chain:
    """From a formulated task to its motion, and who is told about it.

    Attributes:
        run: of all NLPs; those are reported of homotopies, of refinement, and of ever cheaper motions of the search.
        on_activity, on_progress: as in `planner.plan`.
        reports: all NLPs so far.
        early: called with the plan of a motion while cheaper ones are looked for; None if nobody waits for it. It is
            refined in another process, and `as_early` there makes it a plan, which can be pickled.
        earlier: a plan whose sequence is one of the first that are tried, if its contacts are those of the task.
    """

    run: Run
    on_activity: ActivityCallback
    on_progress: ProgressCallback
    reports: list[NlpReport]
    early: Callable[[Plan], None] | None = None
    as_early: Callable[[SolvedMotion], Plan] | None = None
    earlier: Plan | None = None

    @property
    def noted(self) -> Run:
        """The run, with all NLPs noted."""
        return replace(self.run, report=self._note)

    def _note(self, nlp: NlpReport) -> None:
        self.reports.append(nlp)
        self.run.notify(nlp)

    def on_uniform_grid(
        self, motion: MotionProblem, known: UniformMotion | None = None, *, hard_goal: bool = False
    ) -> SolvedMotion:
        """Return the motion of a task whose control grid stands still: the first one, refined.

        Args:
            motion: the formulated task.
            known: the end of the search for it, where there was one.
            hard_goal: as in `planner.attempt`.
        """
        if known:
            self.reports.extend(known.solution.reports)
            motion, found = known.motion, (known.polisher, known.solution)
        else:
            found = self._begun_or_found(motion)
        if hard_goal and motion.task.goal.soft:
            motion = with_hard_goal(motion)
        with held_to(Deadline()):
            solved = SolvedMotion.of(motion, *found)
        return self._refined(solved)

    def _begun_or_found(self, motion: MotionProblem) -> tuple[BranchTranscription, MpccSolution]:
        """Return the first motion on a grid that stands still, or where it begins if no time was left for it."""
        transcription, begin = Transcription(motion.ocp, motion.fesd), time.perf_counter()
        try:
            return self._first(motion, transcription)
        except OutOfTime:
            with held_to(Deadline()):
                return BranchTranscription(transcription), begun(transcription.problem, time.perf_counter() - begin)

    def on_phases(self, motion: MotionProblem, *, hard_goal: bool = False) -> SolvedMotion:
        """Return the motion of a task whose control grid moves with its contacts, searched and refined.

        Sequences of phases are those that the guess shows; where none of them leads to a motion, that of a motion on a
        grid that stands still.

        Args:
            motion: the formulated task.
            hard_goal: as in `planner.attempt`.

        Raises:
            NoSequence: no sequence leads to a motion.
        """
        task, uniform = motion.task, None
        self.on_activity(Activity.SEARCHING)
        solver, first = PhaseSolver(motion, replace(self.run, report=self.reports.append)), np.inf
        search = SequenceSearch(solver, cores_for(task.solver.processes), self.on_progress, self._cheaper)
        own = with_hard_goal(motion) if hard_goal and task.goal.soft else motion
        with contextlib.suppress(OutOfTime):
            if not self.run.effort.search_starts and (kept := self.kept(motion, own)):
                return kept
            try:
                uniform = self._find(search, motion)
                first = search.cost
                if search.best and self.run.effort.search_starts:
                    self.on_activity(Activity.IMPROVING)
                    with self._shared(solver):
                        self._improve(search, own)
            finally:
                search.close()
        if search.best:
            return self._refined(self._best(search, own, first if np.isfinite(first) else search.cost))
        guessed = self._guessed(solver, own) if self.run.deadline.left <= 0 else None
        if guessed is None:
            raise NoSequence(uniform)
        return guessed

    @contextlib.contextmanager
    def _shared(self, solver: PhaseSolver) -> Iterator[None]:
        """Give a solver a part of the time that is left."""
        whole, solver.run = solver.run, solver.run.share(SEARCH_SHARE)
        try:
            yield
        finally:
            solver.run = whole

    def _guessed(self, solver: PhaseSolver, motion: MotionProblem) -> SolvedMotion | None:
        """Return where the first sequence begins, which is no motion, for a task whose time limit came before any."""
        with held_to(Deadline()):
            own = solver.first
            if own is None:
                sequence = next(iter(guessed_sequences(motion)), None)
                if sequence is None:
                    return None
                own = solver.on_grid(sequence)
            solution = replace(begun(own.transcription.problem, 0.0), reports=list(self.reports))
            return SolvedMotion(motion, BranchMotion(own.polisher, solution.w, own.branch), solution)

    def kept(self, motion: MotionProblem, own: MotionProblem | None = None) -> SolvedMotion | None:
        """Return the motion of an earlier plan, from the elements and the multipliers that it ended with, refined.

        Args:
            motion: the task.
            own: the same with the goal that it is held against; default: the task.

        Returns:
            None where there is no plan of these equations, or its branch has no exact motion near by.
        """
        found = self._on_kept_elements(motion)
        same_branch = replace(self.noted, effort=replace(self.run.effort, refinement_repairs=0))
        return self._refined(replace(found, motion=own or motion), same_branch) if found else None

    def _on_kept_elements(self, motion: MotionProblem) -> SolvedMotion | None:
        """Return the motion of an earlier plan on the elements that it ended with; None where there is none."""
        plan = named_plan(motion.task) or self.earlier
        known, begin = kept_motion(plan, motion) if plan else None, time.perf_counter()
        if known is None:
            return None
        for start in (SAME, NEAR):
            end = known.solved(self.noted, start, self.run.effort.branch_iterations)
            if end is not None and end.exact:
                solution = end.as_solution(list(self.reports), time.perf_counter() - begin)
                return SolvedMotion.of(motion, known.polisher, solution)
        return None

    def _best(self, search: SequenceSearch, motion: MotionProblem, first: float) -> SolvedMotion:
        """Return the cheapest motion of a search, of which the first one had a cost."""
        assert search.best is not None
        best = search.best
        with contextlib.suppress(OutOfTime):
            best = search.solver.settled(best)
        solution = best.solution(list(self.reports), search.seconds)
        return replace(SolvedMotion.of(motion, best.own.polisher, solution), search=_summary(search, first))

    def _improve(self, search: SequenceSearch, motion: MotionProblem) -> None:
        """Look for cheaper motions, while another process refines the cheapest so far for whoever waits for it."""
        early, as_early = self.early, self.as_early
        if early is None or as_early is None:
            search.improve()
            return

        def so_far() -> Plan:
            search.solver.run = search.solver.run.unseen
            alone = replace(self, run=self.run.unseen, on_activity=lambda _: None, on_progress=lambda *_: None)
            return as_early(alone._refined(alone._best(search, motion, search.cost)))

        begin = time.monotonic()
        background: InBackground[Plan] | None = None

        def on_progress(done: int, of: int | None) -> None:
            nonlocal background
            self.on_progress(done, of)
            if background is None and time.monotonic() - begin > EARLY_AFTER:
                background = InBackground(so_far, early)
            if background:
                background.look()

        search.on_progress = on_progress
        try:
            search.improve()
        finally:
            if background:
                background.end()

    def _find(self, search: SequenceSearch, motion: MotionProblem) -> UniformMotion | None:
        """Find a motion to search from; return how the search on a grid that stands still ended, if there was one."""
        solver, uniform = search.solver, None
        _note_known(search, "earlier plan", earlier_trajectory(motion))
        if search.best is None:
            if self.earlier:
                _note_known(search, "plan that was there", trajectory_of_plan(self.earlier, motion.ocp.system))
            search.pushes(pushings(motion))
        if search.best is None:
            search.guesses(guessed_sequences(motion))
        if search.best is None:
            check_time()
            search.guesses(hops(motion), "hops")
        if search.best is None and not motion.ocp.system.complementarities and not solver.over:
            # There is one sequence, and nothing but another start leads to its motion.
            for sequence in guessed_sequences(motion):
                search.note("start at rest", sequence, solver.from_guess(sequence, state=resting(motion)))
        if search.best is None and not solver.over:
            uniform = self._from_uniform(search, motion)
        if search.best and _is_gross(search.best):
            search.divide()
        return uniform

    def _cheaper(self, found: PhaseMotion) -> None:
        """Show the NLP of a motion that is cheaper than all before."""
        self.run.notify(found.report.as_nlp)

    def _from_uniform(self, search: SequenceSearch, motion: MotionProblem) -> UniformMotion | None:
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
            found = self._loose(polisher)
            check_time()
            self._from_branches(search, "coarse homotopy" if changes else "homotopy", polisher, found)
            if search.best is not None or search.solver.over:
                return None
        uniform = formulate(task)
        first = UniformMotion(uniform, *self._first(uniform, Transcription(uniform.ocp, uniform.fesd)))
        self._from_branches(search, "motion on a uniform grid", first.polisher, first.solution)
        return first

    def _loose(self, polisher: BranchTranscription) -> MpccSolution:
        """Return the end of a loose homotopy, from which no branch NLP is solved."""
        problem = polisher.transcription.problem
        return solve(
            problem,
            replace(self.noted, options=replace(self.run.options, polish=True)),
            polisher=_Unpolished(polisher),
            otherwise=lambda w: problem.residuals(w).objective,
        )

    def _from_branches(
        self, search: SequenceSearch, what: str, polisher: BranchTranscription, solution: MpccSolution
    ) -> None:
        """Solve the sequences of the branches on which a point may lie, and simpler ones if these lead to nothing."""
        branches = [solution.branch] if solution.branch else list(polisher.candidate_branches(solution.w))
        for branch in branches:
            along = KnownTrajectory.of(BranchMotion(polisher, solution.w, branch))
            sequence = sequence_of(along)
            search.note(what, sequence, search.solver.from_known(sequence, along))
            search.guesses([sequence], f"{what}, from the guess")
            for shortest, sticking in SIMPLER if search.best is None else ():
                search.guesses([sequence.simplified(shortest, sticking=sticking)], f"{what}, simplified")

    def _refined(self, motion: SolvedMotion, run: Run | None = None) -> SolvedMotion:
        """Return a motion as accurate as its task asks for."""
        accuracy = motion.motion.task.method.accuracy
        if accuracy == "none" or self.run.deadline.left <= 0:
            return motion
        self.on_activity(Activity.REFINING)
        with contextlib.suppress(OutOfTime):
            motion = refined(motion, accuracy, run or self.noted)
        return motion

    def _first(self, motion: MotionProblem, transcription: Transcription) -> tuple[BranchTranscription, MpccSolution]:
        """Return the motion of an earlier plan, of the robot that is let go, or of a homotopy."""
        steps, stop = SearchSteps(self.run.options, self.on_activity, self.on_progress), self.run.stop

        def searching(nlp: NlpReport) -> None:
            self._note(nlp)
            steps.nlp(nlp)

        def iterating(iteration: int, objective: float) -> bool:
            steps.iteration()
            return stop is not None and stop(iteration, objective)

        run = replace(self.run, report=searching, stop=iterating)
        if found := warm_start(motion, transcription, run):
            return found
        if needs_simulated_start(motion) and (found := simulated_start(motion, transcription, run)):
            return found
        repair, polisher = Repair(transcription, run), BranchTranscription(transcription)
        solution = solve(transcription.problem, run, polisher=polisher, otherwise=repair)
        return repair.repaired(polisher, solution)


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

    def whole(self, point: NlpPoint) -> NlpPoint:
        """The point."""
        return point

    def bounds(self, branch: Branch) -> BranchBounds:
        """Those of the branch."""
        return self.own.bounds(branch)


def _note_known(search: SequenceSearch, what: str, known: KnownTrajectory | None) -> None:
    """Solve the sequence of known trajectory from it, if there are any, and take note of it."""
    if known is not None:
        sequence = sequence_of(known)
        search.note(what, sequence, search.solver.from_known(sequence, known))


def _is_gross(motion: PhaseMotion) -> bool:
    """Whether a local error of a motion is so large that it is none, and its cost means nothing."""
    return not bool((local_errors(motion.on_branch) <= NO_MOTION).all())


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
