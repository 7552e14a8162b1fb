"""Neighbours of a trajectory of any system: a switch goes into the next interval, or a mode is left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from fesd_robot.fesd.neighbours.patterns import Factors, intervals_of, sequence_of
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.polishing import BranchMotion


@dataclass(frozen=True)
class ModeShift:
    """A neighbour of a trajectory.

    Attributes:
        name: what is changed, in words.
        motion: a point to start from, and the branch.
    """

    name: str
    motion: BranchMotion


def mode_shifts(motion: BranchMotion) -> Iterator[ModeShift]:
    """Yield neighbours in which one decision about when the mode changes is another.

    A switch that has come to the boundary of two control intervals cannot leave it by small steps: an element of the
    other mode would first have to have no length. So one of its neighbours has it inside the interval before, another
    inside that after. A mode that lasts for at most an interval is left out in a third kind.

    Args:
        motion: of a collocation scheme, with an element to spare in its intervals (`with_room`).
    """
    transcription, branch = motion.transcription, motion.branch
    intervals = intervals_of(transcription.elements)
    placing = Placing(transcription, motion.elements, branch)
    sequences = [sequence_of(branch, own) for own in intervals]
    for name, changed in (*_shifted(sequences), *_left_out(sequences)):
        if all(0 < len(sequence) <= len(intervals[k]) for k, sequence in changed.items()):
            placed = placing.with_sequences(changed)
            yield ModeShift(name, motion.at(transcription.pack(placed.elements), placed.branch))


def _shifted(sequences: Sequence[Sequence[Factors]]) -> Iterator[tuple[str, Mapping[int, Sequence[Factors]]]]:
    """Yield the intervals around switches on boundaries, with the switches inside: together, then one at a time.

    Where the end time is free, the grid moves with it, and switches can leave their boundaries together only. So all of
    them up to one go into one interval, those after it into the other.
    """
    at = [k for k, (a, b) in enumerate(pairwise(sequences)) if a and b and a[-1] != b[0]]
    for count in range(len(at) + 1) if len(at) > 1 else ():
        early, late = at[:count], at[count:]
        yield f"{count} switches go into the intervals before them, the others after", _moved(sequences, early, late)
        if 0 < count < len(at):
            yield (
                f"{count} switches go into the intervals after them, the others before",
                _moved(sequences, late, early),
            )
    for k in at:
        yield f"the switch between intervals {k} and {k + 1} goes into the first", _moved(sequences, [k], [])
        yield f"the switch between intervals {k} and {k + 1} goes into the second", _moved(sequences, [], [k])


def _moved(
    sequences: Sequence[Sequence[Factors]], before: Sequence[int], after: Sequence[int]
) -> Mapping[int, Sequence[Factors]]:
    """Return the intervals that change where the switches at the ends of some go into these, or those after them."""
    changed = {k: list(sequences[k]) for k in {*before, *after, *(k + 1 for k in after)}}
    for k in before:
        changed[k].append(sequences[k + 1][0])
    for k in after:
        changed[k + 1].insert(0, sequences[k][-1])
    return {k: sequence for k, sequence in changed.items() if sequence != list(sequences[k])}


def _left_out(sequences: Sequence[Sequence[Factors]]) -> Iterator[tuple[str, Mapping[int, Sequence[Factors]]]]:
    """Yield intervals without a mode that begins and ends in them, its place taken by those beside it."""
    for k, sequence in enumerate(sequences):
        before, after = (sequences[i] if 0 <= i < len(sequences) else () for i in (k - 1, k + 1))
        for n, mode in enumerate(sequence):
            begins = n > 0 or (before and before[-1] != mode)
            ends = n < len(sequence) - 1 or (after and after[0] != mode)
            if not (begins and ends):
                continue
            others = [*sequence[:n], *sequence[n + 1 :]] or [before[-1], after[0]]
            yield f"a mode of interval {k} is left out", {k: [factors for factors, _ in groupby(others)]}
