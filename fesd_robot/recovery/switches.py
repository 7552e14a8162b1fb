"""Switch times from the sequence of contact modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from fesd_robot.contact import ContactMode

Kind = Literal["touchdown", "takeoff", "stick_to_slip", "slip_to_stick", "slip_reversal"]


@dataclass(frozen=True)
class ContactPhase:
    """From `start` (s) on the contacts are in these modes.

    A phase with an impact lasts no time; no mode in it means that the contact takes no part.
    """

    start: float
    modes: Sequence[ContactMode | None]


@dataclass(frozen=True)
class SwitchRecord:
    """A change of the mode of a contact, or of a joint with dry friction, at a physical time, s; its number is
    `contact`."""

    time: float
    contact: int
    kind: Kind


def switches_between(phases: Sequence[ContactPhase]) -> list[SwitchRecord]:
    """Return every change of mode in time order; an impact that ends in flight is a touchdown and a takeoff.

    Args:
        phases: in time order, each with the modes of all contacts.
    """
    switches: list[SwitchRecord] = []
    for contact in range(len(phases[0].modes) if phases else 0):
        mode: ContactMode | None = None
        for phase in phases:
            following = phase.modes[contact]
            if following is None or following is mode:
                continue
            if mode is not None:
                switches += [SwitchRecord(phase.start, contact, kind) for kind in kinds_of_change(mode, following)]
            mode = following
    return sorted(switches, key=lambda switch: switch.time)


def kinds_of_change(mode: ContactMode, following: ContactMode) -> list[Kind]:
    """Return the names of a change of mode: none or one."""
    if following is mode:
        return []
    if following is ContactMode.FLIGHT:
        return ["takeoff"]
    if mode is ContactMode.FLIGHT:
        return ["touchdown"]
    if ContactMode.IMPACT in (mode, following):
        return []
    if mode is ContactMode.STICK:
        return ["stick_to_slip"]
    return ["slip_to_stick" if following is ContactMode.STICK else "slip_reversal"]
