"""A list of the robots of the package example-robot-data, with their main figures."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import pinocchio as pin

from fesd_robot.errors import RobotError, nearest
from fesd_robot.robot.library import example_robots
from fesd_robot.robot.load import load_robot


@dataclass(frozen=True)
class Entry:
    """One robot.

    Attributes:
        name: what follows ``example-robot-data:``.
        file: its file.
        degrees_of_freedom: of its joints, without a floating root; None if it cannot be read, as all below.
        driven: how many of them have a finite, positive effort limit.
        mass: of all its bodies, kg.
        error: why it cannot be read, None if it can.
    """

    name: str
    file: str
    degrees_of_freedom: int | None = None
    driven: int | None = None
    mass: float | None = None
    error: str | None = None


def catalogue(pattern: str | None = None) -> list[Entry]:
    """Return the robots whose names fit a pattern, by name.

    Args:
        pattern: a part of the name, or with ``*`` or ``?`` a pattern for all of it, in any case of letters; all
            robots if absent.

    Raises:
        RobotError: if no name fits, naming the nearest one.
    """
    robots = example_robots()
    wanted = [name for name in robots if pattern is None or _fits(name.lower(), pattern.lower())]
    if not wanted:
        raise RobotError(f"There is no robot '{pattern}' in example-robot-data{nearest(pattern or '', robots)}.")
    return [_entry(name, robots[name]) for name in wanted]


def _fits(name: str, pattern: str) -> bool:
    return fnmatchcase(name, pattern) if any(sign in pattern for sign in "*?") else pattern in name


def _entry(name: str, file: Path) -> Entry:
    try:
        # A floating root lets the first link count, and robots without joints be read.
        robot = load_robot(file, root="free_flyer")
    except RobotError as error:
        return Entry(name, str(file), error=str(error).removeprefix(f"{file}: "))
    root = len(robot.root_names)
    return Entry(
        name,
        str(file),
        degrees_of_freedom=robot.model.nv - root,
        driven=int(robot.driven[root:].sum()),
        mass=float(pin.computeTotalMass(robot.model)),
    )
