"""A measured state as one in which a phase can begin: on its contacts, and with the speed that they leave."""

from __future__ import annotations

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.ocp import MotionProblem, numeric_physics
from fesd_robot.recovery import NumericPhysics


class MeasuredState:
    """Makes states of a task's system from configurations and velocities.

    Args:
        motion: the formulated task.
    """

    def __init__(self, motion: MotionProblem) -> None:
        self.physics: NumericPhysics = numeric_physics(motion)
        self._gap_states = motion.contact_system.gap_states
        self._rows, self._friction = self.physics.rows, self.physics.friction

    def in_modes(
        self, modes: list[ContactMode], time: float, q: np.ndarray, v: np.ndarray, predicted: np.ndarray
    ) -> np.ndarray:
        """Return the state x nearest to a measured one in which contacts do what their modes say, (n_x).

        Closed contacts have no gap and no normal velocity, sticking ones no velocity at all; others have no negative
        gap. Nearest is meant by the kinetic energy of the difference.

        Args:
            modes: of all contacts.
            time: s.
            q, v: measured, (n_q) and (n_v).
            predicted: the state that was expected; what cannot be measured is taken from it.
        """
        physics = self.physics
        closed = np.array([mode.closed for mode in modes], dtype=bool)
        q = np.array(q, dtype=float)
        for _ in range(2):
            gaps = physics.gaps(q)
            moved = closed | (gaps < 0.0)
            if not moved.any():
                break
            rows = physics.contact_jacobian(q)[:: self._rows][moved]
            q = physics.integrate(q, -_least(physics.mass_matrix(q), rows, gaps[moved]))
        held = np.zeros((len(modes), self._rows), dtype=bool)
        held[:, 0] = closed
        sticks = np.array([mode is ContactMode.STICK for mode in modes], dtype=bool)
        held[:, 1:] = (sticks & (self._friction > 0))[:, None]
        if held.any():
            rows = physics.contact_jacobian(q)[held.ravel()]
            v = v - _least(physics.mass_matrix(q), rows, rows @ v)
        x = predicted.copy()
        n_q, n_v = len(q), len(v)
        x[:n_q], x[n_q : n_q + n_v], x[n_q + n_v] = q, v, time
        if self._gap_states:
            gaps = np.where(closed, 0.0, np.maximum(physics.gaps(q), 0.0))
            x[n_q + n_v + 1 : n_q + n_v + 1 + self._gap_states] = gaps
        return x


def _least(mass: np.ndarray, rows: np.ndarray, amount: np.ndarray) -> np.ndarray:
    """Return the change d of least kinetic energy with J d = amount, in least squares."""
    response = np.linalg.solve(mass, rows.T)
    return response @ (np.linalg.pinv(rows @ response, rcond=1e-9) @ amount)
