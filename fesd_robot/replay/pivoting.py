"""Modes of contacts in space, found from forces that obey Coulomb's law nearly and by pivoting."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.recovery import normal_rows, tangential_rows
from fesd_robot.replay.cone_problem import forces_by_projection
from fesd_robot.replay.dynamics import ContactDynamics
from fesd_robot.replay.headings import slip_headings
from fesd_robot.replay.mode_motion import ADMISSIBLE, ModeMotion, scale_of

Rated = Callable[[ContactDynamics, Modes], ModeMotion]

_SHOWN = 1e-5
"""Acceleration or force, as a ratio of the largest, from which forces found by projection show a motion or a push."""

_AT_BOUND = 1e-6
"""Room of a force in its friction cone, as a ratio of the largest force, up to which it is at the cone."""

_DRIFTED = 1e-5
"""By how much modes next to those just left may violate a condition, as `ADMISSIBLE`: by what a state has drifted."""


def pivoted(
    dynamics: ContactDynamics, closed: np.ndarray, stays: Modes, left: Modes | None, rated: Rated
) -> ModeMotion | None:
    """Return admissible modes of contacts in space, found by pivoting; None if that leads nowhere.

    Where not all closed contacts may stay, they start from the modes that `forces_by_projection` shows. Every contact
    that violates the law changes to the mode that the violation points to, or only the first of them where that leads
    round in a circle. Contacts that stick at the edge of their cones leave it together with one that has just left it.
    Where all slides are proper the motion in such modes is the only one unless contacts are redundant, and it need not
    be compared with others.

    Args:
        dynamics, closed, left: as in `rated_modes`.
        stays: mode of every contact in which it neither parts nor begins to slide, (n_c).
        rated: dynamics with directions of slides, and modes -> their motion.
    """
    if stays != left:
        motion = rated(dynamics, stays)
        if motion.admissible:
            return motion
    dynamics, shown = _shown(dynamics, closed, stays)
    for at_once in (True, False):
        modes, seen = shown, set[Modes]()
        while modes not in seen:
            seen.add(modes)
            motion = rated(dynamics, modes)
            if motion.admissible and modes == left:
                alone = _without_room(dynamics, motion)
                for change in (_at_bound(dynamics, motion) | alone, alone):
                    nearest = replace(rated(dynamics, _changed(modes, change)), tolerance=_DRIFTED)
                    if nearest.admissible:
                        return nearest
            pivots = _pivots(dynamics, motion, closed, stays)
            if motion.admissible and modes != left:
                idle = {
                    i: mode for i, mode in pivots.items() if mode is ContactMode.STICK and motion.modes[i].direction
                }
                steady = rated(dynamics, _changed(modes, idle)) if idle else motion
                return steady if steady.admissible and steady.modes != left else motion
            changed = pivots if at_once else dict(list(pivots.items())[:1])
            modes = _changed(modes, changed)
    return None


def _shown(dynamics: ContactDynamics, closed: np.ndarray, stays: Modes) -> tuple[ContactDynamics, Modes]:
    """Return the modes that forces point to which obey the law nearly, and the directions in which they slide.

    Contacts that rest get the directions in which they accelerate, from which that of a beginning slide is solved for.
    """
    resting = np.array([mode is ContactMode.STICK for mode in stays], dtype=bool)
    forces = forces_by_projection(dynamics, closed, resting)
    after = dynamics.free + dynamics.compliance @ forces.ravel()
    parting, drifting = normal_rows(after, dynamics.rows), tangential_rows(after, dynamics.rows)
    moves, pushes = _SHOWN * scale_of(dynamics.free), _SHOWN * scale_of(forces)
    flies = closed & (forces[:, 0] <= pushes) & (parting > moves)
    slides = resting & ~flies & (np.linalg.norm(drifting, axis=1) > moves)
    modes = [
        ContactMode.FLIGHT if f else ContactMode.SLIP if s else stay
        for f, s, stay in zip(flies, slides, stays, strict=True)
    ]
    begins = slip_headings(drifting, dynamics.headings, slow=moves)
    return replace(dynamics, headings=np.where(resting[:, None], begins, dynamics.headings)), tuple(modes)


def _without_room(dynamics: ContactDynamics, motion: ModeMotion) -> dict[int, ContactMode]:
    """Return the contact that is nearest to a bound in modes that have just been left -> its mode beyond that.

    Where the state has drifted by a round-off since, the modes may be admissible still.
    """
    rooms, unused = list[tuple[float, int, ContactMode]](), _unused(dynamics, motion)
    for i, mode in enumerate(motion.modes):
        if mode is ContactMode.STICK:
            rooms.append((float(unused[i]), i, ContactMode.SLIP))
        if mode is not ContactMode.FLIGHT:
            rooms.append((float(motion.force[i, 0]), i, ContactMode.FLIGHT))
    _, contact, becomes = min(rooms, key=lambda room: room[0])
    return {contact: becomes}


def _at_bound(dynamics: ContactDynamics, motion: ModeMotion) -> dict[int, ContactMode]:
    """Return the contacts that stick at the edges of their friction cones -> that they slide."""
    room = _unused(dynamics, motion) / scale_of(motion.force)
    return {
        i: ContactMode.SLIP
        for i, mode in enumerate(motion.modes)
        if mode is ContactMode.STICK and dynamics.friction[i] > 0 and room[i] <= _AT_BOUND
    }


def _unused(dynamics: ContactDynamics, motion: ModeMotion) -> np.ndarray:
    """Return the friction that every contact could still take, mu f_n - |f_t|, N, (n_c)."""
    return np.asarray(dynamics.friction * motion.force[:, 0] - np.linalg.norm(motion.force[:, 1:], axis=1))


def _changed(modes: Modes, changes: Mapping[int, ContactMode]) -> Modes:
    return tuple(changes.get(i, mode) for i, mode in enumerate(modes))


def _pivots(dynamics: ContactDynamics, motion: ModeMotion, closed: np.ndarray, stays: Modes) -> dict[int, ContactMode]:
    """Return the contacts that violate the law -> the modes that their violations point to.

    One that pulls parts, one outside its friction cone slides, one that approaches stays, and one that would begin to
    slide but does not move along its friction sticks.
    """
    drift = dynamics.free - dynamics.jacobian @ dynamics.acceleration
    following = dynamics.jacobian @ motion.acceleration + drift
    parting, drifting = normal_rows(following, dynamics.rows), tangential_rows(following, dynamics.rows)
    found, still = dict[int, ContactMode](), ADMISSIBLE * scale_of(dynamics.free)
    for i in np.flatnonzero(closed).tolist():
        mode, push, friction = motion.modes[i], motion.force[i, 0], float(np.linalg.norm(motion.force[i, 1:]))
        if mode is ContactMode.FLIGHT:
            if parting[i] < 0:
                found[i] = stays[i]
        elif push < 0:
            found[i] = ContactMode.FLIGHT
        elif mode is ContactMode.STICK and friction > dynamics.friction[i] * push:
            found[i] = ContactMode.SLIP
        elif mode.direction and stays[i] is ContactMode.STICK and motion.headings[i] @ drifting[i] <= still:
            found[i] = ContactMode.STICK
    return found
