"""An object that slides and turns on a table: its friction has one ellipsoid, and is against its slide."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from fesd_robot import Plan, load_task, simulate
from fesd_robot.complementarity import Branch
from fesd_robot.contact import Contact, ContactMode, MultibodyDynamics, joint_modes
from fesd_robot.errors import TaskError
from fesd_robot.fesd import Element
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.replay.dynamics import contact_dynamics
from fesd_robot.replay.joints import joints_in_motion
from tests.contact.test_joint_friction import FAR, driven

MODELS = Path(__file__).parents[2] / "models"

MASS, FORCE, LENGTH = 0.5, 2.0, 0.5
"""kg, N, m: a slider whose moment of inertia is m l^2 and whose largest torque is F l, for which all directions are
alike."""

EVEN = np.array([1.0, 1.0, LENGTH])


def slider() -> tuple[MultibodyDynamics, list[Contact]]:
    """M v' = u + tau of x, z and a turn, with a wall far to the left."""
    q, v, u = (ca.SX.sym(name, 3) for name in "qvu")
    names = ["x", "z", "turn"]
    dynamics = MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=v,
        mass_matrix=MASS * ca.diag(ca.DM(EVEN) ** 2),
        force=u,
        configuration_names=names,
        velocity_names=names,
        control_names=["push", "lift", "twist"],
        dry_friction=dict(zip(names, (FORCE * EVEN).tolist(), strict=True)),
        limit_surfaces={"base": names},
    )
    return dynamics, [Contact("wall", q[0] + FAR, ca.SX([1, 0, 0]), ca.SX(ca.DM.zeros(3)), 0.0)]


@cache
def stopping() -> tuple[PhysicalMotion, Branch, list[Element]]:
    """The slider thrown with 1.0 and -0.6 m/s and 1.6 rad/s, for a second."""
    return driven(*slider(), [0, 0, 0, 1.0, -0.6, 1.6], [0.0, 0.0, 0.0], 1.0)


def test_a_slider_stops_where_the_formula_says() -> None:
    """In scaled coordinates it goes straight on and stops after m |v| / F, in the planner's dynamics, to 1e-9."""
    motion, branch, _ = stopping()
    thrown = np.array([1.0, -0.6, 1.6])
    size = float(np.linalg.norm(EVEN * thrown))
    time = MASS * size / FORCE
    assert motion.joints is not None
    (stop,) = motion.joints.switches
    assert (stop.kind, stop.contact) == ("slip_to_stick", 0)
    assert stop.time == pytest.approx(time, abs=1e-9)
    np.testing.assert_allclose(motion.configuration[-1], thrown * time / 2, atol=1e-9)
    sliding = motion.time < time - 1e-9
    expected = np.tile(-FORCE * EVEN**2 * thrown / size, (sliding.sum(), 1))
    np.testing.assert_allclose(motion.joints.force[sliding], expected, atol=1e-8)
    assert joint_modes(branch, 0) == {"base": ContactMode.SLIP}
    assert joint_modes(branch, len(branch.factors) - 1) == {"base": ContactMode.STICK}


@pytest.mark.parametrize("push", [1.9, 2.5])
def test_a_push_moves_a_slider_only_beyond_its_surface(push: float) -> None:
    """Inside of the ellipsoid nothing moves; beyond it the slider accelerates with the rest, along the push."""
    direction = np.array([0.48, -0.6, 0.64])
    motion, _, _ = driven(*slider(), np.zeros(6), (push * EVEN * direction).tolist(), 0.5)
    gone = 0.5 * max(push - FORCE, 0.0) / MASS * 0.25 * direction
    np.testing.assert_allclose(motion.configuration[-1] * EVEN, gone, atol=1e-8)


TASK = f"""name: thrown
robot: {{model: {MODELS}/finger/finger.urdf}}
gravity: [0, 0, 0]
bodies:
  crate: {{type: box, size: [0.3, 0.1, 0.2], mass: 0.5, root: ROOT, limit_surface: {{force: 2, torque: 0.15}}}}
contacts: {{}}
horizon: {{duration: 1, intervals: 4}}
initial: {{configuration: {{tip_x: 3}}, velocity: {{VELOCITY}}}}
goal: {{soft: true}}
"""
INERTIAS, LIMITS = np.array([0.5, 0.5, 0.5 * (0.3**2 + 0.2**2) / 12]), np.array([2, 2, 0.15])


def thrown(folder: Path, velocity: str, root: str = "sagittal") -> Path:
    """Write the task of a crate that is thrown."""
    file = folder / "task.yaml"
    file.write_text(TASK.replace("VELOCITY", velocity).replace("ROOT", root), encoding="utf-8")
    return file


