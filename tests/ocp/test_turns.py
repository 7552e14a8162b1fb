"""The angle of a joint without limits in a task: how it is written, constrained, weighed and referred to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import load_task
from tests.legs_on_a_slide import HEAD, STANDING, leg, task_of

from .pinocchio_points import constraint, rows

CONTINUOUS = leg('<limit velocity="20" effort="40"/>', "continuous")
LIMITED = leg('<limit lower="-2.5" upper="2.5" velocity="20" effort="40"/>')
START = "initial: {configuration: {slide: 1, hip: 0.5, knee: -1.0}}\n"
GOAL = "goal: {configuration: {slide: 1, hip: 0.5, knee: -0.4}}\n"

Formulated = Callable[..., MotionProblem]


@pytest.fixture
def formulated(tmp_path: Path) -> Formulated:
    """Formulate a task of a leg whose knee is continuous, or the one given."""
    return lambda lines, model=CONTINUOUS: formulate(
        load_task(task_of(tmp_path, model, lines), ["method.grid=uniform"])
    )


def knee(q: np.ndarray) -> float:
    """Return the angle of the knee in a configuration of four entries."""
    return float(np.arctan2(q[3], q[2]))


def test_an_angle_is_the_cosine_and_sine(formulated: Formulated) -> None:
    """Start and goal have those of the angles; a completed task holds them and changes no more."""
    motion = formulated(START + GOAL)
    for q, angle in ((motion.endpoints.initial_configuration, -1.0), (motion.endpoints.goal_configuration, -0.4)):
        np.testing.assert_allclose(q[2:], [np.cos(angle), np.sin(angle)], atol=1e-15)
    assert "knee" not in motion.task.goal.configuration
    assert formulate(motion.task).task == motion.task


def test_standing_is_that_of_the_limited_joint(formulated: Formulated) -> None:
    """With the same angles the slide is adjusted to the same height, and an adjusted knee bends alike."""
    for lines in (
        f"initial: {{configuration: {{hip: 0.5, knee: -1.0}}, {STANDING}}}\n",
        "initial: {configuration: {slide: 0.5, hip: 0.5, knee: -1}, stand_on: {contacts: [foot], adjust: [knee]}}\n",
        "initial: {configuration: {slide: 0.5, hip: 0.2, knee: -1},"
        " stand_on: {contacts: [foot], adjust: [hip], prefer: {knee: -1.2}}}\n",
    ):
        turning, limited = (formulated(lines, model) for model in (CONTINUOUS, LIMITED))
        found, wanted = (each.endpoints.initial_configuration for each in (turning, limited))
        np.testing.assert_allclose([*found[:2], knee(found)], wanted, atol=1e-8)


def test_the_pair_remains_valid_and_few_digits_are_normalised(formulated: Formulated) -> None:
    """A whole cosine and sine is the same as its angle, also in two digits."""
    motion = formulated(
        "postures: {bent: {knee.cos: 0.54, knee.sin: -0.84}}\n"
        "initial: {posture: bent, configuration: {slide: 1}}\ngoal: {posture: bent, configuration: {knee: 0.3}}\n"
    )
    start = motion.endpoints.initial_configuration
    assert knee(start) == pytest.approx(-1, abs=2e-3) and np.hypot(*start[2:]) == pytest.approx(1, abs=1e-15)
    assert knee(motion.endpoints.goal_configuration) == pytest.approx(0.3)


def test_goal_and_weights_are_those_of_the_angle(formulated: Formulated) -> None:
    """The goal's row and the terminal cost are the shorter turn, at any angle, also across half a turn."""
    motion = formulated(
        START
        + "goal: {configuration: {slide: 1, knee: 3.0}, tolerance: {configuration: {knee: 0.02}}}\n"
        + "costs: {terminal_configuration: {knee: 7}}\n"
    )
    goal = constraint(motion, "goal")
    assert (goal.row_names, goal.upper.tolist()) == (["goal: knee"], [0.02])
    assert np.isinf(motion.ocp.terminal_upper[2:4]).all()
    state, parameters = motion.ocp.system.state, motion.ocp.system.parameters
    cost = ca.Function("cost", [state, parameters], [motion.ocp.terminal_cost["terminal configuration"]])
    for turn in (0.0, 0.01, -1.5, 2.5):
        x = np.zeros(goal.variables.numel())
        x[2:4] = np.cos(3.0 + turn), np.sin(3.0 + turn)
        np.testing.assert_allclose(rows(goal, x), [turn], atol=1e-14)
        whole = np.zeros(state.numel())
        whole[:4] = x[:4]
        assert float(cost(whole, motion.ocp.parameters[:, -1])) == pytest.approx(7 * turn**2, abs=1e-12)


def test_default_weights_are_those_of_a_limited_joint(formulated: Formulated) -> None:
    """A radian of a joint without limits costs as one of a joint with limits."""
    turning, limited = (formulated(START + GOAL, model).task for model in (CONTINUOUS, LIMITED))
    assert turning.costs == limited.costs
    assert turning.goal.tolerance == limited.goal.tolerance


def test_limits_are_those_of_the_angle(formulated: Formulated) -> None:
    """The row is the angle from the middle of its limits."""
    motion = formulated(START + GOAL + "limits: {position: {knee: [-2.5, 0.5]}}\n")
    found = constraint(motion, "angle limits")
    assert (found.row_names, found.upper.tolist()) == (["limit of knee"], [1.5])
    for angle in (-2.5, -1.0, 0.4):
        x = np.zeros(found.variables.numel())
        x[2:4] = np.cos(angle), np.sin(angle)
        np.testing.assert_allclose(rows(found, x), [angle + 1.0], atol=1e-14)


