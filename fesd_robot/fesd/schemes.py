"""Coefficients of Runge-Kutta families for any number of stages, with the conditions that give their order.

Sources: Hairer & Wanner, Solving ODEs II, IV.5 (implicit families); Hairer, Norsett & Wanner, Solving ODEs I, II.1
(explicit schemes).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

from fesd_robot.ranges import MAX_STAGES

Scheme = Literal[
    "gauss_legendre",
    "radau_ia",
    "radau_iia",
    "lobatto_iiia",
    "lobatto_iiib",
    "lobatto_iiic",
    "explicit_euler",
    "heun_2",
    "heun_3",
    "runge_kutta_4",
]
Coefficients = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A, b and c."""


@dataclass(frozen=True)
class Family:
    """A family of Runge-Kutta schemes.

    With s stages the order is p = 2 s - order_loss, and C(s - stage_loss) and D(s - column_loss) hold. Explicit schemes
    have one number of stages s, order p = s, and no such assumptions.

    Attributes:
        coefficients: A, b, c for a number of stages.
        fewest, most: range of the number of stages.
        order_loss, stage_loss, column_loss: see above.
        explicit: whether each stage needs only those before it.
    """

    coefficients: Callable[[int], Coefficients]
    fewest: int
    most: int = MAX_STAGES
    order_loss: int = 0
    stage_loss: int = 0
    column_loss: int = 0
    explicit: bool = False

    def order(self, stages: int) -> int:
        """Return the classical order p."""
        return stages if self.explicit else 2 * stages - self.order_loss

    def assumptions(self, stages: int) -> tuple[int, int]:
        """Return (eta, zeta) such that C(eta) and D(zeta) hold."""
        return stages - self.stage_loss, stages - self.column_loss


def lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the values of the Lagrange basis, entry (i, r) = l_r(at_i)."""
    basis = np.ones((len(at), len(nodes)))
    for r, node in enumerate(nodes):
        for m, other in enumerate(nodes):
            if m != r:
                basis[:, r] *= (at - other) / (node - other)
    return basis


def lagrange_derivative(nodes: np.ndarray) -> np.ndarray:
    """Return the derivatives of the Lagrange basis at its own nodes, entry (j, r) = l_r'(nodes_j)."""
    difference = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(difference, 1.0)
    weight = 1.0 / difference.prod(axis=1)
    derivative = (weight[None, :] / weight[:, None]) / difference
    np.fill_diagonal(derivative, 0.0)
    np.fill_diagonal(derivative, -derivative.sum(axis=1))
    return derivative


def lagrange_integral(nodes: np.ndarray, to: np.ndarray) -> np.ndarray:
    """Return the integrals of the Lagrange basis, (i, r) = int_0^to_i l_r, by Gauss quadrature exact for it."""
    points, weights = _unit_gauss(len(nodes) + 1)
    return np.array([end * weights @ lagrange(nodes, end * points) for end in to]).reshape(len(to), len(nodes))


