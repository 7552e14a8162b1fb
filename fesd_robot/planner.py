"""The chain from a task to a plan, in the order in which it runs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

from fesd_robot.adapters import (
    assembled_plan,
    conflict_of,
    homotopy_options,
    motion_outcome,
    with_promised_goal,
)
from fesd_robot.coarse_start import coarse_start
from fesd_robot.descent import descended
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.guessed_sequence import guessed_start, needs_guessed_start, stepping_start
from fesd_robot.known_sequence import finite_elements_of, known_start
from fesd_robot.local_search import Depth, searched
from fesd_robot.mpcc import MpccSolution, NlpReport, solve
from fesd_robot.native import begin_building
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan
from fesd_robot.plans.assemble import controls_of
from fesd_robot.plans.overlaps import overlaps_of_motion
from fesd_robot.plans.replay_record import replay_summary
from fesd_robot.plans.statistics import Effort, statistics_of
from fesd_robot.plans.tables import settings_line
from fesd_robot.plans.verdict import status_of
from fesd_robot.refine import refined
from fesd_robot.repair import Repair
from fesd_robot.sagittal_start import sagittal_start, with_own_starts
from fesd_robot.simulated_sequence import needs_simulated_start, simulated_start
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import AttemptedPlan, NoCoarserMotion, Stop, best_plan, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import (
    FALLBACKS,
    SOFT_GOAL,
    Overrides,
    promises_goal,
    time_left,
    with_overrides,
)
from fesd_robot.strategies.multistart import attempt_seeds
from fesd_robot.strategies.processes import SharedStop, processes_of
from fesd_robot.strategies.search_steps import SearchSteps
from fesd_robot.strategies.stations import Counted, Reached, Station
from fesd_robot.strategies.suggestions import suggestions
from fesd_robot.task import Jumps, Task

logger = logging.getLogger(__name__)


def plan(
    task: Task,
    *,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
    retrying: Callable[[Overrides, Plan], None] | None = None,
    started: Callable[[int, Plan], None] | None = None,
    station: Reached | None = None,
    counted: Counted | None = None,
) -> Plan:
    """Plan the motion that a task describes, from its initial guesses, and with fallback settings if none solves it.

    Args:
        task: from `load_task`; `task.solver.starts` is the number of initial guesses, each solved in a process of its
            own as far as cores are free; where it is left open, a motion that is planned in the plane first has one.
            `task.solver.retries` is the number of fallback settings (`strategies.fallbacks.FALLBACKS`); after them a
            motion is looked for that comes near to the goal.
        progress: called after every NLP of the homotopy.
        stop: called once an IPOPT iteration with (iteration, objective), and while starts are waited for with
            (0, NaN); True ends the solve, of other starts as well, and the best motion that one of them has by then is
            returned, or the best iterate as not solved.
        retrying: called before fallback settings or changes of the task are tried, with these and the plan that was not
            solved.
        started: called with the seed and the plan of every one of several starts when it is there.
        station: called with what is done next.
        counted: called with the steps of the station that are done, and of how many, None if that is not known.

    Returns:
        The cheapest solved plan of the starts, else the first that is solved, else one that only misses the goal, else
        the first of all; `plan.status.solved` says whether it can be relied on, and `plan.statistics.attempts` what was
        tried. The message of a plan that is not solved names what stands against each other, and a change of the task
        with which it is solved, if one of `strategies.suggestions` helps.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    deadline, reached, shared = Deadline(task.solver.time_limit), station or _unseen, SharedStop(stop)
    stop = None if stop is None else shared.here

    promised = not task.goal.soft
    attempted = partial(attempt, promised=promised, progress=progress, stop=stop, station=station, counted=counted)
    attempts = attempt_seeds(
        with_own_starts(task),
        attempted,
        partial(attempt, stop=shared.elsewhere),
        deadline=deadline,
        stop=stop,
        started=started,
        waiting=lambda: reached(Station.WAITING),
    )
    for overrides in _further_settings(task, attempts, stop):
        if attempts and deadline.left <= 0:
            break
        if attempts and retrying:
            retrying(overrides, attempts[-1].plan)
        begin = deadline.spent
        changed = with_overrides(task, {**overrides, **time_left(deadline)})
        attempts.append(AttemptedPlan(overrides, attempted(changed), deadline.spent - begin))
        if attempts[-1].final or stop_requested(stop):
            break
    best = best_plan(attempts)
    if any(one.final for one in attempts) or stop_requested(stop) or not task.solver.retries:
        return best
    return _with_what_helps(best, task, deadline, progress, stop, retrying, station)


