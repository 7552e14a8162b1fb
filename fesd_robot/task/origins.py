"""Where each key of a task came from, so that every error can point at it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fesd_robot.errors import TaskError

KeyPath = tuple[str, ...]
"""The keys from the top of the task down to one value."""


@dataclass(frozen=True)
class Origin:
    """A line of the task file (counted from 1), or the text of the override that gave the value."""

    line: int | None = None
    override: str | None = None


@dataclass(frozen=True)
class Origins:
    """Origins of all keys of one task. Two are always equal: where a task came from does not change what it says.

    Attributes:
        file: the task file.
        places: where each key is written.
        start: folder where relative paths start if there is no file.
    """

    file: Path | None = field(default=None, compare=False)
    places: Mapping[KeyPath, Origin] = field(default_factory=dict, compare=False)
    start: Path = field(default=Path(), compare=False)

    @property
    def folder(self) -> Path:
        """Where relative paths start."""
        return self.start if self.file is None else self.file.parent

    def find(self, path: KeyPath) -> Origin:
        """Return the origin of a key, or of its nearest parent that is written anywhere."""
        for end in range(len(path), -1, -1):
            if path[:end] in self.places:
                return self.places[path[:end]]
        return Origin()

    def error(self, path: KeyPath, message: str) -> TaskError:
        """Return the error that points at a key."""
        origin = self.find(path)
        key = ".".join(path) or None
        if origin.override is not None:
            return TaskError(f"{message} (from --set {origin.override})", key=key)
        return TaskError(message, file=self.file, line=origin.line, key=key)

    def first_error(self, problems: Iterable[tuple[KeyPath, str]]) -> TaskError | None:
        """Return the error that comes first in the file (overrides before all), saying how many more there are."""
        ordered = sorted(problems, key=lambda problem: self.find(problem[0]).line or 0)
        if not ordered:
            return None
        path, message = ordered[0]
        more = len(ordered) - 1
        return self.error(path, f"{message}; and {more} more error{'s' * (more > 1)}" if more else message)
