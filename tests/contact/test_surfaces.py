"""Surfaces that vary along y: gap, gradient and axes say the same, in numbers and in expressions, and are true."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import coal
import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from fesd_robot.contact import Plane, Surface, Terrain, Wall
from fesd_robot.contact.ground import (
    Box,
    Cylinder,
    HalfSpace,
    HeightField,
    Solid,
    facing_wall,
    height_map,
    tilted_plane,
)
from fesd_robot.errors import GroundError

from .surfaces import HILLS, LEVEL_ALONG_Y, SURFACES, X, Y, waves

ALL = {**SURFACES, **LEVEL_ALONG_Y}
each_surface = pytest.mark.parametrize("surface", ALL.values(), ids=ALL.keys())


def points(count: int) -> np.ndarray:
    return np.random.default_rng(2).uniform([-1.4, -1.3, -0.6], [1.6, 1.4, 1.2], size=(count, 3))


def on(surface: Surface, at: np.ndarray) -> np.ndarray:
    """The point of a surface below a place, or nearest to one beside a solid or a wall, by Newton's method."""
    at = np.array(at, dtype=float)
    for _ in range(60):
        normal = np.asarray(surface.normal(at))
        step = np.array([0.0, 0.0, 1 / normal[2]]) if isinstance(surface, HeightField) else normal
        at = at - surface.distance(at) * step
    return at


def outside(surface: Surface, count: int) -> list[np.ndarray]:
    """Places outside of a surface."""
    return [at for at in points(4 * count) if surface.distance(at) > 0.02][:count]


@each_surface
def test_the_normal_is_the_gradient(surface: Surface) -> None:
    """n = grad f, by central differences of the numbers, outside and a little inside."""
    step = 1e-6
    places = [*outside(surface, 40), *(on(surface, at) - 0.02 * surface.normal(at) for at in outside(surface, 10))]
    for at in places:
        differences = [
            (surface.distance(at + step * axis) - surface.distance(at - step * axis)) / (2 * step) for axis in np.eye(3)
        ]
        assert np.asarray(surface.normal(at)) == pytest.approx(differences, abs=1e-6)


@each_surface
def test_expressions_and_numbers_agree(surface: Surface) -> None:
    """Gap, normal and tangents as CasADi expressions are the numbers, and so is the derivative of the gap."""
    p = ca.SX.sym("p", 3)
    gap = surface.distance(p)
    axes = surface.axes(p)
    found = ca.Function("f", [p], [gap, surface.normal(p), axes.tangent, axes.lateral, ca.gradient(gap, p)])
    samples = np.vstack([points(60), [[X[0], Y[0], 0.3], [X[3], 0.1, 0.3], [-9.0, 0.2, 0.4], [0.2, 9.0, 0.4]]])
    for at in samples:
        value, normal, tangent, lateral, gradient = (np.asarray(each.full()).ravel() for each in found(at))
        assert value == pytest.approx(surface.distance(at), abs=1e-12)
        assert normal == pytest.approx(np.asarray(surface.normal(at)), abs=1e-10)
        assert normal == pytest.approx(gradient, abs=1e-10)
        assert tangent == pytest.approx(surface.axes(at).tangent, abs=1e-10)
        assert lateral == pytest.approx(surface.axes(at).lateral, abs=1e-10)


@each_surface
def test_on_the_surface_axes_are_orthonormal_and_right_handed(surface: Surface) -> None:
    """There the gap is zero, the gradient is the unit normal n, and t_2 = n x t_1; off it the axes stay orthonormal."""
    for at in outside(surface, 40):
        foot = on(surface, at)
        axes = np.array(surface.axes(foot))
        assert abs(surface.distance(foot)) <= 1e-12
        assert np.asarray(surface.normal(foot)) == pytest.approx(axes[0], abs=1e-9)
        for each in (axes, np.array(surface.axes(at))):
            assert each @ each.T == pytest.approx(np.eye(3), abs=1e-9)
            assert np.cross(each[0], each[1]) == pytest.approx(each[2], abs=1e-9)


@each_surface
def test_axes_turn_smoothly_along_the_surface(surface: Surface) -> None:
    """A step of 1e-5 m over the surface, edges included, turns the axes by no more than the smallest radius allows."""
    for start in outside(surface, 20):
        foot = on(surface, start)
        if surface.axes(foot).normal[2] < -0.4:
            continue  # closed surfaces have tangents that jump where they face downwards
        beside = on(surface, foot + 1e-5 * surface.axes(foot).tangent + 1e-5 * surface.axes(foot).lateral)
        turned = np.abs(np.array(surface.axes(foot)) - np.array(surface.axes(beside))).max()
        assert turned <= 1e-5 * 4 / 0.03


