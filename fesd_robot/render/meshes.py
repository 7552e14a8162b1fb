"""Meshes made small enough for a page: triangles that nobody would see are merged, within a stated deviation."""

from __future__ import annotations

import contextlib
import hashlib
import io
import logging
import math
import zipfile
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import coal
import fast_simplification
import numpy as np
import pinocchio as pin
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from fesd_robot.native import cache_folder
from fesd_robot.writing import write_atomically

logger = logging.getLogger(__name__)

DEVIATION = 5e-4
"""How far a simplified mesh may be from its original, relative to the size of the robot: half a pixel of a
robot that is 1000 pixels long."""

SHARP = math.radians(35.0)
"""Angle between two triangles from which on the edge between them is drawn sharp."""

ENOUGH = 3000
"""Triangles of a mesh that is small enough."""

_MEASURED = 250
"""Vertices of each mesh from which the distance to the other one is measured."""

_NEAR, _OUTLIERS = 0.99, 4.0
"""Share of them that are within the deviation, and how many times farther the others may be: tips of tiny screws."""

_STEP = 1 / 8
"""Coordinates are rounded to this part of the deviation, which makes them small when they are compressed."""


_VERSIONS = f"{fast_simplification.__version__} {trimesh.__version__} 1".encode()
"""Of what simplified meshes in the cache depend on; the last number is that of this file's own rules."""


_DAMAGED = (EOFError, ValueError, KeyError, zlib.error, zipfile.BadZipFile)
"""What reading an array file that is cut or changed may raise."""


class Mesh(NamedTuple):
    """A triangulated surface.

    Args:
        vertices: m, shape (v, 3).
        faces: numbers of the corners, shape (f, 3).
    """

    vertices: np.ndarray
    faces: np.ndarray


def triangles(shape: Any) -> Mesh | None:
    """Return the triangles of a mesh or a convex set of coal, None of another shape."""
    if isinstance(shape, coal.BVHModelBase):
        count, get = shape.num_tris, shape.tri_indices
        vertices = np.array(shape.vertices())
    elif isinstance(shape, coal.Convex):
        count, get = shape.num_polygons, shape.polygons
        vertices = np.array(shape.points())
    else:
        return None
    corners = (get(index) for index in range(count))
    faces = np.array([(one[0], one[1], one[2]) for one in corners], dtype=np.int64).reshape(-1, 3)
    return Mesh(vertices, faces) if count else None


class Meshes:
    """The meshes of a robot in the size that a page needs, each file simplified once and kept for later pages.

    Args:
        size: diagonal of the box around the robot, m.
    """

    def __init__(self, size: float) -> None:
        # A power of two, so that pages of other postures find the same files in the cache.
        self._deviation = 2.0 ** math.floor(math.log2(DEVIATION * (size if math.isfinite(size) and size > 0 else 1.0)))
        self._known: dict[tuple[str, tuple[float, ...]], Mesh | None] = {}

    def drawn(self, geometry_object: pin.GeometryObject, unit: float = 1.0) -> Mesh | None:
        """Return the mesh of a geometry object, in its axes, with edges that are drawn sharp.

        Args:
            geometry_object: with the file of a mesh, or with triangles of coal.
            unit: length of the unit of the file's coordinates, m.

        Returns:
            None if it is neither, or if the file cannot be read.
        """
        file, scale = Path(geometry_object.meshPath), unit * np.ravel(geometry_object.meshScale)
        if not file.is_file():
            return _cached_surface(triangles(geometry_object.geometry), self._deviation)
        key = str(file), tuple(scale.tolist())
        if key not in self._known:
            content = file.read_bytes() + scale.tobytes()
            self._known[key] = _cached(content, partial(read_mesh, file, scale), self._deviation, str(file))
        return self._known[key]


def read_mesh(file: Path, scale: np.ndarray) -> Mesh | None:
    """Return the triangles of a file (STL, OBJ, Collada), None if they cannot be read.

    Coal's reader misplaces the parts of Collada files with several nodes.

    Args:
        scale: of the coordinates along each axis, (3).
    """
    try:
        read = trimesh.load(file, force="mesh", process=False)
        if not isinstance(read, trimesh.Trimesh):
            return None
        read.merge_vertices(merge_tex=True, merge_norm=True)
        mesh = Mesh(scale * np.asarray(read.vertices), np.asarray(read.faces, dtype=np.int64))
    except Exception as error:  # the readers raise whatever their XML or text parsers do
        logger.debug("%s is drawn as it is: %s", file, error)
        return None
    if scale.prod() < 0:  # mirrored: the corners keep their turn
        mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1])
    return mesh if len(mesh.faces) else None


def _drawn(mesh: Mesh, deviation: float) -> Mesh:
    mesh = sharpened(simplified(mesh, deviation))
    step = _STEP * deviation
    return Mesh(step * np.round(mesh.vertices / step), mesh.faces.astype(np.uint32))


