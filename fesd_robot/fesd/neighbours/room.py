"""The same trajectory with other numbers of elements: room for its switches, and no elements without length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.neighbours.patterns import Factors, intervals_of, sequence_of, spread
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

SPARE_ELEMENTS = 1
"""Elements that every interval gets for a search: a touchdown with friction inside an interval needs four."""


def with_room(transcription: Transcription, w: np.ndarray, branch: Branch) -> tuple[Transcription, np.ndarray, Branch]:
    """Return the transcription with one element more in every interval, any of which may fill it, and the same point.

    Args:
        transcription: of a collocation scheme; its added rows are held in all elements of their intervals.
        w: a point of it, (n).
        branch: on which it lies.
    """
    return _with_elements(transcription, w, branch, [count + SPARE_ELEMENTS for count in transcription.elements])


def filled(transcription: Transcription, w: np.ndarray, branch: Branch) -> tuple[np.ndarray, Branch]:
    """Return the same point, and its branch, with all elements in use: those of a mode share its time in an interval.

    An element that has shrunk to nothing would leave its interval to fewer ones, whose errors a cost can gain from.

    Args:
        transcription: in which any element may fill its interval.
        w: a point of it, (n).
        branch: on which it lies.
    """
    _, point, own = _with_elements(transcription, w, branch, transcription.elements)
    return point, own


def without_room(
    transcription: Transcription, w: np.ndarray, branch: Branch, least: Sequence[int]
) -> tuple[Transcription, np.ndarray, Branch]:
    """Return the transcription with as many elements as its modes need, at least given numbers, and the same point.

    Args:
        transcription: of a collocation scheme; its added rows are held in all elements of their intervals.
        w: a point of it, (n).
        branch: on which it lies.
        least: numbers of elements of the intervals, (N).
    """
    needed = [len(sequence_of(branch, own)) for own in intervals_of(transcription.elements)]
    counts = [max(pair) for pair in zip(needed, least, strict=True)]
    return _with_elements(transcription, w, branch, counts)


def with_counts(transcription: Transcription, counts: Sequence[int]) -> Transcription:
    """Return the transcription with given numbers of elements in its intervals, any of which may fill its interval.

    A branch NLP makes elements of one mode equally long anyway, so that step equilibration has no weight. Added
    rows are held in all elements of their intervals.
    """
    options = replace(
        transcription.options, elements=tuple(counts), step_freedom=max(counts) - 1.0, equilibration_weight=0.0
    )
    added = transcription.added.in_intervals(transcription.elements, counts)
    return replace(transcription, options=options, added=added)


def _with_elements(
    transcription: Transcription, w: np.ndarray, branch: Branch, counts: Sequence[int]
) -> tuple[Transcription, np.ndarray, Branch]:
    """Return the transcription with other numbers of elements, its point on the same polynomials, and its branch.

    All elements have a length, and those of one mode are equally long.
    """
    old, tableau = transcription.unpack(w), transcription.options.tableau
    elements: list[Element] = []
    factors: list[Factors] = []
    for own, count in zip(intervals_of(transcription.elements), counts, strict=True):
        whole = [e for e in own if not branch.without_length[e]]
        runs = [[old[e] for e in run] for _, run in groupby(whole, key=lambda e: branch.factors[e])]
        modes = spread(sequence_of(branch, own), count)
        factors += modes
        for run, (_, parts) in zip(runs, groupby(modes), strict=True):
            elements += in_equal_parts(run, len(list(parts)), tableau)
    changed = with_counts(transcription, counts)
    return changed, changed.pack(elements), Branch(branch.conditions, tuple(factors), (False,) * len(factors))


def in_equal_parts(run: Sequence[Element], count: int, tableau: Tableau) -> list[Element]:
    """Return elements that follow each other in one mode as `count` elements of equal length on their polynomials."""
    ends = np.array([element.end for element in run])
    start, step = run[0].start, (ends[-1] - run[0].start) / count
    fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
    x_left, z_left, parts = run[0].x_left, run[0].z_left, []
    for n in range(count):
        times = start + step * (n + fractions)
        sources = [run[min(int(np.searchsorted(ends, at)), len(run) - 1)] for at in times]
        at_times = list(zip(sources, times, strict=True))
        x = np.vstack([source.at(tableau, np.array([at])) for source, at in at_times])
        z = np.vstack([at_stages(source, source.z, at, tableau) for source, at in at_times[: len(run[0].z)]])
        slopes = np.vstack([at_stages(source, source.slopes, at, tableau) for source, at in at_times[: tableau.stages]])
        part = replace(
            sources[0], start=start + n * step, step=step, x_left=x_left, z_left=z_left, x=x, z=z, slopes=slopes
        )
        parts.append(part)
        x_left, z_left = x[-1], z[-1]
    return parts


def at_stages(element: Element, values: np.ndarray, at: float, tableau: Tableau) -> np.ndarray:
    """Return the polynomial through values at the stages of an element, (n_s, n), at a time."""
    fraction = (at - element.start) / element.step if element.step > 0 else 1.0
    return np.asarray(lagrange(tableau.c, np.array([fraction]))[0] @ values[: tableau.stages])
