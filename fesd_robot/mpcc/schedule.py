"""From one sigma to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fesd_robot.errors import OptionError, nearest
from fesd_robot.mpcc.problem import Mpcc

Rule = Literal["linear", "superlinear", "adaptive"]
"""How sigma shrinks from NLP to NLP.

- linear: times the factor; times its square once sigma of the velocity level is at most `ACTIVE_SET_SETTLED_SIGMA`.
- superlinear: min(factor sigma, sigma^power); both levels shrink by the factor that this gives for the velocity level.
- adaptive: times factor^e with e = `USUAL_ITERATIONS` / iterations of the last NLP, within 1/2 and 2.
"""

RULES: tuple[Rule, ...] = get_args(Rule)

ACTIVE_SET_SETTLED_SIGMA = 5e-3
"""Below this sigma of the velocity level the active set hardly changes: NLPs start warm, the factor is squared."""

USUAL_ITERATIONS = 50
"""Iterations of an NLP after which the adaptive schedule keeps the factor as it is."""

FIRST_SIGMA_RANGE = (0.1, 10.0)
"""Where a first sigma that is chosen from the problem lies; far smaller ones lose a third of the published problems."""

Sigmas = tuple[float, float]
"""Sigma of the position and of the velocity level."""


def check_rule(rule: str) -> None:
    """Refuse a name that is no schedule.

    Raises:
        OptionError: the message has the nearest name.
    """
    if rule not in RULES:
        raise OptionError(f"unknown schedule '{rule}'{nearest(rule, RULES)}")


@dataclass(frozen=True)
class SigmaSchedule:
    """A sequence of sigmas from the first to the last.

    Args:
        rule: how they shrink.
        first: sigma of the position level in the first NLP.
        last: sigma of both levels in the last NLP.
        factor, power: of the rule.
        velocity_level_ratio: how much larger sigma of the velocity level is until the position level is at the last.
    """

    rule: Rule
    first: float
    last: float
    factor: float
    power: float
    velocity_level_ratio: float

    def start(self) -> Sigmas:
        """The first sigmas."""
        return self.first, self.first * self.velocity_level_ratio

    def is_last(self, sigmas: Sigmas) -> bool:
        """Whether no smaller sigmas follow."""
        return max(sigmas) <= self.last

    def after(self, sigmas: Sigmas, iterations: int, power: float = 1.0) -> Sigmas:
        """Return the sigmas of the next NLP.

        Args:
            sigmas: of the one before.
            iterations: of the one before.
            power: of the rule's factor; below 1 for a shorter step.
        """
        factor = self._factor(sigmas[1], iterations) ** power
        smaller = [value * factor for value in sigmas]
        first, second = (self.last if value < 1.0001 * self.last else value for value in smaller)
        return first, second

    def _factor(self, sigma: float, iterations: int) -> float:
        if self.rule == "superlinear":
            return min(self.factor, sigma ** (self.power - 1))
        if self.rule == "adaptive":
            return float(self.factor ** np.clip(USUAL_ITERATIONS / max(iterations, 1), 0.5, 2.0))
        return self.factor if sigma > ACTIVE_SET_SETTLED_SIGMA else self.factor**2


def chosen_start(problem: Mpcc, velocity_level_ratio: float) -> float:
    """Return a first sigma for a problem: the largest product G H at its start, within `FIRST_SIGMA_RANGE`.

    Products of the velocity level count by 1/ratio. So no pair is outside its first relaxation at the start, unless its
    product is above 10.
    """
    largest = 0.0
    for block in problem.blocks:
        _, _, G, H = block.evaluate(problem.start)
        scale = np.where(block.velocity_level, velocity_level_ratio, 1.0)[:, None]
        products = np.maximum(G, 0.0) * np.maximum(H, 0.0) / scale
        largest = max(largest, float(np.nan_to_num(products).max(initial=0.0)))
    return float(np.clip(largest, *FIRST_SIGMA_RANGE))
