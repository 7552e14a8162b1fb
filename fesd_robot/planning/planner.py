"""The chain from a task to a plan, in the order in which it runs."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.mpcc import Certificate, NlpReport, NlpStatus, Run
from fesd_robot.native import begin_building
from fesd_robot.ocp import MotionProblem, assembled_plan, conflict_of, formulate, homotopy_options
from fesd_robot.ocp.judged import names_of
from fesd_robot.planning.attempts import AttemptedPlan, best_plan
from fesd_robot.planning.chain import Chain, NoSequence, UniformMotion
from fesd_robot.planning.fallbacks import (
    FALLBACKS,
    SOFT_GOAL,
    Overrides,
    has_hard_goal,
    with_overrides,
)
from fesd_robot.planning.suggestions import suggestions
from fesd_robot.plans import (
    ORDER_MATTERS,
    Audit,
    Plan,
    SolveEffort,
    Status,
    controls_of,
    landing_orders,
    overlaps_of_motion,
    replay_summary,
    settings_line,
    statistics_of,
    status_of,
    use_warnings,
)
from fesd_robot.refinement import SolvedMotion, descended
from fesd_robot.replay import MotionReplay
from fesd_robot.running import (
    Activity,
    ActivityCallback,
    Deadline,
    OutOfTime,
    ProgressCallback,
    SearchEffort,
    Stop,
    held_deadline,
    held_to,
    stop_requested,
)
from fesd_robot.starts import finite_elements_of
from fesd_robot.task import Jumps, Task
from fesd_robot.tracking import with_gains

logger = logging.getLogger(__name__)

ORDER_SECONDS, ORDER_SHARE = 1.0, 0.05
"""How long the orders of landings may take to work out: seconds, and a part of what the plan has taken."""


@checked
def plan(
    task: Task,
    *,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
    retrying: Callable[[Overrides, Plan], None] | None = None,
    on_activity: ActivityCallback | None = None,
    on_progress: ProgressCallback | None = None,
    early: Callable[[Plan], None] | None = None,
    earlier: Plan | None = None,
) -> Plan:
    """Plan the motion that a task describes, and with fallback settings if its own do not solve it.

    Args:
        task: from `load_task`; its time limit counts from now on, or is that of `running.held_to`. Where no sequence of
            phases leads to a motion on a control grid that moves, it is planned on one that stands still.
            `task.solver.retries` is the number of fallback settings (`planning.fallbacks.FALLBACKS`); after them a
            motion is looked for that comes near to the goal.
        progress: called after every NLP of the homotopy, and with the NLPs of ever cheaper motions of the search.
        stop: called once an IPOPT iteration with (iteration, objective), and while other processes are waited for with
            (0, NaN); True ends the solve, and the best motion by then is returned, or the best iterate as not solved.
        retrying: called before fallback settings or changes of the task are tried, with these and the plan that was not
            solved.
        on_activity: called with every activity that begins.
        on_progress: called with the steps of the activity that are done, and of how many, None if that is not known.
        early: called with the plan of the cheapest motion after some seconds of search, refined and audited but without
            a certificate, if it is there while cheaper ones are looked for.
        earlier: a plan of this task or of one like it, as one that was made before: what happens in it, and in which
            order, is one of the first things that are tried.

    Returns:
        The cheapest solved plan of the attempts, else one that only misses the goal, else the first of all;
        `plan.status.solved` says whether it can be relied on, and `plan.statistics.attempts` what was tried. The
        message of a plan that is not solved names the conflicting constraints, and a change of the task with which
        it is solved, if one of `planning.suggestions` helps.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    run = _run_of(task, stop, progress)
    tried = partial(
        attempt,
        hard_goal=not task.goal.soft,
        progress=progress,
        stop=stop,
        on_activity=on_activity,
        on_progress=on_progress,
        early=early,
        earlier=earlier,
    )
    with held_to(run.deadline):
        best = _best_of(task, run, tried, retrying, on_activity)
    return with_gains(best) if task.output.gains and best.status.solved else best


