"""A relaxation of complementarity pairs as a value: its formula, and what follows for signs and sigma."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class Relaxation:
    """Smooth rows r(G, H, sigma) <= 0, or = 0, that become 0 <= G, 0 <= H, G H = 0 as sigma vanishes.

    The scaling is such that G = H = sqrt(sigma) satisfies one of the rows with equality.

    Args:
        name: its key in `RELAXATIONS`.
        formula: (G, H, t) -> rows for t = sigma^(1/power); G, H, t of shape (n, 1), rows of shape (n k, 1).
        power: 1 where the rows are smooth in sigma itself, 2 where they are smooth in its root.
        equality: rows are held at 0 instead of below.
        signs: G, H >= 0 are held beside the rows.
        vanishing: the rows hold vanishing constraints: with H >= 0 alone they become G H <= 0 for G of any sign.
        bounds_product: the rows keep G H within sigma; otherwise only the smaller side is within sqrt(sigma).
    """

    name: str
    formula: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
    power: int = 1
    equality: bool = False
    signs: bool = True
    vanishing: bool = False
    bounds_product: bool = True

    def rows(self, G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
        """Return r(G, H, sigma) of shape (n k, 1) for n pairs with k rows each."""
        return self.formula(G, H, self.parameter(sigma))

    def parameter(self, sigma: ca.SX) -> ca.SX:
        """Return t = sigma^(1/power)."""
        return sigma if self.power == 1 else ca.sqrt(sigma)

    def last_sigma(self, tolerance: float) -> float:
        """Return the sigma that keeps G H within the tolerance.

        Where only the smaller side is within sqrt(sigma), the root is a tenth of the tolerance, which is enough for
        larger sides up to 10.
        """
        return tolerance if self.bounds_product else (0.1 * tolerance) ** 2
