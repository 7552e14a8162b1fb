"""An NLP without the variables that its bounds fix, and without the rows that bound nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from fesd_robot.nlp.nlp import Nlp, NlpNumbers, NlpPoint

REMEMBERED = 6
"""Reduced NLPs that are kept for when they are needed again."""


@dataclass(frozen=True, eq=False)
class ReducedNlp:
    """An NLP without its fixed variables and free rows.

    On a branch most rows of a motion's NLP bound nothing, or lie outside of the window that is solved. IPOPT gives each
    of them a slack variable and a row of its linear systems all the same. The values of variables that are fixed are
    parameters, behind those of the whole: another start of a motion is the same NLP with other numbers.

    Attributes:
        nlp: in the free variables, with the rows that have a bound.
        free: which variables these are, (n,).
        bounded: which rows these are, (m,).
    """

    nlp: Nlp
    free: np.ndarray
    bounded: np.ndarray

    @classmethod
    def of(cls, nlp: Nlp, numbers: NlpNumbers) -> ReducedNlp:
        """Return the reduced NLP, made once for all numbers that fix the same variables and bound the same rows.

        Args:
            nlp: all of it.
            numbers: bounds that are equal fix a variable; a row without bounds is left out.
        """
        free = numbers.lower < numbers.upper
        bounded = np.isfinite(numbers.g_lower) | np.isfinite(numbers.g_upper)
        return _reduced(nlp, free.tobytes(), bounded.tobytes())

    def numbers(self, whole: NlpNumbers) -> NlpNumbers:
        """Return the reduced numbers of the whole."""
        free, bounded = self.free, self.bounded
        return NlpNumbers(
            whole.lower[free],
            whole.upper[free],
            whole.g_lower[bounded],
            whole.g_upper[bounded],
            np.concatenate([whole.p, whole.lower[~free]]),
        )

    def part(self, point: NlpPoint) -> NlpPoint:
        """Return the reduced point."""
        return NlpPoint(point.x[self.free], point.lam_x[self.free], point.lam_g[self.bounded])

    def whole(self, part: NlpPoint, point: NlpPoint) -> NlpPoint:
        """Return a point whose free variables and bounded rows are those of a part, the others those of another point;
        multipliers of what was left out are zero."""
        x, lam_x, lam_g = point.x.copy(), np.zeros(len(self.free)), np.zeros(len(self.bounded))
        x[self.free], lam_x[self.free], lam_g[self.bounded] = part.x, part.lam_x, part.lam_g
        return NlpPoint(x, lam_x, lam_g)


@lru_cache(maxsize=REMEMBERED)
def _reduced(nlp: Nlp, free_pattern: bytes, bounded_pattern: bytes) -> ReducedNlp:
    free, bounded = np.frombuffer(free_pattern, dtype=bool), np.frombuffer(bounded_pattern, dtype=bool)
    if free.all() and bounded.all():
        return ReducedNlp(nlp, free, bounded)
    columns, rows, fixed = (np.flatnonzero(one).tolist() for one in (free, bounded, ~free))
    part, both = ca.MX.sym("x", len(columns)), ca.MX.sym("p", nlp.parameters + len(fixed))
    p, values = both[: nlp.parameters], both[nlp.parameters :]
    weight, multiplier = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", len(rows))
    x = ca.mtimes(_placing(len(free), columns), part) + ca.mtimes(_placing(len(free), fixed), values)
    (f, g), (_, gradient), (_, jacobian) = (one(x, p) for one in (nlp.nlp, nlp.gradient, nlp.jacobian))
    hessian = nlp.hessian(x, p, weight, ca.densify(ca.mtimes(_placing(len(bounded), rows), multiplier)))
    arguments, names = [part, both], ["x", "p"]
    return ReducedNlp(
        Nlp(
            ca.Function("nlp", arguments, [f, g[rows]], names, ["f", "g"]),
            ca.Function("nlp_grad_f", arguments, [f, gradient[columns]], names, ["f", "grad_f_x"]),
            ca.Function("nlp_jac_g", arguments, [g[rows], jacobian[rows, columns]], names, ["g", "jac_g_x"]),
            ca.Function(
                "nlp_hess_l",
                [*arguments, weight, multiplier],
                [hessian[columns, columns]],
                [*names, "lam_f", "lam_g"],
                ["hess_gamma_x_x"],
            ),
        ),
        free,
        bounded,
    )


def _placing(size: int, places: list[int]) -> ca.DM:
    """Return the matrix that puts entries to their places, (size, len(places))."""
    columns = list(range(len(places)))
    return ca.DM(ca.Sparsity.triplet(size, len(places), places, columns), np.ones(len(places)))
