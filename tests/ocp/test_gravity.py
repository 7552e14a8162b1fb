"""Gravity of a task: everything falls with it, in plans and in simulations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import load_task, simulate
from fesd_robot.errors import TaskError
from fesd_robot.explanation import explanation
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate

MODELS = Path(__file__).parents[2] / "models"

LIFTED = 0.9
"""kg; the carriage and both fingers, which the held joint of the gripper carries."""

TASK = f"""name: thrown
robot: {{model: {MODELS}/gripper/gripper.urdf, locked: {{box_x: 2, box_z: 1, box_pitch: 0, lift: 0}}}}
bodies:
  ball: {{type: ball, radius: 0.1, mass: 0.4, root: sagittal}}
contacts: {{touch: {{body: ball}}}}
horizon: {{duration: 1, intervals: 4}}
initial: {{configuration: {{ball.root_z: 5}}, velocity: {{ball.root_x: 1, ball.root_pitch: 2}}}}
goal: {{soft: true}}
"""


def written(folder: Path, gravity: str) -> Path:
    """Write the task with a line about gravity."""
    file = folder / "task.yaml"
    file.write_text(TASK + gravity, encoding="utf-8")
    return file


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -1.62), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_body_falls_as_the_task_says(tmp_path: Path, gravity: tuple[float, float, float]) -> None:
    """A thrown ball is at x0 + v t + g t^2 / 2 after a second, and keeps its spin."""
    motion = simulate(load_task(written(tmp_path, f"gravity: {list(gravity)}\n")))
    end = {name: values[-1] for name, values in motion.trajectory.configuration.items()}
    assert end["ball.root_x"] == pytest.approx(1 + gravity[0] / 2, abs=1e-8)
    assert end["ball.root_z"] == pytest.approx(5 + gravity[2] / 2, abs=1e-8)
    assert end["ball.root_pitch"] == pytest.approx(2, abs=1e-8)
    assert motion.full_model is not None
    assert motion.full_model.joints["lift"].effort[0] == pytest.approx(-LIFTED * gravity[2], abs=1e-9)


@pytest.mark.parametrize(
    ("gravity", "fragment"),
    [
        ("gravity: 9.81", "three numbers"),
        ("gravity: [0, 0]", "three numbers"),
        ("gravity: [0, 0, .nan]", "three finite numbers"),
        ("gravity: {z: -9.81}", "three numbers"),
    ],
)
def test_a_mistake_is_one_sentence(tmp_path: Path, gravity: str, fragment: str) -> None:
    """What is no acceleration is named by file, line and key."""
    with pytest.raises(TaskError, match=rf"task.yaml:\d+: gravity: .*{fragment}"):
        load_task(written(tmp_path, gravity))


def test_check_says_how_things_fall(tmp_path: Path) -> None:
    """Gravity is described where it is not the usual one, and contacts have an auxiliary force without it, too."""
    for line, said in (
        ("", ""),
        ("gravity: [0, 0, 0]\n", "Gravity: none."),
        ("gravity: [0, 0, -1.62]\n", "Gravity: [0, 0, -1.62] m/s2 along x, y and z."),
    ):
        motion = formulate(load_task(written(tmp_path, line), ["method.grid=uniform"]))
        words = explanation(motion, Transcription(motion.ocp, motion.fesd).problem)
        assert said in " ".join(words.split()) and ("Gravity" in words) == bool(said)
    assert np.isfinite(motion.contact_system.system.algebraic_lower).all()
