"""The chain from a task to a plan: formulate, transcribe, solve, return to physical time, audit."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import Certificate, HomotopyOptions, Mpcc, MpccSolution, NlpReport, NlpStatus, certify, solve
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import assemble
from fesd_robot.plans.audit import audit
from fesd_robot.plans.plan import Attempt, Audit, HomotopyStep, Plan, Statistics, Units
from fesd_robot.plans.requirements import requirements
from fesd_robot.plans.verdict import status_of
from fesd_robot.recovery import PhysicalMotion, recover
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot.units import configuration_units, velocity_units
from fesd_robot.strategies.fallbacks import FALLBACKS, Overrides, with_overrides
from fesd_robot.strategies.multistart import solve_multistart
from fesd_robot.task import Task

CERTIFICATE_SECONDS = 30.0
"""Longest time for each answer about the kind of a solution."""


def plan(
    task: Task,
    *,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
    retrying: Callable[[Overrides, Plan], None] | None = None,
    started: Callable[[int, Plan], None] | None = None,
) -> Plan:
    """Plan the motion that a task describes, from several starts, and on other ways where no start solves it.

    Args:
        task: from `load_task`; `task.solver.starts` is the number of first guesses, each solved in a process of its own
            if there are several, and `task.solver.retries` the number of other ways (`retries.FALLBACKS`).
        progress: called after every NLP of the homotopy.
        stop: called once an IPOPT iteration with (iteration, objective), and while starts are waited for with
            (0, NaN); True ends the solve, and the best iterate is returned as not solved.
        retrying: called before every other way with what it changes and the plan that was not solved.
        started: called with the seed and the plan of every one of several starts when it is there.

    Returns:
        The cheapest solved plan of the starts, else the first that is solved, else the first of all;
        `plan.status.solved` says whether it can be relied on, and `plan.statistics.attempts` what was tried.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    begin = time.perf_counter()
    tries = _starts(task, stop, started) if task.solver.starts > 1 else []
    ways: list[Overrides] = [{}] if not tries else []
    if not any(result.status.solved for _, result, _ in tries) and not (tries and stop and stop(0, float("nan"))):
        ways += [way(task) for way in FALLBACKS[: task.solver.retries]]
    for changes in ways:
        if any(result.status.solved for _, result, _ in tries):
            break
        if tries and retrying:
            retrying(changes, tries[-1][1])
        seconds, before = task.solver.time_limit, time.perf_counter()
        left = {} if seconds is None else {"solver.time_limit": max(seconds - (before - begin), 1e-3)}
        result = attempt(with_overrides(task, {**changes, **left}), progress=progress, stop=stop)
        tries.append((changes, result, time.perf_counter() - before))
        if result.status.nlp in (NlpStatus.INTERRUPTED, NlpStatus.TIME_LIMIT):
            break
    solved = [result for _, result, _ in tries if result.status.solved]
    best = min(solved, key=lambda one: one.statistics.objective) if solved else tries[0][1]
    attempts = [
        Attempt(
            changes=changes,
            kept=result is best,
            solved=result.status.solved,
            objective=result.statistics.objective,
            iterations=result.statistics.iterations,
            seconds=seconds,
            message=result.status.message,
        )
        for changes, result, seconds in tries
    ]
    return best.model_copy(update={"statistics": best.statistics.model_copy(update={"attempts": attempts})})


def _starts(
    task: Task, stop: Callable[[int, float], bool] | None, started: Callable[[int, Plan], None] | None
) -> list[tuple[Overrides, Plan, float]]:
    """Solve the task from several first guesses at once."""
    seeds = range(task.solver.seed, task.solver.seed + task.solver.starts)
    found = solve_multistart(
        attempt,
        [with_overrides(task, {"solver.seed": seed}) for seed in seeds],
        (lambda number, result: started(seeds[number], result)) if started else None,
        (lambda: stop(0, float("nan"))) if stop else None,
    )
    return [
        ({"solver.seed": seed}, result, result.statistics.build_seconds + result.statistics.solve_seconds)
        for seed, result in zip(seeds, found, strict=True)
        if result is not None
    ]


