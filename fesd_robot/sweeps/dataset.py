"""The plans of a sweep as a data set for learning, in the columns of LeRobot."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot.errors import SweepError
from fesd_robot.plans import Plan, read_plan
from fesd_robot.plans.sampling import Side
from fesd_robot.sweeps.order import Verdict
from fesd_robot.sweeps.table import SweepTable
from fesd_robot.writing import write_atomically

DATA_FILE, INFO_FILE = "dataset/data/chunk-000/episodes.parquet", "dataset/meta/info.json"
"""The samples of all plans, and what is in them, in the folder of the sweep."""


def write_dataset(table: SweepTable, rate: float) -> Path:
    """Write states and controls of the solved plans of a sweep at equal times; an episode is a plan.

    Columns: ``observation.state`` (positions, then velocities), ``action`` (controls), ``timestamp`` in s,
    ``frame_index``, ``episode_index``, ``index``, ``task_index`` (0), ``next.done``; the info file names their entries,
    and the row of every episode.

    Args:
        table: of the sweep, with its plans kept.
        rate: samples a second, Hz.

    Returns:
        the folder of the data set.

    Raises:
        SweepError: no solved plan is kept, they are of robots with other coordinates, or pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise SweepError("found no package 'pyarrow', expected it: pip install 'fesd-robot[sweep]'") from error
    kept = [row for row in table.rows() if row["verdict"] == Verdict.SOLVED and row["plan"]]
    rows = sorted(kept, key=lambda row: row["number"])
    if not rows:
        raise SweepError(f"{table.folder}: holds no solved plan that is kept, expected some for a data set")
    file = table.folder / DATA_FILE
    file.parent.mkdir(parents=True, exist_ok=True)
    part, writer, known = file.with_name(f"{file.name}.part"), None, 0
    names: list[str] = []
    try:
        for episode, row in enumerate(rows):
            plan = read_plan(table.folder / row["plan"])
            names = names or _names_of(plan)
            if _names_of(plan) != names:
                raise SweepError(
                    f"{table.folder}: found a plan of {', '.join(_names_of(plan))} in row {row['number']}, expected "
                    f"{', '.join(names)}, as in the first one: a data set is of one robot"
                )
            samples = pa.table(_samples(plan, rate, episode, known))
            writer = writer or pq.ParquetWriter(part, samples.schema)
            writer.write_table(samples)
            known += len(samples)
    finally:
        if writer:
            writer.close()
    os.replace(part, file)
    write_atomically(table.folder / INFO_FILE, _info(plan, rate, rows, known).encode())
    return table.folder / "dataset"


def _names_of(plan: Plan) -> list[str]:
    return [*plan.trajectory.configuration, *(name for name in plan.controls if name != "time")]


def _samples(plan: Plan, rate: float, episode: int, known: int) -> dict[str, Any]:
    """Return the columns of an episode; at an impact and where a control changes, the values after it."""
    end = float(plan.trajectory.time[-1])
    times = np.arange(int(end * rate * (1 + 1e-12)) + 1) / rate
    sides: list[Side] = ["after" for _ in times]
    sides[-1] = "before"
    motion = plan.at(np.minimum(times, end), sides)
    states = np.column_stack([*motion.configuration.values(), *motion.velocity.values()])
    actions = np.column_stack(list(motion.controls.values()))
    count = len(times)
    return {
        "observation.state": list(states.astype(np.float32)),
        "action": list(actions.astype(np.float32)),
        "timestamp": times.astype(np.float32),
        "frame_index": np.arange(count),
        "episode_index": np.full(count, episode),
        "index": known + np.arange(count),
        "task_index": np.zeros(count, dtype=np.int64),
        "next.done": np.arange(count) == count - 1,
    }


def _info(plan: Plan, rate: float, rows: list[dict[str, Any]], frames: int) -> str:
    """Return what is in the data set, as JSON."""
    states = [*plan.trajectory.configuration, *(f"{name} velocity" for name in plan.trajectory.velocity)]
    actions = [name for name in plan.controls if name != "time"]

    def feature(kind: str, names: list[str] | None = None) -> dict[str, Any]:
        return {"dtype": kind, "shape": [len(names) if names else 1], "names": names}

    integers = ("frame_index", "episode_index", "index", "task_index")
    told = {
        "codebase_version": "v2.1",
        "robot_type": plan.name,
        "fps": rate,
        "total_episodes": len(rows),
        "total_frames": frames,
        "total_tasks": 1,
        "data_path": DATA_FILE.removeprefix("dataset/"),
        "features": {
            "observation.state": feature("float32", states),
            "action": feature("float32", actions),
            "timestamp": feature("float32"),
            **{name: feature("int64") for name in integers},
            "next.done": feature("bool"),
        },
        "rows_of_episodes": [row["number"] for row in rows],
    }
    return json.dumps(told, indent=1) + "\n"
