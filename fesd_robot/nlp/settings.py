"""How a nonlinear program is solved, in words that no solver owns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Start:
    """How near to its solution a solve begins.

    Attributes:
        barrier: first barrier parameter.
        push: least distance from bounds to which the point is pushed.
        multipliers: whether those of the point are used; else they are estimated.
    """

    barrier: float
    push: float
    multipliers: bool = False


SAME = Start(1e-10, 1e-12, multipliers=True)
"""The point is the solution, and so are its multipliers."""

AT = Start(1e-6, 1e-8)
"""The point is the solution, but for digits."""

NEAR = Start(1e-4, 1e-5)
"""The point is that of a problem that differs little, or of another discretisation."""

FREE = Start(1e-1, 1e-2)
"""The point is a guess."""


AT_REST = 3
"""Iterations at rest after which an NLP that goes on ends; whole steps that have not converged by then go away."""


@dataclass(frozen=True)
class NlpSettings:
    """How a nonlinear program is solved.

    Attributes:
        start: where it begins.
        tolerance: of the scaled optimality conditions.
        violation: largest constraint violation at the end; None for the solver's own.
        iterations: most iterations.
        adaptive: whether the barrier parameter follows a quality function; else it falls step by step.
        regularised: whether constraints are always regularised. Those of a branch that is not the motion's own depend
            on each other nearly: without, an iteration factorises up to ten times to find by how much.
        whole_steps: whether no step is shortened, for a solution that is near. Newton's steps along forces that hardly
            cost anything, as those of legs against each other, leave the constraints by a little and come back; a line
            search cuts them to a thousandth, and the linear systems of such iterates are ill-conditioned.
        at_rest: iterations after which a solve ends whose constraints hold and whose cost stands still, zero for never.
            Constraints that depend on each other, as of two fingers on one box, and forces that cost nothing leave
            multipliers undetermined, and a solver without an end although it is at its point.
        solver: one of `SOLVERS`.
        linear_solver: ``fesd`` is our own, ``auto`` that or MUMPS where it cannot be compiled; else one of IPOPT's.
        further: options by the solver's own names, and their values; they come last.
    """

    start: Start = FREE
    tolerance: float = 1e-8
    violation: float | None = None
    iterations: int = 3000
    adaptive: bool = False
    regularised: bool = False
    whole_steps: bool = False
    at_rest: int = 0
    solver: str = "ipopt"
    linear_solver: str = "auto"
    further: tuple[tuple[str, Any], ...] = ()
