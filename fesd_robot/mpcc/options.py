"""How a homotopy runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from fesd_robot.arguments import checked
from fesd_robot.errors import OptionError
from fesd_robot.exactness import FEASIBLE
from fesd_robot.mpcc.assembly import Compile
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.mpcc.schedule import USUAL_ITERATIONS, Rule, Sigmas, SigmaSchedule, check_rule
from fesd_robot.mpcc.steering import Steering, check_steering
from fesd_robot.nlp import check_solver


@checked
@dataclass(frozen=True)
class HomotopyOptions:
    """How sigma is driven to zero.

    Args:
        tolerance: product G H asked for in every pair; the last sigma (of most relaxations).
        sigma_start, sigma_factor: first sigma (None: `schedule.chosen_start`) and the factor from one NLP to the next.
        velocity_level_ratio: how much larger sigma is for pairs at velocity level, if there are any, until those at
            position level have reached the tolerance.
        max_iterations: IPOPT iterations per NLP.
        linear_solver: ``fesd`` is our own (`native.kkt_library`), ``auto`` that or MUMPS where it cannot be compiled;
            else one of IPOPT's.
        compile: whether the NLP's functions become machine code: ``always``, ``never``, or ``auto``: large ones where
            there is a C compiler.
        feasibility: largest constraint violation of a solved problem; IPOPT is asked for a tenth of it at the end.
        ipopt: further IPOPT options, by IPOPT's names.
        branch_solver: solver of branch NLPs, one of `nlp.SOLVERS`.
        relaxation: name of what stands for a pair, from `relaxations.RELAXATIONS`.
        steering: what drives sigma to zero: ``direct`` this homotopy, ``l1``, ``linf`` a penalty rho = 1/sigma on slack
            variables in its place, which are at most sigma_start; they end as soon as an NLP's products are zero.
        schedule: how sigma shrinks, ``linear``, ``superlinear`` or ``adaptive`` (`schedule.Rule`).
        sigma_power: power of the superlinear schedule.
        polish: whether a polisher that is given to `solve` is used.
        polish_at: sigma of the position level at which polishing is first tried; the homotopy down to it is loose.
        readable_at: sigma of the position level at and below which a point shows what touches when, if need be: where
            NLPs are lost one after the other its branch is tried.
        loose_iterations: IPOPT iterations of an NLP of the loose homotopy.

    Raises:
        OptionError: a tolerance, factor, power or ratio outside its range, or an unknown name.
    """

    tolerance: float = 1e-8
    sigma_start: float | None = 0.1
    sigma_factor: float = 0.35
    velocity_level_ratio: float = 30.0
    max_iterations: int = 1000
    linear_solver: str = "auto"
    compile: Compile = "auto"
    feasibility: float = FEASIBLE
    ipopt: dict[str, Any] = field(default_factory=dict)
    branch_solver: str = "ipopt"
    relaxation: str = "scholtes"
    steering: Steering = "direct"
    schedule: Rule = "linear"
    sigma_power: float = 1.5
    polish: bool = True
    polish_at: float = 1e-5
    readable_at: float = 3e-3
    loose_iterations: int = 200

    def __post_init__(self) -> None:
        relaxation_named(self.relaxation)
        check_steering(self.steering)
        check_rule(self.schedule)
        check_solver(self.branch_solver)
        if not 0 < self.tolerance <= (1.0 if self.sigma_start is None else self.sigma_start):
            first = "chosen" if self.sigma_start is None else f"{self.sigma_start:g}"
            raise OptionError(f"need 0 < tolerance <= sigma_start, found {self.tolerance:g} and {first}")
        if not 0 < self.sigma_factor < 1:
            raise OptionError(f"sigma_factor must be between 0 and 1, found {self.sigma_factor:g}")
        if not self.sigma_power > 1:
            raise OptionError(f"sigma_power must be greater than 1, found {self.sigma_power:g}")
        if not self.velocity_level_ratio >= 1:
            raise OptionError(f"velocity_level_ratio must be at least 1, found {self.velocity_level_ratio:g}")

    def steps(self, sigma_start: float, last: float) -> SigmaSchedule:
        """Return the schedule from one sigma to another."""
        return SigmaSchedule(
            self.schedule, sigma_start, last, self.sigma_factor, self.sigma_power, self.velocity_level_ratio
        )

    def sigmas(self) -> list[Sigmas]:
        """The sequence of sigma of the position and the velocity level; both end at the tolerance exactly.

        A first sigma that a problem would choose is 1 here, and every NLP takes `schedule.USUAL_ITERATIONS` iterations.
        """
        steps = self.steps(1.0 if self.sigma_start is None else self.sigma_start, self.tolerance)
        values = [steps.start()]
        while not steps.is_last(values[-1]):
            values.append(steps.after(values[-1], USUAL_ITERATIONS))
        return values
