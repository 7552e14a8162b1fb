"""An uneven ground and walls as solid blocks."""

from __future__ import annotations

import numpy as np

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.geometry import mesh
from fesd_robot.render.meshcat.commands import SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.render.window import SceneWindow

WALL_COLOR = 0xAEB4B2


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
    for number, (name, wall) in enumerate(ground.walls.items()):
        if not along[0] <= wall.x <= along[1]:
            continue
        inner, outer = wall.x, wall.x + (thickness if wall.side == "left" else -thickness)
        foot = ground.outline(min(inner, outer), max(inner, outer))[:, 1].min()
        size = [thickness, across[1] - across[0], max(top - float(foot), thickness)]
        # Not below the node of the ground, which has the pose of a plane's middle.
        path = Path(("walls", f"wall {number} {name.replace('/', '_')}"))
        material = mg.MeshLambertMaterial(color=WALL_COLOR, opacity=0.75, transparent=True)
        window.send(SetObject(mesh(f"wall {number}", mg.Box(size), material), path=path))
        pose = np.eye(4)
        pose[:3, 3] = [(inner + outer) / 2, sum(across) / 2, float(foot) + size[2] / 2]
        window.send(SetTransform(pose, path))


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
