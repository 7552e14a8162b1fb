"""A folder of results: which files in it are a run's, and how they take their places, whatever ends the run.

Files are made in a folder within the folder of results, the staging folder (`.fesd-robot-….part`). Once all are there a
list of them is written into it, files of the earlier run that have no successor are removed, the new ones are moved one
by one, and `plan.json` is the last. A staging folder with its list was left by a run that was killed meanwhile: the
next command that reads or writes there finishes it. One without is removed.
"""

from __future__ import annotations

import errno
import logging
import os
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import get_args

from pydantic_core import from_json

from fesd_robot.errors import FolderInUseError, PlanFileError
from fesd_robot.locks import LOCK_FILE, locked
from fesd_robot.plans.exports import EXPORTS
from fesd_robot.task import FigureFormat
from fesd_robot.writing import COMPLETE, UNFINISHED, remove_unfinished, staging_folder, sync_folder, write_atomically

logger = logging.getLogger(__name__)

PLAN_FILE, REPORT_FILE, PAGE_FILE, FIGURES_FOLDER = "plan.json", "report.md", "plan.html", "figures"

COMPARISON_FILE = "comparison.html"
"""The page of two plans, which a run does not leave."""

FILES = (
    PLAN_FILE,
    *(each.file for each in EXPORTS.values() if each.with_plan),
    REPORT_FILE,
    PAGE_FILE,
    FIGURES_FOLDER,
)
"""Files that a run may leave, in the order to look at them."""

FIGURES = (
    "snapshots",
    "positions",
    "velocities",
    "controls",
    "contacts",
    "friction_cones",
    "contact_timeline",
    "energy",
    "center_of_mass",
)
"""Names of the figures of a plan."""

ANIMATION_FILE = "motion.gif"
"""The animation, which lies beside the figures."""

_OF_A_PLAN = (REPORT_FILE, PAGE_FILE, *(each.file for each in EXPORTS.values()))
_DRAWINGS = (ANIMATION_FILE, *(f"{name}.{kind}" for name in FIGURES for kind in get_args(FigureFormat)))

DERIVED = (*_OF_A_PLAN, *(f"{FIGURES_FOLDER}/{name}" for name in _DRAWINGS))
"""Files that go with an earlier plan: those of its run, and exports beside it."""

_TRIAL = bytes(2**18)
"""About the size of the results of a small plan."""

_LONGEST_PLAN = 2**26
"""Bytes after which a file is looked at no further."""

_READER_PATIENCE = 5.0
"""How long a reader waits for a writer, s."""


def check_output_folder(folder: Path) -> None:
    """Raise unless results can be written there: a new or empty folder, or one that holds an earlier plan.

    A file is written there and removed again.

    Raises:
        PlanFileError: a file is in the way, the folder holds something else, or it cannot be written to.
    """
    refuse_others(folder)
    try:
        with staging_folder(Path(folder).resolve()) as stage:
            write_atomically(stage / FIGURES_FOLDER / f"{FIGURES[0]}.png", _TRIAL)
    except OSError as error:
        raise PlanFileError(f"{folder}: cannot hold results ({error.strerror}); choose another --out") from error


def refuse_others(folder: Path, finish: Callable[[Path], None] | None = None) -> None:
    """Raise unless a folder is new, empty, or one of results; nothing is written, but an interrupted run is finished.

    Args:
        finish: how that is done; default: `finish_interrupted`.

    Raises:
        PlanFileError: a file is in the way, or the folder holds something else.
    """
    try:
        _refuse_others(Path(folder).resolve(), finish or finish_interrupted)
    except (OSError, RuntimeError) as error:  # RuntimeError: links that lead to each other
        why = error.strerror if isinstance(error, OSError) else error
        raise PlanFileError(f"{folder}: cannot hold results ({why}); choose another --out") from error


def _refuse_others(folder: Path, finish: Callable[[Path], None]) -> None:
    if _is_around_us(folder):
        raise PlanFileError(f"{folder}: is the current folder or one above it; choose another --out")
    if folder.exists() and not folder.is_dir():
        raise PlanFileError(f"{folder}: cannot hold results, it is a file; choose another --out")
    parent = next(parent for parent in folder.parents if parent.exists())
    if not parent.is_dir():
        raise PlanFileError(f"{folder}: cannot hold results, {parent} is a file; choose another --out")
    if not folder.is_dir():
        return
    finish(folder)
    others = {name for name in os.listdir(folder) if not (UNFINISHED.fullmatch(name) or name == LOCK_FILE)}
    if others and PLAN_FILE not in others:
        raise PlanFileError(
            f"{folder}: holds files but no {PLAN_FILE}, so it is no folder of results; choose another --out"
        )
    if others and not is_plan_of_ours(folder / PLAN_FILE):
        raise PlanFileError(
            f"{folder}: holds a {PLAN_FILE} that is no plan of this program, so it is no folder of results; "
            "choose another --out"
        )
    for name in DERIVED:
        if (folder / name).is_dir() and not (folder / name).is_symlink():
            raise PlanFileError(f"{folder / name}: is a folder where results have a file; choose another --out")
    figures = folder / FIGURES_FOLDER
    if figures.is_symlink() or (figures.exists() and not figures.is_dir()):
        raise PlanFileError(f"{figures}: is a link or a file where results have a folder; choose another --out")


