"""Postures in which Coulomb's law decides: the rows of the constraint against Pinocchio, and where they hold."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot import load_task
from fesd_robot.adapters import numeric_physics
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.ocp.determinacy import DETERMINACY, MARGIN

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module")
def monoped():
    """A robot whose foot slips into the ground in some postures."""
    return formulate(load_task(TASKS / "monoped_three_holes.yaml"))


def test_rows_are_the_ratio_of_accelerations(monoped):
    """1 -+ mu W_nt / W_nn with Pinocchio's numbers, which is negative somewhere and 1 on a straight leg."""
    (constraint,) = (one for one in monoped.ocp.constraints if one.name.startswith(DETERMINACY))
    physics, rows = numeric_physics(monoped), ca.Function("rows", [constraint.variables], [constraint.rows])
    draw, n_q = np.random.default_rng(0), monoped.robot.model.nq
    lowest = np.inf
    for _ in range(200):
        q = draw.uniform(-1.5, 1.5, n_q)
        jacobian = physics.contact_jacobian(q)
        delassus = jacobian @ np.linalg.solve(physics.mass_matrix(q), jacobian.T)
        ratio = physics.friction[0] * delassus[0, 1] / delassus[0, 0]
        own = rows(np.concatenate([q, np.zeros(constraint.variables.numel() - n_q)])).full().ravel()
        assert own == pytest.approx([1 - ratio, 1 + ratio], rel=1e-9)
        lowest = min(lowest, *own)
    assert lowest < 0 < MARGIN
    assert (constraint.lower == MARGIN).all()


def test_they_hold_on_request_only(monoped):
    """Without refinement the problem has no row of them."""
    problem = Transcription(monoped.ocp, monoped.fesd).problem
    assert not any(DETERMINACY in str(label) for block in problem.blocks for label in block.constraints)


def test_a_contact_without_friction_needs_none():
    """Without friction there is nothing to decide."""
    motion = formulate(load_task(TASKS / "published_hopper_one_jump.yaml", ["ground.friction=0"]))
    assert not any(one.name.startswith(DETERMINACY) for one in motion.ocp.constraints)
