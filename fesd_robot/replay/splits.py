"""How contacts share a force that the motion leaves undivided."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from fesd_robot.exactness import SINGULAR


def widest_split(forces: np.ndarray, directions: np.ndarray, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the forces with the same resultant that keep the greatest distance to their bounds.

        max_z min_i (rows (forces + N z) + offsets)_i,   directions N = 0

    Args:
        forces: one of the possible divisions, (n).
        directions: generalised force of each of them, (n_v, n).
        rows, offsets: bounds ``rows forces + offsets >= 0``, (m, n) and (m).

    Returns:
        (n); `forces` if they are not redundant or keep to their bounds already.
    """
    if not rows.size or (rows @ forces + offsets).min() >= 0:
        return forces
    _, sizes, right = np.linalg.svd(directions)
    null = right[np.count_nonzero(sizes > SINGULAR * sizes[0]) :].T
    slopes = rows @ null
    if not null.size or not slopes.any():
        return forces
    least = (rows @ forces + offsets).min()
    reach = 1.0 + np.abs(forces).max()
    found = linprog(
        np.append(np.zeros(null.shape[1]), -1.0),
        A_ub=np.column_stack([-slopes, np.ones(len(rows))]),
        b_ub=rows @ forces + offsets,
        bounds=[(None, None)] * null.shape[1] + [(least, reach)],
        method="highs",
    )
    return forces + null @ found.x[:-1] if found.status == 0 else forces
