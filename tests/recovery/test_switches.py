"""Switch times from sequences of contact modes."""

from __future__ import annotations

import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.recovery import SwitchRecord
from fesd_robot.recovery.switches import ContactPhase, switches_between


def phase(start: float, modes: list[str]) -> ContactPhase:
    """A phase from the words of its modes; none is a contact that takes no part."""
    return ContactPhase(start, [ContactMode(mode) if mode else None for mode in modes])


@pytest.mark.parametrize(
    ("modes", "kinds"),
    [
        (["flight", "flight"], []),
        (["flight", "stick"], ["touchdown"]),
        (["flight", "slip+"], ["touchdown"]),
        (["stick", "flight"], ["takeoff"]),
        (["slip-", "flight"], ["takeoff"]),
        (["stick", "slip-"], ["stick_to_slip"]),
        (["slip+", "stick"], ["slip_to_stick"]),
        (["slip+", "slip-"], ["slip_reversal"]),
        (["slip+", "slip+", "stick", "stick", "slip+"], ["slip_to_stick", "stick_to_slip"]),
        (["flight", "impact", "stick"], ["touchdown"]),
        (["flight", "impact", "slip+"], ["touchdown"]),
        (["flight", "impact", "flight"], ["touchdown", "takeoff"]),
        (["stick", "impact", "stick"], []),
        (["stick", "", "slip+"], ["stick_to_slip"]),
        (["", "flight"], []),
        (["flight", "impact", "stick", "flight", "impact", "flight"], ["touchdown", "takeoff", "touchdown", "takeoff"]),
    ],
    ids=", ".join,
)
def test_changes_of_one_contact(modes: list[str], kinds: list[str]) -> None:
    """Every change of mode is one switch of its kind, at the start of the phase that it leads to."""
    phases = [phase(0.5 * k, [mode]) for k, mode in enumerate(modes)]
    switches = switches_between(phases)
    assert [switch.kind for switch in switches] == kinds
    for switch in switches:
        assert switch.contact == 0
        assert modes[int(2 * switch.time)] != modes[int(2 * switch.time) - 1]


def test_switches_of_several_contacts_come_in_time_order() -> None:
    """Switches of several contacts come in time order; a contact that takes no part in an impact does not switch."""
    phases = [
        phase(0.0, ["stick", "flight"]),
        phase(1.0, ["", "impact"]),
        phase(1.0, ["stick", "stick"]),
        phase(2.0, ["flight", "slip+"]),
        phase(3.0, ["stick", "slip-"]),
    ]
    assert switches_between(phases) == [
        SwitchRecord(1.0, 1, "touchdown"),
        SwitchRecord(2.0, 0, "takeoff"),
        SwitchRecord(2.0, 1, "stick_to_slip"),
        SwitchRecord(3.0, 0, "touchdown"),
        SwitchRecord(3.0, 1, "slip_reversal"),
    ]


def test_no_phases_no_switches() -> None:
    """Nothing switches where nothing moves."""
    assert switches_between([]) == []
