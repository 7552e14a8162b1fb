"""Frames against Pinocchio's numeric algorithms."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import frame_jacobian, frame_placement

ALIGNED = pin.LOCAL_WORLD_ALIGNED


def test_frame_placements_agree_with_pinocchio(case, assert_close):
    """R and p of a frame are those of pin.framesForwardKinematics."""
    model, data = case.robot.model, case.robot.model.createData()
    for state, values in zip(case.states, case.values, strict=True):
        pin.framesForwardKinematics(model, data, state.q)
        for frame in case.frames:
            placement = data.oMf[case.robot.frame_id(frame)]
            assert_close(values[f"rotation {frame}"], placement.rotation)
            assert_close(values[f"position {frame}"], placement.translation)


def test_frame_velocities_agree_with_pinocchio(case, assert_close):
    """Linear and angular velocity of a frame are those of pin.getFrameVelocity in world axes."""
    model, data = case.robot.model, case.robot.model.createData()
    for state, values in zip(case.states, case.values, strict=True):
        pin.forwardKinematics(model, data, state.q, state.v)
        for frame in case.frames:
            velocity = pin.getFrameVelocity(model, data, case.robot.frame_id(frame), ALIGNED)
            assert_close(values[f"linear {frame}"], velocity.linear)
            assert_close(values[f"angular {frame}"], velocity.angular)


def test_frame_jacobians_agree_with_pinocchio(case, assert_close):
    """The Jacobian of a frame is that of pin.computeFrameJacobian in world axes, linear rows first."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        for frame in case.frames:
            expected = pin.computeFrameJacobian(model, model.createData(), state.q, case.robot.frame_id(frame), ALIGNED)
            assert_close(values[f"jacobian {frame}"], expected)


def test_frame_jacobian_maps_the_velocity(case, assert_close):
    """J v is the velocity of the frame."""
    for state, values in zip(case.states, case.values, strict=True):
        for frame in case.frames:
            both = np.vstack([values[f"linear {frame}"], values[f"angular {frame}"]])
            assert_close(values[f"jacobian {frame}"] @ state.v, both.ravel())


def test_a_frame_of_the_world_does_not_move(hopper):
    """The universe has a constant placement and an empty Jacobian."""
    q = ca.SX.sym("q", 4)
    rotation, position = frame_placement(hopper, q, "universe")
    assert np.array_equal(ca.evalf(rotation).full(), np.eye(3))
    assert position.nnz() == 0
    assert frame_jacobian(hopper, q, "universe").nnz() == 0


def test_an_unknown_frame_is_refused(hopper):
    """The message names the nearest frame."""
    with pytest.raises(RobotError, match=r"no frame 'foto' \(did you mean 'foot'\?\)"):
        frame_placement(hopper, ca.SX.sym("q", 4), "foto")
