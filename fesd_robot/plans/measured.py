"""A measured value with the place where it was found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Measured:
    """One value of an audit's entry.

    Attributes:
        value: in its unit.
        time: s; None if it has no place in time.
        interval: number of the control interval.
        subject: name of a contact, a coordinate, a control or a constraint.
        unit: of the value, if it is not the entry's.
        detail: what else there is to say about the value, in words.
    """

    value: float
    time: float | None = None
    interval: int | None = None
    subject: str = ""
    unit: str = ""
    detail: str = ""


@dataclass(frozen=True)
class Names:
    """Names in the order of a motion's arrays.

    Attributes:
        contacts: of the rigid contacts, (n_c).
        compliant: of those that give way, (n_s).
        configuration, velocity, controls: name of each coordinate or control -> its unit.
    """

    contacts: Sequence[str]
    configuration: Mapping[str, str]
    velocity: Mapping[str, str]
    controls: Mapping[str, str]
    compliant: Sequence[str] = ()


def cone_excess(force: np.ndarray, friction: float) -> tuple[float, str]:
    """Return |f_t| - mu max(f_n, 0), N, and in words which coefficient the force needs.

    Args:
        force: normal and tangential, N, (rows,).
        friction: mu.
    """
    normal, tangential = float(force[0]), float(np.linalg.norm(force[1:]))
    needed = f"it would need a coefficient of {tangential / normal:.4g} where it has {friction:g}" if normal > 0 else ""
    return tangential - friction * max(normal, 0.0), needed


def largest(values: Iterable[Measured]) -> Measured:
    """Return the largest value, zero if none is larger; NaN if there is one, so that it does not pass."""
    worst = Measured(0.0)
    for one in values:
        if np.isnan(one.value):
            return one
        if one.value > worst.value:
            worst = one
    return worst


def largest_entry(values: np.ndarray, time: np.ndarray, interval: np.ndarray, subjects: Sequence[str]) -> Measured:
    """Return the largest entry of a matrix, zero if none is larger, NaN if there is one.

    Args:
        values: (n, k).
        time, interval: s and number of the control interval of each row, (n,).
        subjects: what each column is about, (k).
    """
    if not values.size:
        return Measured(0.0)
    row, column = np.unravel_index(int(np.argmax(values)), values.shape)  # argmax finds the first NaN
    value = float(values[row, column])
    if value <= 0:
        return Measured(0.0)
    return Measured(value, float(time[row]), int(interval[row]), subjects[int(column)])
