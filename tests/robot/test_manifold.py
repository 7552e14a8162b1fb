"""Moving on the configuration manifold, and its derivatives at and around zero."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import DimensionError
from fesd_robot.robot import Robot, configuration_derivative, difference, integrate, load_robot

MODELS = Path(__file__).parent / "models"

PINOCCHIO_SERIES = 5e-9
"""Pinocchio's own derivatives lose digits around angles of 1e-3, where it switches to a short series."""

ANGLES = [0.0, 1e-300, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 0.95, 0.999999, 1.000001, 1.05, 2.5]
SOURCES = {
    "zoo": (MODELS / "zoo.urdf", "fixed"),
    "crawler": (MODELS / "crawler.xml", "fixed"),
    "solo12": ("example-robot-data:solo12", "free_flyer"),
    "kinova": ("example-robot-data:kinova", "planar"),
}


@cache
def _derivatives(name: str) -> tuple[Robot, dict[str, ca.Function]]:
    source, root = SOURCES[name]
    robot = load_robot(source, root=root)
    nq, nv = robot.model.nq, robot.model.nv
    q, q1, v, x = ca.SX.sym("q", nq), ca.SX.sym("q1", nq), ca.SX.sym("v", nv), ca.SX.sym("x", nv)
    moved = integrate(robot, q, v)
    off = difference(robot, q1, moved)
    gap = difference(robot, q, q1)
    tangent = ca.jacobian(configuration_derivative(robot, q, v), v)
    directional = ca.jacobian(off, v) @ x
    functions = {
        "moved": ca.Function("f", [q, v], [moved]),
        "gap": ca.Function("f", [q, q1], [gap]),
        "tangent": ca.Function("f", [q], [tangent]),
        "off_v": ca.Function("f", [q, q1, v], [ca.jacobian(off, v)]),
        "off_q": ca.Function("f", [q, q1, v], [ca.jacobian(off, q)]),
        "off_vv": ca.Function("f", [q, q1, v, x], [directional, ca.jacobian(directional, v)]),
        "gap_0": ca.Function("f", [q, q1], [ca.jacobian(gap, q)]),
        "gap_1": ca.Function("f", [q, q1], [ca.jacobian(gap, q1)]),
    }
    return robot, functions


@pytest.fixture(params=SOURCES)
def moving(request):
    """A robot with curved configuration space and the derivatives of its motions."""
    return _derivatives(request.param)


def _step(robot: Robot, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, dv and q ⊕ dv where every joint that turns turns by about `angle`."""
    model = robot.model
    rng = np.random.default_rng(11)
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.0, 1.0, model.nv))
    dv = np.zeros(model.nv)
    for link in robot.tree.links:
        part = rng.normal(size=link.v_indices.stop - link.v_indices.start)
        turning = np.linalg.norm(link.angular.full() @ part)
        dv[link.v_indices] = angle * part / (turning if turning > 0.0 else 1.0)
    return q, dv, pin.integrate(model, q, dv)


def test_configuration_derivative_agrees_with_pinocchio(case, assert_close):
    """dq/dt is Pinocchio's tangent map times v."""
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["configuration_derivative"], pin.tangentMap(case.robot.model, state.q) @ state.v)


def test_integrate_agrees_with_pinocchio(case, assert_close):
    """q ⊕ v is the configuration of pin.integrate, up to the sign of a quaternion."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        expected = pin.integrate(model, state.q, state.v)
        actual = values["integrate"].ravel()
        for link in case.robot.tree.links:
            if len(link.joint.unit_entries) == 4:
                entries = np.array(link.joint.unit_entries) + link.q_indices.start
                expected[entries] *= np.sign(expected[entries] @ actual[entries])
        assert_close(actual, expected)


def test_difference_agrees_with_pinocchio(case, assert_close):
    """q1 ⊖ q0 is that of pin.difference."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["difference"], pin.difference(model, state.q, pin.integrate(model, state.q, state.a)))


