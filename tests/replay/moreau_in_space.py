"""Moreau's time stepping in space: a reference with nothing in common with the replay's events and modes."""

from __future__ import annotations

import numpy as np

from fesd_robot.recovery.physics import NumericPhysics

SWEEPS, TOLERANCE, CLOSED = 20000, 1e-12, 1e-9


def step_through(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, u: np.ndarray, duration: float, step: float
) -> np.ndarray:
    """Return the configuration after steps of a fixed length, of first order in it.

        v+ = v + M^-1 (-h + B u) dt + M^-1 J^T P at the midpoint, and
        P = projection of P - rho (J v+ + mu |J_t v+| n) onto the friction cones, for contacts that touch there

    Args:
        physics: in space.
        q, v, u: configuration (n_q), velocity (n_v), controls (n_u), SI units.
        duration, step: s.

    Source: Jean, The non-smooth contact dynamics method, CMAME 177 (1999); De Saxce, Feng, Mathematical and Computer
    Modelling 28 (1998), for the projection.
    """
    impulse, count = np.zeros((len(physics.friction), 3)), round(duration / step)
    dt = duration / count
    for _ in range(count):
        middle = physics.integrate(q, 0.5 * dt * v)
        mass = physics.mass_matrix(middle)
        v = v - dt * np.linalg.solve(mass, physics.required_force(middle, v, np.zeros_like(v), u))
        touches = physics.gaps(middle) <= CLOSED
        impulse[~touches] = 0.0
        if touches.any():
            jacobian = physics.contact_jacobian(middle)[np.repeat(touches, 3)]
            response = np.linalg.solve(mass, jacobian.T)
            found = _impulses(jacobian @ response, jacobian @ v, physics.friction[touches], impulse[touches])
            impulse[touches], v = found, v + response @ found.ravel()
        q = physics.integrate(middle, 0.5 * dt * v)
    return q


def _impulses(compliance: np.ndarray, velocity: np.ndarray, friction: np.ndarray, guess: np.ndarray) -> np.ndarray:
    size, found = 1.0 / np.linalg.eigvalsh(compliance)[-1], guess
    for _ in range(SWEEPS):
        after = (velocity + compliance @ found.ravel()).reshape(-1, 3)
        after[:, 0] += friction * np.linalg.norm(after[:, 1:], axis=1)
        following = _onto_cones(found - size * after, friction)
        moved, found = float(np.abs(following - found).max()), following
        if moved <= TOLERANCE * max(float(np.abs(found).max()), 1e-9):
            break
    return found


def _onto_cones(points: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return the nearest points of the cones |P_t| <= mu P_n, (n, 3)."""
    result = np.zeros_like(points)
    for i, (point, mu) in enumerate(zip(points, friction, strict=True)):
        size = float(np.linalg.norm(point[1:]))
        if size <= mu * point[0]:
            result[i] = point
        elif mu * size > -point[0]:
            height = (point[0] + mu * size) / (1 + mu**2)
            result[i, 0], result[i, 1:] = height, mu * height * point[1:] / size
    return result
