"""The reference of a sequence of jumps: free flight between stances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.reference_motion import LineMotion
from fesd_robot.ocp.reference_types import LONGEST_STANCE
from fesd_robot.task import Task

Load = Callable[[str], Task]
GRAVITY = 9.81
START = np.array([0, 0.6, 0, 0.5])


def jumps(load: Load, short: str, keys: str, count: int = 1, duration: float = 1.0) -> MotionProblem:
    """The short task, 0.6 m high at its start, with a sequence of jumps."""
    horizon = short.replace("duration: 1, intervals: 4", f"duration: {duration}, intervals: {4 * count}")
    return formulate(load(f"{horizon}reference: {{type: jumps, count: {count}, {keys}}}\n"))


def stance_of(motion: MotionProblem) -> float:
    assert isinstance(motion.reference, LineMotion)
    return motion.reference.stance


@pytest.mark.parametrize("count", [1, 5])
def test_the_flight_is_a_free_fall(short: str, load: Load, count: int) -> None:
    """A rise of h takes 2 sqrt(2 h / g); in that time the root falls with g, before and after everything stands."""
    motion = jumps(load, short, "apex: {root_z: 1.1, leg: 0.2}", count, float(count))
    flight = 2 * np.sqrt(2 * 0.5 / GRAVITY)
    assert stance_of(motion) == pytest.approx(1 - flight, abs=1e-12)
    at, speed = motion.reference.configuration, motion.reference.velocity
    for jump in range(count):
        takeoff, middle = jump + 0.5 * (1 - flight), jump + 0.5
        before, after = (np.array([end / count, 0.6, 0, 0.5]) for end in (jump, jump + 1))
        for fraction in (0.0, 0.5, 0.99):
            np.testing.assert_allclose(at(jump + fraction * (takeoff - jump)), before, atol=1e-12)
            np.testing.assert_allclose(speed(jump + fraction * (takeoff - jump)), 0, atol=1e-9)
            np.testing.assert_allclose(at(jump + 1 - fraction * (takeoff - jump)), after, atol=1e-12)
        np.testing.assert_allclose(at(middle), [(jump + 0.5) / count, 1.1, 0, 0.2], atol=1e-12)
        for time in (-0.3, 0.0, 0.2):
            assert at(middle + time)[1] == pytest.approx(1.1 - 0.5 * GRAVITY * time**2, abs=1e-12)
            assert speed(middle + time)[1] == pytest.approx(-GRAVITY * time, abs=1e-4)
            assert speed(middle + time)[0] == pytest.approx(1 / (count * flight), abs=1e-6)


def test_without_stance_a_jump_takes_all_its_time(short: str, load: Load) -> None:
    """With stance 0 the jump is one parabola over the whole line: q = line(t) + (apex - start) 4 t (1 - t)."""
    motion = jumps(load, short, "apex: {root_z: 1.1, leg: 0.2}, stance: 0")
    for time in np.linspace(0, 1, 21):
        expected = np.array([time, 0.6, 0, 0.5]) + 4 * time * (1 - time) * np.array([0, 0.5, 0, -0.3])
        np.testing.assert_allclose(motion.reference.configuration(time), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("keys", "duration", "stance"),
    [
        ("apex: {root_z: 1.1}, stance: 0.5", 1.0, 0.5),
        ("apex: {leg: 0.2}", 1.0, 0.0),
        ("apex: {root_z: 0.6, leg: 0.2}", 1.0, LONGEST_STANCE),
        ("apex: {root_z: 0.5}", 1.0, LONGEST_STANCE),
        ("apex: {root_z: 1.1}", 0.5, 0.0),
    ],
    ids=["given", "no height", "no rise", "a fall", "no time"],
)
def test_where_nothing_is_left_of_a_free_fall(
    short: str, load: Load, keys: str, duration: float, stance: float
) -> None:
    """A given stance wins; without an apex of the root there is none; a flight has from a fifth to all of a jump."""
    motion = jumps(load, short, keys, duration=duration)
    assert stance_of(motion) == pytest.approx(stance, abs=1e-12)
    for time in np.linspace(0, 1, 41):
        assert np.isfinite(motion.reference.configuration(time)).all()
    np.testing.assert_allclose(motion.reference.configuration(0), START, atol=1e-12)
    np.testing.assert_allclose(motion.reference.configuration(duration), START + np.array([1, 0, 0, 0]), atol=1e-12)
