"""What a task leaves out, and what a robot cannot satisfy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.task import Task, load_task

Load = Callable[[str], Task]
TASKS = sorted((Path(__file__).parents[2] / "tasks").glob("*.yaml"))


def test_ten_lines_are_enough(short: str, load: Load) -> None:
    """Robot, contact, horizon, start and goal make a task; all else has a default."""
    problem = formulate(load(short))
    ocp = problem.ocp
    assert len(short.splitlines()) == 10
    np.testing.assert_array_equal(ocp.initial_lower, [0, 0.6, 0, 0.5, 0, 0, 0, 0, 0, 0.6 - 0.5])
    np.testing.assert_array_equal(problem.endpoints.goal_configuration, [1, 0.6, 0, 0.5])
    np.testing.assert_allclose(ocp.parameters[0], [0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(ocp.parameters[1], 0.6)
    assert problem.contacts[0].friction == 0.8


@pytest.mark.parametrize("path", TASKS, ids=lambda path: path.stem)
def test_every_shipped_task_fits_its_robot(path: Path) -> None:
    """Names, limits, ground files and start of every shipped task suit its robot."""
    problem = formulate(load_task(path, ["method.grid=uniform"]))
    assert list(problem.scene.geometries) == list(problem.task.contacts)
    assert [contact.name for contact in problem.contacts] == list(problem.task.contacts)


def test_joints_with_an_effort_limit_are_driven(short: str, load: Load) -> None:
    """Without actuators every joint with a positive effort limit is a control, bounded by it."""
    problem = formulate(load(short))
    actuation = problem.actuation
    assert (actuation.names, actuation.units) == (["root_pitch", "leg"], ["N m", "N"])
    np.testing.assert_array_equal([actuation.lower, actuation.upper], [[-50, -100], [50, 100]])
    np.testing.assert_array_equal(np.asarray(actuation.matrix(np.ones(4))), [[0, 0], [0, 0], [1, 0], [0, 1]])


def test_default_weights(short: str, load: Load) -> None:
    """The default weights of the completed task are those of the terms: per second on the way, once at the end."""
    problem = formulate(load(short))
    ocp, costs = problem.ocp, problem.task.costs
    running = ca.Function("running", ocp.system.arguments, list(ocp.running_cost.values()))
    terminal = ca.Function("terminal", [ocp.system.state, ocp.system.parameters], list(ocp.terminal_cost.values()))
    p = np.append(np.zeros(5), problem.parts.values)
    x, u = np.arange(10.0), np.array([2.0, 3.0, 1.0])
    q, v, to_goal = x[:4], x[4:8], x[:4] - [1, 0.6, 0, 0.5]

    def weighted(weights: Mapping[str, float] | None, values: np.ndarray) -> float:
        assert weights
        return float(np.array(list(weights.values())) @ values**2)

    flight = dict(zip(ocp.running_cost, map(float, running(x, u, [0, 0, 1], p)), strict=True))
    on_the_way = [weighted(costs.configuration, q), weighted(costs.velocity, v), weighted(costs.control, u[:2])]
    names = ["configuration", "velocity", "control", "slipping"]
    assert flight == pytest.approx(dict(zip(names, [*on_the_way, 0.0], strict=True)))
    at_end = [weighted(costs.terminal_configuration, to_goal), weighted(costs.terminal_velocity, v)]
    assert [float(term) for term in terminal(x, p)] == pytest.approx(at_end)


def test_weights_not_listed_are_zero(short: str, load: Load) -> None:
    """In a map of weights that is given, names left out have no weight."""
    problem = formulate(load(short + "costs:\n  terminal_configuration: {leg: 7}\n"))
    system, cost = problem.ocp.system, problem.ocp.terminal_cost["terminal configuration"]
    terminal = ca.Function("terminal", [system.state, system.parameters], [cost])
    assert float(terminal(np.full(10, 2.5), np.append(np.zeros(5), problem.parts.values))) == pytest.approx(7 * 2.0**2)


def test_goal_tolerance_becomes_terminal_bounds(short: str, load: Load) -> None:
    """Of a soft goal what has a tolerance is a hard constraint of that width, all else is free."""
    text = short + "  soft: true\n  tolerance: {configuration: {root_x: 0.01}, velocity: {leg: 0}}\n"
    ocp = formulate(load(text)).ocp
    lower, upper = np.full(10, -np.inf), np.full(10, np.inf)
    lower[[0, 7]], upper[[0, 7]] = [0.99, 0.0], [1.01, 0.0]
    np.testing.assert_array_equal(ocp.terminal_lower, lower)
    np.testing.assert_array_equal(ocp.terminal_upper, upper)


def test_limits_of_the_task_replace_the_models(short: str, load: Load) -> None:
    """A limit in the task stands in place of the model's, null lifts it, names left out keep the model's."""
    text = short + "limits: {position: {leg: [0.2, 0.5], root_x: [null, null]}, velocity: {leg: [-1, 2]}}\n"
    ocp = formulate(load(text)).ocp
    np.testing.assert_allclose(ocp.state_lower[:8], [-np.inf, 0, -np.pi, 0.2, -10, -10, -5, -1])
    np.testing.assert_allclose(ocp.state_upper[:8], [np.inf, 1.5, np.pi, 0.5, 10, 10, 5, 2])


def test_start_respects_velocity_limits(short: str, load: Load) -> None:
    """The initial guess never leaves the velocity limits, even if the reference is faster."""
    ocp = formulate(load(short + "  soft: true\nlimits: {velocity: {root_x: 0.25}}\n")).ocp
    assert ocp.state_guess(0.5)[4] == 0.25


def test_friction_of_a_contact_comes_before_the_grounds(short: str, load: Load) -> None:
    """A contact's own friction coefficient is used if it has one."""
    text = short.replace("{frame: foot}", "{frame: foot, friction: 0.3}") + "ground: {friction: 0.6}\n"
    assert formulate(load(text)).contacts[0].friction == 0.3


