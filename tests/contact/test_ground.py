"""Surfaces as functions: gap, gradient and tangent say the same, in numbers and in expressions."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import Plane, Surface, Terrain
from fesd_robot.contact.ground import height_map, steps
from fesd_robot.errors import GroundError

from .grounds import GROUNDS, HILLS, SINE_X, SOFT, STAIRS, sine

PLANES = [Plane(), Plane(height=0.4), Plane(slope=0.3), Plane(height=-1.2, slope=-1.1)]
each_ground = pytest.mark.parametrize("ground", GROUNDS.values(), ids=GROUNDS.keys())


def on(ground: Surface, x: float) -> np.ndarray:
    """The point of a ground above x, by bisection of its gap along z."""
    low, high = np.array([x, 0.7, -50.0]), np.array([x, 0.7, 50.0])
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if ground.distance(middle) < 0 else (low, middle)
    return high


def points(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform([-2.5, -1, -1], [3.5, 1, 2], size=(count, 3))


@each_ground
def test_the_normal_is_the_gradient(ground: Surface) -> None:
    """n = grad f everywhere, by central differences of the numbers; the tangent has length one and leaves y alone."""
    step = 1e-5
    for at in points(40):
        differences = [
            (ground.distance(at + step * axis) - ground.distance(at - step * axis)) / (2 * step) for axis in np.eye(3)
        ]
        assert np.asarray(ground.normal(at)) == pytest.approx(differences, abs=2e-6)
        normal, tangent, lateral = (np.asarray(axis) for axis in ground.axes(at))
        assert np.stack([normal, tangent, lateral]) @ np.stack([normal, tangent, lateral]).T == pytest.approx(np.eye(3))
        assert tangent[1] == ground.normal(at)[1] == 0
        assert lateral.tolist() == [0, 1, 0] and not ground.varies_across


@each_ground
def test_expressions_and_numbers_agree(ground: Surface) -> None:
    """Gap, normal and tangent as CasADi expressions have the values that scipy gives, on breaks and beyond ends too."""
    at = ca.SX.sym("p", 3)
    both = ca.Function("both", [at], [ground.distance(at), ground.normal(at), ground.axes(at).tangent])
    samples = points(40)
    if isinstance(ground, Terrain):
        breaks = ground.profile.breaks[:: max(len(ground.profile.breaks) // 20, 1)]
        samples = np.vstack([samples, *[[x, 0.0, 0.9] for x in [*breaks, -40.0, 40.0]]])
    for point in samples:
        gap, normal, tangent = (np.asarray(value.full()).ravel() for value in both(point))
        assert gap == pytest.approx(ground.distance(point), abs=1e-12)
        assert normal == pytest.approx(np.asarray(ground.normal(point)), abs=1e-10)
        assert tangent == pytest.approx(np.asarray(ground.axes(point).tangent), abs=1e-12)


@pytest.mark.parametrize("name", [name for name in GROUNDS if "wall" not in name])
def test_the_normal_is_a_unit_vector_on_the_ground(name: str) -> None:
    """Where f = 0 the gradient has length one and t = (n_z, 0, -n_x): forces along them are in N."""
    ground = GROUNDS[name]
    for x in np.linspace(-2.5, 3.5, 61):
        foot = on(ground, x)
        normal, tangent = np.asarray(ground.normal(foot)), np.asarray(ground.axes(foot).tangent)
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-9)
        assert tangent == pytest.approx([normal[2], 0, -normal[0]], abs=1e-9)
        assert ground.distance(foot + 1e-3 * normal) > 0 > ground.distance(foot - 1e-3 * normal)


@pytest.mark.parametrize("ground", [STAIRS, HILLS, SOFT.raised(0.15)], ids=["stairs", "hills", "raised"])
def test_near_the_ground_the_gap_is_the_distance(ground: Terrain) -> None:
    """At s along the normal the gap is s, to second order in s; high above it is the height over the ground."""
    for x in np.linspace(-1.0, 2.0, 31):
        foot = on(ground, x)
        for s in (1e-3, -1e-3, 1e-4):
            curvature = ground.profile.curvature
            assert ground.distance(foot + s * ground.normal(foot)) == pytest.approx(s, abs=20 * curvature * s * s)
        assert ground.distance(foot + 5.0 * np.eye(3)[2]) == pytest.approx(5.0, rel=0.02)


@pytest.mark.parametrize("plane", PLANES, ids=str)
def test_a_plane_is_a_distance(plane: Plane) -> None:
    """Points on the line z = height + x tan(slope) are at distance 0, and s along the normal at distance s."""
    for x, s in ((0.0, 0.7), (2.0, -0.3), (-5.0, 1.0)):
        foot = np.array([x, 1.3, plane.height + x * np.tan(plane.slope)])
        assert plane.distance(foot) == pytest.approx(0, abs=1e-14)
        assert plane.distance(foot + s * plane.normal(foot)) == pytest.approx(s, abs=1e-14)
        assert plane.distance(foot + s * plane.axes(foot).tangent) == pytest.approx(0, abs=1e-14)


def test_a_rising_plane_rises() -> None:
    """A positive slope lifts the ground at positive x."""
    plane = Plane(slope=0.5)
    assert plane.distance(np.array([1.0, 0.0, 0.5])) < 0 < plane.distance(np.array([-1.0, 0.0, 0.0]))
    assert plane.axes(np.zeros(3)).tangent[2] > 0 > plane.normal(np.zeros(3))[0]


def test_steps_are_level_between_their_edges() -> None:
    """Between two rises the ground has the height of its tread, at an edge the mean, and no jump of two derivatives."""
    x = np.array([-3, 0.34, 0.4, 0.46, 0.55, 0.64, 1.0, 1.3, 1.36, 9])
    expected = [0.1, 0.1, 0.175, 0.25, 0.25, 0.25, 0.4, 0.1, -0.2, -0.2]
    assert STAIRS.profile.derivatives(x)[0] == pytest.approx(expected, abs=1e-12)
    for edge in STAIRS.profile.breaks:
        left, right = STAIRS.profile.derivatives(edge + np.array([-1e-9, 1e-9])).T
        assert left == pytest.approx(right, abs=1e-4)


def test_rises_may_meet() -> None:
    """Edges as far apart as they are smoothed make one flight of rises without treads."""
    flight = steps(0.0, [0.1, 0.2, 0.3], [0.1, 0.2, 0.3], 0.1)
    assert flight.derivatives(np.array([0.05, 0.15, 0.25, 0.35]))[0] == pytest.approx([0, 0.1, 0.2, 0.3])


def test_a_height_map_passes_through_its_points() -> None:
    """The spline meets every point and the formula between them, is smooth everywhere, and levels off at its ends."""
    profile = HILLS.profile
    assert profile.derivatives(SINE_X)[0] == pytest.approx(sine(SINE_X), abs=1e-14)
    inside = np.linspace(-1.5, 2.5, 999)
    assert profile.derivatives(inside)[0] == pytest.approx(sine(inside), abs=2e-6)
    start, slope, _ = profile.derivatives(np.array([-2.0]))[:, 0]
    far = profile.derivatives(np.array([-2.5, -9.0, 3.5, 9.0]))
    assert far[1:] == pytest.approx(0, abs=1e-12)
    assert far[0, :2] == pytest.approx(start - 0.25 * slope, abs=1e-14)
    for edge in profile.breaks:
        left, right = profile.derivatives(edge + np.array([-1e-10, 1e-10])).T
        assert left == pytest.approx(right, abs=1e-6)


@pytest.mark.parametrize(("ground", "radius"), [(HILLS, 0.1), (HILLS, 0.3), (SOFT, 0.15)])
def test_a_raised_ground_is_a_radius_away(ground: Terrain, radius: float) -> None:
    """Every point of the raised curve has its nearest point of the ground at the radius, by brute force and Newton."""
    raised = ground.raised(radius)
    for x in np.linspace(-1.7, 2.7, 45):
        center = on(raised, x)
        s = np.linspace(x - 2 * radius, x + 2 * radius, 4001)
        s = s[[np.argmin((s - x) ** 2 + (ground.profile.derivatives(s)[0] - center[2]) ** 2)]]
        for _ in range(5):
            h, slope, curvature = ground.profile.derivatives(s)
            s = s - (s - x + (h - center[2]) * slope) / (1 + slope**2 + (h - center[2]) * curvature)
        nearest = np.array([s[0], 0.7, ground.profile.derivatives(s)[0, 0]])
        assert np.linalg.norm(center - nearest) == pytest.approx(radius, abs=3e-7)
        assert (center - nearest) / radius == pytest.approx(np.asarray(raised.normal(center)), abs=1e-4)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            lambda: STAIRS.raised(0.1),
            "hollow of radius 0.008801 m at x = 1.344 m, .*at most 0.00836",
        ),
        (lambda: Terrain(steps(0, [1], [3], 0.1)), r"slope of 56.* at x = 1 m, expected at most 20"),
        (lambda: Terrain(height_map(np.array([0, 0.1]), np.array([0, 5]))), "slope of 50 .*a vertical face is a wall"),
        (lambda: Terrain(height_map(np.arange(1001.0), np.zeros(1001))), "1002 pieces, expected at most 1000"),
    ],
)
def test_a_ground_that_cannot_be_is_refused(build: object, message: str) -> None:
    """Faces that are too steep, circles in narrow hollows and too many points are errors with place and bound."""
    with pytest.raises(GroundError, match=message):
        build()  # type: ignore[operator]
