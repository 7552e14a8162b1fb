"""Which joints with dry friction stick and which slide: the law Sgn decides, given what the contacts do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.replay.dynamics import ContactDynamics
from fesd_robot.replay.mode_motion import ADMISSIBLE, ZERO_TANGENTIAL_VELOCITY, scale_of

_AT_ONCE = 3
"""Rounds in which all joints that violate the law change their modes; from then on only the first one does."""

_PIVOTS = 200
"""Changes of single modes after which no modes are found."""

_ALONG = {1: ContactMode.SLIP_FORWARDS, -1: ContactMode.SLIP_BACKWARDS}


@dataclass(frozen=True)
class JointsInMotion:
    """The modes of joints, and how well they obey the law.

    Attributes:
        modes: of every joint with dry friction, (n_f).
        dynamics: in these modes.
        margin: smallest F - |tau_f| of a sticking joint, as a ratio of the largest friction; infinite if none sticks.
        motion_margin: the smallest acceleration of a joint that begins to slide along its direction, as a ratio of the
            largest; infinite if none does.
    """

    modes: Modes
    dynamics: ContactDynamics
    margin: float
    motion_margin: float


def joints_in_motion(dynamics: ContactDynamics, forces: Callable[[ContactDynamics], np.ndarray]) -> JointsInMotion:
    """Return the modes of joints with dry friction in a state: stick where they can, slide against their friction.

        v_i = 0:  |tau_i| <= F_i and a_i = 0,  or  tau_i = -F_i s and s a_i >= 0;   v_i != 0:  tau_i = -F_i sgn v_i

    This is a linear complementarity problem with bounds, whose matrix, the inverse of the mass matrix seen by the
    joints, is positive definite where no contact slides, so that the modes are the only ones. They are found by
    principal pivoting from the modes in which all joints at rest stick: every joint that violates its condition changes
    to the mode that the violation points to, at first all of them, then the first only. What rests on a limit surface
    and cannot stick begins to slide in the direction in which it then accelerates, see `beginning_slide`.

    Args:
        dynamics: of the state, without dry friction of joints.
        forces: dynamics in given modes of the joints -> contact forces, stacked, (rows n_c).

    Source: Judice and Pires, A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems, Computers and Operations Research 21 (1994).
    """
    joints = dynamics.joints
    resting = joints.rubbing.resting(joints.velocity, ZERO_TANGENTIAL_VELOCITY)
    modes = [ContactMode.STICK] * len(resting)
    for unit in joints.rubbing.units:
        if not resting[unit[0]]:
            for i in unit:
                modes[i] = _sliding(unit, joints.velocity[i])
    found = _judged(dynamics, forces, modes, resting)
    for pivot in range(_PIVOTS if modes else 0):
        wanted = found.wanted
        if not wanted:
            break
        for number in list(wanted)[: None if pivot < _AT_ONCE else 1]:
            unit, mode = joints.rubbing.units[number], wanted[number]
            for i in unit:
                modes[i] = mode
            if len(unit) > 1 and mode is not ContactMode.STICK:
                dynamics = _turned(dynamics, unit, beginning_slide(dynamics, forces, modes, unit))
        found = _judged(dynamics, forces, modes, resting)
    return found.motion


def _sliding(unit: np.ndarray, along: float) -> ContactMode:
    """Return the mode of a unit that slides; `along` is the velocity of a single joint."""
    return ContactMode.SLIP if len(unit) > 1 else _ALONG[1 if along > 0 else -1]


def _turned(dynamics: ContactDynamics, unit: np.ndarray, heading: np.ndarray) -> ContactDynamics:
    """Return the dynamics in which a limit surface slides in another direction."""
    headings = dynamics.joints.headings.copy()
    headings[unit] = heading
    return replace(dynamics, joints=replace(dynamics.joints, headings=headings))


def beginning_slide(
    without: ContactDynamics,
    forces: Callable[[ContactDynamics], np.ndarray],
    modes: Sequence[ContactMode],
    unit: np.ndarray,
) -> np.ndarray:
    """Return the direction e in which what rests on a limit surface begins to slide: that in which it accelerates.

    With scaled accelerations a~ = a~_0 - R e under the friction f_k = -F_k e_k, that is a~ = lambda e with lambda >= 0,

        e = (R + lambda)^-1 a~_0,   |e| = 1

    whose left side falls with lambda where R is positive definite, as where no contact slides.

    Args:
        without: dynamics without dry friction of joints.
        forces: dynamics in given modes of the joints -> contact forces, stacked, (rows n_c).
        modes: of all joints, in which the unit slides.
        unit: numbers of its coordinates.

    Returns:
        e, (m); the direction in which its friction would have to be larger, where there is none.
    """
    scale = without.joints.limit[unit] / without.joints.limit[unit[0]]

    def accelerated(heading: np.ndarray) -> np.ndarray:
        dynamics = _turned(without, unit, heading).in_joint_modes(tuple(modes))
        acceleration = dynamics.acceleration + dynamics.response @ forces(dynamics)
        return np.asarray(scale * acceleration[without.joints.rows[unit]])

    free = accelerated(np.zeros(len(unit)))
    response = np.column_stack([free - accelerated(one) for one in np.eye(len(unit))])

    def direction(along: float) -> np.ndarray:
        return np.asarray(np.linalg.solve(response + along * np.eye(len(unit)), free))

    def beyond(along: float) -> float:
        return float(np.linalg.norm(direction(along)) - 1.0)

    most = float(np.linalg.norm(free)) + float(np.linalg.norm(response))
    least = 0.0
    if beyond(least) <= 0:
        e = direction(least)
        return e / max(float(np.linalg.norm(e)), np.finfo(float).tiny)
    e = direction(float(brentq(beyond, least, most, xtol=1e-15 * most, rtol=1e-14)))
    return e / float(np.linalg.norm(e))


@dataclass(frozen=True)
class _Judged:
    """Modes of joints, and number of a unit -> the mode it should have instead."""

    motion: JointsInMotion
    wanted: dict[int, ContactMode]


def _judged(
    without: ContactDynamics,
    forces: Callable[[ContactDynamics], np.ndarray],
    modes: list[ContactMode],
    resting: np.ndarray,
) -> _Judged:
    dynamics, wanted = without.in_joint_modes(tuple(modes)), dict[int, ContactMode]()
    margin = motion_margin = np.inf
    if modes:
        contacts, rubbing = forces(dynamics), without.joints.rubbing
        friction = dynamics.joint_force(contacts)
        acceleration = (dynamics.acceleration + dynamics.response @ contacts)[without.joints.rows]
        force_scale, acceleration_scale = scale_of(friction), scale_of(acceleration)
        for number, unit in enumerate(rubbing.units):
            mode = modes[unit[0]]
            if mode is ContactMode.STICK:
                left = rubbing.unused(unit, friction) / force_scale
                margin = min(margin, left)
                if left < -ADMISSIBLE:
                    wanted[number] = _sliding(unit, -friction[unit[0]])
            elif resting[unit[0]]:
                heading = mode.direction * without.joints.headings[unit]
                along = float(heading @ rubbing.scaled(unit, acceleration)) / acceleration_scale
                motion_margin = min(motion_margin, along)
                if along < -ADMISSIBLE:
                    wanted[number] = ContactMode.STICK
    return _Judged(JointsInMotion(tuple(modes), dynamics, margin, motion_margin), wanted)
