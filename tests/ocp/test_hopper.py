"""The hopper benchmark of the literature, number by number."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import StepOptions
from fesd_robot.errors import OptionError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_five_jumps.yaml"
STATE = ["root_x", "root_z", "root_pitch", "leg"]


def published_reference(time: float, *, jump: int | None = None) -> np.ndarray:
    """x linear, y = 0.5 + 2 s (1 - s), r = 0.5 - 1.6 s (1 - s), theta = 0; one jump a second."""
    s = time - (min(int(time + 1e-9), 4) if jump is None else jump)
    return np.array([0.1 + 4.9 * time / 5, 0.5 + 2 * s * (1 - s), 0.0, 0.5 - 1.6 * s * (1 - s)])


def test_names_and_their_order(hopper: MotionProblem) -> None:
    """State is (q, v, clock, gap), control is (torque, leg force, speed of time)."""
    system = hopper.ocp.system
    velocities = [f"{name} velocity" for name in STATE]
    assert list(system.state_names) == [*STATE, *velocities, "clock", "foot integrated gap"]
    assert list(system.control_names) == ["reaction_torque", "leg_force", "speed of time"]
    assert hopper.actuation.units == ["N m", "N"]


def test_horizon_and_scheme(hopper: MotionProblem) -> None:
    """Five seconds, 50 intervals, three elements of two-stage Radau IIA, mean step equilibration."""
    assert (hopper.ocp.duration, hopper.ocp.intervals) == (5.0, 50)
    assert (hopper.fesd.tableau.scheme, hopper.fesd.tableau.stages, hopper.fesd.elements) == ("radau_iia", 2, 3)
    assert (hopper.fesd.step_equilibration, hopper.fesd.equilibration_weight) == ("mean", 1.0)


def test_reference_at_interval_ends(hopper: MotionProblem) -> None:
    """Every interval compares with the five published arcs at its end, and ends when the clock says so."""
    ends = 0.1 * np.arange(1, 51)
    expected = np.array([published_reference(end) for end in ends]).T
    np.testing.assert_allclose(hopper.ocp.parameters[:5], np.vstack([expected, ends]), atol=1e-9)


def test_clock_is_held_at_interval_ends(hopper: MotionProblem) -> None:
    """The one constraint at an interval's end is clock = kT/N."""
    ocp = hopper.ocp
    end = ca.Function("end", [ocp.system.state, ocp.system.parameters], [ocp.interval_end])
    x, p = np.random.default_rng(0).normal(size=10), np.arange(float(ocp.system.parameters.numel()))
    assert ocp.interval_end_names == ("clock",)
    assert float(end(x, p)) == pytest.approx(x[8] - p[4], abs=1e-15)


def test_control_matrix(hopper: MotionProblem) -> None:
    """B(q) = [0 -sin; 0 cos; 1 0; 0 1] at any configuration."""
    for q in np.random.default_rng(1).normal(size=(10, 4)):
        expected = [[0, -np.sin(q[2])], [0, np.cos(q[2])], [1, 0], [0, 1]]
        np.testing.assert_allclose(np.asarray(hopper.actuation.matrix(q)), expected, atol=1e-15)


def test_mass_matrix_force_and_contact(hopper: MotionProblem) -> None:
    """M = diag(1.1, 1.1, 0.275, 0.1), force = B u - gravity, gap = y - r cos, n and t the foot's derivatives."""
    dynamics, contact = hopper.dynamics, hopper.contacts[0]
    symbols = [dynamics.configuration, dynamics.velocity, dynamics.control]
    parts = [dynamics.mass_matrix, dynamics.force, contact.gap, contact.normal, contact.tangents]
    model = ca.Function("model", symbols, parts)
    rng = np.random.default_rng(2)
    for _ in range(10):
        q, v, u = rng.normal(size=4), rng.normal(size=4), rng.normal(size=2)
        mass, force, gap, normal, tangent = (np.asarray(ca.DM(part).full()).squeeze() for part in model(q, v, u))
        sin, cos, r = np.sin(q[2]), np.cos(q[2]), q[3]
        np.testing.assert_allclose(mass, np.diag([1.1, 1.1, 0.275, 0.1]), atol=1e-14)
        expected = [-sin * u[1], cos * u[1] - 1.1 * 9.81, u[0], u[1]]
        np.testing.assert_allclose(force, expected, atol=1e-12)
        np.testing.assert_allclose(gap, q[1] - r * cos, atol=1e-14)
        np.testing.assert_allclose(normal, [0, 1, r * sin, -cos], atol=1e-14)
        np.testing.assert_allclose(tangent, [1, 0, r * cos, sin], atol=1e-14)
    assert contact.friction == 0.45


def test_bounds(hopper: MotionProblem) -> None:
    """States, controls and the speed of time are bounded as published; the goal is not a constraint."""
    ocp = hopper.ocp
    pi, infinity = np.pi, np.inf
    np.testing.assert_allclose(ocp.state_lower, [0, 0, -pi, 0.1, -10, -10, -5, -5, -infinity, 0])
    np.testing.assert_allclose(ocp.state_upper, [5.1, 1.5, pi, 0.5, 10, 10, 5, 5, infinity, infinity])
    np.testing.assert_allclose(ocp.control_lower, [-50, -50, 0.1])
    np.testing.assert_allclose(ocp.control_upper, [50, 50, 20])
    assert np.all(ocp.terminal_lower == -infinity) and np.all(ocp.terminal_upper == infinity)


