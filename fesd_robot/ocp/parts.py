"""The parts from which an optimal control problem is built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.contact import CompliantContact, Contact, ContactSystem, MultibodyDynamics, Surface
from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.constants import Constants
from fesd_robot.ocp.points import Points
from fesd_robot.ocp.reference_motion import ReferenceMotion
from fesd_robot.ocp.reference_spline import ReferenceSpline
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.ocp.vectors import Endpoints, StateLimits
from fesd_robot.task import Task

CLOSED = 1e-12
"""m; a gap that is not larger is none."""


@dataclass(frozen=True)
class ProblemParts:
    """Everything from which costs, constraints and bounds of a task are built.

    Attributes:
        contacts: that are rigid; compliant: those that give way.
        gap: q -> gaps of all rigid contacts, m.
        auxiliary_force: a_n, N.
        reference: the motion that the costs compare with; guess: the one that the solver starts from.
        compared: symbols of the reference configuration and the clock at the end of an interval, (n_q + 1); on a moving
            grid of a window of the reference.
        constants: symbols of the goal and of weights; values: of them, (n).
        reference_spline: the reference as a function of time that such windows are of.
    """

    task: Task
    dynamics: MultibodyDynamics
    actuation: Actuation
    contacts: Sequence[Contact]
    compliant: Sequence[CompliantContact]
    contact_system: ContactSystem
    ground: Surface
    gap: ca.Function
    auxiliary_force: float
    endpoints: Endpoints
    limits: StateLimits
    reference: ReferenceMotion
    guess: ReferenceMotion
    grid: TimeGrid
    points: Points
    compared: ca.SX
    constants: Constants
    values: np.ndarray
    reference_spline: ReferenceSpline

    def values_of(self, symbols: ca.SX) -> np.ndarray:
        """Return the values of some of the constants, (m)."""
        values = self.constants.read(symbols, self.values)
        assert values is not None
        return values

    @property
    def clock_index(self) -> int:
        """Index of the clock in the state."""
        return int(self.dynamics.configuration.numel() + self.dynamics.velocity.numel())

    @property
    def clock(self) -> ca.SX:
        """Symbol of the clock."""
        return self.contact_system.system.state[self.clock_index]

    @property
    def gap_states(self) -> int:
        """Number of integrated gaps in the state; they follow the clock."""
        return self.contact_system.gap_states

    @property
    def slip_limits(self) -> np.ndarray:
        """Largest distance, m, of every slip distance in the state; they follow the integrated gaps."""
        return np.array([contact.slip_distance for contact in self.contacts if contact.limits_slip])

    @cached_property
    def reference_configuration(self) -> ca.SX:
        """The reference that a state is compared with, (n_q): at the end of its interval or, on a moving grid, now."""
        names = self.dynamics.configuration_names
        if not self.grid.moving:
            return self.compared[: len(names)]
        pace = self.contact_system.system.control[-1] if self.grid.free else 1.0
        return self.reference_spline.expression(self.compared, self.clock / pace)

    def state(self, configuration: np.ndarray, velocity: np.ndarray, time: float) -> np.ndarray:
        """Return x of a configuration and velocity that has not slipped; gaps below the ground are closed.

        So are those that are above it by rounding alone.
        """
        gaps = np.asarray(self.gap(configuration)).ravel() if self.gap_states else np.zeros(0)
        gaps = np.where(gaps <= CLOSED, 0.0, gaps)
        return np.concatenate([configuration, velocity, [time], gaps, np.zeros(len(self.slip_limits))])

    def bounds(
        self, position: np.ndarray, velocity: np.ndarray, clock: float, gaps: float | np.ndarray, slip: np.ndarray
    ) -> np.ndarray:
        """Return a bound of x from those of its parts."""
        return np.concatenate([position, velocity, [clock], np.broadcast_to(gaps, self.gap_states), slip])
