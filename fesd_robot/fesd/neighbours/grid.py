"""The same trajectory on another control grid, with other numbers of elements and another scheme."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours.known_trajectory import KnownTrajectory
from fesd_robot.fesd.neighbours.patterns import Factors, spread
from fesd_robot.fesd.neighbours.room import at_stages, in_equal_parts, with_counts
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.instants import SAME_PART

BISECTIONS = 60
"""Halvings of an element in which the clock shows a given time; more than there are digits."""


@dataclass(frozen=True)
class _Piece:
    """A part of an element in one new interval.

    Attributes:
        element: number of the element.
        begin, end: fractions of it.
        length: of the part, in physical terms.
    """

    element: int
    begin: float
    end: float
    length: float


def on_grid(known: KnownTrajectory, transcription: Transcription) -> BranchMotion:
    """Return a trajectory on the control grid of a transcription, its duration stretched to that of the grid.

    Elements are cut at the new ends of intervals. Elements of one mode in an interval become equally long; there are as
    many as the modes need, at least as many as the transcription has. Controls are averages over the new intervals.

    Args:
        known: of a collocation scheme, with the same states, algebraic variables and conditions.
        transcription: of a collocation scheme.
    """
    ocp, tableau = transcription.ocp, transcription.options.tableau
    stretch, length = ocp.duration / known.duration, ocp.duration / ocp.intervals
    ends = length * np.arange(1, ocp.intervals + 1)
    pieces = _pieces(known, ends, stretch)
    counts: list[int] = []
    elements: list[Element] = []
    factors: list[Factors] = []
    for k, own in enumerate(pieces):
        runs = [list(run) for _, run in groupby(own, key=lambda piece: known.branch.factors[piece.element])]
        modes = [known.branch.factors[run[0].element] for run in runs]
        counts.append(max(transcription.elements[k], len(modes)))
        filled = spread(modes, counts[-1])
        speed = sum(piece.length for piece in own) / length
        weights = [max(_advance(known, piece), SAME_PART * length) for piece in own]
        control = np.average([known.elements[piece.element].u for piece in own], axis=0, weights=weights)
        control = np.clip(np.append(control[:-1], speed), ocp.control_lower, ocp.control_upper)
        start = k * length
        for run, (_, parts) in zip(runs, groupby(filled), strict=True):
            cut: list[Element] = []
            for piece in run:
                cut.append(_cut(known, piece, tableau, start, speed, stretch, control, k))
                start = cut[-1].end
            elements += in_equal_parts(cut, len(list(parts)), tableau)
        factors += filled
    changed = with_counts(transcription, counts)
    branch = Branch(known.branch.conditions, tuple(factors), (False,) * len(factors))
    return BranchMotion.of(changed, changed.pack(elements), branch)


def _pieces(known: KnownTrajectory, ends: np.ndarray, stretch: float) -> list[list[_Piece]]:
    """Return the parts of elements in every new interval, of which the ends are given, (N)."""
    pieces: list[list[_Piece]] = [[] for _ in ends]
    rounded = SAME_PART * ends[-1]
    for e, element in enumerate(known.elements):
        if known.branch.without_length[e]:
            continue
        speed = float(element.u[-1])
        begin, end = (stretch * float(x[known.clock]) for x in (element.x_left, element.x[-1]))
        if ActiveFactor.COMPLEMENT in known.branch.factors[e] or end - begin < rounded:
            middle = stretch * _middle(known, element.interval)
            k = int(np.searchsorted(ends, begin + np.sign(middle - begin) * rounded))
            pieces[min(k, len(ends) - 1)].append(_Piece(e, 0.0, 1.0, speed * element.step))
            continue
        first, last = (int(np.searchsorted(ends, at)) for at in (begin + rounded, end - rounded))
        cuts = [0.0, *(_fraction(known, element, ends[k] / stretch) for k in range(first, last)), 1.0]
        for n, k in enumerate(range(first, min(last, len(ends) - 1) + 1)):
            share = cuts[n + 1] - cuts[n]
            pieces[k].append(_Piece(e, cuts[n], cuts[n + 1], share * speed * element.step * stretch))
    return pieces


def _middle(known: KnownTrajectory, interval: int) -> float:
    """Return the physical time in the middle of an interval of the known trajectory."""
    own = [element for element in known.elements if element.interval == interval]
    return float(own[0].x_left[known.clock] + own[-1].x[-1, known.clock]) / 2


def _fraction(known: KnownTrajectory, element: Element, time: float) -> float:
    """Return the fraction of an element at which the clock shows a time."""
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        at = element.at(known.tableau, np.array([element.start + middle * element.step]))[0, known.clock]
        low, high = (middle, high) if at < time else (low, middle)
    return (low + high) / 2


def _advance(known: KnownTrajectory, piece: _Piece) -> float:
    """Return how far the clock goes in a piece."""
    element = known.elements[piece.element]
    times = element.start + element.step * np.array([piece.begin, piece.end])
    clock = element.at(known.tableau, times)[:, known.clock]
    return float(clock[1] - clock[0])


def _cut(
    known: KnownTrajectory,
    piece: _Piece,
    tableau: Tableau,
    start: float,
    speed: float,
    stretch: float,
    control: np.ndarray,
    interval: int,
) -> Element:
    """Return a piece as an element of another scheme and interval.

    Args:
        known: the trajectory; piece: the part of it.
        tableau: of the scheme.
        start: numerical time of its left end.
        speed: of the clock.
        stretch: factor on physical times.
        control: of the interval, (n_u).
        interval: its number.
    """
    source = known.elements[piece.element]
    fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
    inside = piece.begin + (piece.end - piece.begin) * np.append(0.0, fractions)
    times = source.start + source.step * inside
    x = source.at(known.tableau, times)
    x[:, known.clock] *= stretch
    z = np.vstack([at_stages(source, source.z, at, known.tableau) for at in times[1:]])
    left = source.z_left if piece.begin == 0.0 else at_stages(source, source.z, float(times[0]), known.tableau)
    slopes = np.vstack([at_stages(source, source.slopes, at, known.tableau) for at in times[1 : 1 + tableau.stages]])
    scale = (piece.end - piece.begin) * source.step / (piece.length / speed)
    return Element(interval, start, piece.length / speed, x[0], left, x[1:], z, control, slopes * scale)
