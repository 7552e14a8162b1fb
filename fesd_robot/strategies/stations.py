"""What a planner is doing, in the words that people read while they wait."""

from __future__ import annotations

from enum import Enum


class Station(Enum):
    """A station on the way from a task to a plan; an attempt passes them in this order."""

    READING = "reading the task"
    BUILDING = "building the equations"
    SEARCHING = "looking for a motion"
    IMPROVING = "changing contacts"
    REFINING = "refining the motion"
    CERTIFYING = "certifying the plan"
    WAITING = "waiting for others"
    WRITING = "writing the plan"
    DRAWING = "drawing page and figures"
