"""Sizes, effort and cost of a solve, as a plan lists them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fesd_robot.mpcc import Mpcc, MpccSolution, NlpReport
from fesd_robot.plans.plan import HomotopyStep, LocalSearch, Refinement, Statistics


class SolveEffort(NamedTuple):
    """NLPs and seconds of a solve.

    Attributes:
        reports: all NLPs but those of the search.
        build_seconds: time that building the problem took, without that of its derivatives.
        solve_seconds: time since then.
    """

    reports: Sequence[NlpReport]
    build_seconds: float
    solve_seconds: float


def statistics_of(
    problem: Mpcc,
    solution: MpccSolution,
    effort: SolveEffort,
    cost_terms: Mapping[str, float],
    stages: int,
    search: LocalSearch | None,
    refinement: Refinement | None,
) -> Statistics:
    """Return the statistics of a solve.

    Args:
        problem: what was solved.
        solution: where that ended.
        effort: what it took.
        cost_terms: name of a term -> its part of the objective.
        stages: of every element of the problem.
        search: how cheaper neighbours were looked for, None if they were not.
        refinement: how the solution was refined, None if it is not exact.
    """
    return Statistics(
        variables=problem.size,
        constraints=problem.constraints,
        pairs=problem.pairs,
        stages=stages,
        search=search,
        refinement=refinement,
        iterations=sum(report.iterations for report in effort.reports) + (search.iterations if search else 0),
        build_seconds=effort.build_seconds + solution.build_seconds,
        solve_seconds=effort.solve_seconds - solution.build_seconds,
        objective=solution.residuals.objective,
        cost_terms=dict(cost_terms),
        homotopy=[_step(report) for report in effort.reports],
    )


def _step(report: NlpReport) -> HomotopyStep:
    return HomotopyStep(
        sigma=report.sigma,
        velocity_level_sigma=report.velocity_level_sigma,
        status=report.status.value,
        iterations=report.iterations,
        objective=report.residuals.objective,
        complementarity=report.residuals.complementarity,
        constraint_violation=report.residuals.constraint_violation,
        seconds=report.seconds,
    )
