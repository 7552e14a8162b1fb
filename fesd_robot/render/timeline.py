"""Stretches of time in which a contact keeps its mode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fesd_robot.contact import ContactMode


class ModeSpan(NamedTuple):
    """A stretch of time in which a contact keeps its mode; `start` and `end` in s."""

    mode: ContactMode
    start: float
    end: float


def mode_spans(time: np.ndarray, modes: Sequence[ContactMode]) -> list[ModeSpan]:
    """Return the stretches of one contact with one mode each, in order and without gaps between them.

    The stretch between two samples has the mode of the second one, because a sample where the mode changes still
    belongs to the one that ends there. An impact has no duration and takes the mode of its neighbour.
    """
    spans: list[ModeSpan] = []
    for index in np.flatnonzero(np.diff(time) > 0).tolist():
        start, end = float(time[index]), float(time[index + 1])
        mode = next(
            (near for near in (modes[index + 1], modes[index]) if near != ContactMode.IMPACT), ContactMode.FLIGHT
        )
        if spans and spans[-1].mode == mode:
            spans[-1] = spans[-1]._replace(end=end)
        else:
            spans.append(ModeSpan(mode, start, end))
    return spans
