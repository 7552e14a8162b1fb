"""A solved optimal control problem in the time of its user."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.errors import ModelError
from fesd_robot.fesd import Element, OptimalControlProblem, Phase, Transcription
from fesd_robot.instants import SAME_PART
from fesd_robot.mpcc import Certificate, NlpStatus, Residuals

LENGTH_AT_BOUND = 1e-6
"""An element is as long as it may be up to this part of its length."""


@dataclass(frozen=True)
class StartReport:
    """Result of an initial guess.

    Attributes:
        number: of the start, from 0.
        way: ``loose`` or ``converging``, the homotopy that was followed from it.
        solved: whether it ended in a solution.
        cost: there.
        status: how its last NLP ended.
        iterations: of IPOPT.
    """

    number: int
    way: str
    solved: bool
    cost: float
    status: NlpStatus
    iterations: int


@dataclass(frozen=True)
class OptimalControlSolution:
    """The cheapest solution that was found of an optimal control problem.

    Times are the user's: of a problem with a free end time they are stretched to it.

    Attributes:
        problem: as it was given.
        transcription: of the problem that was solved, in numerical time.
        w: the point of its MPCC, (n).
        branch: of the point.
        solved: whether constraints hold and all products are at most the tolerance.
        exact: whether the products are zero to round-off, so that switches are located exactly.
        residuals: at the point.
        cost_terms: name -> part of the cost; step equilibration is none.
        end_time: T.
        certificate: of stationarity; None if it is not solved, or no time was left.
        starts: every initial guess.
        moves: switches that were moved, in words.
        iterations: of IPOPT in all.
        seconds: in all.
    """

    problem: OptimalControlProblem
    transcription: Transcription
    w: np.ndarray
    branch: Branch
    solved: bool
    exact: bool
    residuals: Residuals
    cost_terms: dict[str, float]
    end_time: float
    certificate: Certificate | None
    starts: Sequence[StartReport]
    moves: Sequence[str]
    iterations: int
    seconds: float

    @property
    def cost(self) -> float:
        """Sum of the cost's terms."""
        return sum(self.cost_terms.values())

    @property
    def message(self) -> str:
        """The result in a sentence."""
        if not self.solved:
            worst = self.residuals
            return (
                f"Not solved from {len({start.number for start in self.starts})} starts: constraints are violated by "
                f"{worst.constraint_violation:.1e} ({worst.worst_constraint}), products by {worst.complementarity:.1e}."
            )
        longest = self.longest_elements
        bound = (
            f" Elements of interval {', '.join(map(str, longest))} are as long as step_freedom "
            f"{self.transcription.options.gamma:g} allows; a larger one may lower the cost."
            if longest
            else ""
        )
        found = f"Solved at a cost of {self.cost:.6g}, " + (
            "switches located exactly" if self.exact else f"products at most {self.residuals.complementarity:.1e}"
        )
        verdict = self.certificate.b_stationary if self.certificate else "unknown"
        words = {
            "certified": f"{found}; no cheaper motion nearby (B-stationary).",
            "refuted": f"{found}; a direction descends from it that could not be followed.",
            "unknown": f"{found}; whether a cheaper motion is nearby is not known.",
        }
        return words[verdict] + bound

    @property
    def longest_elements(self) -> list[int]:
        """The intervals with an element that `FesdOptions.step_freedom` keeps from being longer."""
        options, counts = self.transcription.options, self.transcription.elements
        mean = self.problem.duration / self.problem.intervals
        return sorted(
            {
                element.interval
                for element in self.elements
                if options.switch_detection
                and 1.0 + options.gamma < counts[element.interval]
                and element.step > (1.0 - LENGTH_AT_BOUND) * (1.0 + options.gamma) * mean / counts[element.interval]
            }
        )

    @property
    def stretch(self) -> float:
        """The user's time per numerical time."""
        return self.end_time / self.problem.duration

    @cached_property
    def elements(self) -> list[Element]:
        """The finite elements in numerical time."""
        return self.transcription.unpack(self.w)

    @cached_property
    def times(self) -> np.ndarray:
        """The start, and the end of every element, (elements + 1)."""
        return self.stretch * np.array([0.0, *(element.end for element in self.elements)])

    @cached_property
    def states(self) -> np.ndarray:
        """The states at `times`, (elements + 1, n_x)."""
        return np.vstack([self.elements[0].x_left, *(e.x[-1:] for e in self.elements)])[:, : self._n_x]

    @property
    def control_times(self) -> np.ndarray:
        """The start of every control interval, and the end, (N + 1)."""
        return np.linspace(0.0, self.end_time, self.problem.intervals + 1)

    @property
    def controls(self) -> np.ndarray:
        """The controls, constant on every interval, (n_u, N)."""
        return self.transcription.controls(self.w)

    @property
    def phases(self) -> list[Phase]:
        """The time spans between the switches, with the regions in words."""
        system, phases = self.transcription.ocp.system, list[Phase]()
        pairs = [i for i, pair in enumerate(system.complementarities) if not pair.vanishing]
        whole = zip(self.elements, self.branch.factors, self.branch.without_length, strict=True)
        for element, factors in ((e, f) for e, f, without_length in whole if not without_length):
            mode = np.array([factors[i] is not ActiveFactor.H for i in pairs])
            begin, end = self.stretch * element.start, self.stretch * element.end
            if phases and (mode == phases[-1].mode).all():
                phases[-1] = replace(phases[-1], end=end)
            else:
                phases.append(Phase(begin, end, mode, system.in_words(mode)))
        return phases

    @property
    def switch_times(self) -> np.ndarray:
        """When the mode changes."""
        return np.array([phase.start for phase in self.phases[1:]])

    def at(self, times: np.ndarray | Sequence[float]) -> np.ndarray:
        """Return the states at any times by the scheme's dense output, (m, n_x).

        Args:
            times: between 0 and the end time, (m).

        Raises:
            ModelError: a time outside the motion.
        """
        which, numerical = self._elements_at(times)
        tableau, result = self.transcription.options.tableau, np.empty((len(which), self._n_x))
        for index in np.unique(which):
            chosen = which == index
            result[chosen] = self.elements[index].at(tableau, numerical[chosen])[:, : self._n_x]
        return result

    def control_at(self, times: np.ndarray | Sequence[float]) -> np.ndarray:
        """Return the controls at any times, at a jump those after it, (m, n_u).

        Args:
            times: between 0 and the end time, (m).

        Raises:
            ModelError: a time outside the motion.
        """
        which, _ = self._elements_at(times)
        return np.array([self.elements[index].u for index in which])

    @property
    def _n_x(self) -> int:
        return int(self.problem.system.state.numel())

    def _elements_at(self, times: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Return the number of the element of every time, and its numerical time."""
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        slack = SAME_PART * self.end_time
        outside = wanted[(wanted < -slack) | (wanted > self.end_time + slack)]
        if outside.size:
            raise ModelError(f"time {outside[0]:g} is outside the motion, 0 to {self.end_time:g}")
        numerical = np.clip(wanted / self.stretch, 0.0, self.elements[-1].end)
        starts = np.array([element.start for element in self.elements])
        return np.clip(np.searchsorted(starts, numerical, side="right") - 1, 0, len(starts) - 1), numerical
