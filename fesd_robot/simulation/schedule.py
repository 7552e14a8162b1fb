"""Controls over time, constant on intervals: from a plan, from a table, or none."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fesd_robot.errors import DimensionError, MotionFileError, nearest, nearest_file
from fesd_robot.ocp import columns_of_csv, is_plan
from fesd_robot.plans import Plan, read_plan


@dataclass(frozen=True)
class ControlSchedule:
    """Controls that are constant on intervals of time.

    Attributes:
        times: where intervals begin, and the end of the last, increasing, s, (N + 1).
        controls: of every interval, N or N m, (N, n_u).

    Raises:
        DimensionError: lengths that do not fit each other.
    """

    times: np.ndarray
    controls: np.ndarray

    def __post_init__(self) -> None:
        if self.controls.ndim != 2 or len(self.times) != len(self.controls) + 1:
            raise DimensionError(
                f"schedule: times has shape {self.times.shape} and controls {self.controls.shape}, expected (N + 1,) "
                "and (N, n_u)"
            )

    @property
    def duration(self) -> float:
        """s."""
        return float(self.times[-1])

    def until(self, duration: float) -> ControlSchedule:
        """Return the controls up to a time; after the end of the last interval its controls go on."""
        count = max(int(np.searchsorted(self.times[:-1], duration, side="left")), 1)
        return ControlSchedule(np.append(self.times[:count], duration), self.controls[:count])


def schedule_of(
    controls: Plan | Path | str | Mapping[str, float | Sequence[float] | np.ndarray] | None,
    names: Sequence[str],
    duration: float,
    intervals: int,
) -> ControlSchedule:
    """Return the controls of a simulation.

    Args:
        controls: those of a plan; a file, which is a plan or a CSV table with a column ``time``, where an interval
            begins, in s, from 0, and one for every control; name -> value, or values on equal intervals; None for zero.
        names: of the controls.
        duration: of the motion, s.
        intervals: of the control grid, where nothing else says it.

    Raises:
        MotionFileError: no such file or columns, times that do not begin at 0 or do not increase, an unknown control,
            or values of different lengths.
        PlanFileError: a plan that cannot be read.
    """
    if controls is None:
        return ControlSchedule(np.linspace(0.0, duration, intervals + 1), np.zeros((intervals, len(names))))
    if isinstance(controls, Plan):
        return _of_columns(controls.controls, names, duration, f"the plan '{controls.name}'")
    if isinstance(controls, Mapping):
        return _of_values(controls, names, duration, intervals)
    path = Path(controls)
    if is_plan(path):
        return _of_columns(read_plan(path).controls, names, duration, str(path))
    if not path.is_file():
        raise MotionFileError(f"{path}: found no such file, expected controls{nearest_file(path)}")
    try:
        columns = columns_of_csv(path)
    except (OSError, UnicodeDecodeError, csv.Error, MotionFileError) as error:
        raise MotionFileError(f"{path}: cannot be read as a table of controls ({error})") from error
    return _of_columns(columns, names, duration, str(path))


def _of_columns(
    columns: Mapping[str, np.ndarray], names: Sequence[str], duration: float, where: str
) -> ControlSchedule:
    for name in ("time", *names):
        if name not in columns:
            raise MotionFileError(
                f"{where}: found no column '{name}', expected one for 'time' and every control{nearest(name, columns)}"
            )
    starts, values = (
        columns["time"],
        np.column_stack([np.zeros((len(columns["time"]), 0)), *(columns[n] for n in names)]),
    )
    if not len(starts) or not (np.isfinite(starts).all() and np.isfinite(values).all()):
        raise MotionFileError(f"{where}: found no rows, or values that are not finite, expected numbers")
    if starts[0] != 0 or np.any(np.diff(starts) <= 0):
        wrong = int(np.argmax(np.append(starts[0] != 0, np.diff(starts) <= 0)))
        raise MotionFileError(
            f"{where}: found time {starts[wrong]:g} in row {wrong + 1}, expected times that begin at 0 and increase: "
            "a row holds from its time on"
        )
    return ControlSchedule(np.append(starts, max(duration, np.nextafter(starts[-1], np.inf))), values).until(duration)


def _of_values(
    controls: Mapping[str, float | Sequence[float] | np.ndarray],
    names: Sequence[str],
    duration: float,
    intervals: int,
) -> ControlSchedule:
    for name in controls:
        if name not in names:
            raise MotionFileError(f"found control '{name}', expected controls of the task{nearest(name, names)}")
    values = {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in controls.items()}
    lengths = {len(value) for value in values.values()} - {1}
    if len(lengths) > 1:
        raise MotionFileError(f"found controls with {sorted(lengths)} values, expected as many for each, or one")
    count = lengths.pop() if lengths else intervals
    columns = [np.broadcast_to(values.get(name, np.zeros(1)), (count,)) for name in names]
    table = np.column_stack([np.zeros((count, 0)), *columns])
    if not np.isfinite(table).all():
        raise MotionFileError("found controls that are not finite, expected numbers")
    return ControlSchedule(np.linspace(0.0, duration, count + 1), table)
