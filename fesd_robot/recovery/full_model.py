"""A planned motion on all joints of the model file: locked and coupled ones too, with the effort of every motor."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from fesd_robot.contact import ContactGeometry, Scene, TwoBodies
from fesd_robot.errors import RobotError
from fesd_robot.exactness import ROUNDED
from fesd_robot.recovery.contact_rows import stacked_rows
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import Link, Prismatic, Robot, continuous_quaternions, coupling_signs, lock_joints

_PROBES = (0.0, 0.3, -0.7)
"""First entry of the displacements at which the places of feet are compared."""


@dataclass(frozen=True)
class FullMotion:
    """A motion along n samples by the joints of the model file.

    Attributes:
        joints: names of the joints with one degree of freedom, without the root's, (k).
        units: ``m`` or ``rad`` of each.
        position, velocity: m or rad and m/s or rad/s, (n, k).
        effort: what the motor of each joint gives, N or N m, (n, k).
        base: position, m, and quaternion x, y, z, w of the first link in the world, (n, 7); None if it is fixed or the
            joint under it has one degree of freedom.
        feet: name of a contact -> names of the frames at which it touches, one unless it stands for several feet.
        foot_force: normal and tangential force of every foot, N, (n, number of feet, rows), in the order of `feet`.
    """

    joints: list[str]
    units: list[str]
    position: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray
    base: np.ndarray | None
    feet: dict[str, list[str]]
    foot_force: np.ndarray


class FullModel:
    """The model of a file with no joint locked or coupled, and how a plan's reduced model moves it.

        q = c(q_r),   v = C v_r,   a = C a_r

    with a row of C for every joint: that of its own coordinate, plus or minus that of its leader, or zero if locked.

    Args:
        robot: the reduced robot, whose coordinates the plan has.
        full: the robot of the same file and root with nothing locked or coupled.
        locked: name of a joint -> value it is held at, m or rad.
        coupled: name of a joint -> name of the joint it moves in unison with.
        scene: surfaces, and what touches what.
        in_space: whether contacts have two tangents; none stands for several feet then.

    Raises:
        JointError: the joints cannot be locked or coupled.
    """

    def __init__(
        self,
        robot: Robot,
        full: Robot,
        locked: Mapping[str, float],
        coupled: Mapping[str, str],
        scene: Scene,
        *,
        in_space: bool = False,
    ) -> None:
        held = lock_joints(full.model, locked) if locked else full.model
        signs = coupling_signs(held, coupled) if coupled else {}
        self._robot, self._full, self._locked, self._coupled, self._signs = robot, full, locked, coupled, signs
        self._data = full.model.createData()
        self._spread, self._base_joint = self._spreading(), self._find_base()
        own = {name: robot.configuration_names.index(name) for name in robot.configuration_names}
        self._copied = [(i, own[name]) for i, name in enumerate(full.configuration_names) if name in own]
        root = set(full.root_names)
        self._joints = [
            link
            for link in full.tree.links
            if len(link.joint.velocity_suffixes) == 1 and not root & set(full.velocity_names[link.v_indices])
        ]
        self._stand_in = bool(coupled) and not in_space
        self._add_twins([one.frame for one in scene.geometries.values() if not isinstance(one, TwoBodies)])
        feet = {name: self._feet(geometry) for name, geometry in scene.geometries.items()}
        counts = np.array([len(each) for each in feet.values()], dtype=int)
        self._shares = np.repeat(1 / counts, counts)
        self._of_contact = np.repeat(np.arange(len(feet)), counts)
        self._feet_names = {name: [geometry.frame for geometry in each] for name, each in feet.items()}
        geometries = {f"{name} {foot.frame}": foot for name, each in feet.items() for foot in each}
        nothing = np.zeros((full.model.nv, 0))
        self._physics = NumericPhysics(
            self._full,
            Scene(scene.surfaces, geometries),
            dict.fromkeys(geometries, 0.0),
            lambda _: nothing,
            in_space=in_space,
        )

    def configuration(self, q: np.ndarray) -> np.ndarray:
        """Return the configuration of the full model at that of the reduced one."""
        full, step = self._full, np.zeros(self._full.model.nv)
        for name, value in self._locked.items():
            step[full.velocity_names.index(name)] = value
        for name, leader in self._coupled.items():
            step[full.velocity_names.index(name)] = self._signs[name] * self._angle(q, leader)
        result = pin.integrate(full.model, full.neutral, step)
        for entry, source in self._copied:
            result[entry] = q[source]
        return np.asarray(result)

    def velocity(self, v: np.ndarray) -> np.ndarray:
        """Return C v_r; the same turns accelerations."""
        return np.asarray(self._spread @ v)

    def motion(
        self,
        physics: NumericPhysics,
        samples: Iterable[tuple[np.ndarray, ...]],
        dry_friction: np.ndarray | None = None,
    ) -> FullMotion:
        """Return a motion of the reduced robot on the full model.

        The acceleration at a sample is that of the reduced robot under its controls and contact forces. The efforts are
        what the full model needs for it: the inverse dynamics by Pinocchio's recursive Newton-Euler algorithm,

            a_r = M_r^-1 (B u + J_r^T f + r_r - k_r - h_r),   tau = M C a_r + h + k - r - J^T f_feet

        with k = D v + K (q - r) of damping and springs and the dry friction r of joints, so that a joint that is held
        has the effort that holds it, and the efforts of joints in unison add up to the control that the plan has for
        all of them, C^T tau = B u. A joint that follows another by <mimic> in the file has no motor: its effort is
        zero, and the leader's moves both. A contact that stands for n feet gives each the n-th part of its force;
        joints in unison have parts of their dry friction by its limits. A locked joint has none: its effort alone
        holds it.

        Args:
            physics: of the reduced robot, with the contacts in the order of the scene, rigid ones first.
            samples: q_r, v_r, u and f, of shape (n_c + n_s, rows) with normal and tangential force, of every sample;
                the accelerations know the forces of the n_s compliant contacts by themselves.
            dry_friction: r_r of every sample, N or N m, (n, n_v); none if omitted.
        """
        model, links = self._full.model, self._joints
        position, velocity, effort, base, forces = [], [], [], [], []
        sharing, no_friction = self._sharing_of_friction(), np.zeros(self._robot.model.nv)
        for k, (q_r, v_r, u, f) in enumerate(samples):
            joint_friction = no_friction if dry_friction is None else dry_friction[k]
            a_r = acceleration_under(physics, q_r, v_r, u, f[: len(physics.friction)], joint_friction)
            q, v, a = self.configuration(q_r), self.velocity(v_r), self.velocity(a_r)
            feet = self.forces_on_feet(f)
            tau = pin.rnea(model, self._data, q, v, a) + self._physics.resistance(q, v)
            tau = tau - self._physics.contact_jacobian(q).T @ stacked_rows(feet) - sharing @ joint_friction
            position.append([_position(link, q) for link in links])
            velocity.append([link.multiplier * v[link.v_indices.start] for link in links])
            effort.append([0.0 if link.mimics else tau[link.v_indices.start] for link in links])
            base.append(self._base(q))
            forces.append(feet)
        positions, poses = np.array(position), np.array(base)
        for column, link in enumerate(links):
            if len(link.joint.position_suffixes) > 1:
                positions[:, column] = np.unwrap(positions[:, column])
        poses[:, 3:] = continuous_quaternions(poses[:, 3:])
        return FullMotion(
            joints=[link.name for link in links],
            units=["m" if isinstance(link.joint, Prismatic) else "rad" for link in links],
            position=positions,
            velocity=np.array(velocity),
            effort=np.array(effort),
            base=poses if self._base_joint else None,
            feet=self._feet_names,
            foot_force=np.array(forces),
        )

    @property
    def robot(self) -> Robot:
        """The robot of the file with nothing locked or coupled, and a frame for every foot."""
        return self._full

    @property
    def feet(self) -> list[str]:
        """Name of every foot: that of its contact, or of its frame where a contact stands for several."""
        return [
            frame if len(frames) > 1 else contact for contact, frames in self._feet_names.items() for frame in frames
        ]

    def forces_on_feet(self, force: np.ndarray) -> np.ndarray:
        """Return normal and tangential force on every foot, N, of those on contacts, (n_c, rows)."""
        return np.asarray(force[self._of_contact] * self._shares[:, None])

    def feet_at(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points of all feet at a configuration, m, (n_f, 3), and normals and tangents, (n_f, rows, 3).

        Both are in the world.
        """
        return self._physics.contact_points(q), self._physics.contact_axes(q)

    def _sharing_of_friction(self) -> np.ndarray:
        """Return which part of a reduced coordinate's dry friction every joint has, with its sign, (n_v, n_v there)."""
        weighted = np.abs(self._spread) * self._full.dry_friction_limits[:, None]
        parts = weighted / np.maximum(weighted.sum(axis=0), np.finfo(float).tiny)
        return np.asarray(self._spread * parts)

    def _spreading(self) -> np.ndarray:
        """Return C, (n_v, n_v of the reduced robot)."""
        columns = {name: k for k, name in enumerate(self._robot.velocity_names)}
        spread = np.zeros((self._full.model.nv, len(columns)))
        for row, name in enumerate(self._full.velocity_names):
            if name in columns:
                spread[row, columns[name]] = 1.0
            elif name in self._coupled:
                spread[row, columns[self._coupled[name]]] = self._signs[name]
        return spread

    def _angle(self, q: np.ndarray, joint: str) -> float:
        names = self._robot.configuration_names
        if joint in names:
            return float(q[names.index(joint)])
        return float(np.arctan2(q[names.index(f"{joint}.sin")], q[names.index(f"{joint}.cos")]))

    def _find_base(self) -> int:
        """Return Pinocchio's index of the joint under the first link, 0 if it has at most one degree of freedom."""
        model = self._full.model
        own = [i for i in range(1, model.njoints) if self._full.body_of(model.names[i]) is None]
        roots = [i for i in self._full.root_joints if i in own]
        return next((i for i in (*roots, *own) if i in roots or (model.parents[i] == 0 and model.joints[i].nv > 1)), 0)

    def _base(self, q: np.ndarray) -> np.ndarray:
        pin.forwardKinematics(self._full.model, self._data, q)
        return np.asarray(pin.SE3ToXYZQUAT(self._data.oMi[self._base_joint]))

    def _add_twins(self, frames: Sequence[str]) -> None:
        """Add a frame at the place of a foot on every leg that moves in unison with its own and has no frame there.

        The places are one in the x-z plane, and mirror images of each other across it.
        """
        for frame in frames if self._stand_in else ():
            model, own = self._full.model, self._full.frame_id(frame)
            first = model.frames[own].parentJoint
            chain, near = (
                self._chain(first),
                {self._chain(model.frames[index].parentJoint) for index in self._beside(own)},
            )
            ends = {self._chain(joint): joint for joint in range(1, model.njoints)}
            alone = [ends[other] for other in ends if other not in near and self._in_unison(other, chain)]
            if not alone:
                continue
            pin.framesForwardKinematics(model, self._data, self.configuration(self._robot.neutral))
            place, across = self._data.oMf[own].translation, self._data.oMi[first].translation[1]
            added, names = model.copy(), []
            for joint in alone:
                parent, pose = model.getFrameId(model.names[joint], pin.FrameType.JOINT), self._data.oMi[joint]
                beside = np.array([place[0], pose.translation[1] + across - place[1], place[2]])
                names.append(f"{frame} beside {model.names[joint]}")
                at = pin.SE3(np.eye(3), pose.actInv(beside))
                added.addFrame(pin.Frame(names[-1], joint, parent, at, pin.FrameType.OP_FRAME), False)
            self._full = replace(self._full, model=added, frame_names=[*self._full.frame_names, *names])
            self._data = added.createData()

    def _feet(self, geometry: ContactGeometry) -> list[ContactGeometry]:
        """Return the geometry on every foot that a contact stands for, its own first.

        These are the frames that are always at the same place in the x-z plane, at the ends of chains of joints that
        move in unison; of several frames at the end of one chain the first, if possible of the same type.
        """
        if isinstance(geometry, TwoBodies) or not self._stand_in:
            return [geometry]
        frames, own = self._full.model.frames, self._full.frame_id(geometry.frame)
        named = {index: name for name in self._full.frame_names if (index := self._frame(name)) is not None}
        chain, near = self._chain(frames[own].parentJoint), set(self._beside(own))
        twins: dict[tuple[str, ...], list[int]] = {}
        for index in (index for index in named if index in near):
            other = self._chain(frames[index].parentJoint)
            if self._in_unison(other, chain):
                twins.setdefault(other, []).append(index)
        kind = frames[own].type
        chosen = [next((one for one in each if frames[one].type == kind), each[0]) for each in twins.values()]
        return [geometry, *(replace(geometry, frame=named[one]) for one in chosen)]

    def _beside(self, own: int) -> list[int]:
        """Return the frames that are always at the place of one in the x-z plane."""
        every = list(range(1, self._full.model.nframes))
        places = self._places([own, *every])
        apart = np.abs(places[:, 1:] - places[:, :1]).max(axis=(0, 2))
        return [index for index, distance in zip(every, apart, strict=True) if distance <= ROUNDED]

    def _frame(self, name: str) -> int | None:
        """Return the index of a frame, None if several have its name."""
        try:
            return self._full.frame_id(name)
        except RobotError:
            return None

    def _places(self, frames: list[int]) -> np.ndarray:
        """Return x and z of frames at some configurations, m, (number of configurations, number of frames, 2)."""
        robot, places = self._robot, []
        for first in _PROBES:
            q = pin.integrate(robot.model, robot.neutral, np.linspace(first, 1, robot.model.nv))
            pin.framesForwardKinematics(self._full.model, self._data, self.configuration(q))
            places.append([self._data.oMf[frame].translation[[0, 2]] for frame in frames])
        return np.array(places)

    def _chain(self, joint: int) -> tuple[str, ...]:
        """Return the names of a joint and of those between it and the world, without the locked ones."""
        model, names = self._full.model, list[str]()
        while joint:
            if model.names[joint] not in self._locked:
                names.append(model.names[joint])
            joint = model.parents[joint]
        return tuple(names)

    def _in_unison(self, chain: tuple[str, ...], other: tuple[str, ...]) -> bool:
        """Return whether two different chains of joints follow the same leaders."""
        return chain != other and self._led(chain) == self._led(other)

    def _led(self, chain: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(self._coupled.get(name, name) for name in chain)


def acceleration_under(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, u: np.ndarray, force: np.ndarray, joint_friction: np.ndarray
) -> np.ndarray:
    """Return M^-1 (B u + J^T f + r - k - h), the acceleration under controls and forces, m/s² or rad/s², (n_v).

    Args:
        physics: of the robot.
        q, v, u: its state and controls.
        force: normal and tangential, N, (n_c, rows).
        joint_friction: dry friction of joints, N or N m, (n_v).
    """
    driving = physics.contact_jacobian(q).T @ stacked_rows(force) + joint_friction
    driving = driving - physics.required_force(q, v, np.zeros_like(v), u)
    return np.asarray(np.linalg.lstsq(physics.mass_matrix(q), driving, rcond=None)[0])


def _position(link: Link, q: np.ndarray) -> float:
    own = q[link.q_indices]
    if len(link.joint.position_suffixes) > 1:
        return float(np.arctan2(own[1], own[0]))
    return float(link.multiplier * own[0] + link.offset)