def slide(folder: Path) -> Plan:
    """Return the simulated motion of a crate that turns while it slides."""
    return simulate(load_task(thrown(folder, "crate.root_x: 1, crate.root_z: 0.5, crate.root_pitch: 4")))


def test_a_crate_slides_and_turns_to_a_stop(tmp_path: Path) -> None:
    """A simulation ends where the differential equation of the slide, integrated by other means, does."""
    scale = LIMITS / LIMITS[0]

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        speed = scale * y[3:]
        return np.concatenate([y[3:], -LIMITS * speed / np.linalg.norm(speed) / INERTIAS])

    def slow(_: float, y: np.ndarray) -> float:
        return float(np.linalg.norm(scale * y[3:])) - 1e-7

    slow.terminal = True  # type: ignore[attr-defined]
    path = solve_ivp(rate, (0, 1), [0, 0, 0, 1, 0.5, 4], method="LSODA", rtol=1e-11, atol=1e-13, events=slow)
    motion = slide(tmp_path)
    (stop,) = motion.joint_switches
    assert (stop.joint, stop.kind) == ("crate.root_x", "slip_to_stick")
    assert stop.time == pytest.approx(path.t[-1], abs=1e-6)
    names = ("crate.root_x", "crate.root_z", "crate.root_pitch")
    end = [motion.trajectory.configuration[name][-1] for name in names]
    np.testing.assert_allclose(end, path.y[:3, -1], atol=1e-7)
    lost = sum(motion.joint_friction[name].work for name in names)
    assert lost == pytest.approx(-0.5 * float(INERTIAS @ np.array([1, 0.5, 4]) ** 2), abs=1e-6)
    assert motion.audit.max_joint_friction_violation is not None and motion.audit.max_joint_friction_violation < 1e-9


@pytest.mark.parametrize("force", [(3.0, 0.0, 0.3), (-1.0, 2.0, -0.4), (0.0, 0.0, 0.2), (1.2, 1.2, 0.1)])
def test_a_crate_breaks_away_as_gauss_says(tmp_path: Path, force: tuple[float, float, float]) -> None:
    """At rest, and beyond its surface, it accelerates so that the constraint is least: the friction that takes most."""
    motion = formulate(load_task(thrown(tmp_path, ""), ["method.grid=uniform"]), driven=False)
    physics, start = numeric_physics(motion), motion.endpoints.initial_configuration
    dynamics = contact_dynamics(physics, start, np.zeros(5), np.zeros(2))
    rows = dynamics.joints.rows
    dynamics.acceleration[rows] += np.array(force) / INERTIAS
    found = joints_in_motion(dynamics, lambda _: np.zeros(0))
    accelerated = found.dynamics.acceleration[rows]

    def constraint(f: np.ndarray) -> float:
        return float(0.5 * ((force + LIMITS * f) ** 2 / INERTIAS).sum())

    inside = {"type": "ineq", "fun": lambda f: 1 - f @ f}
    least = minimize(constraint, np.zeros(3), constraints=[inside], method="SLSQP", options={"ftol": 1e-15})
    np.testing.assert_allclose(accelerated, (force + LIMITS * least.x) / INERTIAS, atol=2e-4)
    assert found.modes == ((ContactMode.SLIP,) * 3 if np.linalg.norm(force / LIMITS) > 1 else (ContactMode.STICK,) * 3)


@pytest.mark.parametrize(
    ("old", "new", "key", "fragment"),
    [
        ("root: sagittal", "root: free_flyer", "bodies.crate.limit_surface", "expected 'sagittal' or 'planar'"),
        ("force: 2, ", "", "bodies.crate.limit_surface.force", "this key is missing"),
        ("force: 2", "force: 0", "bodies.crate.limit_surface.force", "found 0, expected"),
        (
            "mass: 0.5",
            "mass: 0.5, dry_friction: {root_x: 1}",
            "bodies.crate.dry_friction.root_x",
            "expected one of them",
        ),
        ("torque: 0.15", "torque: 0.15, length: 1", "bodies.crate.limit_surface.length", "unknown key"),
        (
            "contacts: {}",
            "contacts: {tip: {frame: tip, rolling_friction: 0.1}}",
            "contacts.tip.rolling_friction",
            "dry_friction instead",
        ),
        (
            "contacts: {}",
            "contacts: {tip: {frame: tip, torsional_friction: 1}}",
            "contacts.tip.torsional_friction",
            "limit_surface instead",
        ),
    ],
)
def test_a_mistake_is_one_sentence(tmp_path: Path, old: str, new: str, key: str, fragment: str) -> None:
    """What cannot be under a body is named by file, line and key."""
    file = thrown(tmp_path, "")
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(TaskError, match=rf"task.yaml:\d+: {key}: .*{fragment}"):
        load_task(file)
