"""A run as one sees it: in MuJoCo's viewer, or as a video."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from fesd_robot.errors import FesdRobotError
from fesd_robot.in_mujoco.driving import RunRecord
from fesd_robot.in_mujoco.scene import MujocoScene
from fesd_robot.writing import write_atomically

FRAMES_A_SECOND = 25
"""Of a video; a GIF counts time in hundredths of a second."""

WIDTH, HEIGHT = 640, 480

CLOSE = 2.2
"""Distance of the camera, in the size of what the robot does."""

KINDS = {".gif": "GIF", ".webp": "WEBP"}
"""Ending of a video -> its kind."""


def write_video(scene: MujocoScene, record: RunRecord, file: Path | str) -> Path:
    """Write a run as a video in real time, drawn by MuJoCo.

    Args:
        scene: in which it ran, with its shapes, `mujoco_scene(motion, shapes=True)`.
        record: of the run.
        file: ends with ``.gif`` or ``.webp``.

    Returns:
        the file.

    Raises:
        FesdRobotError: another ending, a machine without a renderer, or a file that cannot be written.
    """
    path = Path(file)
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise FesdRobotError(f"{path}: found the ending '{path.suffix}', expected {' or '.join(KINDS)}")
    try:
        renderer = mujoco.Renderer(scene.model, HEIGHT, WIDTH)
    except Exception as error:  # every backend has its own
        raise FesdRobotError(
            f"no video is written: MuJoCo finds no renderer ({_words(error)}); on a machine without a display install "
            "EGL or OSMesa and set MUJOCO_GL=egl or osmesa"
        ) from error
    camera = _camera(scene, record)
    frames = []
    for data in _states(scene, record, 1 / FRAMES_A_SECOND):
        renderer.update_scene(data, camera)
        frames.append(Image.fromarray(renderer.render()))
    renderer.close()
    content = io.BytesIO()
    frames[0].save(
        content, kind, save_all=True, append_images=frames[1:], duration=round(1000 / FRAMES_A_SECOND), loop=0
    )
    try:
        return write_atomically(path, content.getvalue())
    except OSError as error:
        raise FesdRobotError(f"{path}: cannot be written ({error.strerror})") from error


def play(scene: MujocoScene, record: RunRecord) -> None:
    """Play a run in MuJoCo's viewer, in real time and again and again, until its window is closed.

    Args:
        scene: in which it ran, with its shapes, `mujoco_scene(motion, shapes=True)`.
        record: of the run.

    Raises:
        FesdRobotError: there is no display.
    """
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise FesdRobotError("no viewer is opened: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)")
    import mujoco.viewer

    own = mujoco.MjData(scene.model)
    try:
        window = mujoco.viewer.launch_passive(scene.model, own)
    except Exception as error:  # of the window system
        raise FesdRobotError(f"no viewer is opened: {_words(error)}") from error
    period = float(record.time[1] - record.time[0]) if len(record.time) > 1 else 1.0
    with window:
        while window.is_running():
            begin = time.perf_counter()
            for number, data in enumerate(_states(scene, record, period)):
                if not window.is_running():
                    break
                own.qpos[:], own.qvel[:] = data.qpos, data.qvel
                mujoco.mj_forward(scene.model, own)
                late = begin + number * period - time.perf_counter()
                if late > 0:
                    window.sync()
                    time.sleep(late)


def _states(scene: MujocoScene, record: RunRecord, period: float) -> Iterator[mujoco.MjData]:
    """Yield the states of a run, so many seconds from one to the next."""
    data = mujoco.MjData(scene.model)
    moments = np.arange(record.time[0], record.time[-1] + period / 2, period)
    for row in np.searchsorted(record.time, np.minimum(moments, record.time[-1])):
        data.qpos[:], data.qvel[:] = scene.coordinates.to_scene(record.configuration[row], record.velocity[row])
        mujoco.mj_forward(scene.model, data)
        yield data


def _camera(scene: MujocoScene, record: RunRecord) -> mujoco.MjvCamera:
    """Return a camera that sees all places where bodies are; what moves in the plane it sees from the side."""
    places = [data.xpos[1:].copy() for data in _states(scene, record, max(float(record.time[-1]) / 20, 1e-3))]
    low, high = np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (low + high) / 2
    camera.distance = CLOSE * max(float(np.linalg.norm(high - low)), 0.3)
    camera.azimuth, camera.elevation = (135.0, -20.0) if scene.motion.in_space else (90.0, -8.0)
    return camera


def _words(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__
