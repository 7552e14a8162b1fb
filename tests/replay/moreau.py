"""Moreau's time stepping: a reference with nothing in common with the replay but the physics."""

from __future__ import annotations

import numpy as np

from fesd_robot.recovery.physics import NumericPhysics


def step_through(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, u: np.ndarray, duration: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return configuration and velocity after steps of a fixed length, of first order in it.

        v+ = v + M^-1 (-h - D v + B u) dt + M^-1 J^T P at the midpoint,  0 <= P_n ⊥ J_n v+ >= 0,
        P_t in -mu P_n Sgn(J_t v+) for contacts whose gap is not positive there

    by block Gauss-Seidel iterations. A contact that is closed at the start, or below the ground, touches where it is.

    Source: Jean, The non-smooth contact dynamics method, CMAME 177 (1999).
    """
    gaps, count = physics.gaps(q), round(duration / step)
    closed = (gaps <= 1e-3) & (np.abs(physics.contact_jacobian(q)[0::2] @ v) <= 1e-2)
    ground = np.where(closed, gaps + 1e-12, np.minimum(gaps, 0.0))
    impulse = np.zeros((len(gaps), 2))
    dt = duration / count
    for _ in range(count):
        middle = physics.integrate(q, 0.5 * dt * v)
        mass = physics.mass_matrix(middle)
        free = v - dt * np.linalg.solve(mass, physics.required_force(middle, v, np.zeros_like(v), u))
        active = np.flatnonzero(physics.gaps(middle) <= ground)
        if active.size:
            jacobian = physics.contact_jacobian(middle)
            response = np.linalg.solve(mass, jacobian.T)
            impulse[:] = _gauss_seidel(jacobian @ response, jacobian @ free, physics.friction, active, impulse)
            free = free + response @ impulse.ravel()
        v = free
        q = physics.integrate(middle, 0.5 * dt * v)
    return q, v


def _gauss_seidel(
    compliance: np.ndarray, velocity: np.ndarray, friction: np.ndarray, active: np.ndarray, guess: np.ndarray
) -> np.ndarray:
    """Return impulses (n_c, 2) of the active contacts: each in turn as if it were the only one."""
    impulse = np.zeros_like(guess)
    impulse[active] = guess[active]
    for _ in range(500):
        before = impulse.copy()
        for i in active:
            own = slice(2 * i, 2 * i + 2)
            block, impulse[i] = compliance[own, own], 0.0
            impulse[i] = _alone(block, (velocity + compliance @ impulse.ravel())[own], friction[i])
        if len(active) == 1 or np.abs(impulse - before).max() <= 1e-10 * np.abs(impulse).max():
            break
    return impulse


def _alone(compliance: np.ndarray, velocity: np.ndarray, mu: float) -> np.ndarray:
    """Return the impulse (normal, tangential) of one contact whose velocity is `velocity` without it.

    Where sticking and parting are both possible, it sticks.
    """
    stick = -np.linalg.solve(compliance, velocity)
    if abs(stick[1]) <= mu * stick[0]:
        return stick
    if velocity[0] >= 0:
        return np.zeros(2)
    for sign in (1.0, -1.0):
        direction = np.array([1.0, -mu * sign])
        normal = -velocity[0] / (compliance[0] @ direction)
        if normal > 0 and sign * (velocity[1] + normal * compliance[1] @ direction) >= 0:
            return normal * direction
    raise AssertionError("no impulse obeys the law")
