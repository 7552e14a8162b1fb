"""Descent: from a motion that a branch descends from to one that none descends from, with its certificate."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from fesd_robot.exactness import ZERO_PRODUCT
from fesd_robot.fesd.neighbours import Pivots
from fesd_robot.fesd.polishing import problem_around
from fesd_robot.mpcc import (
    BranchSolver,
    Certificate,
    Mpcc,
    MpccSolution,
    PolishingLimits,
    Run,
    certify,
)
from fesd_robot.refinement.refine import refined
from fesd_robot.refinement.solved_motion import SolvedMotion
from fesd_robot.running import Activity, ActivityCallback, OutOfTime, check_time
from fesd_robot.task import Task


def descended(
    solved: SolvedMotion, task: Task, run: Run, on_activity: ActivityCallback
) -> tuple[SolvedMotion, Certificate | None]:
    """Return the motion from which no branch is found that descends, and the certificate of that.

    Where the certificate finds a direction of descent, the modes of the elements that it leaves are completed
    (`fesd.neighbours.Pivots`), and the branch NLP is solved there from the same point. What costs less and is as true
    takes its place. With no descents in the run's effort contacts stay as they are: there is the certificate alone.

    Args:
        solved: the motion; it stays as it is if it is not exact.
        task: its solver's tolerance, and its accuracy: what descends is refined again.
        run: of all NLPs.
        on_activity: called with every activity that begins, a certificate or a descent.

    Returns:
        motion and certificate; no certificate if the motion is not solved, or no time is left.

    Source: phase II of MPECopt, Nurkanovic, Leyffer, arXiv 2501.13835.
    """
    found: tuple[SolvedMotion, Certificate | None] = (solved, None)
    with contextlib.suppress(OutOfTime):
        for one in _descent(solved, task, run, on_activity):
            found = one
    return found


def _descent(
    solved: SolvedMotion, task: Task, run: Run, on_activity: ActivityCallback
) -> Iterator[tuple[SolvedMotion, Certificate | None]]:
    """Yield ever cheaper motions, each before and with its certificate.

    The args are those of `descended`.

    Raises:
        OutOfTime: the time limit came.
    """
    yield solved, None
    check_time()
    on_activity(Activity.CERTIFYING)
    certificate = _certificate(solved, task, run)
    yield solved, certificate
    for _ in range(run.effort.descents):
        if certificate and certificate.direction is not None:
            on_activity(Activity.IMPROVING)
        better, followed = _better(solved, certificate, task, run)
        if better is None:
            yield solved, certificate and replace(certificate, followed=followed)
            return
        yield better, None
        on_activity(Activity.CERTIFYING)
        solved, certificate = better, _certificate(better, task, run)
        yield solved, certificate


def _certificate(solved: SolvedMotion, task: Task, run: Run) -> Certificate | None:
    """Return the certificate of a motion, on the grid of its branch if it is exact.

    There elements of one mode are equally long. A direction that gives elements without length one, in the mode of a
    neighbour, is asked for again without that: the answer is for motions in which these elements keep none.
    """
    solution, tolerance = solved.solution, task.solver.tolerance
    if not solution.exact:
        return _certified(solved.transcription.problem, solution, tolerance, run)
    held: frozenset[int] = frozenset()

    def without(direction: np.ndarray) -> Mpcc | None:
        nonlocal held
        growing = _pivots(solved, direction).growing_for_nothing
        held |= growing
        return problem_around(solved.on_branch, held) if growing else None

    return _certified(problem_around(solved.on_branch), solution, tolerance, run, without)


def _pivots(solved: SolvedMotion, direction: np.ndarray) -> Pivots:
    return Pivots(solved.on_branch, direction)


def _better(
    solved: SolvedMotion, certificate: Certificate | None, task: Task, run: Run
) -> tuple[SolvedMotion | None, int]:
    """Return a motion that costs less on one of the branches that the direction points to, and how many were tried."""
    if not solved.solution.exact or certificate is None or certificate.direction is None:
        return None, 0
    begin, effort, solution, own = time.perf_counter(), run.effort, solved.solution, solved.on_branch
    objective = solution.residuals.objective
    below = objective - effort.descent_gain * max(1.0, abs(objective))
    pivots = _pivots(solved, certificate.direction)
    problem = solved.transcription.problem
    solver = BranchSolver(problem, own.polisher, run)
    branches = list(islice(pivots.branches(), effort.pivots))
    for branch in branches:
        solver.run = run.within(effort.pivot_seconds)
        found = solver.exact(own.at(own.w, branch), limits=PolishingLimits(effort.pivot_iterations, updates=0))
        if found and found.residuals.objective < below:
            continued = solver.solution(found, solution, time.perf_counter() - begin)
            better = solved.continued(own.polisher, continued)
            if better.audit.violations and task.method.accuracy != "none":
                better = refined(better, task.method.accuracy, run)
            cheaper = better.solution.residuals.objective < below
            if cheaper and (solved.audit.violations or not better.audit.violations):
                return better, len(branches)
        if solver.ended_early:
            break
    return None, len(branches)


def _certified(
    problem: Mpcc,
    solution: MpccSolution,
    tolerance: float,
    run: Run,
    without: Callable[[np.ndarray], Mpcc | None] | None = None,
) -> Certificate | None:
    """Return what kind of point a solution is, or None if it is not solved or no time is left.

    Args:
        problem: with pairs; on the branch of an exact solution its elements of one mode are equally long.
        tolerance: product of a pair that counts as zero; where a solution is exact, `ZERO_PRODUCT` is taken.
        run: of whose time the certificate may take three quarters.
        without: as in `certify`.
    """
    seconds = min(run.effort.certificate_seconds, 0.75 * run.deadline.left)
    if not solution.solved or seconds <= 0:
        return None
    product = ZERO_PRODUCT if solution.exact else tolerance
    return certify(problem, solution.w, tolerance=product, time_limit=seconds, without=without)
