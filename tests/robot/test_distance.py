"""Distances of spheres, capsules and boxes, and the capsules around other shapes, against coal."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import coal
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.robot.distance import distance_rows, placed
from fesd_robot.robot.model_file import Shape
from fesd_robot.robot.round_shapes import BoxShape, RoundShape, enclosing, simple_shape

SPHERE, CAPSULE, BOX = coal.Sphere(0.15), coal.Capsule(0.1, 0.6), coal.Box(0.3, 0.5, 0.2)
THIN = coal.Capsule(0.02, 0.4)
PAIRS = [(SPHERE, SPHERE), (SPHERE, CAPSULE), (CAPSULE, THIN), (CAPSULE, CAPSULE), (SPHERE, BOX), (BOX, SPHERE)]


def shape_of(geometry: object, placement: pin.SE3) -> Shape:
    """A collision shape of a body."""
    return Shape("shape", "body", placement, geometry, np.ones(4), True, False)


def closed_form(first: object, second: object, local: Sequence[pin.SE3]) -> ca.Function:
    """Rows of two shapes at places on frames, as a function of the poses of the frames."""
    symbols = [(ca.SX.sym("R", 3, 3), ca.SX.sym("p", 3)) for _ in range(2)]
    shapes = [simple_shape(shape_of(one, at)) for one, at in zip((first, second), local, strict=True)]
    sides = [placed(one, *pose) for one, pose in zip(shapes, symbols, strict=True) if one is not None]
    return ca.Function("rows", [part for pose in symbols for part in pose], [ca.vertcat(*distance_rows(*sides))])


def least(function: ca.Function, poses: Sequence[pin.SE3]) -> float:
    """The distance in closed form."""
    return float(function(*[part for pose in poses for part in (pose.rotation, pose.translation)]).full().min())


def by_coal(first: object, second: object, poses: Sequence[pin.SE3]) -> float:
    """The distance by coal."""
    places = [coal.Transform3s(pose.rotation, pose.translation) for pose in poses]
    return float(coal.distance(first, places[0], second, places[1], coal.DistanceRequest(), coal.DistanceResult()))


@pytest.mark.parametrize(("first", "second"), PAIRS, ids=lambda one: type(one).__name__)
def test_distances_are_those_of_coal(first: object, second: object) -> None:
    """On 400 random postures closed forms and coal agree to 1e-9 m wherever the shapes are apart."""
    pin.seed(3)
    local = [pin.SE3.Random() for _ in range(2)]
    function, compared = closed_form(first, second, local), 0
    for _ in range(400):
        frames = [pin.SE3.Random() for _ in range(2)]
        expected = by_coal(first, second, [frame * at for frame, at in zip(frames, local, strict=True)])
        found = least(function, frames)
        if expected > 1e-6:
            compared += 1
            assert found == pytest.approx(expected, abs=1e-9)
        else:
            assert found < 2e-6
    assert compared > 200


def test_parallel_and_crossing_capsules() -> None:
    """Capsules side by side, in one line, and across each other at a distance in the middle: the closed distances."""
    function = closed_form(CAPSULE, CAPSULE, [pin.SE3.Identity()] * 2)
    across = pin.SE3(pin.utils.rpyToMatrix(np.pi / 2, 0.0, 0.0), np.array([0.5, 0.0, 0.0]))
    for other, expected in (
        (pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.2])), 0.5 - 0.2),
        (pin.SE3(np.eye(3), np.array([0.0, 0.0, 1.0])), 0.4 - 0.2),
        (pin.SE3(np.eye(3), np.array([0.3, 0.0, 1.0])), 0.5 - 0.2),
        (across, 0.5 - 0.2),
    ):
        assert least(function, [pin.SE3.Identity(), other]) == pytest.approx(expected, abs=1e-9)


def test_derivatives_of_a_distance_are_those_of_its_direction() -> None:
    """The gradient with respect to a shape's place is the unit vector from one nearest point to the other."""
    function = closed_form(SPHERE, CAPSULE, [pin.SE3.Identity()] * 2)
    pin.seed(8)
    p = ca.SX.sym("p", 3)
    for _ in range(20):
        frame = pin.SE3.Random()
        row = function(np.eye(3), p, frame.rotation, frame.translation)
        gradient = ca.Function("gradient", [p], [ca.gradient(row, p)])
        far = frame.translation + 2 * pin.SE3.Random().translation
        assert np.linalg.norm(gradient(far).full()) == pytest.approx(1, abs=1e-9)


def mesh_of(points: np.ndarray) -> coal.BVHModelOBBRSS:
    """Triangles through points, three at a time."""
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(points) // 3, len(points))
    mesh.addVertices(points)
    mesh.addTriangles(np.arange(len(points)).reshape(-1, 3))
    mesh.endModel()
    return mesh


CLOUD = np.random.default_rng(4).normal(size=(90, 3)) * [0.1, 0.3, 0.05] + [1.0, 0.0, 2.0]
OTHERS = [coal.Box(0.3, 0.5, 0.2), coal.Cylinder(0.1, 0.7), coal.Cylinder(0.5, 0.1), coal.Cone(0.2, 0.5),
          coal.Ellipsoid(0.1, 0.3, 0.2), mesh_of(CLOUD)]  # fmt: skip


@pytest.mark.parametrize("geometry", OTHERS, ids=lambda one: type(one).__name__)
def test_what_encloses_contains_the_shape(geometry: object) -> None:
    """No plane cuts a shape outside the capsule around it, and the capsule touches the shape."""
    pin.seed(5)
    place = pin.SE3.Random()
    around = enclosing(shape_of(geometry, place))
    plane, widths = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), []
    for direction in np.random.default_rng(6).normal(size=(200, 3)):
        unit = direction / np.linalg.norm(direction)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), -unit).matrix()
        far = 100.0
        gap = by_coal(plane, geometry, [pin.SE3(turn, far * unit), place]) if not isinstance(
            geometry, coal.BVHModelBase
        ) else far - float(max((place.act(point) @ unit) for point in CLOUD))  # fmt: skip
        reach, limit = far - gap, float((around.ends @ unit).max() + around.radius)
        assert reach <= limit + 1e-7
        widths.append(limit - reach)
    assert min(widths) < 0.05


def test_spheres_around_a_capsule_contain_it() -> None:
    """Every point of a capsule is in one of its spheres, which are 5 % thicker; a sphere stays one."""
    capsule = simple_shape(shape_of(CAPSULE, pin.SE3.Random()))
    assert isinstance(capsule, RoundShape)
    spheres, rng = capsule.spheres(), np.random.default_rng(7)
    centers = np.array([one.ends[0] for one in spheres])
    assert all(one.radius == pytest.approx(1.05 * 0.1) and one.length == 0 for one in spheres)
    for part in rng.uniform(size=2000):
        off = rng.normal(size=3)
        point = capsule.ends[0] + part * (capsule.ends[1] - capsule.ends[0]) + 0.1 * off / np.linalg.norm(off)
        assert np.linalg.norm(centers - point, axis=1).min() <= 1.05 * 0.1 + 1e-12
    ball = simple_shape(shape_of(SPHERE, pin.SE3.Random()))
    assert isinstance(ball, RoundShape) and ball.spheres() == [ball]


def test_simple_shapes_are_spheres_capsules_and_boxes() -> None:
    """A cylinder has no closed form of its own."""
    kinds = [type(simple_shape(shape_of(one, pin.SE3.Identity()))) for one in (SPHERE, CAPSULE, BOX, OTHERS[1])]
    assert kinds == [RoundShape, RoundShape, BoxShape, type(None)]
