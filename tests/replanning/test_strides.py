"""Gaits that are planned again stride by stride."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot import plan
from fesd_robot.errors import PlanFileError
from fesd_robot.fesd import Span
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning.replanner import Replanner
from fesd_robot.replanning.strides import Strides
from fesd_robot.starts import kept_motion
from fesd_robot.task import load_task

pytestmark = pytest.mark.slow

TASKS = Path(__file__).parents[2] / "tasks"
DRIFT = 1e-4
"""m; up to which integrated gaps differ at the ends of a gait that was planned quickly."""


@pytest.fixture(scope="module", params=["solo12_bound"])
def gait(request: pytest.FixtureRequest) -> tuple[Plan, MotionProblem]:
    """A gait, planned quickly."""
    found = plan(load_task(TASKS / f"{request.param}.yaml", ["solver.effort=quick", "output.page=false"]))
    assert found.status.solved
    return found, formulate(task_of(found))


@pytest.fixture(scope="module")
def strides(gait: tuple[Plan, MotionProblem]) -> Strides:
    found = kept_motion(*gait)
    assert found is not None
    return Strides(found, gait[1], 3)


def test_strides_are_one_motion(gait: tuple[Plan, MotionProblem], strides: Strides) -> None:
    plan, motion = gait
    own = strides.motion
    bounds, problem = own.polisher.bounds(own.branch), own.polisher.problem
    rows = np.concatenate([block.evaluate(own.w)[1].ravel(order="F") for block in problem.blocks])
    assert max((bounds.g_lower - rows).max(), (rows - bounds.g_upper).max()) < DRIFT
    assert max((bounds.lower - own.w).max(), (own.w - bounds.upper).max()) < DRIFT
    found = kept_motion(plan, motion)
    assert found is not None
    costs, of_plan = (sum(each.transcription.cost_terms(each.w).values()) for each in (own, found))
    assert costs == pytest.approx(3 * strides.plans * of_plan, rel=1e-6)
    assert own.elements[-1].x[-1][: len(strides.advance)] == pytest.approx(
        own.elements[0].x_before[: len(strides.advance)] + 3 * strides.advance, abs=1e-9
    )


def test_a_shifted_gait_is_the_same_gait(strides: Strides) -> None:
    own, settled = strides.motion.w, strides.horizon.settled
    shifted = strides.shifted(replace(settled, x=own)).x
    indices = strides.motion.transcription.indices
    start, begin = indices.state(0), len(indices.point(0))  # the multipliers of contacts at the start mean nothing
    first = own.size - (own.size - begin) // 3
    assert np.abs(shifted - own)[[*start, *range(begin, first)]].max() < DRIFT
    assert np.array_equal(shifted[first:], settled.x[first:])
    assert np.abs(settled.x - own).max() > DRIFT, "the comparison above would see the gait take the settled one's place"


def test_multipliers_move_with_what_they_belong_to(strides: Strides) -> None:
    horizon, problem = strides.horizon, strides.motion.polisher.problem
    labels = [block.constraint_label(row, copy) for block in problem.blocks
              for copy in range(block.copies) for row in range(len(block.lower))]  # fmt: skip
    first = 1e6  # multipliers that stay are smaller
    moved = strides.shifted(replace(horizon.settled, lam=first + np.arange(len(horizon.settled.lam)))).lam - first
    rows, intervals = horizon.solver.bounded_rows, strides.motion.transcription.grid.intervals // 3
    kept = 0
    for row, source in zip(rows, moved, strict=True):
        if source < 0:
            continue
        own, other = labels[row], labels[rows[round(source)]]
        assert own.place.interval is not None
        assert other.place == replace(own.place, interval=own.place.interval + intervals)
        assert (own.kind, own.subject, own.contact) == (other.kind, other.subject, other.contact)
        kept += 1
    assert kept > 0.6 * len(rows)


@pytest.fixture(scope="module")
def replanner(gait: tuple[Plan, MotionProblem]) -> Replanner:
    return Replanner(gait[0], motion=gait[1])


def test_what_one_update_does_not_reach_the_next_ones_do(replanner: Replanner, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least push that is too far for an update of two steps is met by those that follow, which begin nearer."""
    monkeypatch.setattr(replanner, "_iterations", 2)
    strides = replanner.strides
    assert strides is not None
    n_q = len(strides.advance)
    start = strides.motion.elements[0].x_before
    push, first = 0.05, "kept"
    while first == "kept":
        push *= 1.2
        replanner.reset()
        first = replanner.update(0.0, start[:n_q], start[n_q : 2 * n_q] + push).status
    statuses = []
    for _ in range(9):
        replanner.prepare(0.0)
        statuses.append(replanner.update(0.0, start[:n_q], start[n_q : 2 * n_q] + push).status)
    assert statuses[-1] == "kept"


def test_a_gait_goes_on(replanner: Replanner) -> None:
    """Five strides in which the robot is where the policy says."""
    replanner.reset()
    replanner.statistics.updates.clear()
    strides = replanner.strides
    assert strides is not None
    n_q = len(strides.advance)
    start = strides.motion.elements[0].x_before
    q, v = start[:n_q], start[n_q : 2 * n_q]
    for time in np.arange(0.0, 5 * strides.duration, replanner.period):
        if time:
            replanner.prepare()
        policy = replanner.update(float(time), q, v)
        assert policy.begin == pytest.approx(time)
        q, v = policy.reference(float(time) + replanner.period)
    updates = replanner.statistics.updates
    assert np.mean([update.status == "kept" for update in updates]) > 0.95
    assert q[0] - start[0] == pytest.approx(5 * strides.advance[0], abs=0.02)


def test_constraints_in_a_part_of_a_gait_are_refused(gait: tuple[Plan, MotionProblem]) -> None:
    plan, motion = gait
    found = kept_motion(plan, motion)
    assert found is not None
    first, *others = motion.ocp.constraints
    part = replace(first, intervals=Span(0.0, float(found.transcription.grid.nodes[3])))
    moved = found.with_numbers(replace(motion.ocp, constraints=[part, *others]))
    with pytest.raises(PlanFileError, match="in a part of a gait"):
        Strides(moved, motion)
