"""Keys of a plan that once had another name, and are still read under it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fesd_robot.task import Renaming, rename_keys, today

EACH = "*"
"""In a path, every entry of a list."""

RENAMED_PLAN_KEYS: Mapping[tuple[str, ...], str] = {
    ("statistics", "homotopy", EACH, "velocity_sigma"): "velocity_level_sigma",
    ("statistics", "cost_terms", "choice of alpha"): "regularisation of the step functions",
}
"""Path of a key under its old name -> its name today, in the same section; a plan's task has its own table."""


def rename_plan_keys(data: Any) -> list[Renaming]:
    """Give the keys of a plan, and those of the task in it, their names of today, in place and in their order.

    Args:
        data: a plan as plain data; whatever is none is left as it is.

    Returns:
        What was renamed, each name once.

    Raises:
        TwoNamesError: a key of the task is there under both of its names.
    """
    renamings = []
    for path, name in RENAMED_PLAN_KEYS.items():
        sections = [section for section in _sections(data, path[:-1]) if path[-1] in section and name not in section]
        for section in sections:
            _rename(section, {path[-1]: name})
        if sections:
            renamings.append(Renaming(path[-1], name))
    for changes in _sections(data, ("statistics", "attempts", EACH, "changes")):
        _rename(changes, {key: ".".join(today(tuple(key.split(".")))) for key in changes})
    for task in _sections(data, ("task",)):
        renamings += rename_keys(task)
    for method in _sections(data, ("task", "method")):
        method.setdefault("grid", "uniform")  # of plans that do not say it, whose grids never moved
    return renamings


def _sections(data: Any, path: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """Yield the mappings at a path, for every entry of its lists."""
    if not path:
        if isinstance(data, dict):
            yield data
    elif path[0] == EACH:
        for entry in data if isinstance(data, list) else []:
            yield from _sections(entry, path[1:])
    elif isinstance(data, dict) and path[0] in data:
        yield from _sections(data[path[0]], path[1:])


def _rename(section: dict[str, Any], names: Mapping[str, str]) -> None:
    entries = [(names.get(key, key), value) for key, value in section.items()]
    section.clear()
    section.update(entries)
