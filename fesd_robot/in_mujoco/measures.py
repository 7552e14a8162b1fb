"""How far a run is from its plan."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnBox, PointOnSurface, frames_of
from fesd_robot.in_mujoco.driving import RunRecord, Touch
from fesd_robot.in_mujoco.reference import planned_states
from fesd_robot.in_mujoco.scene import MujocoScene
from fesd_robot.ocp import numeric_physics
from fesd_robot.plans import Plan
from fesd_robot.plans.plan import Switch
from fesd_robot.robot import Robot

APART, TURNED = 0.05, 0.2
"""m, rad; a run in which a body ends further from its place in the plan has not finished."""

SAME_LANDING = 0.1
"""s; a touchdown that is further from the planned one is another one."""

TOUCHING = 1e-4
"""m; a contact with a smaller gap touches."""

SATURATED = 0.999
"""Share of a limit from which on a motor gives all it can."""


@dataclass(frozen=True)
class BodyError:
    """Distance of a body from its place in the plan: root mean square over time, and at the end, m and rad."""

    rms: float
    end: float
    angle_rms: float
    angle_end: float


@dataclass(frozen=True)
class TouchdownError:
    """A touchdown of the plan, s, and by how much it came later, s; None if it did not come within 0.1 s."""

    contact: str
    planned: float
    error: float | None


class Deviation:
    """A run beside its plan.

    Bodies are those that move on a joint of their own from the world and can travel: the base of a robot with legs, a
    cart, a free box. The plan is taken at the same times; after its end nothing is compared.

    Args:
        scene: in which it ran.
        plan: any.
        record: of the run.
        goal: values of configuration coordinates, m or rad, that the end of the plan is taken to have instead of its
            own.

    Attributes:
        time: of the run, within the plan, s, (n).
        distance, turn: of every body from its place, by its name, m and rad, (n).
    """

    def __init__(
        self, scene: MujocoScene, plan: Plan, record: RunRecord, goal: Mapping[str, float] | None = None
    ) -> None:
        self._scene, self._plan, self._record = scene, plan, record
        robot = scene.motion.robot
        within = record.time <= plan.trajectory.time[-1] - plan.trajectory.time[0] + scene.model.opt.timestep
        self.time = record.time[within]
        states = planned_states(plan, self.time)
        self._planned, self._sticking = states.configuration, states.sticking
        for name, value in (goal or {}).items():
            self._planned[-1, robot.configuration_names.index(name)] = value
        self._run = record.configuration[within]
        self._speed = record.velocity[within]
        bodies = _travelling(robot)
        own, theirs = (_placements(robot, states, bodies.values()) for states in (self._run, self._planned))
        self.distance, self.turn = {}, {}
        for number, name in enumerate(bodies):
            pairs = list(zip(own, theirs, strict=True))
            self.distance[name] = np.array(
                [np.linalg.norm(one[number].translation - other[number].translation) for one, other in pairs]
            )
            turns = [one[number].rotation.T @ other[number].rotation for one, other in pairs]
            self.turn[name] = np.array([np.linalg.norm(pin.log3(turn)) for turn in turns])

    @property
    def complete(self) -> bool:
        """Whether the run came to the end of the plan."""
        return not self._record.broken

    @cached_property
    def bodies(self) -> dict[str, BodyError]:
        """Errors of bodies by their names."""
        return {
            name: BodyError(_rms(apart), float(apart[-1]), _rms(self.turn[name]), float(self.turn[name][-1]))
            for name, apart in self.distance.items()
        }

    @cached_property
    def _round(self) -> set[str]:
        """Free bodies that are touched as balls about their middle, so that it is open how they turn."""
        motion, names = self._scene.motion, set(self._scene.motion.robot.bodies)
        contacts = motion.scene.geometries.values()
        frames = {frame for each in contacts for frame in frames_of(each)}
        edged = {
            motion.robot.body_of(frame)
            for each in contacts
            for frame in frames_of(each)
            if isinstance(each, PointOnSurface) or (isinstance(each, CircleOnBox) and frame == each.other_frame)
        }
        return {name for name in names & frames if name not in edged}

    @cached_property
    def joints(self) -> np.ndarray:
        """Departure of every joint that turns, rad, and that slides, m, behind the bodies' own, (n, number of them)."""
        robot = self._scene.motion.robot
        apart = np.array([pin.difference(robot.model, a, b) for a, b in zip(self._planned, self._run, strict=True)])
        return np.asarray(apart.reshape(len(self.time), -1))

    def joint_rms(self, kind: str) -> float | None:
        """Return the root mean square of hinges, rad, or slides, m, behind the bodies' own joints; None without any.

        Args:
            kind: ``rad/s`` or ``m/s``, the unit of their velocity.
        """
        rows = self.joint_rows(kind)
        return _rms(self.joints[:, rows]) if rows else None

    def joint_rows(self, kind: str) -> list[int]:
        """Return the velocity coordinates of hinges or slides behind the bodies' own joints."""
        from fesd_robot.robot import velocity_units

        robot = self._scene.motion.robot
        units, own = velocity_units(robot), _own_coordinates(robot)
        return [k for k, name in enumerate(robot.velocity_names) if units[name] == kind and k not in own]

    @cached_property
    def touchdowns(self) -> list[TouchdownError]:
        """Every touchdown of the plan after a flight higher than 0.1 mm, and when it came.

        Each of the run counts once, the nearest first. After a lower flight a foot may well have stayed on the ground.
        """
        start = float(self._plan.trajectory.time[0])
        landings = [each for each in self._plan.switches if each.kind == "touchdown" and _flew(self._plan, each)]
        return _matched(landings, self._record.touches, start)

    @cached_property
    def slip(self) -> dict[str, float]:
        """Path of every contact over its surface at times at which it sticks in the plan and touches in the run, m."""
        motion = self._scene.motion
        physics, names = numeric_physics(motion), list(motion.scene.geometries)
        path = np.zeros(len(names))
        steps = np.gradient(self.time) if len(self.time) > 1 else np.zeros(1)
        for q, v, wanted, step in zip(self._run, self._speed, self._sticking, steps, strict=True):
            holds = wanted & (physics.gaps(q) < TOUCHING) if wanted.any() else wanted
            if holds.any():
                speed = (physics.contact_jacobian(q) @ v).reshape(-1, physics.rows)[:, 1:]
                path += holds * np.linalg.norm(speed, axis=1) * step
        return dict(zip(names, path.tolist(), strict=True))

    @cached_property
    def effort(self) -> tuple[float, float]:
        """The largest share of a motor's limit, and the share of time in which a motor gives all it can."""
        motors, control = self._scene.motors, self._record.control[: max(len(self.time) - 1, 1)]
        if not control.size:
            return 0.0, 0.0
        limit = np.where(control >= 0, motors.upper, -motors.lower)
        share = np.abs(control) / np.where(limit > 0, limit, np.inf)
        return float(share.max()), float((share >= SATURATED).any(axis=1).mean())

    @property
    def finished(self) -> bool:
        """Whether the run came to the end, with all bodies near their places there; without bodies, all joints."""
        if not self.complete:
            return False
        if self.bodies:
            turned = [each.angle_end for name, each in self.bodies.items() if name not in self._round]
            return all(each.end <= APART for each in self.bodies.values()) and all(each <= TURNED for each in turned)
        last = np.abs(self.joints[-1])
        turning, sliding = self.joint_rows("rad/s"), self.joint_rows("m/s")
        return bool((last[turning] <= TURNED).all() and (last[sliding] <= APART).all())


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _first_bodies(robot: Robot) -> dict[int, list[int]]:
    """Return the first link with a mass on every branch from the world -> it and the links before it."""
    massive = {link for joint, link in enumerate(robot.tree.last_link) if robot.model.inertias[joint].mass > 0}
    result: dict[int, list[int]] = {}
    for index in sorted(massive):
        chain, link = [index], robot.tree.links[index].parent
        while link >= 0 and link not in massive:
            chain.append(link)
            link = robot.tree.links[link].parent
        if link < 0:
            result[index] = chain
    return result


