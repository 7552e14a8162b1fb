"""The ground and the contacts of a task as geometry."""

from __future__ import annotations

from fesd_robot.contact import (
    CircleOnCircle,
    CircleOnSurface,
    ContactGeometry,
    Ground,
    Plane,
    PointOnSurface,
    Scene,
    Terrain,
    Wall,
)
from fesd_robot.contact.ground import height_map, read_heights, steps
from fesd_robot.errors import GroundError
from fesd_robot.task import GROUND, CircleCircleContact, HeightMap, PointContact, Steps, Task


def surfaces_of(task: Task) -> dict[str, Ground]:
    """Return every surface by name: the ground, and the walls.

    Raises:
        TaskError: too many steps, or the file of a height map is missing, no table of heights, or too steep.
    """
    walls = {name: Wall(wall.x, wall.side) for name, wall in task.ground.walls.items()}
    return {GROUND: _ground(task), **walls}


def scene_of(task: Task) -> Scene:
    """Return everything that the robot may touch.

    Raises:
        TaskError: a ground that cannot be built, or a circle that does not fit into its hollows.
    """
    surfaces = surfaces_of(task)
    return Scene(surfaces, {name: _geometry(task, name, surfaces) for name in task.contacts})


def friction_of(task: Task, name: str) -> float:
    """Return the friction coefficient of a contact: its own, or that of the surface it touches."""
    contact, ground = task.contacts[name], task.ground
    if contact.friction is not None:
        return contact.friction
    if isinstance(contact, CircleCircleContact) or contact.surface == GROUND:
        return ground.friction
    return ground.walls[contact.surface].friction


def _ground(task: Task) -> Ground:
    ground = task.ground
    if isinstance(ground, Steps):
        edges, heights = [step.x for step in ground.steps], [step.height for step in ground.steps]
        try:
            return Terrain(steps(ground.height, edges, heights, ground.smoothing))
        except GroundError as error:
            raise task.error("ground.steps", str(error)) from error
    if isinstance(ground, HeightMap):
        try:
            return Terrain(height_map(*read_heights(task.folder / ground.file)))
        except GroundError as error:
            raise task.error("ground.file", f"found '{ground.file}', but {error}") from error
    return Plane(ground.height, ground.slope)


def _geometry(task: Task, name: str, surfaces: dict[str, Ground]) -> ContactGeometry:
    contact = task.contacts[name]
    if isinstance(contact, CircleCircleContact):
        return CircleOnCircle(contact.frame, contact.radius, contact.other_frame, contact.other_radius)
    surface = surfaces[contact.surface]
    if isinstance(contact, PointContact):
        return PointOnSurface(contact.frame, surface)
    try:
        return CircleOnSurface(contact.frame, contact.radius, surface.raised(contact.radius))
    except GroundError as error:
        raise task.error(("contacts", name, "radius"), str(error)) from error
