"""The way back from finite elements in numerical time to motion in physical time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.contact import CompliantContact, Contact, ContactSystem, MultibodyDynamics
from fesd_robot.fesd import Element, Tableau
from fesd_robot.recovery.between import DenseSamples, stacked_elements
from fesd_robot.recovery.elements import ElementReader
from fesd_robot.recovery.samples import ImpactRecord, Samples
from fesd_robot.recovery.switches import SwitchRecord, switches_between


@dataclass(frozen=True)
class JointFriction:
    """Dry friction of joints along the n samples of a motion; n_f joints have some.

    Attributes:
        rows: their velocity coordinates, (n_f).
        limit: F, N or N m, (n_f).
        force: of the friction on the joint, N or N m, (n, n_f).
        mode: `ContactMode`, stick or slip, (n, n_f).
        switches: changes between sticking and sliding in time order; their contact is a number of a joint, the first of
            those on one limit surface.
    """

    rows: np.ndarray
    limit: np.ndarray
    force: np.ndarray
    mode: np.ndarray
    switches: list[SwitchRecord]


@dataclass(frozen=True)
class Compliance:
    """Compliant contacts along the n samples of a motion; there are n_s of them.

    Attributes:
        force: normal force, N, (n, n_s).
        mode: `ContactMode`, flight or touch, (n, n_s).
        switches: where they begin and cease to push, in time order; their contact is a number of a compliant one.
    """

    force: np.ndarray
    mode: np.ndarray
    switches: list[SwitchRecord]


@dataclass(frozen=True)
class PhysicalMotion:
    """A trajectory in physical time as arrays; n samples, n_c contacts.

    Attributes:
        time: (n,), s; an impact has two samples at the same time, before and after.
        configuration, velocity: (n, n_q), (n, n_v).
        acceleration: (n, n_v), derivative of the collocation polynomial by the clock; NaN where a sample is no stage.
        weight: (n,), s, quadrature weight of the sample in physical time.
        interval: (n,), control interval of each sample.
        control: (n, n_u), without the speed of time.
        force: (n, n_c, rows), normal and tangential, N; two rows in the plane, three in space.
        gap_state: (n, n_c), integrated gap, m; (n, 0) if there is none.
        mode: (n, n_c) of `ContactMode`: flight, impact, stick or slip, without its direction.
        impacts, switches: in time order.
        clock: physical time at the end of every control interval, (N,).
        theta_sum_error: largest deviation of the multipliers from their definition and their sum from one.
        between: states between the stages, which are no samples.
        joints: dry friction of joints; None if none has any.
        compliance: compliant contacts, which are not among the n_c; None if there is none.
    """

    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    weight: np.ndarray
    interval: np.ndarray
    control: np.ndarray
    force: np.ndarray
    gap_state: np.ndarray
    mode: np.ndarray
    impacts: list[ImpactRecord]
    switches: list[SwitchRecord]
    clock: np.ndarray
    theta_sum_error: float
    between: DenseSamples
    joints: JointFriction | None = None
    compliance: Compliance | None = None

    def dry_friction(self, sample: int) -> np.ndarray:
        """Return the force of dry friction on every velocity coordinate at a sample, N or N m, (n_v)."""
        force = np.zeros(self.velocity.shape[1])
        if self.joints is not None:
            force[self.joints.rows] = self.joints.force[sample]
        return force

    @property
    def states(self) -> States:
        """All samples, and behind them the states between stages."""
        dense = self.between
        count, points = dense.time.shape
        return States(
            time=np.concatenate([self.time, dense.time.ravel()]),
            interval=np.concatenate([self.interval, np.repeat(dense.interval, points)]),
            configuration=np.vstack(
                [self.configuration, dense.configuration.reshape(count * points, self.configuration.shape[1])]
            ),
            velocity=np.vstack([self.velocity, dense.velocity.reshape(count * points, self.velocity.shape[1])]),
        )


@dataclass(frozen=True)
class States:
    """States of a motion in no order.

    Attributes:
        time, interval: s and number of the control interval, (n,).
        configuration, velocity: (n, n_q), (n, n_v).
    """

    time: np.ndarray
    interval: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray


def recover(
    elements: Sequence[Element],
    branch: Branch,
    tableau: Tableau,
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    contact_system: ContactSystem,
    auxiliary_force: float,
    compliant: Sequence[CompliantContact] = (),
) -> PhysicalMotion:
    """Return the motion in physical time: frozen phases removed, both sides of an impact kept.

    Forces follow from the Filippov multipliers, ``lambda_n = a_n beta / (theta_ODE s)`` and
    ``lambda_t = mu a_n (theta_- - theta_+) / (theta_ODE s)``; impulses are a_n beta integrated over a frozen phase.
    What every contact does is read from the branch.

    Args:
        elements: solved finite elements in time order.
        branch: on which they lie, as polishing found it or as `BranchTranscription.branch` reads it.
        tableau: scheme of the elements.
        dynamics, contacts: as given to `contact_system`.
        contact_system: the time-freezing system.
        auxiliary_force: a_n, N.
        compliant: contacts that give way.

    Source: Nurkanovic et al., arXiv 2111.06759, section 4 (recovering the solution in physical time).
    """
    reader = ElementReader(tableau, dynamics, contacts, contact_system, auxiliary_force, branch, compliant)
    samples = Samples(reader)
    theta_error, clock = 0.0, []
    for number, element in enumerate(elements):
        physics = reader.read(number, element)
        theta_error = max(theta_error, physics.theta_error)
        if physics.frozen:
            samples.add_impulse(element, physics.impulse)
        else:
            if element.jump.size and physics.impulse.any():
                samples.add_impulse(element, physics.impulse)
            samples.add_motion(element, physics)
        if number + 1 == len(elements) or elements[number + 1].interval != element.interval:
            clock.append(reader.clock(element.x[-1]))
    samples.close(elements[-1])
    columns, rows = samples.stacked(), reader.friction_coordinates
    of_joints = columns.pop("joint_force"), columns.pop("joint_mode")
    of_compliant = columns.pop("compliant_force"), columns.pop("compliant_mode")
    limits = dynamics.dry_friction_limits[rows]
    switches = [one for one in switches_between(samples.joint_phases) if one.contact in reader.first_of_units]
    joints = JointFriction(rows, limits, *of_joints, switches) if rows.size else None
    return PhysicalMotion(
        **columns,
        joints=joints,
        compliance=Compliance(*of_compliant, switches_between(samples.compliant_phases)) if compliant else None,
        between=stacked_elements(samples.between, (reader.n_q, reader.n_v, len(elements[0].u) - 1, reader.n_c)),
        impacts=samples.impacts,
        switches=switches_between(samples.phases),
        clock=np.array(clock),
        theta_sum_error=theta_error,
    )
