"""States between the stages of finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fesd_robot.contact import ContactMode

PARTS = 8
"""Equal parts of an element at whose ends its states are taken."""

FRACTIONS = np.linspace(0.0, 1.0, PARTS + 1)
"""Of an element in numerical time: its left end, P - 2 interior points, its right end."""


@dataclass(frozen=True)
class DenseSamples:
    """States of the collocation polynomials at P points of each of the E elements in which the clock runs.

    Attributes:
        time: (E, P), s, from the left end of an element to its right end.
        configuration, velocity: (E, P, n_q), (E, P, n_v).
        interval: control interval of each element, (E,).
        control: without the speed of time, (E, n_u).
        mode: of every contact in each element, as the branch says, `ContactMode`, (E, n_c).
        joint_mode: of every joint with dry friction in each element, stick or a direction of slip, (E, n_f).
    """

    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    interval: np.ndarray
    control: np.ndarray
    mode: np.ndarray
    joint_mode: np.ndarray


@dataclass(frozen=True)
class DenseElement:
    """One element of `DenseSamples`: the same without the first axis."""

    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    interval: int
    control: np.ndarray
    mode: Sequence[ContactMode]
    joint_mode: Sequence[ContactMode] = ()


def stacked_elements(elements: Sequence[DenseElement], sizes: tuple[int, int, int, int]) -> DenseSamples:
    """Return the dense samples of elements in time order; there may be none.

    Args:
        sizes: n_q, n_v, n_u and n_c.
    """
    (n_q, n_v, n_u, n_c), count, points = sizes, len(elements), len(FRACTIONS)
    mode = np.empty((count, n_c), dtype=object)
    joint_mode = np.empty((count, len(elements[0].joint_mode) if elements else 0), dtype=object)
    for e, element in enumerate(elements):
        mode[e], joint_mode[e] = element.mode, element.joint_mode
    return DenseSamples(
        time=np.array([element.time for element in elements]).reshape(count, points),
        configuration=np.array([element.configuration for element in elements]).reshape(count, points, n_q),
        velocity=np.array([element.velocity for element in elements]).reshape(count, points, n_v),
        interval=np.array([element.interval for element in elements], dtype=int),
        control=np.array([element.control for element in elements]).reshape(count, n_u),
        mode=mode,
        joint_mode=joint_mode,
    )
