"""The search over sequences: from a motion to its neighbours as long as that pays."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fesd_robot.mpcc import PolishingReport
from fesd_robot.phases.acting import groups_of
from fesd_robot.phases.gait import gait_images
from fesd_robot.phases.neighbours import neighbours
from fesd_robot.phases.profile import ContactProfile
from fesd_robot.phases.pushing import Pushing
from fesd_robot.phases.reading import sequence_of
from fesd_robot.phases.sequence import Sequence
from fesd_robot.phases.solving import PhaseMotion, PhaseSolver
from fesd_robot.running import Cores, Lookahead, SearchEffort

OVERHEAD = 10_000
"""What an iteration takes beside the nonzeros, with its part of what an NLP takes before the first one."""

MUCH_DEARER = 2.0
"""Times as much as before a motion costs on elements half as long, from which it is looked for from the guess, too."""


@dataclass(frozen=True)
class Tried:
    """A sequence that was solved.

    Attributes:
        what: in words, where it came from or what was changed.
        sequence: as it is written.
        cost: infinite where no motion was found, or none that is cheaper.
        seconds: since the beginning, when it was there.
        kept: whether it was the cheapest so far.
    """

    what: str
    sequence: str
    cost: float
    seconds: float
    kept: bool


class _Trial(NamedTuple):
    """A sequence to solve, from a motion with its durations as they were guessed, in a form for another process; from
    the guess of the task if there is no motion."""

    sequence: Sequence
    below: float
    from_sequence: Sequence | None = None
    from_w: np.ndarray | None = None


class _Found(NamedTuple):
    """The motion of a trial, as another process says it, and the iterations that the trial took."""

    sequence: Sequence | None
    report: PolishingReport | None
    iterations: int


@dataclass
class SequenceSearch:
    """A search, and what it has tried.

    Attributes:
        solver: of the task.
        cores: on which neighbours are tried at once.
        on_progress: called with the number of sequences tried so far, and of how many.
        cheaper: called with every motion that costs less than all before.
        tried: all sequences so far.
        best: the cheapest motion; None if none is found.
        starts: the cheapest motions of guesses, as many as the run's effort says, the cheapest first.
        iterations: of IPOPT with sequences that are tried at once, or on the cores that there are.
    """

    solver: PhaseSolver
    cores: Cores
    on_progress: Callable[[int, int | None], None]
    cheaper: Callable[[PhaseMotion], None]
    tried: list[Tried] = field(default_factory=list)
    best: PhaseMotion | None = None
    starts: list[PhaseMotion] = field(default_factory=list)
    iterations: int = 0
    _begin: float = field(default_factory=time.perf_counter)
    _guessed: set[object] = field(default_factory=set)
    _seen: set[object] = field(default_factory=set)
    _patience: float = np.inf
    _found_at: float = 0.0
    _since: float = 0.0
    _reference: float = np.inf

    def __post_init__(self) -> None:
        self._ahead = Lookahead(self._found, self.cores, self.solver.run.stop, self._alone)

    def close(self) -> None:
        """End the processes that try sequences."""
        self._ahead.close()

    @property
    def cost(self) -> float:
        """Of the cheapest motion; infinite if there is none."""
        return self.best.cost if self.best else np.inf

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return time.perf_counter() - self._begin

    def guesses(self, sequences: Iterable[Sequence], what: str = "guess") -> None:
        """Solve sequences from the guess of the task, all but the first of them at once on the cores."""
        untried = []
        for sequence in sequences:
            if self._key(sequence) not in self._guessed:
                self._guessed.add(self._key(sequence))
                untried.append(sequence)
        if untried and not self.solver.over:  # what other processes need has been made here then
            self.note(what, untried[0], self.solver.from_guess(untried[0], self.cost))
        if len(untried) > 1 and not self.solver.over:
            trials = [_Trial(sequence, self.cost) for sequence in untried[1:]]
            for sequence, result in zip(untried[1:], self._ahead.results(trials), strict=False):
                self.note(what, sequence, self._motion(result))

    def pushes(self, pushings: Iterable[Pushing]) -> None:
        """Solve the sequences of pushes from the guesses that push, of each until one leads to a motion."""
        for pushing in pushings:
            for sequence in pushing.sequences:
                if self.solver.over:
                    return
                found = self.solver.from_guess(sequence, self.cost, state=pushing.state)
                self.note("push", sequence, found)
                if found:
                    break

    def divide(self) -> None:
        """Solve the cheapest motion again with twice as many elements; all that follow have as many, if that works."""
        best = self.best
        assert best is not None
        self.solver.parts *= 2
        along = best.along
        sequence = sequence_of(along)
        found = self.solver.from_known(sequence, along)
        if found is None or found.cost > MUCH_DEARER * best.cost:  # what is that far away is another motion
            again = self.solver.from_guess(best.own.sequence)
            found = min((one for one in (found, again) if one), key=lambda one: one.cost, default=None)
        if found is None:
            self.solver.parts //= 2
            return
        self.close()  # other processes have the elements of before
        self.best, self.starts = None, []
        self.note("elements divided", found.sequence, found)

    def improve(self) -> None:
        """Try neighbours of the cheapest motions, and of those that are cheaper, until a pass brings too little.

        It ends as well once neighbours have taken as much work since the last gain that was worthwhile as everything
        had before, and after the most work, both as the run's effort says.
        """
        self._found_at = self._work
        self._gained()
        for start in self.starts[: self._effort.search_starts]:
            self._improve_from(start)

    def _improve_from(self, start: PhaseMotion) -> None:
        """Try neighbours of a motion, and of those that are cheaper, until a pass brings too little."""
        while not self._over:
            before = start.cost
            while better := self._better_neighbour(start):
                start = better
            if not before - start.cost > self._effort.worthwhile_gain * abs(before):
                return

    def _gained(self) -> None:
        """Take note of a gain that is worthwhile."""
        self._since, self._reference, effort = self._work, self.cost, self._effort
        self._patience = min(max(effort.least_patience, self._work), effort.most_patience)

    @property
    def _effort(self) -> SearchEffort:
        return self.solver.run.effort

    @property
    def _work(self) -> float:
        """Of all NLPs so far."""
        iterations = self.iterations + sum(report.iterations for report in self.solver.reports)
        return iterations * (self._nonzeros + OVERHEAD)

    @cached_property
    def _nonzeros(self) -> int:
        """Of the derivatives in an iteration; they are about the same for all sequences of a task."""
        return self.solver.nonzeros(self.best) if self.best else 0

    @property
    def _over(self) -> bool:
        """Whether the search ends: without time, by the user, or because it has not paid for long."""
        if self.solver.run.over:
            return True
        work = self._work
        return work - self._since > self._patience or work - self._found_at > self._effort.most_work

    @cached_property
    def _images(self) -> tuple[int, ...]:
        return gait_images(self.solver.motion)

    def _better_neighbour(self, current: PhaseMotion) -> PhaseMotion | None:
        """Return a neighbour of a motion that is cheaper, None if there is none, or the search ends."""
        if self._over:
            return None
        motion = self.solver.motion
        found = neighbours(
            current.sequence,
            list(motion.contacts),
            ContactProfile.of(motion, current.along),
            motion.ocp.knots,
            self._images,
            len(motion.compliant),
            groups_of(motion),
        )
        untried = [one for one in found if self._key(one.sequence) not in self._seen]
        below = current.cost - self._effort.neighbour_gain * abs(current.cost)
        trials = [_Trial(one.sequence, below, current.own.sequence, current.w) for one in untried]
        for number, (one, result) in enumerate(zip(untried, self._ahead.results(trials), strict=False), start=1):
            self.on_progress(number, len(untried))
            self._seen.add(self._key(one.sequence))
            better = self._motion(result)
            kept = self._kept(one.what, one.sequence, better)
            if kept and self._reference - self.cost > self._effort.worthwhile_gain * abs(self._reference):
                self._gained()
            if better and better.cost < current.cost:
                return better
            if self._over:
                break
        return None

    def _motion(self, result: _Found) -> PhaseMotion | None:
        """Return the motion of a trial that may have been in another process, and count its iterations."""
        self.iterations += result.iterations
        if result.sequence is None or result.report is None:
            return None
        return self.solver.motion_of(result.sequence, result.report)

    def _found(self, trial: _Trial) -> _Found:
        """Return the motion of a trial."""
        before, run = len(self.solver.reports), self.solver.run
        self.solver.run = replace(run, report=None)  # they are counted where the result is taken
        if trial.from_sequence is None or trial.from_w is None:
            motion = self.solver.from_guess(trial.sequence, trial.below)
        else:
            along = self.solver.again(trial.from_sequence, trial.from_w)
            motion = self.solver.from_motion(trial.sequence, along, trial.below)
        iterations = sum(report.iterations for report in self.solver.reports[before:])
        del self.solver.reports[before:]
        self.solver.run = run
        if motion is None:
            return _Found(None, None, iterations)
        return _Found(motion.own.sequence, motion.report, iterations)

    def _alone(self) -> None:
        """In another process nobody looks, and nothing stops but the process."""
        self.solver.run = self.solver.run.unseen

    def _key(self, sequence: Sequence) -> tuple[object, ...]:
        return sequence.key_with(self.solver.motion.ocp.knots)

    def note(self, what: str, sequence: Sequence, motion: PhaseMotion | None) -> None:
        """Take note of a sequence that was solved, from whose motion a search may begin."""
        self._kept(what, sequence, motion)
        if motion:
            self.starts = sorted([*self.starts, motion], key=lambda one: one.cost)
            del self.starts[max(self._effort.search_starts, 1) :]

    def _kept(self, what: str, sequence: Sequence, motion: PhaseMotion | None) -> bool:
        """Take note of a sequence that was solved; return whether its motion is the cheapest so far."""
        cost = motion.cost if motion else np.inf
        kept = cost < self.cost
        shown = str(motion.sequence if motion else sequence)
        self.tried.append(Tried(what, shown, cost, self.seconds, kept))
        if motion and kept:
            self._seen.add(self._key(motion.sequence))
            self.best = motion
            self.cheaper(motion)
        return kept
