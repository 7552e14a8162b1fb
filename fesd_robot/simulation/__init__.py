"""Simulating robots through contact: what a motion with given controls leads to, event by event."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "Drive",
    "Hit",
    "Piece",
    "Schedule",
    "simulate",
    "simulate_robot",
]

if TYPE_CHECKING:
    from fesd_robot.simulation.dispatch import simulate
    from fesd_robot.simulation.drive import Drive, Hit, Piece
    from fesd_robot.simulation.of_robot import simulate_robot
    from fesd_robot.simulation.schedule import Schedule
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.simulation.dispatch": ["simulate"],
            "fesd_robot.simulation.drive": ["Drive", "Hit", "Piece"],
            "fesd_robot.simulation.schedule": ["Schedule"],
            "fesd_robot.simulation.of_robot": ["simulate_robot"],
        },
    )
