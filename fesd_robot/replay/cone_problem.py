"""Forces of contacts in space that obey Coulomb's law nearly, from which their modes are read."""

from __future__ import annotations

import numpy as np

from fesd_robot.recovery import by_contact, normal_rows, tangential_rows
from fesd_robot.replay.dynamics import ContactDynamics

_SWEEPS = 1000
"""At most, of projections."""

_ENOUGH = 1e-7
"""Change in a sweep, as a ratio of the largest force, at which the forces are near enough."""


def forces_by_projection(dynamics: ContactDynamics, closed: np.ndarray, resting: np.ndarray) -> np.ndarray:
    """Return forces of the closed contacts that obey Coulomb's law, (n_c, rows), by projections onto their cones.

        f = P_K(f - rho (a + mu |a_t| n)) of one at rest,  f = P_+(f_n - rho a_n) (n - mu e) of one that slides along e

    with the accelerations ``a = free + W f`` of all contacts. They begin at zero and all change at once, so that
    contacts that are alike get like shares of what mechanics leaves undivided.

    Args:
        dynamics: of the state, in space.
        closed: contacts that touch and have no normal velocity, (n_c) of bool.
        resting: those of them without a tangential velocity, (n_c) of bool.

    Source: De Saxce, Feng, Mathematical and Computer Modelling 28 (1998), for the projection.
    """
    friction, forces = dynamics.friction, np.zeros((len(closed), dynamics.rows))
    against = np.column_stack([np.ones(len(closed)), -friction[:, None] * dynamics.headings])
    step = 1.0 / max(float(np.linalg.eigvalsh(dynamics.compliance)[-1]), 1e-300)
    for _ in range(_SWEEPS):
        before, after = forces, dynamics.free + dynamics.compliance @ forces.ravel()
        parting, drifting = normal_rows(after, dynamics.rows), tangential_rows(after, dynamics.rows)
        pushes = np.maximum(forces[:, 0] - step * parting, 0.0)
        bent = by_contact(after, dynamics.rows).copy()
        bent[:, 0] += friction * np.linalg.norm(drifting, axis=1)
        forces = np.where(resting[:, None], _onto_cones(before - step * bent, friction), pushes[:, None] * against)
        forces[~closed] = 0.0
        if np.abs(forces - before).max() <= _ENOUGH * np.abs(forces).max():
            break
    return forces


def _onto_cones(points: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return the nearest points of the cones |f_t| <= mu f_n, (n_c, 3)."""
    sizes, normal = np.linalg.norm(points[:, 1:], axis=1), points[:, 0]
    height = np.maximum((normal + friction * sizes) / (1.0 + friction**2), 0.0)
    along = points[:, 1:] / np.maximum(sizes, 1e-300)[:, None]
    onto = np.column_stack([height, (friction * height)[:, None] * along])
    return np.where((sizes <= friction * normal)[:, None], points, onto) * (friction * sizes > -normal)[:, None]
