"""Switches that follow each other ever faster."""

from __future__ import annotations

from dataclasses import dataclass, field

CYCLES = 3
"""Cycles of switches that must become shorter, each by the same factor."""

LONGEST_CYCLE = 6
"""Switches of a cycle at most."""


@dataclass
class ZenoWatch:
    """Recognises times between switches that fall like a geometric series, and where they accumulate.

    Attributes:
        closeness: G up to which pairs count as closed; above zero where switches accumulate.
        text: what was recognised, empty before.
    """

    closeness: float = 0.0
    text: str = ""
    _times: list[float] = field(default_factory=list)

    def note(self, time: float) -> None:
        """Note a switch."""
        self._times = [*self._times[-CYCLES * LONGEST_CYCLE :], time]
        remaining = self._remaining()
        self.closeness = 0.0
        if remaining is not None and remaining <= 1e-7 * max(time, 1e-3):
            self.closeness = 1e-6
            self.text = f"Zeno point at {time + remaining:.9g}: switches follow each other ever faster"

    def _remaining(self) -> float | None:
        """Return the time from the last switch to the point where they accumulate, None if they do not."""
        spans = [b - a for a, b in zip(self._times[:-1], self._times[1:], strict=True)]
        for period in range(1, LONGEST_CYCLE + 1):
            own = spans[-CYCLES * period :]
            if len(own) < max(CYCLES * period, 6) or min(own) <= 0.0:
                continue
            ratios = [b / a for a, b in zip(own[:-period], own[period:], strict=True)]
            ratio = sum(ratios) / len(ratios)
            if ratio < 0.95 and max(ratios) - min(ratios) < 0.1 * ratio:
                return sum(own[-period:]) * ratio / (1.0 - ratio)
        return None
