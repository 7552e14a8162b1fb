"""The way back from finite elements in numerical time to motion in physical time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.contact.model import ContactSystem, MultibodyDynamics, PlanarContact
from fesd_robot.fesd import Element, Tableau
from fesd_robot.recovery.switches import Phase, SwitchRecord, switches_between

FROZEN = 1e-2
"""An element whose free share theta_ODE stays below this is an impact: its clock stands still."""

COLLAPSED = 1e-9
"""An element whose clock advances by less than this many seconds is no motion of its own."""

SLIP_VELOCITY = 1e-3
"""Tangential speed, m/s, above which a closed contact slips."""

JUMP = 1e-6
"""Change of a velocity, m/s or rad/s, over frozen elements above which they are an impact."""

IMPULSE_SHARE = 1e-3
"""Share of the largest impulse above which a contact takes part in an impact."""


@dataclass(frozen=True)
class ImpactRecord:
    """One impact: samples before and after, impulse (normal, tangential) of every contact, N s, shape (n_c, 2)."""

    before: int
    after: int
    impulse: np.ndarray


@dataclass(frozen=True)
class PhysicalMotion:
    """A trajectory in physical time as arrays; n samples, n_c contacts.

    Attributes:
        time: (n,), s; an impact stands twice.
        configuration, velocity: (n, n_q), (n, n_v).
        acceleration: (n, n_v), derivative of the collocation polynomial by the clock; NaN where a sample is no stage.
        weight: (n,), s, quadrature weight of the sample in physical time.
        interval: (n,), control interval of each sample.
        control: (n, n_u), without the speed of time.
        force: (n, n_c, 2), normal and tangential, N.
        gap_state: (n, n_c), integrated gap, m; (n, 0) if there is none.
        mode: (n, n_c) of ``flight``, ``impact``, ``stick``, ``slip``.
        impacts, switches: in time order.
        clock: physical time at the end of every control interval, (N,).
        theta_sum_error: largest deviation of the multipliers from their definition and their sum from one.
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


def recover(
    elements: Sequence[Element],
    tableau: Tableau,
    dynamics: MultibodyDynamics,
    contacts: Sequence[PlanarContact],
    contact_system: ContactSystem,
    auxiliary_force: float,
) -> PhysicalMotion:
    """Return the motion in physical time: frozen phases removed, both sides of an impact kept.

    Forces follow from the shares of the fields, lambda_n = a_n beta / (theta_ODE s) and
    lambda_t = mu lambda_n (1 - 2 alpha_t); impulses are a_n beta integrated over a frozen phase.

    Args:
        elements: solved finite elements in time order.
        dynamics, contacts: as given to `contact_system`.

    Source: Nurkanovic et al., arXiv 2111.06759, section 4 (recovering the solution in physical time).
    """
    reader = _ElementReader(tableau, dynamics, contacts, contact_system, auxiliary_force)
    samples = _Samples(reader)
    theta_error, clock = 0.0, []
    for index, element in enumerate(elements):
        share = reader.read(element)
        theta_error = max(theta_error, share.theta_error)
        if share.frozen:
            samples.add_impulse(element, share.impulse)
        else:
            samples.add_motion(element, share)
        if index + 1 == len(elements) or elements[index + 1].interval != element.interval:
            clock.append(reader.clock(element.x[-1]))
    samples.close(elements[-1])
    return PhysicalMotion(
        **samples.stacked(),
        impacts=samples.impacts,
        switches=switches_between(samples.phases),
        clock=np.array(clock),
        theta_sum_error=theta_error,
    )


@dataclass(frozen=True)
class _Share:
    """What the fields do in one element: forces at its points, impulse if frozen, and the contacts' modes."""

    frozen: bool
    force: np.ndarray
    impulse: np.ndarray
    rate: np.ndarray
    mode: list[str]
    theta_error: float


