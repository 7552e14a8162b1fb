"""Runs of a plan in MuJoCo, and their distance from it."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.in_mujoco import Deviation, Disturbance, MujocoScene, Noise, OpenLoop, mujoco_scene, replay, run
from fesd_robot.in_mujoco.driving import Touch, _start
from fesd_robot.in_mujoco.measures import _matched
from fesd_robot.in_mujoco.perturbed import offset, perturbations
from fesd_robot.ocp import MotionProblem, numeric_physics
from fesd_robot.plans import Plan
from fesd_robot.plans.plan import Switch
from fesd_robot.tracking import Tracker
from tests.in_mujoco.conftest import formulated


def test_free_flight(jump: Plan, scene: MujocoScene, motion: MotionProblem) -> None:
    """Until the first landing a run in open loop stays on the plan, to the error of the integrator: g h t / 2."""
    landing = next(each.time for each in jump.switches if each.kind == "touchdown")
    record = run(scene, jump, OpenLoop(jump))
    found = Deviation(scene, jump, record)
    flying = found.time < landing - 1e-3
    assert flying.sum() > 50
    assert found.distance["body"][flying].max() < 2 * 9.81 * scene.model.opt.timestep * landing / 2


def test_a_jump_follows_its_plan(jump: Plan, scene: MujocoScene, motion: MotionProblem) -> None:
    """With the LQR the jump ends where the plan does, and its landings come in time."""
    record = run(scene, jump, Tracker(jump, motion=motion))
    found = Deviation(scene, jump, record)
    assert found.bodies["body"].rms < 2e-3
    assert [each.error for each in found.touchdowns] == pytest.approx([0.0] * len(found.touchdowns), abs=1e-3)
    assert found.finished
    assert max(found.slip.values()) < 1e-3
    assert found.effort[0] <= 1.0
    assert record.control.max() <= scene.motors.upper.max()


def test_open_loop_is_the_mean_over_a_hold(jump: Plan) -> None:
    """The impulse of the controls is that of the plan, although these change between two holds."""
    controller, starts = OpenLoop(jump, 1e-3), jump.controls["time"]
    end = float(jump.trajectory.time[-1])
    times = np.arange(0.0, end - 1e-9, 1e-3)
    actions = np.array([controller.action(time, np.zeros(0), np.zeros(0), np.zeros(0)) for time in times])
    names = [name for name in jump.controls if name != "time"]
    widths = np.diff(np.append(starts, end))
    wanted = [widths @ jump.controls[name] for name in names]
    last = [jump.controls[name][-1] * (len(times) * 1e-3 - end) for name in names]
    assert 1e-3 * actions.sum(axis=0) == pytest.approx(np.array(wanted) + last, abs=1e-9)


def test_a_late_control(jump: Plan, scene: MujocoScene) -> None:
    """With a delay every control comes so much later; before the first one its answer to the start holds."""
    plain = run(scene, jump, OpenLoop(jump))
    late = run(scene, jump, OpenLoop(jump), disturbance=Disturbance(delay=5e-3))
    assert late.control[5:] == pytest.approx(plain.control[:-5])
    assert late.control[:5] == pytest.approx(np.tile(plain.control[0], (5, 1)))


def test_noise_is_repeatable(jump: Plan, scene: MujocoScene, motion: MotionProblem) -> None:
    """The same seed gives the same run, another one another run; the controller alone is misled."""
    first, again, other = (
        run(scene, jump, Tracker(jump, motion=motion), disturbance=Disturbance(noise=Noise(seed))) for seed in (1, 1, 2)
    )
    assert np.array_equal(first.configuration, again.configuration)
    assert not np.array_equal(first.configuration, other.configuration)


@pytest.mark.parametrize("name", ["solo12_jump_in_space", "gripper_lift", "hopper_one_jump"])
def test_an_offset_presses_nothing_together(name: str) -> None:
    """Of a displaced start no gap is below zero, and the displacement is of the size that was asked for."""
    motion = formulated(name)
    physics, robot = numeric_physics(motion), motion.robot
    q0 = motion.endpoints.initial_configuration
    plan = _resting(motion)
    for seed in range(5):
        q, _ = _start(mujoco_scene(motion), plan, offset(robot, seed, 1.0))
        assert physics.gaps(q).min() > min(physics.gaps(q0).min(), 0.0) - 1e-8
        assert 1e-3 < np.linalg.norm(physics.difference(q0, q)) < 0.2


def _resting(motion: MotionProblem) -> Plan:
    """Return what `_start` reads of a plan that begins where its task does."""
    from types import SimpleNamespace

    robot, start = motion.robot, motion.endpoints.initial_configuration
    trajectory = SimpleNamespace(
        configuration={name: [value] for name, value in zip(robot.configuration_names, start, strict=True)},
        velocity={name: [0.0] for name in robot.velocity_names},
    )
    return SimpleNamespace(trajectory=trajectory)  # type: ignore[return-value]


def test_twenty_perturbations() -> None:
    """There are five kinds, each four times, each of one thing at its full size."""
    cases = perturbations(formulated("solo12_jump_in_space").robot)
    assert len(cases) == 20
    assert [case.mass for case in cases[:4]] == pytest.approx([1.1, 0.9, 1.1, 0.9])
    assert sum(case.friction == pytest.approx(0.8) for case in cases) == 4
    assert sum(case.disturbance.delay > 0 for case in cases) == 4
    assert sum(case.disturbance.noise is not None for case in cases) == 4
    lengths = [np.linalg.norm(case.disturbance.offset[:3]) for case in cases if case.disturbance.offset is not None]
    assert sorted(lengths) == pytest.approx([1e-3] * 16 + [1e-2] * 4)


def test_touchdowns_are_matched_once() -> None:
    """Every touchdown of the plan gets the nearest one of the run that no nearer one has taken."""
    planned = [Switch(time=time, contact="foot", kind="touchdown") for time in (0.1, 0.14, 0.9)]
    found = _matched(planned, [Touch("foot", 0.11), Touch("foot", 0.135), Touch("other", 0.9)], 0.0)
    assert [each.error for each in found] == [pytest.approx(0.01), pytest.approx(-0.005), None]


def test_bad_times(jump: Plan, scene: MujocoScene) -> None:
    """A hold is a number of time steps, and a delay a number of holds."""
    with pytest.raises(OptionError, match=r"^hold: found 0.00013 s, expected a whole number of steps of 0.0001 s$"):
        run(scene, jump, OpenLoop(jump), hold=1.3e-4)
    with pytest.raises(OptionError, match=r"^delay: found 0.0005 s"):
        run(scene, jump, OpenLoop(jump), disturbance=Disturbance(delay=5e-4))
    with pytest.raises(OptionError, match=r"^beyond: found -1 s"):
        run(scene, jump, OpenLoop(jump), beyond=-1)


def test_beyond_the_end(jump: Plan, scene: MujocoScene, motion: MotionProblem) -> None:
    """A run may go on after its plan; what is compared ends with the plan."""
    record = run(scene, jump, Tracker(jump, motion=motion), beyond=0.2)
    assert record.time[-1] == pytest.approx(jump.trajectory.time[-1] + 0.2)
    assert Deviation(scene, jump, record).time[-1] == pytest.approx(jump.trajectory.time[-1])


def test_an_unsolved_plan(jump: Plan, motion: MotionProblem) -> None:
    """It is refused, and in open loop it runs if that is asked for, from its samples alone."""
    status = jump.status.model_copy(update={"solved": False})
    unsolved = jump.model_copy(update={"status": status, "finite_elements": None})
    with pytest.raises(PlanFileError, match="found a plan that is not solved"):
        replay(unsolved, motion=motion)
    found = replay(unsolved, unsolved=True, motion=motion)
    assert [each.controller for each in found.runs] == ["open-loop"]
    assert [each.split(" is left out")[0] for each in found.left_out] == ["pd", "lqr"]
    assert found.runs[0].deviation.bodies["body"].rms < 0.05


def test_the_scene_as_a_file(scene: MujocoScene) -> None:
    """MuJoCo reads what is written of a scene, with the same masses, pairs and motors."""
    model = mujoco.MjModel.from_xml_string(scene.xml())
    assert model.body_mass == pytest.approx(scene.model.body_mass, rel=1e-5)
    assert (model.npair, model.nu, model.nv) == (scene.model.npair, scene.model.nu, scene.model.nv)
    assert model.pair_solref == pytest.approx(scene.model.pair_solref)
    assert model.opt.timestep == scene.model.opt.timestep
