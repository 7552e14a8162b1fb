"""Bodies that are in the ground or in each other where no contact keeps them out: what a plan does not know of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import pinocchio as pin

from fesd_robot.contact import Surface
from fesd_robot.errors import RobotError
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.robot import BodyShapes, Depth, Robot
from fesd_robot.running import check_time
from fesd_robot.task import GROUND, CircleContact, PointContact, Task, TwoBodyContact

LEAST_DEPTH = 1e-3
"""m; shapes are seldom truer than this."""

NEAR_DEPTHS = 1.5
"""What is near a place that touches is within this many times a depth of it."""

MOST_STATES = 1000
"""States of a motion that are looked at, evenly spread."""

Moment = tuple[str, np.ndarray]
"""When it is, in words that begin a sentence, and the configuration, (n_q)."""


def overlaps_of_motion(task: Task, robot: Robot, surfaces: Mapping[str, Surface], motion: PhysicalMotion) -> list[str]:
    """Return a sentence for every body that goes below a surface, and for every two that overlap, at the deepest."""
    states = motion.states
    order = np.argsort(states.time, kind="stable")
    order = order[np.unique(np.linspace(0, len(order) - 1, MOST_STATES).astype(int))]
    moments = ((f"At t = {states.time[k]:.4g} s", states.configuration[k]) for k in order)
    return overlaps(task, robot, surfaces, moments)


def overlaps(task: Task, robot: Robot, surfaces: Mapping[str, Surface], moments: Iterable[Moment]) -> list[str]:
    """Return a sentence for every body below a surface, and for every two that overlap, at its deepest moment.

    What a contact keeps out is not meant: the body of its frame, and whatever is around the place that touches.

    Args:
        task: with its contacts in their places.
        robot: of the task, with frames there.
        surfaces: name -> surface.
        moments: when to look.

    Raises:
        OutOfTime: the time limit came meanwhile.
    """
    check_time()
    if robot.shapes is None or robot.shapes or robot.bodies:
        try:
            shapes = BodyShapes(robot)
        except RobotError as error:
            return [f"Whether bodies overlap is not known: {error}"]
        if shapes.shapes:
            return _Overlaps(task, robot, surfaces, shapes).sentences(moments)
    return []


class _Overlaps:
    """Overlaps of one robot in one task."""

    def __init__(self, task: Task, robot: Robot, surfaces: Mapping[str, Surface], shapes: BodyShapes) -> None:
        self._robot, self._shapes = robot, shapes
        self._data = robot.model.createData()
        self._task = task
        self._surfaces = {
            name: surface for name, surface in surfaces.items() if not (name == GROUND and task.has_untouched_ground)
        }
        contacts = task.single_contacts.values()
        self._contacts = [one for one in contacts if isinstance(one, PointContact | CircleContact)]
        self._fixed = {
            one.body
            for one in shapes.shapes
            if robot.body_of(one.body) and not robot.model.frames[robot.frame_id(one.body)].parentJoint
        }
        self._feet = {(one.surface, body) for one in self._contacts for body in self._bodies(one.touching_frame)}
        self._pairs = {
            frozenset((first, second))
            for one in contacts
            if isinstance(one, TwoBodyContact)
            for first in self._bodies(one.frame)
            for second in self._bodies(one.other_frame)
        }

    def sentences(self, moments: Iterable[Moment]) -> list[str]:
        """Return the deepest overlaps, one sentence for each body and surface and each two bodies."""
        worst: dict[tuple[str, ...], tuple[float, str]] = {}
        for when, q in moments:
            check_time()
            if not np.isfinite(q).all():
                continue
            for key, depth in self._found(q):
                if depth > worst.get(key, (LEAST_DEPTH, ""))[0]:
                    worst[key] = depth, when
        return [self._sentence(key, *found) for key, found in sorted(worst.items(), key=lambda item: -item[1][0])]

    def _sentence(self, key: tuple[str, ...], depth: float, when: str) -> str:
        surface, *bodies = key
        if surface:
            return (
                f"{when} body '{bodies[0]}' is {depth:.4g} m {self._task.inside(surface)}: no contact keeps it out "
                "there, and the motion passes through."
            )
        return (
            f"{when} bodies '{bodies[0]}' and '{bodies[1]}' overlap by {depth:.4g} m: no contact or constraint of type "
            "'distance' keeps them apart there."
        )

    def _found(self, q: np.ndarray) -> Iterator[tuple[tuple[str, ...], float]]:
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        for name, surface in self._surfaces.items():
            found = self._shapes.depths(q, surface.distances)
            feet = max([one.depth for one in found if (name, one.body) in self._feet], default=0.0)
            for one in found:
                if one.depth > LEAST_DEPTH and one.body not in self._fixed and not self._touches(name, one, feet):
                    yield (name, one.body), one.depth
        bodies = [shape.body for shape in self._shapes.shapes]
        for first, second, depth in self._shapes.overlaps(q, LEAST_DEPTH):
            pair = frozenset((bodies[first], bodies[second]))
            if pair not in self._pairs:
                yield ("", *sorted(pair)), depth

    def _touches(self, surface: str, one: Depth, feet: float) -> bool:
        """Return whether a contact stands for a body below a surface.

        It does if it is on the body, or if the body is deepest near the place that touches, and that place is in the
        body, or the contact's own body is about as deep.

        Args:
            surface: name.
            one: how deep the body is.
            feet: how deep the deepest body with a contact is, m.
        """
        if (surface, one.body) in self._feet:
            return True
        deepest = one.place - one.radius * self._surfaces[surface].normal(one.place)
        for contact in self._contacts:
            if contact.surface != surface:
                continue
            place = self._data.oMf[self._robot.frame_id(contact.touching_frame)].translation
            radius = contact.radius if isinstance(contact, CircleContact) else 0.0
            away = float(np.hypot(*(deepest - place)[[0, 2]])) - radius - LEAST_DEPTH
            if away <= NEAR_DEPTHS * feet:
                return True
            if away <= NEAR_DEPTHS * one.depth and self._shapes.gap(one.shape, place) <= LEAST_DEPTH:
                return True
        return False

    def _bodies(self, frame: str) -> list[str]:
        """Return the body of a frame, and those at its place in the x-z plane that move with it, as on coupled legs."""
        frames = self._robot.model.frames
        index = self._robot.frame_id(frame)
        while frames[index].type != pin.FrameType.BODY and frames[index].parentFrame != index:
            index = frames[index].parentFrame
        own, beside = frames[index], []
        data = self._robot.model.createData()
        pin.framesForwardKinematics(self._robot.model, data, self._robot.neutral)
        for other, candidate in enumerate(frames):
            apart = (data.oMf[other].translation - data.oMf[index].translation)[[0, 2]]
            same_joint = candidate.parentJoint == own.parentJoint and candidate.type == pin.FrameType.BODY
            if same_joint and np.abs(apart).max() <= LEAST_DEPTH:
                beside.append(candidate.name)
        return [own.name, *beside]
