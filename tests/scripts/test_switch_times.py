"""Which switches of a motion lie where control intervals end."""

from __future__ import annotations

from math import floor, log, sqrt
from pathlib import Path

import numpy as np

from fesd_robot.simulation import simulate_robot
from fesd_robot.task import load_task
from scripts.results import switch_times

BALL = Path(__file__).parents[2] / "tasks" / "simulated" / "spinning_ball.yaml"
FALL = sqrt(2 * 0.5 / 9.81)
"""s until the ball first touches the floor."""


def test_only_ends_of_intervals_are_on_the_grid() -> None:
    """A time counts if an interval ends there but for round-off, and not a thousandth of an interval beside it."""
    assert switch_times.on_grid([0.1, 0.15 + 1e-9, 0.15 + 5e-5, 0.975], np.linspace(0.0, 1.0, 21)) == 2


def test_a_ball_that_lands_where_an_interval_ends() -> None:
    """Impacts are those of a ball that keeps six tenths of its speed, down to the least; the first ends an interval."""
    intervals = [f"horizon.duration={10 * FALL!r}", "horizon.intervals=10"]
    impacts = 1 + floor(log(switch_times.HARD / (9.81 * FALL)) / log(0.6))
    row = switch_times.row_of(simulate_robot(load_task(BALL, intervals)))
    assert row[1:4] == ["10", str(impacts), "1"]
