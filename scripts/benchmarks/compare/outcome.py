"""What one run of one tool gave."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

TOOLS = ("ours", "nosnoc")
TITLES = {"ours": "fesd-robot", "nosnoc": "nosnoc"}


@dataclass(frozen=True)
class Settings:
    """What the command line chooses for a run.

    Attributes:
        tolerance: complementarity asked of fesd-robot; nosnoc keeps its authors' own.
        multipliers: how nosnoc weights the vector fields of the hopper, ``published`` or ``correct``.
        linear_solver: of fesd-robot, ``auto`` or ``mumps``; nosnoc uses MUMPS.
        grid: of fesd-robot's hoppers, ``uniform`` as in nosnoc, or ``phases``, which is the default of tasks.
    """

    tolerance: float = 1e-8
    multipliers: str = "published"
    linear_solver: str = "auto"
    grid: str = "uniform"


@dataclass(frozen=True)
class Outcome:
    """What one run of one tool gave.

    Attributes:
        verdict: the tool's own word on its result.
        last_nlp: how its last NLP ended.
        wall_seconds, cpu_seconds: from the problem's description to the result.
        iterations: of IPOPT, over all NLPs.
        complementarity: largest product of a relaxed pair, as the tool pairs sums over stages.
        constraint_violation: largest violation of a constraint or bound.
        objective: of the tool's own last NLP.
        cost: of the returned trajectory, by one function for both tools.
        variables, constraints: of the NLP.
        further: what else tells the two motions apart, label -> text.
        homotopy: every NLP.
        details: what else the tool reports.
    """

    verdict: str
    last_nlp: str
    wall_seconds: float
    cpu_seconds: float
    iterations: int
    complementarity: float
    constraint_violation: float
    objective: float
    cost: float
    variables: int
    constraints: int
    further: dict[str, str] = field(default_factory=dict)
    homotopy: list[dict[str, Any]] = field(default_factory=list)
    details: dict[str, Any] = field(default_factory=dict)


def show_nlp(step: Any) -> None:
    """Print an NLP of fesd-robot's homotopy."""
    print(
        f"sigma {step.sigma:.1e}: {step.iterations} iterations, {step.seconds:.1f} s, {step.status}, "
        f"objective {step.residuals.objective:.4f}",
        flush=True,
    )
