"""Optimal control problems in which bodies in contact are brought from one rest to another (arXiv 2305.17003)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from fesd_robot.dcs import Mechanism, UnilateralContact, state_of, with_contacts
from fesd_robot.fesd import OptimalControlProblem


def transfer(
    mechanism: Mechanism,
    contacts: Sequence[UnilateralContact],
    targets: tuple[np.ndarray, np.ndarray],
    guess: Callable[[float], np.ndarray],
    grid: tuple[float, int],
    *,
    weights: np.ndarray,
    most: np.ndarray,
    least_gap: float,
) -> OptimalControlProblem:
    """Return the problem min int |x - x_T|^2_Q + 0.1 |u|^2 dt + 100 |x(T) - x_T|^2_Q with abs(u) <= 30.

    Args:
        mechanism, contacts: the bodies, n_v velocities.
        targets: q at the start and q_T, (n_v) each; both at rest.
        guess: time -> q of the initial guess, at rest, (n_v).
        grid: T, s, and number of control intervals.
        weights: diagonal of Q, (2 n_v).
        most: bounds on abs(q) and abs(v), (2 n_v).
        least_gap: lower bound on the state of every gap.
    """
    start, target = targets
    rest, duration = np.zeros(len(start)), grid[0]
    state = state_of(mechanism, contacts, start, rest)
    gaps = np.ones(len(contacts))
    pushes = np.full(mechanism.control.numel(), 30.0)
    miss = ca.vertcat(mechanism.configuration, mechanism.velocity) - np.append(target, rest)
    square = ca.dot(miss**2, ca.DM(weights))
    return OptimalControlProblem(
        with_contacts(mechanism, contacts),
        duration,
        intervals=grid[1],
        initial_lower=state,
        initial_upper=state,
        state_lower=np.append(-most, least_gap * gaps),
        state_upper=np.append(most, np.inf * gaps),
        control_lower=-pushes,
        control_upper=pushes,
        running_cost={"miss": square, "force": 0.1 * ca.sumsqr(mechanism.control)},
        terminal_cost={"end": 100 * square},
        state_guess=lambda time: state_of(mechanism, contacts, guess(time), rest),
    )
