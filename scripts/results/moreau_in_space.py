"""Moreau's time stepping of a box in space: a reference that has nothing in common with the simulator but mechanics."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class Body(Protocol):
    """A rigid body: its corners in its own axes, (n, 3), m, mass, kg, inertia about its axes, (3), kg m^2, friction."""

    corners: np.ndarray
    mass: float
    inertia: np.ndarray
    friction: float


GRAVITY, TOLERANCE, SWEEPS = 9.81, 1e-9, 3000
HITS, PARTS = 1e-2, 2000  # m/s; parts of the impulse that would stop the fastest approach


def stepped(
    body: Body,
    position: np.ndarray,
    quaternion: np.ndarray,
    twist: np.ndarray,
    duration: float,
    step: float,
    *,
    at_once: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Return where a box is after steps of a fixed length, of first order in it: its centre and its rotation.

        v+ = v + M^-1 f dt + M^-1 J^T P at the midpoint,  P in the friction cone, and
        P = projection of P - rho (J v+ + mu |J_t v+| n) onto it, for corners that are below the floor there

    Where corners approach faster than `HITS`, their impulse grows in many small parts: all that approach push at the
    same rate, with friction against their velocity of that moment. Moreau's own law, with friction against the velocity
    after the impact, is another one; `at_once` takes it instead.

    Args:
        body: that moves over the floor z = 0.
        position, quaternion: of the box, (3), m, and (4), x, y, z, w.
        twist: linear and angular velocity in the axes of the box, (6).
        duration, step: s.
        at_once: whether impacts, too, are projections.

    Source: Jean, The non-smooth contact dynamics method, CMAME 177 (1999); De Saxce, Feng, Mathematical and Computer
    Modelling 28 (1998), for the projection.
    """
    x, turn = position.copy(), _rotation(quaternion)
    v, w = turn @ twist[:3], twist[3:].copy()
    corners, mass, inertia = body.corners, body.mass, body.inertia
    impulse, count = np.zeros((len(corners), 3)), round(duration / step)
    for _ in range(count):
        x, turn = x + 0.5 * step * v, turn @ _exponential(0.5 * step * w)
        v = v - step * GRAVITY * np.array([0.0, 0.0, 1.0])
        w = w - step * np.cross(w, inertia * w) / inertia
        arms = corners @ turn.T
        below = np.flatnonzero(x[2] + arms[:, 2] <= 0)
        impulse[np.setdiff1d(np.arange(len(corners)), below)] = 0.0
        if below.size:
            rows = np.concatenate([np.hstack([np.eye(3), -_cross_matrix(arm) @ turn]) for arm in arms[below]])
            weights = np.concatenate([np.full(3, 1 / mass), 1 / inertia])
            compliance, velocity = (rows * weights) @ rows.T, rows @ np.concatenate([v, w])
            change = np.zeros(6)
            if not at_once and velocity[2::3].min() < -HITS:
                change = weights * (rows.T @ _grown(compliance, velocity, body.friction).ravel())
                velocity = velocity + rows @ change
            found = _impulses(compliance, velocity, body.friction, impulse[below])
            impulse[below] = found
            change += weights * (rows.T @ found.ravel())
            v, w = v + change[:3], w + change[3:]
        x, turn = x + 0.5 * step * v, turn @ _exponential(0.5 * step * w)
    return x, turn


def _grown(compliance: np.ndarray, velocity: np.ndarray, friction: float) -> np.ndarray:
    """Return impulses of an impact, (n, 3), that grow until no contact approaches."""
    v, total = velocity.reshape(-1, 3).copy(), np.zeros((len(velocity) // 3, 3))
    part = -v[:, 2].min() / (PARTS * np.diag(compliance)[2::3].max())
    slow = 2 * part * friction * float(np.diag(compliance).max())
    while (v[:, 2] < 0).any():
        pushes = part * (v[:, 2] < 0)
        speeds = np.maximum(np.linalg.norm(v[:, :2], axis=1), max(slow, 1e-300))
        grown = np.column_stack([-(friction * pushes / speeds)[:, None] * v[:, :2], pushes])
        total += grown
        v += (compliance @ grown.ravel()).reshape(-1, 3)
    return total


def _impulses(compliance: np.ndarray, velocity: np.ndarray, friction: float, guess: np.ndarray) -> np.ndarray:
    """Return the impulses of all contacts, (n, 3), by projections onto their cones from a guess."""
    size, found = 1.0 / np.linalg.eigvalsh(compliance)[-1], guess.copy()
    for _ in range(SWEEPS):
        after = (velocity + compliance @ found.ravel()).reshape(-1, 3)
        after[:, 2] += friction * np.linalg.norm(after[:, :2], axis=1)
        projected = _onto_cones(found - size * after, friction)
        moved = float(np.abs(projected - found).max())
        found = projected
        if moved <= TOLERANCE * max(float(np.abs(found).max()), 1e-9):
            break
    return found


def _onto_cones(points: np.ndarray, friction: float) -> np.ndarray:
    """Return the nearest points of the cones |P_t| <= mu P_n, (n, 3)."""
    sizes, normal = np.linalg.norm(points[:, :2], axis=1), points[:, 2]
    height = np.maximum((normal + friction * sizes) / (1 + friction**2), 0.0)
    result = np.column_stack([points[:, :2] * (friction * height / np.maximum(sizes, 1e-300))[:, None], height])
    result[sizes <= friction * normal] = points[sizes <= friction * normal]
    result[friction * sizes <= -normal] = 0.0
    return np.asarray(result)


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    x, y, z, w = quaternion
    cross = _cross_matrix(np.array([x, y, z]))
    return np.asarray(np.eye(3) + 2 * w * cross + 2 * cross @ cross)


def _exponential(vector: np.ndarray) -> np.ndarray:
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3) + _cross_matrix(vector)
    cross = _cross_matrix(vector / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def _cross_matrix(a: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
