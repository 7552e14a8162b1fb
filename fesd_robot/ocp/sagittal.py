"""A task in space whose left and right sides do the same, as a task in the x-z plane, and the way back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin

from fesd_robot.errors import JointError
from fesd_robot.ocp.formulate import MotionProblem
from fesd_robot.robot import Robot
from fesd_robot.robot.couple import coupling_signs
from fesd_robot.robot.lock import lock_joints
from fesd_robot.robot.root import ROOT_HEIGHT, ROOT_JOINT, ROOT_PITCH
from fesd_robot.robot.sagittal import propose_sagittal
from fesd_robot.task import CircleContact, Goal, PointContact, Task, Waypoint
from fesd_robot.task.costs import COST_TERMS
from fesd_robot.task.reference import FromFile, Jumps

_SAME = 1e-5
"""m, rad, or in the units of a velocity; what differs by less is the same on both sides: places are often written with
five decimals."""

_OUT_OF_PLANE = frozenset({"y", "qx", "qz", "qw", "roll", "yaw", "vy", "wx", "wz"})
"""Coordinates of a free root that leave the x-z plane, and the one that says nothing besides the others."""

_IN_PLANE = {"x": "root_x", "z": ROOT_HEIGHT, "pitch": ROOT_PITCH, "vx": "root_x", "vz": ROOT_HEIGHT, "wy": ROOT_PITCH}
"""Coordinates of a free root -> those of a sagittal one; vx and vz while the robot does not pitch."""

Target = TypeVar("Target", Goal, Waypoint)


@dataclass(frozen=True)
class SagittalTwin:
    """A task in the plane, and how its motion moves the robot in space.

    Attributes:
        task: of the same robot with a sagittal root, lateral joints locked, and legs beside each other in unison.
        leaders: joint of the robot in space -> (joint in the plane that moves it, its sign).
        locked: joint of the robot in space -> value it is held at, m or rad.
        contacts: contact in space -> the contact in the plane that stands for it.
    """

    task: Task
    leaders: Mapping[str, tuple[str, float]]
    locked: Mapping[str, float]
    contacts: Mapping[str, str]

    def joints(self, planar: Mapping[str, float], *, at_rest: bool = False) -> dict[str, float]:
        """Return values of the joints in space, those of the leaders by name being given.

        Args:
            planar: name of a joint in the plane -> its position, velocity, or its part of an effort.
            at_rest: whether locked joints have the value zero, as of a velocity or an effort.
        """
        locked = dict.fromkeys(self.locked, 0.0) if at_rest else dict(self.locked)
        return {**locked, **{name: sign * planar[leader] for name, (leader, sign) in self.leaders.items()}}

    @property
    def unison(self) -> dict[str, int]:
        """Joint in the plane -> number of joints in space that it moves."""
        leaders = [leader for leader, _ in self.leaders.values()]
        return {name: leaders.count(name) for name in leaders}


def sagittal_twin(motion: MotionProblem) -> SagittalTwin | None:
    """Return the task of a motion in space as one in the x-z plane, or None where the two would not be the same.

    They are where a free robot begins and is to end in that plane with both sides alike, nothing on the way asks for
    anything else, and no surface varies along y. A motion of the twin is one of the robot in space: what a
    coupled joint is given is what its legs are given together.

    Args:
        motion: the formulated task, in space.
    """
    task, robot = motion.task, motion.robot
    if not _says_nothing_else(task) or any(contact.limits_slip for contact in motion.contacts):
        return None
    if any(surface.varies_across for surface in motion.scene.surfaces.values()):
        return None
    locked, coupled = propose_sagittal(robot.model)
    try:
        signs = coupling_signs(lock_joints(robot.model, locked) if locked else robot.model, coupled) if coupled else {}
    except JointError:
        return None
    single = [name for name in robot.joint_names if name != ROOT_JOINT and name not in locked]
    leaders = {name: (coupled.get(name, name), signs.get(name, 1.0)) for name in single}
    contacts = _paired_contacts(motion)
    if contacts is None:
        return None
    try:
        return SagittalTwin(_Translation(motion, leaders, locked, contacts).task(coupled), leaders, locked, contacts)
    except _NotAlike:
        return None


def _says_nothing_else(task: Task) -> bool:
    """Whether a task has only what can be said in the plane, too."""
    robot, points = task.robot, [one for _, one in task.states if getattr(one, "frames", None)]
    changed = (robot.locked, robot.coupled, robot.actuators, robot.passive, robot.armature, robot.damping)
    return (
        robot.root == "free_flyer"
        and not any(changed)
        and not robot.dry_friction
        and not task.bodies
        and not task.constraints
        and task.goal.periodic is None
        and not points
        and not any(getattr(one, "center_of_mass", None) for _, one in task.states)
        and not task.costs.frames
        and not isinstance(task.reference, FromFile)
        and all(isinstance(contact, PointContact | CircleContact) for contact in task.contacts.values())
    )


def _paired_contacts(motion: MotionProblem) -> dict[str, str] | None:
    """Return contact -> the first contact at its place or at its mirror image across the plane, where the robot begins.

    None where one is beside the plane without a mirror image of the same kind.
    """
    robot, q = motion.robot, motion.endpoints.initial_configuration
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    places = {
        name: np.array(data.oMf[robot.frame_id(contact.touching_frame)].translation)
        for name, contact in motion.task.single_contacts.items()
    }
    kinds = {
        name: contact.model_copy(update={"frame": "", "offset": (0.0, 0.0, 0.0)})
        for name, contact in motion.task.single_contacts.items()
    }
    found: dict[str, str] = {}
    for name, place in places.items():
        image = place * [1.0, -1.0, 1.0]
        beside = [
            other for other, own in places.items() if np.abs(own - image).max() <= _SAME and kinds[other] == kinds[name]
        ]
        if not beside:
            return None
        found[name] = found.get(beside[0], name)
    return found


class _NotAlike(Exception):
    """A task that asks for something outside of the plane, or for different things of its sides."""


@dataclass(frozen=True)
class _Translation:
    """What a completed task in space says, in names of the plane."""

    motion: MotionProblem
    leaders: Mapping[str, tuple[str, float]]
    locked: Mapping[str, float]
    contacts: Mapping[str, str]

    def task(self, coupled: Mapping[str, str]) -> Task:
        """Return the task in the plane."""
        task, robot = self.motion.task, self.motion.robot
        kept = set(self.contacts.values())
        q0, v0 = self.motion.endpoints.initial_configuration, self.motion.endpoints.initial_velocity
        initial = task.initial.model_copy(
            update={
                "configuration": self.values(dict(zip(robot.configuration_names, q0.tolist(), strict=True))),
                "velocity": self.values(dict(zip(robot.velocity_names, v0.tolist(), strict=True))),
                "posture": None,
                "stand_on": None,
            }
        )
        reference = task.reference
        if isinstance(reference, Jumps):
            reference = reference.model_copy(update={"apex": self.values(reference.apex)})
        limits = task.limits.model_copy(
            update={
                "position": self.bounds(task.limits.position),
                "velocity": self.bounds(task.limits.velocity),
                "effort": self.bounds(self._efforts(robot), added=True),
            }
        )
        sagittal = {"root": "sagittal", "locked": dict(self.locked), "coupled": dict(coupled)}
        return task.model_copy(
            update={
                "robot": task.robot.model_copy(update=sagittal),
                "postures": {},
                "contacts": {name: contact for name, contact in task.contacts.items() if name in kept},
                "initial": initial,
                "goal": self.target(task.goal),
                "waypoints": [self.target(one) for one in task.waypoints],
                "reference": reference,
                "costs": task.costs.model_copy(update=dict(self._costs(task))),
                "limits": limits,
                "solver": task.solver.model_copy(update={"warm_start": None}),
            }
        )

    def target(self, one: Target) -> Target:
        """Return a goal or a waypoint in names of the plane."""
        tolerance = one.tolerance
        standing = one.standing
        names = list(dict.fromkeys(self.contacts[name] for name in standing.contacts)) if standing else None
        update = {
            "configuration": self.values(one.configuration),
            "velocity": self.values(one.velocity),
            "posture": None,
            "stand_on": names,
            "tolerance": tolerance.model_copy(
                update={
                    "configuration": self.smallest(tolerance.configuration),
                    "velocity": self.smallest(tolerance.velocity),
                }
            ),
        }
        return one.model_copy(update=update)

    def values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return configuration or velocity coordinates: those of both sides have to agree, others to be zero."""
        found: dict[str, float] = {}
        for name, value in values.items():
            root, _, part = name.rpartition(".")
            if root == ROOT_JOINT and part == "qy":
                self._agree(found, ROOT_PITCH, 2 * float(np.arcsin(np.clip(value, -1, 1))))
            elif (target := self._target(name)) is None:
                if part != "qw" and abs(value - self.locked.get(name, 0.0)) > _SAME:
                    raise _NotAlike
            else:
                self._agree(found, target[0], target[1] * value)
        pitch = found.get(ROOT_PITCH, 0.0)
        if abs(pitch) > _SAME and any(abs(values.get(f"{ROOT_JOINT}.{one}", 0.0)) > _SAME for one in ("vx", "vz")):
            raise _NotAlike
        return found

    def smallest(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return tolerances: of both sides the smaller."""
        found: dict[str, float] = {}
        for name, value in values.items():
            if (target := self._target(name)) is not None:
                found[target[0]] = min(found.get(target[0], np.inf), value)
        return found

    def weights(self, weights: Mapping[str, float], *, shared: bool = False) -> dict[str, float]:
        """Return weights: the sum of those of both sides.

        Args:
            weights: by coordinate or control.
            shared: whether each side has a part of the value that is weighted, as of a control.
        """
        names = [leader for leader, _ in self.leaders.values()]
        found: dict[str, float] = {}
        for name, weight in weights.items():
            if (target := self._target(name)) is not None:
                sides = names.count(target[0]) if shared else 1
                found[target[0]] = found.get(target[0], 0.0) + weight / sides**2
        return found

    def bounds(
        self, bounds: Mapping[str, tuple[float, float]], *, added: bool = False
    ) -> dict[str, tuple[float, float]]:
        """Return bounds: of both sides the narrower ones, or their sum."""
        found: dict[str, tuple[float, float]] = {}
        for name, (low, high) in bounds.items():
            if name.startswith(f"{ROOT_JOINT}.q"):
                raise _NotAlike
            target = self._target(name)
            if target is None:
                continue
            if target[1] < 0:
                low, high = -high, -low
            if target[0] in found:
                other = found[target[0]]
                low, high = (low + other[0], high + other[1]) if added else (max(low, other[0]), min(high, other[1]))
            found[target[0]] = low, high
        return found

    def _efforts(self, robot: Robot) -> dict[str, tuple[float, float]]:
        """Return the bounds of all controls that a task limits, so that those of both sides add up."""
        actuation = self.motion.actuation
        own = zip(actuation.names, actuation.lower.tolist(), actuation.upper.tolist(), strict=True)
        return {name: (low, high) for name, low, high in own if name not in self.locked}

    def _costs(self, task: Task) -> Iterable[tuple[str, Any]]:
        """Yield the weights of all terms that have names."""
        for key, term in COST_TERMS.items():
            value = getattr(task.costs, key)
            if not isinstance(value, Mapping) or term.prefix is not None or term.names == "axis":
                continue
            if term.names == "contact":
                yield key, {self.contacts[name]: weight for name, weight in value.items()}
            else:
                yield key, self.weights(value, shared=term.names == "control")

    def _target(self, name: str) -> tuple[str, float] | None:
        """Return the coordinate in the plane that a coordinate in space is, and its sign; None if it is zero there."""
        root, _, part = name.rpartition(".")
        if root == ROOT_JOINT:
            return None if part in _OUT_OF_PLANE else (_IN_PLANE[part], 1.0)
        return self.leaders.get(name)

    @staticmethod
    def _agree(found: dict[str, float], name: str, value: float) -> None:
        if abs(found.setdefault(name, value) - value) > _SAME:
            raise _NotAlike


def space_configuration(twin: SagittalTwin, robot: Robot, planar: Mapping[str, float]) -> np.ndarray:
    """Return the configuration of a robot in space, (n_q), at one of its twin in the plane, by name."""
    pitch = planar[ROOT_PITCH]
    root = {"x": planar["root_x"], "z": planar[ROOT_HEIGHT], "qy": np.sin(pitch / 2), "qw": np.cos(pitch / 2)}
    values = {f"{ROOT_JOINT}.{part}": value for part, value in root.items()} | twin.joints(planar)
    return np.array([values.get(name, 0.0) for name in robot.configuration_names])


def space_velocity(twin: SagittalTwin, robot: Robot, planar: Mapping[str, float], pitch: float) -> np.ndarray:
    """Return the velocity of a robot in space, (n_v), at one of its twin in the plane, by name.

    That of a free root is in its own axes: v = R^T (dx/dt, 0, dz/dt).

    Args:
        twin, robot: of them.
        planar: velocities by name, m/s or rad/s.
        pitch: rad.
    """
    forward, up = planar["root_x"], planar[ROOT_HEIGHT]
    cosine, sine = np.cos(pitch), np.sin(pitch)
    root = {"vx": cosine * forward - sine * up, "vz": sine * forward + cosine * up, "wy": planar[ROOT_PITCH]}
    values = {f"{ROOT_JOINT}.{part}": value for part, value in root.items()} | twin.joints(planar, at_rest=True)
    return np.array([values.get(name, 0.0) for name in robot.velocity_names])
