"""Jumps of the state: what may happen between two finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.errors import DimensionError

IMPULSE_AT_A_DISTANCE = "impulse at a distance"
"""Kind of the condition that an impulse acts only where the G of its pair is zero."""

IMPACT_LAW = "impact law"
"""Kind of the two conditions that an impulse acts by its law; their subjects are `BELOW_LAW` and `ABOVE_LAW`."""

BELOW_LAW, ABOVE_LAW = "below", "above"


@dataclass(frozen=True, eq=False)
class Impulse:
    """An impulse that may act where the G of a pair is zero: ``G = 0`` and ``law = 0``, or ``size = 0``.

    Attributes:
        contact: name of the contact that it belongs to.
        pair: number of the pair of the system.
        size: SX scalar, a sum of entries of the jump's y, never negative.
        law: SX scalar in x, before the jump, and y.
        above_only: whether a law below zero, with the impulse or without, leads to G < 0 at once, which is excluded
            anyway: an inelastic impact. To hold it once more would keep a relaxed problem from ever going from no
            impulse, where the law is below zero, to one that fulfils it.
    """

    contact: str
    pair: int
    size: ca.SX
    law: ca.SX
    above_only: bool = False


@dataclass(frozen=True, eq=False)
class Jump:
    """A jump that the state may make at the left boundary of every finite element, x to x+, in no time.

    ``x+`` is x with the entries `states` replaced by `after`. With y = (after, algebraic) it obeys ``0 = r(x, y, p)``,
    the laws of its impulses, and further conditions.

    Args:
        states: numbers of the states that jump.
        after: SX symbols, their values afterwards.
        algebraic: SX symbols, as impulses.
        residual: r, SX.
        impulses: what makes the state jump, and where it may.
        conditions: vanishing constraints besides those of the impulses, their G a function of the state, taken at x+,
            their H a sum of entries of y.
        algebraic_names: one an entry.
        algebraic_lower: bounds of `algebraic`, zero if omitted.

    Raises:
        DimensionError: names, bounds or states of another number than the symbols.
    """

    states: tuple[int, ...]
    after: ca.SX
    algebraic: ca.SX
    residual: ca.SX
    impulses: tuple[Impulse, ...]
    algebraic_names: Sequence[str]
    conditions: tuple[Complementarity, ...] = ()
    algebraic_lower: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        n_after, n_algebraic = self.after.numel(), self.algebraic.numel()
        if not self.algebraic_lower.size:
            object.__setattr__(self, "algebraic_lower", np.zeros(n_algebraic))
        for what, found, expected in (
            ("states", len(self.states), n_after),
            ("algebraic_names", len(self.algebraic_names), n_algebraic),
            ("algebraic_lower", len(self.algebraic_lower), n_algebraic),
        ):
            if found != expected:
                raise DimensionError(f"jump: {what} has {found} entries, expected {expected}")

    @property
    def symbols(self) -> ca.SX:
        """y, SX (n_y)."""
        return ca.vertcat(self.after, self.algebraic)

    @property
    def size(self) -> int:
        """Number n_y."""
        return int(self.after.numel() + self.algebraic.numel())

    @cached_property
    def is_square(self) -> bool:
        """Whether every entry of y follows from x once it is known which impulses act."""
        return not self.conditions and bool(self.residual.numel() + len(self.impulses) == self.size)

    def complementarities(self, pairs: Sequence[Complementarity]) -> list[Complementarity]:
        """Return all conditions, G in x, y and the algebraic variables z of the boundary, or in x+, H in y.

        An impulse acts only at a distance of zero, ``G H = 0`` for the G of its pair, and by its law,
        ``max(-law, 0) H = 0`` and ``max(law, 0) H = 0``; the former is left out where it repeats others.

        Args:
            pairs: of the system.

        Source: Nurkanovic et al., arXiv 2305.17003, the impulse equations.
        """
        conditions = []
        for impulse in self.impulses:
            at_a_distance = Label(IMPULSE_AT_A_DISTANCE, contact=impulse.contact)
            conditions.append(Complementarity(at_a_distance, pairs[impulse.pair].G, impulse.size))
            for subject, sign in ((BELOW_LAW, -1), (ABOVE_LAW, 1))[impulse.above_only :]:
                label = Label(IMPACT_LAW, subject, impulse.contact)
                conditions.append(
                    Complementarity(label, sign * impulse.law, impulse.size, vanishing=True, level="velocity")
                )
        return [*conditions, *self.conditions]

    def left_state(self, state: ca.SX, values: ca.SX) -> ca.SX:
        """Return x+ for given x and y.

        Args:
            state: x, (n_x).
            values: y, (n_y).
        """
        after = ca.SX(state)
        after[list(self.states)] = values[: len(self.states)]
        return after
