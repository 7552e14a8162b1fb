"""Initial guesses in which feet step in turn: trunk and feet on smooth ways, the joints by inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnSurface, PointOnSurface
from fesd_robot.ocp import MotionProblem, gap_function
from fesd_robot.phases.footfalls import Feet, Groups, footfall_sequences
from fesd_robot.robot import interpolated

STANDS = 1e-4
"""m, height up to which a foot stands where a motion begins or ends."""

LEAST_STEP = 5e-3
"""m; a foot that ends nearer to where it began does not step."""

MISSED = 1e-3
"""m; a foot that inverse kinematics leaves further from where it should be does not reach it."""

MOST_STEPS = 4
"""Of every foot."""

LIFT = 0.1
"""Height of a swing, in units of the robot's length."""

STANCE = 0.4
"""Time in which all feet stand before the first swing and after the last one, in units of that of a swing."""

_STEPS, _REACHED, _DAMPING = 20, 1e-10, 1e-8
"""Of inverse kinematics: most Gauss-Newton steps, distance at which they end, m, and what is added to J J^T, m2."""

_DIFFERENCE = 1e-5
"""Step of the difference quotient for velocities, as a fraction of the duration."""


@dataclass(frozen=True)
class Foot:
    """A contact that stands at the start and at the end.

    Attributes:
        contact: its index.
        frame: Pinocchio's index of its frame.
        start, goal: where that is, m, (3).
        normal: of the surface, where it begins, (3).
    """

    contact: int
    frame: int
    start: np.ndarray
    goal: np.ndarray
    normal: np.ndarray

    @property
    def steps(self) -> bool:
        """Whether it stands elsewhere at the end."""
        return float(np.linalg.norm(self.goal - self.start)) >= LEAST_STEP


