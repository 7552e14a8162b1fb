"""Where the contacts stand in stacked rows: normal and tangents of the first contact, of the second, and so on.

A contact has two rows in the plane, normal and tangent, and three in space.
"""

from __future__ import annotations

import numpy as np

IN_THE_PLANE = 2
"""Rows of a contact in the plane, and of the contacts of a motion that has none."""


def rows_each(stacked: np.ndarray, contacts: int) -> int:
    """Return how many rows every contact has in stacked rows of all."""
    return len(stacked) // contacts if contacts else IN_THE_PLANE


def rows_of(selected: np.ndarray, rows: int) -> np.ndarray:
    """Return which rows belong to the selected contacts, (rows n_c) of bool, from (n_c) of bool."""
    return np.repeat(selected, rows)


def normal_rows(stacked: np.ndarray, rows: int) -> np.ndarray:
    """Return the normal's rows of all contacts, (n_c, ...), a view on `stacked`, (rows n_c, ...)."""
    return stacked[0::rows]


def tangential_rows(stacked: np.ndarray, rows: int) -> np.ndarray:
    """Return the tangents' rows of all contacts, (n_c, rows - 1, ...), a view on `stacked`, (rows n_c, ...)."""
    return stacked.reshape(-1, rows, *stacked.shape[1:])[:, 1:]


def by_contact(stacked: np.ndarray, rows: int) -> np.ndarray:
    """Return one row (normal, tangential) a contact, (n_c, rows), from stacked entries, (rows n_c)."""
    return stacked.reshape(-1, rows)


def stacked_rows(forces: np.ndarray) -> np.ndarray:
    """Return stacked entries, (rows n_c), from one row (normal, tangential) a contact, (n_c, rows)."""
    return forces.ravel()


FACETS = 16
"""Of the pyramid that takes the place of a friction cone in space where bounds are linear."""


def cone_facets(directions: int) -> np.ndarray:
    """Return D with |f_t| <= mu f_n where ``D f_t <= mu f_n``, (facets, directions); exactly so in the plane.

    Args:
        directions: tangents of a contact, 1 or 2.
    """
    if directions == 1:
        return np.array([[1.0], [-1.0]])
    angles = 2 * np.pi * np.arange(FACETS) / FACETS
    return np.column_stack([np.cos(angles), np.sin(angles)]) / np.cos(np.pi / FACETS)
