"""Changes of the contacts of a motion."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.recovery import Kind, SwitchRecord, kinds_of_change
from fesd_robot.replay.contacts import Contacts
from fesd_robot.replay.impacts import Impact


@dataclass(frozen=True)
class Event:
    """A change of the contacts' modes, or of those of joints with dry friction.

    Attributes:
        time: since the start of the segments, s.
        configuration, velocity: before it, (n_q) and (n_v).
        before, after: the contacts.
        hits: which of them have met the ground, (n_c) of bool.
        impact: what that did; None if none has.
    """

    time: float
    configuration: np.ndarray
    velocity: np.ndarray
    before: Contacts
    after: Contacts
    hits: np.ndarray
    impact: Impact | None

    def switches(self, start: float) -> list[SwitchRecord]:
        """Return the changes of contacts, `start` added to their time, s."""
        changes = zip(self.before.modes, self.after.modes, self.hits.tolist(), strict=True)
        return [
            SwitchRecord(start + self.time, i, kind)
            for i, (old, new, hit) in enumerate(changes)
            for kind in (_kinds_of_hit(old, new) if hit else kinds_of_change(old, new))
        ]

    def compliant_switches(self, start: float) -> list[SwitchRecord]:
        """Return the changes of compliant contacts, by their numbers, `start` added to their time, s."""
        changes = zip(self.before.compliant, self.after.compliant, strict=True)
        return [
            SwitchRecord(start + self.time, i, kind)
            for i, (old, new) in enumerate(changes)
            for kind in kinds_of_change(old, new)
        ]

    def joint_switches(self, start: float, firsts: Collection[int]) -> list[SwitchRecord]:
        """Return the changes of joints, `start` added to their time, s; their contact is a number of a joint.

        Args:
            start: s.
            firsts: numbers of the joints that count, `DryFriction.firsts`.
        """
        changes = zip(self.before.joints, self.after.joints, strict=True)
        return [
            SwitchRecord(start + self.time, i, kind)
            for i, (old, new) in enumerate(changes)
            if i in firsts
            for kind in kinds_of_change(old, new)
        ]


def _kinds_of_hit(old: ContactMode, new: ContactMode) -> list[Kind]:
    """Return the names of the change of a contact that has met the ground: one that flies on has also taken off."""
    if old is not ContactMode.FLIGHT:
        return kinds_of_change(old, new)
    return [*kinds_of_change(old, ContactMode.IMPACT), *kinds_of_change(ContactMode.IMPACT, new)]
