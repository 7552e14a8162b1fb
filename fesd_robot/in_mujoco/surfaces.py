"""Grounds, walls and solids as shapes of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

import mujoco
import numpy as np

from fesd_robot.contact import Surface
from fesd_robot.contact.ground import Box, Cylinder, HalfSpace, HeightField, Plane, Terrain, Wall
from fesd_robot.errors import ModelError
from fesd_robot.in_mujoco.bodies import quaternion

HEIGHT_ERROR = 2e-6
"""m; largest distance between an uneven ground along x and the flat strips that it is made of."""

SHORTEST_STRIP = 2e-4
"""m; strips are not made shorter than this."""

GRID_ERROR = 1e-5
"""m; largest distance between a height field and its triangles, where these do not become too many."""

GRID = 1000
"""Largest number of points of a height field along x and along y."""

FAR = 100.0
"""m; half the size of what has no end."""

_GREY = [0.8, 0.8, 0.8, 1.0]


@dataclass(frozen=True)
class SurfaceShapes:
    """A surface in a scene.

    Attributes:
        names: of its shapes.
        note: how it differs from the plan's, one sentence, empty if it does not.
    """

    names: list[str]
    note: str = ""


@singledispatch
def add_surface(surface: Surface, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    """Add a surface of a task to a scene, as shapes that touch nothing but what pairs name.

    Args:
        surface: of the task.
        spec: the scene.
        name: of the surface.
    """
    raise ModelError(f"no shape of MuJoCo is known for {type(surface).__name__}")


@add_surface.register(Plane)
@add_surface.register(HalfSpace)
@add_surface.register(Wall)
def _flat(surface: Plane | HalfSpace | Wall, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    origin = np.zeros(3)
    normal = np.array(surface.normal(origin), dtype=float)
    _add(
        spec,
        name,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 1],
        pos=-float(surface.distance(origin)) * normal,
        quat=quaternion(_across(normal)),
    )
    return SurfaceShapes([name])


@add_surface.register
def _profile(surface: Terrain, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    """Make strips, each as long as the bend of the ground lets it be flat, and a level box beyond each end."""
    x = _places(surface)
    z = surface.heights(x, np.zeros_like(x))
    names, depth = [], FAR / 10
    for number, (left, right, low, high) in enumerate(zip(x[:-1], x[1:], z[:-1], z[1:], strict=True)):
        along = np.array([right - left, 0.0, high - low])
        length = float(np.linalg.norm(along))
        turn = np.column_stack([along / length, [0.0, 1.0, 0.0], np.cross(along / length, [0.0, 1.0, 0.0])])
        names.append(f"{name} {number}")
        middle = np.array([(left + right) / 2, 0.0, (low + high) / 2]) - depth / 2 * turn[:, 2]
        size = [length / 2, FAR, depth / 2]
        _add(spec, names[-1], type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=middle, quat=quaternion(turn))
    for end, (side, at, height) in {"before": (-1, x[0], z[0]), "beyond": (1, x[-1], z[-1])}.items():
        names.append(f"{name} {end}")
        middle = np.array([at + side * FAR, 0.0, height - depth / 2])
        _add(spec, names[-1], type=mujoco.mjtGeom.mjGEOM_BOX, size=[FAR, FAR, depth / 2], pos=middle)
    error = _deviation(surface, x, z)
    return SurfaceShapes(names, f"{name} is {len(x) - 1} flat strips, {1e6 * error:.2g} µm beside it at most")


def _places(surface: Terrain) -> np.ndarray:
    """Return x of the ends of strips, m: h'' L^2 / 8 below the error, where no strip is shorter than the shortest."""
    profile = surface.profile
    x, bend = profile.sampled(2)
    order = np.argsort(x, kind="stable")
    x, bend = x[order], np.abs(bend[order])
    density = np.minimum(np.sqrt(bend / (8 * HEIGHT_ERROR)), 1 / SHORTEST_STRIP)
    strips = np.concatenate([[0.0], np.cumsum((density[:-1] + density[1:]) / 2 * np.diff(x))])
    count = max(int(np.ceil(strips[-1])), 1)
    # Places that share one number of strips, as along a flat piece, are its ends.
    rising = np.concatenate([[True], np.diff(strips) > 0])
    inner = np.interp(np.linspace(0.0, strips[-1], count + 1), strips[rising], x[rising])
    return np.unique(np.concatenate([inner, profile.breaks]))


def _deviation(surface: Terrain, x: np.ndarray, z: np.ndarray) -> float:
    between = np.linspace(x[:-1], x[1:], 9).ravel()
    return float(np.abs(surface.heights(between, np.zeros_like(between)) - np.interp(between, x, z)).max())


@add_surface.register
def _grid(surface: HeightField, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    edges = surface.along.breaks, surface.across.breaks
    step = np.sqrt(4 * GRID_ERROR / max(surface.curvature, 1e-6))
    x, y = (np.linspace(each[0], each[-1], int(np.clip(np.ptp(each) / step + 2, 2, GRID))) for each in edges)
    z = surface.heights(*np.meshgrid(x, y, indexing="ij"))
    low, high = float(z.min()), max(float(z.max()), float(z.min()) + 1e-6)
    half = [(x[-1] - x[0]) / 2, (y[-1] - y[0]) / 2]
    spec.add_hfield(
        name=name,
        nrow=len(y),
        ncol=len(x),
        size=[*half, high - low, 1.0],
        userdata=((z - low) / (high - low)).T.ravel().tolist(),
    )
    middle = [(x[0] + x[-1]) / 2, (y[0] + y[-1]) / 2, low]
    _add(spec, name, type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=name, pos=middle)
    places = [(each[:-1] + each[1:]) / 2 for each in (x, y)]
    quarters = (z[:-1, :-1] + z[1:, 1:]) / 2
    error = float(np.abs(surface.heights(*np.meshgrid(*places, indexing="ij")) - quarters).max())
    return SurfaceShapes(
        [name],
        f"{name} is a height field of {len(x)} x {len(y)} points, {1e6 * error:.2g} µm beside it at most, and ends "
        "where its grid does",
    )


@add_surface.register
def _box(surface: Box, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    """Make the box with its rounded edges of three boxes, each longer along one axis, and capsules at the edges."""
    core, radius = np.array(surface.half_lengths), surface.rounding
    pose, center = np.array(surface.pose.axes).T, np.array(surface.pose.center)
    core = np.where(np.isfinite(core), core, FAR)
    if not surface.underside:
        center = center - (FAR - core[2]) * pose[:, 2]
        core[2] = FAR
    names = []
    for axis in range(3):
        size = core + radius * np.eye(3)[axis]
        names.append(f"{name} {'xyz'[axis]}")
        _add(spec, names[-1], type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=center, quat=quaternion(pose))
        others = [other for other in range(3) if other != axis]
        turn = pose[:, [others[0], others[1], axis]]
        turn[:, 0] *= np.sign(np.linalg.det(turn))
        for first in (-1, 1):
            for second in (-1, 1):
                away = np.zeros(3)
                away[others] = first * core[others[0]], second * core[others[1]]
                names.append(f"{name} edge {'xyz'[axis]} {first} {second}")
                _add(
                    spec,
                    names[-1],
                    type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                    size=[radius, core[axis], 0],
                    pos=center + pose @ away,
                    quat=quaternion(turn),
                )
    return SurfaceShapes(names)


@add_surface.register
def _cylinder(surface: Cylinder, spec: mujoco.MjSpec, name: str) -> SurfaceShapes:
    x, _, z = surface.half_lengths
    pose, center = np.array(surface.pose.axes).T, np.array(surface.pose.center)
    half = z if np.isfinite(z) else FAR
    if not surface.underside:
        center = center - (FAR - half) * pose[:, 2]
        half = FAR
    size = [x + surface.rounding, half + surface.rounding, 0]
    _add(spec, name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, pos=center, quat=quaternion(pose))
    error = (np.sqrt(2) - 1) * surface.rounding
    note = f"the edges of {name} are sharp, {1e3 * error:.2g} mm beyond the rounded ones at most"
    return SurfaceShapes([name], note if np.isfinite(z) else "")


def _add(spec: mujoco.MjSpec, name: str, **values: object) -> None:
    spec.worldbody.add_geom(name=name, contype=0, conaffinity=0, rgba=_GREY, **values)


def _across(normal: np.ndarray) -> np.ndarray:
    """Return a rotation that takes z to a unit normal."""
    least = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(least, normal)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first), normal])
