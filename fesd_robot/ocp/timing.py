"""The control intervals in physical time: of one length, fixed or free, or moving with the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fesd_robot.fesd import Span
from fesd_robot.task import FreeDuration, Task


@dataclass(frozen=True)
class TimeGrid:
    """Control intervals: of equal physical length T/N, or of lengths that the planner chooses.

    Attributes:
        nominal: duration of the initial guess, s; also the length of numerical time.
        intervals: N.
        lower, upper: bounds of T, s; both `nominal` if it is fixed.
        moving: whether the grid moves with the contacts; N is then about the number of its intervals.
    """

    nominal: float
    intervals: int
    lower: float
    upper: float
    moving: bool = False

    @property
    def free(self) -> bool:
        """Whether T is chosen by the planner."""
        return self.lower < self.upper

    @property
    def ends(self) -> np.ndarray:
        """kT/N, k = 1..N, of the nominal duration, s."""
        return self.nominal * np.arange(1, self.intervals + 1) / self.intervals

    def duration(self, clock: np.ndarray) -> float:
        """Return T of a motion whose intervals end at these physical times, (N), s."""
        return float(clock[-1]) if self.free else self.nominal

    def node(self, time: float) -> int:
        """Return the number of the interval's end nearest to a time, 0 for the start."""
        return round(time / self.nominal * self.intervals)

    def at_node(self, time: float) -> float:
        """Return a time as the grid has it: that of the nearest end of an interval, if these stand still, s."""
        return time if self.moving else self.node(time) * self.nominal / self.intervals

    def between(self, begin: float, end: float) -> Sequence[int] | Span:
        """Return where a constraint holds from one time to another, s, or at the end of an interval if they agree."""
        if self.moving:
            return Span(begin, end)
        first, last = self.node(begin), self.node(end)
        return range(first - 1, first) if first == last else range(first, last)

    def ends_from(self, begin: float, end: float) -> list[Sequence[int] | Span]:
        """Return the places of a constraint at ends of intervals, from one time, included, to another, s."""
        if self.moving:
            return [self.between(begin, end)] if begin == 0 else [Span(begin, begin), Span(begin, end)]
        return [range(max(self.node(begin), 1) - 1, self.node(end))]

    @property
    def everywhere(self) -> Sequence[int] | Span:
        """Where a constraint holds that holds always."""
        return self.between(0.0, self.nominal)


def time_grid(task: Task) -> TimeGrid:
    """Return the control intervals of a task.

    A free duration starts in the middle of its bounds, or as near as lets the speed of time reach both of them.

    Raises:
        TaskError: the speed of time cannot reach both bounds of a free duration.
    """
    duration, intervals, moving = task.horizon.duration, task.horizon.intervals, task.method.grid == "phases"
    if not isinstance(duration, FreeDuration):
        return TimeGrid(duration, intervals, duration, duration, moving)
    speed = task.limits.speed_of_time
    least, most = duration.upper / speed.upper, duration.lower / speed.lower
    if least > most:
        raise task.error(
            "horizon.duration",
            f"found bounds {duration.lower:g} and {duration.upper:g} s, a ratio of "
            f"{duration.upper / duration.lower:g}, expected at most {speed.upper / speed.lower:g}, the ratio of the "
            "bounds of limits.speed_of_time",
        )
    nominal = min(max(0.5 * (duration.lower + duration.upper), least), most)
    return TimeGrid(nominal, intervals, duration.lower, duration.upper, moving)
