"""Simulating robots through contact: what a motion with given controls leads to, event by event."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "ControlSchedule",
    "Hit",
    "Piece",
    "SimulatedMotion",
    "simulate",
    "simulate_robot",
]

if TYPE_CHECKING:
    from fesd_robot.simulation.dispatch import simulate
    from fesd_robot.simulation.drive import Hit, Piece, SimulatedMotion
    from fesd_robot.simulation.of_robot import simulate_robot
    from fesd_robot.simulation.schedule import ControlSchedule
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.simulation.dispatch": ["simulate"],
            "fesd_robot.simulation.drive": ["Hit", "Piece", "SimulatedMotion"],
            "fesd_robot.simulation.schedule": ["ControlSchedule"],
            "fesd_robot.simulation.of_robot": ["simulate_robot"],
        },
    )
