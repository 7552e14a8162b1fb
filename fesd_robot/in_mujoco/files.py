"""The files of a replay."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fesd_robot.errors import PlanFileError
from fesd_robot.in_mujoco.figure import errors_image
from fesd_robot.in_mujoco.replays import Replay, ReplayRun
from fesd_robot.in_mujoco.report import report, table
from fesd_robot.render import PageContent, render_page
from fesd_robot.render.outputs import circle_visuals, ground_visual
from fesd_robot.render.page import Ghost
from fesd_robot.render.verdict import Verdict
from fesd_robot.writing import write_atomically

REPLAY_FILE, REPORT_FILE, FIGURE_FILE, SCENE_FILE = "replay.json", "replay.md", "errors.png", "scene.xml"

PAGE_FILE = "replay_{}.html"

FRAMES = 200
"""Samples a second of the page."""


def write_replay(replay: Replay, folder: Path | str) -> list[Path]:
    """Write a replay into a folder: numbers, report, figure, scene, and a page for every controller.

    Args:
        replay: of a plan.
        folder: where the files go; created if it is missing, earlier ones in it are replaced.

    Returns:
        the files.

    Raises:
        PlanFileError: the folder cannot be written to.
        RobotError: the shapes of the robot cannot be read.
    """
    folder = Path(folder)
    entries = [each.entry() for each in replay.runs]
    try:
        return [
            write_atomically(folder / REPLAY_FILE, (json.dumps(_plain(entries), indent=1) + "\n").encode()),
            write_atomically(folder / REPORT_FILE, report(replay, FIGURE_FILE).encode()),
            write_atomically(folder / FIGURE_FILE, errors_image(replay)),
            write_atomically(folder / SCENE_FILE, replay.scene.xml().encode()),
            *(_write_page(replay, each, folder / PAGE_FILE.format(each.controller)) for each in replay.runs),
        ]
    except OSError as error:
        raise PlanFileError(f"{folder}: cannot be written to ({error.strerror})") from error


def _plain(entries: object) -> object:
    """Return numbers that are not finite as None, which JSON has."""
    if isinstance(entries, dict):
        return {key: _plain(value) for key, value in entries.items()}
    if isinstance(entries, list | tuple):
        return [_plain(value) for value in entries]
    return None if isinstance(entries, float) and not np.isfinite(entries) else entries


def _write_page(replay: Replay, own: ReplayRun, path: Path) -> Path:
    """Write the page that plays a run, with the plan as a ghost beside it."""
    motion, plan, record = replay.scene.motion, replay.plan, own.record
    robot, trajectory = motion.robot, plan.trajectory
    shown = _shown(record.time)
    planned = np.column_stack([trajectory.configuration[name] for name in robot.configuration_names])
    clock = np.maximum.accumulate(trajectory.time) - trajectory.time[0]
    entry = own.entry()
    words = "finished" if entry["finished"] else "did not finish"
    content = PageContent(
        title=f"{plan.name} in MuJoCo",
        subtitle="",
        verdict=Verdict(entry["finished"], f"With {own.controller}, the run {words}.", words),
        facts=_facts(own),
        model=robot.model,
        visual_model=robot.visual_model,
        time=record.time[shown],
        configuration=record.configuration[shown],
        ground=ground_visual(motion.task),
        traces={},
        circles=circle_visuals(motion.task, robot),
        planar=not motion.in_space,
        ghost=Ghost("the plan", robot.model, robot.visual_model, clock, planned),
    )
    return render_page(path, content)


def _shown(time: np.ndarray) -> Sequence[int]:
    """Return the samples of a page: so many a second, and the last one."""
    step = max(round(1 / (FRAMES * (time[1] - time[0]))), 1) if len(time) > 1 else 1
    return sorted({*range(0, len(time), step), len(time) - 1})


def _facts(own: ReplayRun) -> list[tuple[str, str]]:
    names, values = ([cell.strip() for cell in row.strip("|").split("|")] for row in (table([own])[0], table([own])[2]))
    return [(name, value.strip("*")) for name, value in zip(names[2:], values[2:], strict=True) if value != "–"]