@dataclass(frozen=True)
class Stepping:
    """A motion on which feet step in turn.

    Attributes:
        motion: the formulated task.
        feet: those that stand at the start and at the end.
        groups: of them, by their places in `feet`, that swing together, one after the other; each foot takes steps of
            equal length.
    """

    motion: MotionProblem
    feet: Sequence[Foot]
    groups: Groups

    @cached_property
    def swings(self) -> np.ndarray:
        """First interval of the swing of every group, and the one after its last, (n_groups, 2)."""
        count, intervals = len(self.groups), self.motion.grid.intervals
        first = max(1, round(intervals * STANCE / (count + 2 * STANCE)))
        ends = np.round(np.linspace(first, intervals - first, count + 1)).astype(int)
        return np.column_stack([ends[:-1], ends[1:]])

    @property
    def order(self) -> str:
        """The names of the groups' contacts, as a list."""
        names = [[self.motion.contacts[self.feet[foot].contact].name for foot in group] for group in self.groups]
        return ", ".join(" and ".join(own) for own in names)

    @cached_property
    def touching(self) -> np.ndarray:
        """Which contacts touch in which interval, (N, n_c)."""
        found = np.zeros((self.motion.grid.intervals, len(self.motion.contacts)), dtype=bool)
        found[:, [foot.contact for foot in self.feet]] = True
        for group, (begin, end) in zip(self.groups, self.swings, strict=True):
            found[begin:end, [self.feet[foot].contact for foot in group]] = False
        return found

    def state(self, time: float) -> np.ndarray:
        """Return configuration and velocity at a time, (n_q + n_v)."""
        duration, model = self.motion.grid.nominal, self.motion.robot.model
        step = _DIFFERENCE * duration
        first = min(max(time - step / 2, 0.0), duration - step)
        change = pin.difference(model, self.configuration(first), self.configuration(first + step))
        return np.concatenate([self.configuration(time), np.asarray(change) / step])

    def configuration(self, time: float) -> np.ndarray:
        """Return the configuration at a time, (n_q).

        Everything is on the line from start to goal, with a smooth beginning and end; from there the joints bring the
        feet to where they should be.
        """
        robot, ends, limits = self.motion.robot, self.motion.endpoints, self.motion.limits
        way = _smooth(time / self.motion.grid.nominal)
        q, wanted = interpolated(robot, ends.initial_configuration, ends.goal_configuration, way), self.places(time)
        for _ in range(_STEPS):
            places, jacobian = self._placed(q)
            error = (wanted - places).ravel()
            if np.abs(error).max() < _REACHED:
                break
            square = jacobian @ jacobian.T + _DAMPING * np.eye(len(jacobian))
            q = np.asarray(pin.integrate(robot.model, q, jacobian.T @ np.linalg.solve(square, error)))
            q = np.clip(q, limits.lower_position, limits.upper_position)
        return np.asarray(pin.normalize(robot.model, q))

    def places(self, time: float) -> np.ndarray:
        """Return where the feet are at a time, m, (n_feet, 3): where they stand, or on an arc to where they will."""
        found, grid = np.array([foot.start for foot in self.feet]), self.motion.grid
        for group, (first, last) in zip(self.groups, self.swings, strict=True):
            way = _smooth((time / grid.nominal * grid.intervals - first) / (last - first))
            height = LIFT * self.motion.scales.length * (4 * way * (1 - way)) ** 2
            for number in group:
                foot, steps = self.feet[number], sum(number in one for one in self.groups)
                found[number] += way / steps * (foot.goal - foot.start) + height * foot.normal
        return found

    @property
    def reaches(self) -> bool:
        """Whether inverse kinematics brings all feet to where they should be, at the ends of all intervals."""
        grid = self.motion.grid
        for time in np.linspace(0.0, grid.nominal, grid.intervals + 1):
            if np.abs(self.places(time) - self._placed(self.configuration(time))[0]).max() > MISSED:
                return False
        return True

    @cached_property
    def _roots(self) -> np.ndarray:
        """Entries of v that belong to roots, which inverse kinematics leaves as they are."""
        names, roots = self.motion.robot.velocity_names, set(self.motion.robot.root_names)
        return np.array([i for i, name in enumerate(names) if name in roots])

    def _placed(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places of the feet, (n_feet, 3), and their velocities per velocity of a joint, (3 n_feet, n_v)."""
        model, axes = self.motion.robot.model, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        data = model.createData()
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        rows = np.vstack([pin.getFrameJacobian(model, data, foot.frame, axes).reshape(6, -1)[:3] for foot in self.feet])
        rows[:, self._roots] = 0.0
        return np.array([data.oMf[foot.frame].translation for foot in self.feet]), rows


def steppings(motion: MotionProblem) -> list[Stepping]:
    """Return motions on which feet step in turn, from where they stand at the start to where they do at the end.

    The order follows from these places (`footfalls.footfall_sequences`), another one for another `solver.seed`. Every
    foot takes as many steps as it needs to stay within reach.

    Args:
        motion: the formulated task.

    Returns:
        Nothing where no foot stands elsewhere at the end, or a robot has no root, or there are too few intervals, or
        `MOST_STEPS` steps are too few.
    """
    robot, ends = motion.robot, motion.endpoints
    feet = _feet(motion)
    stepping = [number for number, foot in enumerate(feet) if foot.steps]
    if not stepping or not robot.root_joints:
        return []
    center_start, center_goal = (
        np.asarray(pin.centerOfMass(robot.model, robot.model.createData(), q))[:2]
        for q in (ends.initial_configuration, ends.goal_configuration)
    )
    start, goal = np.array([foot.start[:2] for foot in feet]), np.array([foot.goal[:2] for foot in feet])
    for steps in range(1, MOST_STEPS + 1):
        first = Feet(
            start,
            start + (goal - start) / steps,
            stepping,
            center_start,
            center_start + (center_goal - center_start) / steps,
        )
        orders = footfall_sequences(first, motion.task.solver.seed)
        repeated = [Stepping(motion, feet, groups * steps) for groups in orders]
        found = [one for one in repeated if len(one.groups) + 2 <= motion.grid.intervals and one.reaches]
        if found:
            return found
    return []


def _feet(motion: MotionProblem) -> list[Foot]:
    """Return the contacts with surfaces that stand at the start and at the end."""
    if motion.task.goal.periodic is not None:
        return []
    robot, model, found = motion.robot, motion.robot.model, []
    both = (motion.endpoints.initial_configuration, motion.endpoints.goal_configuration)
    gaps = gap_function(motion.dynamics, motion.contacts)
    highest, data = np.max([np.asarray(gaps(q)).ravel() for q in both], axis=0), []
    for q in both:
        data.append(model.createData())
        pin.framesForwardKinematics(model, data[-1], q)
    for number, contact in enumerate(motion.contacts):
        geometry = motion.scene.geometries[contact.name]
        if isinstance(geometry, PointOnSurface | CircleOnSurface) and highest[number] <= STANDS:
            frame = robot.frame_id(geometry.frame)
            surface = geometry.surface if isinstance(geometry, PointOnSurface) else geometry.path
            start, goal = (one.oMf[frame].translation.copy() for one in data)
            found.append(Foot(number, frame, start, goal, np.asarray(surface.axes(start).normal)))
    return found


def _smooth(s: float) -> float:
    """Return a way from 0 to 1 that begins and ends at rest, with accelerations of zero: s^3 (10 - 15 s + 6 s^2)."""
    s = min(max(s, 0.0), 1.0)
    return float(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
