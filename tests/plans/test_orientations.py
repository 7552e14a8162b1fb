"""The length of quaternions in the audit, their weights in words, and roll, pitch and yaw in the figures."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.plans import Plan
from fesd_robot.plans.audit import _angles_outside, _position_defects
from fesd_robot.plans.weights import weights_of
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.render.figures.coordinates import _aims

from .motions import drop
from .test_audit import NAMES, audit_of


def test_a_quaternion_that_is_too_long_is_found(physics: NumericPhysics) -> None:
    """The audit says by how much, when and of which joint; four coordinates of the hopper are given its names."""
    motion = drop()
    names = replace(NAMES, configuration={f"ball.q{axis}": "1" for axis in "xyzw"})
    lengths = np.linalg.norm(motion.states.configuration, axis=1)
    found = audit_of(motion, physics, names=names)
    assert found.max_quaternion_norm_error == pytest.approx(np.abs(lengths - 1).max())
    assert "max_quaternion_norm_error" in found.violations
    (words,) = [one for one in found.findings if one.entry == "max_quaternion_norm_error"]
    assert words.subject == "ball" and words.time == motion.states.time[int(np.argmax(np.abs(lengths - 1)))]
    assert "the length of the quaternion of 'ball' is" in words.sentence
    assert audit_of(motion, physics).max_quaternion_norm_error == 0


def test_an_angle_beyond_its_limits_is_found(physics: NumericPhysics) -> None:
    """By how much, in rad, of roll and yaw the shorter way round; within its limits nothing is."""
    motion, joint = drop(), {f"ball.q{axis}": "1" for axis in "xyzw"}
    names, turn = replace(NAMES, configuration=joint), np.array([0.0, 0.0, np.sin(1.5), np.cos(1.5)])
    dense = replace(motion.between, configuration=np.broadcast_to(turn, motion.between.configuration.shape))
    turned = replace(motion, configuration=np.tile(turn, (len(motion.time), 1)), between=dense)
    bounds = np.full(4, -np.inf), np.full(4, np.inf)
    for limits, excess in (((2.0, 2.8), 0.2), ((-4.0, 2.8 - 2 * np.pi), 0.2), ((2.9, 3.5), 0.0)):
        found = _angles_outside(turned, names, {"ball.yaw": limits})
        assert (found.value, found.subject) == (pytest.approx(excess), "ball.yaw" if excess else "")
    seen = audit_of(turned, physics, names=names, position=bounds, angles={"ball.yaw": (2.0, 2.8)})
    assert seen.max_position_limit_violation == pytest.approx(0.2)


@pytest.mark.parametrize("slip", [0.0, 0.01])
def test_a_fast_spin_is_the_integral_of_its_velocity(slip: float) -> None:
    """Two turns of a ball joint in one control interval: no defect, and of a velocity 1 % too large 1 % of the turn."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    nodes, weights, rate, step, count = (1 / 3, 1.0), (0.75, 0.25), 60.0, 0.02, 10
    times = np.array([0.0, *(step * (e + node) for e in range(count) for node in nodes)])
    axis = np.array([2.0, -1.0, 2.0]) / 3
    motion = SimpleNamespace(
        time=times,
        interval=np.zeros(len(times), dtype=int),
        configuration=np.array([pin.Quaternion(pin.exp3(time * rate * axis)).coeffs() for time in times]),
        velocity=np.tile((1 + slip) * rate * axis, (len(times), 1)),
        weight=np.array([0.0, *(step * weight for _ in range(count) for weight in weights)]),
        between=SimpleNamespace(time=np.array([[step * e, step * (e + 1)] for e in range(count)])),
    )
    numeric = SimpleNamespace(
        difference=lambda q0, q1: pin.difference(model, q0, q1),
        displacement_rate=lambda q, d, v: np.linalg.solve(pin.dIntegrate(model, q, d, pin.ARG1), v),
    )
    velocity = {f"ball.w{axis}": "rad/s" for axis in "xyz"}
    names = replace(NAMES, configuration={f"ball.q{axis}": "1" for axis in "xyzw"}, velocity=velocity)
    (found,) = _position_defects(cast(Any, motion), cast(Any, numeric), names)
    assert found.value == pytest.approx(slip * rate * step * count * 2 / 3, abs=1e-12)


def _plan(waypoints: list[dict[str, Any]]) -> Plan:
    """Return what a plan says about a task with a ball joint."""
    units = SimpleNamespace(configuration={f"ball.q{axis}": "1" for axis in "xyzw"}, velocity={}, controls={})
    task = {
        "costs": {"configuration": {"ball.yaw": 3.0, "ball.roll": 3.0, "ball.pitch": 0.0}},
        "goal": {},
        "waypoints": waypoints,
        "horizon": {"duration": 1.0},
    }
    trajectory = SimpleNamespace(time=np.array([0.0, 1.0]))
    controls = {"time": np.array([0.0, 0.5])}
    found = SimpleNamespace(units=units, task=task, contacts={}, trajectory=trajectory, outcome=None, controls=controls)
    return cast(Plan, found)


WAYPOINT: dict[str, Any] = {
    "time": 0.5,
    "configuration": {"ball.qx": 0.0, "ball.qy": 0.0, "ball.qz": np.sin(0.2), "ball.qw": np.cos(0.2)},
    "velocity": {},
    "frames": {},
    "center_of_mass": None,
    "weight": 7.0,
    "velocity_weight": 1.0,
    "tolerance": {"configuration": {"ball.yaw": 0.1}},
}


def test_weights_of_orientations_are_per_square_radian() -> None:
    """Angles are named with their unit, of waypoints those of the whole orientation."""
    words = weights_of(_plan([WAYPOINT]))
    assert words["configuration"] == "ball.yaw, ball.roll 3 /rad2/s"
    assert words["waypoint 1"] == "ball.roll, ball.pitch, ball.yaw 7 /rad2"


def test_a_waypoint_is_drawn_as_an_angle() -> None:
    """Its diamond in the panel of the yaw is at the yaw of its quaternion, with its tolerance."""
    (aim,) = _aims(_plan([WAYPOINT]), "configuration", "ball.yaw", np.zeros(2))
    assert (aim.word, aim.time, aim.value, aim.tolerance) == ("waypoint", 0.5, pytest.approx(0.4), 0.1)
