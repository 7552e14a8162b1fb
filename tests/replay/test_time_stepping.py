"""The replay of real plans' intervals against Moreau's time stepping."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.task import load_task

from .moreau import step_through

TASKS = Path(__file__).parents[2] / "tasks"
STATES = json.loads((Path(__file__).parent / "states.json").read_text(encoding="utf-8"))
"""State at the start of an interval of a plan, its controls, and its duration, s."""


@functools.cache
def physics_of(name: str) -> NumericPhysics:
    return numeric_physics(formulate(load_task(TASKS / f"{name}.yaml")))


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES, ids=[f"{state['task']}-{state['interval']}" for state in STATES])
def test_time_stepping_comes_to_the_same_end(state: dict) -> None:
    """Steps of 1e-5 s, which know no events and no modes, end where the replay does: landing, slipping, sticking."""
    physics, q, v, u = physics_of(state["task"]), *(np.array(state[key]) for key in "qvu")
    result = replay_motion(physics, q, v, u, state["duration"])
    configuration, velocity = step_through(physics, q, v, u, state["duration"], 1e-5)
    np.testing.assert_allclose(physics.difference(result.configuration, configuration), 0, atol=1e-4)
    np.testing.assert_allclose(result.velocity, velocity, atol=1e-2)
    assert not result.notes
