"""Whether a robot can be held still: forces of controls and contacts against its weight."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from fesd_robot.recovery.contact_rows import cone_facets, rows_of
from fesd_robot.recovery.physics import NumericPhysics


def holding_effort(
    physics: NumericPhysics, q: np.ndarray, limits: tuple[np.ndarray, np.ndarray], closed: np.ndarray
) -> tuple[float, np.ndarray] | None:
    """Return the ratio of its control limits that a robot needs at least to stand still, and controls that do it.

        min k   s.t.   B(q) u + J(q)ᵀ f + τ = g(q),   k u_lower <= u <= k u_upper,   |f_t| <= mu f_n,   |τ| <= F

    with the dry friction τ of joints. In space the friction cone is a pyramid inside it, and a limit
    surface a box.

    Args:
        physics: the robot, its contacts and what its controls push.
        q: configuration, (n_q).
        limits: lower and upper bounds of the controls, N or N m, (n_u) each, with zero between them.
        closed: which contacts can push, (n_c) of bool.

    Returns:
        k, above 1 if the controls are too weak, and u, (n_u); None if no force of the controls, however large, no
        force of the contacts within their friction cones and no dry friction of joints holds the robot still, or if a
        control cannot be zero.
    """
    lower, upper = limits
    if (lower > 0).any() or (upper < 0).any():
        return None
    controls, no_control = len(lower), np.zeros(len(lower))
    v = np.zeros(physics.contact_jacobian(q).shape[1])
    weight = physics.required_force(q, v, v, no_control)
    pushes = np.column_stack([physics.generalized_force(q, row) for row in np.eye(controls)])
    jacobian = physics.contact_jacobian(q)[rows_of(closed, physics.rows)]
    friction, count = physics.friction[closed], int(closed.sum())
    rubbing = physics.rubbing
    limits_of_joints = rubbing.limit.copy()
    for unit in rubbing.surfaces:
        limits_of_joints[unit] /= np.sqrt(len(unit))
    # Unknowns: k, u, (f_n, f_t...) of every closed contact, and the dry friction of joints.
    balance = np.column_stack([np.zeros(len(v)), pushes, jacobian.T, np.eye(len(v))[:, physics.friction_coordinates]])
    facets, per_contact = cone_facets(physics.rows - 1), physics.rows
    bounded = np.zeros((2 * controls + len(facets) * count, balance.shape[1]))
    for i in range(controls):
        bounded[2 * i, [0, 1 + i]] = [-upper[i], 1]
        bounded[2 * i + 1, [0, 1 + i]] = [lower[i], -1]
    for i in range(count):
        row, normal = 2 * controls + len(facets) * i, 1 + controls + per_contact * i
        bounded[row : row + len(facets), normal] = -friction[i]
        bounded[row : row + len(facets), normal + 1 : normal + per_contact] = facets
    optimum = linprog(
        np.eye(1, balance.shape[1])[0],
        A_ub=bounded,
        b_ub=np.zeros(len(bounded)),
        A_eq=balance,
        b_eq=weight,
        bounds=[(0, None)]
        + [(None, None)] * controls
        + [(0, None), *[(None, None)] * (per_contact - 1)] * count
        + [(-limit, limit) for limit in limits_of_joints],
    )
    return (float(optimum.x[0]), optimum.x[1 : 1 + controls]) if optimum.status == 0 else None
