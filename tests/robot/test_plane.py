"""Robots with legs in the sagittal plane against the same robots in space with all their joints."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import frame_jacobian, load_robot, mass_matrix, nonlinear_effects
from fesd_robot.robot.units import configuration_units


class InSpace:
    """A planar state carried over to the robot in space: its q, v and dv/dt, and v's derivative by the planar v."""

    def __init__(self, legs, rng: np.random.Generator) -> None:
        plane, space, coupled = legs
        self.planar = [rng.uniform(-0.8, 0.8, plane.model.nq), *rng.normal(size=(2, plane.model.nv))]
        q, v, a = self.planar
        turn = pin.rpy.rpyToMatrix(0.0, q[2], 0.0)
        self.map = np.zeros((space.model.nv, plane.model.nv))
        self.map[:3, :2] = turn.T[:, [0, 2]]
        self.map[4, 2] = 1.0
        self.q, self.bias = pin.neutral(space.model), np.zeros(space.model.nv)
        self.q[[0, 2]] = q[:2]
        self.q[3:7] = pin.Quaternion(turn).coeffs()
        for row, name in enumerate(space.velocity_names[6:], start=6):
            leader = coupled.get(name, name)
            if leader in plane.velocity_names:
                column = plane.velocity_names.index(leader)
                self.map[row, column] = 1.0
                self.q[row + 1] = q[column]
        self.v = self.map @ v
        self.bias[:3] = -np.cross(self.v[3:6], self.v[:3])
        self.a = self.map @ a + self.bias


@pytest.fixture(scope="module")
def states(legs):
    """Three random planar states, in space."""
    rng = np.random.default_rng(5)
    return [InSpace(legs, rng) for _ in range(3)]


def test_energies_are_those_in_space(legs, states, assert_close):
    """Kinetic and potential energy agree with the robot that has a free root and all joints."""
    plane, space, _ = legs
    one, other = plane.model.createData(), space.model.createData()
    for state in states:
        q, v, _ = state.planar
        assert_close(
            np.array(pin.computeKineticEnergy(plane.model, one, q, v)),
            pin.computeKineticEnergy(space.model, other, state.q, state.v),
        )
        assert_close(
            np.array(pin.computePotentialEnergy(plane.model, one, q)),
            pin.computePotentialEnergy(space.model, other, state.q),
        )


def test_dynamics_are_those_in_space_projected(legs, states, assert_close):
    """M, h and the inverse dynamics of the expressions are Cᵀ M C, Cᵀ (M dC/dt v + h) and Cᵀ τ with v_space = C v."""
    plane, space, _ = legs
    size = plane.model.nv
    q, v = ca.SX.sym("q", size), ca.SX.sym("v", size)
    expressions = ca.Function("f", [q, v], [mass_matrix(plane, q), nonlinear_effects(plane, q, v)])
    data = space.model.createData()
    for state in states:
        mass, effects = (value.full() for value in expressions(*state.planar[:2]))
        upper = np.triu(pin.crba(space.model, data, state.q))
        assert_close(mass, state.map.T @ (upper + np.triu(upper, 1).T) @ state.map)
        assert_close(effects, state.map.T @ pin.rnea(space.model, data, state.q, state.v, state.bias))
        force = pin.rnea(plane.model, plane.model.createData(), *state.planar)
        assert_close(force, state.map.T @ pin.rnea(space.model, data, state.q, state.v, state.a))


def test_every_frame_and_shape_is_where_it_is_in_space(legs, states, assert_close):
    """No link, foot or shape of a locked or coupled leg is lost or moved."""
    plane, space, _ = legs
    assert plane.frame_names == space.frame_names
    assert plane.visual_model.ngeoms == space.visual_model.ngeoms > 0
    for state in states:
        placements = []
        for robot, q in ((plane, state.planar[0]), (space, state.q)):
            data, shapes = robot.model.createData(), robot.visual_model.createData()
            pin.framesForwardKinematics(robot.model, data, q)
            pin.updateGeometryPlacements(robot.model, data, robot.visual_model, shapes)
            frames = [data.oMf[robot.frame_id(name)] for name in robot.frame_names]
            placements.append(np.array([pose.homogeneous for pose in [*frames, *shapes.oMg]]))
        assert_close(*placements)


def test_frames_cannot_leave_the_plane(legs):
    """The sideways row of every Jacobian is structurally zero, so that planar contact is exact."""
    plane, _, _ = legs
    q = ca.SX.sym("q", plane.model.nq)
    assert not any(frame_jacobian(plane, q, name)[1, :].nnz() for name in plane.frame_names)


def test_coordinates_of_the_root(legs):
    """A sagittal root has x, z and pitch, without limits, and nothing that a joint could be mistaken for."""
    plane, _, coupled = legs
    assert plane.root_names == plane.velocity_names[:3] == ["root_x", "root_z", "root_pitch"]
    assert list(configuration_units(plane).values())[:4] == ["m", "m", "rad", "rad"]
    assert (plane.velocity_limit[:3] == np.inf).all()
    for limit in (-plane.lower_position, plane.upper_position, plane.upper_effort):
        assert (limit[:3] == np.inf).all() and np.isfinite(limit[3:]).all()
    assert not set(coupled) & set(plane.joint_names)


def test_pitch_is_nose_down(assert_close):
    """A positive pitch lowers what is in front."""
    robot = load_robot("example-robot-data:solo12", root="sagittal")
    data, q = robot.model.createData(), robot.neutral.copy()
    q[:3] = [2.0, 3.0, 0.1]
    pin.framesForwardKinematics(robot.model, data, q)
    pose = data.oMf[robot.frame_id("base_link")]
    assert_close(pose.translation, np.array([2.0, 0.0, 3.0]))
    assert_close(pose.rotation[:, 0], np.array([np.cos(0.1), 0.0, -np.sin(0.1)]))


@pytest.mark.parametrize("root", ["sagittal", "fixed"])
def test_right_angles_in_few_digits_are_noted_and_exact(root):
    """HyQ's hips are turned by 1.57079632679; a plane takes them as right angles and says so."""
    note = "right angles"
    robot = load_robot("example-robot-data:hyq", root=root)
    assert any(note in sentence and "lf_haa_joint" in sentence for sentence in robot.notes)
    assert not any(note in sentence for sentence in load_robot("example-robot-data:hyq", root="free_flyer").notes)
    for placement in list(robot.model.jointPlacements)[1:]:
        assert set(np.abs(placement.rotation).ravel()) <= {0.0, 1.0}


def test_a_file_that_moves_its_root_itself_is_refused(hopper):
    """A second root_x is a mistake of the task, not two coordinates of one name."""
    with pytest.raises(RobotError, match="own joint 'root_x'; set root to 'fixed'"):
        load_robot(hopper.source, root="sagittal")
