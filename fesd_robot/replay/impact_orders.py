"""Impacts of contacts that hit at the same instant, one after the other instead of all together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice

import numpy as np

from fesd_robot.recovery.contact_rows import normal_rows
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.impacts import impact

MOST_ORDERS = 75
"""Orders of an impact that are looked at: all of up to four contacts."""


def impacts_in_turn(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray
) -> Iterator[np.ndarray]:
    """Yield the velocities, (n_v), after impacts of contacts that hit at once, for every order in which they may do so.

    Contacts that reach the ground at the same instant do so in the limit of some order, of single contacts or of
    groups, and rigid bodies do not say which: the groups hit one after the other, each by `impact` together with those
    that touch already. An order of which an impact does not end is left out, and so is that of all contacts at once.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity before (n_v).
        touching: contacts whose gap is closed, (n_c) of bool; those that approach hit.

    Source: Glocker, Set-Valued Force Laws (2001), chapter 13: multi-contact collisions have no unique impact law.
    """
    hits = np.flatnonzero(touching & (normal_rows(physics.contact_jacobian(q) @ v, physics.rows) < 0)).tolist()
    for order in islice(_orders(hits), MOST_ORDERS):
        if len(order) < 2:
            continue
        closed, after, finished = touching.copy(), v, True
        closed[hits] = False
        for group in order:
            closed[list(group)] = True
            result = impact(physics, q, after, closed)
            after, finished = result.velocity, finished and result.finished
        if finished:
            yield after


def _orders(contacts: Sequence[int]) -> Iterator[tuple[tuple[int, ...], ...]]:
    """Yield the contacts in ordered groups, the larger first groups first."""
    if not contacts:
        yield ()
    for size in range(len(contacts), 0, -1):
        for group in combinations(contacts, size):
            for rest in _orders([contact for contact in contacts if contact not in group]):
                yield (group, *rest)
