"""Several feet in space: the first motion has the contact sequence of the guess, without a homotopy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import Plan, load_task, plan
from fesd_robot.guessed_sequence import needs_guessed_start, with_own_starts
from fesd_robot.mpcc import NlpReport
from fesd_robot.ocp import formulate
from fesd_robot.task import Task
from tests.quadruped_in_space import LEGS, standing

TASKS = Path(__file__).parents[1] / "tasks"
TURN = np.pi / 8

JUMP = (
    standing("turning", "{duration: 0.5, intervals: 6}") + f"goal: {{configuration: {{root_joint.yaw: {TURN}}}}}\n"
    "reference: {type: jumps, count: 1, apex: {root_joint.z: 0.32}}\n"
    "solver: {starts: 1, retries: 0, local_search: false}\n"
)


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """A jump of Solo12 with four feet and twelve joints that turns it by 22.5 degrees."""
    file = tmp_path_factory.mktemp("guessed") / "turning.yaml"
    file.write_text(JUMP, encoding="utf-8")
    return load_task(file, ["method.grid=uniform", "method.accuracy=none"])


@pytest.fixture(scope="module")
def planned(task: Task) -> tuple[Plan, list[NlpReport]]:
    """Its plan and the NLPs of it."""
    reports: list[NlpReport] = []
    return plan(task, progress=reports.append), reports


def test_it_stands_on_all_feet(task: Task) -> None:
    """The height that inverse kinematics finds for a free flyer is that of Pinocchio's feet above its root."""
    motion = formulate(task)
    assert needs_guessed_start(motion)
    model, q = motion.robot.model, motion.endpoints.initial_configuration
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    feet = [data.oMf[model.getFrameId(f"{leg}_FOOT")].translation[2] for leg in LEGS]
    np.testing.assert_allclose(feet, 0.0, atol=1e-9)
    assert q[:2] == pytest.approx([0, 0]) and np.linalg.norm(q[3:7]) == pytest.approx(1)


@pytest.mark.parametrize("name", ["solo12_jump_in_space", "solo12_sideways", "solo12_two_steps", "table_push"])
def test_a_motion_that_begins_on_guessed_contacts_has_one_start(name: str) -> None:
    """One initial guess where the task leaves it open, else as many as it says."""
    file = TASKS / f"{name}.yaml"
    assert with_own_starts(load_task(file, ["method.grid=uniform"])).solver.starts == 1
    assert with_own_starts(load_task(file, ["method.grid=uniform", "solver.starts=3"])).solver.starts == 3


@pytest.mark.parametrize("name", ["hopper_one_jump", "biped_step", "hopper_in_space"])
def test_a_motion_that_begins_with_a_homotopy_has_the_usual_starts(name: str) -> None:
    """The number of initial guesses stays open in the plane, and with a single contact in space."""
    assert with_own_starts(load_task(TASKS / f"{name}.yaml", ["method.grid=uniform"])).solver.starts is None


def test_the_guess_flies_as_long_as_a_fall_from_its_apex(task: Task) -> None:
    """Between take-off and landing the reference is above the stance for 2 sqrt(2 h / g), as a falling mass."""
    motion = formulate(task)
    times = np.linspace(0, 0.5, 5001)
    heights = np.array([motion.reference.configuration(time)[2] for time in times])
    stance = motion.endpoints.initial_configuration[2]
    in_flight = np.ptp(times[heights > stance + 1e-9])
    assert in_flight == pytest.approx(2 * np.sqrt(2 * (0.32 - stance) / 9.81), abs=2e-4)


def test_the_motion_is_exact_without_relaxation(planned: tuple[Plan, list[NlpReport]]) -> None:
    """No NLP relaxes complementarity, and the motion is solved to round-off and meets its goal within 0.01 rad.

    It is not refined, so that its audit may still find a force at the edge of its cone.
    """
    result, reports = planned
    assert result.status.exact and result.status.complementarity <= 1e-9
    assert result.status.stationarity == "S" and result.status.b_stationary == "certified"
    assert reports and all(report.sigma == 0 for report in reports)
    assert result.trajectory.configuration["root_joint.qz"][-1] == pytest.approx(np.sin(TURN / 2), abs=5e-3)


def test_all_feet_leave_the_ground_and_come_back(planned: tuple[Plan, list[NlpReport]]) -> None:
    """Every foot is on the ground at first, flies, and stands again at the end."""
    for contact in planned[0].contacts.values():
        assert contact.mode[1] == "stick" and contact.mode[-1] == "stick" and "flight" in contact.mode


@pytest.fixture(scope="module")
def push() -> tuple[Plan, list[NlpReport]]:
    """An arm that slides a box on three feet, on a coarse grid, and the NLPs of its plan."""
    reports: list[NlpReport] = []
    quick = ["method.accuracy=none", "solver.starts=1", "solver.retries=0", "solver.local_search=false"]
    return plan(load_task(TASKS / "table_push.yaml", ["method.grid=uniform", *quick]), progress=reports.append), reports


def test_what_moves_on_the_ground_all_along_the_guess_slides(push: tuple[Plan, list[NlpReport]]) -> None:
    """No NLP relaxes complementarity; the three feet slide 0.1 m without leaving the table."""
    result, reports = push
    assert result.status.exact and result.status.audit_passed
    assert all(report.sigma == 0 for report in reports)
    assert result.outcome is not None
    for foot in ("rear_left", "rear_right", "front"):
        assert set(result.contacts[foot].mode) <= {"slip"}
        assert result.outcome.contacts[foot].slide_distance == pytest.approx(0.1, abs=3e-3)


def test_a_box_that_is_pushed_on_three_feet_obeys_statics_and_newton(push: tuple[Plan, list[NlpReport]]) -> None:
    """Friction at the height h below its middle loads the front foot by mu m g h more than the rear ones carry.

    With feet 2 b apart, F_front = m g (1 + mu h / b) / 2, here h = b = 0.04 m; along the push m v = int N - mu m g t.
    """
    motion, mass, friction, gravity = push[0], 0.3, 0.3, 9.81
    weight = mass * gravity
    front, tip = (motion.contacts[name].normal_force for name in ("front", "tip"))
    np.testing.assert_allclose(front[1:], weight * (1 + friction) / 2, rtol=1e-4)
    time, velocity = motion.trajectory.time, motion.trajectory.velocity["box.root_joint.vx"]
    pushed = np.cumsum(np.diff(time, prepend=0.0) * tip)
    momentum = mass * velocity
    np.testing.assert_allclose(momentum, pushed - friction * weight * time, atol=0.03 * momentum.max())
