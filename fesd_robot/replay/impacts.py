"""Impacts: contacts push at the same rate with friction until each parts as its restitution asks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.recovery import NumericPhysics, by_contact, normal_rows
from fesd_robot.replay.impact_process import SETTLED, ZERO_OF_LARGEST, Choice, ImpactProcess
from fesd_robot.replay.impact_state import ImpactState
from fesd_robot.replay.impulse_cone import impact_at_once

LEAST_REBOUND = 1e-3
"""m/s; a contact that would part more slowly has no restitution, so that ever smaller bounces come to an end: one of
this speed is 5e-8 m high, and the last ones take 2 `LEAST_REBOUND` / (g (1 - e)) together. It is the velocity up to
which a contact counts as closed where a replay begins."""

_PRESSED = 1e-9
"""m/s, or ten times what counts as zero: with which contacts approach that do not collide but are to have an impact."""

_LEVEL = 1e-6
"""Ratio of singular values of normals that count as redundant."""

_PHASES = 100
"""Phases of one impact after which it counts as unfinished."""


@dataclass(frozen=True)
class Impact:
    """Result of an impact.

    Attributes:
        velocity: after it, (n_v).
        impulse: normal and tangential, N s, (n_c, rows).
        finished: whether no touching contact approaches any more.
    """

    velocity: np.ndarray
    impulse: np.ndarray
    finished: bool


def rebounds(physics: NumericPhysics, velocity: np.ndarray) -> np.ndarray:
    """Return with which normal velocity every contact parts that hits, -e v_n, m/s, (n_c); 0 where it is too slow.

    Args:
        velocity: J v before the impact, m/s, (rows n_c).
    """
    approach = np.maximum(-normal_rows(velocity, physics.rows), 0.0)
    wanted = physics.restitution * approach
    return np.asarray(np.where(wanted > LEAST_REBOUND, wanted, 0.0))


def levelled(physics: NumericPhysics, q: np.ndarray, touching: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """Return the configuration next to one, (n_q), in which contacts that touch are on the ground.

    Corners of a face that hit at once are not all equally high, by the tolerance of what is at once. Where they are,
    what a rigid face needs to stop is redundant exactly; where they are not, it turns by so little that nothing can be
    said of the direction in which its corners slide.

    Args:
        touching: contacts, (n_c) of bool.
        ground: gap at which every one touches, m, (n_c).
    """
    normal = normal_rows(physics.contact_jacobian(q), physics.rows)[touching]
    off = (physics.gaps(q) - ground)[touching]
    return physics.integrate(q, -np.linalg.lstsq(normal, off, rcond=_LEVEL)[0])


def impact(
    physics: NumericPhysics,
    q: np.ndarray,
    v: np.ndarray,
    touching: np.ndarray,
    pressed: np.ndarray | None = None,
    level: np.ndarray | None = None,
) -> Impact:
    """Return velocity and impulses after an impact with restitution and Coulomb friction.

    The configuration stands still while impulses P grow, M dv = J^T dP, until no contact is slower than it has to part,
    w = J_n v + e J_n v- >= 0. Of one that does not hit, as a contact at rest, J_n v- is 0. In units of the normal
    impulse of one approaching contact,

        w < 0:  dP_n = 1
        w = 0:  0 <= dP_n <= 1 and dw = 0, or dP_n = 0 and dw >= 0, or dP_n = 1 and dw < 0
        dP_t = -mu sgn(J_t v) dP_n,  or |dP_t| <= mu dP_n and J_t dv = 0 where J_t v = 0

    and in space -v_t / |v_t| takes the place of the sign. In the plane rates are constant until a velocity becomes
    zero, so every phase is exact; in space the velocity of a contact that slides turns, and a phase is integrated with
    DOP853.

    So a contact that hits alone obeys Newton's law v_n+ = -e v_n-. Where a slide ends or turns round inside the impact,
    or other contacts push, that law may return more energy than was lost. No normal force does: as soon as its work
    over the impact, the integral of J_n v dP_n, is no longer negative, the restitution of its contact is spent and e is
    0 from then on. As friction takes energy, too, none is gained, whatever contacts there are.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity before (n_v).
        touching: contacts whose gap is closed, (n_c) of bool.
        pressed: contacts that begin with an approach of `_PRESSED` besides their own, (n_c) of bool; none if omitted.
            It is enough for slides in paradox, as a push only makes them approach faster.
        level: configuration next to q in which all touching contacts are on the ground, (n_q), as `levelled` finds it;
            the contact Jacobian is that of q if it is omitted.

    Where the physics has its impacts happen at once, `impulse_cone.impact_at_once` is the law instead.

    Source: Nurkanovic et al., arXiv 2111.06759, section 3: the auxiliary dynamics of time freezing, as an impact law;
    Stronge, Impact Mechanics (2000), chapter 3, for restitution by the work of the normal force.
    """
    if physics.impacts_at_once:
        return Impact(*impact_at_once(physics, q, v, touching))
    jacobian = physics.contact_jacobian(q if level is None else level)
    response = np.linalg.solve(physics.mass_matrix(q), jacobian.T)
    process = ImpactProcess(jacobian, jacobian @ response, physics.friction, np.asarray(touching), physics.rows)
    before = jacobian @ v
    zero = ZERO_OF_LARGEST if physics.rows == 2 else 10 * SETTLED
    small, finished = zero * max(1.0, float(np.abs(before).max(initial=0.0))), False
    if pressed is not None:
        normal_rows(before, physics.rows)[:] -= np.where(pressed, max(_PRESSED, 10.0 * small), 0.0)
    state = ImpactState.of(before, np.where(touching, rebounds(physics, before), 0.0), physics.rows)
    left: Choice | None = None
    for _ in range(_PHASES):
        process.settle(state.velocity, small)
        finished = not bool((normal_rows(state.velocity, physics.rows)[process.touching] < 0).any())
        if finished:
            break
        phase = process.phase(state.velocity, left)
        if phase is None:
            break
        after = process.after(phase, state)
        if after is None:
            break
        state, left = after
    return Impact(v + response @ state.impulse, by_contact(state.impulse, physics.rows), finished)
