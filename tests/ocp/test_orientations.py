"""Orientations of a free root in a task: how they are written, constrained, weighed and referred to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.orientations import roll_pitch_yaw
from fesd_robot.task import load_task
from tests.bodies_in_space import box, written

from .pinocchio_points import constraint, costs, rows

AXES = ("vx", "vy", "vz", "wx", "wy", "wz")
BOX = (
    "robot:\n  model: model.urdf\n  root: free_flyer\n  actuators:\n"
    + "".join(
        f"    {axis}: {{type: generalized_force, force: {{root_joint.{axis}: 1}}, lower: -40, upper: 40}}\n"
        for axis in AXES
    )
    + "contacts: {corner: {frame: c0}}\n"
    "horizon: {duration: 1, intervals: 4}\n"
)
START = "initial: {configuration: {root_joint.z: 1, root_joint.roll: 0.2, root_joint.pitch: -0.1}}\n"
GOAL = "goal: {configuration: {root_joint.z: 1, root_joint.yaw: 0.5}}\n"

Formulated = Callable[[str], MotionProblem]


@pytest.fixture
def formulated(tmp_path: Path) -> Formulated:
    """Formulate a task of a box that forces and torques move in space."""
    return lambda lines: formulate(load_task(written(tmp_path, box(), BOX + lines), ["method.grid=uniform"]))


def turn(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the quaternion of three angles, (4)."""
    return np.asarray(pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, yaw)).coeffs())


def angles_at(motion: MotionProblem, time: float) -> np.ndarray:
    """Return roll, pitch and yaw of the reference."""
    return roll_pitch_yaw(motion.reference.configuration(time)[3:])


def final_cost(motion: MotionProblem, q: np.ndarray) -> float:
    """Return the cost of the distance from the goal in a configuration, at rest."""
    state, parameters = motion.ocp.system.state, motion.ocp.system.parameters
    x = np.concatenate([q, np.zeros(state.numel() - len(q))])
    cost = ca.Function("cost", [state, parameters], [motion.ocp.terminal_cost["terminal configuration"]])
    return float(cost(x, motion.ocp.parameters[:, -1]))


def test_angles_that_are_left_out_are_those_of_the_start(formulated: Formulated) -> None:
    """A goal that gives a yaw keeps roll and pitch; a completed task holds unit quaternions and changes no more."""
    motion = formulated(START + GOAL)
    np.testing.assert_allclose(motion.endpoints.initial_configuration[3:], turn(0.2, -0.1, 0), atol=1e-15)
    np.testing.assert_allclose(motion.endpoints.goal_configuration[3:], turn(0.2, -0.1, 0.5), atol=1e-15)
    task = motion.task
    assert not {"root_joint.roll", "root_joint.yaw"} & {*task.goal.configuration, *task.initial.configuration}
    assert [task.goal.configuration[f"root_joint.q{axis}"] for axis in "xyzw"] == pytest.approx(turn(0.2, -0.1, 0.5))
    assert formulate(task).task == task


def test_a_posture_gives_the_rest(formulated: Formulated) -> None:
    """Of a posture by quaternion a goal replaces the angle it gives, and a quaternion replaces a posture's angles."""
    w, z = np.cos(0.4), np.sin(0.4)
    quaternion = f"root_joint.qx: 0, root_joint.qy: 0, root_joint.qz: {z}, root_joint.qw: {w}"
    motion = formulated(
        f"postures: {{turned: {{{quaternion}}}, tilted: {{root_joint.roll: 0.3}}}}\n"
        "initial: {posture: turned, configuration: {root_joint.z: 1, root_joint.pitch: 0.2}}\n"
        f"goal: {{posture: tilted, configuration: {{{quaternion}}}}}\n"
    )
    np.testing.assert_allclose(roll_pitch_yaw(motion.endpoints.initial_configuration[3:]), [0, 0.2, 0.8], atol=1e-14)
    np.testing.assert_allclose(roll_pitch_yaw(motion.endpoints.goal_configuration[3:]), [0, 0, 0.8], atol=1e-14)


