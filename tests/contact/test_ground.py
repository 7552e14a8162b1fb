"""The plane as a signed distance: distance, normal and tangent say the same."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import Plane

PLANES = [Plane(), Plane(height=0.4), Plane(slope=0.3), Plane(height=-1.2, slope=-1.1)]


@pytest.mark.parametrize("plane", PLANES, ids=str)
def test_the_normal_is_the_gradient(plane: Plane) -> None:
    """n = grad f and has length one; t is at right angles, of length one, towards +x."""
    point = ca.SX.sym("p", 3)
    gradient = ca.Function("gradient", [point], [ca.gradient(plane.distance(point), point)])
    for at in np.random.default_rng(0).normal(size=(3, 3)):
        normal, tangent = plane.normal(at), plane.tangent(at)
        assert np.asarray(gradient(at)).ravel() == pytest.approx(normal, abs=1e-15)
        assert np.linalg.norm(normal) == pytest.approx(1)
        assert np.linalg.norm(tangent) == pytest.approx(1)
        assert normal @ tangent == pytest.approx(0, abs=1e-15)
        assert tangent[0] > 0 and tangent[1] == normal[1] == 0


@pytest.mark.parametrize("plane", PLANES, ids=str)
def test_distance_is_signed(plane: Plane) -> None:
    """Points on the line z = height + x tan(slope) are at distance 0, and s along the normal at distance s."""
    for x, s in ((0.0, 0.7), (2.0, -0.3), (-5.0, 1.0)):
        foot = np.array([x, 1.3, plane.height + x * np.tan(plane.slope)])
        assert plane.distance(foot) == pytest.approx(0, abs=1e-14)
        assert plane.distance(foot + s * plane.normal(foot)) == pytest.approx(s, abs=1e-14)
        assert plane.distance(foot + s * plane.tangent(foot)) == pytest.approx(0, abs=1e-14)


def test_a_rising_plane_rises() -> None:
    """A positive slope lifts the ground at positive x."""
    plane = Plane(slope=0.5)
    assert plane.distance(np.array([1.0, 0.0, 0.5])) < 0 < plane.distance(np.array([-1.0, 0.0, 0.0]))
    assert plane.tangent(np.zeros(3))[2] > 0 > plane.normal(np.zeros(3))[0]
