"""Optimal control of a complementarity system: several starts, exact switches, moves between branches, descent."""

from __future__ import annotations

import time
from collections.abc import Callable

from fesd_robot.arguments import checked
from fesd_robot.fesd import FesdOptions, OptimalControlProblem
from fesd_robot.mpcc import NlpReport, Run
from fesd_robot.optimal_control.end_time import EndTime, with_end_time
from fesd_robot.optimal_control.search import Candidate, Search
from fesd_robot.optimal_control.settings import OptimalControlSettings
from fesd_robot.optimal_control.solution import OptimalControlSolution
from fesd_robot.running import Deadline


@checked
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
    run = Run(settings.homotopy(polish=True), Deadline(settings.time_limit), report=progress, effort=settings.effort)
    search = Search(own, options or FesdOptions(), settings, run)
    candidates: list[Candidate] = []
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
