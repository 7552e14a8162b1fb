"""Activities of a planner, in the words that people read while they wait, and its progress."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum


class Activity(Enum):
    """An activity on the way from a task to a plan; an attempt passes them in this order."""

    READING = "reading the task"
    BUILDING = "building the equations"
    COMPILING = "compiling the derivatives"
    SEARCHING = "searching"
    POLISHING = "polishing"
    IMPROVING = "changing contacts"
    REFINING = "refining the motion"
    CERTIFYING = "certifying"
    WRITING = "writing the plan"
    DRAWING = "drawing page and figures"


ActivityCallback = Callable[[Activity], None]
"""Called with every activity that begins."""

ProgressCallback = Callable[[int, int | None], None]
"""Called with the number of steps of the activity that are done, and of how many; None if that is not known."""
