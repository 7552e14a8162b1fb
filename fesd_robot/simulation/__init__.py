"""Simulating robots through contact: what a motion with given controls leads to, event by event."""

from __future__ import annotations

from fesd_robot.simulation.dispatch import simulate
from fesd_robot.simulation.simulate import simulate_robot

__all__ = ["simulate", "simulate_robot"]
