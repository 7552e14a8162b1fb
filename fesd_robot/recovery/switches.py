"""Switch times from the sequence of contact modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Kind = Literal["touchdown", "takeoff", "stick_to_slip", "slip_to_stick", "slip_reversal"]


@dataclass(frozen=True)
class Phase:
    """From `start` (s) on the contacts are in these modes: ``flight``, ``stick``, ``slip+``, ``slip-``.

    A phase of ``impact`` lasts no time; an empty mode in it means that the contact takes no part.
    """

    start: float
    modes: list[str]


@dataclass(frozen=True)
class SwitchRecord:
    """A change of a contact's mode at a physical time, s."""

    time: float
    contact: int
    kind: Kind


def switches_between(phases: Sequence[Phase]) -> list[SwitchRecord]:
    """Return every change of mode in time order; an impact that ends in flight is a touchdown and a takeoff."""
    found: list[SwitchRecord] = []
    for contact in range(len(phases[0].modes) if phases else 0):
        mode = ""
        for phase in phases:
            following = phase.modes[contact]
            if following in ("", mode):
                continue
            found += [SwitchRecord(phase.start, contact, kind) for kind in _kinds(mode, following)]
            mode = following
    return sorted(found, key=lambda switch: switch.time)


def _kinds(mode: str, following: str) -> list[Kind]:
    if mode == "":
        return []
    if following == "flight":
        return ["takeoff"]
    if mode == "flight":
        return ["touchdown"]
    if "impact" in (mode, following):
        return []
    if mode == "stick":
        return ["stick_to_slip"]
    return ["slip_to_stick" if following == "stick" else "slip_reversal"]
