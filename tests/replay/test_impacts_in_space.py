"""Impacts in space: the planar law in a plane of any direction, and an independent integration of the law."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import ContactMode, PointOnSurface, Scene
from fesd_robot.contact.ground import Plane
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.contacts import ContactLaw, Contacts, ReplayNote
from fesd_robot.replay.impacts import impact
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.robot import load_robot
from tests.bodies_in_space import BOX_SIDES, box
from tests.replay.bodies import ROD_LENGTH, body, rod

FRICTION = 0.35
ARM = np.array([0.1, 0.15, -0.08])  # of corner c6, m


def tumbling(restitution: float = 0.0) -> NumericPhysics:
    """A free box whose corner c6 may touch the floor."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "box.urdf"
        file.write_text(box(), encoding="utf-8")
        robot = load_robot(file, root="free_flyer")
    plane = Plane()
    scene = Scene({"ground": plane}, {"c6": PointOnSurface("c6", plane)})
    bouncing = {"c6": restitution}
    return NumericPhysics(
        robot, scene, {"c6": FRICTION}, lambda _: np.zeros((6, 0)), in_space=True, restitution=bouncing
    )


def slender(friction: float) -> NumericPhysics:
    """The rod of the plane in space, free, with its tip as the contact."""
    plane = Plane()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "rod.urdf"
        file.write_text(
            "<robot name='rod'><link name='rod'><inertial><mass value='1'/><inertia ixx='1e-3' "
            f"iyy='{ROD_LENGTH**2 / 12}' izz='{ROD_LENGTH**2 / 12}' ixy='0' ixz='0' iyz='0'/></inertial></link>"
            "<link name='tip'/><joint name='tip' type='fixed'><parent link='rod'/><child link='tip'/>"
            f"<origin xyz='{-ROD_LENGTH / 2} 0 0'/></joint></robot>",
            encoding="utf-8",
        )
        robot = load_robot(file, root="free_flyer")
    scene = Scene({"ground": plane}, {"tip": PointOnSurface("tip", plane)})
    return NumericPhysics(robot, scene, {"tip": friction}, lambda _: np.zeros((6, 0)), in_space=True)


def on_a_face(friction: float) -> NumericPhysics:
    """A free box whose four lower corners may touch the floor."""
    names, plane = ("c0", "c2", "c4", "c6"), Plane()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "box.urdf"
        file.write_text(box(), encoding="utf-8")
        robot = load_robot(file, root="free_flyer")
    scene = Scene({"ground": plane}, {name: PointOnSurface(name, plane) for name in names})
    return NumericPhysics(robot, scene, dict.fromkeys(names, friction), lambda _: np.zeros((6, 0)), in_space=True)


FLYING = Contacts((ContactMode.FLIGHT,) * 4, np.zeros(4, dtype=bool), np.zeros(4), (), np.zeros((4, 2)), np.zeros(0))


@pytest.mark.slow
def test_a_face_that_is_level_but_for_what_is_at_once_hits_as_a_level_one() -> None:
    """Corners whose heights differ by less than 1e-8 m meet the floor together: the impact ends, in the velocity of the
    same box without a tilt to 1e-8."""
    physics, random, law = on_a_face(0.9), np.random.default_rng(0), ContactLaw(on_a_face(0.9), np.zeros(0))
    for _ in range(5):
        tilt, along = random.uniform(-5e-8, 5e-8, 2), random.uniform(-0.3, 0.3, 2)
        v = np.array([*along, -1.0, *random.uniform(-2, 2, 3)])
        level, tilted = (np.array([0, 0, BOX_SIDES[2] / 2, x / 2, y / 2, 0, 1]) for x, y in ((0.0, 0.0), tilt))
        assert 1e-9 < np.ptp(physics.gaps(tilted)) < 2e-8
        (_, one), (_, other) = (law.hit(FLYING, np.ones(4, dtype=bool), q, v) for q in (level, tilted))
        assert not law.notes
        np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("direction", [0.0, 0.5])
