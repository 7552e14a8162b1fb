"""An uneven ground, walls, boxes and cylinders as solids."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.geometry import make_visual, mesh
from fesd_robot.render.meshcat.commands import SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
from fesd_robot.render.meshes import Meshes
from fesd_robot.render.terrain import FacingWallVisual, GroundVisual, WallVisual
from fesd_robot.render.window import SceneWindow

WALL_COLOR = 0xAEB4B2
SOLID_COLOR = 0xBCC3C6


def add_block(window: SceneWindow, outline: np.ndarray, across: tuple[float, float], depth: float, color: int) -> None:
    """Add a block whose top is the outline drawn out along y.

    Args:
        outline: points x, z of the top, m, x increasing, shape (n, 2).
        across: y of its two sides, m.
        depth: of the bottom below the lowest point, m.
    """
    vertices, faces = _block(outline, across, float(outline[:, 1].min()) - depth)
    geometry = mg.TriangularMeshGeometry(vertices, faces)
    window.send(SetObject(mesh("block", geometry, mg.MeshLambertMaterial(color=color)), path=Path(("ground", "block"))))


def add_walls(
    window: SceneWindow,
    ground: GroundVisual,
    along: tuple[float, float],
    across: tuple[float, float],
    top: float,
    thickness: float,
) -> None:
    """Add every wall that stands between the ends of the drawn ground, from the ground to `top`.

    Args:
        along, across: x and y of the ends of the drawn ground, m.
        top: z of the upper ends of the walls, m.
        thickness: m.
    """
    middle = np.array([sum(along) / 2, sum(across) / 2])
    for number, (name, wall) in enumerate(ground.walls.items()):
        if isinstance(wall, FacingWallVisual):
            placed = _facing(wall, ground, middle, np.array([np.ptp(along), np.ptp(across)]) / 2, top, thickness)
        else:
            placed = _across(wall, ground, along, across, top, thickness)
        if placed is None:
            continue
        size, pose = placed
        # Not below the node of the ground, which has the pose of a plane's middle.
        path = Path(("walls", f"wall {number} {name.replace('/', '_')}"))
        material = mg.MeshLambertMaterial(color=WALL_COLOR, opacity=0.75, transparent=True)
        window.send(SetObject(mesh(f"wall {number}", mg.Box(size), material), path=path))
        window.send(SetTransform(pose, path))


def add_solids(window: SceneWindow, ground: GroundVisual, longest: float) -> None:
    """Add the boxes and cylinders; what has no end is as long as `longest`, m."""
    red, green, blue = (int(SOLID_COLOR >> shift & 0xFF) / 255 for shift in (16, 8, 0))
    for number, (name, solid) in enumerate(ground.solids.items()):
        drawn = pin.GeometryObject(f"solid {number}", 0, 0, pin.SE3(solid.pose), solid.shape(longest))
        drawn.meshColor = np.array([red, green, blue, 1.0])
        visual = make_visual(drawn, Meshes(longest))
        assert visual is not None
        path = Path(("surfaces", f"surface {number} {name.replace('/', '_')}"))
        window.send(SetObject(visual.element, path=path))
        window.send(SetTransform(visual.matrix, path))


def add_mesh(window: SceneWindow, x: np.ndarray, y: np.ndarray, z: np.ndarray, depth: float, color: int) -> None:
    """Add a solid whose top goes through a grid of points and whose sides are vertical.

    Args:
        x, y: m, increasing, (n) and (m).
        z: m, (n, m).
        depth: of its lower edge below the lowest point, m.
    """
    n, m = z.shape
    top = np.stack([*np.meshgrid(x, y, indexing="ij"), z], axis=-1).reshape(-1, 3)
    corner = (m * np.arange(n - 1)[:, None] + np.arange(m - 1)).ravel()
    faces = [
        np.stack([corner, corner + m, corner + m + 1], axis=1),
        np.stack([corner, corner + m + 1, corner + 1], axis=1),
    ]
    rim = np.arange(n * m).reshape(n, m)
    rims = (rim[:, 0], rim[-1, :], rim[::-1, -1], rim[0, ::-1])
    vertices, count = [top], n * m
    for side in rims:
        upper = top[side]
        lower = upper * [1.0, 1.0, 0.0] + [0.0, 0.0, float(z.min()) - depth]
        vertices += [upper, lower]
        k, first = len(side), count + np.arange(len(side) - 1)
        faces += [
            np.stack([first, first + k, first + k + 1], axis=1),
            np.stack([first, first + k + 1, first + 1], axis=1),
        ]
        count += 2 * k
    geometry = mg.TriangularMeshGeometry(np.vstack(vertices), np.vstack(faces).astype(np.uint32))
    window.send(SetObject(mesh("block", geometry, mg.MeshLambertMaterial(color=color)), path=Path(("ground", "block"))))


_Placed = tuple[list[float], np.ndarray]
"""Lengths of a drawn wall, m, and its pose, (4, 4)."""


def _across(
    wall: WallVisual,
    ground: GroundVisual,
    along: tuple[float, float],
    across: tuple[float, float],
    top: float,
    thickness: float,
) -> _Placed | None:
    if not along[0] <= wall.x <= along[1]:
        return None
    inner, outer = wall.x, wall.x + (thickness if wall.side == "left" else -thickness)
    foot = ground.levels(np.array([min(inner, outer), across[0]]), np.array([max(inner, outer), across[1]])).min()
    size = [thickness, across[1] - across[0], max(top - float(foot), thickness)]
    pose = np.eye(4)
    pose[:3, 3] = [(inner + outer) / 2, sum(across) / 2, float(foot) + size[2] / 2]
    return size, pose


def _facing(
    wall: FacingWallVisual, ground: GroundVisual, middle: np.ndarray, half: np.ndarray, top: float, thickness: float
) -> _Placed | None:
    """Return a rectangle with this middle and half its lengths, as long as it is over the drawn ground."""
    normal = np.array([math.cos(wall.facing), math.sin(wall.facing)])
    along = np.array([-normal[1], normal[0]])
    start = middle + (normal @ (np.array(wall.place) - middle)) * normal
    ends = [-math.inf, math.inf]
    for i in range(2):
        if abs(along[i]) < 1e-9:
            if abs(start[i] - middle[i]) > half[i]:
                return None
            continue
        reached = sorted((middle[i] + side * half[i] - start[i]) / along[i] for side in (-1.0, 1.0))
        ends = [max(ends[0], reached[0]), min(ends[1], reached[1])]
    if ends[0] >= ends[1]:
        return None
    foot = float(ground.levels(middle - half, middle + half).min())
    size = [thickness, ends[1] - ends[0], max(top - foot, thickness)]
    pose = np.eye(4)
    pose[:2, 0], pose[:2, 1] = normal, along
    pose[:2, 3] = start + sum(ends) / 2 * along - thickness / 2 * normal
    pose[2, 3] = foot + size[2] / 2
    return size, pose


def _block(outline: np.ndarray, across: tuple[float, float], bottom: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices, shape (4 m, 3), and faces, shape (2 m, 3), of m four-cornered sides, corners not shared."""
    near, far = across
    sides: list[list[tuple[float, float, float]]] = []
    for (x, z), (x_next, z_next) in zip(outline[:-1].tolist(), outline[1:].tolist(), strict=True):
        sides.append([(x, near, z), (x_next, near, z_next), (x_next, far, z_next), (x, far, z)])
        sides.append([(x, near, bottom), (x_next, near, bottom), (x_next, near, z_next), (x, near, z)])
        sides.append([(x_next, far, bottom), (x, far, bottom), (x, far, z), (x_next, far, z_next)])
    (x, z), (x_end, z_end) = outline[[0, -1]].tolist()
    sides.append([(x, far, bottom), (x, near, bottom), (x, near, z), (x, far, z)])
    sides.append([(x_end, near, bottom), (x_end, far, bottom), (x_end, far, z_end), (x_end, near, z_end)])
    first = 4 * np.arange(len(sides))[:, None]
    faces = np.concatenate([first + np.array(corners) for corners in ((0, 1, 2), (0, 2, 3))])
    return np.array(sides, dtype=float).reshape(-1, 3), faces.astype(np.uint32)
