"""Distances between spheres, capsules and boxes as CasADi expressions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

from fesd_robot.exactness import NO_LENGTH
from fesd_robot.robot.algebra import clean
from fesd_robot.robot.round_shapes import BoxShape, SimpleShape

PARALLEL = 1e-9
"""Square of the sine of an angle below which two directions count as parallel."""


class Segment(NamedTuple):
    """A round shape in the world.

    Attributes:
        start: of the segment, SX (3).
        direction: unit vector along it, SX (3), or None for a sphere.
        length: m.
        radius: m.
    """

    start: ca.SX
    direction: ca.SX | None
    length: float
    radius: float


class OrientedBox(NamedTuple):
    """A box in the world.

    Attributes:
        center: SX (3).
        axes: its axes as columns, SX (3, 3).
        half: half the lengths of its edges, m, (3).
    """

    center: ca.SX
    axes: ca.SX
    half: list[float]


Placed = Segment | OrientedBox


def placed(shape: SimpleShape, rotation: ca.SX, position: ca.SX) -> Placed:
    """Return a shape on a frame in the world.

    Args:
        shape: in the axes of the frame.
        rotation, position: of the frame, SX (3, 3) and (3).
    """
    if isinstance(shape, BoxShape):
        center = position + rotation @ clean(shape.placement.translation)
        return OrientedBox(
            ca.densify(center), ca.densify(rotation @ clean(shape.placement.rotation)), shape.half.tolist()
        )
    start, length = ca.densify(position + rotation @ clean(shape.ends[0])), shape.length
    direction = ca.densify(rotation @ clean((shape.ends[1] - shape.ends[0]) / length)) if length else None
    return Segment(start, direction, length, shape.radius)


def distance_rows(first: Placed, second: Placed) -> Iterator[ca.SX]:
    """Yield expressions, m; the least is the distance between two shapes where they do not overlap.

    Two spheres: |c_1 - c_2| - r_1 - r_2. A sphere and a capsule: the distance of the centre from the segment, whose
    nearest point is at s = min(max(t . (c - a), 0), l), less the radii. A sphere and a box: |max(|x| - h, 0)| +
    min(max_i(|x_i| - h_i), 0) - r with the centre x in the axes of the box. Two capsules: the least of the distances of
    every end from the other segment, and of the points that are nearest on both lines, each moved onto its segment.
    Every expression has continuous derivatives where the shapes do not overlap, the last one where the segments are not
    parallel, and is never less than the distance.

    Args:
        first, second: not two boxes, and not a box and a capsule.

    Source: Ericson, Real-Time Collision Detection (2005), sections 5.1.2, 5.1.3 and 5.1.9.
    """
    if isinstance(first, OrientedBox):
        first, second = second, first
    assert isinstance(first, Segment)
    if isinstance(second, OrientedBox):
        assert first.direction is None
        yield _to_box(first.start, second) - first.radius
        return
    radii = first.radius + second.radius
    ends = [(end, second) for end in _ends(first)]
    if first.direction is not None:
        ends = [*(ends if second.direction is not None else []), *((end, first) for end in _ends(second))]
    for end, segment in ends:
        yield _to_segment(end, segment) - radii
    if first.direction is not None and second.direction is not None:
        yield _between_lines(first, second) - radii


def _ends(segment: Segment) -> list[ca.SX]:
    if segment.direction is None:
        return [segment.start]
    return [segment.start, segment.start + segment.length * segment.direction]


def _to_segment(point: ca.SX, segment: Segment) -> ca.SX:
    offset = point - segment.start
    if segment.direction is not None:
        offset = offset - _within(ca.dot(segment.direction, offset), segment.length) * segment.direction
    return ca.sqrt(ca.sumsqr(offset) + NO_LENGTH**2)


def _between_lines(first: Segment, second: Segment) -> ca.SX:
    """Return the distance of the points at s = (b e - d) / (1 - b^2) and t = (e - b d) / (1 - b^2).

    b = u . v, d = u . w, e = v . w with the directions u and v, and w from the second start to the first.
    """
    u, v, w = first.direction, second.direction, first.start - second.start
    assert u is not None and v is not None
    b, d, e = ca.dot(u, v), ca.dot(u, w), ca.dot(v, w)
    sine = ca.fmax(1 - b**2, PARALLEL)
    s, t = _within((b * e - d) / sine, first.length), _within((e - b * d) / sine, second.length)
    return ca.sqrt(ca.sumsqr(w + s * u - t * v) + NO_LENGTH**2)


def _to_box(point: ca.SX, box: OrientedBox) -> ca.SX:
    outside = ca.fabs(box.axes.T @ (point - box.center)) - ca.DM(box.half)
    inside = ca.fmin(ca.fmax(ca.fmax(outside[0], outside[1]), outside[2]), 0)
    return ca.sqrt(ca.sumsqr(ca.fmax(outside, 0)) + NO_LENGTH**2) + inside


def _within(value: ca.SX, length: float) -> ca.SX:
    return ca.fmin(ca.fmax(value, 0), length)
