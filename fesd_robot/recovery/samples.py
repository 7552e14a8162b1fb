"""The samples, impacts and phases of a motion, collected element by element."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.fesd import Element
from fesd_robot.recovery.between import DenseElement
from fesd_robot.recovery.elements import ComplianceAtPoint, ElementPhysics, ElementReader, JointsAtPoint
from fesd_robot.recovery.switches import ContactPhase

_TAKES_PART = 1e-3
"""Part of the largest impulse above which a contact takes part in an impact."""


@dataclass(frozen=True)
class ImpactRecord:
    """One impact: samples before and after, impulse (normal, tangential) of every contact, N s, (n_c, rows)."""

    before: int
    after: int
    impulse: np.ndarray

    @property
    def taking_part(self) -> np.ndarray:
        """Which contacts take part: those with more normal impulse than what a solver leaves, (n_c) of bool."""
        normal = self.impulse[:, 0]
        return np.asarray(normal > _TAKES_PART * normal.max())

    def modes_before(self, modes: np.ndarray) -> np.ndarray:
        """Return the modes of all contacts at the sample before it, (n_c): an impact of those that take part."""
        shown = modes.copy()
        shown[self.taking_part] = ContactMode.IMPACT
        return shown


class Samples:
    """Collects samples, those between stages, impacts and phases in time order."""

    def __init__(self, reader: ElementReader) -> None:
        self._reader = reader
        self._rows: list[dict[str, Any]] = []
        self._pending = np.zeros((reader.n_c, reader.rows))
        self._provisional = False
        self.between: list[DenseElement] = []
        self.impacts: list[ImpactRecord] = []
        self.phases: list[ContactPhase] = []
        self.joint_phases: list[ContactPhase] = []
        self.compliant_phases: list[ContactPhase] = []

    def add_impulse(self, element: Element, impulse: np.ndarray) -> None:
        """Add an element in which the clock stands still, or before which impulses act."""
        if not self._rows:
            n_c, self._provisional = self._reader.n_c, True
            self._append(element.x_before, element, np.zeros((n_c, self._reader.rows)), [ContactMode.FLIGHT] * n_c)
        self._pending += impulse

    def add_motion(self, element: Element, physics: ElementPhysics) -> None:
        """Add an element during which the clock runs."""
        if self._provisional and not self._jumps_to(element.x_left):
            self._rows.clear()
        self._provisional = False
        if not self._rows or self._jumps_to(element.x_left):
            self._close_impact(self._reader.clock(element.x_left))
            compliance = self._reader.compliance_of_state(
                *self._reader.split(element.x_left)[:2], physics.compliant_modes
            )
            self._append(
                element.x_left, element, physics.force[0], physics.modes, physics.at_joints(0), compliance=compliance
            )
        self._pending[:] = 0.0
        self.phases.append(ContactPhase(self._reader.clock(element.x_left), physics.modes))
        self.joint_phases.append(ContactPhase(self._reader.clock(element.x_left), physics.joint_modes))
        self.compliant_phases.append(ContactPhase(self._reader.clock(element.x_left), physics.compliant_modes))
        self.between.append(self._reader.between(element, physics))
        n_q, n_v, tableau = self._reader.n_q, self._reader.n_v, self._reader.tableau
        slope = tableau.derivative @ np.vstack([element.x_left, element.x[: tableau.stages]])
        for j, x in enumerate(element.x):
            if j < tableau.stages:
                acceleration = slope[j, n_q : n_q + n_v] / slope[j, n_q + n_v]
                weight = element.step * tableau.b[j] * physics.rate[j]
                joints, compliance = physics.at_joints(j), (physics.compliant_force[j], physics.compliant_modes)
                self._append(x, element, physics.force[j], physics.modes, joints, acceleration, weight, compliance)
            else:
                compliance = self._reader.compliance_of_state(*self._reader.split(x)[:2], physics.compliant_modes)
                joints = physics.at_joints(j - 1)
                self._append(x, element, physics.force[j - 1], physics.modes, joints, compliance=compliance)

    def close(self, last: Element) -> None:
        """Add the state after an impact at the very end."""
        if self._rows and self._jumps_to(last.x[-1]):
            self._close_impact(self._reader.clock(last.x[-1]))
            self._append(
                last.x[-1],
                last,
                np.zeros((self._reader.n_c, self._reader.rows)),
                [ContactMode.FLIGHT] * self._reader.n_c,
            )

    def stacked(self) -> dict[str, np.ndarray]:
        """Return all samples as arrays."""
        return {key: np.array([row[key] for row in self._rows]) for key in self._rows[0]}

    def _jumps_to(self, x: np.ndarray) -> bool:
        if not np.abs(self._pending).max(initial=0.0) > 0:
            return False
        return bool(np.abs(self._reader.split(x)[1] - self._rows[-1]["velocity"]).max() > NO_VELOCITY)

    def _close_impact(self, time: float) -> None:
        if not self._rows:
            return
        impact = ImpactRecord(len(self._rows) - 1, len(self._rows), self._pending.copy())
        hit, before = impact.taking_part, self._rows[-1]
        before["mode"] = impact.modes_before(before["mode"])
        self.impacts.append(impact)
        self.phases.append(ContactPhase(time, [ContactMode.IMPACT if h else None for h in hit]))
        self._pending[:] = 0.0

    def _append(
        self,
        x: np.ndarray,
        element: Element,
        force: np.ndarray,
        modes: list[ContactMode],
        joints: JointsAtPoint | None = None,
        acceleration: np.ndarray | None = None,
        weight: float = 0.0,
        compliance: ComplianceAtPoint | None = None,
    ) -> None:
        q, v, gap_state = self._reader.split(x)
        friction, joint_modes = joints or self._reader.joints_of_state(v)
        compliant_force, compliant_modes = compliance or self._reader.compliance_of_state(q, v)
        in_flight = np.array([mode is ContactMode.FLIGHT for mode in modes], dtype=bool)
        self._rows.append(
            {
                "time": self._reader.clock(x),
                "configuration": q,
                "velocity": v,
                "acceleration": np.full(len(v), np.nan) if acceleration is None else acceleration,
                "weight": weight,
                "interval": element.interval,
                "control": element.u[:-1],
                "force": np.where(in_flight[:, None], 0.0, force),
                "gap_state": gap_state,
                "mode": np.array([mode.without_direction for mode in modes], dtype=object),
                "joint_force": friction,
                "joint_mode": np.array([mode.without_direction for mode in joint_modes], dtype=object),
                "compliant_force": compliant_force,
                "compliant_mode": np.array(compliant_modes, dtype=object),
            }
        )
