"""The start of a motion: above the ground, and exactly touching what it is said to touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.contact import Contact, MultibodyDynamics
from fesd_robot.ocp.parts import CLOSED
from fesd_robot.ocp.setup import gap_function
from fesd_robot.ocp.standing import GAP_TOLERANCE, touching_configuration
from fesd_robot.ocp.vectors import Endpoints, StateLimits
from fesd_robot.robot import Robot, is_height
from fesd_robot.task import GROUND, CircleCircleContact, Task, TwoBodyContact

TOUCHING = 1e-5
"""m; a contact that starts this close to what it touches is closed: positions are often written with five decimals."""

ROUNDING = 1e-14
"""m; a gap that is not larger is rounding alone. One of 5e-13 already keeps a stance from being exact."""


def touching_at_start(
    robot: Robot,
    contacts: Sequence[Contact],
    dynamics: MultibodyDynamics,
    endpoints: Endpoints,
    limits: StateLimits,
    *,
    exactly: bool = False,
) -> Endpoints:
    """Return the ends with a start in which contacts touch whose gaps are up to `TOUCHING`, if there is one nearby.

    The heights of robot and bodies are adjusted if that is enough, else all coordinates that are lengths or angles.
    A ground that is lower for the plan by a few micrometres is another one for the foot that lands on it softly.

    Args:
        exactly: whether gaps have to be zero but for rounding, where `closed_at_start` is not to follow.
    """
    most = CLOSED if exactly else GAP_TOLERANCE
    start = endpoints.initial_configuration
    near = [
        contact
        for contact, gap in zip(contacts, np.asarray(gap_function(dynamics, contacts)(start)).ravel(), strict=True)
        if abs(gap) <= TOUCHING
    ]
    lengths_and_angles = [name for name in robot.configuration_names if name in robot.velocity_names]
    for adjust in ([name for name in lengths_and_angles if is_height(name)], lengths_and_angles):
        if near and adjust:
            q, gaps = touching_configuration(robot, near, dynamics.configuration, adjust, start, limits, CLOSED)
            if np.abs(gaps).max() <= most:
                return replace(endpoints, initial_configuration=q)
    return endpoints


def closed_at_start(contacts: Sequence[Contact], dynamics: MultibodyDynamics, endpoints: Endpoints) -> list[Contact]:
    """Return the contacts, with gaps that are zero at the start where they are at most `TOUCHING`.

    A foot that stands half a micrometre above the ground because its posture is written with so many digits would have
    to land first, or to push from a distance: no point fulfils such a complementarity exactly. Rounding alone is left
    to the gap's own state, which begins at zero, so that another start is the same equations.
    """
    gaps = np.asarray(gap_function(dynamics, contacts)(endpoints.initial_configuration)).ravel()
    return [
        replace(contact, gap=contact.gap - gap) if ROUNDING < abs(gap) <= TOUCHING else contact
        for contact, gap in zip(contacts, gaps, strict=True)
    ]


def check_above_ground(task: Task, gap: ca.Function, endpoints: Endpoints) -> None:
    """Raise if a contact is beyond its surface at the start or the goal.

    Raises:
        TaskError: at the configuration, with the contact that is deepest.
    """
    names = list(task.rigid_contacts)
    for key, configuration in (
        ("initial", endpoints.initial_configuration),
        ("goal", endpoints.goal_configuration),
    ):
        gaps = np.asarray(gap(configuration)).ravel()
        gap_of = dict(zip(names, gaps.tolist(), strict=True))
        deepest = min(names, key=lambda name: gap_of[name], default=None)
        if deepest is not None and gap_of[deepest] < -TOUCHING:
            raise task.error((key, "configuration"), _overlap(task, deepest, -gap_of[deepest]))


def _overlap(task: Task, name: str, depth: float) -> str:
    contact = task.contacts[name]
    if isinstance(contact, TwoBodyContact):
        what = "circles" if isinstance(contact, CircleCircleContact) else "circle and the box"
        return f"found the {what} of contact '{name}' overlapping by {depth:.6g} m, expected them apart or touching"
    if contact.surface == GROUND:
        expected = "on or above the ground"
    else:
        wall = task.ground.walls.get(contact.surface)
        expected = "outside" if wall is None else f"on its {wall.side} side" if wall.side else "on its free side"
    return f"found contact '{name}' {depth:.6g} m {task.inside(contact.surface)}, expected it {expected}"
