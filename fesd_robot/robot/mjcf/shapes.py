"""Geoms of a MuJoCo model as shapes on bodies."""

from __future__ import annotations

from typing import Any

import coal
import mujoco
import numpy as np

from fesd_robot.robot.mjcf.bodies import pose_of
from fesd_robot.robot.mjcf.compiled import name_of
from fesd_robot.robot.model_file import Shape


def read_shapes(model: mujoco.MjModel) -> list[Shape]:
    """Return the shapes of all bodies but the world's; planes and height fields belong there only.

    What a body shows are its geoms that collide with nothing, as files write their meshes, and all if there are none.
    """
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    shapes = []
    for geom in range(model.ngeom):
        body, geometry = int(model.geom_bodyid[geom]), _geometry(model, geom)
        if body == 0 or geometry is None:
            continue
        own = np.asarray(model.geom_bodyid) == body
        material = int(model.geom_matid[geom])
        color = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
        shapes.append(
            Shape(
                name=name_of(model, "geom", geom),
                body=name_of(model, "body", body),
                placement=pose_of(model.geom_pos[geom], model.geom_quat[geom]),
                geometry=geometry,
                color=np.array(color, dtype=float),
                touches=bool(touching[geom]),
                visible=bool(not touching[geom] or touching[own].all()),
                friction=float(model.geom_friction[geom][0]),
            )
        )
    return shapes


def _geometry(model: mujoco.MjModel, geom: int) -> Any | None:
    """Return a shape of coal; MuJoCo's sizes are radii and half lengths."""
    kind, size = int(model.geom_type[geom]), [float(value) for value in model.geom_size[geom]]
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_SPHERE:
        return coal.Sphere(size[0])
    if kind == kinds.mjGEOM_CAPSULE:
        return coal.Capsule(size[0], 2 * size[1])
    if kind == kinds.mjGEOM_CYLINDER:
        return coal.Cylinder(size[0], 2 * size[1])
    if kind == kinds.mjGEOM_BOX:
        return coal.Box(*(2 * half for half in size))
    if kind == kinds.mjGEOM_ELLIPSOID:
        return coal.Ellipsoid(*size)
    if kind in (int(kinds.mjGEOM_MESH), int(kinds.mjGEOM_SDF)):
        return _mesh(model, int(model.geom_dataid[geom]))
    return None


def _mesh(model: mujoco.MjModel, mesh: int) -> coal.BVHModelOBBRSS:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    corners, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    result = coal.BVHModelOBBRSS()
    result.beginModel(int(faces), int(count))
    result.addVertices(np.array(model.mesh_vert[first : first + count], dtype=float))
    result.addTriangles(np.array(model.mesh_face[corners : corners + faces], dtype=np.int64))
    result.endModel()
    return result
