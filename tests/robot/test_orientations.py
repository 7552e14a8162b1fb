"""Orientations against Pinocchio and closed forms: angles, the logarithm of a deviation, even turns."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.orientations import (
    columns_with_angles,
    deviation_names,
    layered,
    lists,
    roll_pitch_yaw,
    value_names,
    with_angles,
    with_unit_quaternions,
)
from fesd_robot.robot import Robot, load_robot
from fesd_robot.robot.orientations import (
    deviation,
    interpolated,
    measured_deviation,
    slerp,
    turned,
    with_turn,
)
from fesd_robot.robot.rotations import quaternion_matrix
from fesd_robot.robot.units import deviation_units

NAMES = ["slide", *(f"base.{s}" for s in ("x", "y", "z", "qx", "qy", "qz", "qw")), "knee"]
TURNS = [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 0.05, 0.19, 0.21, 1.0, 3.0]


def random_quaternions(count: int) -> np.ndarray:
    """Return rotations of both signs, (count, 4)."""
    q = np.random.default_rng(5).normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


@cache
def solo() -> Robot:
    """Solo12 with a free root."""
    return load_robot("example-robot-data:solo12", root="free_flyer")


def test_names() -> None:
    """Three angles stand in the place of a quaternion, and beside it where a configuration is written."""
    angles = ["base.roll", "base.pitch", "base.yaw"]
    assert deviation_names(NAMES) == ["slide", "base.x", "base.y", "base.z", *angles, "knee"]
    assert value_names(NAMES) == [*NAMES, *angles]
    assert deviation_names(["leg", "wheel.cos", "arm.qx"]) == ["leg", "wheel.cos", "arm.qx"]
    assert lists({"base.qw": 1.0}, "base.roll") and lists({"base.yaw": 1.0}, "base.roll")
    assert not lists({"knee": 1.0}, "base.roll") and not lists({"base.roll": 1.0}, "base.qx")
    units = deviation_units(solo())
    assert units["root_joint.z"] == "m" and units["root_joint.yaw"] == "rad" and "root_joint.qx" not in units


def test_a_quaternion_takes_away_angles_below_it() -> None:
    """Of a posture and a configuration on it, the configuration comes first, whichever way either is written."""
    angles, quaternion = {"base.yaw": 0.5, "knee": 1.0}, {"base.qx": 0, "base.qy": 0, "base.qz": 0, "base.qw": 1}
    assert layered(angles, quaternion) == {"knee": 1.0, **quaternion}
    assert layered(quaternion, angles) == {**quaternion, **angles}


def test_angles_are_those_of_pinocchio() -> None:
    """Roll, pitch and yaw give Pinocchio's Rz(yaw) Ry(pitch) Rx(roll), whatever the quaternion's length."""
    quaternions = random_quaternions(50)
    for quaternion, angles in zip(quaternions, roll_pitch_yaw(2.5 * quaternions), strict=True):
        matrix = pin.Quaternion(quaternion).toRotationMatrix()
        np.testing.assert_allclose(pin.rpy.rpyToMatrix(*angles), matrix, atol=1e-14)
        np.testing.assert_allclose(angles, pin.rpy.matrixToRpy(matrix), atol=1e-12)


def test_angles_at_a_right_pitch() -> None:
    """Nose down by a right angle the angles still give the rotation."""
    matrix = pin.rpy.rpyToMatrix(0.3, np.pi / 2, -0.4)
    angles = roll_pitch_yaw(pin.Quaternion(matrix).coeffs())
    np.testing.assert_allclose(pin.rpy.rpyToMatrix(*angles), matrix, atol=1e-14)


def test_turned_keeps_what_is_not_given() -> None:
    """One angle is replaced, the others stay, and the quaternion keeps its side."""
    first = pin.Quaternion(pin.rpy.rpyToMatrix(0.1, -0.2, 0.3)).coeffs()
    for start in (first, -first):
        found = turned(start, (None, None, 1.2))
        np.testing.assert_allclose(roll_pitch_yaw(found), [0.1, -0.2, 1.2], atol=1e-14)
        assert found @ start > 0


def test_a_motion_by_angles_does_not_jump() -> None:
    """Two turns about z are a yaw that grows evenly to 4 pi."""
    angle = np.linspace(0, 4 * np.pi, 101)
    zero = np.zeros_like(angle)
    columns = {"b.qx": zero, "b.qy": zero, "b.qz": np.sin(angle / 2), "b.qw": np.cos(angle / 2), "leg": angle}
    found = columns_with_angles(columns)
    assert list(found) == ["b.roll", "b.pitch", "b.yaw", "leg"]
    np.testing.assert_allclose(found["b.yaw"], angle, atol=1e-12)
    assert with_angles({name: float(column[10]) for name, column in columns.items()})["b.yaw"] == pytest.approx(
        angle[10]
    )


def _expression() -> tuple[ca.Function, ca.Function, ca.Function]:
    q, reference = ca.SX.sym("q", len(NAMES)), ca.SX.sym("reference", len(NAMES))
    found = deviation(NAMES, q, reference)
    square = ca.dot(found, found)
    hessian, gradient = ca.hessian(square, q)
    names = ("value", "slope", "second")
    functions = (found, ca.jacobian(found, q), ca.horzcat(gradient, hessian))
    made = [ca.Function(n, [q, reference], [f]) for n, f in zip(names, functions, strict=True)]
    return made[0], made[1], made[2]


@pytest.mark.parametrize("angle", TURNS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_deviation_is_the_logarithm(angle: float, sign: float) -> None:
    """It is log(R_ref^T R) of Pinocchio, the same for q and -q and any length, and all else is a difference."""
    value, slope, second = _expression()
    rng = np.random.default_rng(3)
    axis = rng.normal(size=3)
    turn = angle * axis / np.linalg.norm(axis)
    reference, q = rng.normal(size=len(NAMES)), rng.normal(size=len(NAMES))
    reference[4:8] = random_quaternions(3)[2]
    step = pin.Quaternion(pin.exp3(turn))
    q[4:8] = sign * (pin.Quaternion(reference[4:8]) * step).coeffs()
    expected = {name: q[i] - reference[i] for i, name in enumerate(NAMES)}
    expected |= dict(zip(("base.roll", "base.pitch", "base.yaw"), turn, strict=True))
    found = value(q, reference).full().ravel()
    np.testing.assert_allclose(found, [expected[name] for name in deviation_names(NAMES)], atol=1e-14 + 4e-16 * angle)
    numbers = measured_deviation(NAMES, q, reference)
    np.testing.assert_allclose(found, list(numbers.values()), atol=2e-8 if angle > 2.9 else 1e-12)
    q[4:8] *= 1.7
    np.testing.assert_allclose(value(q, reference).full().ravel(), found, atol=1e-14)
    q[4:8] /= 1.7
    jacobian = slope(q, reference).full()
    assert np.isfinite(jacobian).all() and np.isfinite(second(q, reference).full()).all()
    # along the motion q' = q (omega, 0) / 2 the logarithm grows by the inverse of the right Jacobian of SO(3)
    omega = rng.normal(size=3)
    rate = sign * (pin.Quaternion(reference[4:8]) * step * pin.Quaternion(0.0, *omega)).coeffs() / 2
    np.testing.assert_allclose(jacobian[4:7, 4:8] @ rate, pin.Jlog3(pin.exp3(turn)) @ omega, atol=5e-8)
    np.testing.assert_allclose(jacobian[4:7, 4:8] @ q[4:8], 0.0, atol=1e-13)


def test_the_square_of_a_deviation_has_its_hessian_at_zero() -> None:
    """At no deviation |log|^2 is 4 |vector part|^2: gradient zero, Hessian 8 on the sphere and 0 along q."""
    _, _, second = _expression()
    q = np.zeros(len(NAMES))
    q[4:8] = random_quaternions(1)[0]
    found = second(q, q).full()[4:8]
    np.testing.assert_allclose(found[:, 0], 0.0, atol=1e-14)
    np.testing.assert_allclose(found[:, 5:9], 8 * (np.eye(4) - np.outer(q[4:8], q[4:8])), atol=1e-12)


def test_what_is_not_given_has_no_deviation() -> None:
    """A reference without an orientation leaves the others as they are."""
    reference, q = np.zeros(len(NAMES)), np.ones(len(NAMES))
    reference[4:8] = np.nan
    found = measured_deviation(NAMES, q, reference)
    assert found["knee"] == 1 and np.isnan(found["base.yaw"])


def test_slerp_turns_evenly_the_short_way() -> None:
    """It is q_0 exp(s log(R_0^T R_1)), from either sign of its end, and stays on the side of its start."""
    first, second = random_quaternions(2)
    start, end = (pin.Quaternion(each).toRotationMatrix() for each in (first, second))
    whole = pin.log3(start.T @ end)
    for last in (second, -second):
        for fraction in (0.0, 0.1, 0.5, 1.0):
            found = slerp(first, last, fraction)
            matrix = pin.Quaternion(found).toRotationMatrix()
            np.testing.assert_allclose(matrix, start @ pin.exp3(fraction * whole), atol=1e-12)
            assert found @ first >= 0
    np.testing.assert_allclose(slerp(first, -first, 0.3), first, atol=1e-12)


def test_a_part_of_a_turn_follows() -> None:
    """q exp(f log(q_0^-1 q_1)) with the axes of the body."""
    q, first, second = random_quaternions(3)
    part = pin.exp3(
        0.4 * pin.log3(pin.Quaternion(first).toRotationMatrix().T @ pin.Quaternion(second).toRotationMatrix())
    )
    found = pin.Quaternion(with_turn(q, first, second, 0.4)).toRotationMatrix()
    np.testing.assert_allclose(found, pin.Quaternion(q).toRotationMatrix() @ part, atol=1e-12)


def test_a_free_flyer_goes_straight_while_it_turns() -> None:
    """Between two poses the place is on the line and the orientation on the geodesic, joints as Pinocchio has them."""
    model, rng = solo().model, np.random.default_rng(4)
    first, second = (pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv)) for _ in range(2))
    found, expected = interpolated(solo(), first, second, 0.3), pin.interpolate(model, first, second, 0.3)
    np.testing.assert_allclose(found[:3], first[:3] + 0.3 * (second[:3] - first[:3]), atol=1e-14)
    assert abs(found[3:7] @ expected[3:7]) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(found[7:], expected[7:], atol=1e-14)


def test_the_length_of_a_quaternion_has_no_effect() -> None:
    """A rotation matrix is that of the direction of a quaternion, in value and derivative; numbers are made unit."""
    q = ca.SX.sym("q", 4)
    matrix = ca.vec(quaternion_matrix(q))
    function = ca.Function("matrix", [q], [matrix, ca.jacobian(matrix, q) @ q])
    quaternion = random_quaternions(1)[0]
    value, along = function(3.0 * quaternion)
    expected = pin.Quaternion(quaternion).toRotationMatrix()
    np.testing.assert_allclose(value.full().reshape(3, 3, order="F"), expected, atol=1e-15)
    np.testing.assert_allclose(along.full(), 0.0, atol=1e-15)
    row = np.arange(1.0, 10.0)
    unit = with_unit_quaternions(NAMES, row)
    np.testing.assert_allclose(np.delete(unit - row, slice(4, 8)), 0.0)
    np.testing.assert_allclose(unit[4:8], row[4:8] / np.linalg.norm(row[4:8]))
    np.testing.assert_array_equal(with_unit_quaternions(NAMES, np.stack([row, row]))[1], unit)