def test_sloped_ground(short: str, load: Load) -> None:
    """Gap and initial gap state are measured along the normal of a slope."""
    problem = formulate(load(short + "ground: {height: -0.2, slope: 0.2}\n"))
    gap = (0.6 - 0.5 + 0.2) * np.cos(0.2)
    assert problem.ocp.initial_lower[9] == pytest.approx(gap, abs=1e-12)


def test_armature_adds_to_the_mass_matrix(short: str, load: Load) -> None:
    """Armature of a joint is added to its diagonal entry; without it a leg that has no mass is refused."""
    dynamics = formulate(load(short)).dynamics
    mass = ca.Function("mass", [dynamics.configuration], [dynamics.mass_matrix])
    np.testing.assert_allclose(np.asarray(mass(np.ones(4)).full()), np.diag([1.1, 1.1, 0.275, 0.1]), atol=1e-14)


SOLO = """\
name: solo
robot:
  model: example-robot-data:solo12
  root: free_flyer
contacts:
  foot: {frame: FR_FOOT}
horizon: {duration: 1, intervals: 2}
"""


def test_a_foot_that_can_leave_the_plane_slips_in_two_directions(load: Load) -> None:
    """A robot that moves in three dimensions has contacts in space: J_t v is the foot's velocity along x and y."""
    motion = formulate(load(f"{SOLO}initial: {{configuration: {{root_joint.z: 0.5}}}}\n"))
    (contact,), dynamics = motion.contacts, motion.dynamics
    assert contact.in_space
    state = [dynamics.configuration, dynamics.velocity]
    velocities = ca.Function("slip", state, [ca.vertcat(*contact.tangential_velocities(dynamics.velocity))])
    q, v = pin.randomConfiguration(motion.robot.model), np.random.default_rng(2).normal(size=motion.robot.model.nv)
    model, data = motion.robot.model, motion.robot.model.createData()
    pin.forwardKinematics(model, data, q, v)
    frame = motion.robot.frame_id("FR_FOOT")
    expected = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
    np.testing.assert_allclose(np.asarray(velocities(q, v)).ravel(), expected[:2], atol=1e-9)


@pytest.mark.parametrize(
    ("contact", "words"),
    [
        ("{frame: FR_FOOT, slipping: 0.1}", "found 0.1 for a contact in space, expected 'allowed', 'forbidden'"),
    ],
)
def test_what_contacts_in_space_cannot_do_yet_is_refused(load: Load, contact: str, words: str) -> None:
    """A limit of the slip distance of a contact in space is an error at its key."""
    text = SOLO.replace("{frame: FR_FOOT}", contact)
    assert text != SOLO
    with pytest.raises(TaskError, match=words):
        formulate(load(text))


def test_a_joint_with_several_degrees_of_freedom_is_not_driven(load: Load) -> None:
    """A joint actuator on a floating root is an error that names the alternative."""
    text = SOLO.replace(
        "contacts:", "  actuators:\n    push: {type: joint, joint: root_joint, lower: -1, upper: 1}\ncontacts:"
    )
    with pytest.raises(TaskError, match="generalized_force") as caught:
        formulate(load(text))
    assert (caught.value.line, caught.value.key) == (6, "robot.actuators.push.joint")


def test_a_foot_that_stands_by_rounding_touches(short: str, load: Load) -> None:
    """A gap of a few micrometres at the start is zero there, and smaller by it elsewhere; a larger one stays."""
    near, far = (formulate(load(short.replace("root_z: 0.6", f"root_z: {0.5 + gap:.7f}"))) for gap in (4e-6, 4e-5))
    assert near.ocp.initial_lower[-1] == pytest.approx(0, abs=1e-15)
    assert far.ocp.initial_lower[-1] == pytest.approx(4e-5, rel=1e-6)
