"""Keys of a task that once had another name, and are still read under it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from fesd_robot.task.origins import KeyPath

RENAMED_KEYS: Mapping[KeyPath, str] = {
    ("method", "auxiliary_acceleration"): "auxiliary_force",
    ("method", "formulation", "gap_feedback"): "baumgarte_gain",
    ("solver", "finish"): "polish",
    ("solver", "sketch_iterations"): "loose_iterations",
    ("solver", "velocity_relaxation"): "velocity_level_ratio",
}
"""Path of a key under its old name -> its name today, in the same section."""


class Renaming(NamedTuple):
    """A key that was read under its old name: both paths, dotted."""

    old: str
    new: str


class TwoNamesError(Exception):
    """A section that gives one key under its old and under its new name, at the path of the old one."""

    def __init__(self, old: KeyPath, new: KeyPath) -> None:
        self.path = old
        super().__init__(
            f"found '{'.'.join(old)}' beside '{'.'.join(new)}', which is its name today; expected only the new one"
        )


def today(path: KeyPath) -> KeyPath:
    """Return the path of a key under its name today; a path that was never renamed is returned as it is."""
    for old, name in RENAMED_KEYS.items():
        if path[: len(old)] == old:
            return (*old[:-1], name, *path[len(old) :])
    return path


def rename_keys(data: dict[str, Any], start: KeyPath = ()) -> list[Renaming]:
    """Give the keys of a task their names of today, in place and without changing their order.

    Args:
        data: a task as plain data, or one section of it.
        start: the path of that section in the task; empty for the whole task.

    Returns:
        What was renamed.

    Raises:
        TwoNamesError: a key is there under both of its names.
    """
    renamings = []
    for old in RENAMED_KEYS:
        if old[: len(start)] != start or len(old) == len(start):
            continue
        section: Any = data
        for part in old[len(start) : -1]:
            section = section.get(part) if isinstance(section, dict) else None
        if not isinstance(section, dict) or old[-1] not in section:
            continue
        new = today(old)
        if new[-1] in section:
            raise TwoNamesError(old, new)
        entries = [(new[-1] if key == old[-1] else key, value) for key, value in section.items()]
        section.clear()
        section.update(entries)
        renamings.append(Renaming(".".join(old), ".".join(new)))
    return renamings


def old_names(section: KeyPath) -> Iterator[tuple[str, str]]:
    """Yield (old name, name today) of the keys of one section that were renamed."""
    for old, name in RENAMED_KEYS.items():
        if old[:-1] == section:
            yield old[-1], name
