"""From one sigma to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fesd_robot.errors import OptionError, nearest
from fesd_robot.mpcc.problem import Mpcc

Rule = Literal["linear", "superlinear", "adaptive"]
"""How sigma shrinks from NLP to NLP.

- linear: times the factor; times its square once sigma of rank 1 is at most `SETTLED`.
- superlinear: min(factor sigma, sigma^power); both ranks shrink by the factor that this gives for rank 1.
- adaptive: times factor^e with e = `USUAL` / iterations of the last NLP, within 1/2 and 2.
"""

RULES: tuple[Rule, ...] = get_args(Rule)

SETTLED = 5e-3
"""Below this sigma of rank 1 the active set hardly changes: NLPs start warm, sigma falls by its factor squared."""

USUAL = 50
"""Iterations of an NLP after which the adaptive schedule keeps the factor as it is."""

START_RANGE = (0.1, 10.0)
"""Where a first sigma that is chosen from the problem lies; far smaller ones lose a third of the published problems."""

Sigmas = tuple[float, float]
"""Sigma for pairs of rank 0 and 1."""


def check_rule(rule: str) -> None:
    """Refuse a name that is no schedule.

    Raises:
        OptionError: the message has the nearest name.
    """
    if rule not in RULES:
        raise OptionError(f"unknown schedule '{rule}'{nearest(rule, RULES)}")


@dataclass(frozen=True)
class Schedule:
    """A sequence of sigmas from the first to the last.

    Args:
        rule: how they shrink.
        first: sigma of rank 0 in the first NLP.
        last: sigma of both ranks in the last NLP.
        factor, power: of the rule.
        ratio: how much larger sigma of rank 1 is until rank 0 has reached the last.
    """

    rule: Rule
    first: float
    last: float
    factor: float
    power: float
    ratio: float

    def start(self) -> Sigmas:
        """The first sigmas."""
        return self.first, self.first * self.ratio

    def is_last(self, sigmas: Sigmas) -> bool:
        """Whether no smaller sigmas follow."""
        return max(sigmas) <= self.last

    def after(self, sigmas: Sigmas, iterations: int) -> Sigmas:
        """Return the sigmas of the next NLP; `iterations` are those of the one before."""
        factor = self._factor(sigmas[1], iterations)
        smaller = [value * factor for value in sigmas]
        first, second = (self.last if value < 1.0001 * self.last else value for value in smaller)
        return first, second

    def _factor(self, sigma: float, iterations: int) -> float:
        if self.rule == "superlinear":
            return min(self.factor, sigma ** (self.power - 1))
        if self.rule == "adaptive":
            return float(self.factor ** np.clip(USUAL / max(iterations, 1), 0.5, 2.0))
        return self.factor if sigma > SETTLED else self.factor**2


def chosen_start(problem: Mpcc, ratio: float) -> float:
    """Return a first sigma chosen from the problem: the largest product G H at its start point, within `START_RANGE`.

    Products of rank 1 count by 1/ratio. So no pair is outside its first relaxation at the start, unless its product is
    above 10.
    """
    largest = 0.0
    for block in problem.blocks:
        _, _, G, H = block.evaluate(problem.start)
        scale = np.where(block.pair_ranks == 1, ratio, 1.0)[:, None]
        products = np.maximum(G, 0.0) * np.maximum(H, 0.0) / scale
        largest = max(largest, float(np.nan_to_num(products).max(initial=0.0)))
    return float(np.clip(largest, *START_RANGE))
