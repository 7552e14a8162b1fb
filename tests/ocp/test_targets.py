"""Goals of frames and the centre of mass, and waypoints, against Pinocchio's numeric algorithms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.task import Task

from .pinocchio_points import center_of_mass, constraint, costs, frame, rows, states

Load = Callable[[str], Task]

POINTS = """\
  frames:
    foot: {position: [0.9, null, 0.2], velocity: {x: 0.3}, tolerance: 0.02, weight: 7, velocity_weight: 3}
  center_of_mass: {position: {z: 0.7}, velocity: [1, null, null], velocity_tolerance: 0.5}
"""


def test_points_of_the_goal(short: str, load: Load) -> None:
    """Rows are position and velocity minus target along the given axes, bounded by the tolerance; costs are squares."""
    motion = formulate(load(short + POINTS))
    goal = constraint(motion, "goal")
    assert (goal.kind, tuple(goal.intervals)) == ("interval_end", (3,))
    np.testing.assert_array_equal(goal.upper, [0.02, 0.02, 0.01, 0.01, 0.5])
    np.testing.assert_array_equal(goal.lower, -goal.upper)
    for x in states():
        p, dp, _ = frame(motion.robot, "foot", x[:4], x[4:8])
        c, dc = center_of_mass(motion.robot, x[:4], x[4:8])
        np.testing.assert_allclose(
            rows(goal, x), [p[0] - 0.9, p[2] - 0.2, dp[0] - 0.3, c[2] - 0.7, dc[0] - 1], atol=1e-12
        )
        expected = {
            "goal: foot": 7 * ((p[0] - 0.9) ** 2 + (p[2] - 0.2) ** 2) + 3 * (dp[0] - 0.3) ** 2,
            "goal: center of mass": 100 * (c[2] - 0.7) ** 2 + 10 * (dc[0] - 1) ** 2,
        }
        assert costs(goal, x) == pytest.approx(expected, abs=1e-12)


def test_goals_of_points_leave_coordinates_free(short: str, load: Load) -> None:
    """With a goal for a frame only coordinates that the goal lists have a weight at the end."""
    from casadi import Function

    ocp = formulate(load(short + POINTS)).ocp
    symbols, cost = [ocp.system.state, ocp.system.parameters], ocp.terminal_cost["terminal configuration"]
    terminal = Function("terminal", symbols, [cost])
    for x in states():
        assert float(terminal(x, ocp.parameters[:, -1])) == pytest.approx(400 * (x[0] - 1) ** 2)


WAYPOINTS = """\
waypoints:
  - time: 0.25
    configuration: {leg: 0.3, root_z: 0.8}
    velocity: {root_x: 2}
    tolerance: {configuration: {leg: 0.02}, velocity: {root_x: 0}}
    weight: 4
  - time: 0.75
    frames: {foot: {position: {z: 0.1}, tolerance: 0}}
    center_of_mass: {position: {x: 0.6}, weight: 2}
