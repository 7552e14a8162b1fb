"""The search over sequences: from a motion to its neighbours as long as that pays."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from fesd_robot.phases.neighbours import Neighbour, neighbours
from fesd_robot.phases.sequence import Sequence
from fesd_robot.phases.solving import PhaseMotion, PhaseSolver

GAIN = 1e-3
"""Part of the cost by which a neighbour has to be cheaper to take the motion's place."""

WORTHWHILE = 5e-3
"""Part of the cost that a pass over all neighbours has to bring for another one to follow."""


@dataclass(frozen=True)
class Tried:
    """A sequence that was solved.

    Attributes:
        what: in words, where it came from or what was changed.
        sequence: as it is written.
        cost: infinite where no motion was found.
        seconds: since the beginning, when it was there.
        kept: whether it was the cheapest so far.
    """

    what: str
    sequence: str
    cost: float
    seconds: float
    kept: bool


@dataclass
class SequenceSearch:
    """A search, and what it has tried.

    Attributes:
        solver: of the task.
        counted: called with the number of sequences tried so far, and of how many.
        cheaper: called with every motion that costs less than all before.
        tried: all sequences so far.
        best: the cheapest motion; None if none is found.
    """

    solver: PhaseSolver
    counted: Callable[[int, int | None], None]
    cheaper: Callable[[PhaseMotion], None]
    tried: list[Tried] = field(default_factory=list)
    best: PhaseMotion | None = None
    _begin: float = field(default_factory=time.perf_counter)
    _seen: set[object] = field(default_factory=set)

    @property
    def cost(self) -> float:
        """Of the cheapest motion; infinite if there is none."""
        return self.best.cost if self.best else np.inf

    def guesses(self, sequences: Iterable[Sequence], what: str = "guess") -> None:
        """Solve sequences from the guess of the task."""
        for sequence in sequences:
            if self.solver.over:
                break
            if sequence.key not in self._seen:
                self._seen.add(sequence.key)
                self._note(what, sequence, self.solver.from_guess(sequence))

    def known(self, motion: PhaseMotion, what: str) -> None:
        """Take note of a motion that was found in another way."""
        self._note(what, motion.sequence, motion)

    def improve(self, passes: int) -> None:
        """Try neighbours of the cheapest motion, pass after pass, until one brings less than `WORTHWHILE`.

        Args:
            passes: at most.
        """
        for _ in range(passes):
            if self.best is None or self.solver.over:
                return
            before = self.cost
            self._pass()
            if not before - self.cost > WORTHWHILE * abs(before):
                return

    def _pass(self) -> None:
        """Try all neighbours of the cheapest motion; where one is cheaper, go on with the neighbours of that."""
        again = True
        while again and not self.solver.over:
            again = False
            assert self.best is not None
            found = list(neighbours(self.best.sequence, list(self.solver.motion.contacts)))
            untried = [one for one in found if one.sequence.key not in self._seen]
            for number, one in enumerate(untried):
                if self.solver.over:
                    return
                self.counted(number, len(untried))
                if self._tries(one):
                    again = True
                    break

    def _tries(self, one: Neighbour) -> bool:
        """Whether a neighbour is cheaper than the cheapest motion."""
        assert self.best is not None
        self._seen.add(one.sequence.key)
        below = self.cost - GAIN * abs(self.cost)
        return self._note(one.what, one.sequence, self.solver.from_motion(one.sequence, self.best.along, below))

    def _note(self, what: str, sequence: Sequence, motion: PhaseMotion | None) -> bool:
        cost = motion.cost if motion else np.inf
        kept = cost < self.cost
        shown = str(motion.sequence if motion else sequence)
        self.tried.append(Tried(what, shown, cost, time.perf_counter() - self._begin, kept))
        if motion and kept:
            self._seen.add(motion.sequence.key)
            self.best = motion
            self.cheaper(motion)
        return kept
