"""Names and texts of a task that a terminal can show as they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fesd_robot.printable import has_hidden, visible
from fesd_robot.task.origins import KeyPath, Origins


def refuse_hidden(data: Any, origins: Origins) -> None:
    """Raise the first error, by line, about control characters, or marks of direction, in a key or a value.

    Args:
        data: a task file as plain data.
        origins: where its keys come from.

    Raises:
        TaskError: a text has some; texts may have several lines.
    """
    error = origins.first_error(_hidden(data, ()))
    if error is not None:
        raise error


def _hidden(data: Any, path: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    if isinstance(data, dict):
        for key, value in data.items():
            if has_hidden(key):
                yield path, f"found the key '{visible(key)[:60]}', expected one without control characters"
            else:
                yield from _hidden(value, (*path, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _hidden(value, (*path, str(index)))
    elif isinstance(data, str) and has_hidden(data, lines=True):
        yield path, f"found the text '{visible(data)[:60]}', expected one without control characters"
