"""What another order would change of landings in which several contacts hit at the same instant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fesd_robot.plans.measured import Names
from fesd_robot.plans.record import Record
from fesd_robot.recovery import ImpactRecord, NumericPhysics, PhysicalMotion
from fesd_robot.replay import CLOSED_GAP, each_first

ORDER_MATTERS = 0.01
"""Part of what an impact changes from which on what another order would change is worth a warning."""


class LandingOrder(Record):
    """What is different after a landing in which one contact hits first and the others that hit with it follow.

    Attributes:
        time: of the landing, s.
        contacts: that hit at once.
        tried: those of them that were taken as the first: all, as far as there was time.
        first: the one of these whose coming first changes most.
        coordinate, unit: the velocity that it changes most, m/s or rad/s.
        change: that velocity after the landing in turn, less that of the plan.
        part: |change|, of the largest change of a velocity by the landing.
    """

    time: float
    contacts: list[str]
    tried: list[str]
    first: str
    coordinate: str
    unit: str
    change: float
    part: float

    @property
    def sentence(self) -> str:
        """What it says, in words."""
        which = "one of them" if self.tried == self.contacts else " or ".join(self.tried)
        return (
            f"At {self.time:.4g} s the contacts {', '.join(self.contacts)} land at once; if {which} lands first, "
            f"velocities afterwards differ by up to {abs(self.change):.2g} {self.unit} ({self.coordinate}, with "
            f"'{self.first}' first), {100 * self.part:.2g} % of what the landing changes."
        )


def landing_orders(
    motion: PhysicalMotion, physics: NumericPhysics, names: Names, goes_on: Callable[[], bool]
) -> list[LandingOrder]:
    """Return what another order would change of every landing of several contacts at once.

    Args:
        motion: in physical time.
        physics: of its robot and contacts.
        names: of its contacts and coordinates.
        goes_on: whether there is time for another order; what follows is left out.
    """
    found = (_order(motion, physics, names, one, goes_on) for one in motion.impacts if goes_on())
    return [one for one in found if one is not None]


def _order(
    motion: PhysicalMotion,
    physics: NumericPhysics,
    names: Names,
    landing: ImpactRecord,
    goes_on: Callable[[], bool],
) -> LandingOrder | None:
    """Return the order that changes most of a landing; None where contacts do not hit at once."""
    q, v, planned = motion.configuration[landing.before], *motion.velocity[[landing.before, landing.after]]
    in_turn = []
    for one in each_first(physics, q, v, physics.gaps(q) <= CLOSED_GAP):
        in_turn.append(one)
        if not goes_on():
            break
    if not in_turn:
        return None
    hits, first, after = max(in_turn, key=lambda one: float(np.abs(one[2] - planned).max()))
    coordinate = int(np.abs(after - planned).argmax())
    name, unit = list(names.velocity.items())[coordinate]
    change = float(after[coordinate] - planned[coordinate])
    return LandingOrder(
        time=float(motion.time[landing.after]),
        contacts=[names.contacts[contact] for contact in hits],
        tried=[names.contacts[one[1]] for one in in_turn],
        first=names.contacts[first],
        coordinate=name,
        unit=unit,
        change=change,
        part=abs(change) / float(np.abs(planned - v).max()),
    )
