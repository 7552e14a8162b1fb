"""Pushes and moved goals as they are written on a command line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fesd_robot.errors import OptionError, number_hint

if TYPE_CHECKING:
    from fesd_robot.in_mujoco import Push
    from fesd_robot.replanning import MovedGoal


def push_of(text: str) -> Push:
    """Return the push that a text is, ``TIME:VX,VZ`` or ``TIME:VX,VY,VZ``, s and m/s.

    Raises:
        OptionError: another text.
    """
    from fesd_robot.in_mujoco import Push

    form = "TIME:VX,VZ or TIME:VX,VY,VZ in s and m/s, as 0.3:0.2,0"
    time, colon, velocity = text.partition(":")
    parts = velocity.split(",")
    if not colon or len(parts) not in (2, 3):
        raise OptionError(f"--push: found '{text}', expected {form}")
    x, *y, z = (_number("--push", text, part, form) for part in parts)
    return Push(_number("--push", text, time, form), (x, *(y or [0.0]), z))


def moved_goal_of(text: str) -> MovedGoal:
    """Return the moved goal that a text is, ``TIME:NAME=VALUE``, s and m or rad.

    Raises:
        OptionError: another text.
    """
    from fesd_robot.replanning import MovedGoal

    form = "TIME:NAME=VALUE in s and m or rad, as 0.3:root_x=1.1"
    time, colon, rest = text.partition(":")
    name, equals, value = rest.partition("=")
    if not colon or not equals or not name.strip():
        raise OptionError(f"--goal: found '{text}', expected {form}")
    return MovedGoal(_number("--goal", text, time, form), name.strip(), _number("--goal", text, value, form))


def _number(option: str, text: str, part: str, form: str) -> float:
    try:
        value = float(part)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise OptionError(f"{option}: found '{part}' in '{text}', expected a number{number_hint(part)}: {form}")
    return value
