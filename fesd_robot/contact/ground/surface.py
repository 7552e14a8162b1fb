"""The protocol of a surface that a contact may touch."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

LATERAL = np.array([0.0, 1.0, 0.0])
"""The tangent along which no surface varies: a second direction of slip in space."""


class Ground(Protocol):
    """A surface that does not vary along y: a function f(x, z), positive outside, zero on it, negative inside.

    On the surface the gradient of f is the unit normal n, so that forces along it are in N. Away from it f may be
    another function than the distance; `normal` is its gradient everywhere, so that df/dt = normal . velocity.
    Points are (x, y, z) of floats or of CasADi expressions; directions are a numpy array where they are numbers.
    """

    def distance(self, point: Any) -> Any:
        """Gap f of a point (x, y, z), m."""
        ...

    def normal(self, point: Any) -> Any:
        """Gradient of f, (3,); on the surface the unit normal, out of the ground."""
        ...

    def tangent(self, point: Any) -> Any:
        """Unit tangent (n_z, 0, -n_x) of the surface at the point's x, (3,): towards +x where the normal points up."""
        ...

    def heights(self) -> np.ndarray | None:
        """Points x, z of the surface, m, x increasing, (n, 2), level beyond both ends; None where it is a plane."""
        ...

    def raised(self, radius: float) -> Ground:
        """The surface on which the centre of a circle of this radius, m, lies while the circle touches.

        Raises:
            GroundError: the circle would touch at two points at once.
        """
        ...