class _ElementReader:
    """Reads physics off an element's variables."""

    def __init__(
        self,
        tableau: Tableau,
        dynamics: MultibodyDynamics,
        contacts: Sequence[PlanarContact],
        contact_system: ContactSystem,
        auxiliary_force: float,
    ) -> None:
        self.tableau = tableau
        self.n_q, self.n_v = dynamics.configuration.numel(), dynamics.velocity.numel()
        self.n_c = len(contacts)
        self._strength = auxiliary_force
        self._friction = np.array([contact.friction for contact in contacts])
        shares = ca.vertcat(*[ca.horzcat(*both) for both in contact_system.theta_auxiliary])
        self._shares = ca.Function(
            "shares",
            [contact_system.system.algebraic],
            [contact_system.theta_ode, shares, contact_system.theta_error],
        )
        self._kinematics = ca.Function(
            "kinematics",
            [dynamics.configuration, dynamics.velocity],
            [
                ca.vertcat(*[contact.gap for contact in contacts]),
                ca.vertcat(*[ca.dot(contact.tangent, dynamics.velocity) for contact in contacts]),
            ],
        )

    def clock(self, x: np.ndarray) -> float:
        """Physical time of a state."""
        return float(x[self.n_q + self.n_v])

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Configuration, velocity, integrated gaps of a state."""
        n = self.n_q + self.n_v
        return x[: self.n_q], x[self.n_q : n], x[n + 1 :]

    def read(self, element: Element) -> _Share:
        """Return what the fields do in an element."""
        values = [self._shares(z) for z in element.z]
        theta = np.array([float(value[0]) for value in values])
        both = np.array([np.asarray(ca.DM(value[1]).full()).reshape(self.n_c, 2) for value in values])
        push = self._strength * np.stack([both.sum(axis=2), self._friction * (both[:, :, 1] - both[:, :, 0])], axis=2)
        stages = self.tableau.stages
        rate = theta * element.u[-1]
        advance = self.clock(element.x[-1]) - self.clock(element.x_left)
        frozen = bool(theta[:stages].max() < FROZEN or advance < COLLAPSED)
        return _Share(
            frozen=frozen,
            force=push / np.maximum(rate, 1e-300)[:, None, None],
            impulse=element.step * np.tensordot(self.tableau.b, push[:stages], axes=1),
            rate=rate,
            mode=[] if frozen else self._modes(element, both[:stages].sum(axis=2)),
            theta_error=max(float(value[2]) for value in values),
        )

    def _modes(self, element: Element, beta: np.ndarray) -> list[str]:
        """The side of each pair gap _|_ beta that is not zero: flight where the gap, in m, is the larger one."""
        points = element.x[: self.tableau.stages]
        kinematics = [self._kinematics(*self.split(x)[:2]) for x in points]
        integrated = np.array([self.split(x)[2] for x in points])
        gap = integrated if integrated.size else np.array([np.asarray(value[0]).ravel() for value in kinematics])
        speed = np.array([np.asarray(value[1]).ravel() for value in kinematics])
        modes = []
        for i in range(self.n_c):
            if beta[:, i].max() <= max(gap[:, i].max(), 1e-12):
                modes.append("flight")
            elif np.abs(speed[:, i]).max() < SLIP_VELOCITY:
                modes.append("stick")
            else:
                modes.append("slip+" if speed[:, i].sum() > 0 else "slip-")
        return modes


class _Samples:
    """Collects samples, impacts and phases in time order."""

    def __init__(self, reader: _ElementReader) -> None:
        self._reader = reader
        self._rows: list[dict[str, object]] = []
        self._pending = np.zeros((reader.n_c, 2))
        self._provisional = False
        self.impacts: list[ImpactRecord] = []
        self.phases: list[Phase] = []

    def add_impulse(self, element: Element, impulse: np.ndarray) -> None:
        """A frozen or collapsed element."""
        if not self._rows:
            n_c, self._provisional = self._reader.n_c, True
            self._append(element.x_left, element, np.zeros((n_c, 2)), ["flight"] * n_c)
        self._pending += impulse

    def add_motion(self, element: Element, share: _Share) -> None:
        """An element during which the clock runs."""
        if self._provisional and not self._jumps_to(element.x_left):
            self._rows.clear()
        self._provisional = False
        if not self._rows or self._jumps_to(element.x_left):
            self._close_impact(self._reader.clock(element.x_left))
            self._append(element.x_left, element, share.force[0], share.mode)
        self._pending[:] = 0.0
        self.phases.append(Phase(self._reader.clock(element.x_left), share.mode))
        n_q, n_v, tableau = self._reader.n_q, self._reader.n_v, self._reader.tableau
        slope = tableau.derivative @ np.vstack([element.x_left, element.x[: tableau.stages]])
        for j, x in enumerate(element.x):
            if j < tableau.stages:
                acceleration = slope[j, n_q : n_q + n_v] / slope[j, n_q + n_v]
                weight = element.step * tableau.b[j] * share.rate[j]
                self._append(x, element, share.force[j], share.mode, acceleration, weight)
            else:
                self._append(x, element, share.force[j - 1], share.mode)

    def close(self, last: Element) -> None:
        """Add the state after an impact at the very end."""
        if self._rows and self._jumps_to(last.x[-1]):
            self._close_impact(self._reader.clock(last.x[-1]))
            self._append(last.x[-1], last, np.zeros((self._reader.n_c, 2)), ["flight"] * self._reader.n_c)

    def stacked(self) -> dict[str, np.ndarray]:
        """All samples as arrays."""
        return {key: np.array([row[key] for row in self._rows]) for key in self._rows[0]}

    def _jumps_to(self, x: np.ndarray) -> bool:
        if not np.abs(self._pending).max() > 0:
            return False
        return bool(np.abs(self._reader.split(x)[1] - self._rows[-1]["velocity"]).max() > JUMP)

    def _close_impact(self, time: float) -> None:
        if not self._rows:
            return
        hit = self._pending[:, 0] > IMPULSE_SHARE * self._pending[:, 0].max()
        before = self._rows[-1]
        before["mode"] = np.where(hit, "impact", np.asarray(before["mode"], dtype=object))
        self.impacts.append(ImpactRecord(len(self._rows) - 1, len(self._rows), self._pending.copy()))
        self.phases.append(Phase(time, ["impact" if h else "" for h in hit]))
        self._pending[:] = 0.0

    def _append(
        self,
        x: np.ndarray,
        element: Element,
        force: np.ndarray,
        mode: list[str],
        acceleration: np.ndarray | None = None,
        weight: float = 0.0,
    ) -> None:
        q, v, gap_state = self._reader.split(x)
        self._rows.append(
            {
                "time": self._reader.clock(x),
                "configuration": q,
                "velocity": v,
                "acceleration": np.full(len(v), np.nan) if acceleration is None else acceleration,
                "weight": weight,
                "interval": element.interval,
                "control": element.u[:-1],
                "force": np.where([[m == "flight"] for m in mode], 0.0, force),
                "gap_state": gap_state,
                "mode": np.array([m.rstrip("+-") for m in mode], dtype=object),
            }
        )
