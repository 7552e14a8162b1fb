"""The exceptions a user can meet; every one ends a run with a sentence that says what to change."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from pathlib import Path

from fesd_robot.printable import visible

_NUMBER = re.compile(r"^\s*([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*([a-zA-Z°%][^\d]*)?$")
"""A number, with a point or a comma, and what may be its unit."""


class FesdRobotError(Exception):
    """Base of all exceptions that this package raises on purpose; the text is one line of characters that show."""

    def __str__(self) -> str:
        """Return the message, with ends of lines, control characters and what turns the text round escaped."""
        return visible(super().__str__())


class TaskError(FesdRobotError):
    """A task file that cannot be solved as written.

    Args:
        message: what was found and what would be valid, one sentence.
        file: the task file, if there is one.
        line: line of the offending key, counted from 1.
        key: dotted path of the offending key, e.g. ``goal.configuration.leg``.
    """

    def __init__(
        self, message: str, *, file: Path | None = None, line: int | None = None, key: str | None = None
    ) -> None:
        self.message = message
        self.file = file
        self.line = line
        self.key = key
        where = "" if file is None else f"{file}:{line}: " if line is not None else f"{file}: "
        super().__init__(f"{where}{key}: {message}" if key else f"{where}{message}")


class ExpressionError(FesdRobotError, ValueError):
    """A text that is no arithmetic expression of a task, or one that needs a name that has no value."""


class MotionFileError(FesdRobotError):
    """A file that cannot be read as a motion."""


class RobotError(FesdRobotError):
    """A robot model that cannot be loaded or used."""


class JointError(RobotError):
    """A joint that cannot be treated as asked.

    Args:
        message: what was found and what would be valid.
        option: which treatment, ``locked`` or ``coupled``.
        joint: name of the joint.
    """

    def __init__(self, message: str, *, option: str, joint: str) -> None:
        self.option = option
        self.joint = joint
        super().__init__(message)


class PlanFileError(FesdRobotError):
    """A plan that cannot be read or exported, or a folder that cannot be written to.

    Args:
        message: what was found and what would be valid, one sentence.
        kept: the folder that a plan was written to instead, if there is one.
    """

    def __init__(self, message: str, *, kept: Path | None = None) -> None:
        self.kept = kept
        super().__init__(message)


class FolderInUseError(PlanFileError):
    """A folder that another run writes to."""


class SweepError(FesdRobotError):
    """A sweep that cannot be begun or gone on with, as one whose scheduler does not answer."""


class GroundError(FesdRobotError):
    """A ground that cannot be built, or on which a contact cannot be computed."""


class DimensionError(FesdRobotError):
    """An array or expression of the wrong shape; the message names it with its shape and the expected one."""


class ModelError(FesdRobotError):
    """A nonsmooth system or its discretisation that contradicts itself."""


class OptionError(FesdRobotError, ValueError):
    """An option, scheme or method that does not exist, or a value of one outside its range."""


class SolverError(FesdRobotError):
    """The numerical solver could not be run at all (a solve that merely fails is a status, not an exception)."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return `` (did you mean 'x'?)`` for the closest valid name, else a list of the valid names."""
    names = list(valid)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f" (did you mean '{close[0]}'?)"
    return f" (valid: {', '.join(sorted(names))})" if names else ""


def nearest_file(path: Path) -> str:
    """Return `` (did you mean 'x'?)`` for the file beside a missing one with the closest name, else nothing."""
    folder = path.parent
    names = [file.name for file in folder.iterdir() if file.is_file()] if folder.is_dir() else []
    if names:
        hint = nearest(path.name, names)
        return hint if hint.startswith(" (did") else ""
    return "" if folder.is_dir() else f" (nor a folder {folder})"


def number_hint(text: str) -> str:
    """Return how to write a number that has a unit or a decimal comma, to follow "expected a number"; else nothing."""
    if not (match := _NUMBER.match(text)):
        return ""
    number, unit = match.groups()
    return " without unit, in SI units and radians" if unit else f", written {number.replace(',', '.')}"
