"""Gains that hold a robot to its plan, by name and with units."""

from __future__ import annotations

from typing import Literal

import numpy as np

from fesd_robot.plans.record import Array, Arrays, Record


class ReferenceSegment(Record):
    """A plan with gains between two landings, at n instants; the control and the gain hold until the next one.

    Attributes:
        landed: contacts that fly before it and land at its beginning; none for the first one.
        time: s, (n,), from one landing to the next, both included.
        configuration, velocity: of the plan, (n, n_q) and (n, n_v).
        control: feed-forward u_ref, (n, n_u).
        gain: K, (n, n_u, 2 n_v): displacements before velocities.
    """

    landed: list[str]
    time: Array
    configuration: Arrays
    velocity: Arrays
    control: Arrays
    gain: Arrays


class TrackingGains(Record):
    """Feedback along a plan.

        u = u_ref - K e,   e = (q (-) q_ref, v - v_ref)

    The displacement q (-) q_ref is Pinocchio's difference from q_ref to q: the plain one of joints, and of free flyers,
    quaternions and turned axes that in the tangent space of q_ref.

    Attributes:
        plan: name of the plan.
        kind: ``lqr``, ``pd`` or ``open-loop``.
        configuration_names, velocity_names, control_names, contact_names: order of the entries.
        velocity_units: ``m/s`` or ``rad/s``, one a velocity coordinate; a displacement is in m or rad.
        control_units: ``N`` or ``N m``, one a control; an entry of K is in this per unit of its entry of e.
        lower, upper: limits of the controls, N or N m, (n_u,).
        segments: from landing to landing, in the order of time.
    """

    plan: str
    kind: Literal["lqr", "pd", "open-loop"]
    configuration_names: list[str]
    velocity_names: list[str]
    control_names: list[str]
    contact_names: list[str]
    velocity_units: list[str]
    control_units: list[str]
    lower: Array
    upper: Array
    segments: list[ReferenceSegment]

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s."""
        return float(self.segments[0].time[0]), float(self.segments[-1].time[-1])

    @property
    def departure_names(self) -> list[str]:
        """Names of the entries of e, displacements before velocities."""
        return [*self.velocity_names, *(f"{name} velocity" for name in self.velocity_names)]

    @property
    def departure_units(self) -> list[str]:
        """Units of the entries of e."""
        return [*(unit.removesuffix("/s") for unit in self.velocity_units), *self.velocity_units]

    def stacked(self, name: str) -> np.ndarray:
        """Return an array of all segments one after the other: ``time``, ``configuration``, ``gain`` and so on."""
        return np.concatenate([getattr(each, name) for each in self.segments])

    @property
    def segment_numbers(self) -> np.ndarray:
        """Number of the segment of every instant, (n,)."""
        return np.repeat(np.arange(len(self.segments)), [len(each.time) for each in self.segments])
