"""A plan from any of its instants on, ready to be solved again from any state there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.fesd import OptimalControlProblem
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.instants import SAME_TIME
from fesd_robot.mpcc import BranchNlp
from fesd_robot.nlp import Nlp, NlpNumbers
from fesd_robot.nlp.real_time import PrimalDual, RealTimeInteriorPoint

SETTLING, SETTLED = 60, 1e-8
"""Steps from a plan to the solution that keeps its bounds at a distance, at most, and the last one's size."""

STRENGTH = 4.0
"""Up to which multiplier bounds hold, in terms of the largest of a plan."""

BARRIER = 2.5
"""Sum of the products of all multipliers and distances, as a multiple of a plan's objective, for steps far away."""

LEAST, LEAST_BARRIER = 0.01, 1e-9
"""Part of it for steps nearby, and one of the products, at least."""


@dataclass(frozen=True)
class RunningElements:
    """Where the variables of the elements in which the clock runs sit, E of them with S stages.

    Attributes:
        elements, intervals, phases: numbers among all elements, and of what they belong to, (E).
        left: of the state at the left end, (E, n_x).
        states, algebraic: at the stages, (E, S, n_x) and (E, S, n_z).
        controls: (E, n_u).
        steps: (E).
    """

    elements: np.ndarray
    intervals: np.ndarray
    phases: np.ndarray
    left: np.ndarray
    states: np.ndarray
    algebraic: np.ndarray
    controls: np.ndarray
    steps: np.ndarray

    def first_of(self, phase: int) -> int:
        """Return the number of the first element of a phase."""
        return int(np.searchsorted(self.phases, phase))


