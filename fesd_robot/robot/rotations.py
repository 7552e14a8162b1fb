"""Exponentials and logarithms of rotations and rigid motions, smooth at and around zero.

Every scalar function below is an even function of the angle θ and is written in s = θ². For s < 1 its power series is
used, so that neither the value nor any derivative divides by zero or cancels; both branches get an argument at which
they are finite, so that no derivative is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from fesd_robot.robot.algebra import cross

_TERMS = 11
_SINC = [(-1) ** k / math.factorial(2 * k + 1) for k in range(_TERMS)]
_COS = [(-1) ** k / math.factorial(2 * k) for k in range(_TERMS)]
_ONE_MINUS_COS = [(-1) ** k / math.factorial(2 * k + 2) for k in range(_TERMS)]
_MINUS_SIN = [(-1) ** k / math.factorial(2 * k + 3) for k in range(_TERMS)]
_BERNOULLI = [1 / 6, 1 / 30, 1 / 42, 1 / 30, 5 / 66, 691 / 2730, 7 / 6, 3617 / 510, 43867 / 798, 174611 / 330]
_HALF_COTANGENT = [b / math.factorial(2 * k + 2) for k, b in enumerate(_BERNOULLI)]
_ARCTANGENT = [(-1) ** k / (2 * k + 1) for k in range(10)]


def _horner(s: ca.SX, coefficients: Sequence[float]) -> ca.SX:
    value = ca.SX(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = coefficient + s * value
    return value


def _even(s: ca.SX, coefficients: Sequence[float], closed: Callable[[ca.SX], ca.SX]) -> ca.SX:
    """Return Σ c_k s^k for s < 1 and closed(√s) elsewhere."""
    small = s < 1
    series = _horner(ca.if_else(small, s, 0), coefficients)
    return ca.if_else(small, series, closed(ca.sqrt(ca.if_else(small, 1, s))))


def sinc(s: ca.SX) -> ca.SX:
    """Return sin θ / θ with s = θ²."""
    return _even(s, _SINC, lambda angle: ca.sin(angle) / angle)


def cosine(s: ca.SX) -> ca.SX:
    """Return cos θ with s = θ²."""
    return _even(s, _COS, ca.cos)


def one_minus_cosine(s: ca.SX) -> ca.SX:
    """Return (1 − cos θ) / θ² with s = θ²."""
    return _even(s, _ONE_MINUS_COS, lambda angle: (1 - ca.cos(angle)) / (angle * angle))


def angle_minus_sine(s: ca.SX) -> ca.SX:
    """Return (θ − sin θ) / θ³ with s = θ²."""
    return _even(s, _MINUS_SIN, lambda angle: (angle - ca.sin(angle)) / (angle * angle * angle))


def half_cotangent(s: ca.SX) -> ca.SX:
    """Return (1 − (θ/2) cot(θ/2)) / θ² with s = θ², θ < 2π."""

    def closed(angle: ca.SX) -> ca.SX:
        return (1 - angle / 2 * ca.cos(angle / 2) / ca.sin(angle / 2)) / (angle * angle)

    return _even(s, _HALF_COTANGENT, closed)


def quaternion_matrix(quaternion: ca.SX) -> ca.SX:
    """Return the rotation matrix of the direction of a quaternion (x, y, z, w); its length does not matter.

    So what an integration scheme lets the length drift by has no effect.
    """
    x, y, z, w = ca.vertsplit(quaternion)
    twice = 2 / ca.dot(quaternion, quaternion)
    x2, y2, z2 = twice * x, twice * y, twice * z
    xx, yy, zz = x2 * x, y2 * y, z2 * z
    xy, xz, yz = x2 * y, x2 * z, y2 * z
    wx, wy, wz = x2 * w, y2 * w, z2 * w
    return ca.blockcat(
        [[1 - (yy + zz), xy - wz, xz + wy], [xy + wz, 1 - (xx + zz), yz - wx], [xz - wy, yz + wx, 1 - (xx + yy)]]
    )


def quaternion_product(a: ca.SX, b: ca.SX) -> ca.SX:
    """Return a ⊗ b, both ordered (x, y, z, w)."""
    return ca.vertcat(a[3] * b[:3] + b[3] * a[:3] + cross(a[:3], b[:3]), a[3] * b[3] - ca.dot(a[:3], b[:3]))


def quaternion_conjugate(a: ca.SX) -> ca.SX:
    """Return the inverse of a unit quaternion (x, y, z, w)."""
    return ca.vertcat(-a[:3], a[3])


def quaternion_exponential(rotation: ca.SX) -> ca.SX:
    """Return the unit quaternion (x, y, z, w) of a rotation vector, rad."""
    quarter = ca.dot(rotation, rotation) / 4
    return ca.vertcat(sinc(quarter) / 2 * rotation, cosine(quarter))


def quaternion_logarithm(quaternion: ca.SX) -> ca.SX:
    """Return the rotation vector of a quaternion (x, y, z, w), rad, the short way round: 2 atan2(|u|, w) u / |u|."""
    flip = ca.if_else(quaternion[3] < 0, -1, 1)
    vector, scalar = flip * quaternion[:3], flip * quaternion[3]
    squared = ca.dot(vector, vector)
    small = squared < 0.01 * scalar * scalar
    safe_scalar = ca.if_else(small, scalar, 1)
    series = _horner(ca.if_else(small, squared, 0) / (safe_scalar * safe_scalar), _ARCTANGENT) / safe_scalar
    norm = ca.sqrt(ca.if_else(small, 1, squared))
    return 2 * ca.if_else(small, series, ca.atan2(norm, scalar) / norm) * vector


def rigid_exponential_translation(linear: ca.SX, rotation: ca.SX) -> ca.SX:
    """Return the translation of exp(linear, rotation) in SE(3): V(ω) v."""
    squared = ca.dot(rotation, rotation)
    once = cross(rotation, linear)
    return linear + one_minus_cosine(squared) * once + angle_minus_sine(squared) * cross(rotation, once)


def rigid_logarithm_translation(translation: ca.SX, rotation: ca.SX) -> ca.SX:
    """Return the linear part of the logarithm in SE(3): V(ω)⁻¹ t."""
    once = cross(rotation, translation)
    return translation - once / 2 + half_cotangent(ca.dot(rotation, rotation)) * cross(rotation, once)


def planar_matrix(direction: ca.SX) -> ca.SX:
    """Return the 2 × 2 rotation of a unit vector (cos θ, sin θ)."""
    cos, sin = direction[0], direction[1]
    return ca.blockcat([[cos, -sin], [sin, cos]])


def planar_exponential_translation(linear: ca.SX, angle: ca.SX) -> ca.SX:
    """Return the translation of exp(linear, angle) in SE(2)."""
    squared = angle * angle
    along, across = sinc(squared), angle * one_minus_cosine(squared)
    return ca.vertcat(along * linear[0] - across * linear[1], across * linear[0] + along * linear[1])


def planar_logarithm_translation(translation: ca.SX, angle: ca.SX) -> ca.SX:
    """Return the linear part of the logarithm in SE(2)."""
    squared = angle * angle
    along, across = 1 - squared * half_cotangent(squared), angle / 2
    return ca.vertcat(
        along * translation[0] + across * translation[1], along * translation[1] - across * translation[0]
    )


def continuous_quaternions(quaternion: np.ndarray) -> np.ndarray:
    """Return the same rotations with every quaternion on the side of its predecessor, shape (k, 4)."""
    flips = np.where(np.einsum("ij,ij->i", quaternion[1:], quaternion[:-1]) < 0.0, -1.0, 1.0)
    return np.asarray(quaternion * np.concatenate([[1.0], np.cumprod(flips)])[:, None])
