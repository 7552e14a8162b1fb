"""The chain from a task to a plan, in the order in which it runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fesd_robot.adapters import (
    assembled_plan,
    certificate_of,
    homotopy_options,
    motion_audit,
    motion_outcome,
    numeric_physics,
    physical_motion,
    with_promised_goal,
)
from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Transcription, with_stages
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.fesd.schemes import MAX_STAGES
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, NlpReport, continue_on_branch, solve
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan
from fesd_robot.plans.audit_record import Audit
from fesd_robot.plans.statistics import statistics_of
from fesd_robot.plans.verdict import status_of
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.strategies.attempts import AttemptedPlan, Stop, best_plan, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import FALLBACKS, SOFT_GOAL, Overrides, promises_goal, with_overrides
from fesd_robot.strategies.multistart import attempt_seeds
from fesd_robot.task import Jumps, Task

ADDED_STAGES = 2
"""How many stages more than the task's an element may get where the audit finds an exact solution too coarse."""

LEAST_SECONDS = 1e-3
"""Time limit of an attempt for which no time is left; it ends at once."""


def plan(
    task: Task,
    *,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
    retrying: Callable[[Overrides, Plan], None] | None = None,
    started: Callable[[int, Plan], None] | None = None,
) -> Plan:
    """Plan the motion that a task describes, from its initial guesses, and with fallback settings if none solves it.

    Args:
        task: from `load_task`; `task.solver.starts` is the number of initial guesses, each solved in a process of its
            own if there are several, and `task.solver.retries` the number of fallback settings
            (`strategies.fallbacks.FALLBACKS`); after them a motion is looked for that comes near to the goal.
        progress: called after every NLP of the homotopy.
        stop: called once an IPOPT iteration with (iteration, objective), and while starts are waited for with
            (0, NaN); True ends the solve, and the best iterate is returned as not solved.
        retrying: called before fallback settings are used, with these and the plan that was not solved.
        started: called with the seed and the plan of every one of several starts when it is there.

    Returns:
        The cheapest solved plan of the starts, else the first that is solved, else one that only misses the goal, else
        the first of all; `plan.status.solved` says whether it can be relied on, and `plan.statistics.attempts` what was
        tried.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    deadline = Deadline(task.solver.time_limit)
    attempts = attempt_seeds(task, attempt, stop, started)
    for overrides in _further_settings(task, attempts, stop):
        if attempts and retrying:
            retrying(overrides, attempts[-1].plan)
        begin = deadline.spent
        changed = with_overrides(task, {**overrides, **_time_left(deadline)})
        result = attempt(changed, promised=not task.goal.soft, progress=progress, stop=stop)
        attempts.append(AttemptedPlan(overrides, result, deadline.spent - begin))
        if attempts[-1].final:
            break
    return best_plan(attempts)


def attempt(
    task: Task,
    *,
    promised: bool = False,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Stop | None = None,
) -> Plan:
    """Plan the motion with the task's own settings, once: formulate, transcribe, solve, recover, audit, assemble.

    Args:
        promised: whether the motion is held against the task's goal as if that were not soft.

    The other args and raises are those of `plan`.
    """
    deadline = Deadline(task.solver.time_limit)
    motion = formulate(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    problem, build_seconds = transcription.problem, deadline.spent

    options, polisher = homotopy_options(task), BranchTranscription(transcription)
    solution = solve(problem, options, polisher=polisher, progress=progress, stop=stop)

    motion = with_promised_goal(motion) if promised and task.goal.soft else motion
    solved = _Solved.of(motion, polisher, solution)
    most_stages = min(task.method.stages + ADDED_STAGES, MAX_STAGES)
    while solved.inexact and solved.stages < most_stages:
        refined = _refined(solved, options, deadline, progress, stop)
        if refined is None:
            break
        solved = refined

    motion, transcription, solution, w = solved.motion, solved.transcription, solved.solution, solved.solution.w
    problem, physics = transcription.problem, solved.physics
    certificate = certificate_of(problem, solution, task.solver.tolerance, deadline.left)
    full_intervals = [] if solution.solved else solved.polisher.out_of_elements(w)
    outcome = motion_outcome(motion, solved.physical, physics)
    jumps = isinstance(task.reference, Jumps)
    status = status_of(solution, solved.audit, outcome, task.solver.tolerance, certificate, full_intervals, jumps)
    statistics = statistics_of(problem, solution, transcription.cost_terms(w), build_seconds, solved.stages)
    return assembled_plan(
        motion,
        solved.physical,
        physics,
        transcription.controls(w),
        status=status,
        audit=solved.audit,
        outcome=outcome,
        statistics=statistics,
    )


@dataclass(frozen=True)
class _Solved:
    """A solution, the motion that it is, and what the audit says about that."""

    motion: MotionProblem
    polisher: BranchTranscription
    solution: MpccSolution
    branch: Branch
    physics: NumericPhysics
    physical: PhysicalMotion
    audit: Audit

    @classmethod
    def of(cls, motion: MotionProblem, polisher: BranchTranscription, solution: MpccSolution) -> _Solved:
        """Recover the motion of a solution and audit it."""
        transcription = polisher.transcription
        motion = replace(motion, fesd=transcription.options)
        branch = solution.branch or polisher.branch(solution.w)
        physical, physics = physical_motion(motion, transcription.unpack(solution.w), branch), numeric_physics(motion)
        return cls(motion, polisher, solution, branch, physics, physical, motion_audit(motion, physical, physics))

    @property
    def transcription(self) -> Transcription:
        """Of the problem that was solved."""
        return self.polisher.transcription

    @property
    def stages(self) -> int:
        """Of every element."""
        return self.transcription.options.tableau.stages

    @property
    def inexact(self) -> bool:
        """Whether an exact solution fails its audit by more than a missed goal: its elements are too coarse."""
        return self.solution.exact and bool(set(self.audit.violations) - {"max_goal_violation"})


def _refined(
    solved: _Solved,
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> _Solved | None:
    """Return the solution on the same branch with one more stage an element, None if there is none."""
    transcription, w = with_stages(solved.transcription, solved.solution.w, solved.stages + 1)
    polisher = BranchTranscription(transcription)
    solution = continue_on_branch(
        transcription.problem,
        polisher,
        (w, solved.branch),
        solved.solution,
        options,
        seconds_left=lambda: None if math.isinf(deadline.left) else deadline.left,
        progress=progress,
        stop=stop,
    )
    return None if solution is None else _Solved.of(solved.motion, polisher, solution)


def _further_settings(task: Task, attempts: Sequence[AttemptedPlan], stop: Stop | None) -> list[Overrides]:
    """Return the settings to use after the attempts from several seeds: the task's own if there are none of these."""
    own: list[Overrides] = [] if attempts else [{}]
    if any(attempt.solved for attempt in attempts) or (attempts and stop_requested(stop)):
        return own
    fallbacks = [fallback(task) for fallback in FALLBACKS[: task.solver.retries]]
    return own + fallbacks + ([SOFT_GOAL] if fallbacks and promises_goal(task) else [])


def _time_left(deadline: Deadline) -> Overrides:
    """Return the time limit of an attempt that begins now; no override if the task has none."""
    return {} if math.isinf(deadline.left) else {"solver.time_limit": max(deadline.left, LEAST_SECONDS)}
