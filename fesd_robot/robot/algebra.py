"""Small matrix helpers on CasADi values that keep structural zeros and exact ones."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.errors import DimensionError
from fesd_robot.exactness import LAST_BITS


def clean(values: np.ndarray) -> ca.DM:
    """Return `values` as a sparse matrix whose entries within 1e-15 of 0 or ±1 are exactly that.

    Rounding is what makes an axis-aligned chain as cheap as one written by hand: CasADi drops a product with an exact
    zero and keeps no node for a product with an exact one.

    Args:
        values: a vector or a matrix; entries below 1e-15 times the largest one count as zero.
    """
    array = np.array(values, dtype=float)
    array[np.abs(array) <= LAST_BITS * max(1.0, np.abs(array).max(initial=0.0))] = 0.0
    for one in (1.0, -1.0):
        array[np.abs(array - one) <= LAST_BITS] = one
    return ca.sparsify(ca.DM(array))


def column(name: str, value: ca.SX, size: int) -> ca.SX:
    """Return `value` as an SX column of length `size`.

    Raises:
        DimensionError: if it has another shape.
    """
    expression = ca.SX(value)
    if expression.shape != (size, 1):
        raise DimensionError(f"{name} has shape {expression.shape}, expected ({size}, 1).")
    return expression


def cross(a: ca.SX, b: ca.SX) -> ca.SX:
    """Return a × b for two columns of length 3."""
    return ca.vertcat(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def cross_columns(a: ca.SX, matrix: ca.SX) -> ca.SX:
    """Return [a]× times a 3 × n matrix."""
    return ca.horzcat(*(cross(a, matrix[:, k]) for k in range(matrix.shape[1])))


def symmetric(xx: ca.SX, yy: ca.SX, zz: ca.SX, xy: ca.SX, xz: ca.SX, yz: ca.SX) -> ca.SX:
    """Return the symmetric 3 × 3 matrix with these entries, each mirrored pair sharing one node."""
    return ca.blockcat([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def rotate_symmetric(rotation: ca.SX, matrix: ca.SX) -> ca.SX:
    """Return R S Rᵀ for a symmetric S, computing each mirrored pair once."""
    half = rotation @ matrix

    def entry(i: int, j: int) -> ca.SX:
        return half[i, :] @ rotation[j, :].T

    return symmetric(entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2))
