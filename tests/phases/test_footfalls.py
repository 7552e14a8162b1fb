"""Orders in which feet step follow from where they stand."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.phases.footfalls import MOST_FEET, Feet, Groups, beyond_support, footfall_sequences

QUADRUPED = np.array([[0.2, 0.15], [0.2, -0.15], [-0.2, 0.15], [-0.2, -0.15]])
"""Front left, front right, hind left, hind right, m."""

STEP = np.array([0.08, 0.0])


def _feet(start: np.ndarray, step: np.ndarray = STEP) -> Feet:
    """All feet go the same way, the centre of mass above their middle."""
    return Feet(start, start + step, range(len(start)), start.mean(axis=0), start.mean(axis=0) + step)


def _crossing(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the segments between two pairs of points, (2, 2) each, cross."""

    def side(pair: np.ndarray, x: np.ndarray) -> float:
        (d0, d1), (e0, e1) = pair[1] - pair[0], x - pair[0]
        return float(np.sign(d0 * e1 - d1 * e0))

    return side(a, b[0]) != side(a, b[1]) and side(b, a[0]) != side(b, a[1])


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def test_the_distance_from_a_support_is_that_from_its_convex_hull() -> None:
    """Of a rectangle, a line and a point, inside and outside, as geometry says."""
    assert beyond_support(np.zeros(2), QUADRUPED) == pytest.approx(-0.15)
    assert beyond_support(np.array([0.0, 0.25]), QUADRUPED) == pytest.approx(0.1)
    assert beyond_support(np.array([0.5, 0.55]), QUADRUPED) == pytest.approx(0.5)
    assert beyond_support(np.array([0.3, 0.1]), np.array([[-1.0, 0.0], [1.0, 0.0]])) == pytest.approx(0.1)
    assert beyond_support(np.array([0.3, 0.4]), np.zeros((1, 2))) == pytest.approx(0.5)
    assert beyond_support(np.zeros(2), np.zeros((1, 2))) == 0.0


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
@pytest.mark.parametrize("names", [(0, 1, 2, 3), (2, 0, 3, 1)])
def test_pairs_are_diagonal_whatever_the_feet_are_called(angle: float, names: tuple[int, ...]) -> None:
    """The lines between the feet of both pairs cross, in any order of the feet and any direction of travel."""
    start = _turned(QUADRUPED[list(names)], angle)
    pairs, _ = footfall_sequences(_feet(start, _turned(STEP, angle)))
    first, second = (start[list(pair)] for pair in pairs)
    assert len(first) == len(second) == 2 and _crossing(first, second)


def test_single_feet_step_in_the_order_of_a_walk() -> None:
    """A hind foot, the front foot of its side, then the same of the other side.

    That order keeps the centre of mass farthest inside its support: McGhee and Frank, On the stability properties of
    quadruped creeping gaits, Mathematical Biosciences 3 (1968).
    """
    _, single = footfall_sequences(_feet(QUADRUPED))
    order = [foot for (foot,) in single]
    assert order in ([2, 0, 3, 1], [3, 1, 2, 0])


def test_the_next_in_the_ranking_is_the_mirror_image() -> None:
    """Where both sides are asked for the same, the second order is that of the other side."""
    mirror = {0: 1, 1: 0, 2: 3, 3: 2}

    def mirrored(groups: Groups) -> list[set[int]]:
        return [{mirror[foot] for foot in group} for group in groups]

    for first, second in zip(*(footfall_sequences(_feet(QUADRUPED), number) for number in (0, 1)), strict=True):
        assert mirrored(first) == [set(group) for group in second]


def test_some_feet_always_stand() -> None:
    """Of two feet one steps at a time; of three that step beside one that stays, all may; six step as tripods, too."""
    assert [len(groups) for groups in footfall_sequences(_feet(QUADRUPED[:2]))] == [2]
    beside = Feet(QUADRUPED, QUADRUPED + np.outer([1, 1, 1, 0], STEP), (0, 1, 2), np.zeros(2), STEP)
    assert [len(groups) for groups in footfall_sequences(beside)] == [1, 3]
    hexapod = np.array([[x, y] for x in (-0.2, 0.0, 0.2) for y in (-0.1, 0.1)])
    tripods = footfall_sequences(_feet(hexapod, np.array([0.03, 0.0])))[0]
    assert [len(group) for group in tripods] == [3, 3]
    for group in tripods:  # the middle of the body is inside every tripod
        assert beyond_support(np.array([0.015, 0.0]), hexapod[list(group)]) < 0
    assert footfall_sequences(Feet(QUADRUPED, QUADRUPED, (), np.zeros(2), np.zeros(2))) == []
    assert footfall_sequences(_feet(np.random.default_rng(0).normal(size=(MOST_FEET + 1, 2)))) == []