def test_few_digits_are_normalised(formulated: Formulated) -> None:
    """A quaternion in three digits is that rotation, of norm one."""
    motion = formulated(
        "initial: {configuration: {root_joint.z: 1, root_joint.qx: 0, root_joint.qy: 0, root_joint.qz: 0.195, "
        "root_joint.qw: 0.981}}\n"
    )
    expected = np.array([0, 0, 0.195, 0.981]) / np.hypot(0.195, 0.981)
    np.testing.assert_allclose(motion.endpoints.initial_configuration[3:], expected, atol=1e-15)


def test_a_goal_promises_the_rotation_vector(formulated: Formulated) -> None:
    """Its rows are log(R_goal^T R) within the tolerance of every angle, and no entry of the quaternion is bounded."""
    motion = formulated(START + GOAL.replace("}}", "}, tolerance: {configuration: {root_joint.yaw: 0.03}}}"))
    goal = constraint(motion, "goal")
    assert goal.row_names == [f"goal: root_joint.{angle}" for angle in ("roll", "pitch", "yaw")]
    np.testing.assert_array_equal(goal.upper, [0.01, 0.01, 0.03])
    np.testing.assert_array_equal(goal.lower, -goal.upper)
    assert np.isinf(motion.ocp.terminal_upper[3:7]).all() and motion.ocp.terminal_upper[2] == pytest.approx(1.01)
    wanted = pin.Quaternion(motion.endpoints.goal_configuration[3:])
    for vector in ([0.0, 0.0, 0.0], [0.01, -0.02, 0.03]):
        for sign in (1, -1):
            x = np.zeros(goal.variables.numel())
            x[3:7] = sign * (wanted * pin.Quaternion(pin.exp3(np.array(vector)))).coeffs()
            np.testing.assert_allclose(rows(goal, x), vector, atol=1e-14)


def test_weights_act_on_the_turn_about_the_axes_of_the_body(formulated: Formulated) -> None:
    """A turn of 0.1 rad about one axis of the body from the goal costs the square times the weight of its angle."""
    weights = {"roll": 2.0, "pitch": 3.0, "yaw": 5.0}
    written_out = ", ".join(f"root_joint.{angle}: {weight}" for angle, weight in weights.items())
    motion = formulated(START + GOAL + f"costs: {{terminal_configuration: {{{written_out}}}}}\n")
    goal = motion.endpoints.goal_configuration
    for axis, weight in enumerate(weights.values()):
        q = goal.copy()
        q[3:] = (pin.Quaternion(goal[3:]) * pin.Quaternion(pin.exp3(0.1 * np.eye(3)[axis]))).coeffs()
        assert final_cost(motion, q) == pytest.approx(weight * 0.01, rel=1e-12)
        q[3:] *= -1
        assert final_cost(motion, q) == pytest.approx(weight * 0.01, rel=1e-12)


def test_by_default_a_radian_of_an_orientation_costs_as_one_of_a_joint(formulated: Formulated) -> None:
    """Default weights have the names of angles, 10 for a radian all the time and 100 at the end."""
    costs = formulated(START + GOAL).task.costs
    for angle in ("root_joint.roll", "root_joint.pitch", "root_joint.yaw"):
        assert costs.configuration is not None and costs.configuration[angle] == 10
        assert costs.terminal_configuration is not None and costs.terminal_configuration[angle] == 100
        assert not any(name.startswith("root_joint.q") for name in costs.configuration)


