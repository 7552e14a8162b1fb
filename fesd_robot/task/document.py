"""A task file as plain data: YAML text and overrides turned into dicts, with the origin of every key."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from fesd_robot.errors import TaskError
from fesd_robot.ranges import MAX_TASK_BYTES
from fesd_robot.task.origins import KeyPath, Origin, Origins
from fesd_robot.task.renamed_keys import TwoNamesError, rename_keys, today
from fesd_robot.task.yaml_hints import yaml_sentence

logger = logging.getLogger(__name__)

_MAX_NODES = 100_000
_TAG = "tag:yaml.org,2002:"
_MERGE = f"{_TAG}merge"
_SCALARS = {f"{_TAG}{kind}" for kind in ("null", "bool", "int", "float", "str")}


_DECIMALS = re.compile(r"(\d+(?:[eE][-+]?\d+)?)(?:\s*[a-zA-Z°%].*)?$")
"""What stands behind a decimal comma, perhaps with a unit."""

_WITH_COORDINATES = ("initial", "goal", "reference", "costs", "limits")
_MAPS_OF_COORDINATES = (
    "configuration",
    "velocity",
    "terminal_configuration",
    "terminal_velocity",
    "position",
    "apex",
    "prefer",
)
"""Sections, and their keys below which nothing stands but names of coordinates."""


class _Problem(Exception):
    """A fault of YAML text: sentence, line counted from 1, key."""

    def __init__(self, message: str, line: int | None = None, path: KeyPath = ()) -> None:
        super().__init__(message)
        self.message, self.line, self.path = message, line, path


class _Reader:
    """Turns one YAML text into plain data and notes the line of every key."""

    def __init__(self) -> None:
        self.lines: dict[KeyPath, int] = {}
        self._yaml = YAML(typ="safe", pure=True)
        self._open: list[Node] = []
        self._merged: set[int] = set()
        self._count = 0

    def read(self, text: str) -> Any:
        try:
            node = self._yaml.compose(text)
            if node is None:
                return None
            self.lines[()] = node.start_mark.line + 1
            return self._convert(node, ())
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            raise _Problem(yaml_sentence(error), None if mark is None else mark.line + 1) from error
        except ReaderError as error:
            position = error.position if isinstance(error.position, int) else 0
            line = text.count("\n", 0, position) + 1
            raise _Problem(f"this is not valid YAML: character {error.character!r} is not allowed", line) from error
        except YAMLError as error:
            raise _Problem(f"this is not valid YAML: {' '.join(str(error).split())}") from error
        except RecursionError as error:
            raise _Problem("this is nested too deeply to be read") from error

    def _convert(self, node: Node, path: KeyPath) -> Any:
        line = node.start_mark.line + 1
        self._count += 1
        if self._count > _MAX_NODES or any(node is parent for parent in self._open):
            raise _Problem("an alias (*) repeats too much or contains itself, expected plain values", line, path)
        self._open.append(node)
        try:
            if isinstance(node, ScalarNode):
                return self._scalar(node, path)
            if isinstance(node, SequenceNode) and node.tag == f"{_TAG}seq":
                return [self._item(item, (*path, str(index))) for index, item in enumerate(node.value)]
            if isinstance(node, MappingNode) and node.tag == f"{_TAG}map":
                return self._mapping(node, path)
        finally:
            self._open.pop()
        raise _Problem(f"found the YAML tag {node.tag}, expected a plain value", line, path)

    def _item(self, node: Node, path: KeyPath) -> Any:
        self.lines[path] = node.start_mark.line + 1
        return self._convert(node, path)

    def _mapping(self, node: MappingNode, path: KeyPath) -> dict[str, Any]:
        self._merge(node, path)
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            below = (*path, str(key_node.value))
            self.lines[below] = key_node.start_mark.line + 1
            result[below[-1]] = self._convert(value_node, below)
        return result

    def _merge(self, node: MappingNode, path: KeyPath) -> None:
        """Check the keys of a mapping, and put in place of its merge key (<<) what it stands for, every key once."""
        if id(node) in self._merged:
            return
        self._merged.add(id(node))
        _check_keys(node, path)
        for key_node, value_node in node.value:
            if key_node.tag == _MERGE:
                sources = value_node.value if isinstance(value_node, SequenceNode) else [value_node]
                for source in (each for each in sources if isinstance(each, MappingNode)):
                    self._merge(source, path)
        self._yaml.constructor.flatten_mapping(node)
        node.value = [*{str(key_node.value): (key_node, value) for key_node, value in node.value}.values()]

    def _scalar(self, node: ScalarNode, path: KeyPath) -> Any:
        if node.tag not in _SCALARS:
            if str(node.tag).startswith(f"{_TAG}timestamp"):
                return str(node.value)
            raise _Problem(f"found the YAML tag {node.tag}, expected a plain value", node.start_mark.line + 1, path)
        try:
            return self._yaml.constructor.construct_object(node)
        except (ValueError, ConstructorError) as error:
            raise _Problem(
                f"found {str(node.value)[:40]}, expected a number", node.start_mark.line + 1, path
            ) from error


def _check_keys(node: MappingNode, path: KeyPath) -> None:
    """Raise unless the keys that a mapping itself has are names, every one there once."""
    lines: dict[str, int] = {}
    for index, (key_node, value_node) in enumerate(node.value):
        line = key_node.start_mark.line + 1
        if index and (number := _decimal_comma(node.value[index - 1], key_node, value_node)):
            written, point = number
            below = (*path, str(node.value[index - 1][0].value))
            raise _Problem(f"found {written}, expected a number with a decimal point, written {point}", line, below)
        if key_node.tag == _MERGE:
            continue
        if not isinstance(key_node, ScalarNode) or key_node.tag != f"{_TAG}str":
            raw = f" {key_node.value}" if isinstance(key_node, ScalarNode) else ""
            raise _Problem(f"found the key{raw}, expected a name; quote it if it is one", line, path)
        key = str(key_node.value)
        if key in lines:
            raise _Problem(f"this key is given twice, first in line {lines[key]}", line, (*path, key))
        lines[key] = line


def _decimal_comma(before: tuple[Node, Node], key: Node, value: Node) -> tuple[str, str] | None:
    """Return a number with a decimal comma as it is written between braces and as it should be: there, 0,6 is a key 6.

    Args:
        before: key and value of the entry in front.
        key, value: of an entry.
    """
    whole = before[1]
    if not (isinstance(key, ScalarNode) and isinstance(value, ScalarNode) and isinstance(whole, ScalarNode)):
        return None
    plain = not value.value and key.style is None and whole.tag == f"{_TAG}int"
    match = _DECIMALS.match(str(key.value)) if plain else None
    return None if match is None else (f"{whole.value},{key.value}", f"{whole.value}.{match[1]}")


def read_document(path: Path, overrides: Sequence[str], kind: str = "task") -> tuple[dict[str, Any], Origins]:
    """Return a task file with overrides applied, as plain data, and where each key came from.

    Keys under an old name (`fesd_robot.task.renamed_keys`) get their new one, with a warning for each.

    Args:
        path: the task file, UTF-8.
        overrides: ``key.path=value`` each, the value in YAML; the last one for a key wins.
        kind: what the file is expected to be, for messages.

    Raises:
        TaskError: the file cannot be read, is not YAML, is not a mapping, gives a key under its old and its new name,
            or an override does not fit.
    """
    reader = _Reader()
    try:
        data = reader.read(_read_text(path, kind))
    except _Problem as problem:
        key = ".".join(problem.path) or None
        raise TaskError(problem.message, file=path, line=problem.line, key=key) from problem.__cause__
    if data is None:
        raise TaskError(f"this file is empty, expected the keys of a {kind}", file=path, line=1)
    if not isinstance(data, dict):
        found = "a list" if isinstance(data, list) else "a single value"
        raise TaskError(f"found {found}, expected the keys of a {kind}", file=path, line=reader.lines[()])
    places = {key_path: Origin(line=line) for key_path, line in reader.lines.items()}
    try:
        renamings = rename_keys(data)
    except TwoNamesError as error:
        raise Origins(file=path, places=places).error(error.path, str(error)) from error
    for old, new in renamings:
        logger.warning("%s:%d: the key '%s' is now called '%s'", path, reader.lines[tuple(old.split("."))], old, new)
    places = {today(key_path): origin for key_path, origin in places.items()}
    override_keys(data, places, overrides)
    return data, Origins(file=path, places=places)


def override_keys(data: dict[str, Any], places: dict[KeyPath, Origin], overrides: Sequence[str]) -> None:
    """Replace values of a task's plain data, and note where they came from.

    Args:
        data, places: the task and the origins of its keys, both changed.
        overrides: ``key.path=value`` each, the value in YAML; the last one for a key wins.

    Raises:
        TaskError: an override does not fit.
    """
    for override in overrides:
        _apply(override, data, places)


def _read_text(path: Path, kind: str) -> str:
    if path.is_dir():
        raise TaskError(f"this is a folder, expected a {kind} file", file=path)
    try:
        with path.open("rb") as stream:  # which may be a pipe
            content = stream.read(MAX_TASK_BYTES + 1)
    except FileNotFoundError as error:
        raise TaskError(f"there is no such file, expected a {kind} file", file=path) from error
    except OSError as error:
        raise TaskError(f"this file cannot be read ({error.strerror}), expected a {kind} file", file=path) from error
    if len(content) > MAX_TASK_BYTES:
        raise TaskError(f"found a file of more than {MAX_TASK_BYTES / 1e6:g} MB, expected a {kind} file", file=path)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise TaskError("found bytes that are not UTF-8, expected a text file", file=path, line=line) from error


def _apply(override: str, data: dict[str, Any], places: dict[KeyPath, Origin]) -> None:
    path, value = _read_override(override)
    path = _with_whole_names(path, data)
    origin = Origin(override=override)
    parent = data
    for end, part in enumerate(path[:-1], start=1):
        if parent.get(part) is None:
            parent[part] = {}
            places[path[:end]] = origin
        if not isinstance(parent[part], dict):
            raise TaskError(
                f"'{'.'.join(path[:end])}' holds a value, expected keys below it (from --set {override})",
                key=".".join(path),
            )
        parent = parent[part]
    parent[path[-1]] = value
    for known in [known for known in places if known[: len(path)] == path]:
        del places[known]
    places[path] = origin


def _with_whole_names(path: KeyPath, data: Any) -> KeyPath:
    """Return a path in which the name of a coordinate is one key, also if it has dots, as ``box.root_joint.x``."""
    for at, part in enumerate(path[:-1] if path[0] in _WITH_COORDINATES else ()):
        data = data.get(part) if isinstance(data, dict) else None
        if part in _MAPS_OF_COORDINATES and path[at + 1] not in (data or ()):
            return (*path[: at + 1], ".".join(path[at + 1 :]))
    return path


def _read_override(override: str) -> tuple[KeyPath, Any]:
    """Return the path and the value of an override, all keys under their names of today."""
    dotted, equals, text = override.partition("=")
    given = tuple(part.strip() for part in dotted.split("."))
    if not equals or not all(given):
        raise TaskError(
            f"found --set {override}, expected key.path=value, for example --set horizon.intervals=30",
            key=dotted.strip() or None,
        )
    path = today(given)
    renamings = [(".".join(given), ".".join(path))] if path != given else []
    try:
        value = _Reader().read(text)
        if isinstance(value, dict):
            renamings += rename_keys(value, path)
    except _Problem as problem:
        raise TaskError(f"{problem.message} (from --set {override})", key=".".join(path)) from problem.__cause__
    except TwoNamesError as error:
        raise TaskError(f"{error} (from --set {override})", key=".".join(error.path)) from error
    for old, new in renamings:
        logger.warning("--set %s: the key '%s' is now called '%s'", override, old, new)
    return path, value
