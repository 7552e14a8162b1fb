"""The contacts of a task as pairs of shapes."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import mujoco
import numpy as np

from fesd_robot.contact import CircleOnBox, CircleOnCircle, CircleOnSurface, PointOnSurface, TwoBodies
from fesd_robot.contact.ground import HeightField
from fesd_robot.in_mujoco.bodies import STIFF_IMPEDANCE, Bodies, quaternion
from fesd_robot.in_mujoco.impacts import bouncing, rubbing, spread, stiff
from fesd_robot.in_mujoco.surfaces import FAR, SurfaceShapes, add_surface
from fesd_robot.ocp import MotionProblem, friction_of, restitution_of
from fesd_robot.task import TwoBodyContact

POINT = 1e-5
"""m; radius of the sphere that a point is; it touches where its centre does."""

POINT_ON_GRID = 1e-3
"""m; the same on a height field, whose distance from spheres MuJoCo finds to a micrometre."""

_BODY_COLOR = [0.25, 0.4, 0.7, 0.6]


class Contacts:
    """The contacts of a task in a scene.

    Args:
        spec: the scene.
        bodies: of the robot in it.
        motion: the task, formulated.
        friction: factor of all coefficients.
        sliding: names of contacts that slide nearly all of the time.
        time_step: s.

    Attributes:
        pairs: name of a contact -> names of its pairs.
        notes: how they differ from the plan's, one sentence each.
    """

    def __init__(
        self,
        spec: mujoco.MjSpec,
        bodies: Bodies,
        motion: MotionProblem,
        *,
        friction: float,
        sliding: Collection[str],
        time_step: float,
    ) -> None:
        self._spec, self._bodies, self._motion = spec, bodies, motion
        self._friction, self._sliding, self._time_step = friction, sliding, time_step
        self._shapes: dict[str, SurfaceShapes] = {
            name: add_surface(surface, spec, name) for name, surface in motion.scene.surfaces.items()
        }
        self.pairs: Mapping[str, list[str]] = {name: self._add(name) for name in motion.scene.geometries}
        used = [_surface(motion, name) for name in motion.scene.geometries]
        self.notes = [shapes.note for name, shapes in self._shapes.items() if shapes.note and name in used]
        bounces = {name: restitution_of(motion.task, name) for name in self.pairs}
        self.notes += [
            f"contact {name} has the restitution {value:g} by a spring and a damper: to {spread(value):.1g} where it "
            "hits alone, within a millisecond; where several hit at once, another one"
            for name, value in bounces.items()
            if value > 0
        ]

    def _add(self, name: str) -> list[str]:
        """Add the shapes of a contact and a pair for each, and return the names of the pairs."""
        motion, geometry = self._motion, self._motion.scene.geometries[name]
        if isinstance(geometry, TwoBodies):
            own = self._sphere(f"{name}", geometry.frame, geometry.radius, in_plane=not motion.in_space)
            return [self._pair(name, name, own, self._other(name, geometry), 0.0)]
        surface = _surface(motion, name)
        radius, margin = (geometry.radius, 0.0) if isinstance(geometry, CircleOnSurface) else (POINT, -POINT)
        if isinstance(geometry, PointOnSurface) and isinstance(motion.scene.surfaces[surface], HeightField):
            radius, margin = POINT_ON_GRID, -POINT_ON_GRID
        own = self._sphere(f"{name}", geometry.frame, radius, in_plane=False)
        names = self._shapes[surface].names
        labels = [name] if len(names) == 1 else [f"{name} {number}" for number in range(len(names))]
        return [self._pair(name, label, own, each, margin) for label, each in zip(labels, names, strict=True)]

    def _sphere(self, name: str, frame: str, radius: float, *, in_plane: bool) -> str:
        body, placement = self._bodies.frame(frame)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0, 0],
            pos=placement.act(self._to_plane(frame)) if in_plane else placement.translation,
            contype=0,
            conaffinity=0,
            rgba=_BODY_COLOR,
        )
        return name

    def _other(self, name: str, geometry: CircleOnCircle | CircleOnBox) -> str:
        """Add the circle, ball or box that another one touches; boxes in the plane are wide."""
        frame, label, in_plane = geometry.other_frame, f"{name} other", not self._motion.in_space
        if isinstance(geometry, CircleOnCircle):
            return self._sphere(label, frame, geometry.other_radius, in_plane=in_plane)
        body, placement = self._bodies.frame(frame)
        sides = geometry.other_size
        size = [side / 2 for side in sides] if len(sides) == 3 else [sides[0] / 2, FAR, sides[1] / 2]
        body.add_geom(
            name=label,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=size,
            pos=placement.act(self._to_plane(frame)) if in_plane else placement.translation,
            quat=quaternion(placement.rotation),
            contype=0,
            conaffinity=0,
            rgba=_BODY_COLOR,
        )
        return label

    def _to_plane(self, frame: str) -> np.ndarray:
        """Return the point of y = 0 beside a frame that keeps to a plane, in its own axes, m."""
        placement = self._bodies.neutral_placement(frame)
        return np.asarray(placement.rotation.T @ np.array([0.0, -placement.translation[1], 0.0]))

    def _pair(self, name: str, label: str, first: str, second: str, margin: float) -> str:
        task = self._motion.task
        friction, restitution = self._friction * friction_of(task, name), restitution_of(task, name)
        solref = bouncing(restitution, self._time_step) if restitution else stiff(self._time_step)
        self._spec.add_pair(
            name=label,
            geomname1=first,
            geomname2=second,
            condim=3 if friction else 1,
            friction=[friction, friction, 0, 0, 0],
            margin=margin,
            solref=solref,
            solreffriction=rubbing(self._time_step, slides=name in self._sliding),
            solimp=STIFF_IMPEDANCE,
        )
        return label


def _surface(motion: MotionProblem, name: str) -> str:
    """Return the name of the surface that a contact touches, empty if it is another body."""
    contact = motion.task.single_contacts[name]
    return "" if isinstance(contact, TwoBodyContact) else contact.surface
