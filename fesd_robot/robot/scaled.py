"""Models whose masses or lengths are those of the file times a factor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.model_file import ModelFile, Shape


@dataclass(frozen=True)
class ModelScale:
    """Factors on quantities of a model.

    A factor on lengths moves joints, frames and centres of mass, and stretches shapes; inertias grow with its square,
    masses stay. Ranges of joints stay as they are, also of those that slide.

    Args:
        mass: on all masses, with their inertias.
        length: on all lengths.
        link_mass, link_length: name of a link -> further factor on the mass and the lengths of the body that it belongs
            to, all links that are fixed to each other.
    """

    mass: float = 1.0
    length: float = 1.0
    link_mass: Mapping[str, float] = field(default_factory=dict)
    link_length: Mapping[str, float] = field(default_factory=dict)

    @property
    def changes_nothing(self) -> bool:
        """Whether all factors are one."""
        factors = (self.mass, self.length, *self.link_mass.values(), *self.link_length.values())
        return all(factor == 1.0 for factor in factors)


def scaled_model(path: Path, read: ModelFile, scale: ModelScale) -> ModelFile:
    """Return a model file whose model and shapes are scaled.

    Args:
        path: of the file, for messages.
        read: before joints are locked or coupled.
        scale: the factors.

    Raises:
        RobotError: a link that the model does not have.
    """
    if scale.changes_nothing:
        return read
    model = read.model.copy()
    bodies = {frame.name: frame.parentJoint for frame in model.frames if frame.type == pin.FrameType.BODY}
    masses = _by_joint(path, bodies, model.njoints, scale.mass, scale.link_mass)
    lengths = _by_joint(path, bodies, model.njoints, scale.length, scale.link_length)
    for joint in range(model.njoints):
        model.inertias[joint] = _inertia(model.inertias[joint], masses[joint], lengths[joint])
        model.jointPlacements[joint] = _moved(model.jointPlacements[joint], lengths[model.parents[joint]])
    for frame in model.frames:
        factor = lengths[frame.parentJoint]
        frame.placement = _moved(frame.placement, factor)
        frame.inertia = _inertia(frame.inertia, masses[frame.parentJoint], factor)
    by_body = {name: float(lengths[joint]) for name, joint in bodies.items() if lengths[joint] != 1.0}
    shapes = (
        None if read.shapes is None else [scaled_shape(shape, by_body.get(shape.body, 1.0)) for shape in read.shapes]
    )
    return replace(read, model=model, shapes=shapes, lengths=by_body)


def scaled_shape(shape: Shape, factor: float) -> Shape:
    """Return a shape that is larger by a factor, as is its distance from the frame that it is on."""
    if factor == 1.0:
        return shape
    geometry = _stretched(shape.geometry, factor)
    return replace(shape, placement=_moved(shape.placement, factor), geometry=geometry)


def scale_shapes(model: pin.Model, shapes: pin.GeometryModel, lengths: Mapping[str, float]) -> pin.GeometryModel:
    """Scale the shapes that Pinocchio has read from a file, in place, and return them.

    Args:
        model: on whose bodies they are, scaled.
        shapes: as they are in the file.
        lengths: name of a body's frame -> factor.
    """
    for one in shapes.geometryObjects:
        frame = model.frames[one.parentFrame]
        factor = lengths.get(frame.name, 1.0)
        if factor == 1.0:
            continue
        # The reader has put it beside the frame, which is at its new place already.
        one.placement = frame.placement * _moved(frame.placement.actInv(one.placement), factor)
        if Path(one.meshPath).is_file():
            one.meshScale = factor * np.ravel(one.meshScale)
            one.geometry = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS).load(one.meshPath, np.ravel(one.meshScale))
        else:
            one.geometry = _stretched(one.geometry, factor)
    return shapes


def _by_joint(
    path: Path, bodies: Mapping[str, int], count: int, all_of_them: float, single: Mapping[str, float]
) -> np.ndarray:
    """Return the factor of every joint's body, (n_joints)."""
    factors = np.full(count, all_of_them)
    for link, factor in single.items():
        if link not in bodies:
            raise RobotError(f"{path}: there is no link '{link}' to scale{nearest(link, bodies)}.")
        factors[bodies[link]] *= factor
    return factors


def _inertia(inertia: pin.Inertia, mass: float, length: float) -> pin.Inertia:
    if mass == 1.0 and length == 1.0:
        return inertia
    return pin.Inertia(mass * inertia.mass, length * inertia.lever, mass * length**2 * inertia.inertia)


def _moved(placement: pin.SE3, factor: float) -> pin.SE3:
    return pin.SE3(placement.rotation, factor * placement.translation)


def _box(shape: Any, factor: float) -> Any:
    return coal.Box(*(2.0 * factor * np.ravel(shape.halfSide)))


_STRETCHED: Sequence[tuple[type, Callable[[Any, float], Any]]] = (
    (coal.Sphere, lambda shape, factor: coal.Sphere(factor * shape.radius)),
    (coal.Ellipsoid, lambda shape, factor: coal.Ellipsoid(*(factor * np.ravel(shape.radii)))),
    (coal.Box, _box),
    (coal.Cylinder, lambda shape, factor: coal.Cylinder(factor * shape.radius, 2.0 * factor * shape.halfLength)),
    (coal.Cone, lambda shape, factor: coal.Cone(factor * shape.radius, 2.0 * factor * shape.halfLength)),
    (coal.Capsule, lambda shape, factor: coal.Capsule(factor * shape.radius, 2.0 * factor * shape.halfLength)),
)


def _stretched(shape: Any, factor: float) -> Any:
    """Return a shape of coal that is larger by a factor."""
    for kind, stretch in _STRETCHED:
        if isinstance(shape, kind):
            return stretch(shape, factor)
    if isinstance(shape, coal.BVHModelBase):
        larger = coal.BVHModelOBBRSS()
        corners, count = factor * np.array(shape.vertices()), shape.num_tris
        larger.beginModel(count, len(corners))
        larger.addVertices(corners)
        triangles = [shape.tri_indices(number) for number in range(count)]
        larger.addTriangles(np.array([[each[0], each[1], each[2]] for each in triangles], dtype=np.int64))
        larger.endModel()
        return larger
    raise RobotError(f"found a shape of kind {type(shape).__name__}, expected one whose lengths can be scaled.")