def test_a_jammed_slide_in_space_goes_on_as_in_the_plane(direction: float) -> None:
    """A slender rod that slides on its tip with mu = 2 until its force is infinite, in any direction, moves as the same
    rod in the plane, whose impact without a collision ends the slide."""
    planar, angle, turn = rod(2.0), 0.5, pin.rpy.rpyToMatrix(0, 0, direction)
    q, v = np.array([0, 0.6 * math.sin(angle), -angle]), np.array([0.0, 0.0, -4.0])
    normal, along = planar.contact_jacobian(q) @ v
    v[:2] = -3.0 - along, -normal
    expected = replay_motion(planar, q, v, np.zeros(3), 0.3)
    attitude = turn @ pin.rpy.rpyToMatrix(0, -angle, 0)
    start = np.array([0, 0, q[1], *pin.Quaternion(attitude).coeffs()])
    twist = np.concatenate([attitude.T @ turn @ [v[0], 0, v[1]], [0, v[2], 0]])
    found = replay_motion(slender(2.0), start, twist, np.zeros(0), 0.3)
    assert found.notes == expected.notes == {ReplayNote.NO_MODE}
    x, z = expected.configuration[:2]
    np.testing.assert_allclose(found.configuration[:3], turn @ [x, 0, z], atol=1e-4)
    np.testing.assert_allclose(found.velocity[4], expected.velocity[2], atol=1e-3)


class Feet(NumericPhysics):
    """Three feet of a body with nine coordinates and random inertia, whose contact Jacobian is the unit matrix.

    The first foot stands still, the second slides, and the third hits the ground.
    """

    rows, impacts_at_once = 3, False

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        jacobian, shape = random.normal(size=(9, 9)), random.normal(size=(9, 9))
        to_feet = np.linalg.inv(jacobian)
        self._mass = to_feet.T @ (shape @ shape.T / 9 + 0.05 * np.eye(9)) @ to_feet
        self.friction, self.restitution = np.full(3, random.uniform(0.3, 1)), np.zeros(3)
        self.before = random.normal(size=9)
        self.before[:4], self.before[6] = 0.0, -3 * abs(self.before[6])

    def contact_jacobian(self, q: np.ndarray) -> np.ndarray:
        return np.eye(9)

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        return self._mass


@pytest.mark.parametrize("seed", [2, 35, 87, 101])
def test_impacts_of_three_feet_end_without_a_gain_of_energy(seed: int) -> None:
    """Whatever their inertia: forces leave their cones, slides begin and turn, feet part and come back, and in the end
    none approaches; no energy is gained, and impulses stay in their cones."""
    feet = Feet(seed)
    result = impact(feet, np.zeros(9), feet.before, np.ones(3, dtype=bool))
    assert result.finished
    assert result.velocity[::3].min() >= -1e-6
    mass = feet.mass_matrix(np.zeros(9))
    assert result.velocity @ mass @ result.velocity < feet.before @ mass @ feet.before
    sizes = np.linalg.norm(result.impulse[:, 1:], axis=1)
    assert (sizes <= feet.friction * result.impulse[:, 0] + 1e-7).all()


def test_a_corner_parts_as_newton_says_and_no_energy_is_gained() -> None:
    """v_n+ = -e v_n- of a corner that hits, less only where its force would do work over the whole impact; friction
    stays in its cone."""
    random, less = np.random.default_rng(7), 0
    for _ in range(40):
        restitution = random.uniform(0.2, 1.0)
        physics, quaternion = tumbling(restitution), random.normal(size=4)
        q = np.concatenate([[0, 0, 1], quaternion / np.linalg.norm(quaternion)])
        v = np.concatenate([random.uniform(-2, 2, 3), random.uniform(-8, 8, 3)])
        before = float((physics.contact_jacobian(q) @ v)[0])
        v, before = (v, before) if before < 0 else (-v, -before)
        result = impact(physics, q, v, np.array([True]))
        assert result.finished
        after, mass = float((physics.contact_jacobian(q) @ result.velocity)[0]), physics.mass_matrix(q)
        assert 0 < after <= -restitution * before + 1e-8
        less += after < -restitution * before - 1e-8
        assert result.velocity @ mass @ result.velocity <= v @ mass @ v * (1 + 1e-9)
        assert np.linalg.norm(result.impulse[0, 1:]) <= FRICTION * result.impulse[0, 0] + 1e-9
    assert less < 10


