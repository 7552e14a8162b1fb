"""The robot: a Pinocchio model, its tree of links, names for every coordinate, limits and frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.root import ROOT_JOINT
from fesd_robot.robot.tree import Tree

Format = Literal["urdf", "mjcf", "sdf"]


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot as it was read from its file; nothing in it is to be modified.

    Attributes:
        name: name given in the file.
        source: the file.
        format: how the file is written.
        package_directories: where ``package://`` addresses of meshes are looked up.
        model: Pinocchio's model, with ``model.armature`` and ``model.damping`` set, without locked joints and with
            coupled ones merged.
        tree: the same model as links, for the CasADi expressions.
        configuration_names: a name for every entry of q: the joint's name, or for joints with several entries
            ``joint.x .y .z .qx .qy .qz .qw`` (free flyer), ``joint.x .y .cos .sin`` (planar), ``joint.cos .sin``
            (unbounded revolute), ``joint.qx .qy .qz .qw`` (spherical). The joints of a MuJoCo body with several keep
            their own names, and their q is MuJoCo's qpos.
        velocity_names: a name for every entry of v: the joint's name, or ``joint.vx .vy .vz .wx .wy .wz`` (free flyer),
            ``joint.vx .vy .wz`` (planar), ``joint.wx .wy .wz`` (spherical).
        lower_position, upper_position: limits of q, m or rad, shape (nq,); ±inf where there is none, and for entries
            that are cosines, sines or quaternion components.
        velocity_limit: limit of |v|, m/s or rad/s, shape (nv,); inf where there is none.
        effort_limit: limit of |τ|, N or N m, shape (nv,); inf where there is none; of an asymmetric
            one the smaller side; of coupled joints the sum.
        frame_names: names of all frames, each once.
        neutral: the configuration with every joint at zero, shape (nq,).
        notes: what the file says that the equations of motion leave out, one sentence each.
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
    effort_limit: np.ndarray = field(repr=False)
    frame_names: list[str] = field(repr=False)
    neutral: np.ndarray = field(repr=False)
    notes: tuple[str, ...]

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

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints that have coordinates of their own; those of a MuJoCo body with several one by one."""
        return [link.name for link in self.tree.links if not link.mimics]

    @property
    def root_names(self) -> list[str]:
        """Names of the entries of v that belong to the joint under the first link, none if it is fixed."""
        if not self.model.existJointName(ROOT_JOINT):
            return []
        joint = self.model.joints[self.model.getJointId(ROOT_JOINT)]
        # A joint of the file that happens to have this name has one degree of freedom.
        return self.velocity_names[joint.idx_v : joint.idx_v + joint.nv] if joint.nv > 1 else []

    @cached_property
    def visual_model(self) -> pin.GeometryModel:
        """The shapes to draw; read from the file on first use, so that planning needs no meshes.

        Raises:
            RobotError: if a mesh is missing or unreadable.
        """
        path = str(self.source)
        packages = [str(directory) for directory in self.package_directories]
        try:
            if self.format == "mjcf":
                return pin.buildGeomFromMJCF(self.model, path, pin.GeometryType.VISUAL)
            if self.format == "sdf":
                return pin.buildGeomFromSdf(self.model, path, pin.GeometryType.VISUAL, "", packages)
            return pin.buildGeomFromUrdf(self.model, path, pin.GeometryType.VISUAL, package_dirs=packages)
        except Exception as error:
            raise RobotError(
                f"The shapes of {self.source} cannot be read: {' '.join(str(error).split()).rstrip('.')}."
            ) from error
