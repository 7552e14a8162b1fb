"""Reading and writing plans."""

from __future__ import annotations

import logging
import re
import shutil
import tempfile
from collections.abc import Callable
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
from fesd_robot.plans.results_folder import (
    FIGURES_FOLDER,
    PLAN_FILE,
    REPORT_FILE,
    finish_interrupted,
    place,
    refuse_others,
)
from fesd_robot.task import TwoNamesError
from fesd_robot.writing import staging_folder, write_atomically

logger = logging.getLogger(__name__)

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
    if file.name == PLAN_FILE and file.parent.is_dir():
        finish_interrupted(file.parent.resolve())
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


@checked
def write_plan(plan: Plan, folder: Path | str, extras: Callable[[Path], None] | None = None) -> Path:
    """Write a plan's files into `folder` and return it.

    Everything is written into a folder within it first and moved from there, the plan last (`results_folder`). Of an
    earlier plan the files that a run leaves are replaced or removed; no other file is touched. Another run that writes
    there is waited for. Where the files cannot be written the plan is written elsewhere.

    Args:
        extras: called with the folder being written, to add a page or figures.

    Raises:
        PlanFileError: the folder cannot hold results, and nothing is written; or it could not be written to, and the
            message says where the plan is.
    """
    refuse_others(Path(folder))
    return write_or_keep(plan, folder, extras)


def write_or_keep(plan: Plan, folder: Path | str, extras: Callable[[Path], None] | None = None) -> Path:
    """Write a plan's files as `write_plan` does, into a folder that was checked before; nothing makes it lose the plan.

    Raises:
        PlanFileError: the folder could not be written to, or has become one of something else; the message says where
            the plan is.
    """
    try:
        return write_into(plan, folder, extras)
    except PlanFileError as error:
        raise kept_elsewhere(plan, str(error)) from error
    except OSError as error:
        raise kept_elsewhere(plan, f"{folder}: cannot be written to ({error.strerror})") from error


def write_into(plan: Plan, folder: Path | str, extras: Callable[[Path], None] | None = None) -> Path:
    """Write a plan's files into `folder` or nowhere, else as `write_plan`.

    Raises:
        PlanFileError: the folder cannot hold results, or another run writes there.
        OSError: it cannot be written to; what was there is as it was.
    """
    refuse_others(Path(folder))
    folder = Path(folder).resolve()
    with staging_folder(folder) as stage:
        write_atomically(stage / PLAN_FILE, (plan.model_dump_json(indent=1) + "\n").encode())
        for name, each in EXPORTS.items():
            if each.with_plan:
                write_atomically(stage / each.file, export(plan, name))
        write_atomically(stage / REPORT_FILE, report(plan).encode())
        if extras:
            extras(stage)
            write_atomically(stage / REPORT_FILE, report(plan, _picture(stage)).encode())
        place(stage, folder)
    return folder


def kept_elsewhere(plan: Plan, why: str) -> PlanFileError:
    """Write a plan into a new folder in the current folder, in that of temporary files or at home.

    Args:
        why: what is wrong with the folder that it should go to.

    Returns:
        an error that says both.
    """
    name, why = re.sub(r"[^A-Za-z0-9_-]", "_", plan.name)[:40], why.removesuffix("; choose another --out")
    places = (Path.cwd, lambda: Path(tempfile.gettempdir()), Path.home)
    for place_of in places:
        try:
            there = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=place_of()))
        except (OSError, RuntimeError):  # RuntimeError: nobody's home
            continue
        try:
            write_into(plan, there)
        except (OSError, PlanFileError):
            shutil.rmtree(there, ignore_errors=True)
            continue
        return PlanFileError(f"{why}; the plan is written to {there}", kept=there)
    return PlanFileError(f"{why}, nor can the current folder, that of temporary files or the home folder")


def _picture(folder: Path) -> str | None:
    """Return the snapshots of a motion that a report can show, None where they were not drawn."""
    names = (f"{FIGURES_FOLDER}/snapshots.{kind}" for kind in ("png", "svg"))
    return next((name for name in names if (folder / name).is_file()), None)
