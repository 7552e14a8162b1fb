"""The ground and the contacts of a task as geometry."""

from __future__ import annotations

import math
from functools import singledispatch
from pathlib import Path

from fesd_robot.contact import (
    CircleOnBox,
    CircleOnCircle,
    CircleOnSurface,
    ContactGeometry,
    Ground,
    PointOnSurface,
    Scene,
    Surface,
)
from fesd_robot.contact import ground as surfaces
from fesd_robot.contact.ground import profiles
from fesd_robot.errors import GroundError, ModelError
from fesd_robot.task import (
    GROUND,
    BoxSurface,
    CircleBoxContact,
    CircleCircleContact,
    CylinderSurface,
    GroundShape,
    HeightMap,
    Plane,
    PointContact,
    SolidSurface,
    Steps,
    Task,
    TwoBodyContact,
    Wall,
)


def surfaces_of(task: Task) -> dict[str, Surface]:
    """Return every surface by name: the ground, the walls, the boxes and cylinders.

    Raises:
        TaskError: the ground cannot be built, see `ground_of`.
    """
    walls = {name: _wall(wall) for name, wall in task.ground.walls.items()}
    solids = {name: solid_of(surface) for name, surface in task.surfaces.items()}
    return {GROUND: ground_of(task), **walls, **solids}


def ground_of(task: Task) -> Ground:
    """Return the ground.

    Raises:
        TaskError: too many steps, or the file of a height map is missing, no table of heights, or too steep.
    """
    try:
        return surface_of(task.ground, task.folder)
    except GroundError as error:
        raise task.error(("ground", task.ground.BUILT_FROM), str(error)) from error


def scene_of(task: Task) -> Scene:
    """Return everything that the robot may touch.

    Raises:
        TaskError: a ground that cannot be built, or a circle that does not fit into its hollows.
    """
    by_name = surfaces_of(task)
    return Scene(by_name, {name: _geometry(task, name, by_name) for name in task.contacts})


def friction_of(task: Task, name: str) -> float:
    """Return the friction coefficient of a contact: its own, or that of the surface it touches."""
    own = task.contacts[name].friction
    return _surface_of_contact(task, name).friction if own is None else own


def reserve_of(task: Task, name: str) -> float:
    """Return the part of its cone that a contact leaves unused where it sticks: its own, or that of the task."""
    own = task.contacts[name].reserve
    return task.reserve.friction if own is None else own


def restitution_of(task: Task, name: str) -> float:
    """Return the coefficient of restitution of a contact: its own, or that of the surface it touches."""
    own = task.contacts[name].restitution
    return _surface_of_contact(task, name).restitution if own is None else own


def compliance_of(task: Task) -> dict[str, tuple[float, float]]:
    """Return name of every compliant contact -> its stiffness, N/m, and damping, N s/m."""
    return {name: (one.stiffness, one.damping or 0.0) for name, one in task.contacts.items() if one.stiffness}


def _surface_of_contact(task: Task, name: str) -> GroundShape | Wall | SolidSurface:
    """Return the section of the surface that a contact touches; the ground's for two bodies."""
    contact = task.contacts[name]
    if isinstance(contact, TwoBodyContact) or contact.surface == GROUND:
        return task.ground
    return {**task.ground.walls, **task.surfaces}[contact.surface]


@singledispatch
def surface_of(shape: GroundShape, folder: Path) -> Ground:
    """Return the surface of a task's ground.

    Args:
        shape: the section `ground` of a task.
        folder: where relative paths start.

    Raises:
        GroundError: the surface cannot be built.
    """
    raise ModelError(f"no surface is known for {type(shape).__name__}")


@surface_of.register
def _plane(shape: Plane, folder: Path) -> Ground:
    if shape.lateral_slope:
        return surfaces.tilted_plane(shape.height, shape.slope, shape.lateral_slope)
    return surfaces.Plane(shape.height, shape.slope)


@surface_of.register
def _steps(shape: Steps, folder: Path) -> Ground:
    edges, heights = [step.x for step in shape.steps], [step.height for step in shape.steps]
    return surfaces.Terrain(profiles.steps(shape.height, edges, heights, shape.smoothing))


@surface_of.register
def _height_map(shape: HeightMap, folder: Path) -> Ground:
    path = folder / shape.file
    try:
        if shape.size is not None and shape.height is not None:
            return surfaces.HeightField.through(*surfaces.read_image(path, shape.size, shape.height, shape.origin))
        points = surfaces.read_heights(path)
        if isinstance(points, surfaces.Grid):
            return surfaces.HeightField.through(*points)
        return surfaces.Terrain(profiles.height_map(*points))
    except GroundError as error:
        raise GroundError(f"found '{shape.file}', but {error}") from error


def _wall(wall: Wall) -> Surface:
    if wall.place is not None and wall.facing is not None:
        return surfaces.facing_wall(wall.place, wall.facing)
    assert wall.x is not None and wall.side is not None
    return surfaces.Wall(wall.x, wall.side)


@singledispatch
def solid_of(surface: SolidSurface) -> surfaces.Solid:
    """Return the solid of a task's box or cylinder."""
    raise ModelError(f"no solid is known for {type(surface).__name__}")


@solid_of.register
def _box(surface: BoxSurface) -> surfaces.Solid:
    pose = surfaces.Pose.turned(surface.center, surface.yaw, surface.pitch)
    x, y, z = (math.inf if edge is None else edge / 2 - surface.edge_radius for edge in surface.size)
    return surfaces.Box(pose, surface.edge_radius, (x, y, z), underside=surface.underside)


@solid_of.register
def _cylinder(surface: CylinderSurface) -> surfaces.Solid:
    half = math.inf if surface.length is None else surface.length / 2 - surface.edge_radius
    pose = surfaces.Pose.turned(surface.center, surface.yaw).along(surface.axis)
    underside = bool(surface.underside) or surface.axis != "z"
    return surfaces.Cylinder(pose, surface.edge_radius, surface.radius - surface.edge_radius, half, underside=underside)


def _geometry(task: Task, name: str, by_name: dict[str, Surface]) -> ContactGeometry:
    contact = task.single_contacts[name]
    if isinstance(contact, CircleCircleContact):
        assert contact.other_radius is not None
        return CircleOnCircle(contact.frame, contact.radius, contact.other_frame, contact.other_radius, contact.facing)
    if isinstance(contact, CircleBoxContact):
        assert contact.other_size is not None
        return CircleOnBox(contact.frame, contact.radius, contact.other_frame, contact.other_size, contact.facing)
    surface = by_name[contact.surface]
    if isinstance(contact, PointContact):
        return PointOnSurface(contact.touching_frame, surface)
    try:
        return CircleOnSurface(contact.touching_frame, contact.radius, surface.raised(contact.radius))
    except GroundError as error:
        raise task.error(("contacts", name, "radius"), str(error)) from error
