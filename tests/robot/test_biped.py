"""The biped is what its file says: 30 kg on two equal legs, whose feet are where a closed form puts them."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.robot import Robot, frame_placement, load_robot
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]
LINK = 0.4


@pytest.fixture(scope="module")
def biped() -> Robot:
    return load_robot(ROOT / "models/biped/biped.urdf", root="sagittal")


def _foot(robot: Robot, q: list[float], side: str) -> np.ndarray:
    symbol = ca.SX.sym("q", 7)
    _, position = frame_placement(robot, symbol, f"{side}_foot")
    return np.asarray(ca.Function("foot", [symbol], [position])(q).full()).ravel()[[0, 2]]


def test_coordinates_and_mass(biped: Robot) -> None:
    """Three coordinates of the torso and four of the legs; 30 kg, more than half of them in the torso."""
    legs = ["left_hip", "left_knee", "right_hip", "right_knee"]
    assert list(biped.configuration_names) == ["root_x", "root_z", "root_pitch", *legs]
    assert pin.computeTotalMass(biped.model) == pytest.approx(30)
    assert max(inertia.mass for inertia in biped.model.inertias) == pytest.approx(18)


@pytest.mark.parametrize("side", ["left", "right"])
def test_feet(biped: Robot, side: str) -> None:
    """A straight leg reaches 0.8 m down; with a = pitch + hip and b = a + knee the foot is where the file says."""
    assert _foot(biped, [0] * 7, side) == pytest.approx([0, -2 * LINK], abs=1e-15)
    x, z, pitch, hip, knee = 0.3, 0.7, 0.1, -0.5, 0.8
    legs = [hip, knee, 0, 0] if side == "left" else [0, 0, hip, knee]
    a, b = pitch + hip, pitch + hip + knee
    expected = [x - LINK * (np.sin(a) + np.sin(b)), z - LINK * (np.cos(a) + np.cos(b))]
    assert _foot(biped, [x, z, pitch, *legs], side) == pytest.approx(expected, abs=1e-12)


def test_the_step_begins_and_ends_on_both_feet(biped: Robot) -> None:
    """Start and goal of the task stand on the ground within a millimetre; the left foot stays, the right one swings."""
    task = load_task(ROOT / "tasks/biped_step.yaml")
    start, goal = (
        [part.configuration.get(name, 0.0) for name in biped.configuration_names] for part in (task.initial, task.goal)
    )
    left, right = ([_foot(biped, q, side) for q in (start, goal)] for side in ("left", "right"))
    assert np.abs([foot[1] for foot in (*left, *right)]).max() < 1e-3
    assert left[1][0] == pytest.approx(left[0][0], abs=5e-3)
    assert right[1][0] - right[0][0] > 0.45
