"""Runge-Kutta tableaus of every family, generated for any number of stages and checked when constructed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import ModelError, OptionError, nearest
from fesd_robot.fesd.schemes import (
    FAMILIES,
    Family,
    Scheme,
    lagrange,
    lagrange_derivative,
    lagrange_integral,
)

__all__ = ["Scheme", "Tableau", "make_tableau"]

ORDER_DEFECT = 1e-11
"""Up to this defect a condition of a tableau holds."""


@dataclass(frozen=True, eq=False)
class Tableau:
    """A Runge-Kutta scheme: ``X_j = X_0 + h sum_r a_jr K_r``, ``X(1) = X_0 + h sum_r b_r K_r``, ``K_j = f(X_j)``.

    Attributes:
        scheme: name of the family.
        A, b, c: Butcher tableau, shapes (n_s, n_s), (n_s,), (n_s,).
        order: classical order p of the scheme.

    Raises:
        ModelError: if the order conditions of `order_defects` do not hold to 1e-11.

    Source: Hairer & Wanner, Solving ODEs II, IV.5 (simplifying assumptions B(p), C(eta), D(zeta)).
    """

    scheme: Scheme
    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    order: int

    def __post_init__(self) -> None:
        worst = max(self.order_defects().values())
        if not worst <= ORDER_DEFECT:
            raise ModelError(
                f"tableau {self.scheme} with {self.stages} stages misses its order conditions by {worst:.1e}"
            )

    @property
    def stages(self) -> int:
        """Number of stages n_s."""
        return len(self.b)

    @cached_property
    def explicit(self) -> bool:
        """Whether every stage needs only those before it: A is strictly lower triangular."""
        return not np.triu(self.A).any()

    @cached_property
    def ends_at_stage(self) -> bool:
        """Whether the last stage is the right end of the step: c_ns = 1 and b is the last row of A."""
        return bool(abs(self.c[-1] - 1.0) <= 1e-13 and np.abs(self.A[-1] - self.b).max() <= 1e-13)

    @cached_property
    def starts_at_stage(self) -> bool:
        """Whether the first stage is the left end of the step: c_1 = 0 and the first row of A is zero."""
        return bool(self.c[0] == 0.0 and not self.A[0].any())

    @cached_property
    def stage_order(self) -> int:
        """Largest q <= p with C(q); with 0 not even the row sums are the nodes, and X_j is no value at c_j."""
        holds = [self._stage_defect(k) <= ORDER_DEFECT for k in range(1, self.order + 1)]
        return holds.index(False) if False in holds else self.order

    @cached_property
    def collocation(self) -> bool:
        """Whether X_0 and the stages lie on one polynomial: C(n_s) with distinct nodes that are all above zero."""
        distinct = len(np.unique(self.c)) == self.stages
        return bool(distinct and self.c.min() > 0.0 and self.stage_order >= self.stages)

    @cached_property
    def derivative(self) -> Any:
        """D with ``sum_r D[j, r] X_r = h K_j``, r = 0..n_s, shape (n_s, n_s + 1); None without `collocation`."""
        return lagrange_derivative(self.nodes)[1:] if self.collocation else None

    @cached_property
    def end(self) -> Any:
        """e with ``X(1) = sum_r e[r] X_r``, r = 0..n_s, shape (n_s + 1,); None without `collocation`."""
        return lagrange(self.nodes, np.array([1.0]))[0] if self.collocation else None

    @property
    def nodes(self) -> np.ndarray:
        """The left end and the stages, (n_s + 1,)."""
        return np.concatenate([[0.0], self.c])

    def order_defects(self) -> dict[str, float]:
        """Return the worst defect of every set of conditions that together give order p.

        All schemes: ``B(p): sum_j b_j c_j^(k-1) = 1/k, k = 1..p``. Implicit ones, with p <= eta + zeta + 1 and
        p <= 2 eta + 2: ``C(eta): sum_j a_ij c_j^(k-1) = c_i^k / k, k = 1..eta``, which contains the row sums, and
        ``D(zeta): sum_i b_i c_i^(k-1) a_ij = b_j (1 - c_j^k) / k, k = 1..zeta``. Explicit ones: the row sums and the
        conditions of the rooted trees up to order 4 that B(p) leaves. Families with eta = 0 (Radau IA with one stage,
        Lobatto IIIB with two) have nodes that are not their row sums.

        Source: Hairer & Wanner, Solving ODEs II, IV.5, Theorem 5.1; Hairer, Norsett & Wanner, Solving ODEs I, II.2.
        """
        A, b, c, p = self.A, self.b, self.c, self.order
        family = _family(self.scheme)
        defects = {f"B({p})": max(float(abs(b @ c ** (k - 1) - 1.0 / k)) for k in range(1, p + 1))}
        if family.explicit:
            trees = {
                "sum_ij b_i a_ij c_j = 1/6": (3, b @ A @ c - 1 / 6),
                "sum_ij b_i c_i a_ij c_j = 1/8": (4, (b * c) @ A @ c - 1 / 8),
                "sum_ij b_i a_ij c_j^2 = 1/12": (4, b @ A @ c**2 - 1 / 12),
                "sum_ijk b_i a_ij a_jk c_k = 1/24": (4, b @ A @ A @ c - 1 / 24),
            }
            defects["row sums"] = self._stage_defect(1)
            return defects | {name: float(abs(defect)) for name, (order, defect) in trees.items() if order <= p}
        eta, zeta = family.assumptions(self.stages)
        if eta > 0:
            defects["row sums"] = self._stage_defect(1)
            defects[f"C({eta})"] = max(self._stage_defect(k) for k in range(1, eta + 1))
        if zeta > 0:
            defects[f"D({zeta})"] = max(self._column_defect(k) for k in range(1, zeta + 1))
        return defects

    def _stage_defect(self, k: int) -> float:
        return float(np.abs(self.A @ self.c ** (k - 1) - self.c**k / k).max())

    def _column_defect(self, k: int) -> float:
        return float(np.abs((self.b * self.c ** (k - 1)) @ self.A - self.b * (1.0 - self.c**k) / k).max())

    def continuous_weights(self, fraction: np.ndarray) -> np.ndarray:
        """Return the weights of the dense output ``X(tau) = X_0 + h sum_j b_j(tau) K_j``, (m, n_s).

        ``b_j(tau) = int_0^tau l_j`` with the Lagrange polynomials on the distinct nodes; slopes at one node share its
        weight in proportion to b. ``b_j(1) = b_j``, and for collocation schemes X is the collocation polynomial.

        Args:
            fraction: tau, 0 at the left and 1 at the right end of the step, (m,).

        Source: Hairer, Norsett & Wanner, Solving ODEs I, II.6.
        """
        distinct, node, count = np.unique(self.c, return_inverse=True, return_counts=True)
        total = np.bincount(node, weights=self.b)
        weightless = (total == 0.0)[node]
        share = np.where(weightless, 1.0 / count[node], self.b / np.where(weightless, 1.0, total[node]))
        return lagrange_integral(distinct, np.asarray(fraction, dtype=float))[:, node] * share

    def interpolate(self, values: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the collocation polynomial through `values`, (n_s + 1, n_x), at `fraction` of the step, (m, n_x).

        Raises:
            ModelError: a scheme without `collocation`.
        """
        if not self.collocation:
            raise ModelError(
                f"{self.scheme} is no collocation scheme with distinct nodes above zero: its states cannot be "
                "interpolated (use continuous_weights)"
            )
        return lagrange(self.nodes, np.asarray(fraction, dtype=float)) @ values


