"""Impacts at once: impulses inside Coulomb's cone, by the velocities after the impact."""

from __future__ import annotations

from itertools import product

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import ROUNDED, SINGULAR_STEP
from fesd_robot.recovery import NumericPhysics

_MODES = (ContactMode.IMPACT_STICK, ContactMode.IMPACT_FORWARDS, ContactMode.IMPACT_BACKWARDS, ContactMode.FLIGHT)
"""Of a contact that touches, the last without an impulse, in the order in which they are tried."""


def impact_at_once(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return velocity after an impact in the plane, impulses (n_c, 2), and whether there is such an impact.

    ``M (v+ - v) = J^T P`` and for every touching contact either ``P = 0`` and ``J_n v+ >= 0``, or ``P_n >= 0``,
    ``J_n v+ = e max(-J_n v, 0)`` and Coulomb's law for P_t and J_t v+. Of several possible combinations the first is
    taken, contacts that stick before those that slip.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity before (n_v).
        touching: contacts whose gap is closed, (n_c) of bool.

    Source: Nurkanovic et al., arXiv 2305.17003, the impulse equations.
    """
    jacobian = physics.contact_jacobian(q)
    response = np.linalg.solve(physics.mass_matrix(q), jacobian.T)
    compliance, before = jacobian @ response, jacobian @ v
    rebound = np.zeros(len(before))
    rebound[::2] = physics.restitution * np.maximum(-before[::2], 0.0)
    closed, zero = np.flatnonzero(touching), ROUNDED * max(1.0, float(np.abs(before).max(initial=0.0)))
    for modes in product(_MODES, repeat=len(closed)):
        impulse = _impulse(compliance, rebound - before, physics.friction, closed, modes)
        after = before + compliance @ impulse
        if _possible(after - rebound, impulse, physics.friction, dict(zip(closed.tolist(), modes, strict=True)), zero):
            return v + response @ impulse, impulse.reshape(-1, 2), True
    return v, np.zeros((len(touching), 2)), False


def _impulse(
    compliance: np.ndarray, change: np.ndarray, friction: np.ndarray, closed: np.ndarray, modes: Modes
) -> np.ndarray:
    """Return the impulse that changes the velocities that modes prescribe, normal and tangential in turn, (2 n_c)."""
    columns, rows = list[np.ndarray](), list[int]()
    for contact, mode in zip(closed.tolist(), modes, strict=True):
        normal, tangent = np.zeros(len(change)), np.zeros(len(change))
        normal[2 * contact] = tangent[2 * contact + 1] = 1.0
        if mode is ContactMode.IMPACT_STICK:
            columns += [normal, tangent]
            rows += [2 * contact, 2 * contact + 1]
        elif mode.hits:
            columns.append(normal - mode.direction * friction[contact] * tangent)
            rows.append(2 * contact)
    if not columns:
        return np.zeros(len(change))
    basis = np.array(columns).T
    return np.asarray(basis @ np.linalg.lstsq((compliance @ basis)[rows], change[rows], rcond=SINGULAR_STEP)[0])


def _possible(
    after: np.ndarray, impulse: np.ndarray, friction: np.ndarray, modes: dict[int, ContactMode], zero: float
) -> bool:
    for contact, mode in modes.items():
        normal, tangential = after[2 * contact], after[2 * contact + 1]
        push, rub = impulse[2 * contact], impulse[2 * contact + 1]
        if normal < -zero or push < -zero or (mode.hits and normal > zero):
            return False
        if mode is ContactMode.IMPACT_STICK and (abs(rub) > friction[contact] * push + zero or abs(tangential) > zero):
            return False
        if mode.direction * tangential < -zero:
            return False
    return True