def _cached_surface(surface: Mesh | None, deviation: float) -> Mesh | None:
    """Return the drawn mesh of triangles without a file, such as those of a collision shape."""
    if surface is None:
        return None
    content = surface.vertices.tobytes() + surface.faces.tobytes()
    return _cached(content, lambda: surface, deviation, "a shape without a file")


def _cached(content: bytes, read: Callable[[], Mesh | None], deviation: float, name: str) -> Mesh | None:
    """Return the drawn mesh of a content, from the cache if it was simplified before."""
    digest = hashlib.sha256(content)
    digest.update(np.float64(deviation).tobytes() + _VERSIONS)
    kept = cache_folder() / "meshes" / f"{digest.hexdigest()[:32]}.npz"
    with contextlib.suppress(OSError, *_DAMAGED), np.load(kept) as arrays:
        return Mesh(arrays["vertices"], arrays["faces"])
    surface = read()
    if surface is None:
        return None
    mesh = _drawn(surface, deviation)
    archive = io.BytesIO()
    np.savez(archive, vertices=mesh.vertices, faces=mesh.faces)
    try:
        write_atomically(kept, archive.getvalue())
    except OSError as error:
        logger.debug("the simplified mesh of %s is not kept: %s", name, error)
    return mesh


def simplified(mesh: Mesh, deviation: float) -> Mesh:
    """Return a mesh of fewer triangles, by quadric error metrics.

    The number of triangles is halved as long as both meshes stay near to each other, measured at some hundred of the
    vertices of each.

    Args:
        mesh: to simplify.
        deviation: largest distance between both, in the unit of the mesh.

    Source: Garland, Heckbert, Surface simplification using quadric error metrics (SIGGRAPH 1997).
    """
    result, tree = mesh, None
    while len(result.faces) > ENOUGH:
        trial = _merged(result, len(result.faces) // 2, deviation)
        if not len(trial.faces):
            break
        tree = tree or _tree(mesh)
        apart = np.concatenate([_distances(mesh.vertices, _tree(trial)), _distances(trial.vertices, tree)])
        if np.quantile(apart, _NEAR) > deviation or apart.max() > _OUTLIERS * deviation:
            break
        result = trial
    return result


def _merged(mesh: Mesh, count: int, deviation: float) -> Mesh:
    """Return the mesh with this many triangles; coordinates count in deviations, as the library begins far below 1."""
    vertices, faces = fast_simplification.simplify(
        (mesh.vertices / deviation).astype(np.float32), mesh.faces.astype(np.int32), target_count=count
    )
    return Mesh(deviation * np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64))


def sharpened(mesh: Mesh) -> Mesh:
    """Return the mesh with the vertices on sharp edges doubled, since the viewer shades smoothly across all others.

    The corners of triangles at a vertex are one as far as they are connected by edges at which the surface turns by
    less than `SHARP`.
    """
    faces = mesh.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    face, place = np.tile(np.arange(len(faces)), 3), np.repeat([0, 1, 2], len(faces))
    first, second = 3 * face + place, 3 * face + (place + 1) % 3
    swapped = edges[:, 0] > edges[:, 1]
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    edges = np.sort(edges, axis=1)
    order = np.lexsort(edges.T)
    along, beside = order[:-1], order[1:]
    normals = _normals(mesh)
    smooth = (edges[along] == edges[beside]).all(axis=1)
    smooth &= np.einsum("ij,ij->i", normals[face[along]], normals[face[beside]]) > math.cos(SHARP)
    along, beside = along[smooth], beside[smooth]
    rows = np.concatenate([first[along], second[along]])
    columns = np.concatenate([first[beside], second[beside]])
    graph = coo_matrix((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(faces.size, faces.size))
    _, group = connected_components(graph, directed=False)
    _, chosen, numbers = np.unique(group, return_index=True, return_inverse=True)
    return Mesh(mesh.vertices[faces.ravel()[chosen]], numbers.reshape(-1, 3))


def _normals(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def _tree(mesh: Mesh) -> coal.BVHModelBase:
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(mesh.faces), len(mesh.vertices))
    tree.addVertices(np.ascontiguousarray(mesh.vertices))
    tree.addTriangles(np.ascontiguousarray(mesh.faces))
    tree.endModel()
    return tree


def _distances(points: np.ndarray, tree: coal.BVHModelBase) -> np.ndarray:
    """Return the distances of some points from a surface."""
    chosen = points[np.unique(np.linspace(0, len(points) - 1, _MEASURED).astype(int))]
    request, result, origin, point = coal.DistanceRequest(), coal.DistanceResult(), coal.Transform3s(), coal.Sphere(0.0)
    distances = np.empty(len(chosen))
    for number, place in enumerate(chosen):
        result.clear()
        distances[number] = coal.distance(tree, origin, point, coal.Transform3s(np.eye(3), place), request, result)
    return distances
