"""A first task, before it is written as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class RobotSection:
    """The section `robot` of a task.

    Attributes:
        model: as the task names it.
        root: kind of the joint under the first link.
        locked: joint that leaves the x-z plane -> value it is held at, m or rad.
        coupled: joint -> joint that it moves in unison with.
        armature: coordinate that moves no mass -> inertia for it, kg or kg m2.
    """

    model: str
    root: str
    locked: Mapping[str, float] = field(default_factory=dict)
    coupled: Mapping[str, str] = field(default_factory=dict)
    armature: Mapping[str, float] = field(default_factory=dict)


def what_moves(section: RobotSection) -> str:
    """Return a short name for a robot: that of its file, or the one in its package."""
    return Path(section.model.rpartition(":")[2]).stem


@dataclass(frozen=True)
class Contact:
    """A place that may touch the ground.

    Attributes:
        name: of the contact.
        frame: on which it is.
        offset: from the frame's origin, m.
        shapes: whether the collision shapes of the frame's body touch, instead of a point.
        radius: of a circle about that place, m; None for a point.
        beside: bodies that it stands for as well, because their legs move in unison.
    """

    name: str
    frame: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shapes: bool = False
    radius: float | None = None
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class State:
    """A start or a goal.

    Attributes:
        posture: name of a posture of the model file, empty for none.
        configuration: coordinate -> value, m or rad.
        stand_on: contacts that touch.
        adjust: coordinates that are found so that they do; empty for the default.
    """

    posture: str = ""
    configuration: Mapping[str, float] = field(default_factory=dict)
    stand_on: tuple[str, ...] = ()
    adjust: tuple[str, ...] = ()


@dataclass(frozen=True)
class Proposal:
    """A first task.

    Attributes:
        name: of the task.
        words: what the robot does, one sentence.
        robot: the section.
        contacts: places that may touch.
        duration: of the motion, s.
        intervals: of the controls.
        initial, goal: where it starts and ends.
        apex: coordinate -> value at the top of a jump, m or rad; empty where there is none.
        effort: joint -> guessed largest effort, N or N m, of a model without motors.
        slides: whether to slide is what it is for.
        found: which posture of the model file was taken, or that one was found, in words.
    """

    name: str
    words: str
    robot: RobotSection
    contacts: tuple[Contact, ...]
    duration: float
    intervals: int
    initial: State
    goal: State
    found: str
    apex: Mapping[str, float] = field(default_factory=dict)
    effort: Mapping[str, float] = field(default_factory=dict)
    slides: bool = False