def test_a_line_turns_evenly(formulated: Formulated) -> None:
    """From start to goal the reference turns with one angular velocity, and goes straight."""
    motion = formulated(START + GOAL.replace("root_joint.z: 1,", "root_joint.z: 1, root_joint.x: 1,"))
    first, last = (pin.Quaternion(turn(0.2, -0.1, yaw)).toRotationMatrix() for yaw in (0, 0.5))
    omega = pin.log3(first.T @ last)
    for time in (0.0, 0.3, 0.99):
        q, v = motion.reference.configuration(time), motion.reference.velocity(time)
        rotation = pin.Quaternion(q[3:]).toRotationMatrix()
        np.testing.assert_allclose(rotation, first @ pin.exp3(time * omega), atol=1e-12)
        np.testing.assert_allclose(q[:3], [time, 0, 1], atol=1e-12)
        np.testing.assert_allclose(v[3:], omega, atol=1e-8)
        np.testing.assert_allclose(rotation @ v[:3], [1, 0, 0], atol=1e-6)
        guess = motion.ocp.state_guess(time)
        np.testing.assert_allclose(guess[3:7], q[3:], atol=1e-12)
        np.testing.assert_allclose(guess[10:13], omega, atol=1e-8)


SOMERSAULT = """\
initial: {configuration: {root_joint.z: 1}}
goal: {configuration: {root_joint.z: 1, root_joint.pitch: 0}}
waypoints:
  - {time: 0.25, weight: 0, configuration: {root_joint.pitch: 2.0}}
  - {time: 0.5, configuration: {root_joint.pitch: 4.0}}
reference: {type: waypoints}
"""


def test_waypoints_lead_through_a_whole_turn(formulated: Formulated) -> None:
    """Between waypoints the turn is even and the short way, so that three of them make a somersault, without a jump."""
    motion = formulated(SOMERSAULT)
    times = np.linspace(0, 1, 201)
    quaternions = np.array([motion.reference.configuration(time)[3:] for time in times])
    assert (np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) > 0.99).all()
    for time, rate in ((0.1, 8.0), (0.3, 8.0), (0.7, (2 * np.pi - 4) / 0.5)):
        np.testing.assert_allclose(motion.reference.velocity(time)[3:], [0, rate, 0], atol=1e-6)
    end = pin.Quaternion(quaternions[-1])
    np.testing.assert_allclose(end.toRotationMatrix(), np.eye(3), atol=1e-12)
    assert end.coeffs()[3] == pytest.approx(-1)


def test_a_waypoint_weighs_the_rotation_vector(formulated: Formulated) -> None:
    """100 |log(R_wanted^T R)|^2, of the whole orientation, where it gives an angle, and a bound where it says so."""
    lines = SOMERSAULT.replace("4.0}}", "4.0}, tolerance: {configuration: {root_joint.roll: 0.2}}}")
    motion = formulated(lines)
    waypoint = constraint(motion, "waypoint 2")
    assert (waypoint.row_names, list(waypoint.upper)) == (["root_joint.roll"], [0.2])
    x = np.zeros(waypoint.variables.numel())
    vector = np.array([0.1, -0.2, 0.3])
    x[3:7] = (pin.Quaternion(turn(0, 4.0, 0)) * pin.Quaternion(pin.exp3(vector))).coeffs()
    assert costs(waypoint, x) == pytest.approx({"waypoint 2": 100 * vector @ vector})


def test_an_apex_turns_on_and_back(formulated: Formulated) -> None:
    """In the middle of a jump the orientation is the apex', before and after it that of the line."""
    motion = formulated(
        START
        + GOAL
        + "reference: {type: jumps, count: 2, stance: 0, apex: {root_joint.z: 1.5, root_joint.roll: -0.4}}\n"
    )
    np.testing.assert_allclose(angles_at(motion, 0.0), [0.2, -0.1, 0], atol=1e-12)
    np.testing.assert_allclose(angles_at(motion, 0.5), roll_pitch_yaw(motion.reference.configuration(0.5)[3:]))
    first, middle = (pin.Quaternion(turn(0.2, -0.1, yaw)).toRotationMatrix() for yaw in (0, 0.5))
    quarter = first @ pin.exp3(pin.log3(first.T @ middle) / 4)
    at_apex = pin.Quaternion(turn(-0.4, -0.1, 0)).toRotationMatrix()
    found = pin.Quaternion(motion.reference.configuration(0.25)[3:]).toRotationMatrix()
    np.testing.assert_allclose(found, quarter @ first.T @ at_apex, atol=1e-12)
    np.testing.assert_allclose(angles_at(motion, 1.0), [0.2, -0.1, 0.5], atol=1e-12)
    assert motion.reference.configuration(0.25)[2] == pytest.approx(1.5)


