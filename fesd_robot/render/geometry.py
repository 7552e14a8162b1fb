"""Pinocchio geometry objects as Meshcat objects."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, NamedTuple

import coal
import meshcat.geometry as mg
import numpy as np
import pinocchio as pin
import umsgpack

from fesd_robot.render.collada import collada_unit, read_collada

logger = logging.getLogger(__name__)

Y_TO_Z = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Three.js turns its cylinders about y, Pinocchio about z."""

CAP_SEGMENTS = 12


class Visual(NamedTuple):
    """Something the viewer can draw.

    Args:
        element: a Meshcat object.
        matrix: its pose and scale in the joint frame, shape (4, 4).
    """

    element: mg.Object
    matrix: np.ndarray


class Shape(mg.Geometry):
    """A geometry that three.js knows by type name and parameters."""

    def __init__(self, kind: str, **parameters: Any) -> None:
        super().__init__()
        self.kind = kind
        self.parameters = parameters

    def lower(self, object_data: Any) -> dict[str, Any]:
        return {"uuid": self.uuid, "type": self.kind, **self.parameters}


class MeshObject(mg.Object):
    """A Collada file with its own materials and textures."""

    def __init__(self, text: str, resources: dict[str, str]) -> None:
        super().__init__(None, None)
        self.text = text
        self.resources = resources

    def lower(self) -> dict[str, Any]:
        description = {"uuid": self.uuid, "type": "_meshfile_object", "format": "dae", "data": self.text}
        return {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": [],
            "materials": [],
            "object": {**description, "resources": self.resources, "matrix": np.eye(4).flatten().tolist()},
        }


def mesh(name: str, geometry: mg.Geometry, material: mg.Material, kind: type[mg.Object] = mg.Mesh) -> mg.Object:
    """Return geometry and material as one object whose identifiers depend on `name` only (pages are reproducible)."""
    geometry.uuid, material.uuid = f"{name} geometry", f"{name} material"
    element = kind(geometry, material)
    element.uuid = name
    return element


def make_visual(geometry_object: pin.GeometryObject) -> Visual | None:
    """Translate one geometry object.

    Args:
        geometry_object: a sphere, box, cylinder, capsule, cone, ellipsoid, convex set or mesh.

    Returns:
        What to draw, or None (with a warning in the log) for a kind that cannot be drawn.
    """
    name = geometry_object.name
    scale = np.diag([*np.asarray(geometry_object.meshScale, dtype=float).ravel(), 1.0])
    placement = geometry_object.placement.homogeneous
    primitive = _primitive(geometry_object.geometry)
    if primitive is not None:
        shape, local = primitive
        return Visual(mesh(name, shape, _material(geometry_object)), placement @ local)
    element = _read_mesh(geometry_object)
    if element is not None:
        unit = file_unit(geometry_object)
        return Visual(element, placement @ scale @ np.diag([unit, unit, unit, 1.0]))
    triangles = _triangles(geometry_object.geometry)
    if triangles is None:
        logger.warning("%s: a %s cannot be drawn and is left out", name, type(geometry_object.geometry).__name__)
        return None
    # Pinocchio has already applied the scale to these vertices.
    return Visual(mesh(name, mg.TriangularMeshGeometry(*triangles), _material(geometry_object)), placement)


def _material(geometry_object: pin.GeometryObject) -> mg.Material:
    """Return a matt material of the colour that the robot description gives."""
    red, green, blue, opacity = np.clip(np.asarray(geometry_object.meshColor, dtype=float), 0.0, 1.0)
    color = (round(255 * red) << 16) + (round(255 * green) << 8) + round(255 * blue)
    return mg.MeshPhongMaterial(color=int(color), opacity=float(opacity), specular=0x1C1C1C, shininess=24.0)


def _primitive(shape: Any) -> tuple[mg.Geometry, np.ndarray] | None:
    """Return a three.js shape and its pose for a geometric primitive, None for everything else."""
    if isinstance(shape, coal.Sphere):
        return _sphere(shape.radius), np.eye(4)
    if isinstance(shape, coal.Ellipsoid):
        return _sphere(1.0), np.diag([*np.asarray(shape.radii, dtype=float).ravel(), 1.0])
    if isinstance(shape, coal.Box):
        return mg.Box([float(2.0 * half) for half in np.asarray(shape.halfSide).ravel()]), np.eye(4)
    if isinstance(shape, coal.Cylinder):
        return mg.Cylinder(2.0 * shape.halfLength, shape.radius), Y_TO_Z
    if isinstance(shape, coal.Cone):
        return mg.Cylinder(2.0 * shape.halfLength, radiusTop=0.0, radiusBottom=shape.radius), Y_TO_Z
    if isinstance(shape, coal.Capsule):
        return _capsule(shape.radius, shape.halfLength), Y_TO_Z
    return None


def _sphere(radius: float) -> mg.Geometry:
    return Shape("SphereGeometry", radius=float(radius), widthSegments=40, heightSegments=24)


def _capsule(radius: float, half_length: float) -> mg.Geometry:
    """Return a capsule about y as the profile of half a stadium turned once around."""
    angle = np.linspace(0.0, np.pi / 2, CAP_SEGMENTS + 1)
    across = np.concatenate([radius * np.sin(angle), radius * np.cos(angle)])
    along = np.concatenate([-half_length - radius * np.cos(angle), half_length + radius * np.sin(angle)])
    points = [{"x": float(x), "y": float(y)} for x, y in zip(across, along, strict=True)]
    return Shape("LatheGeometry", points=points, segments=36, phiStart=0.0, phiLength=2.0 * np.pi)


def file_unit(geometry_object: pin.GeometryObject) -> float:
    """Return the length of the unit of a mesh file, m; Collada files name it, but Pinocchio ignores it."""
    path = Path(geometry_object.meshPath)
    return collada_unit(path) if path.suffix.lower() == ".dae" and path.is_file() else 1.0


def _read_mesh(geometry_object: pin.GeometryObject) -> mg.Object | None:
    """Return the mesh file of a geometry object, None if there is none or the viewer cannot read it."""
    path = Path(geometry_object.meshPath)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in ("dae", "obj", "stl") or not path.is_file():
        return None
    if kind == "stl":
        content: Any = umsgpack.Ext(0x12, path.read_bytes())
    elif kind == "obj":
        content = path.read_text(encoding="utf-8", errors="replace") + "\n"
    else:
        content, resources = read_collada(path)
        if not geometry_object.overrideMaterial:
            element = MeshObject(content, resources)
            element.uuid = geometry_object.name
            return element
    shape = Shape("_meshfile_geometry", format=kind, data=content)
    return mesh(geometry_object.name, shape, _material(geometry_object))


def _triangles(shape: Any) -> tuple[np.ndarray, np.ndarray] | None:
    """Return vertices, m, shape (v, 3), and faces, shape (f, 3), of a triangulated shape, None if it has none."""
    if isinstance(shape, coal.BVHModelBase):
        count, get = shape.num_tris, shape.tri_indices
        vertices = np.asarray(shape.vertices())
    elif isinstance(shape, coal.Convex):
        count, get = shape.num_polygons, shape.polygons
        vertices = np.asarray(shape.points())
    else:
        return None
    faces = np.array([[get(index)[corner] for corner in range(3)] for index in range(count)], dtype=np.uint32)
    return (vertices, faces) if count else None