@each_surface
def test_many_points_at_once(surface: Surface) -> None:
    """Distances of many points are those of one: from the tangent plane below over a height field, else the gap."""
    places = points(20)
    found = surface.distances(places.T)
    if isinstance(surface, HeightField):
        for at, distance in zip(places, found, strict=True):
            heights = surface.numbers(*at[:2])
            expected = (at[2] - heights.h) / np.sqrt(1 + heights.x**2 + heights.y**2)
            assert distance == pytest.approx(expected, abs=1e-12)
    else:
        assert found == pytest.approx([surface.distance(at) for at in places], abs=1e-12)


def test_a_height_field_is_the_natural_spline_of_scipy() -> None:
    """Inside the map heights are those of natural cubic splines along x, then along y; points are met exactly."""
    assert HILLS.derivatives(*np.meshgrid(X, Y, indexing="ij")).h == pytest.approx(waves(X, Y), abs=1e-14)
    x, y = np.random.default_rng(3).uniform([-1.0, -0.9], [1.2, 1.0], size=(50, 2)).T
    along = CubicSpline(X, waves(X, Y), bc_type="natural")
    for one, other in zip(x, y, strict=True):
        expected = CubicSpline(Y, along(one), bc_type="natural")
        by_x = CubicSpline(Y, along(one, 1), bc_type="natural")
        found = HILLS.numbers(one, other)
        assert found.h == pytest.approx(float(expected(other)), abs=1e-13)
        assert found[1:6] == pytest.approx(
            [
                float(by_x(other)),
                float(expected(other, 1)),
                float(CubicSpline(Y, along(one, 2), bc_type="natural")(other)),
                float(by_x(other, 1)),
                float(expected(other, 2)),
            ],
            abs=1e-11,
        )


def test_numbers_are_those_of_scipy_everywhere() -> None:
    """The polynomials of the pieces and scipy's NdBSpline have the same six values, on breaks and beyond borders."""
    x, y = np.random.default_rng(4).uniform(-2, 2, size=(2, 100))
    x[:4], y[:4] = X[:4], Y[:4]
    many = np.array(HILLS.derivatives(x, y))
    one = np.array([HILLS.numbers(float(a), float(b)) for a, b in zip(x, y, strict=True)]).T
    assert one == pytest.approx(many, abs=1e-12)


def test_a_height_field_levels_off() -> None:
    """Beyond its borders the ground is level across them within a fifth of its length, with no jump of derivatives."""
    length = X[-1] - X[0]
    for y in (-0.5, 0.3):
        far = HILLS.numbers(X[-1] + 0.2 * length, y)
        assert (far.x, far.xx, far.xy) == (0, 0, 0)
        assert far.h == pytest.approx(HILLS.numbers(X[-1] + 5 * length, y).h, abs=1e-15)
        for edge in HILLS.along.breaks:
            left, right = (np.array(HILLS.numbers(edge + s, y)) for s in (-1e-9, 1e-9))
            assert left == pytest.approx(right, abs=1e-6)


def test_what_does_not_vary_along_y_is_the_terrain_along_x() -> None:
    """A grid whose rows are one profile has the gap and the gradient of the terrain through that profile."""
    z = 0.1 * np.sin(3.0 * X)
    field, terrain = HeightField.through(X, Y, np.tile(z[:, None], len(Y))), Terrain(height_map(X, z))
    assert field.curvature == pytest.approx(terrain.profile.curvature, rel=0.05)
    for at in np.random.default_rng(5).uniform([-1.0, -2, -0.1], [1.2, 2, 0.2], size=(40, 3)):
        assert field.distance(at) == pytest.approx(terrain.distance(at), rel=0.01, abs=1e-12)
        at[2] = field.numbers(at[0], at[1]).h
        for one, other in zip(field.axes(at), terrain.axes(at), strict=True):
            assert one == pytest.approx(other, abs=1e-12)


