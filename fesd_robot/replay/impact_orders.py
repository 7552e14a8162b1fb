"""Impacts of contacts that hit at the same instant, one after the other instead of all together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, product

import numpy as np

from fesd_robot.recovery import NumericPhysics, normal_rows
from fesd_robot.replay.contacts import CLOSED_VELOCITY
from fesd_robot.replay.impacts import impact

MOST_ORDERS = 74
"""Orders of an impact that are looked at: all of up to four contacts, and of more those in fewest groups."""


def impacts_in_turn(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray
) -> Iterator[np.ndarray]:
    """Yield the velocities, (n_v), after impacts of contacts that hit at once, for the orders in which they may do so.

    Contacts that reach the ground at the same instant do so in the limit of some order, of single contacts or of
    groups, and rigid bodies do not say which: the groups hit one after the other, each by `impact` together with those
    that touch already. An order of which an impact does not end is left out, and all at once is none. Those in
    which the fastest hit first come first.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity before (n_v).
        touching: contacts whose gap is closed, (n_c) of bool; those that approach hit.

    Source: Glocker, Set-Valued Force Laws (2001), chapter 13: multi-contact collisions have no unique impact law.
    """
    approach = normal_rows(physics.contact_jacobian(q) @ v, physics.rows)
    hits = sorted(np.flatnonzero(touching & (approach < 0)).tolist(), key=lambda contact: float(approach[contact]))
    for order in islice(_orders(hits), MOST_ORDERS):
        after = _in_order(physics, q, v, touching, order)
        if after is not None:
            yield after


def each_first(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray
) -> Iterator[tuple[list[int], int, np.ndarray]]:
    """Yield the contacts that hit at once, one of them, and the velocities, (n_v), if it hits before the others.

    Nothing where less than two contacts hit faster than `CLOSED_VELOCITY`.

    Args:
        physics, q, v, touching: as of `impacts_in_turn`.
    """
    approach = normal_rows(physics.contact_jacobian(q) @ v, physics.rows)
    hits = np.flatnonzero(touching & (approach < -CLOSED_VELOCITY)).tolist()
    for first in hits if len(hits) > 1 else []:
        after = _in_order(physics, q, v, touching, [[first], [one for one in hits if one != first]])
        if after is not None:
            yield hits, first, after


def _in_order(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray, order: Sequence[list[int]]
) -> np.ndarray | None:
    """Return the velocities, (n_v), after groups of contacts have hit in turn; None if an impact does not end."""
    closed, after = touching.copy(), v
    closed[[contact for group in order for contact in group]] = False
    for group in order:
        closed[group] = True
        result = impact(physics, q, after, closed)
        if not result.finished:
            return None
        after = result.velocity
    return after


def _orders(contacts: Sequence[int]) -> Iterator[list[list[int]]]:
    """Yield the contacts in two ordered groups or more, few groups first, those that come first in early groups."""
    for count in range(2, len(contacts) + 1):
        for turns in product(range(count), repeat=len(contacts)):
            groups = [[c for c, turn in zip(contacts, turns, strict=True) if turn == k] for k in range(count)]
            if all(groups):
                yield groups