def test_a_file_may_give_angles_or_quaternions(formulated: Formulated, tmp_path: Path) -> None:
    """Roll, pitch and yaw stand for a quaternion; quaternions of either sign follow on each other from the start."""
    head = "time,root_joint.x,root_joint.y,root_joint.z,"
    angles = head + "root_joint.roll,root_joint.pitch,root_joint.yaw\n0,0,0,1,0.2,-0.1,0\n1,0,0,1,0.2,-0.1,1\n"
    signs = zip((0, 1), (-turn(0.2, -0.1, 0), turn(0.2, -0.1, 1)), strict=True)
    rows = "".join(f"{time},0,0,1,{','.join(map(str, q))}\n" for time, q in signs)
    quaternions = head + ",".join(f"root_joint.q{axis}" for axis in "xyzw") + "\n" + rows
    for content in (angles, quaternions):
        (tmp_path / "motion.csv").write_text(content, encoding="utf-8")
        motion = formulated(START + GOAL + "reference: {type: file, path: motion.csv}\n")
        start = motion.endpoints.initial_configuration
        np.testing.assert_allclose(motion.reference.configuration(0.0), start, atol=1e-12)
        np.testing.assert_allclose(motion.reference.configuration(1.0)[3:], turn(0.2, -0.1, 1), atol=1e-12)


def test_limits_of_angles_are_those_of_the_angles(formulated: Formulated) -> None:
    """Rows are the sine of the pitch, and roll and yaw from the middle of their limits, for any orientation."""
    limits = {"root_joint.roll": (-0.4, 1.2), "root_joint.pitch": (-np.inf, 0.3), "root_joint.yaw": (-1.0, 5.0)}
    lines = (
        "limits: {position: {root_joint.roll: [-0.4, 1.2], root_joint.pitch: [null, 0.3], root_joint.yaw: [-1, 5]}}\n"
    )
    motion = formulated(START + GOAL + lines)
    found = constraint(motion, "angle limits")
    assert found.kind == "path" and list(found.intervals) == [0, 1, 2, 3]
    bounds = dict(zip(found.row_names, zip(found.lower, found.upper, strict=True), strict=True))
    assert bounds["limit of root_joint.pitch"] == pytest.approx((-1.0, np.sin(0.3)))
    assert bounds["limit of root_joint.roll"] == pytest.approx((-0.8, 0.8))
    for roll, pitch, yaw in np.random.default_rng(2).uniform(-1, 1, (20, 3)) * [3.1, 1.5, 3.1]:
        x = np.zeros(found.variables.numel())
        x[3:7] = 1.3 * turn(roll, pitch, yaw)
        values = dict(zip(limits, [roll, pitch, yaw], strict=True))
        inside = {
            f"limit of {name}": bool(low <= low + np.remainder(values[name] - low, 2 * np.pi) <= high)
            if np.isfinite(low)
            else bool(values[name] <= high)
            for name, (low, high) in limits.items()
        }
        held = zip(found.row_names, found.lower, rows(found, x), found.upper, strict=True)
        assert {name: bool(low <= value <= high) for name, low, value, high in held} == inside


