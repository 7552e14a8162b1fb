"""The chain from a task to a plan, in the order in which it runs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from fesd_robot.adapters import (
    assembled_plan,
    conflict_of,
    homotopy_options,
)
from fesd_robot.chain import Chain
from fesd_robot.descent import descended
from fesd_robot.fesd import Transcription
from fesd_robot.guessed_sequence import with_own_starts
from fesd_robot.known_sequence import finite_elements_of
from fesd_robot.mpcc import Certificate, NlpReport
from fesd_robot.native import begin_building
from fesd_robot.ocp import formulate
from fesd_robot.plans import Plan
from fesd_robot.plans.assemble import controls_of
from fesd_robot.plans.overlaps import overlaps_of_motion
from fesd_robot.plans.plan import Status
from fesd_robot.plans.replay_record import replay_summary
from fesd_robot.plans.statistics import Effort, statistics_of
from fesd_robot.plans.tables import settings_line
from fesd_robot.plans.verdict import given_up, status_of
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import AttemptedPlan, NoSequence, Stop, best_plan, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import (
    FALLBACKS,
    SOFT_GOAL,
    Overrides,
    promises_goal,
    time_left,
    with_overrides,
)
from fesd_robot.strategies.multistart import attempt_seeds, starts_of
from fesd_robot.strategies.shared import LeastCost, SharedStop
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
    starting: Callable[[int], None] | None = None,
    started: Callable[[int, Plan], None] | None = None,
    station: Reached | None = None,
    counted: Counted | None = None,
) -> Plan:
    """Plan the motion that a task describes, from its initial guesses, and with fallback settings if none solves it.

    Args:
        task: from `load_task`; `task.solver.starts` is the number of initial guesses, each solved in a process of its
            own as far as cores are free; where it is left open, one with several contacts in space has one.
            `task.solver.retries` is the number of fallback settings (`strategies.fallbacks.FALLBACKS`); after them a
            motion is looked for that comes near to the goal.
        progress: called after every NLP of the homotopy, and with the NLPs of ever cheaper motions of the search.
        stop: called once an IPOPT iteration with (iteration, objective), and while starts are waited for with
            (0, NaN); True ends the solve, of other starts as well, and the best motion that one of them has by then is
            returned, or the best iterate as not solved.
        retrying: called before fallback settings or changes of the task are tried, with these and the plan that was not
            solved.
        starting: called with the number of initial guesses, before the first of them.
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
    stop, least = None if stop is None else shared.here, LeastCost()

    promised = not task.goal.soft
    attempted = partial(attempt, promised=promised, progress=progress, stop=stop, station=station, counted=counted)
    if task.method.grid == "phases":
        if on_phases := _on_phases(task, attempted, deadline):
            return on_phases
        task = with_overrides(task, {"method.grid": "uniform", **time_left(deadline)})
    guessed = with_own_starts(task)
    if starting:
        starting(starts_of(guessed))
    attempts = attempt_seeds(
        guessed,
        partial(attempted, least=least),
        partial(attempt, stop=shared.elsewhere, least=least),
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


def _on_phases(task: Task, attempted: Callable[[Task], Plan], deadline: Deadline) -> Plan | None:
    """Return the plan on a control grid that moves, None where a grid that stands still is to be tried."""
    begin = deadline.spent
    try:
        found = AttemptedPlan({}, attempted(task), deadline.spent - begin)
    except NoSequence as error:
        logger.warning("%s, which is planned on a control grid that stands still", error)
        return None
    if found.final or deadline.left <= 0:
        return best_plan([found])
    logger.warning("the motion on a control grid that moves is not solved: %s", found.plan.status.message)
    return None


def attempt(
    task: Task,
    *,
    promised: bool = False,
    strictly: bool = False,
    least: LeastCost | None = None,
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
        least: the cost of the cheapest motion of the task that is solved, noted and held against this one: what costs
            much more is neither refined nor certified.

    The other args and raises are those of `plan`.

    Raises:
        NoCoarserMotion: if `strictly`, and the coarser grid leads to no motion of the task.
    """
    chain = Chain(
        Deadline(task.solver.time_limit),
        progress,
        stop,
        station or _unseen,
        counted or _uncounted,
        list[NlpReport](),
        strictly,
        least,
    )
    deadline, reached = chain.deadline, chain.reached
    reached(Station.BUILDING)
    if task.solver.linear_solver in ("auto", "fesd"):
        begin_building()
    motion = formulate(task)
    build_seconds, options = deadline.spent, homotopy_options(task)
    if motion.grid.moving:
        found = chain.on_phases(motion, promised=promised)
        if found is None:
            raise NoSequence("no sequence of phases leads to a motion of the task")
        solved = found
    else:
        solved = chain.solved(motion, Transcription(motion.ocp, motion.fesd), promised=promised)
    motion, certificate = solved.motion, None
    beaten = chain.beaten(solved)
    if not beaten:
        if least and solved.solution.solved and _status(solved, None, deadline).solved:
            least.note(solved.cost)  # others that are dearer need not wait for the certificate
        solved, certificate = descended(solved, options, task, deadline, chain.report, stop, reached)

    transcription, solution, w = solved.transcription, solved.solution, solved.solution.w
    problem, physics = transcription.problem, solved.physics
    status = _status(solved, certificate, deadline)
    if least and beaten:
        status = given_up(status, solved.cost, least.value)
    if least and status.solved:
        least.note(solved.cost)
    cost_terms = transcription.cost_terms(w)
    effort = Effort(chain.reports, build_seconds, deadline.spent - build_seconds)
    statistics = statistics_of(problem, solution, effort, cost_terms, solved.stages, solved.search, solved.refinement)
    names, controls = motion.actuation.names, transcription.controls(w)
    plan = assembled_plan(
        motion,
        solved.physical,
        physics,
        controls_of(controls[: len(names)], names, _interval_starts(solved)),
        status=status,
        audit=solved.audit,
        outcome=solved.outcome,
        statistics=statistics,
    )
    summary = replay_summary(solved.replay, motion.robot.velocity_names)
    elements = finite_elements_of(transcription, w, solution.branch) if solution.branch else None
    warnings = overlaps_of_motion(motion.task, motion.robot, motion.scene.surfaces, solved.physical)
    return plan.model_copy(update={"replay": summary, "finite_elements": elements, "warnings": warnings})


def _interval_starts(solved: SolvedMotion) -> np.ndarray:
    """Return when control intervals begin, (N), s."""
    ends, grid = solved.physical.clock, solved.motion.grid
    if grid.moving:
        return np.append(0.0, ends[:-1])
    return grid.duration(ends) * np.arange(len(ends)) / len(ends)


def _status(solved: SolvedMotion, certificate: Certificate | None, deadline: Deadline) -> Status:
    """Return the status of a motion, with its certificate if there is one."""
    motion, solution, w, known = solved.motion, solved.solution, solved.solution.w, solved.solution.solved
    return status_of(
        solution,
        solved.audit,
        solved.outcome,
        motion.task.solver.tolerance,
        certificate,
        [] if known else solved.polisher.out_of_elements(w),
        isinstance(motion.task.reference, Jumps),
        "" if known else conflict_of(motion, solved.polisher, w, deadline.left),
    )


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