def _unit_gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the Gauss nodes and weights on [0, 1]."""
    points, weights = legendre.leggauss(count)
    return 0.5 * (1.0 + points), 0.5 * weights


def _gauss_nodes(stages: int) -> np.ndarray:
    """Return the zeros of the Legendre polynomial of degree s on [0, 1]."""
    return _unit_gauss(stages)[0]


def _radau_right_nodes(stages: int) -> np.ndarray:
    """Return the Radau nodes with c_s = 1; the others are zeros of the Jacobi polynomial P^(1, 0) of degree s - 1."""
    inner = np.empty(0) if stages == 1 else 0.5 * (1.0 + roots_jacobi(stages - 1, 1.0, 0.0)[0])
    return np.concatenate([inner, [1.0]])


def _radau_left_nodes(stages: int) -> np.ndarray:
    """Return the Radau nodes with c_1 = 0; the others are zeros of the Jacobi polynomial P^(0, 1) of degree s - 1."""
    inner = np.empty(0) if stages == 1 else 0.5 * (1.0 + roots_jacobi(stages - 1, 0.0, 1.0)[0])
    return np.concatenate([[0.0], inner])


def _lobatto_nodes(stages: int) -> np.ndarray:
    """Return the symmetric Lobatto nodes, c_1 = 0, c_s = 1; the others are zeros of P^(1, 1) of degree s - 2."""
    inner = np.empty(0) if stages == 2 else roots_jacobi(stages - 2, 1.0, 1.0)[0]
    return np.concatenate([[0.0], 0.5 + 0.25 * (inner - inner[::-1]), [1.0]])


def _collocation(c: np.ndarray) -> Coefficients:
    """Return the scheme with C(s): a_ij = int_0^c_i l_j, b_j = int_0^1 l_j."""
    return lagrange_integral(c, c), lagrange_integral(c, np.ones(1))[0], c


def _adjoint(c: np.ndarray) -> Coefficients:
    """Return the scheme with D(s): sum_i b_i c_i^(k-1) a_ij = b_j (1 - c_j^k) / k for k = 1..s.

    The condition is linear in the polynomial x^(k-1); for the Lagrange polynomial l_i it reads
    ``b_i a_ij = b_j int_c_j^1 l_i``, which needs no linear system.
    """
    points, weights = _unit_gauss(len(c) // 2 + 1)
    b = weights @ lagrange(c, points)
    remaining = np.array([(1.0 - left) * weights @ lagrange(c, left + (1.0 - left) * points) for left in c])
    return remaining.T * b[None, :] / b[:, None], b, c


def _lobatto_iiic(stages: int) -> Coefficients:
    """Return the scheme with a_i1 = b_1 and C(s - 1).

    For the Lagrange polynomials L_j on the nodes c_2..c_s, of degree s - 2, C(s - 1) reads
    ``b_1 L_j(0) + a_ij = int_0^c_i L_j``.
    """
    c = _lobatto_nodes(stages)
    b = lagrange_integral(c, np.ones(1))[0]
    A = np.full((stages, stages), b[0])
    A[:, 1:] = lagrange_integral(c[1:], c) - b[0] * lagrange(c[1:], np.zeros(1))
    A[-1] = b
    return A, b, c


def _given(rows: list[list[float]], b: list[float]) -> Coefficients:
    """Return an explicit scheme from the rows of A below the diagonal; its nodes are the row sums."""
    A = np.zeros((len(b), len(b)))
    for i, row in enumerate(rows, start=1):
        A[i, : len(row)] = row
    return A, np.array(b, dtype=float), A.sum(axis=1)


FAMILIES: dict[str, Family] = {
    "gauss_legendre": Family(lambda s: _collocation(_gauss_nodes(s)), 1),
    "radau_ia": Family(lambda s: _adjoint(_radau_left_nodes(s)), 1, order_loss=1, stage_loss=1),
    "radau_iia": Family(lambda s: _collocation(_radau_right_nodes(s)), 1, order_loss=1, column_loss=1),
    "lobatto_iiia": Family(lambda s: _collocation(_lobatto_nodes(s)), 2, order_loss=2, column_loss=2),
    "lobatto_iiib": Family(lambda s: _adjoint(_lobatto_nodes(s)), 2, order_loss=2, stage_loss=2),
    "lobatto_iiic": Family(_lobatto_iiic, 2, order_loss=2, stage_loss=1, column_loss=1),
    "explicit_euler": Family(lambda s: _given([], [1]), 1, 1, explicit=True),
    "heun_2": Family(lambda s: _given([[1]], [1 / 2, 1 / 2]), 2, 2, explicit=True),
    "heun_3": Family(lambda s: _given([[1 / 3], [0, 2 / 3]], [1 / 4, 0, 3 / 4]), 3, 3, explicit=True),
    "runge_kutta_4": Family(
        lambda s: _given([[1 / 2], [0, 1 / 2], [0, 0, 1]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]), 4, 4, explicit=True
    ),
}
"""Every family by its name."""
