"""Which joints with dry friction stick and which slide: the law Sgn decides, given what the contacts do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

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
    to the mode that the violation points to, at first all of them, then the first only.

    Args:
        dynamics: of the state, without dry friction of joints.
        forces: dynamics in given modes of the joints -> contact forces, stacked, (rows n_c).

    Source: Judice and Pires, A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems, Computers and Operations Research 21 (1994).
    """
    joints = dynamics.joints
    resting = np.abs(joints.velocity) <= ZERO_TANGENTIAL_VELOCITY
    modes = [
        ContactMode.STICK if rests else _ALONG[int(np.sign(speed))]
        for rests, speed in zip(resting, joints.velocity, strict=True)
    ]
    found = _judged(dynamics, forces, modes, resting)
    for pivot in range(_PIVOTS if len(modes) else 0):
        wanted = found.wanted
        if not wanted:
            break
        for i in list(wanted)[: None if pivot < _AT_ONCE else 1]:
            modes[i] = wanted[i]
        found = _judged(dynamics, forces, modes, resting)
    return found.motion


@dataclass(frozen=True)
class _Judged:
    """Modes of joints, and number of a joint -> the mode it should have instead."""

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
        contacts, limit = forces(dynamics), without.joints.limit
        friction = dynamics.joint_force(contacts)
        acceleration = (dynamics.acceleration + dynamics.response @ contacts)[without.joints.rows]
        force_scale, acceleration_scale = scale_of(friction), scale_of(acceleration)
        for i, mode in enumerate(modes):
            if mode is ContactMode.STICK:
                left = float(limit[i] - abs(friction[i])) / force_scale
                margin = min(margin, left)
                if left < -ADMISSIBLE:
                    wanted[i] = _ALONG[-int(np.sign(friction[i]))]
            elif resting[i]:
                along = mode.direction * float(acceleration[i]) / acceleration_scale
                motion_margin = min(motion_margin, along)
                if along < -ADMISSIBLE:
                    wanted[i] = ContactMode.STICK
    return _Judged(JointsInMotion(tuple(modes), dynamics, margin, motion_margin), wanted)
