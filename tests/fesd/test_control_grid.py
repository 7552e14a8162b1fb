"""Control grids: their nodes, phases, knots and spans."""

from __future__ import annotations

import pytest

from fesd_robot.errors import DimensionError
from fesd_robot.fesd.grid import ControlGrid, Span

MOVING = ControlGrid((0.1, 0.1, 0.3, 0.3, 0.2), (2, 2, 1), moving=True, knots=(3, 5))


def test_nodes_are_sums_of_lengths() -> None:
    """The last node of a grid is the sum of all lengths."""
    assert MOVING.nodes == pytest.approx([0, 0.1, 0.2, 0.5, 0.8, 1.0])
    assert ControlGrid.uniform(2.0, 4).nodes == pytest.approx([0, 0.5, 1, 1.5, 2])


def test_intervals_of_a_phase_have_successors() -> None:
    """All but the last interval of every phase have one in it."""
    assert MOVING.within_phases == [0, 2]
    assert ControlGrid.uniform(1.0, 3).within_phases == [0, 1]


@pytest.mark.parametrize(
    ("begin", "end", "numbers"), [(0.2, 0.8, [2, 3]), (0, 1, [0, 1, 2, 3, 4]), (0.5, 0.5, [2]), (0.8, 1, [4])]
)
def test_a_span_is_the_intervals_between_its_ends(begin: float, end: float, numbers: list[int]) -> None:
    """A span of one time is the interval that ends there."""
    assert list(MOVING.between(Span(begin, end))) == numbers


def test_a_span_ends_at_nodes() -> None:
    """A time without a node is an error that names the nearest."""
    with pytest.raises(DimensionError, match=r"no node at 0.45 s, the nearest is at 0.5 s"):
        MOVING.between(Span(0.2, 0.45))


@pytest.mark.parametrize(
    ("phases", "knots", "message"),
    [((2, 2), (5,), "expected positive numbers with the sum 5"), ((5, 0), (5,), "positive"), ((5,), (0,), "1 to 5")],
)
def test_a_grid_that_does_not_fit_is_refused(phases: tuple[int, ...], knots: tuple[int, ...], message: str) -> None:
    """Phases add up to the intervals, and a knot is the end of one of them."""
    with pytest.raises(DimensionError, match=message):
        ControlGrid(MOVING.lengths, phases, moving=True, knots=knots)