def attempt(
    task: Task,
    *,
    promised: bool = False,
    strictly: bool = False,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
    station: Reached | None = None,
    counted: Counted | None = None,
) -> Plan:
    """Plan the motion with the task's own settings, once: formulate, transcribe, solve, recover, audit, assemble.

    Args:
        promised: whether the motion is held against the task's goal as if that were not soft.
        strictly: whether a task that is planned on a coarser control grid first is given up where that leads nowhere;
            else it is planned as if it asked for none, and a warning says so.

    The other args and raises are those of `plan`.

    Raises:
        NoCoarserMotion: if `strictly`, and the coarser grid leads to no motion of the task.
    """
    chain = _Chain(
        Deadline(task.solver.time_limit),
        progress,
        stop,
        station or _unseen,
        counted or _uncounted,
        list[NlpReport](),
        strictly,
    )
    deadline, reached = chain.deadline, chain.reached
    reached(Station.BUILDING)
    if task.solver.linear_solver in ("auto", "fesd"):
        begin_building()
    motion = formulate(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    problem, build_seconds = transcription.problem, deadline.spent
    options = homotopy_options(task)
    solved = chain.solved(motion, transcription, promised=promised)
    motion = solved.motion
    solved, certificate = descended(solved, options, task, deadline, chain.report, stop, reached)

    transcription, solution, w = solved.transcription, solved.solution, solved.solution.w
    problem, physics = transcription.problem, solved.physics
    full_intervals = [] if solution.solved else solved.polisher.out_of_elements(w)
    outcome = motion_outcome(motion, solved.physical, physics)
    jumps = isinstance(task.reference, Jumps)
    in_the_way = "" if solution.solved else conflict_of(motion, solved.polisher, w, deadline.left)
    status = status_of(
        solution, solved.audit, outcome, task.solver.tolerance, certificate, full_intervals, jumps, in_the_way
    )
    cost_terms = transcription.cost_terms(w)
    effort = Effort(chain.reports, build_seconds, deadline.spent - build_seconds)
    statistics = statistics_of(problem, solution, effort, cost_terms, solved.stages, solved.search, solved.refinement)
    names, controls = motion.actuation.names, transcription.controls(w)
    plan = assembled_plan(
        motion,
        solved.physical,
        physics,
        controls_of(controls[: len(names)], names, motion.grid.duration(solved.physical.clock)),
        status=status,
        audit=solved.audit,
        outcome=outcome,
        statistics=statistics,
    )
    summary = replay_summary(solved.replay, motion.robot.velocity_names)
    elements = finite_elements_of(transcription, w, solution.branch) if solution.branch else None
    warnings = overlaps_of_motion(motion.task, motion.robot, motion.scene.surfaces, solved.physical)
    return plan.model_copy(update={"replay": summary, "finite_elements": elements, "warnings": warnings})


@dataclass(frozen=True)
class _Chain:
    """From a formulated task to its motion, and who is told about it.

    Attributes:
        deadline: of the task.
        progress, stop, reached, counted: as in `plan`.
        reports: NLPs so far.
        strictly: as in `attempt`.
    """

    deadline: Deadline
    progress: Callable[[NlpReport], None] | None
    stop: Stop | None
    reached: Reached
    counted: Counted
    reports: list[NlpReport]
    strictly: bool

    def report(self, nlp: NlpReport) -> None:
        """Note an NLP."""
        self.reports.append(nlp)
        if self.progress:
            self.progress(nlp)

    def solved(self, motion: MotionProblem, transcription: Transcription, *, promised: bool = False) -> SolvedMotion:
        """Return the motion of a task: the first one, the cheapest nearby, and that refined.

        Args:
            motion, transcription: the formulated task.
            promised: as in `attempt`.
        """
        return self._before_and_after(motion, transcription, promised=promised).after

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
        options, stop = homotopy_options(task), self.stop
        first = self._first(motion, transcription)
        if promised and task.goal.soft:
            motion = with_promised_goal(motion)
        solved = SolvedMotion.of(motion, first.polisher, first.solution)
        wanted = task.solver.local_search
        if first.search if wanted == "auto" else wanted:
            self.reached(Station.IMPROVING)
            searches = searched(
                solved,
                options,
                self.deadline,
                self.report,
                stop,
                processes_of(task),
                depth=min(depth, first.depth),
                tried=self.counted,
            )
        else:
            searches = iter([solved])
        found = _Refined(solved, solved)
        for candidate in searches:  # the cheaper ones first; the first that is true is taken
            found = _Refined(candidate, candidate)
            if task.method.accuracy != "none":
                self.reached(Station.REFINING)
                accuracy, deadline = task.method.accuracy, self.deadline
                finer = refined(candidate, options, accuracy, deadline, self.report, stop, with_spare=with_spare)
                found = _Refined(candidate, finer)
            if found.after.passes:
                break
        return found

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
        chain = replace(self, deadline=self.deadline.share(0.5))
        coarse = Transcription(motion.ocp, motion.fesd)
        return chain._before_and_after(motion, coarse, with_spare=False, depth=Depth.PATIENT).after

    def _twin(self, task: Task) -> list[SolvedMotion]:
        """Return the motion of a task in the plane, refined and as it was before; a deeper search took two thirds of
        the time on quadrupeds, and found nothing."""
        motion = formulate(task)
        transcription = Transcription(motion.ocp, motion.fesd)
        found = self._before_and_after(motion, transcription, with_spare=False, depth=Depth.QUICK)
        return [found.before] if found.after is found.before else [found.after, found.before]


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


def _further_settings(task: Task, attempts: Sequence[AttemptedPlan], stop: Stop | None) -> list[Overrides]:
    """Return the settings to use after the attempts from several seeds: the task's own if there are none of these."""
    own: list[Overrides] = [] if attempts else [{}]
    if any(attempt.final for attempt in attempts) or (attempts and stop_requested(stop)):
        return own
    fallbacks = [fallback(task) for fallback in FALLBACKS[: task.solver.retries]]
    return own + fallbacks + ([SOFT_GOAL] if fallbacks and promises_goal(task) else [])


def _with_what_helps(
    plan: Plan,
    task: Task,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
    retrying: Callable[[Overrides, Plan], None] | None,
    station: Reached | None,
) -> Plan:
    """Return a plan that is not solved with a message that says with which change of its task it is, if one helps."""
    last = plan
    for changes, changed in suggestions(task):
        if deadline.left <= 0:
            break
        if retrying:
            retrying(changes, last)
        settings: Overrides = {"solver.local_search": False, **time_left(deadline)}
        last = attempt(with_overrides(changed, settings), progress=progress, stop=stop, station=station)
        tried = AttemptedPlan(changes, last, 0.0)
        if tried.solved:
            message = f"{plan.status.message} Tried, and solved: the same task with {settings_line(changes)}."
            return plan.model_copy(update={"status": plan.status.model_copy(update={"message": message})})
        if tried.final:
            break
    return plan


def _unseen(station: Station) -> None:
    """Take note of nothing."""


def _uncounted(done: int, of: int | None) -> None:
    """Take note of nothing."""
