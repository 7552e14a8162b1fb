"""Grounds, walls and solids of a scene are where those of the task are."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from fesd_robot.contact import Surface
from fesd_robot.contact.ground import (
    Box,
    Cylinder,
    HalfSpace,
    HeightField,
    Plane,
    Pose,
    Terrain,
    Wall,
    facing_wall,
    height_map,
    steps,
    tilted_plane,
)
from fesd_robot.in_mujoco.surfaces import add_surface

RADIUS = 0.01


def distances(surface: Surface, centers: np.ndarray, margin: float = 0.2) -> tuple[np.ndarray, str]:
    """Return how far balls about some centers are from a surface in MuJoCo, m, and how it says that it differs."""
    spec = mujoco.MjSpec()
    shapes = add_surface(surface, spec, "surface")
    body = spec.worldbody.add_body(name="ball", mocap=True)
    body.add_geom(name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0, 0])
    for name in shapes.names:
        spec.add_pair(name=name, geomname1="ball", geomname2=name, margin=margin, condim=1)
    model = spec.compile()
    data, result = mujoco.MjData(model), []
    for center in centers:
        data.mocap_pos[0] = center
        mujoco.mj_forward(model, data)
        result.append(data.contact.dist.min() + RADIUS if data.ncon else np.inf)
    return np.array(result), shapes.note


@pytest.mark.parametrize(
    "surface",
    [
        Plane(0.3, 0.0),
        Plane(-0.1, 0.4),
        tilted_plane(0.2, 0.3, -0.2),
        Wall(0.5, "left"),
        Wall(-0.5, "right"),
        facing_wall((0.3, 0.1), 2.0),
        HalfSpace((0.0, 0.6, 0.8), 0.1),
        Box(Pose.turned((0.1, 0.2, 0.3), 0.5, 0.2), 0.02, (0.1, 0.15, 0.2)),
        Box(Pose.turned((0.1, 0.0, 0.3), 0.5), 0.02, (0.1, np.inf, 0.2), underside=False),
        Cylinder(Pose.turned((0.1, 0.2, 0.3), 0.5).along("y"), 0.01, 0.2, np.inf),
    ],
)
def test_exact_surfaces(surface: Surface) -> None:
    """Planes, walls, boxes with rounded edges and endless cylinders are exact, near by outside."""
    random, checked = np.random.default_rng(0), 0
    points = random.uniform(-0.6, 0.8, (400, 3))
    gaps = np.array([float(surface.distance(point)) for point in points])
    near = (gaps > 1e-3) & (gaps < 0.15)
    found, note = distances(surface, points[near])
    assert found == pytest.approx(gaps[near], abs=1e-9)
    checked = int(near.sum())
    assert checked > 20
    assert note == ""


def test_a_cylinder_with_ends() -> None:
    """Its rounded edges are sharp, by what is said."""
    surface = Cylinder(Pose.turned((0.0, 0.0, 0.0), 0.0), 0.02, 0.1, 0.2)
    points = np.random.default_rng(1).uniform(-0.4, 0.4, (600, 3))
    gaps = np.array([float(surface.distance(point)) for point in points])
    near = (gaps > 1e-3) & (gaps < 0.15)
    found, note = distances(surface, points[near])
    assert note == "the edges of surface are sharp, 8.3 mm beyond the rounded ones at most"
    assert (gaps[near] - found).max() <= (np.sqrt(2) - 1) * 0.02 + 1e-6
    assert (gaps[near] - found).min() >= -1e-6


@pytest.mark.parametrize("profile", [steps(0.0, [0.5, 1.0], [0.1, 0.05], 0.05), height_map(
    np.linspace(0, 2, 9), np.array([0, 0.1, 0.05, 0.2, 0.1, 0.0, -0.1, 0.0, 0.05]))])  # fmt: skip
def test_profiles(profile: object) -> None:
    """Strips along a profile are as near to it as they say, and it is level beyond its ends."""
    surface = Terrain(profile)  # type: ignore[arg-type]
    x = np.linspace(-0.5, 2.5, 301)
    height, slope, bend = profile.derivatives(x)  # type: ignore[attr-defined]
    normals = np.column_stack([-slope, 0 * x, np.ones_like(x)]) / np.sqrt(1 + slope**2)[:, None]
    places = np.column_stack([x, 0 * x, height])
    hollow = bend * RADIUS > 0.5
    found, note = distances(surface, (places + 2e-3 * normals)[~hollow])
    said = float(note.split(", ")[1].split(" µm")[0]) * 1e-6
    assert said < 1e-5
    assert np.abs(found - 2e-3).max() <= said + 1e-7


def test_a_height_field() -> None:
    """Points of a height field are as near to it as they say, and a micrometre."""
    x, y = np.linspace(0, 1, 6), np.linspace(0, 1.5, 7)
    z = 0.1 * np.sin(3 * x)[:, None] * np.cos(2 * y)[None, :]
    surface = HeightField.through(x, y, z)
    points = np.random.default_rng(2).uniform([0.1, 0.1], [0.9, 1.4], (50, 2))
    at = surface.derivatives(points[:, 0], points[:, 1])
    normals = np.column_stack([-at.x, -at.y, np.ones_like(at.x)]) / np.sqrt(1 + at.x**2 + at.y**2)[:, None]
    found, note = distances(surface, np.column_stack([points, at.h]) + 2e-3 * normals, 4e-3)
    said = float(note.split(", ")[1].split(" µm")[0]) * 1e-6
    assert np.abs(found - 2e-3).max() <= said + 2e-6
