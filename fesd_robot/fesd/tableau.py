"""Runge-Kutta tableaus of collocation type, generated for any number of stages and checked when constructed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

Scheme = Literal["radau_iia", "gauss_legendre"]
MAX_STAGES = 9


@dataclass(frozen=True)
class Tableau:
    """A collocation Runge-Kutta scheme with its interpolation through the left end of the step.

    The collocation polynomial has the values X_0 at 0 and X_j at c_j, with
    ``sum_r derivative[j, r] X_r = h f(X_j)`` and ``X(1) = sum_r end[r] X_r``, r = 0..n_s.

    Attributes:
        scheme: name of the family.
        A, b, c: Butcher tableau, shapes (n_s, n_s), (n_s,), (n_s,).
        derivative: shape (n_s, n_s + 1).
        end: shape (n_s + 1,).
        order: classical order p of the scheme.

    Raises:
        ValueError: if row sums, B(p) or C(n_s) do not hold to 1e-11.

    Source: Hairer & Wanner, Solving ODEs II, IV.5 (simplifying assumptions B(p), C(q)).
    """

    scheme: str
    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    derivative: np.ndarray
    end: np.ndarray
    order: int

    def __post_init__(self) -> None:
        worst = max(self.order_defects().values())
        if worst > 1e-11:
            raise ValueError(
                f"tableau {self.scheme} with {self.stages} stages misses its order conditions by {worst:.1e}"
            )

    @property
    def stages(self) -> int:
        """Number of stages n_s."""
        return len(self.b)

    @property
    def ends_at_stage(self) -> bool:
        """Whether the last stage is the right end of the step (c_ns = 1)."""
        return abs(self.c[-1] - 1.0) < 1e-14

    def order_defects(self) -> dict[str, float]:
        """Return the worst defect of the row sums, of B(p): sum b c^(k-1) = 1/k, of C(n_s): A c^(k-1) = c^k/k."""
        row = float(np.abs(self.A.sum(axis=1) - self.c).max())
        quadrature = max(abs(self.b @ self.c ** (k - 1) - 1.0 / k) for k in range(1, self.order + 1))
        stage = max(float(np.abs(self.A @ self.c ** (k - 1) - self.c**k / k).max()) for k in range(1, self.stages + 1))
        return {"row sums": row, f"B({self.order})": float(quadrature), f"C({self.stages})": stage}

    def interpolate(self, values: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the collocation polynomial through `values`, (n_s + 1, n_x), at `fraction` of the step, (m, n_x)."""
        return _lagrange(np.concatenate([[0.0], self.c]), np.asarray(fraction, dtype=float)) @ values


def make_tableau(scheme: Scheme, stages: int) -> Tableau:
    """Return the tableau of a collocation scheme.

    Args:
        scheme: ``radau_iia`` (order 2 n_s - 1, last node 1) or ``gauss_legendre`` (order 2 n_s).
        stages: number of stages n_s, 1..9.

    Raises:
        ValueError: unknown scheme or number of stages out of range.
    """
    if not 1 <= stages <= MAX_STAGES:
        raise ValueError(f"stages must be between 1 and {MAX_STAGES}, found {stages}")
    if scheme == "gauss_legendre":
        c = 0.5 * (1.0 + legendre.leggauss(stages)[0])
        order = 2 * stages
    elif scheme == "radau_iia":
        inner = np.empty(0) if stages == 1 else 0.5 * (1.0 + roots_jacobi(stages - 1, 1.0, 0.0)[0])
        c = np.concatenate([inner, [1.0]])
        order = 2 * stages - 1
    else:
        raise ValueError(f"unknown scheme '{scheme}' (valid: gauss_legendre, radau_iia)")
    nodes, weights = legendre.leggauss(stages + 1)
    nodes, weights = 0.5 * (1.0 + nodes), 0.5 * weights
    A = np.array([ci * weights @ _lagrange(c, ci * nodes) for ci in c])
    b = weights @ _lagrange(c, nodes)
    with_left = np.concatenate([[0.0], c])
    return Tableau(
        scheme=scheme,
        A=A,
        b=b,
        c=c,
        derivative=_lagrange_derivative(with_left)[1:],
        end=_lagrange(with_left, np.array([1.0]))[0],
        order=order,
    )


def _lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values of the Lagrange basis, entry (i, r) = l_r(at_i)."""
    basis = np.ones((len(at), len(nodes)))
    for r, node in enumerate(nodes):
        for m, other in enumerate(nodes):
            if m != r:
                basis[:, r] *= (at - other) / (node - other)
    return basis


def _lagrange_derivative(nodes: np.ndarray) -> np.ndarray:
    """Derivatives of the Lagrange basis at its own nodes, entry (j, r) = l_r'(nodes_j)."""
    difference = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(difference, 1.0)
    weight = 1.0 / difference.prod(axis=1)
    derivative = (weight[None, :] / weight[:, None]) / difference
    np.fill_diagonal(derivative, 0.0)
    np.fill_diagonal(derivative, -derivative.sum(axis=1))
    return derivative
