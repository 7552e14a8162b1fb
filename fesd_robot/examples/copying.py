"""Copies of the tasks, sweeps and models that come with the program, to be changed by their user."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from fesd_robot.errors import FesdRobotError, TaskError, nearest
from fesd_robot.examples.shipped import MODELS, TASKS, Example, examples_by_name, shipped_folder
from fesd_robot.writing import write_atomically

SCHEMA = "task.schema.json"
"""Name of the JSON schema beside copied tasks, which editors check them with."""

_SCHEMA_LINE = re.compile(r"(# yaml-language-server: \$schema=)\S+")
_SHOWN = 3
"""Files that a message names before it says how many more there are."""


def copy_examples(names: Sequence[str], out: Path, *, schema: bytes, overwrite: bool = False) -> list[Path]:
    """Copy tasks with every file that they name, sweeps and models into folders of these names in another folder.

    A sweep goes alone where it names a task of the program, and with its task where it names a file. All relative paths
    in the copies hold. Nothing is written if a file would be lost.

    Args:
        names: of tasks, sweeps or models; none stands for all.
        out: folder for the copies.
        schema: content of the JSON schema of tasks.
        overwrite: whether files with another content may be replaced.

    Returns:
        The files of the copy, below `out`, sorted; those that were there with the same content are among them.

    Raises:
        TaskError: for an unknown name, with the nearest one.
        FesdRobotError: if files with another content are in the way, or a file cannot be written.
    """
    examples = examples_by_name()
    for name in names:
        if name not in examples:
            raise TaskError(f"found '{name}', expected the name of an example{nearest(name, examples)}")
    contents: dict[Path, bytes] = {}
    for name in names or list(examples):
        contents |= dict(_contents(examples[name], schema))
    in_the_way = [out / path for path, content in sorted(contents.items()) if _differs(out / path, content)]
    if in_the_way and not overwrite:
        more = f" and {len(in_the_way) - _SHOWN} more" if len(in_the_way) > _SHOWN else ""
        raise FesdRobotError(
            f"found {', '.join(map(str, in_the_way[:_SHOWN]))}{more} with another content, expected no such file: "
            "choose another folder by --out, or replace by --force"
        )
    try:
        for path, content in contents.items():
            write_atomically(out / path, content)
    except OSError as error:
        raise FesdRobotError(f"{error.filename or out}: this cannot be written ({error.strerror})") from error
    return sorted(out / path for path in contents)


def _contents(example: Example, schema: bytes) -> Iterator[tuple[Path, bytes]]:
    """Yield every file of an example, relative to the folder of the examples, with its content."""
    folder = shipped_folder()
    if example.kind == "model":
        yield from ((file.relative_to(folder), file.read_bytes()) for file in _files_below(example.path))
        return
    if example.kind == "sweep":
        yield example.path.relative_to(folder), example.path.read_bytes()
        told = YAML(typ="safe", pure=True).load(example.path.read_text(encoding="utf-8"))
        for named in _named_files(told, example.path.parent):
            yield from _of_task(named, schema)
        return
    yield from _of_task(example.path, schema)


def _of_task(file: Path, schema: bytes) -> Iterator[tuple[Path, bytes]]:
    """Yield a task file and every file that it names, relative to the folder of the examples, with its content."""
    folder, text = shipped_folder(), file.read_text(encoding="utf-8")
    yield Path(TASKS) / SCHEMA, schema
    place = file.relative_to(folder)
    schema_there = os.path.relpath(Path(TASKS) / SCHEMA, place.parent)
    yield place, _SCHEMA_LINE.sub(rf"\g<1>{schema_there}", text, count=1).encode()
    for named in _named_files(YAML(typ="safe", pure=True).load(text), file.parent):
        # A model comes with what lies beside it, as its meshes.
        in_models = named.is_relative_to(folder / MODELS)
        files = _files_below(named.parent) if in_models else [named]
        yield from ((file.relative_to(folder), file.read_bytes()) for file in files)


def _named_files(value: Any, folder: Path) -> Iterator[Path]:
    """Yield the files beside a task that some text in it names."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from _named_files(each, folder)
    elif isinstance(value, str) and (file := Path(os.path.normpath(folder / value))).is_file():
        yield file


def _files_below(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _differs(path: Path, content: bytes) -> bool:
    """Return whether something else is in the way of a file."""
    return (path.exists() or path.is_symlink()) and not (path.is_file() and path.read_bytes() == content)