QUATERNION = "root_joint.qx: 0, root_joint.qy: 0, root_joint.qz: 0, root_joint.qw: "
FAULTS = [
    (f"goal: {{configuration: {{{QUATERNION}1, root_joint.yaw: 1}}}}", "goal.configuration.root_joint.yaw", "not both"),
    (
        "goal: {configuration: {root_joint.qz: 0.6, root_joint.qw: 0.8}}",
        "goal.configuration.root_joint.qz",
        "found a quaternion without root_joint.qx and root_joint.qy, expected all of root_joint.qx",
    ),
    (f"initial: {{configuration: {{{QUATERNION}0}}}}", "initial.configuration.root_joint.qx", "of norm 0, expected"),
    (f"postures: {{p: {{{QUATERNION}0.9}}}}", "postures.p.root_joint.qx", "of norm 0.9, expected one of norm 1"),
    ("reference: {type: jumps, count: 1, apex: {root_joint.qz: 1}}", "reference.apex.root_joint.qz", "without"),
    ("waypoints: [{configuration: {root_joint.qw: 1}}]", "waypoints.0.configuration.root_joint.qw", "without"),
    (
        "costs: {configuration: {root_joint.qx: 3}}",
        "costs.configuration.root_joint.qx",
        "a part of a quaternion, expected",
    ),
    (
        "goal: {configuration: {root_joint.yaw: 1}, tolerance: {configuration: {root_joint.qz: 0.1}}}",
        "goal.tolerance.configuration.root_joint.qz",
        "expected root_joint.roll, root_joint.pitch and root_joint.yaw",
    ),
    ("limits: {position: {root_joint.qz: [-1, 1]}}", "limits.position.root_joint.qz", "a part of a quaternion"),
    ("limits: {position: {root_joint.pitch: [-2, 1]}}", "limits.position.root_joint.pitch", "beyond a right angle"),
    ("limits: {position: {root_joint.yaw: [null, 1]}}", "limits.position.root_joint.yaw", "less than 6.28319 apart"),
    ("limits: {position: {root_joint.yaw: [-4, 4]}}", "limits.position.root_joint.yaw", "less than 6.28319 apart"),
    (
        "goal: {configuration: {root_joint.yaw: 45}}",
        "goal.configuration.root_joint.yaw",
        "found 45, expected a value in [-6.28319, 6.28319], one turn in rad (45 degrees are 0.785398 rad)",
    ),
    (
        "goal: {configuration: {root_joint.yaww: 1}}",
        "goal.configuration.root_joint.yaww",
        "did you mean 'root_joint.yaw'?",
    ),
    (
        "initial: {stand_on: {contacts: [corner], adjust: [root_joint.pitch]}}",
        "initial.stand_on.adjust.0",
        "which changes together with others",
    ),
    (
        "goal: {periodic: {stride: {root_joint.yaw: 1}}}",
        "goal.periodic",
        "found a robot with joints whose configuration",
    ),
]


@pytest.mark.parametrize(("line", "key", "fragment"), FAULTS, ids=[fault[1] for fault in FAULTS])
def test_faults_are_located(formulated: Formulated, line: str, key: str, fragment: str) -> None:
    """What is wrong with an orientation is said in one sentence with file, line and key."""
    with pytest.raises(TaskError) as caught:
        formulated(line + "\n")
    error = caught.value
    assert (error.key, error.line) == (key, BOX.count("\n") + 2), str(error)
    assert fragment in error.message and error.file is not None
    assert "more error" not in error.message


def test_a_start_outside_the_limits_of_an_angle_is_located(formulated: Formulated) -> None:
    """Whichever way it is written: the neutral orientation, which nothing mentions, has no roll."""
    with pytest.raises(TaskError, match="found limits that the initial angle is outside of") as caught:
        formulated("initial: {configuration: {root_joint.z: 1}}\nlimits: {position: {root_joint.roll: [0.1, 1]}}\n")
    assert caught.value.key == "limits.position.root_joint.roll"
    with pytest.raises(TaskError, match=r"found 0\.2, expected .*, the limits in limits\.position"):
        formulated(START + "limits: {position: {root_joint.roll: [-0.1, 0.1]}}\n")
