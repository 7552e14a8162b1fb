"""The branch of the robot that is let go has the modes of that motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.contact import contact_modes
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import MotionProblem, formulate, numeric_physics
from fesd_robot.simulation import ControlSchedule
from fesd_robot.simulation.drive import drive
from fesd_robot.starts import needs_simulated_start
from fesd_robot.starts.simulated import _Known
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


def formulated(task: str, *overrides: str) -> MotionProblem:
    """A shipped task on a grid that stands still."""
    return formulate(load_task(TASKS / f"{task}.yaml", ["method.grid=uniform", *overrides]))


@pytest.mark.parametrize("task", ["solo12_jump", "hopper_in_space"])
def test_the_branch_has_the_modes_of_the_motion(task: str) -> None:
    """In every element in which the clock runs each contact has the mode of its piece; the others are the impacts."""
    motion = formulated(task, "ground.restitution=0.2")
    physics, ends = numeric_physics(motion), motion.endpoints
    schedule = ControlSchedule(np.array([0.0, motion.grid.nominal]), np.zeros((1, len(motion.actuation.names))))
    driven = drive(physics, ends.initial_configuration, ends.initial_velocity, schedule)
    transcription = Transcription(motion.ocp, motion.fesd)
    known = _Known(motion, transcription, physics, driven).elements()
    modes = [tuple(contact_modes(known.branch, e).values()) for e in range(len(known.elements))]
    running = [own for own in modes if not any(mode.hits for mode in own)]
    assert running == [piece.contacts.modes for piece in driven.pieces]
    assert len(modes) - len(running) == len(driven.hits)


def test_only_bounces_that_stop_the_clock_have_a_simulated_start() -> None:
    """A ball that bounces begins with its fall; an impulse between elements is no element to begin with."""
    assert needs_simulated_start(formulated("ball_bat"))
    assert not needs_simulated_start(formulated("ball_bat", "method.contact=impulses"))
    assert not needs_simulated_start(formulated("hopper_one_jump"))