REFERENCES = [
    "",
    "waypoints: [{time: 0.3, configuration: {knee: -0.9}}]\nreference: {type: waypoints}\n",
    "reference: {type: jumps, count: 2, stance: 0, apex: {slide: 1.3, knee: -2.0}}\n",
]


@pytest.mark.parametrize("reference", REFERENCES)
def test_references_are_those_of_the_angle(formulated: Formulated, reference: str) -> None:
    """Lines, waypoints and jumps turn a joint without limits as they turn one with limits."""
    turning, limited = (formulated(START + GOAL + reference, model) for model in (CONTINUOUS, LIMITED))
    for time in np.linspace(0, 0.6, 13):
        found, wanted = (each.reference.configuration(float(time)) for each in (turning, limited))
        np.testing.assert_allclose([*found[:2], knee(found)], wanted, atol=1e-9)


def test_waypoints_lead_over_half_a_turn(formulated: Formulated) -> None:
    """From waypoint to waypoint a joint without limits turns the short way, and so once round."""
    path = "waypoints: [{time: 0.2, configuration: {knee: 1}}, {time: 0.4, configuration: {knee: 3}}]\n"
    motion = formulated(START + "goal: {configuration: {slide: 1, knee: -1.3}}\nreference: {type: waypoints}\n" + path)
    angles = np.unwrap([knee(motion.reference.configuration(time)) for time in np.linspace(0, 0.6, 61)])
    assert angles[[0, 20, 40, 60]] == pytest.approx([-1, 1, 3, 2 * np.pi - 1.3])


def test_a_file_may_give_the_angle(formulated: Formulated, tmp_path: Path) -> None:
    """A column of the joint's name stands for its cosine and sine."""
    (tmp_path / "motion.csv").write_text("time,slide,hip,knee\n0,1,0.5,-1\n0.6,1,0.5,4\n", encoding="utf-8")
    motion = formulated(START + GOAL + "reference: {type: file, path: motion.csv}\n")
    assert knee(motion.reference.configuration(0.6)) == pytest.approx(4 - 2 * np.pi)


def test_a_force_may_depend_on_the_angle(tmp_path: Path) -> None:
    """In an expression the joint's name is its angle."""
    drive = "actuators: {spring: {type: generalized_force, force: {knee: 2 * knee, hip: 1}, lower: -1, upper: 1}}"
    path = task_of(tmp_path, CONTINUOUS, START + GOAL)
    path.write_text(path.read_text().replace("{model: robot.urdf}", f"{{model: robot.urdf, {drive}}}"))
    motion = formulate(load_task(path))
    forces = motion.actuation.matrix(motion.endpoints.initial_configuration).full().ravel()
    np.testing.assert_allclose(forces, [0, 1, -2], atol=1e-15)


FAULTS = [
    (
        "initial: {configuration: {knee.sin: -1.0}}",
        "initial.configuration.knee.sin",
        "found 'knee.sin' without 'knee.cos'",
    ),
    ("goal: {configuration: {knee.cos: 1}}", "goal.configuration.knee.cos", "expected the angle 'knee' (rad), or both"),
    (
        "initial: {configuration: {knee.cos: 3, knee.sin: 4}}",
        "initial.configuration.knee.cos",
        "found a cosine and sine of norm 5, expected the angle 'knee' (rad), or a norm of 1, within 0.01",
    ),
    ("postures: {p: {knee.cos: 0.7, knee.sin: 0.7, knee: 1}}", "postures.p.knee", "not both"),
    ("reference: {type: jumps, count: 1, apex: {knee.sin: 1}}", "reference.apex.knee.sin", "without 'knee.cos'"),
    ("waypoints: [{configuration: {knee.cos: 0}}]", "waypoints.0.configuration.knee.cos", "without 'knee.sin'"),
    (
        "costs: {configuration: {knee.cos: 3}}",
        "costs.configuration.knee.cos",
        "a part of an angle, expected 'knee' (rad)",
    ),
    ("limits: {position: {knee.sin: [-1, 1]}}", "limits.position.knee.sin", "a part of an angle"),
    ("limits: {position: {knee: [-4, 4]}}", "limits.position.knee", "less than 6.28319 apart"),
    ("limits: {position: {knee: [0, null]}}", "limits.position.knee", "less than 6.28319 apart"),
    (
        "goal: {configuration: {knee: 45}}",
        "goal.configuration.knee",
        "found 45, expected a value in [-6.28319, 6.28319], one turn in rad (45 degrees are 0.785398 rad)",
    ),
    ("goal: {configuration: {kneee: 1}}", "goal.configuration.kneee", "did you mean 'knee'?"),
    ("goal: {periodic: {stride: {knee: 1}}}", "goal.periodic", "found a robot with joints whose configuration"),
    (
        "initial: {stand_on: {contacts: [foot], adjust: [knee.sin]}}",
        "initial.stand_on.adjust.0",
        "which changes together with others",
    ),
]


@pytest.mark.parametrize(("line", "key", "fragment"), FAULTS, ids=[fault[1] for fault in FAULTS])
def test_faults_are_located(formulated: Formulated, line: str, key: str, fragment: str) -> None:
    """What is wrong with an angle is said in one sentence with file, line and key."""
    with pytest.raises(TaskError) as caught:
        formulated(line + "\n")
    error = caught.value
    assert (error.key, error.line) == (key, HEAD.count("\n") + 1), str(error)
    assert fragment in error.message and error.file is not None


def test_a_start_outside_the_limits_of_the_angle_is_located(formulated: Formulated) -> None:
    """The start that nothing writes has the angle 0."""
    with pytest.raises(TaskError, match="found limits that the initial angle is outside of") as caught:
        formulated("initial: {configuration: {slide: 1}}\nlimits: {position: {knee: [0.1, 1]}}\n")
    assert caught.value.key == "limits.position.knee"
