"""Coordinates that rolling ties together: what turns a wheel or a ball about its centre, and what moves that centre.

Where one of them has a goal the others have to follow it: no default cost may hold them where they were.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnSurface, Scene
from fesd_robot.exactness import SINGULAR
from fesd_robot.ocp.scene import friction_of
from fesd_robot.ocp.vectors import StateLimits
from fesd_robot.orientations import deviation_names, lists
from fesd_robot.robot import Robot
from fesd_robot.task import Goal, Jumps, Task, TwoBodyContact

_PROBE = 0.3
"""m or rad; how far from a posture it is looked whether a centre still stays where it is while a body turns."""


@dataclass(frozen=True)
class Rolling:
    """A circle or ball that rolls on a surface.

    Attributes:
        contact: its name.
        turns: coordinates that turn it along the surface and leave its centre where it is, all the way round.
        moves: coordinates that move its centre along the surface and do not turn it, as far as it rolls in a turn.
        lifts: the coordinate that alone lifts its centre off the surface, in the same way, if there is one.
        rates: names of the velocities of all of these.
    """

    contact: str
    turns: tuple[str, ...]
    moves: tuple[str, ...]
    lifts: tuple[str, ...]
    rates: tuple[str, ...]

    @property
    def tied(self) -> tuple[str, ...]:
        """All coordinates of which none moves alone."""
        return *self.turns, *self.moves, *self.lifts

    def free_in(self, goal: Goal) -> tuple[str, ...]:
        """Return the coordinates that a goal does not list, and that have to move as those do that it lists."""
        turns, moves = ([name for name in own if lists(goal.configuration, name)] for own in (self.turns, self.moves))
        if (len(turns) == len(self.turns) and moves) or not (turns or moves or goal.has_points):
            return ()
        return tuple(name for name in self.tied if not lists(goal.configuration, name))


def rollings_of(task: Task, robot: Robot, scene: Scene, posture: np.ndarray, limits: StateLimits) -> list[Rolling]:
    """Return the circles and balls of a task that roll where the goal moves them.

    Bodies that jump, or that another body may carry by friction, need not roll, and those that end as they began have
    no default costs at the end.

    Args:
        task: with its contacts in their places.
        robot: with frames there.
        scene: what may touch what.
        posture: in which it is looked which coordinate does what, (n_q).
        limits: of the robot.
    """
    if isinstance(task.reference, Jumps) or task.goal.periodic is not None:
        return []
    found, carried = [], _carried(task, robot)
    for name, geometry in scene.geometries.items():
        if not isinstance(geometry, CircleOnSurface) or friction_of(task, name) == 0:
            continue
        if robot.model.frames[robot.frame_id(geometry.frame)].parentJoint not in carried:
            rolling = _rolling(name, geometry, robot, posture, limits)
            if rolling.turns and rolling.moves:
                found.append(rolling)
    return found


def _carried(task: Task, robot: Robot) -> set[int]:
    """Return the joints of bodies that another body touches with friction."""
    pairs = [
        one for name, one in task.contacts.items() if isinstance(one, TwoBodyContact) and friction_of(task, name) > 0
    ]
    frames = [frame for one in pairs for frame in (one.frame, one.other_frame)]
    return {robot.model.frames[robot.frame_id(frame)].parentJoint for frame in frames}


def _rolling(name: str, geometry: CircleOnSurface, robot: Robot, posture: np.ndarray, limits: StateLimits) -> Rolling:
    centre, turn = _motions(robot, geometry.frame, posture)
    elsewhere = pin.integrate(robot.model, posture, np.full(robot.model.nv, _PROBE))
    centre_there, turn_there = _motions(robot, geometry.frame, elsewhere)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, posture)
    normal = np.asarray(geometry.path.axes(data.oMf[robot.frame_id(geometry.frame)].translation).normal, dtype=float)
    stays = _still(centre) & _still(centre_there)
    straight = _still(turn) & _still(turn_there)
    along = ~_still(np.cross(turn.T, normal).T)
    ranges, entries = _ranges(robot, limits), _entries(robot)
    turns = stays & along & (ranges > 2 * np.pi)
    sideways, upwards = ~_still(np.cross(centre.T, normal).T), ~_still((normal @ centre)[None])
    pushes = straight & (ranges > 2 * np.pi * geometry.radius)
    moves, lifts = pushes & sideways, pushes & upwards & ~sideways & (upwards.sum() == 1)

    def names(chosen: np.ndarray) -> tuple[str, ...]:
        return tuple(name for i in np.flatnonzero(chosen) for name in entries[i])

    rates = tuple(robot.velocity_names[i] for i in np.flatnonzero(turns | moves | lifts))
    return Rolling(name, names(turns), names(moves), names(lifts), rates)


def _motions(robot: Robot, frame: str, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity and angular velocity of a frame's origin per velocity, in world axes, (3, n_v) each."""
    data = robot.model.createData()
    pin.computeJointJacobians(robot.model, data, q)
    pin.updateFramePlacements(robot.model, data)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    both = pin.getFrameJacobian(robot.model, data, robot.frame_id(frame), axes)
    return both[:3], both[3:]


def _still(columns: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(columns, axis=0) <= SINGULAR)


def _entries(robot: Robot) -> list[list[str]]:
    """Return the names of the entries of a deviation that a velocity changes: two of a joint with cosine and sine."""
    found: list[list[str]] = []
    for link in robot.tree.links:
        if not link.mimics:
            own = deviation_names([link.name + suffix for suffix in link.joint.position_suffixes])
            single = len(link.joint.velocity_suffixes) - 1
            found += [*([name] for name in own[:single]), own[single:]]
    return found


def _ranges(robot: Robot, limits: StateLimits) -> np.ndarray:
    """Return how far every velocity may take its coordinate, m or rad, (n_v); angles of orientations without end."""
    spans = dict(zip(robot.configuration_names, limits.upper_position - limits.lower_position, strict=True))
    return np.array([spans.get(own[0], np.inf) if len(own) == 1 else np.inf for own in _entries(robot)])