@pytest.mark.parametrize("seed", range(4))
def test_the_impulse_is_that_of_many_small_ones(seed: int) -> None:
    """With the normal impulse as time, Euler steps of 1/4000 of the impulse give the same to 1e-3 of it, and half the
    step half the difference."""
    random, physics = np.random.default_rng(seed), tumbling()
    quaternion = random.normal(size=4)
    q = np.concatenate([[0, 0, 1], quaternion / np.linalg.norm(quaternion)])
    v = np.concatenate([random.uniform(-1, 1, 2), [-1.5], random.uniform(-2, 2, 3)])
    jacobian = physics.contact_jacobian(q)
    if (jacobian @ v)[0] > -0.1:
        v[:3] = pin.Quaternion(q[3:]).toRotationMatrix().T @ np.array([0.5, 0.3, -2.0])
    result = impact(physics, q, v, np.array([True]))
    assert result.finished
    found = result.impulse[0]
    errors = [np.abs(_stepped(jacobian, physics.mass_matrix(q), v, steps) - found).max() for steps in (4000, 8000)]
    assert errors[0] <= 1e-3 * found[0]
    assert errors[1] <= 0.7 * errors[0] or errors[1] <= 1e-9
    assert np.linalg.norm(found[1:]) <= FRICTION * found[0] + 1e-12
    np.testing.assert_allclose(physics.mass_matrix(q) @ (result.velocity - v), jacobian.T @ found, atol=1e-12)


def _stepped(jacobian: np.ndarray, mass: np.ndarray, v: np.ndarray, steps: int) -> np.ndarray:
    """Return the impulse of equal normal impulses one after the other, each with the friction that would stop the
    corner, or the largest there is against its velocity."""
    compliance = jacobian @ np.linalg.solve(mass, jacobian.T)
    velocity, total = jacobian @ v, np.zeros(3)
    step = -velocity[0] / compliance[0, 0] / steps
    while velocity[0] < 0:
        stop = -np.linalg.solve(compliance[1:, 1:], velocity[1:] + step * compliance[1:, 0])
        if np.linalg.norm(stop) <= FRICTION * step:
            rate = np.array([step, *stop])
        else:
            rate = step * np.array([1.0, *(-FRICTION * velocity[1:] / np.linalg.norm(velocity[1:]))])
        part = min(1.0, -velocity[0] / max((compliance @ rate)[0], 1e-300))
        velocity, total = velocity + part * compliance @ rate, total + part * rate
        velocity[0] = 0.0 if part < 1 else velocity[0]
    return total


@pytest.mark.parametrize("speed", [2.0, 0.4, -1.0])
def test_in_a_plane_it_is_the_planar_law(speed: float) -> None:
    """A ball-like body that moves in the x-z plane has the impulses of the same body in the plane, none across."""
    planar = body(1.0, 0.02, {"foot": (0.05, -0.1)}, friction=FRICTION)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "body.urdf"
        file.write_text(
            "<robot name='b'><link name='b'><inertial><mass value='1'/><inertia ixx='0.02' iyy='0.02' izz='0.02' "
            "ixy='0' ixz='0' iyz='0'/></inertial></link><link name='foot'/><joint name='foot' type='fixed'>"
            "<parent link='b'/><child link='foot'/><origin xyz='0.05 0 -0.1'/></joint></robot>",
            encoding="utf-8",
        )
        robot = load_robot(file, root="free_flyer")
    plane = Plane()
    scene = Scene({"ground": plane}, {"foot": PointOnSurface("foot", plane)})
    spatial = NumericPhysics(robot, scene, {"foot": FRICTION}, lambda _: np.zeros((6, 0)), in_space=True)
    touching = np.array([True])
    one = impact(planar, np.array([0.0, 0.1, 0.0]), np.array([speed, -1.0, 0.5]), touching)
    other = impact(spatial, np.array([0.0, 0, 0.1, 0, 0, 0, 1]), np.array([speed, 0.0, -1.0, 0.0, 0.5, 0.0]), touching)
    np.testing.assert_allclose(other.impulse[0, :2], one.impulse[0], atol=1e-8)
    assert abs(other.impulse[0, 2]) <= 1e-9
