"""A plan cut into pieces in which nothing switches, on a fine grid of time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.instants import SAME_EVENT, SAME_TIME
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.plans.sampling import MotionAt, Side, planned_motion
from fesd_robot.tracking.mode_dynamics import ContactState

_STICKS = 1 - 1e-6
"""Share of the cone of friction up to which a contact sticks in an impact."""


@dataclass(frozen=True)
class States:
    """States of a plan at n instants, in the order of its robot.

    Attributes:
        time: s, (n).
        configuration, velocity, control: (n, n_q), (n, n_v), (n, n_u).
    """

    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    control: np.ndarray


@dataclass(frozen=True)
class Piece:
    """A span in which no contact changes and controls are constant, cut into steps of one length.

    Attributes:
        nodes: both ends of every step, n + 1 of them; the controls are those of the piece.
        middles: of the steps, n of them.
        acceleration, force: there, (n, n_v), and of every contact, N, (n, n_c, rows).
        modes: of the whole piece.
        impact: at its end, or None.
    """

    nodes: States
    middles: States
    acceleration: np.ndarray
    force: np.ndarray
    modes: ContactState
    impact: Impact | None

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return float(self.nodes.time[-1] - self.nodes.time[0]) / (len(self.nodes.time) - 1)


@dataclass(frozen=True)
class Impact:
    """An impact.

    Attributes:
        modes: contacts that take part, and whether they slide after it.
        before, after: velocity, (n_v).
        impulse: of every contact, N s, (n_c, rows).
        landed: names of the contacts that flew before it and are hit.
    """

    modes: ContactState
    before: np.ndarray
    after: np.ndarray
    impulse: np.ndarray
    landed: tuple[str, ...]


def pieces_of(plan: Plan, motion: MotionProblem, period: float) -> Iterator[Piece]:
    """Yield a plan piece by piece in the order of time.

    Args:
        plan: with its finite elements.
        motion: its task, formulated.
        period: longest step, s.
    """
    planned, names = planned_motion(plan), _Names(plan, motion)
    first, last = planned.span
    switches = [*(each.time for each in plan.switches), *(each.time for each in plan.joint_switches)]
    cuts = _distinct(np.array([first, last, *plan.controls["time"], *switches, *planned.impacts]), first, last)
    for start, end in pairwise(cuts):
        steps = max(int(np.ceil((end - start) / period - SAME_TIME)), 1)
        time = np.linspace(start, end, steps + 1)
        sides: list[Side] = ["after", *["before"] * steps]  # type: ignore[list-item]
        middles = planned.at((time[:-1] + time[1:]) / 2)
        nodes = names.states(planned.at(time, sides))
        inside = names.states(middles)
        held = States(nodes.time, nodes.configuration, nodes.velocity, np.repeat(inside.control[:1], steps + 1, axis=0))
        yield Piece(
            held,
            inside,
            names.vectors(middles.acceleration, names.velocity),
            names.forces(middles),
            names.modes(middles),
            names.impact(plan, end, planned.at(end, "before"), planned.at(end, "after")),
        )


def _distinct(times: np.ndarray, first: float, last: float) -> np.ndarray:
    """Return times in order, those of one event once, and both ends."""
    ordered = np.sort(np.clip(times, first, last))
    kept = ordered[np.concatenate([[True], np.diff(ordered) > SAME_EVENT])]
    if last - kept[-1] <= SAME_EVENT and len(kept) > 1:
        kept[-1] = last
    return kept


class _Names:
    """Values by name as arrays in the order of a robot."""

    def __init__(self, plan: Plan, motion: MotionProblem) -> None:
        robot = motion.robot
        self.configuration, self.velocity = robot.configuration_names, robot.velocity_names
        self.control = [name for name in plan.controls if name != "time"]
        self.contacts = [contact.name for contact in motion.contacts]
        self.friction = np.array([contact.friction for contact in motion.contacts])
        self.in_space = motion.in_space

    def vectors(self, values: dict, names: list[str]) -> np.ndarray:
        columns = [np.atleast_1d(values[name]) for name in names]
        return np.column_stack(columns) if columns else np.zeros((len(self.contacts) and 1, 0))

    def states(self, moment: MotionAt) -> States:
        time = np.atleast_1d(moment.time)
        control = self.vectors(moment.controls, self.control) if self.control else np.zeros((len(time), 0))
        return States(
            time,
            self.vectors(moment.configuration, self.configuration),
            self.vectors(moment.velocity, self.velocity),
            control,
        )

    def forces(self, moment: MotionAt) -> np.ndarray:
        """Return forces of all contacts, N, (n, n_c, rows)."""
        n, rows = np.atleast_1d(moment.time).size, 3 if self.in_space else 2
        result = np.zeros((n, len(self.contacts), rows))
        for i, name in enumerate(self.contacts):
            one = moment.contacts[name]
            for k, part in enumerate((one.normal, one.tangential, one.lateral)[:rows]):
                result[:, i, k] = part
        return result

    def modes(self, moment: MotionAt) -> ContactState:
        """Return what contacts and joints do at the first of these instants in a piece, all of which have one mode."""
        modes = [np.atleast_1d(moment.contacts[name].mode)[len(np.atleast_1d(moment.time)) // 2]
                 for name in self.contacts]  # fmt: skip
        held = [
            self.velocity.index(name)
            for name, mode in moment.joint_modes.items()
            if np.atleast_1d(mode)[0] is ContactMode.STICK
        ]
        return ContactState(
            np.array([mode is not ContactMode.FLIGHT for mode in modes], dtype=bool),
            np.array([mode not in (ContactMode.FLIGHT, ContactMode.STICK) for mode in modes], dtype=bool),
            np.array(held, dtype=int),
        )

    def impact(self, plan: Plan, time: float, before: MotionAt, after: MotionAt) -> Impact | None:
        rows = 3 if self.in_space else 2
        impulse = np.zeros((len(self.contacts), rows))
        for each in plan.impulses:
            if abs(each.time - time) <= SAME_EVENT and each.contact in self.contacts:
                parts = (each.normal, each.tangential, each.lateral or 0.0)
                impulse[self.contacts.index(each.contact)] += parts[:rows]
        hit = impulse[:, 0] > 0
        if not hit.any():
            return None
        sides = [(before.contacts[name].mode, after.contacts[name].mode) for name in self.contacts]
        flew = np.array([modes[0] is ContactMode.FLIGHT for modes in sides])
        stays = np.array([ContactMode.FLIGHT not in modes for modes in sides])
        friction = np.linalg.norm(impulse[:, 1:], axis=1)
        sliding = hit & (friction >= _STICKS * self.friction * impulse[:, 0])
        unhit = stays & ~hit
        sliding |= unhit & np.array([modes[1] is not ContactMode.STICK for modes in sides])
        modes = ContactState(hit | unhit, sliding, np.zeros(0, dtype=int))
        landed = tuple(name for name, new in zip(self.contacts, hit & flew, strict=True) if new)
        hit_with, left_with = (self.vectors(each.velocity, self.velocity)[0] for each in (before, after))
        return Impact(modes, hit_with, left_with, impulse, landed)
