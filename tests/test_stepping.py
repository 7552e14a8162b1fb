"""Guesses in which feet step in turn, and the motions that begin with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import load_task
from fesd_robot.adapters import homotopy_options, motion_outcome
from fesd_robot.fesd import Transcription
from fesd_robot.guessed_sequence import stepping_start
from fesd_robot.mpcc import NlpReport
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.stepping import STANDS, Stepping, steppings
from fesd_robot.strategies.deadline import Deadline
from tests.quadruped_in_space import LEGS, standing

TROT = (
    standing("steps", "{duration: 0.8, intervals: 8}")
    + "goal: {configuration: {root_joint.x: 0.06, root_joint.y: 0.03}, stand_on: [FL, FR, HL, HR]}\n"
    "constraints: {swing: {type: swing_clearance, contacts: [FL, FR, HL, HR], height: 0.02}}\n"
)


def _formulated(folder: Path, *changes: str) -> MotionProblem:
    file = folder / "steps.yaml"
    file.write_text(TROT, encoding="utf-8")
    return formulate(load_task(file, ["method.grid=uniform", *list(changes)]))


def _stiff(folder: Path) -> MotionProblem:
    """The same robot without joints, so that it could only slide."""
    angles = {"HAA": 0.0, "HFE": 0.7, "KFE": -1.4}
    locked = ", ".join(f"{leg}_{joint}: {angle}" for leg in LEGS for joint, angle in angles.items())
    file = folder / "stiff.yaml"
    file.write_text(TROT, encoding="utf-8")
    changes = [f"robot.locked={{{locked}}}", "initial={stand_on: [FL, FR, HL, HR]}"]
    return formulate(load_task(file, ["method.grid=uniform", *changes]), driven=False)


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> MotionProblem:
    """Solo12 with all of its joints goes 6 cm forward and 3 cm to its left."""
    return _formulated(tmp_path_factory.mktemp("steps"))


@pytest.fixture(scope="module", params=(0, 1), ids=("pairs", "single"))
def stepping(motion: MotionProblem, request: pytest.FixtureRequest) -> Stepping:
    """One of the orders in which its feet may step."""
    return steppings(motion)[request.param]


def _feet_at(stepping: Stepping, q: np.ndarray) -> np.ndarray:
    model = stepping.motion.robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.array([data.oMf[model.getFrameId(f"{leg}_FOOT")].translation for leg in LEGS])


def test_feet_stand_still_or_swing(stepping: Stepping) -> None:
    """Where a foot touches it is where it stood to a micrometre and has no velocity; where it does not it is higher.

    In the middle of every interval, by Pinocchio's kinematics; it begins and ends where it stands at start and goal.
    """
    model, grid = stepping.motion.robot.model, stepping.motion.grid
    start, goal = _feet_at(stepping, stepping.configuration(0.0)), _feet_at(stepping, stepping.configuration(0.8))
    np.testing.assert_allclose(goal - start, np.tile([0.06, 0.03, 0.0], (4, 1)), atol=1e-6)
    for interval, own in enumerate(stepping.touching):
        time = (interval + 0.5) * grid.nominal / grid.intervals
        q, v = np.split(stepping.state(time), [model.nq])
        data = model.createData()
        pin.forwardKinematics(model, data, q, v)
        for foot, place in enumerate(_feet_at(stepping, q)):
            if own[foot]:
                rest = start[foot] if stepping.touching[: interval + 1, foot].all() else goal[foot]
                np.testing.assert_allclose(place, rest, atol=1e-6)
                frame = model.getFrameId(f"{LEGS[foot]}_FOOT")
                moving = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
                np.testing.assert_allclose(moving.linear, 0.0, atol=1e-5)
            else:
                assert place[2] > STANDS


def test_every_foot_swings_once_and_some_always_stand(stepping: Stepping) -> None:
    """All stand in the first and in the last interval, and never do all swing."""
    touching = stepping.touching.astype(int)
    assert touching[0].all() and touching[-1].all() and touching.any(axis=1).all()
    assert (np.diff(touching, axis=0) == -1).sum(axis=0).tolist() == [1, 1, 1, 1]


def test_the_order_turns_with_the_robot(motion: MotionProblem, tmp_path: Path) -> None:
    """A robot that faces another way and goes as far ahead and to its left steps in the same order."""
    ahead, left = np.array([np.cos(2.0), np.sin(2.0)]), np.array([-np.sin(2.0), np.cos(2.0)])
    x, y = 0.06 * ahead + 0.03 * left
    place = (f"goal.configuration.root_joint.{axis}={value}" for axis, value in zip("xy", (x, y), strict=True))
    turned = _formulated(
        tmp_path, "initial.configuration.root_joint.yaw=2.0", "goal.configuration.root_joint.yaw=2.0", *place
    )
    assert [one.order for one in steppings(turned)] == [one.order for one in steppings(motion)]


def test_not_everything_steps(tmp_path: Path) -> None:
    """Where feet leave the ground in the reference, end where they stand, or have no joints, they do not step."""
    jump = _formulated(tmp_path, "reference={type: jumps, count: 1, apex: {root_joint.z: 0.32}}")
    transcription = Transcription(jump.ocp, jump.fesd)
    assert stepping_start(jump, transcription, homotopy_options(jump.task), Deadline(None), None, None) is None
    assert steppings(_formulated(tmp_path, "goal.configuration={root_joint.x: 0.002}")) == []
    assert steppings(_stiff(tmp_path)) == []


def test_the_first_motion_is_two_steps_of_a_trot(motion: MotionProblem) -> None:
    """Exact, without relaxation; every foot flies once and lands 5 cm further on, diagonal feet together.

    The first pair has landed before the second leaves the ground.
    """
    transcription, reports = Transcription(motion.ocp, motion.fesd), list[NlpReport]()
    options = homotopy_options(motion.task)
    found = stepping_start(motion, transcription, options, Deadline(None), reports.append, None)
    assert found and found[1].exact and found[1].residuals.complementarity <= 1e-9
    assert reports and all(report.sigma == 0 for report in reports)
    solved = SolvedMotion.of(motion, *found)
    outcome = motion_outcome(motion, solved.physical, solved.physics)
    flights = {name: contact.flights for name, contact in outcome.contacts.items()}
    assert all(len(own) == 1 and own[0].length > 0.05 and own[0].height > 0.01 for own in flights.values())
    for one, other in (("FL", "HR"), ("FR", "HL")):
        assert min(flights[one][0].end, flights[other][0].end) > max(flights[one][0].start, flights[other][0].start)
    landed = max(flights[name][0].end for name in ("FL", "HR"))
    assert min(flights[name][0].start for name in ("FR", "HL")) >= landed - 1e-9


def test_a_long_way_takes_several_steps(tmp_path: Path) -> None:
    """Where one step is out of reach every foot takes two, half as long, and lands in between in the middle of it."""
    far = _formulated(tmp_path, "goal.configuration={root_joint.x: 0.5}", "horizon={duration: 1.2, intervals: 20}")
    one = steppings(far)[0]
    touching = one.touching.astype(int)
    assert (np.diff(touching, axis=0) == -1).sum(axis=0).tolist() == [2, 2, 2, 2]
    landed = one.swings[len(one.groups) // 2 - 1][1] * far.grid.nominal / far.grid.intervals
    way = _feet_at(one, one.configuration(landed)) - _feet_at(one, one.configuration(0.0))
    np.testing.assert_allclose(way, np.tile([0.25, 0.0, 0.0], (4, 1)), atol=1e-6)
