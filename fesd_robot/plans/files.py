"""Reading and writing plans; a folder of results is replaced as a whole or not at all."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from fesd_robot.errors import FesdRobotError
from fesd_robot.plans.plan import Plan
from fesd_robot.plans.report import report

PLAN_FILE = "plan.json"


class PlanFileError(FesdRobotError):
    """A plan that cannot be read, or a folder that cannot be written to."""


def read_plan(path: Path | str) -> Plan:
    """Return the plan in a ``plan.json``, or in a folder that holds one.

    Raises:
        PlanFileError: no such file, or not a plan of this schema version.
    """
    path = Path(path)
    file = path / PLAN_FILE if path.is_dir() else path
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PlanFileError(f"{file}: cannot be read as a plan ({error})") from error
    try:
        return Plan.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise PlanFileError(f"{file}: not a plan of this version: {where}: {first['msg']}") from error


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


def write_plan(plan: Plan, folder: Path, extras: Callable[[Path], None] | None = None) -> Path:
    """Write a plan's files into `folder` and return it.

    Everything is written beside the folder first and takes its place in one move, so that an interrupted run leaves
    the earlier results whole. Files of an earlier plan go, files that are not a plan's stay.

    Args:
        extras: called with the folder being written, to add a page or figures.

    Raises:
        PlanFileError: the folder cannot hold results.
    """
    folder = folder.resolve()
    check_output_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with _staged(folder) as stage:
        (stage / PLAN_FILE).write_text(plan.model_dump_json(indent=1) + "\n", encoding="utf-8")
        write_csv(plan, stage / "trajectory.csv")
        write_npz(plan, stage / "trajectory.npz")
        (stage / "report.md").write_text(report(plan), encoding="utf-8")
        if extras:
            extras(stage)
    return folder


_OWN = {PLAN_FILE, "trajectory.csv", "trajectory.npz", "report.md", "plan.html", "figures"}


@contextmanager
def _staged(folder: Path) -> Iterator[Path]:
    """A folder beside `folder` that takes its place at the end; if anything fails, the earlier results are back."""
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


def columns_of(plan: Plan) -> dict[str, np.ndarray]:
    """Return the trajectory as named columns with units, controls held over their interval."""
    trajectory, units = plan.trajectory, plan.units
    columns = {"time [s]": trajectory.time}
    for name, values in trajectory.configuration.items():
        columns[f"{name} [{units.configuration[name]}]"] = values
    for name, values in trajectory.velocity.items():
        columns[f"{name} velocity [{units.velocity[name]}]"] = values
    starts = plan.controls["time"]
    interval = np.clip(np.searchsorted(starts, trajectory.time - 1e-9, side="right") - 1, 0, len(starts) - 1)
    for name, values in plan.controls.items():
        if name != "time":
            columns[f"{name} [{units.controls[name]}]"] = values[interval]
    for name, contact in plan.contacts.items():
        columns[f"{name} gap [m]"] = contact.gap
        columns[f"{name} normal force [N]"] = contact.normal_force
        columns[f"{name} tangential force [N]"] = contact.tangential_force
    return columns


def write_csv(plan: Plan, path: Path) -> None:
    """Write the trajectory with a header of names and units; an impact stands twice at the same time."""
    columns = columns_of(plan)
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow([*columns, *(f"{name} mode" for name in plan.contacts)])
        modes = [contact.mode for contact in plan.contacts.values()]
        for row in zip(*[values.tolist() for values in columns.values()], *modes, strict=True):
            writer.writerow([repr(value) if isinstance(value, float) else value for value in row])


def write_npz(plan: Plan, path: Path) -> None:
    """Write the trajectory as numpy arrays: time, configuration (n, n_q), velocity (n, n_v), controls, contacts."""
    trajectory = plan.trajectory
    arrays = {
        "time": trajectory.time,
        "configuration": np.column_stack(list(trajectory.configuration.values())),
        "velocity": np.column_stack(list(trajectory.velocity.values())),
        "configuration_names": np.array(list(trajectory.configuration)),
        "velocity_names": np.array(list(trajectory.velocity)),
        "control_names": np.array([name for name in plan.controls if name != "time"]),
        "control_time": plan.controls["time"],
        "control": np.column_stack([values for name, values in plan.controls.items() if name != "time"]),
        "contact_names": np.array(list(plan.contacts)),
        "gap": np.column_stack([contact.gap for contact in plan.contacts.values()]),
        "normal_force": np.column_stack([contact.normal_force for contact in plan.contacts.values()]),
        "tangential_force": np.column_stack([contact.tangential_force for contact in plan.contacts.values()]),
        "mode": np.column_stack([contact.mode for contact in plan.contacts.values()]),
    }
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]
