"""The files of a replay."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import coal
import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.errors import PlanFileError
from fesd_robot.in_mujoco.figure import errors_image
from fesd_robot.in_mujoco.replays import Replay, ReplayRun
from fesd_robot.in_mujoco.report import pushes_in_words, replanning_in_words, report, table
from fesd_robot.in_mujoco.scene import MujocoScene
from fesd_robot.render import PageContent, render_page
from fesd_robot.render.marks import Mark
from fesd_robot.render.outputs import circle_visuals, ground_visual
from fesd_robot.render.page import Ghost
from fesd_robot.render.palette import VERMILION
from fesd_robot.render.verdict import Verdict
from fesd_robot.writing import write_atomically

REPLAY_FILE, REPORT_FILE, FIGURE_FILE, SCENE_FILE = "replay.json", "replay.md", "errors.png", "scene.xml"

PAGE_FILE = "replay_{}.html"

FRAMES = 200
"""Samples a second of the page."""

BAR_LENGTH, BAR_RADIUS = 0.5, 0.006
"""Of the bar of a push: length for 1 m/s, and radius, m."""


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
        marks=_pushes(replay.scene, own),
    )
    return render_page(path, content)


def _shown(time: np.ndarray) -> Sequence[int]:
    """Return the samples of a page: so many a second, and the last one."""
    step = max(round(1 / (FRAMES * (time[1] - time[0]))), 1) if len(time) > 1 else 1
    return sorted({*range(0, len(time), step), len(time) - 1})


def _pushes(scene: MujocoScene, own: ReplayRun) -> list[Mark]:
    """Return a bar that ends at the pushed body for every push, where the robot is then."""
    record, data, result = own.record, mujoco.MjData(scene.model), []
    for each in own.different.disturbance.pushes:
        size = float(np.linalg.norm(each.velocity))
        if size == 0.0:
            continue
        row = min(int(np.searchsorted(record.time, each.time)), len(record.time) - 1)
        data.qpos[:], data.qvel[:] = scene.coordinates.to_scene(record.configuration[row], record.velocity[row])
        mujoco.mj_kinematics(scene.model, data)
        along, length = np.asarray(each.velocity) / size, BAR_LENGTH * size
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along).matrix()
        middle = data.xpos[scene.first_body] - 0.5 * length * along
        shape = coal.Cylinder(BAR_RADIUS, length)
        (words,) = pushes_in_words([each])
        result.append(Mark("pushes", words, pin.SE3(turn, middle), shape, VERMILION, 0.9))
    return result


def _facts(own: ReplayRun) -> list[tuple[str, str]]:
    names, values = ([cell.strip() for cell in row.strip("|").split("|")] for row in (table([own])[0], table([own])[2]))
    facts = [(name, value.strip("*")) for name, value in zip(names[2:], values[2:], strict=True) if value != "–"]
    pushes = pushes_in_words(own.different.disturbance.pushes)
    facts += [("pushes", "; ".join(pushes))] if pushes else []
    return [*facts, ("replanning", replanning_in_words(own.replanned))] if own.replanned else facts
