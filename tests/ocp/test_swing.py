"""A foot that swings is high: the gap that its speed asks for, against closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.task import SwingClearance, Task

from .pinocchio_points import constraint, frame, rows, states

Load = Callable[[str], Task]

SWING = "constraints: {up: {type: swing_clearance, contacts: [foot], height: 0.04, speed: 0.25}}\n"


def test_rows_are_the_gap_that_the_speed_asks_for(short: str, load: Load) -> None:
    """On a slope the gap and the speed along it are those of Pinocchio's kinematics of the foot."""
    path = constraint(formulate(load(short + "ground: {height: -0.3, slope: 0.1}\n" + SWING)), "up")
    assert (path.kind, path.lower.tolist(), path.upper.tolist()) == ("path", [0.0], [np.inf])
    rest = np.zeros(path.variables.numel() - 10)
    along = np.array([np.cos(0.1), 0, np.sin(0.1)])
    for x in states():
        motion = formulate(load(short))
        position, velocity, _ = frame(motion.robot, "foot", x[:4], x[4:8])
        gap = (position[2] + 0.3) * np.cos(0.1) - position[0] * np.sin(0.1)
        square = (along @ velocity) ** 2
        expected = gap - 0.04 * (square - 0.0625) / (square + 0.0625)
        assert rows(path, x, rest) == pytest.approx([expected], abs=1e-9)


@pytest.mark.parametrize(("ratio", "part"), [(0.0, -1.0), (1.0, 0.0), (2.0, 0.6), (3.0, 0.8), (5.0, 0.923), (1e3, 1.0)])
def test_what_is_asked_at_a_multiple_of_the_speed(short: str, load: Load, ratio: float, part: float) -> None:
    """Nothing up to the speed, so that stance is no bound; 0.6, 0.8 and 0.92 of the height at 2, 3 and 5 times it."""
    path = constraint(formulate(load(short + SWING)), "up")
    x = np.concatenate([[0, 0.5, 0, 0.5], [0.25 * ratio, 0, 0, 0], np.zeros(path.variables.numel() - 8)])
    assert rows(path, x) == pytest.approx([-part * 0.04], abs=1e-4)


def test_the_speed_is_a_tenth_of_the_robots(short: str, load: Load) -> None:
    """Without a speed it is 0.1 sqrt(g l) with the robot's length l, and the plan's task has the number."""
    motion = formulate(load(short + SWING.replace(", speed: 0.25", "")))
    swing = motion.task.constraints["up"]
    assert isinstance(swing, SwingClearance) and swing.speed is not None
    assert swing.speed == pytest.approx(0.1 * np.sqrt(9.81 * motion.scales.length), rel=1e-2)


def test_contacts_of_a_swing_exist(short: str, load: Load) -> None:
    """A name that is no contact is an error at its place in the list."""
    with pytest.raises(TaskError) as caught:
        formulate(load(short + SWING.replace("[foot]", "[foot, hand]")))
    assert caught.value.key == "constraints.up.contacts.1"
    assert "found 'hand', expected a contact" in caught.value.message
