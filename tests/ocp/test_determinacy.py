"""Postures in which Coulomb's law decides: the rows of the constraint against Pinocchio, and where they hold."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from fesd_robot import load_task
from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import with_bounds_between
from fesd_robot.fesd.refinement.between_stages import STRICTER
from fesd_robot.ocp import formulate
from fesd_robot.ocp.determinacy import DETERMINACY, MARGIN
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.refinement.determinacy import HALF, with_determinate_postures

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module")
def monoped():
    """A robot whose foot slips into the ground in some postures."""
    return formulate(load_task(TASKS / "monoped_three_holes.yaml", ["method.grid=uniform"]))


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
    motion = formulate(
        load_task(TASKS / "published_hopper_one_jump.yaml", ["method.grid=uniform", "ground.friction=0"])
    )
    assert not any(one.name.startswith(DETERMINACY) for one in motion.ocp.constraints)


def test_what_is_held_and_missed_is_held_more_strictly(monoped):
    """In an interval that its replay leaves a closed contact is held in such postures, at once or half of the way; half
    of the way leaves the other half, or half of that; what is held and missed all the same becomes stricter."""
    transcription = Transcription(monoped.ocp, monoped.fesd)
    (number,) = (i for i, one in enumerate(monoped.ocp.constraints) if one.name.startswith(DETERMINACY))
    constraint, n_q = monoped.ocp.constraints[number], monoped.robot.model.nq
    rows, draw = ca.Function("rows", [constraint.variables], [constraint.rows]), np.random.default_rng(0)
    rest = np.zeros(constraint.variables.numel() - n_q)
    postures = draw.uniform(-1.5, 1.5, (200, n_q))
    crouching = min(postures, key=lambda q: float(rows(np.concatenate([q, rest])).full().min()))
    elements = transcription.unpack(transcription.problem.start)
    own = [e for e, element in enumerate(elements) if element.interval == 4]
    for e in own:
        elements[e].x[:, :n_q] = crouching
    conditions = BranchTranscription(transcription).conditions
    factors = ((ActiveFactor.G,) * len(conditions.members),) * len(elements)
    branch = Branch(tuple(conditions.labels), factors, (False,) * len(elements))
    solved = SimpleNamespace(
        replay_among=lambda _: SimpleNamespace(intervals=[SimpleNamespace(interval=4, velocity_error=np.ones(1))]),
        transcription=transcription,
        local_errors=np.zeros(len(elements)),
        on_branch=BranchMotion.of(transcription, transcription.pack(elements), branch),
    )
    whole, half = (finer.motion.transcription.added.paths for finer in with_determinate_postures(solved))
    assert [(one.constraint, one.element, one.margin) for one in whole] == [(number, e, 0.0) for e in own]
    missing = MARGIN - rows(np.concatenate([crouching, rest])).full().min()
    assert [one.margin for one in half] == pytest.approx([-HALF * missing] * len(own))

    for held, margins in (
        (whole, (STRICTER * missing, HALF * STRICTER * missing)),
        (half, (0.0, -(HALF**2) * missing)),
    ):
        solved.on_branch = with_bounds_between(BranchMotion.of(transcription, solved.on_branch.w, branch), held)
        solved.transcription = solved.on_branch.transcription
        for finer, margin in zip(with_determinate_postures(solved), margins, strict=True):
            assert [one.margin for one in finer.motion.transcription.added.paths] == pytest.approx([margin] * len(own))

    solved.local_errors = np.full(len(elements), 1.0)
    assert not list(with_determinate_postures(solved)), (
        "an error of the motion's own explains that the replay leaves it"
    )
