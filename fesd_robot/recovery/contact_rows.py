"""Where the contacts stand in stacked rows: normal and tangent of the first contact, of the second, and so on."""

from __future__ import annotations

import numpy as np

ROWS = 2
"""Rows of one contact: its normal and its tangent in the plane."""


def rows_of(selected: np.ndarray) -> np.ndarray:
    """Return which rows belong to the selected contacts, (2 n_c) of bool, from (n_c) of bool."""
    return np.repeat(selected, ROWS)


def normal_rows(stacked: np.ndarray) -> np.ndarray:
    """Return the normal's rows of all contacts, (n_c, ...), a view on `stacked`, (2 n_c, ...)."""
    return stacked[0::ROWS]


def tangential_rows(stacked: np.ndarray) -> np.ndarray:
    """Return the tangent's rows of all contacts, (n_c, ...), a view on `stacked`, (2 n_c, ...)."""
    return stacked[1::ROWS]


def by_contact(stacked: np.ndarray) -> np.ndarray:
    """Return one row (normal, tangential) a contact, (n_c, 2), from stacked entries, (2 n_c)."""
    return stacked.reshape(-1, ROWS)


def stacked_rows(forces: np.ndarray) -> np.ndarray:
    """Return stacked entries, (2 n_c), from one row (normal, tangential) a contact, (n_c, 2)."""
    return forces.ravel()
