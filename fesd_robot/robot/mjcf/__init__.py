"""Reading MuJoCo files, by MuJoCo's own compiler."""

from __future__ import annotations

from fesd_robot.robot.mjcf.read import read_mjcf

__all__ = ["read_mjcf"]
