"""Reading a motion: a CSV file, or an earlier plan."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.errors import MotionFileError, PlanFileError, nearest, nearest_file
from fesd_robot.instants import SAME_TIME
from fesd_robot.ocp.vectors import initial_configuration
from fesd_robot.orientations import angles_of, orientations_of, quaternion_entries, quaternion_of, turn_of, turns_of
from fesd_robot.plans import read_plan
from fesd_robot.ranges import MAX_TABLE_BYTES, too_large
from fesd_robot.robot import Robot, continuous_quaternions
from fesd_robot.task import Task

_UNIT = re.compile(r"\s*\[[^\]]*\]$")


def read_motion(task: Task, key: str, name: str, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the times, increasing, (n), and the configurations, (n, n_q), of a file that a key of the task names.

    Raises:
        TaskError: no such file, no such columns, or values that are no motion.
    """
    path = task.folder / name
    if not path.exists():
        raise task.error(key, f"found '{name}', but there is no file {path}{nearest_file(path)}")
    try:
        columns = _of_plan(path) if is_plan(path) else columns_of_csv(path)
    except (OSError, UnicodeDecodeError, csv.Error, MotionFileError, PlanFileError) as error:
        raise task.error(key, f"found {path}, which cannot be read as a motion: {error}") from error
    columns |= _unit_entries(columns, robot)
    for column in ("time", *robot.configuration_names):
        if column not in columns:
            raise task.error(
                key, f"found no column '{column}' in {path}, expected one for 'time' and every configuration coordinate"
                f"{nearest(column, columns)}"
            )  # fmt: skip
    times, first = np.unique(np.maximum.accumulate(columns["time"]), return_index=True)
    rows = np.column_stack([columns[name] for name in robot.configuration_names])[first]
    if not len(times) or not (np.isfinite(times).all() and np.isfinite(rows).all()):
        raise task.error(key, f"found no rows, or values that are not finite, in {path}, expected numbers")
    if np.any(np.diff(columns["time"]) < -SAME_TIME):
        raise task.error(key, f"found times that decrease in {path}, expected increasing ones")
    rows = np.array([pin.normalize(robot.model, row) for row in rows])
    start = initial_configuration(task, robot)
    for at in quaternion_entries(robot.configuration_names).values():
        rows[:, at] = continuous_quaternions(np.vstack([start[at], rows[:, at]]))[1:]
    return times, rows


def _unit_entries(columns: Mapping[str, np.ndarray], robot: Robot) -> dict[str, np.ndarray]:
    """Return quaternions, and cosines and sines, by name of joints for which a file has angles only."""
    found: dict[str, np.ndarray] = {}
    for joint in orientations_of(robot.configuration_names):
        angles, entries = angles_of(joint), quaternion_of(joint)
        if all(name in columns for name in angles) and not any(name in columns for name in entries):
            turns = [pin.rpy.rpyToMatrix(*row) for row in np.column_stack([columns[name] for name in angles])]
            quaternions = np.array([pin.Quaternion(turn).coeffs() for turn in turns]).reshape(-1, 4)
            found |= dict(zip(entries, quaternions.T, strict=True))
    for joint in turns_of(robot.configuration_names):
        cosine, sine = turn_of(joint)
        if joint in columns and not (cosine in columns or sine in columns):
            found |= {cosine: np.cos(columns[joint]), sine: np.sin(columns[joint])}
    return found


def is_plan(path: Path) -> bool:
    """Return whether a path is that of a plan, a folder or its JSON, and not of a table."""
    return path.is_dir() or path.suffix == ".json"


def _of_plan(path: Path) -> dict[str, np.ndarray]:
    trajectory = read_plan(path).trajectory
    return {"time": trajectory.time, **trajectory.configuration}


def columns_of_csv(path: Path) -> dict[str, np.ndarray]:
    """Return the columns by name without unit, of two with one name the first; text that is no number is NaN.

    Raises:
        MotionFileError: a file that is too large, or a row with more or less values than there are columns.
    """
    if fault := too_large(path, MAX_TABLE_BYTES):
        raise MotionFileError(fault)
    with path.open(newline="", encoding="utf-8-sig") as stream:
        header, *rows = list(csv.reader(stream)) or [[]]
    rows = [row for row in rows if row]
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise MotionFileError(f"row {number} has {len(row)} values for {len(header)} columns")
    columns: dict[str, np.ndarray] = {}
    for i, title in enumerate(header):
        columns.setdefault(_UNIT.sub("", title.strip()), np.array([_number(row[i]) for row in rows]))
    return columns


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
