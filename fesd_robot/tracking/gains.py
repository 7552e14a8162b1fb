"""Gains that hold a robot to its plan: time-varying LQR, or proportional and derivative ones of its joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from scipy.linalg import expm

from fesd_robot.arguments import checked
from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, ReferenceSegment, TrackingGains, task_of
from fesd_robot.tracking.mode_dynamics import ModeDynamics
from fesd_robot.tracking.pieces import Piece, States, pieces_of
from fesd_robot.tracking.weights import TrackingWeights

Kind = Literal["lqr", "pd", "open-loop"]

PERIOD = 2e-3
"""Longest step between two gains, s."""

REPETITIONS, SAME_COST_TO_GO = 100, 1e-9
"""Of a gait, at most, until its cost to go repeats, and the relative difference up to which it does."""

STIFFNESS, DAMPING = 0.5, 0.03
"""Of a proportional and derivative controller: rad or m of departure at which a motor gives all it can, and the time,
s, by which its damping follows from its stiffness."""


@checked
def tracking_gains(
    plan: Plan,
    weights: TrackingWeights | None = None,
    *,
    period: float = PERIOD,
    motion: MotionProblem | None = None,
) -> TrackingGains:
    """Return the gains of a time-varying linear-quadratic regulator along a plan.

    The modes of contacts are those of the plan. With the linearised motion `ModeDynamics` of every step, discretised
    exactly for values that hold over it, e+ = A e + B u, and of every impact, e+ = S e,

        P = Q h + A^T (P+ - P+ B (R h + B^T P+ B)^-1 B^T P+) A,   K = (R h + B^T P+ B)^-1 B^T P+ A,   P = S^T P+ S,

    from P = Q T at the end. Impacts stay where they are in time: the reference of `Tracker` follows the landings.

    Args:
        plan: exact, with its finite elements.
        weights: Q, R and T; default: `TrackingWeights()`.
        period: longest step h, s.
        motion: the task of the plan, formulated; default: it is formulated.

    Raises:
        PlanFileError: a plan that is not solved or has no finite elements.
        TaskError: the model of the robot cannot be read any more.
        OptionError: weights of unknown names, or a period that is not positive.

    Source: Saccon, van de Wouw, Nijmeijer, Sensitivity analysis of hybrid systems with state jumps, 2014.
    """
    return _regulator(plan, weights, period, motion, None)


def gait_gains(
    plan: Plan, motion: MotionProblem, goes_on: Callable[[np.ndarray], np.ndarray], period: float = PERIOD
) -> TrackingGains:
    """Return the gains of `tracking_gains` along a gait that goes on and on.

    Args:
        plan: of a gait, exact, with its finite elements.
        motion: its task, formulated.
        goes_on: P where the gait goes on, at its end, from P at its beginning; both are then one cost to go.
        period: longest step, s.

    Raises:
        PlanFileError: a plan that is not solved or has no finite elements.
    """
    return _regulator(plan, None, period, motion, goes_on)


def _regulator(
    plan: Plan,
    weights: TrackingWeights | None,
    period: float,
    motion: MotionProblem | None,
    goes_on: Callable[[np.ndarray], np.ndarray] | None,
) -> TrackingGains:
    motion, weights = _checked(plan, period, motion), weights or TrackingWeights()
    state, control = weights.of_state(motion), weights.of_control(motion)
    pieces, dynamics = list(pieces_of(plan, motion, period)), ModeDynamics(motion)
    cost = np.diag(state * weights.end)
    for _ in range(1 if goes_on is None else REPETITIONS):
        gains, end = list[np.ndarray](), cost
        for piece in reversed(pieces):
            cost, own = _backwards(piece, dynamics, state, control, cost)
            gains.append(own)
        if goes_on is not None:
            cost = goes_on(cost)
            if np.abs(cost - end).max() <= SAME_COST_TO_GO * np.abs(cost).max():
                break
    return _gains(plan, motion, "lqr", pieces, gains[::-1])


def with_gains(plan: Plan) -> Plan:
    """Return a plan with the gains of `tracking_gains`, unless it has some.

    Args:
        plan: as there.

    Raises:
        PlanFileError, TaskError: as there.
    """
    return plan if plan.gains else plan.model_copy(update={"gains": tracking_gains(plan)})


@checked
def proportional_gains(
    plan: Plan,
    stiffness: Mapping[str, float] | None = None,
    damping: Mapping[str, float] | None = None,
    *,
    period: float = PERIOD,
    motion: MotionProblem | None = None,
) -> TrackingGains:
    """Return gains of proportional and derivative controllers, one at every joint with a motor to itself.

    Args:
        plan: exact, with its finite elements.
        stiffness: name of a control -> N m/rad or N/m; default: half the width of its limits at 0.5 rad or m.
        damping: name of a control -> N m s/rad or N s/m; default: 0.03 s of its stiffness.
        period: longest step of the reference, s.
        motion: the task of the plan, formulated; default: it is formulated.

    Raises:
        PlanFileError, TaskError: as `tracking_gains`.
        OptionError: gains of unknown names, or negative ones.
    """
    motion = _checked(plan, period, motion)
    drive, n_v = motion.actuation, len(motion.robot.velocity_names)
    matrix = drive.numeric(motion.robot.neutral)
    rows = [np.flatnonzero(column) for column in matrix.T]
    single = {name: row[0] for name, row in zip(drive.names, rows, strict=True) if len(row) == 1}
    gain = np.zeros((len(drive.names), 2 * n_v))
    for own, key in ((stiffness or {}, "stiffness"), (damping or {}, "damping")):
        for name, value in own.items():
            if name not in single:
                raise OptionError(f"{key}: found '{name}', expected a control of one joint, one of {', '.join(single)}")
            if not value >= 0:
                raise OptionError(f"{key}['{name}']: found {value!r}, expected a number that is not negative")
    for k, (name, width) in enumerate(zip(drive.names, (drive.upper - drive.lower) / 2, strict=True)):
        if name not in single:
            continue
        stiff = (stiffness or {}).get(name, width / STIFFNESS)
        sign = np.sign(matrix[single[name], k])
        gain[k, single[name]] = sign * stiff
        gain[k, n_v + single[name]] = sign * (damping or {}).get(name, DAMPING * stiff)
    return _constant(plan, motion, "pd", period, gain)


def feed_forward(plan: Plan, *, period: float = PERIOD, motion: MotionProblem | None = None) -> TrackingGains:
    """Return the plan's controls without any gain.

    Args:
        plan, period, motion: as `tracking_gains`.

    Raises:
        PlanFileError, TaskError: as there.
    """
    motion = _checked(plan, period, motion)
    gain = np.zeros((len(motion.actuation.names), 2 * len(motion.robot.velocity_names)))
    return _constant(plan, motion, "open-loop", period, gain)


def _checked(plan: Plan, period: float, motion: MotionProblem | None) -> MotionProblem:
    if not period > 0:
        raise OptionError(f"period: found {period!r} s, expected a number greater than 0")
    if not plan.status.solved:
        raise PlanFileError(f"{plan.name}: found a plan that is not solved, expected one that can be followed")
    motion = formulate(task_of(plan), driven=False) if motion is None else motion
    if surfaces := motion.robot.limit_surfaces:
        raise PlanFileError(
            f"{plan.name}: found a limit surface ({', '.join(surfaces)}), expected none: feedback does not know them"
        )
    return motion


def _constant(plan: Plan, motion: MotionProblem, kind: Kind, period: float, gain: np.ndarray) -> TrackingGains:
    pieces = list(pieces_of(plan, motion, period))
    return _gains(plan, motion, kind, pieces, [np.repeat(gain[None], len(each.middles.time), 0) for each in pieces])


def _backwards(
    piece: Piece, dynamics: ModeDynamics, state: np.ndarray, control: np.ndarray, cost: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost matrix at the beginning of a piece from that behind its impact, and its gains."""
    if piece.impact is not None:
        end = piece.nodes.configuration[-1]
        jump = dynamics.across(piece.impact.modes, end, piece.impact.before, piece.impact.after, piece.impact.impulse)
        cost = jump.T @ cost @ jump
    middles = piece.middles
    linear = dynamics.along(
        piece.modes, middles.configuration, middles.velocity, middles.control, piece.acceleration, piece.force
    )
    steps, n_u = len(middles.time), len(control)
    size = linear.state.shape[1] + n_u
    rates = np.zeros((steps, size, size))
    rates[:, : size - n_u, : size - n_u], rates[:, : size - n_u, size - n_u :] = linear.state, linear.control
    through = expm(rates * piece.step)[:, : size - n_u]
    gains = np.zeros((steps, n_u, size - n_u))
    for k in reversed(range(steps)):
        A, B = through[k, :, : size - n_u], through[k, :, size - n_u :]
        gains[k] = np.linalg.solve(np.diag(control * piece.step) + B.T @ cost @ B, B.T @ cost @ A)
        cost = np.diag(state * piece.step) + A.T @ cost @ (A - B @ gains[k])
        cost = (cost + cost.T) / 2
    return cost, gains


