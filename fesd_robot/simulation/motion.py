"""The samples of a driven robot, in the form that plans are made of."""

from __future__ import annotations

from typing import Any

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.fesd import Tableau, make_tableau
from fesd_robot.recovery import (
    FRACTIONS,
    Compliance,
    DenseElement,
    ImpactRecord,
    JointFriction,
    NumericPhysics,
    PhysicalMotion,
    stacked_elements,
    stacked_rows,
)
from fesd_robot.replay import Contacts, contact_dynamics, motion_in_modes
from fesd_robot.simulation.drive import Hit, Piece, SimulatedMotion
from fesd_robot.simulation.schedule import ControlSchedule

STAGES = 4
"""Of the Radau IIA formula at whose nodes every step of the integrator is sampled: its weights integrate powers and
velocities to order 7."""


def driven_motion(
    driven: SimulatedMotion, physics: NumericPhysics, schedule: ControlSchedule, n_u: int
) -> PhysicalMotion:
    """Return the motion of a driven robot as samples with accelerations, forces and modes, and its impacts.

    Args:
        driven: the robot's motion.
        physics: of the robot and its contacts.
        schedule: of its controls.
        n_u: number of controls.
    """
    samples, hits = _Samples(physics, make_tableau("radau_iia", STAGES)), {hit.pieces: hit for hit in driven.hits}
    for number, piece in enumerate(driven.pieces):
        if number == 0:
            samples.begin(piece, hits.pop(0, None))
        elif number in hits:
            samples.impact(hits[number], piece.start, piece.contacts, piece.interval, piece.control)
        samples.piece(piece)
    if len(driven.pieces) in hits:  # an impact at the very end
        last = driven.pieces[-1]
        samples.impact(hits[len(driven.pieces)], last.end, last.contacts, last.interval, last.control)
    columns = samples.stacked()
    joint_force, joint_mode = columns.pop("joint_force"), columns.pop("joint_mode")
    compliance = Compliance(columns.pop("compliant_force"), columns.pop("compliant_mode"), driven.compliant_switches)
    rows = physics.friction_coordinates
    joints = JointFriction(rows, physics.dry_friction[rows], joint_force, joint_mode, driven.joint_switches)
    sizes = (len(driven.configuration), len(driven.velocity), n_u, len(physics.friction))
    return PhysicalMotion(
        **columns,
        gap_state=np.zeros((len(columns["time"]), 0)),
        impacts=samples.impacts,
        switches=driven.switches,
        clock=schedule.times[1:],
        theta_sum_error=0.0,
        between=stacked_elements(samples.between, sizes),
        joints=joints if rows.size else None,
        compliance=compliance if physics.compliant else None,
    )


class _Samples:
    """Collects samples in time order."""

    def __init__(self, physics: NumericPhysics, tableau: Tableau) -> None:
        self._physics, self._tableau = physics, tableau
        self._rows: list[dict[str, Any]] = []
        self.impacts: list[ImpactRecord] = []
        self.between: list[DenseElement] = []

    def begin(self, piece: Piece, hit: Hit | None) -> None:
        """Add the state at the start, and an impact there."""
        if hit is None:
            q, v = piece.state(piece.start)
            self._append(piece.start, q, v, piece.contacts, piece.interval, piece.control, np.nan * v, 0.0)
            return
        flying = Contacts(
            (ContactMode.FLIGHT,) * len(piece.contacts.modes),
            np.zeros_like(piece.contacts.closed),
            piece.contacts.ground,
            piece.contacts.joints,
            piece.contacts.headings,
            piece.contacts.joint_headings,
            piece.contacts.compliant,
        )
        start = hit.configuration, hit.before
        self._append(hit.time, *start, flying, piece.interval, piece.control, np.nan * hit.before, 0.0)
        self.impact(hit, piece.start, piece.contacts, piece.interval, piece.control)

    def impact(self, hit: Hit, time: float, after: Contacts, interval: int, control: np.ndarray) -> None:
        """Add the state after an impact; the one before it is the last one."""
        record = ImpactRecord(len(self._rows) - 1, len(self._rows), hit.impact.impulse)
        before = self._rows[-1]
        before["mode"] = record.modes_before(before["mode"])
        self.impacts.append(record)
        v = hit.impact.velocity
        self._append(time, hit.configuration, v, after, interval, control, np.nan * v, 0.0)

    def piece(self, piece: Piece) -> None:
        """Add the states at the nodes of a step, the last one at its end."""
        length = piece.end - piece.start
        for node, weight in zip(self._tableau.c, self._tableau.b, strict=True):
            time = piece.start + node * length
            q, v = piece.state(time)
            self._append(time, q, v, piece.contacts, piece.interval, piece.control, None, weight * length)
        times = piece.start + FRACTIONS * length
        states = [piece.state(float(time)) for time in times]
        self.between.append(
            DenseElement(
                time=times,
                configuration=np.array([q for q, _ in states]),
                velocity=np.array([v for _, v in states]),
                interval=piece.interval,
                control=piece.control,
                mode=piece.contacts.modes,
                joint_mode=piece.contacts.joints,
            )
        )

    def stacked(self) -> dict[str, np.ndarray]:
        """Return all samples as arrays."""
        return {key: np.array([row[key] for row in self._rows]) for key in self._rows[0]}

    def _append(
        self,
        time: float,
        q: np.ndarray,
        v: np.ndarray,
        contacts: Contacts,
        interval: int,
        control: np.ndarray,
        acceleration: np.ndarray | None,
        weight: float,
    ) -> None:
        dynamics = contact_dynamics(self._physics, q, v, control, contacts.headings, contacts.joint_headings)
        dynamics = dynamics.in_joint_modes(contacts.joints)
        found, force = motion_in_modes(dynamics, contacts.modes)
        self._rows.append(
            {
                "time": time,
                "configuration": q,
                "velocity": v,
                "acceleration": found if acceleration is None else acceleration,
                "weight": weight,
                "interval": interval,
                "control": control,
                "force": force,
                "mode": np.array([mode.without_direction for mode in contacts.modes], dtype=object),
                "joint_force": dynamics.joint_force(stacked_rows(force)),
                "joint_mode": np.array([mode.without_direction for mode in contacts.joints], dtype=object),
                "compliant_force": self._physics.compliant_forces(q, v),
                "compliant_mode": np.array(contacts.compliant, dtype=object),
            }
        )