def _is_around_us(folder: Path) -> bool:
    """Return whether a folder is the current one, if there is one, or above it."""
    try:
        here = Path.cwd()
    except FileNotFoundError:
        return False
    return folder == here or folder in here.parents


def is_plan_of_ours(file: Path) -> bool:
    """Return whether a file is a plan that any version of this program wrote, also one that is cut off."""
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            return False
        with file.open("rb") as stream:
            text = stream.read(_LONGEST_PLAN).decode(errors="ignore")
        data = from_json(text, allow_partial=True)
    except (OSError, ValueError):
        return False
    if not isinstance(data, dict) or type(data.get("schema_version")) is not int:
        return False
    return "name" in data and isinstance(data.get("status"), dict) and "solved" in data["status"]


def place(stage: Path, folder: Path) -> None:
    """Move the files of a staging folder to their places around it; with a plan it is another run's folder then.

    Args:
        stage: of `writing.staging_folder`, with all files.
        folder: of results, or of drawings.

    Raises:
        PlanFileError: the folder has become something else, or another run writes there.
        OSError: a file cannot be moved; the earlier plan is still there.
    """
    names = sorted(path.relative_to(stage).as_posix() for path in _files_in(stage))
    with locked(folder):
        if PLAN_FILE in names:
            refuse_others(folder, _finish)
        else:
            _finish(folder)
        remove_unfinished(folder)
        remove_unfinished(folder / FIGURES_FOLDER)
        write_atomically(stage / COMPLETE, "\n".join(names).encode())
        try:
            _move(stage, folder)
        except OSError:
            raise
        except BaseException:  # an interrupt waits for the moment that this takes
            _move(stage, folder)
            raise


def finish_interrupted(folder: Path) -> None:
    """Move the files of runs that were killed while they did so; where that cannot be done, a warning says so."""
    with suppress(OSError):  # who may not list it finds nothing
        if not _interrupted(folder):
            return
    try:
        with locked(folder, _READER_PATIENCE):
            _finish(folder)
    except (OSError, FolderInUseError) as error:
        logger.warning(
            "%s: a run was killed while it wrote there, and its files cannot be moved to their places (%s), so that "
            "other files than %s may be of another run",
            folder,
            error.strerror if isinstance(error, OSError) else error,
            PLAN_FILE,
        )


def _finish(folder: Path) -> None:
    for stage in _interrupted(folder):
        logger.debug("finishing %s", stage)
        _move(stage, folder)
        shutil.rmtree(stage, ignore_errors=True)


def _interrupted(folder: Path) -> list[Path]:
    """Return the staging folders in a folder whose files are on the way to their places."""
    stages = [folder / name for name in os.listdir(folder) if UNFINISHED.fullmatch(name)]
    return [stage for stage in stages if (stage / COMPLETE).is_file() and not stage.is_symlink()]


def _files_in(stage: Path) -> list[Path]:
    """Return the files of a staging folder, the plan last."""
    files = [path for path in sorted(stage.rglob("*")) if path.is_file()]
    own = [path for path in files if path.name not in (COMPLETE, LOCK_FILE)]
    return sorted(own, key=lambda path: path == stage / PLAN_FILE)


def _move(stage: Path, folder: Path) -> None:
    """Move all files of a staging folder, also a second time; files of an earlier run without a successor go first.

    Raises:
        OSError: one cannot be moved; of those beside the plan none of another run is left.
    """
    names = (stage / COMPLETE).read_text(encoding="utf-8").splitlines()
    stale = [folder / name for name in DERIVED if name not in names] if PLAN_FILE in names else []
    for path in stale:
        if not path.parent.is_symlink():
            path.unlink(missing_ok=True)
    if stale:
        with suppress(OSError):  # other files are in it, or it is not there
            (folder / FIGURES_FOLDER).rmdir()
    moved: list[Path] = []
    try:
        for path in _files_in(stage):
            target = folder / path.relative_to(stage)
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.parent.resolve() != target.parent:
                raise NotADirectoryError(errno.ENOTDIR, "is a link", str(target.parent))
            os.replace(path, target)
            moved.append(target)
            sync_folder(target.parent)
    except OSError:
        for target in moved:
            target.unlink(missing_ok=True)
        raise
