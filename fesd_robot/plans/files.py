"""Reading and writing plans; a folder of results is replaced as a whole or not at all."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError
from pydantic_core import from_json

from fesd_robot.arguments import checked
from fesd_robot.errors import PlanFileError, TaskError
from fesd_robot.plans.consistency import inconsistencies
from fesd_robot.plans.exports import EXPORTS, export
from fesd_robot.plans.origin import check_task
from fesd_robot.plans.plan import SCHEMA_VERSION, Plan
from fesd_robot.plans.renamed_keys import rename_plan_keys
from fesd_robot.plans.report_text import report
from fesd_robot.task import TwoNamesError

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

_NO_JSON = "not a plan: expected the JSON that fesd-robot plan writes"


@checked
def read_plan(path: Path | str) -> Plan:
    """Return the plan in a ``plan.json``, or in a folder that holds one.

    Keys under an old name get their new one, with one warning for all (`fesd_robot.plans.renamed_keys`).

    Raises:
        PlanFileError: no such file, not a plan of this schema version, or one whose parts do not fit each other.
    """
    path = Path(path)
    file = path / PLAN_FILE if path.is_dir() else path
    if not file.is_file():
        what = f"the folder holds no {PLAN_FILE}" if path.is_dir() else "there is no such file or folder"
        raise PlanFileError(f"{path}: {what}, expected a folder of results or the {PLAN_FILE} in it")
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PlanFileError(f"{file}: cannot be read as a plan ({error})") from error
    try:
        data = from_json(text)
        renamings = rename_plan_keys(data)
        plan = Plan.model_validate(data)
    except ValidationError as error:
        raise PlanFileError(f"{file}: {_why_no_plan(error)}") from error
    except TwoNamesError as error:
        raise PlanFileError(f"{file}: task: {error}") from error
    except ValueError as error:
        raise PlanFileError(f"{file}: {_NO_JSON} ({error})") from error
    try:
        check_task(plan)
    except TaskError as error:
        raise PlanFileError(f"{file}: task: {error}") from error
    for sentence in inconsistencies(plan):
        raise PlanFileError(f"{file}: {sentence}")
    if renamings:
        names = ", ".join(f"'{old}' is now called '{new}'" for old, new in renamings)
        logger.warning("%s: keys have new names: %s", file, names)
    return plan


def _why_no_plan(error: ValidationError) -> str:
    """Explain why a file is no plan; a later version comes before everything that follows from it."""
    errors = error.errors(include_url=False)
    version = next((each["input"] for each in errors if each["loc"] == ("schema_version",)), None)
    if isinstance(version, int) and version > SCHEMA_VERSION:
        return (
            f"found a plan of schema version {version}, expected {SCHEMA_VERSION}, the one that this version of "
            "fesd-robot reads; use the version that wrote it, or a later one"
        )
    where = ".".join(str(part) for part in errors[0]["loc"])
    if not where:
        return f"{_NO_JSON} ({errors[0]['msg']})"
    return f"not a plan of this version: {where}: {errors[0]['msg']}"


def check_output_folder(folder: Path) -> None:
    """Raise unless results may be written there: a new or empty folder, or one that holds an earlier plan.

    Raises:
        PlanFileError: a file is in the way, or the folder holds something else.
    """
    folder = folder.resolve()
    if folder == Path.cwd() or folder in Path.cwd().parents:
        raise PlanFileError(f"{folder}: is the current folder or one above it; choose another --out")
    if folder.exists() and not folder.is_dir():
        raise PlanFileError(f"{folder}: cannot hold results, it is a file; choose another --out")
    parent = next(parent for parent in folder.parents if parent.exists())
    if not parent.is_dir():
        raise PlanFileError(f"{folder}: cannot hold results, {parent} is a file; choose another --out")
    if not os.access(parent, os.W_OK):
        raise PlanFileError(f"{folder}: cannot hold results, {parent} is not writable; choose another --out")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / PLAN_FILE).is_file():
        raise PlanFileError(
            f"{folder}: holds files but no {PLAN_FILE}, so it is no folder of results; choose another --out"
        )


@checked
def write_plan(plan: Plan, folder: Path | str, extras: Callable[[Path], None] | None = None) -> Path:
    """Write a plan's files into `folder` and return it.

    Everything is written beside the folder first and takes its place in one move, so that an interrupted run leaves
    the earlier results whole. Files of an earlier plan go, files that are not a plan's stay.

    Args:
        extras: called with the folder being written, to add a page or figures.

    Raises:
        PlanFileError: the folder cannot hold results.
    """
    folder = Path(folder).resolve()
    check_output_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with _staged(folder) as stage:
        (stage / PLAN_FILE).write_text(plan.model_dump_json(indent=1) + "\n", encoding="utf-8")
        for name, each in EXPORTS.items():
            if each.with_plan:
                (stage / each.file).write_bytes(export(plan, name))
        (stage / REPORT_FILE).write_text(report(plan), encoding="utf-8")
        if extras:
            extras(stage)
            (stage / REPORT_FILE).write_text(report(plan, _picture(stage)), encoding="utf-8")
    return folder


def _picture(folder: Path) -> str | None:
    """Return the snapshots of a motion that a report can show, None where they were not drawn."""
    names = (f"{FIGURES_FOLDER}/snapshots.{kind}" for kind in ("png", "svg"))
    return next((name for name in names if (folder / name).is_file()), None)


_OWN = {*FILES, *(each.file for each in EXPORTS.values())}
"""Files that go with an earlier plan: those of its run, and exports beside it."""


@contextmanager
def _staged(folder: Path) -> Iterator[Path]:
    """Yield a folder beside `folder` that replaces it at the end; if anything fails, the earlier results are back."""
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as beside:
        stage, earlier = Path(beside) / "new", Path(beside) / "earlier"
        stage.mkdir()
        yield stage
        if not folder.exists():
            stage.rename(folder)
            return
        try:
            folder.rename(earlier)
            for item in earlier.iterdir():
                if item.name not in _OWN and not (stage / item.name).exists():
                    item.rename(stage / item.name)
            stage.rename(folder)
        except BaseException:
            if earlier.exists():
                for item in [] if folder.exists() else list(stage.iterdir()):
                    if item.name not in _OWN and not (earlier / item.name).exists():
                        item.rename(earlier / item.name)
                if not folder.exists():
                    earlier.rename(folder)
            raise
