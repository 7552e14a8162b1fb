"""Impacts in space: the planar law in a plane of any direction, and an independent integration of the law."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import PointOnSurface, Scene
from fesd_robot.contact.ground import Plane
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.impacts import impact
from fesd_robot.robot import load_robot
from tests.bodies_in_space import box
from tests.replay.bodies import body

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