def _gains(
    plan: Plan, motion: MotionProblem, kind: Kind, pieces: Sequence[Piece], gains: Sequence[np.ndarray]
) -> TrackingGains:
    segments, own = list[ReferenceSegment](), list[tuple[States, np.ndarray]]()
    landed: tuple[str, ...] = ()
    for piece, gain in zip(pieces, gains, strict=True):
        own.append((piece.nodes, np.concatenate([gain, gain[-1:]])))
        if piece.impact is not None and piece.impact.landed:
            segments.append(_segment(own, landed))
            own, landed = [], piece.impact.landed
    if own:
        segments.append(_segment(own, landed))
    robot, drive = motion.robot, motion.actuation
    return TrackingGains(
        plan=plan.name,
        kind=kind,
        configuration_names=list(robot.configuration_names),
        velocity_names=list(robot.velocity_names),
        control_names=list(drive.names),
        contact_names=[contact.name for contact in motion.contacts],
        velocity_units=[plan.units.velocity[name] for name in robot.velocity_names],
        control_units=list(drive.units),
        lower=drive.lower,
        upper=drive.upper,
        segments=segments,
    )


def _segment(parts: Sequence[tuple[States, np.ndarray]], landed: tuple[str, ...]) -> ReferenceSegment:
    """Return pieces one after the other; where one ends and the next begins, the next one's control and gain count."""

    def joined(arrays: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([*(each[:-1] for each in arrays[:-1]), arrays[-1]])

    fields = ("time", "configuration", "velocity", "control")
    columns = {name: joined([getattr(states, name) for states, _ in parts]) for name in fields}
    return ReferenceSegment(landed=list(landed), **columns, gain=joined([gain for _, gain in parts]))
