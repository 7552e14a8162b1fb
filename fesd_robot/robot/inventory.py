"""Inventory of a model file for tasks: joints, frames, shapes, motors and postures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from fesd_robot.orientations import turn_entries
from fesd_robot.robot.robot import Robot
from fesd_robot.robot.units import configuration_units

Rows = list[dict[str, Any]]
"""The rows of a table, each column -> value."""

_DECIMALS = 6
"""Of lengths, m, and positions."""


def inventory(robot: Robot, tables: Sequence[str]) -> dict[str, Rows]:
    """Return some of the tables ``coordinates``, ``frames``, ``shapes``, ``motors`` and ``postures`` of a robot.

    Positions are those of the neutral configuration, in the world, m; limits that do not exist are None. Only shapes
    need the files of meshes.
    """
    makers = {
        "coordinates": _coordinates,
        "motors": _motors,
        "frames": _frames,
        "shapes": _shapes,
        "postures": _postures,
    }
    return {name: list(makers[name](robot)) for name in tables}


def _motors(robot: Robot) -> Iterator[dict[str, Any]]:
    for name, drive in robot.drives.items():
        yield {"name": name, "pushes": dict(drive.force), "limits": [drive.lower, drive.upper]}


def _postures(robot: Robot) -> Iterator[dict[str, Any]]:
    for name, values in robot.postures.items():
        yield {"name": name, "values": dict(values)}


def _coordinates(robot: Robot) -> Iterator[dict[str, Any]]:
    """Yield the properties of every joint coordinate, a cosine and sine as their angle; quaternions have none here."""
    units, turns = configuration_units(robot), turn_entries(robot.configuration_names)
    springs = {v: [stiffness, rest] for v, _, stiffness, rest in robot.springs}
    first = {at.start: name for name, at in turns.items()}
    for index, entry in enumerate(robot.configuration_names):
        if any(at.start < index < at.stop for at in turns.values()):
            continue
        name = first.get(index, entry)
        row: dict[str, Any] = {
            "name": name,
            "unit": units.get(name, "rad"),
            "limits": _limits(robot.lower_position[index], robot.upper_position[index]),
        }
        if name in robot.velocity_names:
            v = robot.velocity_names.index(name)
            row |= {
                "velocity": _size(robot.velocity_limit[v]),
                "effort": _limits(robot.lower_effort[v], robot.upper_effort[v]),
                "damping": float(robot.model.damping[v]),
                "armature": float(robot.model.armature[v]),
                "dry friction": float(robot.dry_friction_limits[v]),
                "spring": springs.get(v),
            }
        yield row


def _limits(lower: float, upper: float) -> list[float | None] | None:
    ends = [float(end) if np.isfinite(end) else None for end in (lower, upper)]
    return None if ends == [None, None] else ends


def _size(limit: float) -> float | None:
    return float(limit) if np.isfinite(limit) else None


def _frames(robot: Robot) -> Iterator[dict[str, Any]]:
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.neutral)
    for frame, pose in list(zip(model.frames, data.oMf, strict=True))[1:]:
        kind = str(frame.type).rpartition(".")[2].lower().replace("op_frame", "site").replace("_", " ")
        yield {"name": frame.name, "kind": kind, "on": model.names[frame.parentJoint], "position": _rounded(pose)}


def _shapes(robot: Robot) -> Iterator[dict[str, Any]]:
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.neutral)
    for shape in robot.collision_shapes:
        pose = data.oMf[robot.frame_id(shape.body)] * shape.placement
        kind, sizes = _shape_size(shape.geometry)
        yield {
            "body": shape.body,
            "name": shape.name,
            "kind": kind,
            "size": sizes,
            "position": _rounded(pose),
            "friction": shape.friction,
        }


def _rounded(pose: pin.SE3) -> list[float]:
    return [float(value) for value in np.round(pose.translation, _DECIMALS) + 0.0]


def _shape_size(geometry: Any) -> tuple[str, Sequence[float]]:
    """Return the kind of a shape and its size: a radius, then a length, or the lengths of its edges, m."""
    kind = type(geometry).__name__.lower()
    if kind in ("box", "ellipsoid"):
        halves = geometry.halfSide if kind == "box" else geometry.radii
        return kind, [float(2 * half) for half in np.ravel(halves)]
    if kind == "sphere":
        return kind, [float(geometry.radius)]
    if kind in ("capsule", "cylinder", "cone"):
        return kind, [float(geometry.radius), float(2 * geometry.halfLength)]
    geometry.computeLocalAABB()
    box = geometry.aabb_local
    return "mesh", [float(edge) for edge in np.ravel(box.max_) - np.ravel(box.min_)]
