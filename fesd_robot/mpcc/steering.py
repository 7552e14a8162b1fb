"""Where a relaxed NLP's sigma comes from: given from outside, or slack variables that a penalty drives to zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np

from fesd_robot.errors import ModelError, OptionError, nearest
from fesd_robot.mpcc.problem import BlockEquations, Mpcc
from fesd_robot.mpcc.relaxations import RELAXATIONS, Relaxation

Steering = Literal["direct", "l1", "linf"]
"""How sigma goes to zero.

- direct: it is a parameter.
- l1: every pair has a slack variable s_i in its place and the cost gets sum_i rho_i s_i.
- linf: all pairs share one slack variable s and the cost gets rho s.

rho = 1/sigma grows from NLP to NLP. For pairs of the velocity level it is 1/sigma of that level (l1), or
their part of s is larger by the ratio of both sigmas (linf). A relaxation that is smooth in the root of sigma has the
root for s.
"""

STEERINGS: tuple[Steering, ...] = get_args(Steering)


@dataclass(frozen=True)
class Slacks:
    """The slack variables of an NLP; they follow the problem's own variables.

    Attributes:
        index: for each block, which slack each copy reads, integers of shape (n_s, K) counted from 0.
        levels: which sigma of each slack, 0 for the position level and 1 for the velocity level, shape (count,).
        power: s stands for sigma^(1/power).
    """

    index: Sequence[np.ndarray]
    levels: np.ndarray
    power: int

    @property
    def count(self) -> int:
        """Number of slack variables."""
        return len(self.levels)

    def upper(self, sigma_max: float, velocity_level_ratio: float) -> np.ndarray:
        """Return bounds 0 <= s <= upper: sigma_max, times the ratio at velocity level, to the relaxation's power."""
        return (sigma_max * np.where(self.levels == 1, velocity_level_ratio, 1.0)) ** (1 / self.power)

    def prices(self, sigma: ca.MX) -> ca.MX:
        """Return what one unit of each slack costs, rho = 1/sigma of its level, (count, 1)."""
        return 1 / sigma[self.levels.tolist()]


def check_steering(steering: str) -> None:
    """Refuse a name that is no steering.

    Raises:
        OptionError: the message has the nearest name.
    """
    if steering not in STEERINGS:
        raise OptionError(f"unknown steering '{steering}'{nearest(steering, STEERINGS)}")


def check_vanishing(problem: Mpcc, relaxation: Relaxation) -> None:
    """Refuse a relaxation that cannot hold the vanishing constraints of a problem.

    Raises:
        ModelError: there are such constraints; the message names one and the relaxations that can.
    """
    for block in problem.blocks:
        if block.vanishing.any() and block.copies and not relaxation.vanishing:
            valid = ", ".join(sorted(name for name, other in RELAXATIONS.items() if other.vanishing))
            label = block.complementarities[int(np.argmax(block.vanishing))].label
            raise ModelError(
                f"relaxation '{relaxation.name}' needs G >= 0 in every pair, but '{label}' of block "
                f"'{block.name}' is a vanishing constraint (valid: {valid})"
            )


def slacks_of(problem: Mpcc, steering: Steering, power: int) -> Slacks:
    """Return the slack variables that a steering adds to a problem; none if it is direct."""
    index, levels, count = [], [np.zeros(0, dtype=int)], 0
    shared = steering == "linf" and problem.pairs > 0
    for block in problem.blocks:
        pairs, copies = block.pairs, block.copies
        if steering == "l1":
            index.append(count + np.arange(pairs * copies).reshape((pairs, copies), order="F"))
            levels.append(np.tile(block.velocity_level.astype(int), copies))
            count += pairs * copies
        else:
            index.append(np.zeros((int(shared and pairs > 0), copies), dtype=int))
    if shared:
        levels.append(np.zeros(1, dtype=int))
    return Slacks(index, np.concatenate(levels), power)


def pair_parameters(
    block: BlockEquations, relaxation: Relaxation, steering: Steering, sigma: ca.SX, slack: ca.SX
) -> ca.SX:
    """Return what each pair of a block has in its relaxation in the place of sigma^(1/power).

    Args:
        sigma: of the position and the velocity level, (2, 1).
        slack: the block's own, (n_s, 1).
    """
    if steering == "l1":
        return slack
    if steering == "linf" and slack.numel():
        parts = ca.vertcat(1, relaxation.parameter(sigma[1] / sigma[0]))
        return slack * parts[block.velocity_level.astype(int).tolist()]
    return relaxation.parameter(sigma[block.velocity_level.astype(int).tolist()])
