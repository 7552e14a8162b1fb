"""Pinocchio geometry objects as Meshcat objects."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin
import umsgpack

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.collada import collada_unit, read_collada
from fesd_robot.render.meshes import Meshes

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


def make_visual(geometry_object: pin.GeometryObject, meshes: Meshes) -> Visual | None:
    """Translate one geometry object.

    Args:
        geometry_object: a sphere, box, cylinder, capsule, cone, ellipsoid, convex set or mesh.
        meshes: of the page, simplified; those with materials of their own stay as they are.

    Returns:
        What to draw, or None (with a warning in the log) for a kind that cannot be drawn.
    """
    name = geometry_object.name
    placement = geometry_object.placement.homogeneous
    primitive = _primitive(geometry_object.geometry)
    if primitive is not None:
        shape, local = primitive
        return Visual(mesh(name, shape, _material(geometry_object)), placement @ local)
    unit = file_unit(geometry_object)
    triangles = None if _has_materials(geometry_object) else meshes.drawn(geometry_object, unit)
    if triangles is not None:
        element = mesh(name, mg.TriangularMeshGeometry(*triangles), _material(geometry_object))
        return Visual(element, placement)
    element = _read_mesh(geometry_object)
    if element is None:
        logger.warning("%s: a %s cannot be drawn and is left out", name, type(geometry_object.geometry).__name__)
        return None
    scale = unit * np.ravel(geometry_object.meshScale)
    return Visual(element, placement @ np.diag([*scale, 1.0]))


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


def box_corners(shape: Any) -> np.ndarray:
    """Return the corners of the box around a shape of coal, in its own axes and its file's unit, (8, 3)."""
    shape.computeLocalAABB()
    box = shape.aabb_local
    ends = np.array([np.ravel(box.min_), np.ravel(box.max_)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])


def file_unit(geometry_object: pin.GeometryObject) -> float:
    """Return the length of the unit of a mesh file, m; Collada files name it, but Pinocchio ignores it."""
    path = Path(geometry_object.meshPath)
    return collada_unit(path) if path.suffix.lower() == ".dae" and path.is_file() else 1.0


def _has_materials(geometry_object: pin.GeometryObject) -> bool:
    """Return whether a mesh is a Collada file whose materials the robot description does not replace."""
    return Path(geometry_object.meshPath).suffix.lower() == ".dae" and not geometry_object.overrideMaterial


def _read_mesh(geometry_object: pin.GeometryObject) -> mg.Object | None:
    """Return the mesh file of a geometry object as it is, None if there is none or the viewer cannot read it."""
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
