"""Activities of a planner, in the words that people read while they wait, and its progress."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum


class Station(Enum):
    """A station on the way from a task to a plan; an attempt passes them in this order."""

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


Reached = Callable[[Station], None]
"""What is done next."""

Counted = Callable[[int, int | None], None]
"""How many steps of the station are done, and of how many; None if that is not known."""
