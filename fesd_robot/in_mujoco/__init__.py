"""Plans in MuJoCo: the scene of a task, runs in it with controllers, and how far they are from the plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "CONTROLLERS",
    "RUNS",
    "Controller",
    "Deviation",
    "Disturbance",
    "MujocoScene",
    "Noise",
    "OpenLoop",
    "Perturbation",
    "Push",
    "Replanned",
    "Replanning",
    "Replay",
    "ReplayRun",
    "RunRecord",
    "mujoco_scene",
    "perturbations",
    "play",
    "replay",
    "run",
    "scene_file",
    "sliding_contacts",
    "write_replay",
    "write_video",
]

if TYPE_CHECKING:
    from fesd_robot.in_mujoco.controllers import CONTROLLERS, RUNS, Replanning
    from fesd_robot.in_mujoco.driving import Controller, Disturbance, Noise, OpenLoop, Push, RunRecord, run
    from fesd_robot.in_mujoco.files import write_replay
    from fesd_robot.in_mujoco.measures import Deviation
    from fesd_robot.in_mujoco.perturbed import Perturbation, perturbations
    from fesd_robot.in_mujoco.pictures import play, write_video
    from fesd_robot.in_mujoco.replanned import Replanned
    from fesd_robot.in_mujoco.replays import Replay, ReplayRun, replay
    from fesd_robot.in_mujoco.scene import MujocoScene, mujoco_scene, scene_file, sliding_contacts
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.in_mujoco.controllers": ["CONTROLLERS", "RUNS", "Replanning"],
            "fesd_robot.in_mujoco.files": ["write_replay"],
            "fesd_robot.in_mujoco.measures": ["Deviation"],
            "fesd_robot.in_mujoco.perturbed": ["Perturbation", "perturbations"],
            "fesd_robot.in_mujoco.pictures": ["play", "write_video"],
            "fesd_robot.in_mujoco.replanned": ["Replanned"],
            "fesd_robot.in_mujoco.replays": ["Replay", "ReplayRun", "replay"],
            "fesd_robot.in_mujoco.driving": [
                "Controller",
                "Disturbance",
                "Noise",
                "OpenLoop",
                "Push",
                "RunRecord",
                "run",
            ],
            "fesd_robot.in_mujoco.scene": ["MujocoScene", "mujoco_scene", "scene_file", "sliding_contacts"],
        },
    )
