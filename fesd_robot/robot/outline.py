"""Outlines of shapes in the x-z plane: the points and circles that can touch."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.exactness import ROUNDED
from fesd_robot.robot.model_file import Shape

_ALIGNED = 1e-6
"""Entry of a direction that counts as zero."""

_DIRECTIONS = np.radians(np.linspace(-75, 75, 61))
"""Tilts, rad, over which what a body touches first is looked for."""


_AZIMUTHS = 24
"""Sides to which a body tilts in space, and as many opposite ones."""

_DIGITS = 9
"""Of a place, m, by which places are put in order."""


class Outline(NamedTuple):
    """A circle in the x-z plane, or a point where its radius is zero.

    Attributes:
        place: of the centre, in the axes of the body's frame, m, (3).
        radius: m.
        friction: coefficient of the shape, None without one.
    """

    place: np.ndarray
    radius: float
    friction: float | None


def touching_outlines(
    shapes: Sequence[Shape], body: pin.SE3, towards: np.ndarray, *, in_space: bool = False
) -> list[Outline]:
    """Return the points and circles, in space balls, of a body that can touch a surface, from back to front.

    Those are what the body has furthest towards the surface while it tilts by up to 75 degrees to either side, in space
    to any side.

    Args:
        shapes: of the body.
        body: pose of its frame in the world.
        towards: direction from the body to the surface, in the x-z plane, (3).
        in_space: whether the body leaves the x-z plane or turns out of it.

    Raises:
        RobotError: a shape whose outline in the x-z plane is neither points nor circles, or in space neither points nor
            balls.
    """
    if in_space:
        return _touching_in_space(shapes, body, towards)
    outlines = [outline for shape in shapes for outline in _outlines(shape, body.rotation)]
    centers = np.array([body.act(outline.place)[[0, 2]] for outline in outlines]).reshape(-1, 2)
    radii = np.array([outline.radius for outline in outlines])
    angle = np.arctan2(towards[2], towards[0])
    chosen: set[int] = set()
    for turn in _DIRECTIONS:
        reach = centers @ [np.cos(angle + turn), np.sin(angle + turn)] + radii
        chosen |= set(np.flatnonzero(reach >= reach.max() - ROUNDED).tolist())
    along = centers @ [-np.sin(angle), np.cos(angle)]
    return [outlines[k] for k in _distinct(sorted(chosen, key=lambda k: along[k]), centers, radii)]


def _touching_in_space(shapes: Sequence[Shape], body: pin.SE3, towards: np.ndarray) -> list[Outline]:
    outlines = [outline for shape in shapes for outline in _outlines_in_space(shape)]
    centers = np.array([body.act(outline.place) for outline in outlines]).reshape(-1, 3)
    radii = np.array([outline.radius for outline in outlines])
    along = np.cross([0.0, 1.0, 0.0], -towards)
    along = along / np.linalg.norm(along) if np.linalg.norm(along) > _ALIGNED else np.array([1.0, 0.0, 0.0])
    across = np.cross(-towards, along)
    chosen: set[int] = set()
    for azimuth in np.linspace(0, np.pi, _AZIMUTHS, endpoint=False):
        aside = np.cos(azimuth) * along + np.sin(azimuth) * across
        for turn in _DIRECTIONS:
            reach = centers @ (np.cos(turn) * towards + np.sin(turn) * aside) + radii
            chosen |= set(np.flatnonzero(reach >= reach.max() - ROUNDED).tolist())
    order = sorted(chosen, key=lambda k: (round(float(centers[k] @ along), _DIGITS), float(centers[k] @ across)))
    return [outlines[k] for k in _distinct(order, centers, radii)]


def _outlines_in_space(shape: Shape) -> Iterator[Outline]:
    """Yield the corners of a box, the ball that a sphere is, and the two at the ends of a capsule."""
    geometry, place = shape.geometry, shape.placement
    if isinstance(geometry, coal.Sphere):
        yield Outline(place.translation, float(geometry.radius), shape.friction)
    elif isinstance(geometry, coal.Capsule):
        for end in (-1, 1):
            along = np.array([0.0, 0.0, end * float(geometry.halfLength)])
            yield Outline(place.act(along), float(geometry.radius), shape.friction)
    elif isinstance(geometry, coal.Box):
        half = np.array(geometry.halfSide, dtype=float).ravel()
        for corner in product((-1, 1), repeat=3):
            yield Outline(place.act(half * corner), 0.0, shape.friction)
    else:
        raise RobotError(
            f"found shape '{shape.name}' of body '{shape.body}', a {type(geometry).__name__.lower()}, expected a "
            "sphere, capsule or box in space; name the places that touch by 'frame' and 'offset'"
        )


def _distinct(order: Iterable[int], centers: np.ndarray, radii: np.ndarray) -> list[int]:
    kept: list[int] = []
    for k in order:
        if all(max(np.abs(centers[k] - centers[j]).max(), abs(radii[k] - radii[j])) > ROUNDED for j in kept):
            kept.append(k)
    return kept


def _outlines(shape: Shape, turn: np.ndarray) -> Iterator[Outline]:
    """Yield the outline of a shape on a body that is turned by a matrix, (3, 3)."""
    geometry, place = shape.geometry, shape.placement
    across = turn @ place.rotation  # columns: the shape's axes in the world
    sideways = np.abs(across[1])
    if isinstance(geometry, coal.Sphere):
        yield Outline(place.translation, float(geometry.radius), shape.friction)
    elif isinstance(geometry, coal.Capsule):
        half_length = float(geometry.halfLength)
        ends = (-half_length, half_length) if _in_plane(shape, across[:, 2]) else (0.0,)
        for end in ends:
            yield Outline(place.act(np.array([0.0, 0.0, end])), float(geometry.radius), shape.friction)
    elif isinstance(geometry, coal.Cylinder) and not _in_plane(shape, across[:, 2]):
        yield Outline(place.translation, float(geometry.radius), shape.friction)
    elif isinstance(geometry, coal.Cylinder):
        rim = np.cross(place.rotation[:, 2], turn.T @ [0.0, 1.0, 0.0])
        for side in (-1, 1):
            for end in (-1, 1):
                height = end * geometry.halfLength * place.rotation[:, 2]
                yield Outline(place.translation + height + side * geometry.radius * rim, 0.0, shape.friction)
    elif isinstance(geometry, coal.Box):
        axis = int(np.argmax(sideways))
        if 1 - sideways[axis] > _ALIGNED:
            raise _tilted(shape)
        half = np.array(geometry.halfSide, dtype=float).ravel()
        first, second = (k for k in range(3) if k != axis)
        for one in (-1, 1):
            for other in (-1, 1):
                corner = np.zeros(3)
                corner[first], corner[second] = one * half[first], other * half[second]
                yield Outline(place.act(corner), 0.0, shape.friction)
    else:
        raise RobotError(
            f"found shape '{shape.name}' of body '{shape.body}', a {type(geometry).__name__.lower()}, expected a "
            "sphere, capsule, cylinder or box; name the places that touch by 'frame' and 'offset'"
        )


def _in_plane(shape: Shape, axis: np.ndarray) -> bool:
    """Return whether an axis lies in the x-z plane; False if it is across."""
    if abs(axis[1]) <= _ALIGNED:
        return True
    if 1 - abs(axis[1]) > _ALIGNED:
        raise _tilted(shape)
    return False


def _tilted(shape: Shape) -> RobotError:
    return RobotError(
        f"found shape '{shape.name}' of body '{shape.body}' at a slant to the x-z plane, expected one along or "
        "across it; name the places that touch by 'frame' and 'offset'"
    )
