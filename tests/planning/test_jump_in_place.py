"""A jump on the spot is made: nothing but its apex asks for it, and standing would cost less effort."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import explain, load_task, plan
from fesd_robot.ocp import formulate

BIPED = Path(__file__).parents[2] / "models" / "biped" / "biped.urdf"

LEGS = """
name: squat_jump
robot: {model: robot.urdf, root: sagittal}
ground: {friction: 0.8}
contacts: {left: {frame: left_foot}, right: {frame: right_foot}}
horizon: {duration: 1, intervals: 20}
initial:
  configuration: {left_hip: -0.5, left_knee: 0.6, right_hip: -0.1, right_knee: 0.6}
  stand_on: {contacts: [left, right], adjust: [root_z, right_knee]}
goal:
  configuration: {root_x: 0, left_hip: -0.5, left_knee: 0.6, right_hip: -0.1}
  stand_on: {contacts: [left, right], adjust: [root_z, right_knee]}
reference: {type: jumps, count: 1, apex: {root_z: 1.0}}
output: {page: false, figures: false}
"""

UNISON = """
name: squat_unison
robot: {model: robot.urdf, root: sagittal, coupled: {right_hip: left_hip, right_knee: left_knee}}
contacts: {feet: {frame: left_foot}}
ground: {friction: 0.8}
horizon: {duration: 1, intervals: 20}
initial: {configuration: {left_hip: -0.6, left_knee: 1.2}, stand_on: [feet]}
goal: {configuration: {root_x: 0, left_hip: -0.6, left_knee: 1.2}, stand_on: [feet]}
reference: {type: jumps, count: 1, apex: {root_z: 1.0}}
output: {page: false, figures: false}
"""


def written(folder: Path, text: str) -> Path:
    (folder / "robot.urdf").write_text(BIPED.read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "jump.yaml").write_text(text, encoding="utf-8")
    return folder / "jump.yaml"


@pytest.mark.parametrize("text", [UNISON, LEGS])
def test_a_biped_jumps_on_the_spot(tmp_path: Path, text: str) -> None:
    """It rises by at least 0.7 of what is asked, flies about as long as a throw of that height, and lands once."""
    found = plan(load_task(written(tmp_path, text)))
    height = found.trajectory.configuration["root_z"]
    asked = 1.0 - height[0]
    assert found.status.solved and height.max() - height[0] >= 0.7 * asked and height.max() < 1.05
    assert found.outcome is not None
    for contact in found.outcome.contacts.values():
        longest = max(contact.flights, key=lambda flight: flight.end - flight.start)
        assert longest.end - longest.start == pytest.approx(np.sqrt(8 * asked / 9.81), rel=0.2)
        assert longest.height > 0.5 * asked


def test_the_apex_of_a_jump_in_place_is_a_goal(tmp_path: Path) -> None:
    """To miss it by its height costs 100 a second, as a goal does; one that leads elsewhere keeps the robot's unit."""
    task = load_task(written(tmp_path, UNISON))
    motion = formulate(task)
    rise = 1.0 - motion.endpoints.initial_configuration[motion.robot.configuration_names.index("root_z")]
    assert (motion.task.costs.configuration or {})["root_z"] == pytest.approx(100 / rise**2, rel=5e-3)
    assert "nothing but its apex asks for it" in " ".join(explain(task).split())
    away = (
        formulate(load_task(tmp_path / "jump.yaml", ["goal.configuration.root_x=0.3"])).task.costs.configuration or {}
    )
    assert away["root_z"] == away["root_x"]