@checked
@cache
def make_tableau(scheme: Scheme, stages: int | None = None) -> Tableau:
    """Return the tableau of a scheme.

    Args:
        scheme: with n_s stages, ``gauss_legendre`` (order 2 n_s), ``radau_ia``, ``radau_iia`` (2 n_s - 1),
            ``lobatto_iiia``, ``lobatto_iiib``, ``lobatto_iiic`` (2 n_s - 2), ``explicit_euler`` (1), ``heun_2`` (2),
            ``heun_3`` (3), ``runge_kutta_4`` (4).
        stages: number of stages n_s, 1..9 (Lobatto 2..9); explicit schemes have one number only and may leave it out.

    Raises:
        OptionError: unknown scheme, or a number of stages that it does not have.
    """
    family = _family(scheme)
    if stages is None and family.fewest == family.most:
        stages = family.fewest
    if stages is None:
        raise OptionError(f"{scheme} needs a number of stages (valid: {family.fewest} to {family.most})")
    if not family.fewest <= stages <= family.most:
        if family.fewest == family.most:
            raise OptionError(f"{scheme} has {family.most} stage{'s' * (family.most > 1)}, found {stages}")
        raise OptionError(f"stages of {scheme} must be between {family.fewest} and {family.most}, found {stages}")
    A, b, c = family.coefficients(stages)
    return Tableau(scheme=scheme, A=A, b=b, c=c, order=family.order(stages))


def _family(scheme: str) -> Family:
    if scheme not in FAMILIES:
        suggestion, valid = nearest(scheme, FAMILIES), nearest("", FAMILIES)
        raise OptionError(f"unknown scheme '{scheme}'{suggestion}" + valid * (suggestion != valid))
    return FAMILIES[scheme]