def test_initial_state(hopper: MotionProblem) -> None:
    """The motion starts at rest on the ground at time 0."""
    start = [0.1, 0.5, 0, 0.5, 0, 0, 0, 0, 0, 0]
    np.testing.assert_array_equal(hopper.ocp.initial_lower, start)
    np.testing.assert_array_equal(hopper.ocp.initial_upper, start)


def test_running_cost(hopper: MotionProblem) -> None:
    """Deviation, speed and control are weighted as published, per second of physical time."""
    ocp = hopper.ocp
    terms = ca.Function("terms", ocp.system.arguments, list(ocp.running_cost.values()))
    theta = ca.Function("theta", [ocp.system.algebraic], [hopper.contact_system.theta_ode])
    rng = np.random.default_rng(3)
    for _ in range(10):
        x, u, p = rng.normal(size=10), rng.normal(size=3), rng.normal(size=5)
        z = rng.uniform(0, 0.5, size=ocp.system.algebraic.numel())
        rate = float(theta(z)) * u[2]
        expected = {
            "configuration": rate * np.array([100, 100, 20, 50]) @ (x[:4] - p[:4]) ** 2,
            "velocity": rate * 0.1 * x[4:8] @ x[4:8],
            "control": rate * 0.01 * u[:2] @ u[:2],
        }
        values = dict(zip(ocp.running_cost, map(float, terms(x, u, z, np.append(p, hopper.parts.values))), strict=True))
        assert values == pytest.approx(expected, rel=1e-12)


def test_terminal_cost(hopper: MotionProblem) -> None:
    """The end is compared with (5, 0.5, 0, 0.5) at rest, weights 300 and 0.1."""
    ocp = hopper.ocp
    terms = ca.Function("terms", [ocp.system.state, ocp.system.parameters], list(ocp.terminal_cost.values()))
    p = np.append(np.zeros(5), hopper.parts.values)
    for x in np.random.default_rng(4).normal(size=(10, 10)):
        expected = {
            "terminal configuration": 300 * np.sum((x[:4] - [5, 0.5, 0, 0.5]) ** 2),
            "terminal velocity": 0.1 * x[4:8] @ x[4:8],
        }
        assert dict(zip(ocp.terminal_cost, map(float, terms(x, p)), strict=True)) == pytest.approx(expected, rel=1e-12)


def test_auxiliary_force(hopper: MotionProblem) -> None:
    """The task's a_n is used as written; 'auto' is ten times the weight."""
    automatic = formulate(load_task(TASK, ["method.grid=uniform", "method.auxiliary_force=auto"]))
    assert hopper.auxiliary_force == 100.0
    assert automatic.auxiliary_force == pytest.approx(10 * 1.1 * 9.81, rel=1e-12)


def test_start_follows_the_reference(hopper: MotionProblem) -> None:
    """The initial guess is the reference with its own derivative, the clock, and the true gap."""
    guess, step = hopper.ocp.state_guess, 1e-4
    for time in np.linspace(0.03, 4.97, 29):
        jump = int(time)
        x = guess(time)
        ahead, behind = published_reference(time + step, jump=jump), published_reference(time - step, jump=jump)
        np.testing.assert_allclose(x[:4], published_reference(time), atol=1e-9)
        np.testing.assert_allclose(x[4:8], (ahead - behind) / (2 * step), atol=1e-4)
        assert x[8] == time
        assert x[9] == pytest.approx(x[1] - x[3] * np.cos(x[2]), abs=1e-12)


@pytest.mark.parametrize(("time", "rise"), [(0.0, 2.0), (1.0, 2.0), (4.0, 2.0), (5.0, -2.0)])
def test_reference_velocity_at_its_kinks(hopper: MotionProblem, time: float, rise: float) -> None:
    """At a take-off the velocity is that of the jump that begins, at the end that of the last one."""
    assert hopper.reference.velocity(time)[1] == pytest.approx(rise, abs=1e-3)


def test_control_guess(hopper: MotionProblem) -> None:
    """The controls start at zero with time passing at its own pace."""
    np.testing.assert_array_equal(hopper.ocp.control_guess, np.tile([0.0, 0.0, 1.0], (50, 1)).T)


@pytest.mark.parametrize("kind", ["multipliers", "steps"])
def test_gap_state_follows_the_formulation(kind: str) -> None:
    """Both forms of the contact logic give the same state; a true gap has no state."""
    task = load_task(TASK, ["method.grid=uniform", f"method.formulation.type={kind}"])
    assert formulate(task).ocp.system.state.numel() == 10
    true_gap = StepOptions(gap="true")
    if kind == "steps":
        assert formulate(task, steps=true_gap).ocp.system.state.numel() == 9
    else:
        with pytest.raises(OptionError, match="needs the form 'steps'"):
            formulate(task, steps=true_gap)
