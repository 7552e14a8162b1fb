"""Gains along a plan: optimal for the linearised motion, written by name and read again."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from mcap_ros2.reader import read_ros2_messages
from scipy.linalg import block_diag, expm

from fesd_robot.actions import exported
from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan, TrackingGains, read_plan, write_plan
from fesd_robot.tracking import ModeDynamics, TrackingWeights, proportional_gains, tracking_gains
from fesd_robot.tracking.pieces import pieces_of

PERIOD = 8e-3


def test_first_control_is_that_of_the_whole_least_squares_problem(jump: Plan, motion: MotionProblem) -> None:
    """The gain at the start is what minimises the cost over all controls at once, impacts included, to 1e-8."""
    gains, weights = tracking_gains(jump, period=PERIOD, motion=motion), TrackingWeights()
    dynamics, Q, R = ModeDynamics(motion), weights.of_state(motion), weights.of_control(motion)
    n_x, n_u = len(Q), len(R)
    by_start, by_controls = np.eye(n_x), np.zeros((n_x, 0))
    rows_start, rows_controls, control_weights = [], [], []
    for piece in pieces_of(jump, motion, PERIOD):
        middles = piece.middles
        linear = dynamics.along(
            piece.modes, middles.configuration, middles.velocity, middles.control, piece.acceleration, piece.force
        )
        for A, B in zip(linear.state, linear.control, strict=True):
            rows_start.append(np.sqrt(Q * piece.step)[:, None] * by_start)
            rows_controls.append(np.sqrt(Q * piece.step)[:, None] * by_controls)
            rates = np.zeros((n_x + n_u, n_x + n_u))
            rates[:n_x] = np.hstack([A, B])
            step = expm(rates * piece.step)[:n_x]
            by_start = step[:, :n_x] @ by_start
            by_controls = np.hstack([step[:, :n_x] @ by_controls, step[:, n_x:]])
            control_weights.append(np.sqrt(R * piece.step))
        if piece.impact:
            one = piece.impact
            jumps = dynamics.across(one.modes, piece.nodes.configuration[-1], one.before, one.after, one.impulse)
            by_start, by_controls = jumps @ by_start, jumps @ by_controls
    rows_start.append(np.sqrt(Q * weights.end)[:, None] * by_start)
    rows_controls.append(np.sqrt(Q * weights.end)[:, None] * by_controls)
    width = by_controls.shape[1]
    left = np.vstack([np.pad(each, ((0, 0), (0, width - each.shape[1]))) for each in rows_controls])
    left = np.vstack([left, block_diag(*[np.diag(each) for each in control_weights])])
    right = np.vstack([*rows_start, np.zeros((width, n_x))])
    optimal = np.linalg.lstsq(left, -right, rcond=None)[0][:n_u]
    found = -gains.segments[0].gain[0]
    assert found == pytest.approx(optimal, abs=1e-8 * np.abs(optimal).max())


def test_weights_may_be_given_by_name(jump: Plan, motion: MotionProblem) -> None:
    """A coordinate that hardly counts is hardly followed; names that do not exist are refused with the nearest one."""
    loose = tracking_gains(jump, TrackingWeights(position={"leg": 1e6}, velocity={"leg": 1e6}), motion=motion)
    usual = tracking_gains(jump, motion=motion)
    leg = usual.velocity_names.index("leg")
    assert np.abs(loose.stacked("gain")[:, :, leg]).max() < np.abs(usual.stacked("gain")[:, :, leg]).max()
    with pytest.raises(OptionError, match=r"position: found 'lag', expected a velocity coordinate .did you mean 'leg'"):
        tracking_gains(jump, TrackingWeights(position={"lag": 1.0}), motion=motion)
    with pytest.raises(OptionError, match="control: found 'leg', expected a control"):
        tracking_gains(jump, TrackingWeights(control={"leg": 1.0}), motion=motion)
    with pytest.raises(OptionError, match=r"hinge_rate: found -1, expected a number greater than 0"):
        TrackingWeights(hinge_rate=-1)


def test_proportional_gains_push_back(jump: Plan, motion: MotionProblem) -> None:
    """A motor of one joint answers its departure against it, with stiffness and damping as given."""
    gains = proportional_gains(jump, {"leg_force": 300.0}, {"leg_force": 20.0}, motion=motion)
    leg, n_v = gains.velocity_names.index("leg"), len(gains.velocity_names)
    row = gains.segments[0].gain[0, gains.control_names.index("leg_force")]
    assert row[leg] == 300.0 and row[n_v + leg] == 20.0
    assert np.count_nonzero(row) == 2
    with pytest.raises(OptionError, match="stiffness: found 'leg'"):
        proportional_gains(jump, {"leg": 300.0}, motion=motion)
    with pytest.raises(OptionError, match="expected a number that is not negative"):
        proportional_gains(jump, {"leg_force": -1.0}, motion=motion)


def test_a_plan_that_is_not_solved_has_no_gains(jump: Plan) -> None:
    """Neither has one without its finite elements; each is one sentence."""
    failed = jump.model_copy(update={"status": jump.status.model_copy(update={"solved": False})})
    with pytest.raises(PlanFileError, match="not solved"):
        tracking_gains(failed)
    with pytest.raises(PlanFileError, match="without its finite elements"):
        tracking_gains(jump.model_copy(update={"finite_elements": None, "gains": None}))


def test_gains_are_kept_in_the_plan(jump: Plan, gains: TrackingGains, tmp_path) -> None:
    """`output.gains` leaves them in plan.json, from where they come back to the last digit."""
    kept = read_plan(write_plan(jump, tmp_path / "jump")).gains
    assert kept is not None
    for name in ("time", "configuration", "velocity", "control", "gain"):
        np.testing.assert_array_equal(kept.stacked(name), gains.stacked(name))


def test_arrays_table_and_recording_hold_the_same_gains(jump: Plan, gains: TrackingGains) -> None:
    """The archive, the CSV file and the MCAP file have K(t), feed-forward and reference by name and with units."""
    archive = np.load(io.BytesIO(exported(jump, "gains")))
    np.testing.assert_array_equal(archive["gain"], gains.stacked("gain"))
    assert archive["velocity_names"].tolist() == gains.velocity_names
    header, *rows = csv.reader(io.StringIO(exported(jump, "gains", suffix=".csv").decode()))
    column = header.index("gain of leg_force by root_z velocity [N/(m/s)]")
    k, i = gains.control_names.index("leg_force"), gains.departure_names.index("root_z velocity")
    assert [float(row[column]) for row in rows] == gains.stacked("gain")[:, k, i].tolist()
    recording = read_ros2_messages(io.BytesIO(exported(jump, "gains", suffix=".mcap")), topics=["/tracking/gain"])
    read = np.array([message.ros_msg.data for message in recording])
    np.testing.assert_array_equal(read, gains.stacked("gain").reshape(len(read), -1))
