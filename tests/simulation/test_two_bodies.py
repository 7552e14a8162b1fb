"""Bodies that touch each other in space: closed forms, and laws that no motion may break."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import Plan, load_task, simulate
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from tests.bodies_in_space import BALL, MASS, written

GRAVITY = 9.81
MASSES, RADII = (0.5, 0.8), (0.1, 0.15)


def thrown(folder: Path, friction: float, apart: np.ndarray, velocity: np.ndarray, *, restitution: float = 0.0) -> Plan:
    """Return the motion of a ball that is thrown at another one, both in free fall."""
    x, y, z = apart.tolist()
    start = f"root_joint.x: {x!r}, root_joint.y: {y!r}, root_joint.z: {z + 5!r}, other.root_joint.z: 5"
    speeds = ", ".join(f"root_joint.v{axis}: {value!r}" for axis, value in zip("xyz", velocity.tolist(), strict=True))
    task = written(
        folder,
        BALL,
        "robot: {model: model.urdf, root: free_flyer}\n"
        f"bodies: {{other: {{type: ball, radius: {RADII[1]}, mass: {MASSES[1]}, root: free_flyer}}}}\n"
        "contacts: {hit: {type: circle_circle, frame: ball, radius: 0.1, other_frame: other, "
        f"friction: {friction}, restitution: {restitution}}}}}\n"
        "horizon: {duration: 0.3, intervals: 3}\n"
        f"initial: {{configuration: {{{start}}}, velocity: {{{speeds}, root_joint.wy: 3, other.root_joint.wx: 2}}}}\n"
        "goal: {soft: true}\n",
    )
    return simulate(load_task(task))


@pytest.mark.parametrize("friction", [0.0, 0.02, 0.5], ids=["smooth", "slides", "sticks"])
@pytest.mark.parametrize(
    ("apart", "velocity"),
    [
        (np.array([0.5, 0.0, 0.0]), np.array([-2.0, 0.0, 0.0])),
        (np.array([0.5, 0.05, 0.02]), np.array([-2.0, 0.3, 0.2])),
        (np.array([0.0, -0.5, 0.02]), np.array([0.0, 2.0, 0.2])),
        (np.array([0.03, 0.05, 0.52]), np.array([0.1, 0.0, -2.0])),
    ],
    ids=["head-on", "askew", "from the side", "from above"],
)
def test_two_balls_collide_as_mechanics_says(
    tmp_path: Path, friction: float, apart: np.ndarray, velocity: np.ndarray
) -> None:
    """The impulse of two solid balls: all of the approach, and what friction does to their sliding, in any direction.

    With the centres' velocity u against each other, the normal n, and the velocity s of the surfaces over each other,
    L_n = -m u.n, and L_t = -2/7 m s if that is inside the cone, else of size mu L_n against s, where
    1/m = 1/m_1 + 1/m_2. (Normal and tangential velocities of balls do not depend on each other.)
    """
    motion = thrown(tmp_path, friction, apart, velocity)
    (impulse,) = motion.impulses
    reduced = 1 / sum(1 / mass for mass in MASSES)
    place = apart + impulse.time * velocity
    assert np.linalg.norm(place) == pytest.approx(sum(RADII), abs=1e-9)
    normal = place / np.linalg.norm(place)
    spin, other = np.array([0.0, 3.0, 0.0]), np.array([2.0, 0.0, 0.0])
    surface = velocity - np.cross(spin, RADII[0] * normal) - np.cross(other, RADII[1] * normal)
    approach, slide = velocity @ normal, surface - (surface @ normal) * normal
    sticking = 2 / 7 * reduced * np.linalg.norm(slide)
    size = min(sticking, -friction * reduced * approach)
    assert impulse.normal == pytest.approx(-reduced * approach, abs=1e-8)
    lateral = 0.0 if impulse.lateral is None else impulse.lateral
    assert np.hypot(impulse.tangential, lateral) == pytest.approx(size, abs=1e-8)
    total = -reduced * approach * normal - size * slide / np.linalg.norm(slide)
    after = [motion.trajectory.velocity[f"root_joint.v{axis}"][-1] for axis in "xyz"]
    turn = quaternion_matrix([motion.trajectory.configuration[f"root_joint.q{part}"][-1] for part in "xyzw"])
    expected = velocity + total / MASSES[0] + [0, 0, -GRAVITY * 0.3]
    np.testing.assert_allclose(turn @ after, expected, atol=1e-7)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_two_balls_bounce(tmp_path: Path, restitution: float) -> None:
    """Without friction they part with e times the velocity with which they met: L_n = -(1 + e) m u.n."""
    apart, velocity = np.array([0.5, 0.05, 0.02]), np.array([-2.0, 0.3, 0.2])
    motion = thrown(tmp_path, 0.0, apart, velocity, restitution=restitution)
    (impulse,) = motion.impulses
    normal = (apart + impulse.time * velocity) / sum(RADII)
    reduced = 1 / sum(1 / mass for mass in MASSES)
    assert impulse.normal == pytest.approx(-(1 + restitution) * reduced * (velocity @ normal), abs=1e-8)


def quaternion_matrix(entries: list[float]) -> np.ndarray:
    """Return the rotation of a quaternion x, y, z, w."""
    x, y, z, w = entries
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pushed_box(folder: Path, push: float, start: str = "") -> Plan:
    """Return the motion of a box on the floor that a round finger of 1 kg at its middle pushes along x."""
    task = written(
        folder,
        MASS,
        "robot: {model: model.urdf, locked: {z: 0.1}}\n"
        "bodies: {crate: {type: box, size: [0.2, 0.3, 0.2], mass: 2, root: free_flyer}}\n"
        "ground: {type: plane, friction: 0.3}\n"
        "contacts:\n"
        "  floor: {body: crate}\n"
        "  finger: {type: circle_box, frame: mass, radius: 0.05, other_frame: crate, friction: 0}\n"
        "horizon: {duration: 0.5, intervals: 2}\n"
        f"initial: {{configuration: {{x: -0.15, crate.root_joint.z: 0.1{start}}}}}\n"
        "goal: {soft: true}\n",
    )
    return simulate(load_task(task), {"x": push, "y": 0.0})


def test_a_finger_pushes_a_box_over_the_floor(tmp_path: Path) -> None:
    """A push through the middle moves both by (F - mu m g) / (M + m), and the contact carries the part of the box."""
    push, friction = 12.0, 0.3 * 2 * GRAVITY
    motion = pushed_box(tmp_path, push)
    acceleration = (push - friction) / 3
    distance = acceleration * 0.5**2 / 2
    assert motion.trajectory.configuration["x"][-1] == pytest.approx(-0.15 + distance, abs=1e-8)
    assert motion.trajectory.configuration["crate.root_joint.x"][-1] == pytest.approx(distance, abs=1e-8)
    finger = motion.contacts["finger"]
    assert finger.normal_force[-1] == pytest.approx(2 * acceleration + friction, abs=1e-6)
    assert motion.status.audit_passed


def test_a_push_beside_the_middle_turns_the_box_and_creates_no_energy(tmp_path: Path) -> None:
    """The box turns about the vertical as it is pushed, stays flat, and gains no more than the work of the push."""
    push = 12.0
    motion = pushed_box(tmp_path, push, ", y: 0.05")
    place, speed = motion.trajectory.configuration, motion.trajectory.velocity
    assert place["crate.root_joint.qz"][-1] < -1e-3
    np.testing.assert_allclose(place["crate.root_joint.z"], 0.1, atol=1e-8)
    physics = numeric_physics(formulate(load_task(tmp_path / "task.yaml"), driven=False))
    names = list(place), list(speed)
    q, v = np.column_stack([place[name] for name in names[0]]), np.column_stack([speed[name] for name in names[1]])
    energy = np.array([physics.energy(*state) for state in zip(q, v, strict=True)])
    spent = energy - push * (place["x"] - place["x"][0])
    assert np.diff(spent).max() <= 1e-7
    assert spent[-1] < spent[0] - 0.1
    assert motion.status.audit_passed