@pytest.mark.parametrize("angle", ANGLES)
def test_difference_inverts_integrate(moving, angle, assert_close):
    """(q ⊕ dv) ⊖ q = dv for turns from nothing to almost half a circle."""
    robot, functions = moving
    q, dv, _ = _step(robot, angle)
    assert_close(functions["gap"](q, functions["moved"](q, dv)).full(), dv, 1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_derivatives_of_integrate(moving, angle, assert_close):
    """The derivatives of q ⊕ dv are those of pin.dIntegrate."""
    robot, functions = moving
    q, dv, q1 = _step(robot, angle)
    with_q, with_v = pin.dIntegrate(robot.model, q, dv)
    assert_close(functions["off_v"](q, q1, dv).full(), with_v, PINOCCHIO_SERIES)
    assert_close(functions["off_q"](q, q1, dv).full() @ functions["tangent"](q).full(), with_q, PINOCCHIO_SERIES)


@pytest.mark.parametrize("angle", ANGLES)
def test_derivatives_of_difference(moving, angle, assert_close):
    """The derivatives of q1 ⊖ q0 are those of pin.dDifference."""
    robot, functions = moving
    q, _, q1 = _step(robot, angle)
    with_0, with_1 = pin.dDifference(robot.model, q, q1)
    assert_close(functions["gap_0"](q, q1).full() @ functions["tangent"](q).full(), with_0, PINOCCHIO_SERIES)
    assert_close(functions["gap_1"](q, q1).full() @ functions["tangent"](q1).full(), with_1, PINOCCHIO_SERIES)


@pytest.mark.parametrize("angle", ANGLES)
def test_second_derivatives_of_integrate(moving, angle, assert_close):
    """The second derivatives of q ⊕ dv are finite and the slopes of the first, on both sides of every switch."""
    robot, functions = moving
    q, dv, q1 = _step(robot, angle)
    direction = np.random.default_rng(1).normal(size=robot.model.nv)
    second = functions["off_vv"](q, q1, dv, direction)[1].full()
    assert np.isfinite(second).all()
    along = np.random.default_rng(2).normal(size=robot.model.nv)
    step = 1e-5
    slope = [functions["off_vv"](q, q1, dv + sign * step * along, direction)[0].full() for sign in (1.0, -1.0)]
    assert_close(second @ along, ((slope[0] - slope[1]) / (2 * step)).ravel(), 1e-8)


def test_zero_difference_has_finite_second_derivatives(moving):
    """No derivative of q1 ⊖ q0 is NaN where q1 = q0."""
    robot, _ = moving
    q, _, _ = _step(robot, 0.0)
    q0, q1 = ca.SX.sym("q0", robot.model.nq), ca.SX.sym("q1", robot.model.nq)
    weighted = ca.dot(difference(robot, q0, q1), np.arange(1.0, robot.model.nv + 1))
    hessian = ca.Function("h", [q0, q1], [ca.hessian(weighted, ca.vertcat(q0, q1))[0]])
    assert np.isfinite(hessian(q, q).full()).all()


def test_unit_entries_stay_unit(moving):
    """Quaternions and (cos, sin) pairs keep their length along dq/dt and under ⊕."""
    robot, functions = moving
    q, dv, _ = _step(robot, 2.0)
    rate = functions["tangent"](q).full() @ dv
    moved = functions["moved"](q, dv).full().ravel()
    for link in robot.tree.links:
        entries = np.array(link.joint.unit_entries, dtype=int) + link.q_indices.start
        if entries.size:
            assert abs(rate[entries] @ q[entries]) < 1e-14
            assert abs(np.linalg.norm(moved[entries]) - 1.0) < 1e-14


def test_difference_takes_the_short_way():
    """Opposite quaternions are the same attitude."""
    robot, functions = _derivatives("solo12")
    q, _, q1 = _step(robot, 1.0)
    opposite = q1.copy()
    opposite[3:7] *= -1.0
    assert functions["gap"](q, opposite).full() == pytest.approx(functions["gap"](q, q1).full(), abs=1e-14)


def test_arguments_of_the_wrong_length_are_refused(hopper):
    """The message names the argument."""
    with pytest.raises(DimensionError, match="dv has shape"):
        integrate(hopper, ca.SX.sym("q", 4), ca.SX.sym("dv", 5))
    with pytest.raises(DimensionError, match="q1 has shape"):
        difference(hopper, ca.SX.sym("q", 4), ca.SX.sym("q1", 5))
