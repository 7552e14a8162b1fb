"""The shapes by which a robot is seen in MuJoCo; they touch nothing and weigh nothing."""

from __future__ import annotations

from typing import Any

import coal
import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.in_mujoco.bodies import Bodies, quaternion
from fesd_robot.render.geometry import file_unit
from fesd_robot.render.meshes import Meshes

SEEN = 2
"""Group of these shapes."""

MESH_SIZE = 1.0
"""m; meshes are simplified as those of a robot of this size."""


def add_shapes(spec: mujoco.MjSpec, bodies: Bodies) -> None:
    """Add the visible shapes of a robot and of the free bodies beside it to a scene; what cannot be drawn is left out.

    Args:
        spec: the scene.
        bodies: of the robot in it.

    Raises:
        RobotError: a mesh is missing or unreadable.
    """
    robot, meshes = bodies.robot, Meshes(MESH_SIZE)
    for number, each in enumerate(robot.visual_model.geometryObjects):
        link = robot.tree.last_link[each.parentJoint]
        body = bodies.world if link < 0 else bodies.links[link]
        own = _primitive(each.geometry) or _mesh(spec, f"seen {number}", each, meshes)
        if own is not None:
            body.add_geom(
                name=f"seen {number}",
                pos=each.placement.translation,
                quat=quaternion(each.placement.rotation),
                rgba=np.clip(np.asarray(each.meshColor, dtype=float), 0.0, 1.0),
                contype=0,
                conaffinity=0,
                group=SEEN,
                **own,
            )


def _primitive(shape: Any) -> dict[str, Any] | None:
    kinds = mujoco.mjtGeom
    if isinstance(shape, coal.Sphere):
        return {"type": kinds.mjGEOM_SPHERE, "size": [shape.radius, 0, 0]}
    if isinstance(shape, coal.Ellipsoid):
        return {"type": kinds.mjGEOM_ELLIPSOID, "size": np.ravel(shape.radii)}
    if isinstance(shape, coal.Box):
        return {"type": kinds.mjGEOM_BOX, "size": np.ravel(shape.halfSide)}
    if isinstance(shape, coal.Cylinder | coal.Capsule):
        kind = kinds.mjGEOM_CYLINDER if isinstance(shape, coal.Cylinder) else kinds.mjGEOM_CAPSULE
        return {"type": kind, "size": [shape.radius, shape.halfLength, 0]}
    return None


def _mesh(spec: mujoco.MjSpec, name: str, shape: pin.GeometryObject, meshes: Meshes) -> dict[str, Any] | None:
    found = meshes.drawn(shape, file_unit(shape))
    if found is None:
        return None
    spec.add_mesh(
        name=name,
        uservert=np.asarray(found.vertices, dtype=np.float32).ravel(),
        userface=np.asarray(found.faces, dtype=np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}
