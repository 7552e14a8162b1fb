"""A sequence of phases on its control grid: the transcription, and the branch on which contacts do what it says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.contact import ContactMode, Modes, factors_of
from fesd_robot.fesd import PHASE, SHORTEST_PHASE, ControlGrid, Transcription
from fesd_robot.fesd.polishing import BranchTranscription, ElementConditions
from fesd_robot.instants import SAME_NODE
from fesd_robot.mpcc import BranchBounds, Mpcc
from fesd_robot.nlp import NlpPoint
from fesd_robot.ocp import MotionProblem
from fesd_robot.phases.sequence import Phase, Sequence

WITH_FORCE = 2
"""Least number of intervals of a phase in which a contact has a force: with one control it could only push evenly."""


@dataclass(frozen=True)
class Discretised:
    """A sequence on its grid.

    Attributes:
        sequence: with its knots.
        counts: control intervals of every phase, (P).
        parts: elements of every interval in which the clock runs.
        polisher: of the transcription on the grid.
        branch: on which contacts do what the sequence says.
    """

    sequence: Sequence
    counts: tuple[int, ...]
    parts: int
    polisher: BranchTranscription
    branch: Branch

    @property
    def transcription(self) -> Transcription:
        """On the grid."""
        return self.polisher.transcription

    @cached_property
    def nodes(self) -> np.ndarray:
        """Numbers of the nodes where phases begin and end, (P + 1)."""
        return np.concatenate([[0], np.cumsum(self.counts)])

    def clocks(self, w: np.ndarray) -> np.ndarray:
        """Return the physical time of every node at a point, s, (N + 1)."""
        indices, clock = self.transcription.indices, self.transcription.ocp.clock
        assert clock is not None
        return np.array([w[indices.state(k)[clock.state]] for k in range(indices.intervals + 1)])

    def solved(self, w: np.ndarray) -> Sequence:
        """Return the sequence with the durations of a point, s."""
        return self.sequence.with_durations(np.diff(self.clocks(w)[self.nodes]))

    def impact_steps(self, w: np.ndarray) -> list[list[float]]:
        """Return the numerical times of the impacts of every phase at a point, and of those at the end, (P + 1)."""
        elements, indices, first, found = self.transcription.elements, self.transcription.indices, 0, []
        impulses = self.transcription.ocp.system.jump is not None
        for node, count, phase in zip(self.nodes[:-1], self.counts, self.sequence.phases, strict=True):
            own = 0 if impulses else len(phase.impacts)
            found.append([float(w[indices.step(first + n)]) for n in range(own)])
            first += sum(elements[node : node + count])
        last = 0 if impulses else len(self.sequence.at_end)
        return [*found, [float(w[indices.step(first - last + n)]) for n in range(last)]]

    @cached_property
    def phase_rows(self) -> np.ndarray:
        """Numbers of the rows of the branch NLP that are the durations of the phases, (P)."""
        blocks = self.polisher.problem.blocks
        counts = [len(block.lower) * block.copies for block in blocks]
        own = next(i for i, block in enumerate(blocks) if any(label.kind == PHASE for label in block.constraints))
        return sum(counts[:own]) + np.arange(counts[own])

    def within(self, lower: np.ndarray, upper: np.ndarray) -> _Within:
        """Return what bounds the branch NLP with durations of phases between two, s, (P)."""
        least = np.maximum(lower, SHORTEST_PHASE)
        return _Within(self, least, np.maximum(upper, least))


@dataclass(frozen=True, eq=False)
class _Within:
    """A polisher whose branch NLP holds the durations of phases within bounds."""

    own: Discretised
    lower: np.ndarray
    upper: np.ndarray

    @property
    def problem(self) -> Mpcc:
        """The problem without pairs."""
        return self.own.polisher.problem

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """That of the sequence."""
        return iter([self.own.branch])

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """None: what has vanished is left out of the sequence."""
        return None

    def whole(self, point: NlpPoint) -> NlpPoint:
        """Return the point: the problem has all rows."""
        return point

    def bounds(self, branch: Branch) -> BranchBounds:
        """The bounds that keep the active factors of a branch at zero, and durations within theirs."""
        bounds, rows = self.own.polisher.bounds(branch), self.own.phase_rows
        g_lower, g_upper = bounds.g_lower.copy(), bounds.g_upper.copy()
        g_lower[rows], g_upper[rows] = self.lower, self.upper
        return replace(bounds, g_lower=g_lower, g_upper=g_upper)


def discretised(motion: MotionProblem, sequence: Sequence, parts: int = 1) -> Discretised:
    """Return a sequence on its control grid.

    Every phase has a part of the task's intervals in proportion to its duration, at least one, and `WITH_FORCE` where a
    contact has a force. Where the clock stands still elements are added in front of the first interval of a phase.

    Args:
        motion: the task.
        sequence: with durations that add up to that of the task.
        parts: elements of every interval, beside those in which the clock stands still.
    """
    sequence = sequence.with_knots(motion.ocp.knots)
    counts = shares(sequence, motion.grid.intervals)
    lengths = tuple(
        phase.duration / count for phase, count in zip(sequence.phases, counts, strict=True) for _ in range(count)
    )
    ends = np.cumsum(counts)
    held = [int(end) for phase, end in zip(sequence.phases[:-1], ends, strict=False) if phase.knot]
    grid = ControlGrid(lengths, tuple(counts), moving=True, knots=(*held, int(ends[-1])))
    impulses = motion.task.method.contact == "impulses"
    modes: list[Modes] = []
    hits: list[frozenset[int]] = []
    acting: list[tuple[str, ...]] = []
    elements: list[int] = []
    for phase, count in zip(sequence.phases, counts, strict=True):
        frozen = () if impulses else phase.impacts
        elements += [parts + len(frozen)] + [parts] * (count - 1)
        modes += [*frozen, *[phase.modes] * count * parts]
        acting += [phase.acting] * (len(frozen) + count * parts)
        hits += [frozenset()] * len(frozen) + [phase.hit] + [frozenset()] * (count * parts - 1)
    if sequence.at_end and not impulses:
        elements[-1] += len(sequence.at_end)
        modes += sequence.at_end
        acting += [sequence.phases[-1].acting] * len(sequence.at_end)
        hits += [frozenset()] * len(sequence.at_end)
    own = replace(motion.fesd, elements=tuple(elements), step_equilibration="none")
    polisher = BranchTranscription(Transcription(motion.ocp, own, given_grid=grid))
    branch = _branch(polisher.conditions, sequence.names, modes, hits, acting)
    return Discretised(sequence, tuple(counts), parts, polisher, branch)


def shares(sequence: Sequence, intervals: int) -> list[int]:
    """Return the number of control intervals of every phase: a number shared out in proportion to durations."""
    least = np.array([_least(phase) for phase in sequence.phases])
    wanted = intervals * sequence.durations / sequence.durations.sum()
    counts = np.maximum(np.floor(wanted + SAME_NODE).astype(int), least)
    while counts.sum() < intervals:
        counts[int(np.argmax(wanted - counts))] += 1
    return [int(count) for count in counts]


def _least(phase: Phase) -> int:
    return WITH_FORCE if any(mode.closed for mode in phase.modes) else 1


def _branch(
    conditions: ElementConditions,
    names: tuple[str, ...],
    modes: list[Modes],
    hits: list[frozenset[int]],
    acting_sets: list[tuple[str, ...]],
) -> Branch:
    """Return the branch of elements in given modes, in which given sets of controls act; where contacts are hit,
    impulses of all closed ones act."""
    members = [member.condition for member in conditions.members]
    factors = []
    for own, hit, sets in zip(modes, hits, acting_sets, strict=True):
        found = factors_of(members, dict(zip(names, own, strict=True)), sets)
        if conditions.jumps:
            acting = {
                name: (mode if mode.closed else ContactMode.STICK).hitting
                for i, (name, mode) in enumerate(zip(names, own, strict=True))
                if hit and (i in hit or mode.closed)
            }
            found += tuple(
                factors_of([jump.condition], acting)[0] if jump.condition.label.contact in acting else ActiveFactor.H
                for jump in conditions.jumps
            )
        factors.append(found)
    return Branch(conditions.labels, tuple(factors), (False,) * len(factors))
