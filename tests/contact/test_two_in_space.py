"""Contacts between two bodies in space: their expressions against Pinocchio's kinematics and against derivatives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import load_task
from fesd_robot.contact.two_in_space import Facing, axes_about, tangents_at
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import numeric_physics
from tests.bodies_in_space import BALL, written

FACINGS: list[Facing] = ["x", "-x", "y", "-y", "z", "-z"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> MotionProblem:
    """A ball beside another one and a box, all of them free."""
    task = written(
        tmp_path_factory.mktemp("scene"),
        BALL,
        "robot: {model: model.urdf, root: free_flyer}\n"
        "bodies:\n"
        "  other: {type: ball, radius: 0.15, mass: 0.8, root: free_flyer}\n"
        "  crate: {type: box, size: [0.2, 0.3, 0.16], mass: 0.7, root: free_flyer}\n"
        "contacts:\n"
        "  balls: {type: circle_circle, frame: ball, radius: 0.1, other_frame: other, friction: 0.4}\n"
        "  side: {type: circle_box, frame: ball, radius: 0.1, other_frame: crate, friction: 0.4}\n"
        "  floor: {body: crate}\n"
        "horizon: {duration: 1, intervals: 4}\n"
        "initial: {configuration: {root_joint.x: 0.4, root_joint.z: 0.1, other.root_joint.y: 0.6, "
        "other.root_joint.z: 0.3, crate.root_joint.z: 0.08}}\n"
        "goal: {soft: true}\n",
    )
    return formulate(load_task(task, ["method.grid=uniform"]), driven=False)


def test_a_body_in_space_touches_with_the_corners_below(scene: MotionProblem) -> None:
    """A box that lies flat has four places, those of its lower corners."""
    places = [scene.task.contacts[f"floor_{number}"].offset for number in (1, 2, 3, 4)]
    assert sorted(places) == [(x, y, -0.08) for x in (-0.1, 0.1) for y in (-0.15, 0.15)]


def test_sizes_are_those_of_the_bodies(scene: MotionProblem) -> None:
    """A contact that says no size of the other body has that of the task, and faces the axis next to its normal."""
    balls, side = (scene.scene.geometries[name] for name in ("balls", "side"))
    assert (balls.other_radius, balls.facing) == (0.15, "-y")
    assert (side.other_size, side.facing) == ((0.2, 0.3, 0.16), "x")


@pytest.mark.parametrize("seed", range(6))
def test_expressions_agree_with_pinocchio_and_with_derivatives(scene: MotionProblem, seed: int) -> None:
    """Gaps and Jacobians are those of Pinocchio's kinematics to round-off, and J_n v is the rate of the gap."""
    physics, model, rng = numeric_physics(scene), scene.robot.model, np.random.default_rng(seed)
    contacts = scene.contacts
    function = ca.Function(
        "contacts",
        [scene.dynamics.configuration],
        [ca.vertcat(*[c.gap for c in contacts]), ca.horzcat(*[ca.horzcat(c.normal, c.tangents) for c in contacts]).T],
    )
    q = pin.integrate(model, scene.endpoints.initial_configuration, 0.5 * rng.normal(size=model.nv))
    v, step = rng.normal(size=model.nv), 1e-6
    gaps, jacobian = (np.array(value) for value in function(q))
    np.testing.assert_allclose(gaps.ravel(), physics.gaps(q), atol=1e-14)
    np.testing.assert_allclose(jacobian, physics.contact_jacobian(q), atol=1e-13)
    ahead, behind = (physics.gaps(pin.integrate(model, q, sign * step * v)) for sign in (1, -1))
    np.testing.assert_allclose(jacobian[::3] @ v, (ahead - behind) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("which", [0, 1], ids=["balls", "side"])
@pytest.mark.parametrize("seed", range(3))
def test_a_common_motion_moves_no_closed_contact(scene: MotionProblem, which: int, seed: int) -> None:
    """If all bodies move as one, nothing slides and no gap changes: the forces on the two bodies are opposite."""
    physics, robot, rng = numeric_physics(scene), scene.robot, np.random.default_rng(seed)
    model, data = robot.model, robot.model.createData()
    q = pin.integrate(model, scene.endpoints.initial_configuration, 0.3 * rng.normal(size=model.nv))
    q[:3] -= physics.gaps(q)[which] * physics.contact_axes(q)[which, 0]
    assert physics.gaps(q)[which] == pytest.approx(0.0, abs=1e-12)
    pin.forwardKinematics(model, data, q)
    twist, v = pin.Motion(rng.normal(size=6)), np.zeros(model.nv)
    for joint in range(1, model.njoints):
        v[model.joints[joint].idx_v :][:6] = data.oMi[joint].actInv(twist).vector
    np.testing.assert_allclose((physics.contact_jacobian(q) @ v)[3 * which :][:3], np.zeros(3), atol=1e-12)


@pytest.mark.parametrize("facing", FACINGS)
def test_tangents_are_orthonormal_and_smooth(facing: Facing) -> None:
    """With the normal they are a right-handed frame, also across from the axis; on the axis they are its own."""
    normal = ca.SX.sym("n", 3)
    function = ca.Function("tangents", [normal], list(tangents_at(normal, facing)))
    first = axes_about(facing)[:, 0]
    for sample in np.random.default_rng(3).normal(size=(20, 3)):
        unit = sample / np.linalg.norm(sample)
        if unit @ first > -0.9:
            frame = np.column_stack([unit, *(np.array(tangent).ravel() for tangent in function(unit))])
            np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-13)
            assert np.linalg.det(frame) == pytest.approx(1.0)
    on_axis = np.column_stack([np.array(tangent).ravel() for tangent in function(first)])
    np.testing.assert_allclose(on_axis, axes_about(facing)[:, 1:], atol=1e-15)


def test_seen_from_the_side_the_first_tangent_is_that_of_the_plane() -> None:
    """For normals in the x-z plane t_1 = (n_z, 0, -n_x) and t_2 = y, so the plane is a special case."""
    normal = ca.SX.sym("n", 3)
    for facing in ("x", "-x", "z", "-z"):
        function = ca.Function("tangents", [normal], list(tangents_at(normal, facing)))
        for angle in np.linspace(-1.2, 1.2, 7):
            a, b, _ = axes_about(facing).T
            n = np.cos(angle) * a + np.sin(angle) * b
            along, across = (np.array(tangent).ravel() for tangent in function(n))
            np.testing.assert_allclose(along, [n[2], 0, -n[0]], atol=1e-14)
            np.testing.assert_allclose(across, [0, 1, 0], atol=1e-14)