class Horizon:
    """A plan whose beginning passes.

    Args:
        motion: of the whole plan, on a grid that moves.
        beginnings: in how many of its phases, the first ones, it may begin; default: in all.
        least: least barrier parameter, as a part of the largest one.

    Attributes:
        solver: of its branch NLP, whose goal gives way where it cannot be reached.
        settled: its solution, which keeps bounds at a distance.
        barriers: the least and the largest barrier parameter of the solver.
        running: the elements in which the clock runs; the others are impacts.
        duration: of the plan, s.
        clock: number of the clock in the state.
        node_clocks: variables that are the times of the nodes of the control grid, (N + 1).
        phase_nodes: numbers of the nodes at which phases begin, and of the last node, (P + 1).
    """

    def __init__(self, motion: BranchMotion, beginnings: int | None = None, least: float = LEAST) -> None:
        self.motion, self._numbers_of = motion, motion.transcription.ocp
        own = motion.transcription
        nlp, numbers = _program(motion)
        assert own.ocp.clock is not None
        self.clock = own.ocp.clock.state
        self.nodes = own.options.tableau.nodes
        last = own.indices.state(own.grid.intervals)
        goal = np.flatnonzero(own.ocp.terminal_lower == own.ocp.terminal_upper)
        self.solver = RealTimeInteriorPoint(nlp, numbers, last[goal[goal != self.clock]])
        self.phase_nodes = np.concatenate([[0], np.cumsum(own.grid.phases)])
        self.node_clocks = np.array([own.indices.state(k)[self.clock] for k in range(own.grid.intervals + 1)])
        self.running = self._running()
        self._rows_at = self._rows_of_beginnings()
        self.duration = float(motion.w[self.node_clocks[-1]])
        self._end_row = self._row_of_the_end()
        final = self.running.first_of(beginnings or len(own.grid.phases))
        analysed = [0, *(e for e in range(1, final) if self.solver.analyse(*self._passed(e)[:2]))]
        self._element: int | None = None
        self.restrict(motion.w, 0)
        self.settled = self._settled(np.clip(motion.w, numbers.lower, numbers.upper), least)
        for element in reversed(analysed):
            self.restrict(self.settled.x, element)
            self.solver.settle(self.settled)

    def with_numbers(self, ocp: OptimalControlProblem) -> None:
        """Let the solver have the numbers of another problem with the same equations: its goal, reference, weights."""
        if ocp is not self._numbers_of:
            self._numbers_of = ocp
            self.solver.renumber(_program(self.motion.with_numbers(ocp))[1])

    def lasts_until(self, time: float) -> None:
        """Let the motion last longer than the plan, until a time, s; `restrict` takes it back."""
        self.solver.shift(self._end_row, max(time - self.duration, 0.0))

    def end(self, x: np.ndarray) -> np.ndarray:
        """Return the state at the end, (n_x)."""
        own = self.motion.transcription
        return x[own.indices.state(own.grid.intervals)]

    def place(self, x: np.ndarray, time: float, phase: int, last: float) -> int:
        """Return the number of the running element of a phase in which a time is, s.

        Args:
            x: variables.
            time: s.
            phase: number of the phase.
            last: what is left of an element that is too short, s; then it is the next one.
        """
        run = self.running
        first, end = run.first_of(phase), run.first_of(phase + 1)
        ends = x[run.states[first:end, -1, self.clock]] - last
        return first + min(int(np.searchsorted(ends, time, side="right")), end - first - 1)

    def state(self, element: int) -> np.ndarray:
        """Return the variables that are the state in which a running element begins, (n_x)."""
        return self.running.left[element]

    def span(self, x: np.ndarray, element: int) -> tuple[float, float]:
        """Return when a running element begins and ends, s."""
        run = self.running
        return float(x[run.left[element, self.clock]]), float(x[run.states[element, -1, self.clock]])

    def runs_backwards(self, x: np.ndarray, element: int) -> bool:
        """Return whether the clock does, from a running element on."""
        run = self.running
        spans = x[run.states[element:, -1, self.clock]] - x[run.left[element:, self.clock]]
        return bool((spans < -SAME_TIME).any())

    def phase_ends(self, x: np.ndarray) -> np.ndarray:
        """Return when phases begin, and when the last one ends, (P + 1), s."""
        return x[self.node_clocks[self.phase_nodes]]

    def begun_at(self, x: np.ndarray, element: int, time: float) -> np.ndarray:
        """Return variables of a motion that begins in a running element: what is left of it has all of its stages.

        States and algebraic variables are those of the polynomials.

        Args:
            x: variables.
            element: number of the element, as of `place`.
            time: at which it begins, s.
        """
        run, tableau = self.running, self.motion.transcription.options.tableau
        left, states, algebraic = run.left[element], run.states[element], run.algebraic[element]
        begin, end = self.span(x, element)
        share = (end - time) / (end - begin)
        fractions = 1.0 - share * (1.0 - np.concatenate([[0.0], tableau.c]))
        known = np.vstack([x[left], x[states]])
        moved = lagrange(tableau.nodes, fractions) @ known
        result = x.copy()
        result[states] = moved[1:]
        result[algebraic] = lagrange(tableau.c, fractions[1:]) @ x[algebraic]
        result[left] = moved[0]
        result[run.steps[element]] *= share
        return result

    def at_rest(self, x: np.ndarray, time: float, duration: float) -> tuple[np.ndarray, int]:
        """Return variables of a motion that rests in the last phase as it ends, and the element in which it begins.

        Args:
            x: variables.
            time: at which it begins, s.
            duration: how long it lasts, s.
        """
        run = self.running
        first = run.first_of(len(self.phase_nodes) - 2)
        result, last = x.copy(), run.states[-1, -1]
        lengths = np.array([np.subtract(*self.span(self.settled.x, e)[::-1]) for e in range(first, len(run.steps))])
        factor = duration / lengths.sum()
        begins = time + factor * np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        nodes = np.concatenate([[0.0], self.motion.transcription.options.tableau.c])
        for e, begin, length in zip(range(first, len(run.steps)), begins, lengths * factor, strict=True):
            places = np.concatenate([run.left[e][None], run.states[e]])
            result[places] = x[last]
            result[places[:, self.clock]] = begin + nodes * length
            result[run.algebraic[e]] = x[run.algebraic[-1, -1]]
            result[run.controls[e]] = x[run.controls[-1]]
            result[run.steps[e]] = self.settled.x[run.steps[e]] * factor
        return result, first

    def later(self, x: np.ndarray, element: int, time: float) -> np.ndarray:
        """Return variables of the same motion from a running element on, which begins at another time, s."""
        run, result = self.running, x.copy()
        seconds = time - x[run.left[element, self.clock]]
        clocks = np.concatenate([run.left[element:, self.clock], run.states[element:, :, self.clock].ravel()])
        result[np.unique(clocks)] += seconds
        return result

    def restrict(self, x: np.ndarray, element: int, *, whole: bool = False) -> None:
        """Let the solver keep all that is before a running element, and the share of its interval that is left.

        Args:
            x: variables, as of `begun_at`.
            element: number of the element.
            whole: whether all of its interval is left.
        """
        passed, left_out, held = self._passed(element)
        if element != self._element:
            self.solver.restrict(passed, left_out)
            self._element = element
        if not whole:
            self.solver.hold(held, x)
            return
        run = self.running
        interval = int(run.intervals[element])
        self.solver.hold(held[:0], x)
        # Its interval begins at the element, the row that makes it as long as the next one knows the node before that.
        late = float(x[self.node_clocks[interval]] - x[run.left[element, self.clock]])
        self.solver.shift(np.intersect1d(held, self._equal_intervals[interval]), late)

    def _passed(self, element: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the variables that have passed when the motion begins in a running element, and `_rows_at`."""
        run, passed = self.running, np.zeros(self.solver.size, dtype=bool)
        passed[: run.steps[element]] = True
        passed[run.controls[element]] = False
        return passed, *self._rows_at[element]

    def _settled(self, x: np.ndarray, least: float) -> PrimalDual:
        """Return the solution, for a barrier and a strength of bounds that fit this plan."""
        solver = self.solver
        largest = BARRIER * abs(solver.objective(x)) / max(solver.bounds, 1)
        self.barriers = max(least * largest, LEAST_BARRIER), max(largest, LEAST_BARRIER)
        solver.barrier = self.barriers[0]
        iterate = self._centred(solver.at(x))
        solver.strength = STRENGTH * float(iterate.z.max(initial=1.0))
        return self._centred(solver.at(iterate.x, iterate))

    def eased(self, *, further: bool) -> None:
        """Let the barrier be larger, for a step to a state far away, or smaller, for exact bounds.

        Args:
            further: whether it is the largest one, or half of what it is.
        """
        self.solver.barrier = self.barriers[1] if further else max(self.barriers[0], 0.5 * self.solver.barrier)

    def _centred(self, iterate: PrimalDual) -> PrimalDual:
        for _ in range(SETTLING):
            self.solver.prepare(iterate)
            step = self.solver.step()
            far = float(np.abs(step.iterate.x - iterate.x).max())
            iterate = step.iterate
            if far <= SETTLED:
                break
        return iterate

    def _rows_of_beginnings(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return for every running element what becomes of rows when the motion begins in it.

        Left out are the rows of earlier elements, and those that tie what comes to lengths that have passed. Rows that
        make its length, or that of its interval, equal to the next one keep the difference that there is.
        """
        own, run = self.motion.transcription, self.running
        indices = own.indices
        of_rows, columns = self.solver.columns_of_rows()
        count = int(of_rows.max(initial=-1)) + 1
        last, first = np.full(count, -1), np.full(count, self.solver.size)
        np.maximum.at(last, of_rows, columns)
        np.minimum.at(first, of_rows, columns)
        self._equal_intervals = [
            np.flatnonzero((first == clocks[0]) & (last == clocks[2]))
            for clocks in (self.node_clocks[k : k + 3] for k in range(own.grid.intervals - 1))
        ]
        self._equal_intervals.append(np.zeros(0, dtype=int))
        lengths = np.zeros(self.solver.size, dtype=bool)
        lengths[[indices.step(e) for e in range(sum(own.elements))]] = True
        is_step = np.append(lengths, False)
        lengths[self.node_clocks] = True
        lengths[[int(indices.control(k)[-1]) for k in range(own.grid.intervals)]] = True
        of_lengths = np.bincount(of_rows, ~lengths[columns], minlength=count) == 0
        known = np.flatnonzero(last >= 0)
        result = []
        for e, interval in enumerate(run.intervals):
            begins, control = run.steps[e], indices.control(int(interval))
            node = self.node_clocks[interval]
            before = (last < begins) & ~((first >= control[0]) & (last <= control[-1]))
            ties = of_lengths & (last >= begins) & ((first < node) | (is_step[first] & (first < begins)))
            held = of_lengths & ~ties & ((first == begins) | (first == node)) & (last > begins)
            result.append((known[(before | ties)[known]], known[held[known]]))
        return result

    def _row_of_the_end(self) -> np.ndarray:
        """Return the number of the row that keeps the end at its time, one or none."""
        rows, columns = self.solver.columns_of_rows()
        own = self.motion.transcription
        pace = int(own.indices.control(own.grid.intervals - 1)[-1])
        apart = np.bincount(rows, ~np.isin(columns, [self.node_clocks[-1], pace]), minlength=int(rows.max()) + 1)
        with_clock = rows[columns == self.node_clocks[-1]]
        return with_clock[apart[with_clock] == 0]

    def _running(self) -> RunningElements:
        own, motion = self.motion.transcription, self.motion
        indices, stages = own.indices, own.options.tableau.stages
        n_x, n_z = own.ocp.system.state.numel(), own.ocp.system.algebraic.numel()
        found, last = [], np.cumsum(own.elements)
        for e, element in enumerate(motion.elements):
            advance = element.x[-1, self.clock] - element.x_left[self.clock]
            if motion.branch.without_length[e] or advance <= SAME_TIME:
                continue
            points = np.array([indices.stage(e, j) for j in range(stages)])
            interval = int(np.searchsorted(last, e, side="right"))
            phase = int(np.searchsorted(self.phase_nodes, interval, side="right")) - 1
            found.append(
                (
                    e,
                    interval,
                    phase,
                    indices.left_state(e),
                    points[:, :n_x],
                    points[:, n_x : n_x + n_z],
                    indices.control(interval),
                    indices.step(e),
                )
            )
        return RunningElements(*(np.array(part) for part in zip(*found, strict=True)))


def _program(motion: BranchMotion) -> tuple[Nlp, NlpNumbers]:
    """Return the branch NLP of a motion, and its numbers."""
    nlp, bounds = BranchNlp.of(motion.polisher, "always").nlp, motion.polisher.bounds(motion.branch)
    numbers = NlpNumbers(bounds.lower, bounds.upper, bounds.g_lower, bounds.g_upper, nlp.parameters((0, 0)))
    return nlp.program, numbers
