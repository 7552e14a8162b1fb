"""Tasks with all files that they name, by content, so that a machine without them can plan them."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from fesd_robot.errors import RobotError, TaskError
from fesd_robot.robot.paths import locate_robot, package_directories
from fesd_robot.task import EXAMPLE_ROBOT_PREFIX, FromFile, HeightMap, ModelBody, Robot, Task

LARGEST = 200_000_000
"""Bytes of all files of a task."""


@dataclass(frozen=True)
class TaskContent:
    """Task files and the files that they name.

    Args:
        tasks: name of a task -> path of its file among them.
        files: path -> content; paths are relative, to each other as they were.
        overrides: name of a task -> ``key=value`` of files that it names by paths of the sender.
    """

    tasks: Mapping[str, str]
    files: Mapping[str, bytes]
    overrides: Mapping[str, tuple[str, ...]]

    @cached_property
    def identity(self) -> str:
        """A hash of all."""
        digest = hashlib.sha256(json.dumps(list(self.tasks.items())).encode())
        for name, content in sorted(self.files.items()):
            digest.update(f"\0{name}\0".encode() + hashlib.sha256(content).digest())
        return digest.hexdigest()

    def unpacked(self, folder: Path) -> dict[str, Path]:
        """Write all files into a folder, and return name of a task -> its file there."""
        for name, content in self.files.items():
            file = folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        return {name: folder / path for name, path in self.tasks.items()}


def content_of(tasks: Mapping[str, Sequence[Task]]) -> TaskContent:
    """Return task files and the files that they name, with the meshes of their models.

    Args:
        tasks: name -> what is loaded from the file of a task, each with other files that are to go along; a robot of
            the package example-robot-data is named, not sent.

    Raises:
        TaskError: a file that one names is not there, or all are too large to be sent.
    """
    own, named, moved = dict[str, Path](), set[Path](), dict[str, dict[str, Path]]()
    for name, loaded in tasks.items():
        file = loaded[0].origins.file
        assert file is not None, "a task of a sweep comes from a file"
        own[name], moved[name] = _absolute(file), {}
        for task in loaded:
            for key, written, path in _named(task):
                named.add(_absolute(path))
                if Path(written).is_absolute():
                    moved[name][key] = _absolute(path)
                if key.endswith("model"):
                    named.update(map(_absolute, _beside(path, task.folder)))
    size = sum(each.stat().st_size for each in named)
    if size > LARGEST:
        raise TaskError(f"found {size / 1e6:.0f} MB of files, expected at most {LARGEST / 1e6:g} MB", file=file)
    root = Path(os.path.commonpath([each.parent for each in (*own.values(), *named)]))
    files = {each.relative_to(root).as_posix(): each.read_bytes() for each in sorted({*own.values(), *named})}
    overrides = {
        name: tuple(f"{key}={json.dumps(os.path.relpath(path, own[name].parent))}" for key, path in keys.items())
        for name, keys in moved.items()
    }
    return TaskContent({name: path.relative_to(root).as_posix() for name, path in own.items()}, files, overrides)


def _absolute(path: Path) -> Path:
    return Path(os.path.abspath(path))


def _named(task: Task) -> Iterator[tuple[str, str, Path]]:
    """Yield the key, what is written there, and the path, of every file that a task names."""
    sections = {"robot": task.robot} | {f"bodies.{name}": body for name, body in task.bodies.items()}
    for at, section in sections.items():
        if not isinstance(section, Robot | ModelBody) or section.model.startswith(EXAMPLE_ROBOT_PREFIX):
            continue
        address = task.locate_model(None if at == "robot" else at.partition(".")[2])
        try:
            yield f"{at}.model", section.model, locate_robot(address, task.folder)
        except RobotError as error:
            raise task.error(f"{at}.model", str(error)) from error
    others: list[tuple[str, str | None]] = [("solver.warm_start", task.solver.warm_start)]
    others += [("reference.path", task.reference.path)] if isinstance(task.reference, FromFile) else []
    others += [("ground.file", task.ground.file)] if isinstance(task.ground, HeightMap) else []
    for key, written in others:
        if written is not None:
            path = task.folder / written
            path = path / "plan.json" if path.is_dir() else path
            if not path.is_file():
                raise task.error(key, f"found '{written}', but there is no file {path}")
            yield key, written, path


def _beside(model: Path, folder: Path) -> Iterator[Path]:
    """Yield the files that a model file names, as far as they are there: meshes, textures, included files."""
    try:
        document = ElementTree.parse(model).getroot()
    except (ElementTree.ParseError, OSError):
        return  # which the reader of models says better
    compiler = document.find("compiler")
    folders = {compiler.get(name, "") for name in ("meshdir", "texturedir", "assetdir")} if compiler is not None else {}
    places = [model.parent, *(model.parent / each for each in folders), *package_directories(model, folder)]
    for element in document.iter():
        for attribute in ("filename", "file"):
            address = element.get(attribute, "")
            found = _found(address.rpartition("://")[2], places) if address else None
            if found is not None:
                yield found
                if element.tag == "include":
                    yield from _beside(found, folder)


def _found(address: str, places: list[Path]) -> Path | None:
    return next((place / address for place in places if (place / address).is_file()), None)


class Unpacked:
    """Files of tasks on this machine, unpacked once, in a folder that goes with the process."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._files: dict[str, dict[str, Path]] = {}

    def files(self, content: TaskContent) -> dict[str, Path]:
        """Return name of a task -> its file, of a content."""
        if content.identity not in self._files:
            self._folder = self._folder or tempfile.TemporaryDirectory(prefix="fesd-robot-sweep-")
            self._files[content.identity] = content.unpacked(Path(self._folder.name) / content.identity[:16])
        return self._files[content.identity]

    def end(self) -> None:
        """Remove the files."""
        self._files.clear()
        if self._folder:
            self._folder.cleanup()
            self._folder = None
