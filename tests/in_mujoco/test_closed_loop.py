"""Plans that are solved again while they run in MuJoCo, and what may be different from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.in_mujoco import (
    Deviation,
    Disturbance,
    MujocoScene,
    Noise,
    OpenLoop,
    Perturbation,
    Push,
    Replanning,
    Replay,
    mujoco_scene,
    replay,
    run,
    write_replay,
)
from fesd_robot.in_mujoco.controllers import controller_of
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.replanning import MovedGoal

PUSHED = Perturbation(disturbance=Disturbance(pushes=(Push(0.05, (0.05, 0.0, 0.0)),)))


@pytest.fixture(scope="module")
def found(jump: Plan, motion: MotionProblem) -> Replay:
    """The jump with the LQR and replanned, pushed before it lands."""
    return replay(jump, ["lqr", "replan"], different=PUSHED, motion=motion)


def test_every_run_is_the_same(jump: Plan, motion: MotionProblem, found: Replay) -> None:
    """The simulator waits for updates, so that a run does not depend on how long they take."""
    again = replay(jump, ["replan"], different=PUSHED, motion=motion)
    assert np.array_equal(again.runs[0].record.configuration, found.runs[1].record.configuration)


def test_what_is_written(found: Replay, tmp_path: Path) -> None:
    """Entries have pushes, times and shares of updates; report and page say them."""
    write_replay(found, tmp_path)
    lqr, replanned = json.loads((tmp_path / "replay.json").read_text(encoding="utf-8"))
    assert lqr["replanning"] is None
    for entry in (lqr, replanned):
        assert entry["pushes"] == [{"time": 0.05, "velocity": [0.05, 0.0, 0.0], "duration": 0.01}]
        assert (entry["mass"], entry["friction"]) == (1.0, 1.0)
    told = replanned["replanning"]
    assert (told["period"], told["real_time"], told["goals"], told["updates"]) == (0.01, False, [], 100)
    assert sum(told["status"].values()) == pytest.approx(1.0) and set(told["status"]) <= {"kept", "changed", "old"}
    assert told["status"]["kept"] > 0.8 and 0.0 <= told["exact_at_once"] <= 1.0
    for key in ("feedback_seconds", "prepare_seconds"):
        assert 0.0 < told[key]["median"] <= told[key]["percentile_99"]
    report = (tmp_path / "replay.md").read_text(encoding="utf-8")
    assert "Different from the plan: pushed by 0.05 m/s at 0.05 s.\n" in report
    assert "Every 10 ms, the simulator waited: " in report
    page = (tmp_path / "replay_replan.html").read_text(encoding="utf-8")
    assert '"text":"pushed by 0.05 m/s at 0.05 s"' in page and "pushes (1)" in page
    assert "of 100 updates kept the sequence" in page


def test_the_jump_arrives(found: Replay) -> None:
    """With a small push both controllers bring it to its goal."""
    assert all(each.deviation.finished for each in found.runs)


def test_a_goal_that_moves(jump: Plan, motion: MotionProblem) -> None:
    """Before its last push-off the jump takes a goal 10 cm further; what follows the plan ends there short of it."""
    wanted = Replanning(goals=(MovedGoal(0.05, "root_x", 1.1),))
    lqr, replanned = replay(jump, ["lqr", "replan"], replanning=wanted, motion=motion).runs
    assert not lqr.deviation.finished and replanned.deviation.finished
    assert replanned.entry()["base_end"] < 0.25 * lqr.entry()["base_end"]
    assert replanned.entry()["replanning"]["goals"] == [{"time": 0.05, "name": "root_x", "value": 1.1}]


def test_a_push_is_a_change_of_velocity(jump: Plan, scene: MujocoScene) -> None:
    """In flight the centre of mass moves faster by so much; twice as heavy a robot, too."""
    push = Push(0.05, (0.2, 0.0, -0.1))
    for factor in (1.0, 2.0):
        own = mujoco_scene(scene.motion, mass=factor)
        runs = [run(own, jump, OpenLoop(jump), disturbance=Disturbance(pushes=each)) for each in ((), (push,))]
        still, pushed = (_speed_of_center(scene.motion, each, 70) for each in runs)
        assert pushed - still == pytest.approx(push.velocity, abs=2e-3)


def _speed_of_center(motion: MotionProblem, record: Any, row: int) -> np.ndarray:
    import pinocchio as pin

    model = motion.robot.model
    data = model.createData()
    pin.centerOfMass(model, data, record.configuration[row], record.velocity[row])
    return np.array(data.vcom[0])


def test_the_end_is_compared_with_the_goal_that_moved(jump: Plan, scene: MujocoScene) -> None:
    """A run that follows the plan ends so far from a goal that is 4 cm further, and before the end nothing changes."""
    record, planned = run(scene, jump, OpenLoop(jump)), float(jump.trajectory.configuration["root_x"][-1])
    plain, moved = (Deviation(scene, jump, record, goal) for goal in (None, {"root_x": planned + 0.04}))
    assert np.array_equal(plain.distance["body"][:-1], moved.distance["body"][:-1])
    assert moved.bodies["body"].end == pytest.approx(0.04, abs=plain.bodies["body"].end + 1e-3)


def test_perturbed_runs_have_both() -> None:
    """Factors multiply, pushes add up; what a perturbed run is off by is kept."""
    push, offset = Push(0.1, (0.1, 0.0, 0.0)), np.ones(3)
    case = Perturbation("case", 1.1, 0.8, Disturbance(offset, 0.005, Noise(1), (push,)))
    both = case.beside(Perturbation(mass=2.0, friction=0.5, disturbance=Disturbance(pushes=(push,))))
    assert (both.what, both.mass, both.friction) == ("case", 2.2, 0.4)
    assert both.disturbance.offset is offset and both.disturbance.pushes == (push, push)
    assert (both.disturbance.delay, both.disturbance.noise) == (0.005, Noise(1))


@pytest.mark.parametrize(
    ("push", "message"),
    [
        (Push(1.5, (0.1, 0, 0)), "push: found one at 1.5 s, expected a time before the run ends, 1 s"),
        (Push(-0.1, (0.1, 0, 0)), "push: found one at -0.1 s, expected a time before the run ends, 1 s"),
        (Push(0.1, (0.1, 0, 0), 1e-5), "push: found a duration of 1e-05 s, expected one of at least 0.001 s"),
        (Push(0.1, (0.1, 0)), "push: found the velocity (0.1, 0), expected three numbers, m/s"),
        (
            Push(0.1, (0.1, 0.2, 0)),
            "push: found 0.2 m/s along y, expected 0 for a robot that moves in the x-z plane",
        ),
    ],
)
def test_a_push_that_is_none(jump: Plan, scene: MujocoScene, push: Push, message: str) -> None:
    """A push that nobody would feel is refused, with one sentence."""
    with pytest.raises(OptionError) as error:
        run(scene, jump, OpenLoop(jump), disturbance=Disturbance(pushes=(push,)))
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (Replanning(1e-4), "period: found 0.0001 s, expected a time of at least 0.001 s, for which controls hold"),
        (
            Replanning(goals=(MovedGoal(0.1, "rootx", 1.0),)),
            "goal: found 'rootx', expected a configuration coordinate of the task's goal (did you mean 'root_x'?)",
        ),
        (
            Replanning(goals=(MovedGoal(1.0, "root_x", 1.0),)),
            "goal: found a new root_x at 1 s, expected a time before the plan ends, 1 s",
        ),
    ],
)
def test_replanning_that_cannot_be(jump: Plan, motion: MotionProblem, wanted: Replanning, message: str) -> None:
    """A period and goals are checked before anything is made."""
    with pytest.raises(OptionError) as error:
        controller_of("replan", jump, motion, replanning=wanted)
    assert str(error.value) == message


def test_a_plan_that_cannot_be_replanned(jump: Plan, motion: MotionProblem) -> None:
    """A plan without its finite elements is refused by the replanner."""
    with pytest.raises(PlanFileError, match="found a plan without its finite elements"):
        replay(jump.model_copy(update={"finite_elements": None}), ["replan"], motion=motion)


def test_factors_of_a_scene(motion: MotionProblem) -> None:
    """Masses and friction are positive."""
    with pytest.raises(OptionError, match=r"^mass: found the factor 0, expected a number greater than 0$"):
        mujoco_scene(motion, mass=0.0)
