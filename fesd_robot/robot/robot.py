"""The robot: a Pinocchio model, its tree of links, names for every coordinate, limits and frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.printable import has_hidden, visible
from fesd_robot.robot.body_names import SEPARATOR, name_on, shapes_on, visuals_on
from fesd_robot.robot.followers import LimitNotes
from fesd_robot.robot.model_file import Format, MultiJointMotor, Shape, Spring, geometry_model, shapes_of
from fesd_robot.robot.reader_errors import captured_errors, last_sentence
from fesd_robot.robot.root import ROOT_JOINT
from fesd_robot.robot.scaled import scale_shapes
from fesd_robot.robot.tree import Tree
from fesd_robot.robot.urdf_shapes import urdf_shapes


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot as it was read from its file; nothing in it is to be modified.

    Attributes:
        name: name given in the file.
        source: the file.
        format: how the file is written.
        package_directories: where ``package://`` addresses of meshes are looked up.
        model: Pinocchio's model, with ``model.armature``, ``model.damping`` and the limits of dry friction set, without
            locked joints and with coupled ones merged.
        tree: the same model as links, for the CasADi expressions.
        configuration_names: a name for every entry of q: the joint's name, or for joints with several entries
            ``joint.x .y .z .qx .qy .qz .qw`` (free flyer), ``joint.x .y .cos .sin`` (planar), ``joint.cos .sin``
            (unbounded revolute), ``joint.qx .qy .qz .qw`` (spherical). Of a MuJoCo file, q is MuJoCo's qpos but for
            the order of quaternions.
        velocity_names: a name for every entry of v: the joint's name, or ``joint.vx .vy .vz .wx .wy .wz`` (free flyer),
            ``joint.vx .vy .wz`` (planar), ``joint.wx .wy .wz`` (spherical).
        lower_position, upper_position: limits of q, m or rad, shape (nq,); ±inf where there is none, and for entries
            that are cosines, sines or quaternion components.
        velocity_limit: limit of |v|, m/s or rad/s, shape (nv,); inf where there is none.
        lower_effort, upper_effort: limits of τ, N or N m, shape (nv,); ±inf where there is none; of coupled joints the
            sum.
        joint_springs: name of a joint with one degree of freedom -> its spring.
        drives: name of a motor of the file that pushes several joints -> how; those that push one are in the limits.
        postures: name -> name of a configuration coordinate -> value, m or rad: keyframes of the file.
        frame_names: names of all frames, each once.
        neutral: the configuration with every joint at zero, shape (nq,).
        notes: what the file says that the equations of motion leave out, one sentence each.
        warnings: likely mistakes in the file, one sentence each.
        shapes: of all bodies; None where Pinocchio reads them from the file, when they are drawn.
        limit_notes: limits that are not those of their joint in the file, with where they are from.
        lengths: name of a link whose lengths are not those of the file -> factor on them.
        bodies: name -> the same for every free body beside it, which is a part of the model and of all names here, but
            not of the shapes.
        limit_surfaces: name -> names of the velocity coordinates whose dry friction is bounded by one ellipsoid, with
            the limits F of these for its axes.
    """

    name: str
    source: Path
    format: Format
    package_directories: tuple[Path, ...]
    model: pin.Model = field(repr=False)
    tree: Tree = field(repr=False)
    configuration_names: list[str]
    velocity_names: list[str]
    lower_position: np.ndarray = field(repr=False)
    upper_position: np.ndarray = field(repr=False)
    velocity_limit: np.ndarray = field(repr=False)
    lower_effort: np.ndarray = field(repr=False)
    upper_effort: np.ndarray = field(repr=False)
    joint_springs: Mapping[str, Spring] = field(repr=False)
    drives: Mapping[str, MultiJointMotor] = field(repr=False)
    postures: Mapping[str, Mapping[str, float]] = field(repr=False)
    frame_names: list[str] = field(repr=False)
    neutral: np.ndarray = field(repr=False)
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    shapes: Sequence[Shape] | None = field(default=None, repr=False)
    limit_notes: LimitNotes = field(default_factory=dict, repr=False)
    lengths: Mapping[str, float] = field(default_factory=dict, repr=False)
    bodies: Mapping[str, Robot] = field(default_factory=dict, repr=False)
    limit_surfaces: Mapping[str, tuple[str, ...]] = field(default_factory=dict, repr=False)

    def frame_id(self, name: str) -> int:
        """Return Pinocchio's index of the frame called `name`; a link or site goes before a joint of the same name.

        Raises:
            RobotError: if there is none, naming the nearest one, or if several at different places share the name.
        """
        frames = self.model.frames
        named = [index for index in range(self.model.nframes) if frames[index].name == name]
        if not named:
            raise RobotError(f"Robot '{self.name}' has no frame '{name}'{nearest(name, self.frame_names)}.")
        joints = (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)
        named = [index for index in named if frames[index].type not in joints] or named
        first = frames[named[0]]
        for index in named[1:]:
            other = frames[index]
            if other.parentJoint != first.parentJoint or not other.placement.isApprox(first.placement, 1e-12):
                raise RobotError(
                    f"Robot '{self.name}' has several frames called '{name}' at different places; rename one of them."
                )
        return named[0]

    @cached_property
    def springs(self) -> list[tuple[int, int, float, float]]:
        """Entry of v, entry of q, stiffness k and rest of every spring."""
        return [
            (link.v_indices.start, link.q_indices.start, spring.stiffness, spring.rest)
            for link in self.tree.links
            if not link.mimics and (spring := self.joint_springs.get(link.name))
        ]

    @property
    def dry_friction_limits(self) -> np.ndarray:
        """Limit F of the dry friction -F Sgn(v) of every velocity coordinate, N or N m, (nv,)."""
        return np.abs(np.array(self.model.upperDryFrictionLimit))

    @property
    def dry_friction(self) -> dict[str, float]:
        """Velocity coordinate -> limit of its dry friction, N or N m, of those that have some."""
        limits = zip(self.velocity_names, self.dry_friction_limits.tolist(), strict=True)
        return {name: limit for name, limit in limits if limit}

    @property
    def driven(self) -> np.ndarray:
        """Whether effort limits are those of a motor: finite, and apart; (nv) of bool."""
        width = self.upper_effort - self.lower_effort
        return np.asarray(np.isfinite(width) & (width > 0))

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints that have coordinates of their own; those of a MuJoCo body with several one by one."""
        return [link.name for link in self.tree.links if not link.mimics]

    @property
    def root_names(self) -> list[str]:
        """Names of the entries of v that belong to the joints under the first links of robot and bodies."""
        joints = [self.model.joints[index] for index in self.root_joints]
        return [name for joint in joints for name in self.velocity_names[joint.idx_v : joint.idx_v + joint.nv]]

    @property
    def root_joints(self) -> list[int]:
        """Pinocchio's indices of the joints under the first links of robot and bodies, without those that are fixed."""
        names = [ROOT_JOINT, *(name_on(body, ROOT_JOINT) for body in self.bodies)]
        found = [self.model.getJointId(name) for name in names if self.model.existJointName(name)]
        # A joint of a file that happens to have this name has one degree of freedom.
        return [index for index in found if self.model.joints[index].nv > 1]

    def roots_under(self, frame: str, names: Sequence[str]) -> list[str]:
        """Return those coordinates of a root that the robot has, by their names on the body to which a frame belongs.

        Args:
            frame: name of a frame.
            names: of coordinates of a root, as ``root_z``.
        """
        body = self.body_of(frame)
        own = names if body is None else [name_on(body, name) for name in names]
        return [name for name in own if name in self.configuration_names]

    def body_of(self, name: str) -> str | None:
        """Return the body to which a joint, a coordinate or a frame belongs by its name, None for the robot's own."""
        body = name.partition(SEPARATOR)[0]
        return body if body in self.bodies else None

    def __post_init__(self) -> None:
        for name in (*self.model.names, *self.frame_names):
            if has_hidden(name):
                raise RobotError(
                    f"{self.source}: found the name '{visible(name)}', expected no control characters in it."
                )

    @cached_property
    def collision_shapes(self) -> Sequence[Shape]:
        """The shapes that the file lets collide, on their bodies.

        Raises:
            RobotError: if a mesh is missing or unreadable.
        """
        if self.shapes is not None:
            own = [shape for shape in self.shapes if shape.touches]
        else:
            own = shapes_of(self.model, self._read_shapes(pin.GeometryType.COLLISION))
        return [*own, *(shape for name, body in self.bodies.items() for shape in shapes_on(name, body))]

    @cached_property
    def visual_model(self) -> pin.GeometryModel:
        """The shapes to draw; read from the file on first use, so that planning needs no meshes.

        Raises:
            RobotError: if a mesh is missing or unreadable.
        """
        drawn = (
            self._read_shapes(pin.GeometryType.VISUAL)
            if self.shapes is None
            else geometry_model(self.model, self.shapes)
        )
        for name, body in self.bodies.items():
            for one in visuals_on(name, body, self.model):
                drawn.addGeometryObject(one)
        return drawn

    def _read_shapes(self, kind: pin.GeometryType) -> pin.GeometryModel:
        directories = self.package_directories
        with captured_errors():
            try:
                if self.format == "sdf":
                    read = pin.buildGeomFromSdf(self.model, str(self.source), kind, "", [*map(str, directories)])
                else:
                    read = urdf_shapes(self.source, self.model, kind, directories)
                return scale_shapes(self.model, read, self.lengths)
            except RobotError:
                raise
            except Exception as error:
                said = last_sentence(str(error)).rstrip(".")
                raise RobotError(f"The shapes of {self.source} cannot be read: {said}.") from error
