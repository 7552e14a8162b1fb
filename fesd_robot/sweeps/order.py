"""What goes to a worker and what comes back: plain values, which any machine reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any


class State(str, Enum):
    """State of a row."""

    COMPLETED = "completed"
    """A plan came back, solved or not."""
    FAILED = "failed"
    """None came: its task is refused, its process crashed, took too long or too much memory."""
    INTERRUPTED = "interrupted"
    """It was begun when the sweep was ended."""


class Verdict(str, Enum):
    """Verdict on a row."""

    SOLVED = "solved"
    NOT_SOLVED = "not solved"
    REFUSED = "refused"
    """The task is not valid with its values."""
    ERROR = "error"
    """An exception that no task should lead to."""
    CRASHED = "crashed"
    """Its process ended before it answered."""
    TIMEOUT = "timeout"
    MEMORY = "memory"
    INTERRUPTED = "interrupted"

    @property
    def state(self) -> State:
        """State of a row with this verdict."""
        if self in (Verdict.SOLVED, Verdict.NOT_SOLVED):
            return State.COMPLETED
        return State.INTERRUPTED if self is Verdict.INTERRUPTED else State.FAILED


@dataclass(frozen=True)
class Limits:
    """What one plan may take.

    Args:
        seconds: after which it returns its best iterate, and a moment later is ended; None for no limit.
        megabytes: of memory, after which its process is ended; None for no limit.
    """

    seconds: float | None = None
    megabytes: float | None = None

    @property
    def killed_after(self) -> float | None:
        """Seconds after which a process that does not return is ended."""
        return None if self.seconds is None else self.seconds + max(2.0, 0.1 * self.seconds)


UNLIMITED = Limits()


@dataclass(frozen=True)
class Start:
    """The plan of a row from which another one begins.

    Args:
        number: of the row.
        plan: as JSON.
        place: its folder where it is kept, which the other plan names.
    """

    number: int
    plan: bytes
    place: str


@dataclass(frozen=True)
class Order:
    """One plan to make.

    Args:
        number: of the row.
        overrides: ``key=value`` of its task each, the values of the row last.
        limits: what it may take.
        keep: whether the plan is sent back if it is solved, or also if it is not.
        cheaper_than: cost from which on a solved plan need not be sent back.
        start: the plan of another row to begin from.
        task, case: names of the task and of the case, as in the sweep.
        home: folder of the task file where it was ordered, which its plan names; nothing is looked for there.
    """

    number: int
    overrides: tuple[str, ...]
    limits: Limits = UNLIMITED
    keep: str = "none"
    cheaper_than: float | None = None
    start: Start | None = None
    task: str = ""
    case: str = ""
    home: str = ""


@dataclass(frozen=True)
class Answer:
    """What became of an order.

    Args:
        number: of the row.
        verdict: on it.
        values: name of a column -> value.
        message: one sentence.
        seconds: that it took.
        megabytes: most memory that its process had.
        files: name -> content of every file of the plan that is kept.
    """

    number: int
    verdict: Verdict
    values: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""
    seconds: float = 0.0
    megabytes: float | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)


Work = Callable[[Order, Path], Answer]
"""Make the plan of an order, with the task file that was sent along; a function of a module, in a process of its own.

Its answer needs no seconds and no memory, which are measured from outside.
"""