def _best_of(
    task: Task,
    run: Run,
    tried: Callable[..., Plan],
    retrying: Callable[[Overrides, Plan], None] | None,
    on_activity: ActivityCallback | None,
) -> Plan:
    """Return the cheapest solved plan of the attempts, else one that only misses the goal, else the first of all."""
    attempts, deadline, stop = list[AttemptedPlan](), run.deadline, run.stop
    uniform: UniformMotion | None = None
    if task.method.grid == "phases":
        on_phases, uniform = _on_phases(task, tried, deadline)
        if on_phases:
            return on_phases
        task = with_overrides(task, {"method.grid": "uniform"})
    for overrides in _settings(task):
        if attempts and deadline.left <= 0:
            break
        if attempts and retrying:
            retrying(overrides, attempts[-1].plan)
        begin = deadline.spent
        known = {"earlier": uniform} if uniform and not overrides else {}  # it would end there again
        plan = tried(with_overrides(task, overrides), **known)
        attempts.append(AttemptedPlan(overrides, plan, deadline.spent - begin))
        if attempts[-1].final or stop_requested(stop):
            break
    best = best_plan(attempts)
    if any(one.final for one in attempts) or stop_requested(stop) or not task.solver.retries:
        return best
    return _with_what_helps(best, task, run, retrying, on_activity)


def _on_phases(
    task: Task, attempted: Callable[[Task], Plan], deadline: Deadline
) -> tuple[Plan | None, UniformMotion | None]:
    """Return the plan on a control grid that moves, None where a grid that stands still is to be tried.

    With it how the search on a grid that stands still has ended, if there was one.
    """
    begin = deadline.spent
    try:
        found = AttemptedPlan({}, attempted(task), deadline.spent - begin)
    except NoSequence as error:
        logger.warning("%s, which is planned on a control grid that stands still", error)
        return None, error.uniform
    if found.final or deadline.left <= 0:
        return best_plan([found]), None
    logger.warning("the motion on a control grid that moves is not solved: %s", found.plan.status.message)
    return None, None


def attempt(
    task: Task,
    *,
    hard_goal: bool = False,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
    on_activity: ActivityCallback | None = None,
    on_progress: ProgressCallback | None = None,
    early: Callable[[Plan], None] | None = None,
    earlier: Plan | UniformMotion | None = None,
) -> Plan:
    """Plan the motion with the task's own settings, once: formulate, transcribe, solve, recover, audit, assemble.

    Args:
        hard_goal: whether the motion is held against the task's goal as if that were not soft.
        earlier: a plan as in `plan`, or how the search for the motion ended on its grid that stands still.

    The other args and raises are those of `plan`.

    Raises:
        NoSequence: no sequence of phases leads to a motion on a control grid that moves.
    """
    before: list[Plan] = []
    known = earlier if isinstance(earlier, UniformMotion) else None

    def take(plan: Plan) -> None:
        if plan.status.solved and early:
            before.append(plan)
            early(plan)

    run = _run_of(task, stop, progress)
    chain = Chain(
        run,
        on_activity or _unseen,
        on_progress or _uncounted,
        list[NlpReport](),
        take if early else None,
        earlier=earlier if isinstance(earlier, Plan) else None,
    )
    with held_to(run.deadline):
        plan = _chained(task, chain, partial(_searched, hard_goal=hard_goal, known=known))
    assert plan is not None
    return min([plan, *before], key=lambda one: one.statistics.objective if one.status.solved else np.inf)


