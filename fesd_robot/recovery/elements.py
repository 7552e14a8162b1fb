"""Contacts and forces of one finite element, from its Filippov multipliers and the branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.contact import (
    CompliantContact,
    Contact,
    ContactMode,
    ContactSystem,
    MultibodyDynamics,
    acting_impulses,
    contact_modes,
    joint_modes,
)
from fesd_robot.fesd import Element, Tableau
from fesd_robot.instants import SAME_TIME
from fesd_robot.orientations import with_unit_quaternions
from fesd_robot.recovery.between import FRACTIONS, DenseElement
from fesd_robot.recovery.contact_rows import IN_THE_PLANE

FROZEN_MULTIPLIER = 1e-2
"""An element whose free-flow multiplier theta_ODE stays below this is an impact: its clock stands still."""

SLIP_VELOCITY = 1e-3
"""Tangential velocity, m/s, below which a contact that could slip is said to stick."""


JointsAtPoint = tuple[np.ndarray, Sequence[ContactMode]]
"""Force of the dry friction of joints, N or N m, (n_f), and their modes, (n_f)."""

ComplianceAtPoint = tuple[np.ndarray, Sequence[ContactMode]]
"""Normal force of compliant contacts, N, (n_s), and their modes, (n_s)."""


@dataclass(frozen=True)
class ElementPhysics:
    """Physics of one element.

    Attributes:
        frozen: the clock stands still.
        force: normal and tangential force of every contact at the points, N, (points, n_c, rows).
        impulse: their integral over a frozen element, or impulses at the left boundary, N s, (n_c, rows).
        rate: theta_ODE s = dt/dtau at the points, (points,).
        modes: that every contact shows, `SLIP_VELOCITY`; empty if frozen.
        branch_modes: of the branch, also where a contact that could slip does not; empty if frozen.
        theta_error: largest deviation of the multipliers from their definition.
        joint_force: dry friction of every joint that has some at the points, N or N m, (points, n_f).
        joint_modes: that these joints show, stick or a direction of slip; all coordinates of a limit surface the same;
            empty if frozen.
        joint_branch_modes: those of the branch; empty if frozen.
        compliant_force: normal force of every compliant contact at the points, N, (points, n_s).
        compliant_modes: of these, flight or touch; empty if frozen.
    """

    frozen: bool
    force: np.ndarray
    impulse: np.ndarray
    rate: np.ndarray
    modes: list[ContactMode]
    branch_modes: list[ContactMode]
    theta_error: float
    joint_force: np.ndarray
    joint_modes: list[ContactMode]
    joint_branch_modes: list[ContactMode]
    compliant_force: np.ndarray
    compliant_modes: list[ContactMode]

    def at_joints(self, point: int) -> JointsAtPoint:
        """Return dry friction and modes of the joints at a point."""
        return self.joint_force[point], self.joint_modes


class ElementReader:
    """Reads physics off an element's variables and its branch.

    Args:
        tableau: scheme of the elements.
        dynamics, contacts: of which the contact system was made.
        contact_system: the time-freezing system.
        auxiliary_force: a_n, N.
        branch: of the trajectory, one entry an element.
        compliant: contacts that give way, of which the system was made, too.
    """

    def __init__(
        self,
        tableau: Tableau,
        dynamics: MultibodyDynamics,
        contacts: Sequence[Contact],
        contact_system: ContactSystem,
        auxiliary_force: float,
        branch: Branch,
        compliant: Sequence[CompliantContact] = (),
    ) -> None:
        self.tableau = tableau
        self.n_q, self.n_v = dynamics.configuration.numel(), dynamics.velocity.numel()
        self._names_of_q = dynamics.configuration_names
        self.n_c = len(contacts)
        self._gap_states = contact_system.gap_states
        self._names = [contact.name for contact in contacts]
        self._branch = branch
        self._auxiliary_force = auxiliary_force
        self._friction = np.array([contact.usable_friction for contact in contacts])
        self.rows = 1 + len(contacts[0].directions) if contacts else IN_THE_PLANE
        shares_of_contacts = [ca.horzcat(own.normal, *own.tangential) for own in contact_system.theta_auxiliary]
        multipliers = ca.vertcat(ca.SX(0, self.rows), *shares_of_contacts)
        shares = ca.vertcat(ca.SX(0, 1), *[plus - minus for plus, minus in contact_system.theta_joints])
        self.friction_coordinates = np.flatnonzero(dynamics.dry_friction_limits)
        self._dry_friction = dynamics.dry_friction_limits[self.friction_coordinates]
        coordinates = [dynamics.velocity_names[int(row)] for row in self.friction_coordinates]
        self._rubbing = {
            name: np.array([coordinates.index(one) for one in own]) for name, own in dynamics.dry_friction_units.items()
        }
        self._multipliers = ca.Function(
            "multipliers",
            [contact_system.system.algebraic],
            [
                contact_system.theta_ode,
                multipliers,
                contact_system.theta_error,
                shares,
                ca.densify(ca.vertcat(ca.SX(0, 1), *contact_system.compliant_forces)),
            ],
        )
        self._compliant_names = [one.name for one in compliant]
        self._relief = ca.Function(
            "relief",
            [dynamics.configuration, dynamics.velocity],
            [ca.densify(ca.vertcat(ca.SX(0, 1), *[one.relief(dynamics.velocity) for one in compliant]))],
        )
        jump, impulses = contact_system.system.jump, contact_system.impulses
        self._jump = None
        if jump is not None:
            pushes = [
                ca.horzcat(own.normal, c.usable_friction * own.tangential[0])
                for own, c in zip(impulses, contacts, strict=True)
            ]
            self._jump = ca.Function("impulses", [jump.symbols], [ca.densify(ca.vertcat(ca.SX(0, self.rows), *pushes))])
        slips = [ca.horzcat(*contact.tangential_velocities(dynamics.velocity)) for contact in contacts]
        self._tangential_velocities = ca.Function(
            "tangential_velocities",
            [dynamics.configuration, dynamics.velocity],
            [ca.vertcat(ca.SX(0, self.rows - 1), *slips)],
        )

    def clock(self, x: np.ndarray) -> float:
        """Return the physical time of a state."""
        return float(x[self.n_q + self.n_v])

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return configuration, with unit quaternions, velocity and integrated gaps of a state.

        The dynamics see the direction of a quaternion only; what the scheme lets its length drift by is left out.
        """
        n = self.n_q + self.n_v
        q = with_unit_quaternions(self._names_of_q, x[: self.n_q])
        return q, x[self.n_q : n], x[n + 1 : n + 1 + self._gap_states]

    def joints_of_state(self, velocity: np.ndarray) -> JointsAtPoint:
        """Return no friction, and the modes that velocities show: of a state that is followed by no motion."""
        speeds = velocity[self.friction_coordinates]
        modes = [ContactMode.STICK] * len(speeds)
        for own in self._rubbing.values():
            for i in own:
                modes[i] = _observed(ContactMode.SLIP, speeds[None, own])
        return np.zeros(len(speeds)), modes

    def compliance_of_state(
        self, q: np.ndarray, v: np.ndarray, modes: Sequence[ContactMode] | None = None
    ) -> ComplianceAtPoint:
        """Return force and modes of compliant contacts in a state; the modes are those of an element if given."""
        relief = np.asarray(self._relief(q, v)).ravel()
        own = [ContactMode.TOUCH if one < 0 else ContactMode.FLIGHT for one in relief] if modes is None else modes
        flies = np.array([mode is ContactMode.FLIGHT for mode in own], dtype=bool)
        return np.where(flies, 0.0, np.maximum(-relief, 0.0)), own

    def read(self, number: int, element: Element) -> ElementPhysics:
        """Return the physics of an element, the `number`-th of the trajectory.

        Forces are ``lambda_n = a_n beta / rate`` and ``lambda_t = mu a_n (theta_- - theta_+) / rate``,
        the dry friction of a joint is ``-F (pi_+ - pi_-) / theta_ODE``.
        """
        values = [self._multipliers(z) for z in element.z]
        theta = np.array([float(value[0]) for value in values])
        shares = np.array([np.asarray(ca.DM(value[1]).full()) for value in values])
        push = self._auxiliary_force * np.concatenate(
            [shares[:, :, :1], self._friction[:, None] * shares[:, :, 1:]], axis=2
        )
        stages = self.tableau.stages
        rate = theta * element.u[-1]
        advance = self.clock(element.x[-1]) - self.clock(element.x_left)
        frozen = bool(theta[:stages].max() < FROZEN_MULTIPLIER or advance < SAME_TIME)
        modes, branch_modes = ([], []) if frozen else self._modes(number, element)
        joint_modes, joint_branch_modes = ([], []) if frozen else self._joint_modes(number, element)
        of_joints = np.array([np.asarray(value[3]).ravel() for value in values])
        return ElementPhysics(
            frozen=frozen,
            force=push / np.maximum(rate, 1e-300)[:, None, None],
            impulse=self._impulse(number, element, push[:stages]),
            rate=rate,
            modes=modes,
            branch_modes=branch_modes,
            theta_error=max(float(value[2]) for value in values),
            joint_force=-self._dry_friction * of_joints / np.maximum(theta, 1e-300)[:, None],
            joint_modes=joint_modes,
            joint_branch_modes=joint_branch_modes,
            compliant_force=np.array([np.asarray(value[4]).ravel() for value in values]),
            compliant_modes=[] if frozen else self._compliant_modes(number),
        )

    @property
    def first_of_units(self) -> set[int]:
        """Numbers of the coordinates with dry friction that stand for their limit surface, or for themselves."""
        return {int(own[0]) for own in self._rubbing.values()}

    def _impulse(self, number: int, element: Element, push: np.ndarray) -> np.ndarray:
        """Return the impulse of every contact, (n_c, rows): where the velocity jumps, of those that act."""
        if self._jump is None:
            return np.asarray(element.step * np.tensordot(self.tableau.b, push, axes=1))
        acting = acting_impulses(self._branch, number)
        acts = np.array([acting[name] for name in self._names], dtype=bool)
        return np.where(acts[:, None], np.asarray(self._jump(element.jump)), 0.0)

    def between(self, element: Element, physics: ElementPhysics) -> DenseElement:
        """Return the states of an element at `FRACTIONS` of it, from its collocation polynomial."""
        x = self.tableau.interpolate(np.vstack([element.x_left, element.x[: self.tableau.stages]]), FRACTIONS)
        n = self.n_q + self.n_v
        return DenseElement(
            time=x[:, n],
            configuration=with_unit_quaternions(self._names_of_q, x[:, : self.n_q]),
            velocity=x[:, self.n_q : n],
            interval=element.interval,
            control=element.u[:-1],
            mode=physics.branch_modes,
            joint_mode=physics.joint_branch_modes,
        )

    def _modes(self, number: int, element: Element) -> tuple[list[ContactMode], list[ContactMode]]:
        """Return the modes that contacts show and those of the branch, with a direction of slip if there is friction.

        The velocity at the stages decides what the branch leaves open.
        """
        stages = [self.split(x)[:2] for x in element.x[: self.tableau.stages]]
        velocity = np.array([np.asarray(ca.DM(self._tangential_velocities(q, v)).full()) for q, v in stages])
        modes = contact_modes(self._branch, number)
        planned = [modes[name] for name in self._names]
        shown = [_observed(mode, velocity[:, i]) for i, mode in enumerate(planned)]
        closed = [s if p is ContactMode.IMPACT else p for p, s in zip(planned, shown, strict=True)]
        return shown, closed

    def _compliant_modes(self, number: int) -> list[ContactMode]:
        """Return the modes of compliant contacts in an element."""
        modes = contact_modes(self._branch, number)
        return [modes[name] for name in self._compliant_names]

    def _joint_modes(self, number: int, element: Element) -> tuple[list[ContactMode], list[ContactMode]]:
        """Return the modes that joints with dry friction show and those of the branch."""
        velocity = np.array([self.split(x)[1][self.friction_coordinates] for x in element.x[: self.tableau.stages]])
        shown, planned = [ContactMode.STICK] * velocity.shape[1], [ContactMode.STICK] * velocity.shape[1]
        for name, mode in joint_modes(self._branch, number).items():
            for i in self._rubbing[name]:
                shown[i], planned[i] = _observed(mode, velocity[:, self._rubbing[name]]), mode
        return shown, planned


def _observed(mode: ContactMode, velocity: np.ndarray) -> ContactMode:
    """Return the mode that a contact shows: one that could slip and does not, its force on the cone, sticks.

    Args:
        mode: of the branch.
        velocity: tangential, at the stages, (n_s, n_t).
    """
    if mode in (ContactMode.FLIGHT, ContactMode.STICK):
        return mode
    if np.linalg.norm(velocity, axis=1).max() < SLIP_VELOCITY:
        return ContactMode.STICK
    if mode in (ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS) or velocity.shape[1] > 1:
        return mode.running
    return ContactMode.SLIP_FORWARDS if velocity.sum() > 0 else ContactMode.SLIP_BACKWARDS