def test_tilted_planes_and_walls_are_those_that_do_not_vary_along_y() -> None:
    """Without a slope along y, and facing along x, planes and walls are the ones of the x-z plane."""
    pairs: list[tuple[HalfSpace, Surface]] = [
        (tilted_plane(0.2, 0.3, 0.0), Plane(0.2, 0.3)),
        (facing_wall((1.2, 5.0), 0.0), Wall(1.2, "right")),
    ]
    for general, special in pairs:
        for at in points(10):
            assert general.distance(at) == pytest.approx(special.distance(at), abs=1e-14)
            for one, other in zip(general.axes(at), special.axes(at), strict=True):
                assert one == pytest.approx(other, abs=1e-14)


@pytest.mark.parametrize(
    "name", [name for name, surface in SURFACES.items() if isinstance(surface, Solid) and surface.underside]
)
def test_a_solid_is_as_far_away_as_coal_says(name: str) -> None:
    """Outside of its core the gap is coal's distance of a point from box or cylinder, less the rounding."""
    solid = SURFACES[name]
    assert isinstance(solid, Box | Cylinder)
    pose = pin.SE3(np.array(solid.pose.axes).T, np.array(solid.pose.center))
    core = (
        coal.Box(*(2 * half for half in solid.half))
        if isinstance(solid, Box)
        else coal.Cylinder(solid.radius, 2 * solid.half)
    )
    placed, request = coal.Transform3s(pose.rotation, pose.translation), coal.DistanceRequest()
    for at in outside(solid, 60):
        point, result = coal.Transform3s(np.eye(3), at), coal.DistanceResult()
        distance = coal.distance(core, placed, coal.Sphere(1e-3), point, request, result) + 1e-3
        assert solid.distance(at) == pytest.approx(distance - solid.rounding, abs=1e-5)


@pytest.mark.parametrize("name", ["pedestal", "column"])
def test_nothing_gets_below_a_solid_without_an_underside(name: str) -> None:
    """Above its middle it is the same as with one; below, it is as wide as there, and inside is inside all the way."""
    solid = SURFACES[name]
    assert isinstance(solid, Box | Cylinder)
    whole, middle = replace(solid, underside=True), solid.pose.center[2]
    for at in points(60):
        if at[2] >= middle:
            assert solid.distance(at) == whole.distance(at)
        elif solid.distance(at) > 0:
            assert solid.distance(at) == pytest.approx(whole.distance([*at[:2], middle]), abs=1e-15)
    assert solid.distance(np.array([*solid.pose.center[:2], -5.0])) < -0.1


def test_a_raised_height_field_is_a_radius_away() -> None:
    """Where a ball touches, its centre's nearest point of the ground is at the radius to 2e-5 m, along the normal."""
    radius = 0.1
    raised = HILLS.raised(radius)
    for x, y in np.random.default_rng(6).uniform(-1.2, 1.3, size=(25, 2)):
        centre = np.array([x, y, raised.numbers(x, y).h])

        def away(at: np.ndarray, centre: np.ndarray = centre) -> float:
            return float(np.sum((centre - [*at, HILLS.numbers(*at).h]) ** 2))

        nearest = minimize(away, centre[:2] - radius * raised.normal(centre)[:2], method="Nelder-Mead", tol=1e-12)
        assert np.sqrt(nearest.fun) == pytest.approx(radius, abs=2.5e-5)
        foot = np.array([*nearest.x, HILLS.numbers(*nearest.x).h])
        assert raised.axes(centre).normal == pytest.approx((centre - foot) / radius, abs=5e-3)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: HeightField.through(X, Y, 100 * waves(X, Y)), r"slope of \d.* at x = .*, y = .* at most 20"),
        (lambda: HILLS.raised(3.0), "hollow of radius 0.* at x = .*, y = .* a ball touches twice; .* at most 0.*"),
    ],
)
def test_a_surface_that_cannot_be_is_refused(build: object, message: str) -> None:
    """Grounds that are too steep, and balls in narrow hollows, are errors with place and bound."""
    with pytest.raises(GroundError, match=message):
        build()  # type: ignore[operator]


def test_a_map_of_twenty_by_twenty_stays_small() -> None:
    """Gap, gradient and tangents of such a map together take a few products for each of its points."""
    x = np.linspace(-1, 1, 20)
    field = HeightField.through(x, x, waves(x, x))
    p = ca.SX.sym("p", 3)
    every = ca.cse([field.distance(p), field.normal(p), *field.axes(p)[1:]])
    assert ca.Function("f", [p], every).n_instructions() <= 10 * x.size**2
