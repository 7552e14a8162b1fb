"""The watch on what the program prints sees lines, their times and lengths."""

from __future__ import annotations

from scripts.results import progress_times

SHORT = (
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "reference={type: line}",
    "goal.configuration.root_x=0.1",
    "solver.tolerance=1e-6",
    "output.figures=false",
)


def test_a_short_plan_is_watched() -> None:
    """Lines come before the end, none is wider than a terminal, and the silence is one between two of them."""
    times = progress_times.watched("published_hopper_one_jump", 60.0, list(SHORT))
    assert 0 < times.first < times.seconds and 0 < times.silence <= times.seconds
    assert 20 < times.columns <= progress_times.COLUMNS
