"""Moves from a branch to its neighbours: a switch earlier or later, with an impact or without, or a run left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.neighbours.contact_modes import ContactMode, ContactModes
from fesd_robot.fesd.neighbours.patterns import Pattern, Run, intervals_of, pattern_of, runs_of
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.polishing import ElementConditions
from fesd_robot.fesd.transcription import Transcription

SHORT_RUN = 3
"""A run of at most so many intervals may be left out between two different modes."""


@dataclass(frozen=True)
class Move:
    """A neighbour of a branch.

    Attributes:
        key: what is moved, and how: of two moves with the same key one continues the other.
        what: the same in words.
        intervals: in which something changes.
        w: where to start looking for its motion, (n).
        branch: the neighbour.
    """

    key: tuple[str, int, str]
    what: str
    intervals: range
    w: np.ndarray
    branch: Branch


@dataclass(frozen=True)
class _Change:
    key: tuple[str, int, str]
    what: str
    patterns: Mapping[int, Pattern]


def moves(transcription: Transcription, conditions: ElementConditions, w: np.ndarray, branch: Branch) -> Iterator[Move]:
    """Yield the neighbours of a branch, contact by contact and switch by switch in time order.

    - A switch between two modes that lies on the boundary of two control intervals moves to the boundary before, the
      one after, or into one of the two intervals; one inside an interval moves into the interval before or after, or
      to one of its boundaries.
    - A touchdown gets an impact wherever it lies inside an interval, and none on a boundary.
    - A mode between two that are the same, or a short one between two others, is left out.
    - A mode with contact becomes another one with contact that the contact has elsewhere: stick, or slip.

    Args:
        transcription: of a collocation scheme.
        conditions: what can vanish in an element.
        w: a point of it, (n).
        branch: on which it lies.
    """
    placing = Placing(transcription, w, branch)
    intervals = intervals_of(transcription.elements)
    for modes in ContactModes.of(conditions, branch):
        patterns = [pattern_of(modes, branch, own) for own in intervals]
        runs = runs_of(modes, patterns)
        for change in (*_shifted(modes, patterns, runs, placing), *_without_run(modes, runs), *_swapped(modes, runs)):
            for start, neighbour in placing.placed(modes, change.patterns):
                changed = range(min(change.patterns), max(change.patterns) + 1)
                yield Move(change.key, change.what, changed, start, neighbour)


def _shifted(modes: ContactModes, patterns: list[Pattern], runs: list[Run], placing: Placing) -> Iterator[_Change]:
    """Yield the changes that move one switch."""
    last = len(patterns) - 1
    for n, (before, after) in enumerate(pairwise(runs)):
        a, b = before.mode, after.mode
        whole, k, following = (a, *_impacts(modes, a, b, before.last, placing), b), before.last, after.first
        if k < following:
            choices = {
                "an interval earlier": {k: (b,)} if patterns[k][0] == a else None,
                "an interval later": {following: (a,)} if patterns[following][-1] == b else None,
                f"into interval {k}": {k: whole, following: _without_impacts(modes, patterns[following])},
                f"into interval {following}": {k: _without_impacts(modes, patterns[k]), following: whole},
            }
            if not (patterns[k][0] == a and len(_without_impacts(modes, patterns[k])) == 1):
                choices[f"into interval {k}"] = None
            if len(_without_impacts(modes, patterns[following])) > 1:
                choices[f"into interval {following}"] = None
        else:
            own = patterns[k]
            if len(_without_impacts(modes, own)) > 2:
                continue
            choices = {
                "to the beginning of its interval": {k: (b,)},
                "to the end of its interval": {k: (a,)},
                "an interval earlier": {k - 1: own, k: (b,)} if k > 0 and patterns[k - 1] == (a,) else None,
                "an interval later": {k: (a,), k + 1: own} if k < last and patterns[k + 1] == (b,) else None,
            }
        for where, change in choices.items():
            if change is not None:
                what = f"{_name(modes, a, b)} of contact '{modes.name}' in interval {k} {where}"
                yield _Change((modes.name, n, where.split(" interval ")[0]), what, change)


def _impacts(modes: ContactModes, a: ContactMode, b: ContactMode, interval: int, placing: Placing) -> list[ContactMode]:
    """Return the modes of the impact between two modes; none if it is no touchdown."""
    if not modes.is_flight(a) or modes.is_flight(b):
        return []
    return modes.impacts(b, *placing.end_of(interval))


def _without_impacts(modes: ContactModes, pattern: Pattern) -> Pattern:
    return tuple(mode for mode in pattern if not modes.is_impact(mode))


def _without_run(modes: ContactModes, runs: list[Run]) -> Iterator[_Change]:
    """Yield the changes that leave one run out."""
    for n in range(1, len(runs) - 1):
        before, run, after = runs[n - 1 : n + 2]
        others = {before.mode, after.mode} if run.last - run.first < SHORT_RUN else set()
        for mode in {before.mode} if before.mode == after.mode else sorted(others, key=str):
            patterns = dict.fromkeys(range(run.first, run.last + 1), (mode,))
            kind = "flight" if modes.is_flight(run.mode) else "contact"
            what = f"no {kind} of contact '{modes.name}' in intervals {run.first} to {run.last}"
            yield _Change((modes.name, n, "left out"), what, patterns)


def _swapped(modes: ContactModes, runs: list[Run]) -> Iterator[_Change]:
    """Yield the changes of one mode with contact into another one."""
    closed = sorted({run.mode for run in runs if not modes.is_flight(run.mode)}, key=str)
    for n, run in enumerate(runs):
        for mode in closed:
            if mode != run.mode and not modes.is_flight(run.mode):
                what = f"stick or slip of contact '{modes.name}' swapped in intervals {run.first} to {run.last}"
                yield _Change((modes.name, n, "swapped"), what, dict.fromkeys(range(run.first, run.last + 1), (mode,)))


def _name(modes: ContactModes, a: ContactMode, b: ContactMode) -> str:
    """Return what a switch is called."""
    if modes.is_flight(a) == modes.is_flight(b):
        return "stick or slip"
    return "touchdown" if modes.is_flight(a) else "take-off"
