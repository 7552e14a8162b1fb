"""Everything the page shows, as commands of Meshcat: robot, motion and traces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.animation import Motion, joint_tracks
from fesd_robot.render.geometry import make_visual, mesh
from fesd_robot.render.meshcat.animation import Animation, AnimationClip
from fesd_robot.render.meshcat.commands import SetAnimation, SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
from fesd_robot.render.meshes import Meshes
from fesd_robot.render.palette import color_number, series_color
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.render.window import SceneWindow

TUBE_SIDES = 6


def view_box(motions: Sequence[Motion], others: Sequence[np.ndarray], ground: GroundVisual) -> np.ndarray:
    """Return the corners of the box the camera must see, m, shape (2, 3): robots, other points, solids and ground.

    The box of a robot without shapes is not finite, and left out.
    """
    solids = [solid.corners() for solid in ground.solids.values()]
    boxes = (motion.box for motion in motions)
    points = [each for each in (*others, *solids, *boxes) if np.isfinite(each).all()]
    cloud = np.vstack(points or [np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]])])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    levels = ground.levels(low, high)
    low[2], high[2] = min(low[2], *levels), max(high[2], *levels)
    return np.array([low, high])


def add_robot(
    window: SceneWindow,
    model: pin.Model,
    visual_model: pin.GeometryModel,
    motion: Motion,
    meshes: Meshes,
    root: str = "robot",
) -> dict[Path, AnimationClip]:
    """Add one node per joint, nested as in the kinematic tree, and the geometry below it; return how the joints move.

    Only joint nodes move: placement and scale of the geometry stay in nodes of their own, which keeps mirrored
    meshes whole, and between key times every joint moves along its own axis instead of drifting off its parent.
    """
    paths = joint_paths(model, root)
    clips = {}
    for joint, path in enumerate(paths):
        window.send(SetTransform(pin.XYZQUATToSE3(motion.placement[0, joint]).homogeneous, path))
        tracks = joint_tracks(motion, joint)
        if tracks:
            clips[path] = AnimationClip(tracks=tracks, fps=1, name=f"{root} joint {joint}")
    for index, geometry_object in enumerate(visual_model.geometryObjects):
        visual = make_visual(geometry_object, meshes)
        if visual is not None:
            parent = paths[geometry_object.parentJoint].entries
            path = Path((*parent, f"shape {index} {_label(geometry_object.name)}"))
            window.send(SetObject(visual.element, path=path))
            window.send(SetTransform(visual.matrix, path))
    return clips


def add_animation(window: SceneWindow, clips: Mapping[Path, AnimationClip]) -> None:
    """Add the motion of all joints; the viewer keeps one animation."""
    animation = Animation(default_framerate=1)
    animation.clips.update(clips)
    window.send(SetAnimation(animation, play=False))


def joint_paths(model: pin.Model, root: str = "robot") -> list[Path]:
    """Return the place of every joint's node in the scene tree, all below one."""
    paths = [Path((root,))]
    for joint in range(1, model.njoints):
        paths.append(Path((*paths[model.parents[joint]].entries, f"{joint} {_label(model.names[joint])}")))
    return paths


def add_traces(window: SceneWindow, traces: Mapping[str, np.ndarray], radius: float) -> None:
    """Add each path as a thin tube, because browsers draw lines one pixel wide only.

    Args:
        traces: name -> points, m, shape (n, 3).
        radius: of the tubes, m.
    """
    for index, (name, points) in enumerate(traces.items()):
        corners = _thinned(points, radius / 2)
        if len(corners) < 2:
            continue
        vertices, faces = tube(corners, radius)
        material = mg.MeshBasicMaterial(color=color_number(series_color(index)))
        element = mesh(f"trace {index}", mg.TriangularMeshGeometry(vertices, faces), material)
        window.send(SetObject(element, path=Path(("traces", f"{index} {_label(name)}"))))


def _thinned(points: np.ndarray, distance: float) -> np.ndarray:
    """Return the first point and those at least `distance` from the one returned before them."""
    chosen = [0]
    for index in range(1, len(points)):
        if np.linalg.norm(points[index] - points[chosen[-1]]) >= distance:
            chosen.append(index)
    return points[chosen]


def tube(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices, shape (m * sides, 3), and faces of a tube along a polyline, shape (m, 3)."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    normal = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    angle = np.linspace(0.0, 2.0 * np.pi, TUBE_SIDES, endpoint=False)
    rings = np.empty((len(points), TUBE_SIDES, 3))
    for index, (point, along) in enumerate(zip(points, tangent, strict=True)):
        # Carrying the normal along keeps the tube from twisting.
        normal = normal - along * (normal @ along)
        if np.linalg.norm(normal) < 1e-6:
            normal = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        normal = normal / np.linalg.norm(normal)
        rings[index] = point + radius * (
            np.outer(np.cos(angle), normal) + np.outer(np.sin(angle), np.cross(along, normal))
        )
    ring, side = np.meshgrid(np.arange(len(points) - 1), np.arange(TUBE_SIDES), indexing="ij")
    here, beside = ring * TUBE_SIDES + side, ring * TUBE_SIDES + (side + 1) % TUBE_SIDES
    faces = np.stack([here, beside, beside + TUBE_SIDES, here, beside + TUBE_SIDES, here + TUBE_SIDES], axis=-1)
    return rings.reshape(-1, 3), faces.reshape(-1, 3)


def _label(name: str) -> str:
    """Return a name that can stand in a path of the scene tree."""
    return name.replace("/", "_")
