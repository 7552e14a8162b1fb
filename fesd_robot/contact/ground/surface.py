"""The protocols of a surface that a contact may touch, and of the ground among them."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import casadi as ca
import numpy as np

LATERAL = np.array([0.0, 1.0, 0.0])
"""The second tangent of every surface that does not vary along y."""

_FACING_DOWN = -0.5
"""z of a unit normal below which its tangents are turned from -z instead of +z."""


class Axes(NamedTuple):
    """Unit normal n and unit tangents t_1, t_2 = n x t_1 of a surface, (3) each, numbers or expressions."""

    normal: Any
    tangent: Any
    lateral: Any


class Surface(Protocol):
    """A surface in space: a function f(x, y, z), positive outside, zero on it, negative inside.

    On the surface the gradient of f is the unit normal n, so that forces along it are in N. Away from it f may be
    another function than the distance; `normal` is its gradient everywhere, so that df/dt = normal . velocity.
    Points are (x, y, z) of floats or of CasADi expressions; directions are a numpy array where they are numbers.

    Attributes:
        varies_across: whether the surface varies along y; contacts in the x-z plane need one that does not.
    """

    @property
    def varies_across(self) -> bool:
        """Whether the surface varies along y."""
        ...

    def distance(self, point: Any) -> Any:
        """Return the gap f of a point (x, y, z), m."""
        ...

    def normal(self, point: Any) -> Any:
        """Return the gradient of f, (3,); on the surface the unit normal, out of the ground."""
        ...

    def axes(self, point: Any) -> Axes:
        """Return the unit normal at or below the point, and its tangents: +x and +y where the normal points up.

        Where the surface does not vary along y they are (n_z, 0, -n_x) and +y, else those of `turned_axes`.
        """
        ...

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of many points, (3, n), m, (n): near the surface that of the tangent plane."""
        ...

    def raised(self, radius: float) -> Surface:
        """Return the surface on which the centre of a circle or ball of this radius, m, lies while it touches.

        Raises:
            GroundError: it would touch at two points at once.
        """
        ...


class Ground(Surface, Protocol):
    """A surface z = h(x, y) below the robot: heights by which it is drawn, and words in which it is described."""

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return h at many places, m, in the shape of x and y, m."""
        ...

    def bends(self, low: float, high: float) -> np.ndarray:
        """Return x between low and high, m, (n), increasing, such that straight lines from one to the next, from low to
        high and at y = 0, are the ground to the eye; none where it is straight.
        """
        ...

    def heights_in_words(self) -> str:
        """Return a sentence about heights that its section of the task does not give, empty if there are none."""
        ...


def turned_axes(normal: Any) -> Axes:
    """Return the axes into which the shortest turn that takes +z to a unit normal takes x, y and z.

    t_1 = (1 - s n_x^2 a, -s n_x n_y a, -s n_x) and t_2 = (-n_x n_y a, s - n_y^2 a, -n_y), a = 1 / (s + n_z), s = 1.
    For n_y = 0 these are (n_z, 0, -n_x) and +y. No tangents of a closed surface are smooth all over it; these jump
    where the normal points down by 30 degrees, below which s = -1.

    Args:
        normal: n, (3), numbers or expressions.

    Source: Duff et al., Building an Orthonormal Basis, Revisited, J. Comput. Graph. Tech. 6 (2017).
    """
    n_x, n_y, n_z = normal[0], normal[1], normal[2]
    sign = 2.0 * (n_z >= _FACING_DOWN) - 1.0
    share = 1.0 / (sign + n_z)
    tangent = [1.0 - sign * n_x * n_x * share, -sign * n_x * n_y * share, -sign * n_x]
    lateral = [-n_x * n_y * share, sign - n_y * n_y * share, -n_y]
    if isinstance(normal, ca.SX):
        return Axes(normal, ca.vertcat(*tangent), ca.vertcat(*lateral))
    return Axes(np.asarray(normal, dtype=float), np.array(tangent), np.array(lateral))


def upright_axes(tangent: Any) -> Axes:
    """Return the axes of a surface that does not vary along y.

    Args:
        tangent: t_1 = (n_z, 0, -n_x), (3), numbers or expressions.
    """
    if isinstance(tangent, ca.SX):
        return Axes(ca.vertcat(-tangent[2], ca.SX(1, 1), tangent[0]), tangent, LATERAL)
    return Axes(np.array([-tangent[2], 0.0, tangent[0]]), tangent, LATERAL)
