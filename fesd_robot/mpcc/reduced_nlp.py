"""An NLP without the variables that its bounds fix, and without the rows that bound nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.mpcc.assembly import RelaxedNlp
from fesd_robot.mpcc.ipopt import NlpPoint


@dataclass(frozen=True)
class ReducedNlp:
    """What is left of an NLP.

    On a branch most rows of a motion's NLP bound nothing, or lie outside of the window that is solved. IPOPT gives each
    of them a slack variable and a row of its linear systems all the same.

    Attributes:
        nlp: in the free variables, with the rows that have a bound.
        free: which variables these are, (n,).
        bounded: which rows these are, (m,).
    """

    nlp: RelaxedNlp
    free: np.ndarray
    bounded: np.ndarray

    @classmethod
    def of(cls, nlp: RelaxedNlp, lower: np.ndarray, upper: np.ndarray) -> ReducedNlp:
        """Return the reduced NLP.

        Args:
            nlp: all of it; the bounds of its rows say which are kept.
            lower, upper: bounds of its variables, (n,); equal ones fix a variable.
        """
        free, bounded = lower < upper, np.isfinite(nlp.lower) | np.isfinite(nlp.upper)
        if free.all() and bounded.all():
            return cls(nlp, free, bounded)
        columns, rows = np.flatnonzero(free).tolist(), np.flatnonzero(bounded).tolist()
        part, sigma = ca.MX.sym("x", len(columns)), ca.MX.sym("p", 2)
        weight, multiplier = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", len(rows))
        x = ca.DM(np.where(free, 0.0, lower)) + ca.mtimes(_placing(len(free), columns), part)
        (f, g), (_, gradient), (_, jacobian) = (one(x, sigma) for one in (nlp.nlp, nlp.gradient, nlp.jacobian))
        hessian = nlp.hessian(x, sigma, weight, ca.densify(ca.mtimes(_placing(len(bounded), rows), multiplier)))
        arguments, names = [part, sigma], ["x", "p"]
        return cls(
            replace(
                nlp,
                nlp=ca.Function("nlp", arguments, [f, g[rows]], names, ["f", "g"]),
                gradient=ca.Function("nlp_grad_f", arguments, [f, gradient[columns]], names, ["f", "grad_f_x"]),
                jacobian=ca.Function(
                    "nlp_jac_g", arguments, [g[rows], jacobian[rows, columns]], names, ["g", "jac_g_x"]
                ),
                hessian=ca.Function(
                    "nlp_hess_l",
                    [*arguments, weight, multiplier],
                    [hessian[columns, columns]],
                    [*names, "lam_f", "lam_g"],
                    ["hess_gamma_x_x"],
                ),
                lower=nlp.lower[rows],
                upper=nlp.upper[rows],
            ),
            free,
            bounded,
        )

    def part(self, point: NlpPoint) -> NlpPoint:
        """Return what is left of a point."""
        return NlpPoint(point.x[self.free], point.lam_x[self.free], point.lam_g[self.bounded])

    def whole(self, part: NlpPoint, point: NlpPoint) -> NlpPoint:
        """Return a point whose free variables and bounded rows are those of a part, the others those of another point;
        multipliers of what was left out are zero."""
        x, lam_x, lam_g = point.x.copy(), np.zeros(len(self.free)), np.zeros(len(self.bounded))
        x[self.free], lam_x[self.free], lam_g[self.bounded] = part.x, part.lam_x, part.lam_g
        return NlpPoint(x, lam_x, lam_g)


def _placing(size: int, places: list[int]) -> ca.DM:
    """Return the matrix that puts entries to their places, (size, len(places))."""
    columns = list(range(len(places)))
    return ca.DM(ca.Sparsity.triplet(size, len(places), places, columns), np.ones(len(places)))
