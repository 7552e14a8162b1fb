"""Replanning from measured states: exact, quick to follow, and honest about what it could not do."""

from __future__ import annotations

import contextlib

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import FesdRobotError, OptionError, PlanFileError
from fesd_robot.in_mujoco import Disturbance, Push, mujoco_scene, run
from fesd_robot.ocp import MotionProblem, formulate, numeric_physics
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning import Policy, Replanner, ReplanningController
from tests.wrong_calls import WRONG


def state(plan: Plan, motion: MotionProblem, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, v and what touches, of a plan at a time."""
    at = plan.at(time)
    return (
        np.array([at.configuration[name] for name in motion.robot.configuration_names]),
        np.array([at.velocity[name] for name in motion.robot.velocity_names]),
        np.array([str(at.contacts[contact.name].mode) != "flight" for contact in motion.contacts]),
    )


def followed(replanner: Replanner, plan: Plan, motion: MotionProblem, until: float) -> list[Policy]:
    """Update a replanner with the states of a plan, once a period."""
    policies = []
    for number in range(round(until / replanner.period)):
        if number:
            replanner.prepare()
        time = number * replanner.period
        policies.append(replanner.update(time, *state(plan, motion, time)))
    return policies


def test_on_the_plan_it_keeps_the_plan(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """Measured on its plan, it keeps the sequence, and predicts its landing to some milliseconds."""
    policies = followed(replanner, jump, motion, 0.7)
    updates = replanner.statistics.updates
    assert sum(each.status == "kept" for each in updates) >= 0.95 * len(updates)
    assert max(each.violation for each in updates if each.status == "kept") < 1e-3
    landing = [each.time for each in jump.switches if each.kind == "touchdown"][-1]
    found = [each.time for each in policies[-1].events if each.kind == "touchdown"]
    assert found == pytest.approx([landing], abs=0.02)


def test_most_updates_are_exact_after_one_step(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """In flight, near the plan, the equations hold to 1e-6 after a single step."""
    followed(replanner, jump, motion, 0.7)
    flying = [each for each in replanner.statistics.updates if 0.35 < each.time < 0.7]
    assert np.mean([each.first <= 1e-6 for each in flying]) > 0.8


def test_the_motion_begins_in_the_measured_state(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """A state beside the plan, in flight, is where the new motion begins, and its controls are others."""
    followed(replanner, jump, motion, 0.4)
    q, v, touching = state(jump, motion, 0.4)
    v = v + np.array([0.05, 0.03, 0.02, -0.04])
    replanner.prepare()
    policy = replanner.update(0.4, q, v, touching)
    assert policy.status == "kept"
    begins_q, begins_v = policy.reference(0.4)
    assert begins_q == pytest.approx(q, abs=1e-9)
    assert begins_v == pytest.approx(v, abs=1e-9)
    planned = [jump.at(0.4).controls[name] for name in motion.actuation.names]
    assert np.abs(policy.action(0.4, q, v) - planned).max() > 1e-3


def test_the_motion_obeys_the_equations_of_rigid_bodies(
    replanner: Replanner, jump: Plan, motion: MotionProblem
) -> None:
    """Ballistics, apart from any solver: the centre of mass of the new motion falls with g through a flight."""
    followed(replanner, jump, motion, 0.4)
    q, v, touching = state(jump, motion, 0.4)
    replanner.prepare()
    policy = replanner.update(0.4, q, v + np.array([0.05, 0.1, 0.02, -0.04]), touching)
    landing = next(each.time for each in policy.events if each.kind == "touchdown")
    model = motion.robot.model
    data = model.createData()

    def centre(time: float) -> np.ndarray:
        return np.array(pin.centerOfMass(model, data, policy.reference(time)[0]))

    first, last = centre(0.4), centre(landing)
    duration = landing - 0.4
    pin.centerOfMass(model, data, q, policy.reference(0.4)[1])
    expected = first + duration * np.array(data.vcom[0]) + 0.5 * duration**2 * model.gravity.linear
    assert last == pytest.approx(expected, abs=1e-6)
    assert abs(numeric_physics(motion).gaps(policy.reference(landing)[0])[0]) < 1e-6


def test_another_goal_is_aimed_at(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """A goal 5 cm further, told before take-off, moves the end of the motion there, and back again."""
    followed(replanner, jump, motion, 0.1)
    replanner.prepare()
    ends = []
    for number, goal in enumerate([{"root_x": 1.05}] * 4 + [{"root_x": 1.0}] * 4):
        policy = replanner.update(0.1, *state(jump, motion, 0.1), goal=goal)
        ends.append(policy.reference(policy._ends[-1])[0][0])
        replanner.prepare()
        assert policy.status in ("kept", "old"), number
    assert ends[3] == pytest.approx(1.05, abs=0.0101)
    assert ends[7] == pytest.approx(1.0, abs=0.0101)
    with pytest.raises(OptionError, match="found 'roof', expected coordinates of the task's goal: root_x"):
        replanner.update(0.1, *state(jump, motion, 0.1), goal={"roof": 1.0})


def test_an_impossible_state_leaves_the_last_policy(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """What no step comes near to is answered by the last policy and the reason; the next good state is followed."""
    followed(replanner, jump, motion, 0.4)
    before = replanner.policy
    q, v, touching = state(jump, motion, 0.4)
    replanner.prepare()
    policy = replanner.update(0.4, q + np.array([0.0, 50.0, 3.0, 0.0]), v + 100.0, touching)
    assert policy.status == "old"
    assert "violated" in policy.reason or "backwards" in policy.reason
    assert before is not None
    assert policy.action(0.41, q, v) == pytest.approx(before.action(0.41, q, v))
    for number in range(1, 6):
        time = 0.4 + number * replanner.period
        replanner.prepare()
        policy = replanner.update(time, *state(jump, motion, time))
    assert policy.status == "kept"


def test_it_is_deterministic(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """The same states, after a reset, give the same controls to the last digit."""
    first = followed(replanner, jump, motion, 0.3)
    replanner.reset()
    second = followed(replanner, jump, motion, 0.3)
    for one, other in zip(first, second, strict=True):
        q, v = one.reference(one.begin)
        assert np.array_equal(one.action(one.begin, q, v), other.action(other.begin, q, v))


def test_nothing_is_compiled_in_the_loop(
    replanner: Replanner, jump: Plan, motion: MotionProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No function of CasADi is made while it runs."""
    made = []
    original = ca.Function.__init__

    def counted(self: ca.Function, *arguments: object, **options: object) -> None:
        made.append(arguments)
        original(self, *arguments, **options)

    monkeypatch.setattr(ca.Function, "__init__", counted)
    followed(replanner, jump, motion, 0.3)
    assert not made


def test_a_push_that_lqr_cannot_take(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """In MuJoCo a push in the last flight is met: the robot lands, and stands half a second beyond the plan."""
    driven = formulate(task_of(jump), driven=False)
    scene = mujoco_scene(driven)
    push = Disturbance(pushes=[Push(0.4, (0.1, 0.0, 0.05))])
    record = run(scene, jump, ReplanningController(replanner), beyond=0.5, disturbance=push)
    names = motion.robot.configuration_names
    end = dict(zip(names, record.configuration[-1], strict=True))
    assert not record.broken
    assert abs(end["root_pitch"]) < 0.1
    assert end["root_z"] == pytest.approx(0.5, abs=0.02)
    late = [each for each in replanner.statistics.updates if each.time > 1.1]
    assert np.mean([each.status == "kept" for each in late]) > 0.9


@pytest.mark.slow
def test_another_plan_reaches_a_goal_that_was_missed(jump: Plan, motion: MotionProblem) -> None:
    """A push in the last flight makes the robot miss; it stands, another plan is found and followed, and it arrives."""
    replanner = Replanner(jump, search=True, motion=motion)
    scene = mujoco_scene(formulate(task_of(jump), driven=False))
    push = Disturbance(pushes=[Push(0.52, (0.29, 0.0, 0.06))])
    record = run(scene, jump, ReplanningController(replanner), beyond=1.05, disturbance=push)
    missed = record.configuration[np.searchsorted(record.time, 1.0), 0]
    assert abs(missed - 1.0) > 0.08
    assert record.configuration[-1, 0] == pytest.approx(1.0, abs=0.015)
    assert [each.status for each in replanner.statistics.updates].count("changed") == 1


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_wrong_arguments_are_refused(jump: Plan, motion: MotionProblem, wrong: object) -> None:
    """Whatever is given for the plan, its period or its iterations is taken, or refused by an exception of ours."""
    given: list[dict[str, object]] = [{"plan": wrong}, {"plan": jump, "iterations": wrong}]
    given += [] if isinstance(wrong, (int, float, np.generic)) else [{"plan": jump, "period": wrong}]
    for arguments in given:
        with contextlib.suppress(FesdRobotError):
            Replanner(**arguments, motion=motion)  # type: ignore[arg-type]


def test_bad_input_is_told(replanner: Replanner, jump: Plan, motion: MotionProblem) -> None:
    """Periods, iterations, arrays and plans that cannot be: one sentence each."""
    with pytest.raises(OptionError, match="period: found 0 s, expected a number greater than 0"):
        Replanner(jump, period=0, motion=motion)
    with pytest.raises(OptionError, match="iterations: found 0, expected a number of at least 1"):
        Replanner(jump, iterations=0, motion=motion)
    with pytest.raises(OptionError, match="found q of 3 and v of 4 entries, expected 4 and 4"):
        replanner.update(0.0, np.zeros(3), np.zeros(4))


def test_plans_that_cannot_be_followed(jump: Plan, motion: MotionProblem) -> None:
    """A plan without its finite elements is refused in one sentence."""
    without = jump.model_copy(update={"finite_elements": None})
    with pytest.raises(PlanFileError, match="without its finite elements"):
        Replanner(without, motion=motion)