@checked
def continued(task: Task, earlier: Plan, *, progress: Callable[[NlpReport], None] | None = None) -> Plan | None:
    """Plan the motion with the contact sequence of a plan of a task that differs in numbers, and look for no other one.

    It begins from the elements and the multipliers that the plan ended with, and takes a few iterations where the
    numbers are near to each other.

    Args:
        task: from `load_task`; its `solver.warm_start` names another plan to begin from, if it is given.
        earlier: the plan to begin from.
        progress: as in `plan`.

    Returns:
        The solved plan; None where the sequence has no exact motion near that of the plan.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    run = _run_of(task, None, progress)
    chain = Chain(run, _unseen, _uncounted, list[NlpReport](), earlier=earlier)
    with held_to(run.deadline):
        plan = _chained(task, chain, Chain.kept)
    return plan if plan and plan.status.solved else None


def _searched(chain: Chain, motion: MotionProblem, *, hard_goal: bool, known: UniformMotion | None) -> SolvedMotion:
    """Return the motion of a task on its grid.

    Raises:
        NoSequence: no sequence of phases leads to a motion on a control grid that moves.
    """
    if motion.grid.moving:
        return chain.on_phases(motion, hard_goal=hard_goal)
    return chain.on_uniform_grid(motion, known, hard_goal=hard_goal)


def _chained(task: Task, chain: Chain, find: Callable[[Chain, MotionProblem], SolvedMotion | None]) -> Plan | None:
    """Return the plan that the chain from a task leads to, of one attempt; None where no motion is found."""
    clock, on_activity = Deadline(), chain.on_activity
    on_activity(Activity.BUILDING)
    if task.solver.linear_solver in ("auto", "fesd"):
        begin_building()
    try:
        motion = formulate(task)
    except OutOfTime:
        raise task.error("solver.time_limit", TOO_SHORT) from None
    build_seconds = clock.spent

    def planned(solved: SolvedMotion, certificate: Certificate | None = None) -> Plan:
        return _plan_of(
            solved, certificate, chain, SolveEffort(chain.reports, build_seconds, clock.spent - build_seconds)
        )

    chain = replace(chain, as_early=planned)
    found = find(chain, motion)
    if found is None:
        return None
    solved, certificate = descended(found, task, chain.noted, on_activity)
    return _with_landing_orders(planned(solved, certificate), solved, chain.run.deadline)


def _plan_of(solved: SolvedMotion, certificate: Certificate | None, chain: Chain, effort: SolveEffort) -> Plan:
    """Return the plan of a motion, with its certificate if there is one.

    A motion that is one is still driven again for a moment after the time limit; where that does not suffice it is not
    known to be solved.
    """
    with held_to(Deadline()):
        conflict, replay = _conflict(solved, chain.run), _replay_of(solved, chain.run)
        audit = solved.audit if replay else solved.audit_without_replay
        motion, transcription, w = solved.motion, solved.transcription, solved.on_branch.w
        names, controls = motion.actuation.names, transcription.controls(w)
        plan = assembled_plan(
            motion,
            solved.physical,
            solved.physics,
            controls_of(controls[: len(names)], names, _interval_starts(solved)),
            status=_status(solved, certificate, audit, conflict, replayed=replay is not None),
            audit=audit,
            outcome=solved.outcome,
            statistics=statistics_of(
                transcription.problem,
                solved.solution,
                effort,
                transcription.cost_terms(w),
                solved.stages,
                solved.search,
                None if chain.run.deadline.left <= 0 and not solved.has_errors else solved.refinement,
            ),
        )
        summary = replay_summary(replay, motion.robot.velocity_names) if replay else None
        elements = finite_elements_of(solved.on_branch) if solved.solution.exact else None
        warnings = [*_overlaps_of(solved, chain.run), *use_warnings(solved.outcome.contacts)]
    return plan.model_copy(update={"replay": summary, "finite_elements": elements, "warnings": warnings})


def _with_landing_orders(plan: Plan, solved: SolvedMotion, deadline: Deadline) -> Plan:
    """Return a solved plan with what another order would change of its landings, as far as there is time."""
    if not plan.status.solved:
        return plan
    end = deadline.spent + ORDER_SECONDS + ORDER_SHARE * deadline.spent

    def goes_on() -> bool:
        return deadline.left > 0 and deadline.spent < end

    orders = landing_orders(solved.physical, solved.physics, names_of(solved.motion), goes_on)
    told = [one.sentence for one in orders if one.part > ORDER_MATTERS]
    return plan.model_copy(update={"landing_orders": orders, "warnings": [*plan.warnings, *told]})


def _replay_of(solved: SolvedMotion, run: Run) -> MotionReplay | None:
    """Return the motion driven again, None where no time is left for that."""
    try:
        with held_to(_for_audit(solved, run)):
            return solved.replay
    except OutOfTime:
        return None


def _for_audit(solved: SolvedMotion, run: Run) -> Deadline:
    """Return the clock of what is found out about a motion: one that is none is not looked at after the time limit."""
    return run.deadline.with_grace if solved.solution.solved else run.deadline


def _overlaps_of(solved: SolvedMotion, run: Run) -> list[str]:
    """Return a sentence for what overlaps along a motion, or that no time was left to look."""
    motion = solved.motion
    try:
        with held_to(_for_audit(solved, run)):
            return overlaps_of_motion(motion.task, motion.robot, motion.scene.surfaces, solved.physical)
    except OutOfTime:
        return ["Whether bodies overlap is not known: the time limit came before that was looked at."]


def _conflict(solved: SolvedMotion, run: Run) -> str:
    """Return the conflicting constraints of a motion that is not solved, as far as time is left to find them."""
    if solved.solution.solved:
        return ""
    seconds = min(run.effort.conflict_seconds, 0.5 * run.deadline.left)
    try:
        with held_to(run.deadline):
            return conflict_of(solved.motion, solved.on_branch.polisher, solved.on_branch.w, seconds)
    except OutOfTime:
        return ""


def _interval_starts(solved: SolvedMotion) -> np.ndarray:
    """Return when control intervals begin, (N), s."""
    ends, grid = solved.physical.clock, solved.motion.grid
    if grid.moving:
        return np.append(0.0, ends[:-1])
    return grid.duration(ends) * np.arange(len(ends)) / len(ends)


def _status(
    solved: SolvedMotion, certificate: Certificate | None, audit: Audit, conflict: str, *, replayed: bool
) -> Status:
    """Return the status of a motion, with its certificate if there is one."""
    motion, solution, w, known = solved.motion, solved.solution, solved.on_branch.w, solved.solution.solved
    status = status_of(
        solution,
        audit,
        solved.outcome,
        motion.task.solver.tolerance,
        certificate,
        [] if known or not replayed else solved.on_branch.polisher.out_of_elements(w),
        isinstance(motion.task.reference, Jumps),
        conflict,
    )
    if replayed or not status.solved:
        return status
    return status.model_copy(update={"solved": False, "audit_passed": False, "message": NOT_REPLAYED})


TOO_SHORT = "the time limit came while the equations were built, expected a longer one"

NOT_REPLAYED = (
    "Not solved: time limit before the motion was driven again by the laws of rigid bodies, as the physics audit asks "
    f"for; {NlpStatus.TIME_LIMIT.advice}."
)


def _run_of(task: Task, stop: Stop | None, report: Callable[[NlpReport], None] | None) -> Run:
    """Return what all NLPs of a task have in common; its deadline is the one that is held to, if there is one."""
    effort, deadline = SearchEffort.of(task.solver.effort), held_deadline() or Deadline(task.solver.time_limit)
    return Run(homotopy_options(task), deadline, stop, report, effort)


def _settings(task: Task) -> list[Overrides]:
    """Return the settings to try one after the other, the task's own first."""
    fallbacks = [fallback(task) for fallback in FALLBACKS[: task.solver.retries]]
    return [{}, *fallbacks, *([SOFT_GOAL] if fallbacks and has_hard_goal(task) else [])]


def _with_what_helps(
    plan: Plan,
    task: Task,
    run: Run,
    retrying: Callable[[Overrides, Plan], None] | None,
    on_activity: ActivityCallback | None,
) -> Plan:
    """Return a plan that is not solved with a message that says with which change of its task it is, if one helps."""
    last = plan
    for changes, changed in suggestions(task):
        if run.deadline.left <= 0:
            break
        if retrying:
            retrying(changes, last)
        quick = with_overrides(changed, {"solver.effort": "quick"})
        last = attempt(quick, progress=run.report, stop=run.stop, on_activity=on_activity)
        tried = AttemptedPlan(changes, last, 0.0)
        if tried.solved:
            message = f"{plan.status.message} Tried, and solved: the same task with {settings_line(changes)}."
            return plan.model_copy(update={"status": plan.status.model_copy(update={"message": message})})
        if tried.final:
            break
    return plan


def _unseen(activity: Activity) -> None:
    """Take note of nothing."""


def _uncounted(done: int, of: int | None) -> None:
    """Take note of nothing."""
