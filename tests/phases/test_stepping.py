"""Guesses in which feet step in turn, and the sequences of phases that begin with them."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import load_task
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.phases import guessed_sequences
from fesd_robot.phases.stepping import STANDS, Stepping, steppings
from tests.quadruped_in_space import LEGS, standing

TROT = (
    standing("steps", "{duration: 0.8, intervals: 8}")
    + "goal: {configuration: {root_joint.x: 0.06, root_joint.y: 0.03}, stand_on: [FL, FR, HL, HR]}\n"
    "constraints: {swing: {type: swing_clearance, contacts: [FL, FR, HL, HR], height: 0.02}}\n"
)


def _formulated(folder: Path, *changes: str) -> MotionProblem:
    file = folder / "steps.yaml"
    file.write_text(TROT, encoding="utf-8")
    return formulate(load_task(file, ["method.grid=uniform", *changes]))


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
    jump = _formulated(tmp_path, "method.grid=phases", "reference={type: jumps, count: 1, apex: {root_joint.z: 0.32}}")
    assert all("FFFF" in str(sequence).split() for sequence in guessed_sequences(jump))
    assert steppings(_formulated(tmp_path, "goal.configuration={root_joint.x: 0.002}")) == []
    assert steppings(_stiff(tmp_path)) == []


def test_the_likeliest_sequence_is_two_steps_of_a_trot(tmp_path: Path) -> None:
    """Diagonal feet fly together, once, and the others leave the ground as they land, with impacts or softly."""
    found = [str(one) for one in guessed_sequences(_formulated(tmp_path, "method.grid=phases"))][:2]
    for words, hit in zip(found, ("!", ""), strict=True):
        assert words in (f"SSSS {one} {hit}{other} {hit}SSSS" for one, other in permutations(("FSSF", "SFFS")))


def test_feet_step_over_a_trench_as_on_a_plane(motion: MotionProblem, tmp_path: Path) -> None:
    """The line from start to goal takes the front feet over a trench; the first sequence is that of level ground."""
    places = np.arange(-0.5, 0.61, 0.01)
    heights = -0.02 * np.maximum(0.0, 1 - ((places - 0.22) / 0.05) ** 2) ** 3
    rows = "\n".join(f"{x:.3f},{z:.5f}" for x, z in zip(places, heights, strict=True))
    (tmp_path / "trench.csv").write_text(f"x,z\n{rows}\n", encoding="utf-8")
    standing = "stand_on={contacts: [FL, FR, HL, HR], adjust: [root_joint.z, FL_KFE, FR_KFE, HL_KFE, HR_KFE]}"
    ground = "ground={type: height_map, file: trench.csv, friction: 0.7}"
    across = _formulated(tmp_path, ground, f"initial.{standing}", f"goal.{standing}")
    assert next(guessed_sequences(across)).key == next(guessed_sequences(motion)).key
