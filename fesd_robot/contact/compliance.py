"""Compliant contact: a spring and a damper between two bodies that push and never pull."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact.kinds import COMPLIANT_FORCE
from fesd_robot.contact.model import Contact, ContactSystem, MultibodyDynamics


@dataclass(frozen=True)
class CompliantContact:
    """A contact without friction that gives way: its force is max(0, -k gap - d dgap/dt).

    Attributes:
        contact: name, gap and normal direction; its tangents have no part.
        stiffness: k, N/m, greater than 0.
        damping: d, N s/m, not negative.
    """

    contact: Contact
    stiffness: float
    damping: float

    @property
    def name(self) -> str:
        """Of the contact."""
        return self.contact.name

    def relief(self, velocity: ca.SX) -> ca.SX:
        """Return k gap + d J_n v, N, SX scalar: negative where the contact is compressed, then minus its force.

        Args:
            velocity: v, SX (n_v).
        """
        return self.stiffness * self.contact.gap + self.damping * ca.dot(self.contact.normal, velocity)


def with_compliance(
    contact_system: ContactSystem, dynamics: MultibodyDynamics, compliant: Sequence[CompliantContact], unit: float
) -> ContactSystem:
    """Return the contact system in which compliant contacts push, with an exact switch.

    With the relief r = k gap + d J_n v of a contact, and its part that is positive as a variable c,

        M v' = ... + J_n lambda,   0 <= lambda complementary to c = lambda + r >= 0

    Both sides are continuous in time, for r is a function of the state. So neither is positive at a point of a finite
    element, its left boundary included, in which the other one is: an element ends where the contact begins or ceases
    to push. The force has no impulse, and vanishes with the rate of the clock while that stands still.

    Args:
        contact_system: in multipliers, or with impulses.
        dynamics: of the robot.
        compliant: the contacts.
        unit: N, of lambda and c.

    Source: the linear complementarity form of a unilateral spring, Brogliato, Nonsmooth Mechanics (2016), section 2.1;
    its transcription follows Nurkanovic et al., arXiv 2205.05337.
    """
    if not compliant:
        return contact_system
    system, count = contact_system.system, len(compliant)
    force, apart = ca.SX.sym("compliant_force", count), ca.SX.sym("apart", count)
    relief = ca.vertcat(*[one.relief(dynamics.velocity) for one in compliant]) / unit
    first, n_v = dynamics.configuration.numel(), dynamics.velocity.numel()
    push = sum((unit * force[i] * one.contact.normal for i, one in enumerate(compliant)), ca.SX.zeros(n_v))
    right_hand_side = ca.SX(system.right_hand_side)
    right_hand_side[first : first + n_v] += contact_system.clock_rate * push
    reliefs = ca.Function("relief", [dynamics.configuration, dynamics.velocity], [relief])

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        values = np.asarray(reliefs(x[:first], x[first : first + n_v])).ravel()
        return np.concatenate([system.guess(x, u, p), np.maximum(-values, 0.0), np.maximum(values, 0.0)])

    return replace(
        contact_system,
        system=replace(
            system,
            right_hand_side=right_hand_side,
            algebraic=ca.vertcat(system.algebraic, force, apart),
            residual=ca.vertcat(system.residual, apart - force - relief),
            algebraic_lower=np.append(system.algebraic_lower, np.zeros(2 * count)),
            algebraic_upper=np.append(system.algebraic_upper, np.full(2 * count, np.inf)),
            guess=guess,
            algebraic_names=[
                *system.algebraic_names,
                *(f"force[{one.name}]" for one in compliant),
                *(f"apart[{one.name}]" for one in compliant),
            ],
            complementarities=[
                *system.complementarities,
                *(
                    Complementarity(Label(COMPLIANT_FORCE, contact=one.name), apart[i], force[i], continuous=True)
                    for i, one in enumerate(compliant)
                ),
            ],
        ),
        compliant_forces=[unit * one for one in ca.vertsplit(force)],
    )