def _can_travel(robot: Robot, chain: list[int]) -> bool:
    return any(np.any(np.array(robot.tree.links[link].linear.full())) for link in chain)


def _own_coordinates(robot: Robot) -> set[int]:
    """Return the velocity coordinates on which bodies travel."""
    chains = [chain for chain in _first_bodies(robot).values() if _can_travel(robot, chain)]
    return {
        row
        for chain in chains
        for link in chain
        for row in range(robot.tree.links[link].v_indices.start, robot.tree.links[link].v_indices.stop)
    }


def _travelling(robot: Robot) -> dict[str, int]:
    """Return the name of every body that can travel -> Pinocchio's index of its joint."""
    joints = {link: joint for joint, link in enumerate(robot.tree.last_link) if joint}
    result = {}
    for link, chain in _first_bodies(robot).items():
        if _can_travel(robot, chain):
            joint = joints[link]
            frames = [f.name for f in robot.model.frames if f.parentJoint == joint and f.type == pin.FrameType.BODY]
            result[frames[0] if frames else robot.model.names[joint]] = joint
    return result


def _placements(robot: Robot, states: np.ndarray, joints: Collection[int]) -> list[list[pin.SE3]]:
    data, result = robot.model.createData(), []
    for q in states:
        pin.forwardKinematics(robot.model, data, q)
        result.append([pin.SE3(data.oMi[joint]) for joint in joints])
    return result


def _flew(plan: Plan, landing: Switch) -> bool:
    """Return whether the flight before a touchdown is one, not a graze."""
    parting = [
        each.time
        for each in plan.switches
        if each.contact == landing.contact and each.kind == "takeoff" and each.time < landing.time
    ]
    time, gap = plan.trajectory.time, plan.contacts[landing.contact].gap
    within = (time >= (parting[-1] if parting else time[0])) & (time <= landing.time)
    return bool(gap[within].max(initial=0.0) > TOUCHING)


def _matched(landings: list[Switch], touches: list[Touch], start: float) -> list[TouchdownError]:
    result = []
    for contact in dict.fromkeys(each.contact for each in landings):
        wanted = [each.time - start for each in landings if each.contact == contact]
        came = [each.time for each in touches if each.contact == contact]
        pairs = sorted((abs(b - a), i, j) for i, a in enumerate(wanted) for j, b in enumerate(came))
        taken: dict[int, int] = {}
        for apart, i, j in pairs:
            if apart <= SAME_LANDING and i not in taken and j not in taken.values():
                taken[i] = j
        result += [
            TouchdownError(contact, time + start, came[taken[i]] - time if i in taken else None)
            for i, time in enumerate(wanted)
        ]
    return sorted(result, key=lambda each: each.planned)
