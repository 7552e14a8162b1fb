"""How far a sweep is."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from fesd_robot.sweeps.order import Verdict


@dataclass
class Tally:
    """Counts of rows.

    Args:
        total: of the sweep.
        known, known_solved: rows that were there before, and those of them that are solved.
    """

    total: int
    known: int = 0
    known_solved: int = 0
    done: int = 0
    solved: int = 0
    failed: int = 0
    running: int = 0
    begin: float = field(default_factory=time.monotonic)

    def add(self, verdict: Verdict) -> None:
        """Count a row."""
        self.done += 1
        self.solved += verdict is Verdict.SOLVED
        self.failed += verdict.state.value == "failed"

    @property
    def rate(self) -> float | None:
        """Rows a second since the beginning; None before the first."""
        spent = time.monotonic() - self.begin
        return self.done / spent if self.done and spent > 0 else None

    @property
    def seconds_left(self) -> float | None:
        """How long the others will take at this rate."""
        return None if self.rate is None else (self.total - self.known - self.done) / self.rate

    def line(self) -> str:
        """Return all in a line."""
        parts = [f"{self.known + self.done} of {self.total}"]
        if self.rate is not None:
            parts.append(_rate(self.rate))
        parts.append(f"{self.known_solved + self.solved} solved")
        if missed := self.done - self.solved - self.failed:
            parts.append(f"{missed} not solved")
        if self.failed:
            parts.append(f"{self.failed} failed")
        if self.seconds_left is not None and self.seconds_left > 0:
            parts.append(f"{duration(self.seconds_left)} left")
        return ", ".join(parts)


def _rate(rate: float) -> str:
    return f"{rate:.3g}/s" if rate >= 1 else f"{60 * rate:.3g}/min"


def duration(seconds: float) -> str:
    """Return a duration in words."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
