"""Times at which values change their signs inside a step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fesd_robot.replay.roots import crossing_time


@pytest.mark.parametrize(
    ("value", "expected"),
    [(lambda time: 0.3 - time, 0.3), (lambda time: -1.0 - time, 0.0), (lambda time: 2.0 - time, 1.0)],
    ids=["inside", "negative all along", "positive all along"],
)
def test_a_crossing_is_a_root_or_an_end(value: Callable[[float], float], expected: float) -> None:
    """A value that is negative already crosses at the start, one that stays positive by a round-off at the end."""
    assert crossing_time(lambda time: np.array([value(time)]), 0, 0.0, 1.0) == pytest.approx(expected, abs=1e-14)