"""


def test_waypoints(short: str, load: Load) -> None:
    """Every waypoint bounds its targets and adds their costs at the end of the interval that ends at its time."""
    motion = formulate(load(short + WAYPOINTS))
    first, second = constraint(motion, "waypoint 1"), constraint(motion, "waypoint 2")
    assert (tuple(first.intervals), tuple(second.intervals)) == ((0,), (2,))
    np.testing.assert_array_equal(first.upper, [0.02, 0])
    for x in states():
        np.testing.assert_allclose(rows(first, x), [x[3] - 0.3, x[4] - 2], atol=1e-14)
        square = 4 * ((x[3] - 0.3) ** 2 + (x[1] - 0.8) ** 2) + 10 * (x[4] - 2) ** 2
        assert costs(first, x) == pytest.approx({"waypoint 1": square})
        p, _, _ = frame(motion.robot, "foot", x[:4], x[4:8])
        c, _ = center_of_mass(motion.robot, x[:4], x[4:8])
        np.testing.assert_allclose(rows(second, x), [p[2] - 0.1], atol=1e-14)
        assert costs(second, x)["waypoint 2"] == pytest.approx(100 * (p[2] - 0.1) ** 2 + 2 * (c[0] - 0.6) ** 2)


def test_waypoints_without_times_are_evenly_spread(short: str, load: Load) -> None:
    """Three waypoints without times in four intervals stand at the ends of the first three."""
    text = short + "waypoints: [{configuration: {leg: 0.3}}, {configuration: {leg: 0.4}}, {velocity: {leg: 0}}]\n"
    constraints = formulate(load(text)).ocp.constraints
    assert [tuple(one.intervals) for one in constraints if not one.on_request] == [(0,), (1,), (2,)]


ERRORS = [
    ("frames: {foot: {position: {z: 3}}}", "goal.frames.foot.position", "0.99 m out of reach"),
    ("frames: {foot: {position: [0, 0.5, 0], tolerance: 0}}", "goal.frames.foot.position", "always is 0 m"),
    ("frames: {foot: {velocity: {y: 1}, velocity_tolerance: 0}}", "goal.frames.foot.velocity", "expected null"),
    ("frames: {food: {position: {z: 1}}}", "goal.frames.food", "did you mean 'foot'?"),
]


@pytest.mark.parametrize(("text", "key", "fragment"), ERRORS, ids=[error[1] + error[0][-5:] for error in ERRORS])
def test_what_cannot_be_reached(short: str, load: Load, text: str, key: str, fragment: str) -> None:
    """A target beyond the links' lengths and joints' limits, or off the plane, is an error at its line."""
    with pytest.raises(TaskError) as caught:
        formulate(load(f"{short}  {text}\n"))
    assert (caught.value.line, caught.value.key) == (11, key), caught.value
    assert fragment in caught.value.message


def test_reach_is_sound(short: str, load: Load) -> None:
    """No configuration within the limits brings the foot further than the bound says, and some come close to it."""
    from fesd_robot.ocp.reach import reach

    motion = formulate(load(short))
    lower, upper, radius = reach(motion.robot, motion.task, "foot")
    np.testing.assert_allclose([lower, upper], [[-100, 0, 0], [100, 0, 1.5]], atol=1e-12)
    assert radius == 0.5
    rng = np.random.default_rng(0)
    distances = []
    for _ in range(300):
        q = rng.uniform(motion.limits.lower_position, motion.limits.upper_position)
        q[1] = rng.choice([0, 1.5])
        p, _, _ = frame(motion.robot, "foot", q, np.zeros(4))
        distances.append(np.linalg.norm(np.maximum(np.maximum(lower - p, p - upper), 0)))
    assert 0.4 < max(distances) <= radius + 1e-12


def test_reach_of_the_mass_is_sound(short: str, load: Load) -> None:
    """The centre of mass of a six-joint arm never gets further than the bound says, and comes close to it."""
    from fesd_robot.ocp.reach import reach_of_mass
    from fesd_robot.robot import load_robot

    arm = load_robot("example-robot-data:ur5")
    lower, upper, radius = reach_of_mass(arm, load(short))
    rng, data, distances = np.random.default_rng(0), arm.model.createData(), []
    for _ in range(500):
        c = pin.centerOfMass(arm.model, data, rng.uniform(-np.pi, np.pi, arm.model.nq))
        distances.append(np.linalg.norm(np.maximum(np.maximum(lower - c, c - upper), 0)))
    assert 0.75 * radius < max(distances) <= radius


TWINS = """\
<mujoco>
  <worldbody>
    <body name="mass" pos="0 0 1">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
      <geom size="0.1" mass="1"/><site name="twin"/>
      <body name="twin" pos="0 0 0.3"><geom size="0.1" mass="1"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="z" ctrlrange="-1 1"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ("goal: {frames: {twin: {position: {x: 1}}}}", "goal.frames.twin"),
        ("waypoints: [{frames: {twin: {position: {x: 1}}}}]", "waypoints.0.frames.twin"),
        ("costs: {frames: {twin: 1}}", "costs.frames.twin"),
        ("constraints: {c: {type: clearance, frame: twin, distance: 0}}", "constraints.c.frame"),
    ],
)
def test_a_name_of_several_frames(tmp_path: Path, load: Load, more: str, key: str) -> None:
    """A name that two frames share is an error wherever a task uses it."""
    (tmp_path / "twins.xml").write_text(TWINS, encoding="utf-8")
    text = "name: t\nrobot:\n  model: twins.xml\n  actuators:\n"
    text += "    up: {type: generalized_force, force: {z: 1}, lower: -1, upper: 1}\n"
    text += "contacts: {foot: {frame: mass}}\nhorizon: {duration: 1, intervals: 2}\n"
    formulate(load(text))
    with pytest.raises(TaskError, match="several frames called 'twin'") as caught:
        formulate(load(f"{text}{more}\n"))
    assert (caught.value.line, caught.value.key) == (8, key)


@pytest.mark.parametrize(
    ("foot", "allowed"),
    [("{x: 1.06}, tolerance: 0.04", True), ("{x: 1.06}", False), ("{x: 0.94}", False), ("{x: 1.03}", True)],
)
def test_a_point_and_the_configuration_agree(short: str, load: Load, foot: str, allowed: bool) -> None:
    """A goal that puts the foot at x = 1 by its coordinates and elsewhere by its frame is refused beyond tolerances."""
    upright = short.replace("{root_x: 1}", "{root_x: 1, root_pitch: 0, leg: 0.5}")
    tolerance = "  tolerance: {configuration: {root_x: 0.03, root_pitch: 0, leg: 0}}\n"
    task = load(f"{upright}{tolerance}  frames: {{foot: {{position: {foot}}}}}\n")
    if allowed:
        assert formulate(task).task.goal.frames["foot"].position is not None
        return
    with pytest.raises(TaskError) as caught:
        formulate(task)
    assert caught.value.key == "goal.configuration"
    assert "is 0.06 m from its own goal, expected at most 0.04 m or one of the two" in caught.value.message


def test_a_configuration_in_part_leaves_a_point_free(short: str, load: Load) -> None:
    """Where the point depends on a coordinate without a goal nothing can contradict it."""
    assert formulate(load(short + "  frames: {foot: {position: {x: 1.2}}}\n")).task.goal.configuration == {"root_x": 1}
