"""The same trajectory with other numbers of elements: room for its switches, and no elements without length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from fesd_robot.fesd.neighbours.patterns import Factors, intervals_of, sequence_of, spread
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

SPARE_ELEMENTS = 1
"""Elements that every interval gets for a search: a touchdown with friction inside an interval needs four."""


def with_room(motion: BranchMotion) -> BranchMotion:
    """Return a trajectory with one element more in every interval, any of which may fill it.

    Args:
        motion: of a collocation scheme; its added rows are held in all elements of their intervals.
    """
    return _with_elements(motion, [count + SPARE_ELEMENTS for count in motion.transcription.elements])


def filled(motion: BranchMotion) -> BranchMotion:
    """Return a trajectory with all elements in use: those of a mode share its time in an interval.

    An element that has shrunk to nothing would leave its interval to fewer ones, whose errors a cost can gain from.

    Args:
        motion: of a transcription in which any element may fill its interval.
    """
    own = _with_elements(motion, motion.transcription.elements)
    return motion.at(own.w, own.branch)


def without_room(motion: BranchMotion, least: Sequence[int]) -> BranchMotion:
    """Return a trajectory with as many elements as its modes need, at least given numbers.

    Args:
        motion: of a collocation scheme; its added rows are held in all elements of their intervals.
        least: numbers of elements of the intervals, (N).
    """
    needed = [len(sequence_of(motion.branch, own)) for own in intervals_of(motion.transcription.elements)]
    return _with_elements(motion, [max(pair) for pair in zip(needed, least, strict=True)])


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


def _with_elements(motion: BranchMotion, counts: Sequence[int]) -> BranchMotion:
    """Return a trajectory with other numbers of elements, whose points lie on the same polynomials.

    All elements have a length, and those of one mode are equally long.
    """
    transcription, branch, old = motion.transcription, motion.branch, motion.elements
    tableau = transcription.options.tableau
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
    branch = replace(branch, factors=tuple(factors), without_length=(False,) * len(factors))
    return BranchMotion.of(changed, changed.pack(elements), branch)


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