def attempt(
    task: Task,
    *,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
) -> Plan:
    """Plan the motion in one try: formulate, transcribe, solve, return to physical time, audit.

    Args and raises are those of `plan`.
    """
    begin = time.perf_counter()
    motion = formulate(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    problem = transcription.problem
    build_seconds = time.perf_counter() - begin
    polisher = BranchTranscription(transcription)
    solution = solve(
        problem,
        homotopy_options(task),
        polisher=polisher,
        progress=progress,
        stop=stop,
    )
    elements = transcription.unpack(solution.w)
    physical = recover(
        elements,
        motion.fesd.tableau,
        motion.dynamics,
        motion.contacts,
        motion.contact_system,
        motion.auxiliary_force,
    )
    physics = numeric_physics(motion)
    found = _audit(motion, physical, physics)
    names, controls = list(task.contacts), motion.actuation.names
    values = transcription.controls(solution.w)[: len(controls)]
    return Plan(
        name=task.name,
        status=status_of(
            solution,
            found,
            task.solver.tolerance,
            _certificate(task, problem, solution, begin),
            [] if solution.solved else polisher.out_of_elements(solution.w),
        ),
        audit=found,
        units=Units(
            configuration=configuration_units(motion.robot),
            velocity=velocity_units(motion.robot),
            controls=dict(zip(controls, motion.actuation.units, strict=True)),
        ),
        trajectory=assemble.trajectory_of(physical, motion.robot.configuration_names, motion.robot.velocity_names),
        controls=assemble.controls_of(values, controls, motion.grid.duration(physical.clock)),
        contacts=assemble.contacts_of(physical, names, physics),
        switches=assemble.switches_of(physical, names),
        impulses=assemble.impulses_of(physical, names),
        statistics=_statistics(transcription, solution, build_seconds),
        provenance=assemble.provenance(task.folder),
        task=task.model_dump(mode="json"),
    )


def homotopy_options(task: Task) -> HomotopyOptions:
    """Return the solver's options from the task's section `solver`."""
    solver = task.solver
    return HomotopyOptions(
        tolerance=solver.tolerance,
        sigma_start=solver.sigma_start,
        sigma_factor=solver.sigma_factor,
        velocity_level_ratio=solver.velocity_level_ratio,
        max_iterations=solver.max_iterations,
        time_limit=solver.time_limit,
        relaxation=solver.relaxation,
        steering=solver.steering,
        schedule=solver.schedule,
        linear_solver=solver.linear_solver,
        compile=task.method.compile,
        polish=solver.polish,
        loose_iterations=solver.loose_iterations,
    )


def numeric_physics(motion: MotionProblem) -> NumericPhysics:
    """Return Pinocchio's numeric view of the same robot, ground and contacts."""
    friction = {contact.name: contact.friction for contact in motion.contacts}
    matrix = motion.actuation.matrix
    return NumericPhysics(motion.robot, motion.scene, friction, lambda q: np.asarray(matrix(q).full()))


def _certificate(task: Task, problem: Mpcc, solution: MpccSolution, begin: float) -> Certificate | None:
    """What kind of point a solution is, within what is left of the task's time."""
    limit, seconds = task.solver.time_limit, CERTIFICATE_SECONDS
    if limit is not None:
        seconds = min(seconds, 0.5 * (limit - (time.perf_counter() - begin)))  # for each of its two answers
    if not solution.solved or seconds <= 0:
        return None
    return certify(problem, solution.w, tolerance=task.solver.tolerance, time_limit=seconds)


def _audit(motion: MotionProblem, physical: PhysicalMotion, physics: NumericPhysics) -> Audit:
    grid, limits, ends = motion.grid, motion.limits, motion.endpoints
    return audit(
        physical,
        physics,
        interval_ends=grid.duration(physical.clock) * np.arange(1, grid.intervals + 1) / grid.intervals,
        position_limits=(limits.lower_position, limits.upper_position),
        velocity_limits=(limits.lower_velocity, limits.upper_velocity),
        control_limits=(motion.actuation.lower, motion.actuation.upper),
        requirements=requirements(
            motion.task,
            motion.robot,
            physics,
            physical,
            (ends.initial_configuration, ends.initial_velocity),
            (ends.goal_configuration, ends.goal_velocity),
        ),
    )


def _statistics(transcription: Transcription, solution: MpccSolution, build_seconds: float) -> Statistics:
    problem = transcription.problem
    return Statistics(
        variables=problem.size,
        constraints=problem.constraints,
        pairs=problem.pairs,
        iterations=solution.iterations,
        build_seconds=build_seconds + solution.build_seconds,
        solve_seconds=solution.solve_seconds,
        objective=solution.residuals.objective,
        cost_terms=transcription.cost_terms(solution.w),
        homotopy=[
            HomotopyStep(
                sigma=step.sigma,
                velocity_level_sigma=step.velocity_level_sigma,
                status=step.status.value,
                iterations=step.iterations,
                objective=step.residuals.objective,
                complementarity=step.residuals.complementarity,
                constraint_violation=step.residuals.constraint_violation,
                seconds=step.seconds,
            )
            for step in solution.reports
        ],
    )
