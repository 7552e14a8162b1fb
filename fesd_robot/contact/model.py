"""Input and output of the contact layer: a mechanism, its contacts, and the time-freezing system made of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem

STICKING_MARGIN = 1e-3
"""Of its friction cone: what a contact that may not slip leaves unused while the clock runs. On the edge of
the cone mechanics does not say whether it slips, nor where to, and a replay follows every digit that is missing."""


@dataclass(frozen=True)
class MultibodyDynamics:
    """M(q) dv/dt = force(q, v, u), dq/dt = configuration_derivative(q, v), as SX expressions.

    Attributes:
        configuration, velocity, control: symbols q (n_q), v (n_v), u (n_u).
        configuration_derivative: (n_q); `mass_matrix`: (n_v, n_v); `force`: B u - h, (n_v).
        configuration_names, velocity_names, control_names: one name an entry.
        dry_friction: velocity coordinate -> limit F of its dry friction, N or N m, greater than 0; those not listed
            have none. The force -F Sgn(v) is no part of `force`.
        limit_surfaces: name -> velocity coordinates whose dry friction is bounded by one ellipsoid with their limits
            for its axes, instead of each by its own limit.
        one_at_a_time: name of a group -> name of a set -> its controls, never negative, of which those of one set act
            at a time.
    """

    configuration: ca.SX
    velocity: ca.SX
    control: ca.SX
    configuration_derivative: ca.SX
    mass_matrix: ca.SX
    force: ca.SX
    configuration_names: Sequence[str]
    velocity_names: Sequence[str]
    control_names: Sequence[str]
    dry_friction: Mapping[str, float] = field(default_factory=dict)
    limit_surfaces: Mapping[str, Sequence[str]] = field(default_factory=dict)
    one_at_a_time: Mapping[str, Mapping[str, Sequence[str]]] = field(default_factory=dict)

    @property
    def dry_friction_units(self) -> dict[str, tuple[str, ...]]:
        """Name of a joint with dry friction of its own, or of a limit surface -> its velocity coordinates."""
        shared = {name for names in self.limit_surfaces.values() for name in names}
        alone = {name: (name,) for name in self.velocity_names if name in self.dry_friction and name not in shared}
        return {**alone, **{name: tuple(names) for name, names in self.limit_surfaces.items()}}

    @property
    def dry_friction_limits(self) -> np.ndarray:
        """Limit of the dry friction of every velocity coordinate, N or N m, (n_v); zero where there is none."""
        return np.array([self.dry_friction.get(name, 0.0) for name in self.velocity_names])


@dataclass(frozen=True)
class Contact:
    """A contact, in the plane or in space.

    Attributes:
        name: of the contact.
        gap: f_c(q), m, SX scalar.
        normal: J_n in velocity space, SX (n_v): df_c/dt = J_n v.
        tangents: J_t^T in velocity space, SX (n_v, n_t), one column a direction: one in the plane, two at right angles
            in space; J_t v is the tangential velocity, (n_t).
        friction: coefficient mu of Coulomb's law.
        slip_distance: length of the path, m, that it may slip while the clock runs: 0 if it may not, infinite without a
            limit.
        restitution: coefficient e of restitution, 0 to 1: a contact that hits with a normal velocity v parts with -e v.
        reserve: part of the cone of friction that a plan leaves unused where it sticks, 0 to less than 1.
    """

    name: str
    gap: ca.SX
    normal: ca.SX
    tangents: ca.SX
    friction: float
    slip_distance: float = math.inf
    restitution: float = 0.0
    reserve: float = 0.0

    @property
    def directions(self) -> list[ca.SX]:
        """The columns of `tangents`, (n_v) each."""
        return list(ca.horzsplit(self.tangents))

    @property
    def in_space(self) -> bool:
        """Whether it may slip in two directions."""
        return self.tangents.shape[1] == 2

    def tangential_velocities(self, velocity: ca.SX) -> list[ca.SX]:
        """Return J_t v, m/s, one SX scalar a direction."""
        return [ca.dot(direction, velocity) for direction in self.directions]

    @property
    def comes_to_rest(self) -> bool:
        """Whether it sticks wherever it stays closed, also after an impact: it may neither slip nor bounce."""
        return self.slip_distance == 0 and self.restitution == 0

    @property
    def usable_friction(self) -> float:
        """Coefficient of the friction that a plan uses, (1 - r) mu of a contact that comes to rest, else mu.

        In the plane r is at least `STICKING_MARGIN`; in space the cone itself leaves so much while the clock runs.

        One that slides has all of its friction by Coulomb's law. Where a contact comes to rest in an impact, its
        impulse follows from that, however the slide before has ended: less friction leads there, too, and leaves the
        reserve unused in the impulse as a whole.
        """
        kept = self.reserve if self.in_space else max(self.reserve, STICKING_MARGIN)
        return self.friction * (1 - kept) if self.comes_to_rest else self.friction

    @property
    def sticking_reserve(self) -> float:
        """Part of `usable_friction` that it leaves unused where it sticks."""
        return 0.0 if self.comes_to_rest else self.reserve

    @property
    def limits_slip(self) -> bool:
        """Whether it may slip, but not without end."""
        return 0 < self.slip_distance < math.inf


@dataclass(frozen=True)
class AuxiliaryMultipliers:
    """Filippov multipliers of a contact's auxiliary fields.

    Attributes:
        sides: (theta_+, theta_-) of every tangential direction, SX in z; plus belongs to J_t v > 0. All pairs have the
            same sum beta.
        spares: algebraic variables that are not negative where the contact sticks and keeps its reserve: one a side of
            the first direction, in space one for the cone; none without a reserve.
    """

    sides: tuple[tuple[ca.SX, ca.SX], ...]
    spares: tuple[ca.SX, ...] = ()

    @property
    def normal(self) -> ca.SX:
        """beta: what pushes along the normal."""
        plus, minus = self.sides[0]
        return plus + minus

    @property
    def tangential(self) -> list[ca.SX]:
        """theta_- - theta_+ of every direction: what pushes along it, in units of mu."""
        return [minus - plus for plus, minus in self.sides]


@dataclass(frozen=True)
class StepOptions:
    """Which variant of the step form is built.

    Args:
        gap: ``integrated`` switches on the state p with p' = theta_ODE s (J_n v + kappa (f_c - p)); ``true`` on f_c(q).
        gate: let velocity signs count at the ground only.
        regularisation_weight: epsilon of epsilon ||alpha||^2 at every stage.
    """

    gap: Literal["integrated", "true"] = "integrated"
    gate: bool = True
    regularisation_weight: float = 1e-3


@dataclass(frozen=True)
class ContactOptions:
    """Which form of the contact logic is built.

    Args:
        transcription: ``freezing``: the clock stands still in impacts; ``impulses``: the velocity jumps between the
            elements, whatever the form.
        form: ``multipliers``: the Filippov multipliers of the auxiliary fields are the variables; ``steps``:
            set-valued step functions of gap and velocities, as published.
        baumgarte_gain: kappa, 1/s, of the integrated gap.
        auxiliary_force: a_n, N per unit of J_n, force of the auxiliary fields.
        steps: variant of the form ``steps``.
    """

    transcription: Literal["freezing", "impulses"] = "freezing"
    form: Literal["multipliers", "steps"] = "multipliers"
    baumgarte_gain: float = 30.0
    auxiliary_force: float = 100.0
    steps: StepOptions = field(default_factory=StepOptions)


@dataclass(frozen=True)
class ContactSystem:
    """A time-freezing system and the expressions that lead back to physics.

    The state is y = (q, v, t, p_1..p_nc, d_1..d_nd), the control (u, s) with the speed of time s last. There is a slip
    distance d for every contact that limits it, in the order of the contacts.

    Attributes:
        system: the complementarity system.
        theta_ode: Filippov multiplier of free motion, SX in z; zero while the clock stands still.
        theta_auxiliary: multipliers of each contact's auxiliary fields.
        clock_rate: theta_ode * s = dt/dtau.
        theta_error: largest deviation of the multipliers from their definition; for one contact this is
            |theta_ODE + theta_+ + theta_- - 1|.
        integrated_gap: whether the p states exist.
        gap_lower: lower bound of the p states, m.
        theta_joints: (plus, minus) shares of the clock's rate of each velocity coordinate with dry friction, in the
            order of the coordinates, SX in z; minus F (plus - minus) / theta_ODE is its force.
        impulses: of each contact at the left boundary of an element, N s, SX in the y of the system's jump; none where
            impacts take numerical time.
        compliant_forces: normal force of every compliant contact, N, SX in z.
    """

    system: ComplementaritySystem
    theta_ode: ca.SX
    theta_auxiliary: list[AuxiliaryMultipliers]
    clock_rate: ca.SX
    theta_error: ca.SX
    integrated_gap: bool
    gap_lower: float
    theta_joints: Sequence[tuple[ca.SX, ca.SX]] = ()
    impulses: Sequence[AuxiliaryMultipliers] = ()
    compliant_forces: Sequence[ca.SX] = ()

    @property
    def clock_stops(self) -> bool:
        """Whether the clock stands still during impacts, instead of never."""
        return not self.impulses

    @property
    def gap_states(self) -> int:
        """Number of integrated gaps in the state."""
        return len(self.theta_auxiliary) if self.integrated_gap else 0
