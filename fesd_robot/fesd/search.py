"""Finding the modes of a simulation step: solve, look for the first wrong sign, switch there, solve again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.fesd.element import states_function
from fesd_robot.fesd.groups import PairGroups
from fesd_robot.fesd.impulse_modes import impulses_are_right, modes_with_impulses
from fesd_robot.fesd.mode_sequence import FoundModes, ModeSequence, StepInput, Violation
from fesd_robot.fesd.modes import ModeEquations, Modes
from fesd_robot.fesd.point import PointFunctions
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.simulation import passed_bound

MAX_TRIALS = 400
"""Newton solves after which a search gives up."""

DOUBTED_TRIALS = 20
"""Newton solves that look for another solution after one whose signs are right at the stages alone."""

ACTIVE_G = 1e-8
"""Largest G at the left boundary of a step of a pair that can be active there."""


class ModeSearch:
    """Finds modes for which an interval of finite elements has all signs right.

    A depth-first search over sequences of modes. The first sequence is one mode throughout; where G or H of a pair has
    the wrong sign first, modes that differ in these pairs are tried from there on. What it returns solves the
    interval's complementarity system with products that vanish exactly.

    Args:
        equations: the interval.
        tolerance: how negative G, H or a step may be.
        state_lower, state_upper: bounds of the states, (n_x).

    Attributes:
        reason: what spoke against the modes that were found, if a search ends without a result.
        passed_bound: by how much the motion it found passes a bound of the state, 0 if it passes none.
        out_of_elements: whether a sequence was given up because it had more modes than the step has elements.
    """

    def __init__(
        self, equations: ModeEquations, tolerance: float, state_lower: np.ndarray, state_upper: np.ndarray
    ) -> None:
        self.equations = equations
        self.tolerance = tolerance
        self.state_lower, self.state_upper = state_lower, state_upper
        self.point = PointFunctions(equations.system)
        self.groups = PairGroups(equations.system)
        self.switching = equations.options.switch_detection
        self.reason, self.passed_bound, self.out_of_elements = "", 0.0, False

    def solve(self, step: StepInput, likely: Sequence[np.ndarray]) -> FoundModes | None:
        """Return the solved interval, or None.

        Args:
            step: where it starts.
            likely: modes it probably starts in, (n_pairs) each; all others that fit are tried after them.
        """
        self._trials = self._iterations = 0
        self.reason, self.passed_bound, self.out_of_elements = "", 0.0, False
        self._seen: set[bytes] = set()
        self._limit = MAX_TRIALS
        self._doubtful: FoundModes | None = None
        for mode in self._starts(step, likely):
            if self._trials >= self._limit:
                break
            sequence = ModeSequence((tuple(mode.tolist()),), (1.0,))
            solved = self._descend(step, sequence, self._constant(step, mode))
            if solved is not None:
                return solved
        return self._doubtful

    def check(self, step: StepInput, own: np.ndarray, modes: Modes) -> FoundModes | None:
        """Return a point solved exactly in given modes, or None if that has a wrong sign."""
        result = self.equations.newton(own, modes, step.x, step.p, step.length)
        right = result.converged and self._impulses_right(step, result.own, modes)
        right = right and self._first_violation(step, result.own, modes) is None
        if not right or not self._admissible(step, result.own):
            return None
        return FoundModes(result.own, modes, result.residual, 1, result.iterations)

    def _starts(self, step: StepInput, likely: Sequence[np.ndarray]) -> Iterator[np.ndarray]:
        for mode in likely:
            yield np.append(mode[: self.equations.pairs], np.zeros(len(self._of_impulse), dtype=bool))
        closed = np.asarray(self.point.sides(step.z)[0]).ravel() <= ACTIVE_G
        every, no_impulse = range(len(self.groups.groups)), np.zeros(len(self._of_impulse), dtype=bool)
        closed = np.append(closed, no_impulse)
        yield from self.groups.combined(closed & False, [(g, self.groups.subsets(g, closed)) for g in every])

    @property
    def _of_impulse(self) -> np.ndarray:
        """Number of the pair of every impulse."""
        return self.equations.impulse_pairs

    def _descend(self, step: StepInput, sequence: ModeSequence, guess: np.ndarray) -> FoundModes | None:
        modes = self._allocate(sequence)
        if modes is None or self._trials >= self._limit or modes.tobytes() in self._seen:
            return None
        if self.switching and (self._left_G(step)[self.equations.hit(modes[0])] > ACTIVE_G).any():
            return None  # a pair cannot be active where its G at the left boundary is not zero
        self._seen.add(modes.tobytes())
        self._trials += 1
        result = self.equations.newton(guess, modes, step.x, step.p, step.length)
        self._iterations += result.iterations
        if not result.converged or not self._impulses_right(step, result.own, modes):
            return None
        violation = self._first_violation(step, result.own, modes)
        if violation is None:
            if not self._admissible(step, result.own):
                return None
            found = FoundModes(result.own, modes, result.residual, self._trials, self._iterations)
            if not self._is_doubtful(step, result.own, modes):
                return found
            if self._doubtful is None:
                self._doubtful, self._limit = found, min(self._trials + DOUBTED_TRIALS, MAX_TRIALS)
            return None
        kept = int((~self.equations.goes_on(modes)[: violation.cell]).sum())
        for candidate in self._candidates(sequence, kept, modes[violation.cell], violation):
            solved = self._descend(step, candidate, self._guess(step, result.own, candidate))
            if solved is not None:
                return solved
        return None

    def _impulses_right(self, step: StepInput, own: np.ndarray, modes: Modes) -> bool:
        if not self._of_impulse.size:
            return True
        return impulses_are_right(self.equations, step, own, self._left_G(step), modes, self.tolerance)

    def _is_doubtful(self, step: StepInput, own: np.ndarray, modes: Modes) -> bool:
        """Return whether signs may be right only because no stage sees where they are wrong.

        An element without length meets every condition that holds at its left boundary. A pair that is left at the
        left boundary of the step may have G < 0 before the first stage.
        """
        if not self.switching:
            return False
        h, fractions = self._grid(own)[1], self.equations.fractions
        changed = ~self.equations.goes_on(modes)
        if changed.any() and (h[np.append(changed, False) | np.append(False, changed)] < 1e-9 * step.length).any():
            return True
        closed = ~modes[0][: self.equations.pairs] & (self._left_G(step) <= ACTIVE_G)
        if not closed.any() or fractions.min() <= 0.0:
            return False
        G_at = self.equations.values(own, step.x, step.p)[0][0][:, closed]
        dips = self._before_first @ np.vstack([np.zeros(G_at.shape[1]), G_at])
        return bool((dips < -self.tolerance).any())

    @cached_property
    def _before_first(self) -> np.ndarray:
        """From values at the left boundary and the points of an element to values before its first point."""
        fractions = self.equations.fractions
        inner = fractions.min() * 0.5 ** np.arange(1, 20)
        return lagrange(np.append(0.0, fractions), inner)

    def _candidates(
        self, sequence: ModeSequence, kept: int, base: np.ndarray, violation: Violation
    ) -> Iterator[ModeSequence]:
        """Yield sequences that differ from the violation on, nearest modes first; the first `kept` modes stay."""
        before = np.array(sequence.modes[kept - 1]) if kept else base
        if violation.immediate:
            # The last mode was wrong from its beginning: another one from there on.
            first, ends = sequence.modes[:kept], sequence.ends[:kept]
            for mode in self._modes(base, before, violation):
                if not kept or (mode != before).any() or mode[self.equations.pairs :].any():
                    yield ModeSequence((*first, tuple(mode.tolist())), (*ends, 1.0))
            if kept:
                return
        if self.switching:
            end = max(violation.time, sequence.ends[kept - 1] if kept else 0.0)
        else:
            end = violation.cell / self.equations.cells
        for mode in self._modes(base, base, violation):
            if kept + 1 >= self.equations.cells:
                self.reason = f"its switches need more than the {self.equations.elements} elements of a step"
                self.out_of_elements = True
                return
            yield ModeSequence((*sequence.modes[: kept + 1], tuple(mode.tolist())), (*sequence.ends[:kept], end, 1.0))

    def _modes(self, base: np.ndarray, before: np.ndarray, violation: Violation) -> Iterator[np.ndarray]:
        """Yield modes that differ from `base` in the groups with a wrong sign, those with few active pairs first."""
        if self._of_impulse.size:
            yield from modes_with_impulses(self.equations, base, before, violation)
            return
        options = []
        for number in self.groups.touched(np.concatenate([violation.entering, violation.leaving])):
            own = self.groups.groups[number]
            entering, leaving = np.intersect1d(violation.entering, own), np.intersect1d(violation.leaving, own)
            pool = base.copy()
            pool[entering] = True
            pool[own] |= before[own]
            modes = [
                mode
                for mode in self.groups.subsets(number, pool)
                if (mode[own] != base[own]).any()
                and (mode[entering].any() if entering.size else not mode[leaving].all())
            ]
            # Crossing before sliding: a sliding mode can meet a further surface without a wrong sign at a stage.
            changes, size = (lambda m, own=own: int((m[own] != base[own]).sum())), (lambda m: int(m.sum()))
            modes.sort(key=lambda m: (size(m), changes(m)) if self.switching else (changes(m), size(m)))
            options.append((number, modes))
        yield from self.groups.combined(base, options)

    def _allocate(self, sequence: ModeSequence) -> Modes | None:
        """Distribute the cells over a sequence, elements so that the steps are as equal as the switches allow."""
        numbers = self._numbers(sequence)
        return None if numbers is None else self._repeated(sequence, numbers)

    def _repeated(self, sequence: ModeSequence, numbers: np.ndarray) -> Modes:
        """Return the modes of all cells; an impulse acts at the beginning of a mode only."""
        modes = np.repeat(np.array(sequence.modes, dtype=bool), numbers, axis=0)
        if self._of_impulse.size:
            repeats = np.ones(len(modes), dtype=bool)
            repeats[np.cumsum([0, *numbers[:-1]])] = False
            modes[repeats, self.equations.pairs :] = False
        return modes

    def _numbers(self, sequence: ModeSequence) -> np.ndarray | None:
        """Return the number of cells of every mode, None if there are more modes than cells."""
        cells, count = self.equations.cells, len(sequence.modes)
        if not self.switching:
            return np.diff([0, *(round(end * cells) for end in sequence.ends)])
        if count > cells:
            return None
        lengths = np.diff([0.0, *sequence.ends])
        numbers = np.ones(count, dtype=int)
        for _ in range(cells - count):
            numbers[int(np.argmax(lengths / numbers))] += 1
        return numbers

    # -- where Newton's method starts ------------------------------------------------------------------------------

    def _constant(self, step: StepInput, mode: np.ndarray) -> np.ndarray:
        """Return own variables whose state stays where it is."""
        layout = self.equations.layout
        z = self.point.fit(step.x, step.u, step.z, step.p, mode)
        times = np.array([0.0, step.length])
        states = np.array([step.x, step.x])
        steps = np.full(layout.elements, step.length / layout.elements)
        return self._sampled(step, steps, times, states, lambda x, cell: z)

    def _guess(self, step: StepInput, own: np.ndarray, sequence: ModeSequence) -> np.ndarray:
        """Return the states of an earlier trial, with the steps of the new sequence."""
        layout, numbers = self.equations.layout, self._numbers(sequence)
        if numbers is None:
            return own
        modes = self._repeated(sequence, numbers)
        steps = np.full(layout.elements, step.length / layout.elements)
        if self.switching:
            steps = np.repeat(np.diff([0.0, *sequence.ends]) * step.length / numbers, numbers)

        def algebraic(x: np.ndarray, cell: int) -> np.ndarray:
            start = self.equations.system.guess(x, step.u, step.p)
            return self.point.fit(x, step.u, start, step.p, modes[cell])

        return self._sampled(step, steps, *self._samples(step, own), algebraic)

    def _sampled(
        self,
        step: StepInput,
        steps: np.ndarray,
        times: np.ndarray,
        states: np.ndarray,
        algebraic: Callable[[np.ndarray, int], np.ndarray],
    ) -> np.ndarray:
        """Return the own variables whose states lie on given samples; ``algebraic`` gives z from (x, cell)."""
        layout, c = self.equations.layout, self.equations.options.tableau.c
        own = np.zeros(layout.size)
        own[: layout.n_u] = step.u
        begin = 0.0
        for n, h in enumerate(steps):
            own[layout.step(n)] = h
            if layout.jump_size:
                states_there = np.array([np.interp(begin, times, row) for row in states.T])
                own[layout.jumped(n)] = states_there[list(layout.jump_states)]
            for j in range(layout.stages + layout.own_end):
                fraction = 1.0 if j == layout.stages else c[j]
                x = np.array([np.interp(begin + fraction * h, times, row) for row in states.T])
                if layout.stage_states or j == layout.stages:
                    own[layout.state(n, j)] = x
                if j < layout.stages or layout.end_algebraic:
                    if not j or not self.switching:  # one value an element is enough to start from
                        z = algebraic(x, n if self.switching else n * layout.stages + j)
                    own[layout.algebraic(n, j)] = z
                if layout.slopes and j < layout.stages:
                    own[layout.slope(n, j)] = np.asarray(self.point.rate(x, step.u, z, step.p)).ravel()
            begin += h
        return own

    @cached_property
    def states(self) -> ca.Function:
        """(x_left, own) -> (states, slopes)."""
        return states_function(self.equations.layout, self.equations.options.tableau)

    def _samples(self, step: StepInput, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the times and states of a trial at its start, the stages and the element ends, in time order."""
        layout, begin, h = self.equations.layout, *self._grid(own)
        states = np.asarray(self.states(step.x, own)[0]).T
        fractions = np.append(self.equations.options.tableau.c, 1.0)[: len(states) // layout.elements]
        times = np.append(0.0, (begin[:, None] + h[:, None] * fractions[None, :]).ravel())
        order = np.argsort(times, kind="stable")
        return times[order], np.vstack([step.x, states])[order]

    def _grid(self, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the left ends and lengths of the elements."""
        h = own[[self.equations.layout.step(n) for n in range(self.equations.elements)]]
        return np.concatenate([[0.0], np.cumsum(h)])[:-1], h

    # -- signs -----------------------------------------------------------------------------------------------------

    def _left_G(self, step: StepInput) -> np.ndarray:
        """Return G at the left boundary of the step, (n_pairs)."""
        return np.asarray(self.point.sides(step.z)[0]).ravel()

    def _first_violation(self, step: StepInput, own: np.ndarray, modes: Modes) -> Violation | None:
        equations, stages = self.equations, self.equations.layout.stages
        G_at, H_at = equations.values(own, step.x, step.p)
        wrong_G = (G_at < -self.tolerance) & equations.sign_checked[None, :, None]
        if self.switching and equations.options.tableau.collocation and equations.points > stages:
            H_at[:, stages] = np.einsum("j,njp->np", equations.to_right, H_at[:, :stages])
        else:
            H_at[:, stages:] = 0.0
        wrong_H = H_at < -self.tolerance
        wrong = (wrong_G | wrong_H).any(axis=2)
        if not wrong.any():
            return None
        order = np.argsort(equations.fractions, kind="stable").tolist()
        points = [(n, j) for n in range(equations.elements) for j in order]
        first = next(number for number, point in enumerate(points) if wrong[point])
        n, j = points[first]
        begin, h = self._grid(own)
        times = begin[:, None] + equations.fractions[None, :] * h[:, None]
        checked = [point for point in points[:first] if equations.sign_checked[point[1]]]
        last_G, last_time = (G_at[checked[-1]], times[checked[-1]]) if checked else (self._left_G(step), 0.0)
        begins = self._first_of_mode(modes, n)
        of_mode = [point for point in points[:first] if point[0] >= begins and point[1] < stages]
        if of_mode:
            last_H, H_time = H_at[of_mode[-1]], times[of_mode[-1]]
        else:
            last_H, H_time = equations.to_left @ H_at[n, :stages], float(begin[n])
        zeros = [_zero(last_time, last_G[i], times[n, j], G_at[n, j, i]) for i in np.flatnonzero(wrong_G[n, j])]
        zeros += [_zero(H_time, last_H[i], times[n, j], H_at[n, j, i]) for i in np.flatnonzero(wrong_H[n, j])]
        seen = slice(None) if self.switching else slice(j, j + 1)
        return Violation(
            cell=n if self.switching else n * stages + j,
            entering=np.flatnonzero(wrong_G[n, seen].any(axis=0)),
            leaving=np.flatnonzero(wrong_H[n, seen].any(axis=0)),
            time=float(min(max(min(zeros) / step.length, 0.0), 1.0)),
            immediate=self.switching and not of_mode and bool(min(zeros) <= begin[n] + 1e-12),
        )

    def _first_of_mode(self, modes: Modes, n: int) -> int:
        """Return the element in which the mode of element n begins; without switch detection the first."""
        goes_on = self.equations.goes_on(modes)
        while self.switching and n and goes_on[n - 1]:
            n -= 1
        return n if self.switching else 0

    def _admissible(self, step: StepInput, own: np.ndarray) -> bool:
        """Return whether steps, states and algebraic variables are within their bounds."""
        layout, system, slack = self.equations.layout, self.equations.system, self.tolerance
        if self.switching:
            h = self._grid(own)[1] / step.length
            longest = (1.0 + self.equations.options.gamma) / layout.elements
            if h.max() > longest + 1e-9:
                self.reason = (
                    f"its modes need an element of length {h.max() * step.length:.4g}, longer than the "
                    f"{longest * step.length:.4g} that step_freedom {self.equations.options.gamma:g} allows"
                )
            if h.min() < -1e-9 or h.max() > longest + 1e-9:
                return False
        states = np.asarray(self.states(step.x, own)[0]).T
        passed = passed_bound(system, states, (self.state_lower, self.state_upper), self.tolerance)
        if passed:
            self.reason, self.passed_bound = passed
            return False
        sign_checked = np.flatnonzero(self.equations.sign_checked[: layout.stages])
        z = np.array([own[layout.algebraic(n, j)] for n in range(layout.elements) for j in sign_checked.tolist()])
        z = z.reshape(-1, layout.n_z)
        return not ((z < system.algebraic_lower - slack).any() or (z > system.algebraic_upper + slack).any())


def _zero(t_before: float, before: float, time: float, after: float) -> float:
    """Return the time at which the line through two values crosses zero; the first one if it does not."""
    return t_before + (time - t_before) * before / (before - after) if before > 0.0 > after else t_before
