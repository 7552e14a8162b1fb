"""The tasks, sweeps and models that come with the program, by name."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Literal

from fesd_robot.errors import TaskError, nearest

TASKS, MODELS, SWEEPS = "tasks", "models", "sweeps"
"""Folders of the examples; tasks name models relative to their own."""

SIMULATED = "simulated"
"""Folder below that of the tasks, of those without controls."""

PUBLIC = "public"
"""Folder below that of the tasks, of those of other planners."""

_SUFFIX = ".yaml"

ROBOT_DATA = "example-robot-data:"
"""How the name of a robot begins that needs the extra `robots`."""


@dataclass(frozen=True)
class Example:
    """A task, a sweep or a model that comes with the program.

    Attributes:
        name: of the task or the sweep, or of the model's folder.
        kind: what it is.
        path: its file, or the model's folder.
        words: what it does, one sentence; what the model is.
        needs_robot_data: whether its robot is one of the package example-robot-data.
        simulated: whether it is a task of a robot without controls, which is simulated and not planned.
        public: whether it is a task of another planner.
    """

    name: str
    kind: Literal["task", "sweep", "model"]
    path: Path
    words: str
    needs_robot_data: bool = False
    simulated: bool = False
    public: bool = False


def shipped_folder() -> Path:
    """Return the folder with the folders `tasks` and `models`: inside the installed package, or of a checkout.

    Raises:
        TaskError: if they are in neither.
    """
    here = Path(__file__).resolve().parent
    for folder in (here, here.parents[1]):
        if (folder / TASKS).is_dir() and (folder / MODELS).is_dir():
            return folder
    raise TaskError(f"found no folders {TASKS} and {MODELS} in {here}, expected them there: install fesd-robot again")


def shipped_examples() -> list[Example]:
    """Return the tasks, then those of others and those to simulate, the sweeps and the models, each kind by name."""
    folder, places = shipped_folder(), ("", PUBLIC, SIMULATED)
    tasks = [_task(file) for place in places for file in sorted((folder / TASKS / place).glob("*.yaml"))]
    sweeps = [_sweep(file, tasks) for file in shipped_sweeps().values()]
    models = [_model(each) for each in sorted((folder / MODELS).iterdir()) if each.is_dir()]
    return [*tasks, *sweeps, *models]


def examples_by_name() -> dict[str, Example]:
    """Return the examples by name: of a task and a model of one name the task, which has that model with it."""
    return {example.name: example for example in reversed(shipped_examples())}


def find_task(given: str | Path) -> Path:
    """Return the task file that a path or the name of a shipped task stands for.

    A file is found first, so that a name never hides a file of the user.

    Args:
        given: a path, which need not exist, or a name without folder and suffix.

    Raises:
        TaskError: for a name that is neither, with the nearest name.
    """
    path = _path(given, "task")
    if path.is_file():
        return path
    tasks = {example.name: example.path for example in shipped_examples() if example.kind == "task"}
    if path.suffix or path.name != str(given):
        if path.suffix == _SUFFIX and path.stem in tasks and not path.exists():
            raise TaskError(
                f"there is no such file, expected a task file; '{path.stem}' alone is the task that comes with the "
                "program",
                file=path,
            )
        return path
    return _named(str(given), tasks, "task", "that `fesd-robot examples` lists")


def shipped_sweeps() -> dict[str, Path]:
    """Return the sweeps that come with the program: name -> file."""
    return {file.stem: file for file in sorted((shipped_folder() / SWEEPS).glob(f"*{_SUFFIX}"))}


def find_sweep(given: str | Path) -> Path:
    """Return the sweep file that a path or the name of a shipped sweep stands for.

    Args:
        given: a path, which need not exist, or a name without folder and suffix.

    Raises:
        TaskError: for a name that is neither, with the nearest name.
    """
    path = _path(given, "sweep")
    if path.is_file() or path.suffix or path.name != str(given):
        return path
    return _named(str(given), shipped_sweeps(), "sweep", "that `fesd-robot examples` lists")


def _path(given: str | Path, kind: str) -> Path:
    """Return what is given for a file of a kind as a path that has a name."""
    path = Path(given)
    if not path.name:
        raise TaskError(f"found '{given}', expected a {kind} file or the name of a {kind}")
    return path


def _named(name: str, files: Mapping[str, Path], kind: str, which: str) -> Path:
    """Return the file of a kind that has a name."""
    if name in files:
        return files[name]
    # Files of the user, too: who writes a name without suffix has perhaps forgotten it.
    here = {file.stem: file.name for file in Path().glob(f"*{_SUFFIX}")}
    close = get_close_matches(name, [*here, *files], n=1)
    hint = f" (did you mean '{here.get(close[0], close[0])}'?)" if close else nearest(name, files)
    raise TaskError(f"found '{name}', expected a {kind} file or the name of a {kind} {which}{hint}")


def _task(file: Path) -> Example:
    text = file.read_text(encoding="utf-8")
    simulated, public = (file.parent.name == place for place in (SIMULATED, PUBLIC))
    words = _first_sentence(text).partition(" Source: ")[0]
    return Example(file.stem, "task", file, words, f"model: {ROBOT_DATA}" in text, simulated, public)


def _sweep(file: Path, tasks: Sequence[Example]) -> Example:
    text = file.read_text(encoding="utf-8")
    needing = any(
        task.needs_robot_data and re.search(rf"^task: (.*/)?{task.name}(\.yaml)?$", text, re.MULTILINE)
        for task in tasks
    )
    return Example(file.stem, "sweep", file, _first_sentence(text), needing)


def _first_sentence(text: str) -> str:
    """Return the first paragraph of the comment at the top of a file, without the line that is for editors."""
    lines: list[str] = []
    for line in text.splitlines():
        words = line.removeprefix("#").strip()
        if not line.startswith("#") or (lines and not words):
            break
        if words and not words.startswith("yaml-language-server"):
            lines.append(words)
    return " ".join(lines)


def _model(folder: Path) -> Example:
    (file,) = sorted(folder.glob("*.urdf"))
    comment = re.search(r"<!--\s*(.*?)\s*-->", file.read_text(encoding="utf-8"), re.DOTALL)
    words = " ".join(comment.group(1).split()) if comment else ""
    return Example(folder.name, "model", folder, re.split(r"(?<=[.:])\s", words)[0].rstrip(".:") + ".")
