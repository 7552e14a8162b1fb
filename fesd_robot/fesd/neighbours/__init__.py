"""Neighbours of an exact trajectory: branches that differ from its own by one decision about one contact."""

from fesd_robot.fesd.neighbours.grid import on_grid
from fesd_robot.fesd.neighbours.known_trajectory import CLOCK, KnownTrajectory
from fesd_robot.fesd.neighbours.mode_shifts import ModeShift, mode_shifts
from fesd_robot.fesd.neighbours.moves import Move, moves
from fesd_robot.fesd.neighbours.patterns import intervals_of
from fesd_robot.fesd.neighbours.pivots import Pivots
from fesd_robot.fesd.neighbours.room import filled, with_counts, with_room, without_room

__all__ = [
    "CLOCK",
    "KnownTrajectory",
    "ModeShift",
    "Move",
    "Pivots",
    "filled",
    "intervals_of",
    "mode_shifts",
    "moves",
    "on_grid",
    "with_counts",
    "with_room",
    "without_room",
]
