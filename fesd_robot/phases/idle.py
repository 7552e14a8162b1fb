"""Slides that do not move: what a contact with a reserve may not use all of its friction for."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.exactness import NO_SQUARE
from fesd_robot.ocp import MotionProblem
from fesd_robot.phases.discretised import Discretised

IDLE = 1e-3
"""m/s; a slide in which a contact is never faster is none: the plan says that it sticks."""


def idle_slides(motion: MotionProblem, own: Discretised, w: np.ndarray) -> list[tuple[int, int]]:
    """Return the phases, and the contacts in them, that keep a reserve where they stick and slide without moving.

    Coulomb's law lets a contact at rest have all of its friction, as the limit of ever slower slides; a branch that
    says that it slides has that motion, too.

    Args:
        motion: the formulated task.
        own: a sequence on its grid.
        w: a point on it, (n).

    Returns:
        number of a phase and of a contact, each.
    """
    kept = [n for n, contact in enumerate(motion.contacts) if contact.sticking_reserve > 0]
    slides = [(i, n) for i, phase in enumerate(own.sequence.phases) for n in kept if phase.modes[n].direction]
    if not slides:
        return []
    q, v = motion.dynamics.configuration, motion.dynamics.velocity
    speeds = [ca.sqrt(ca.sumsqr(ca.vertcat(*one.tangential_velocities(v))) + NO_SQUARE) for one in motion.contacts]
    speed, n_q, n_v = ca.Function("speeds", [q, v], [ca.vertcat(*speeds)]), q.numel(), v.numel()
    elements, impulses = own.transcription.unpack(w), own.transcription.ocp.system.jump is not None
    found = []
    for i, n in slides:
        inside = [one for one in elements if own.nodes[i] <= one.interval < own.nodes[i + 1]]
        running = inside[0 if impulses else len(own.sequence.phases[i].impacts) :]
        states = np.vstack([one.x for one in running])
        own_speeds = np.asarray(speed(states[:, :n_q].T, states[:, n_q : n_q + n_v].T).full())[n]
        if own_speeds.max() <= IDLE:
            found.append((i, n))
    return found
