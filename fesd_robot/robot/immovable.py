"""Joints that cannot move, because a limit holds them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fesd_robot.robot.robot import Robot


def immovable_joints(
    robot: Robot, positions: tuple[np.ndarray, np.ndarray], velocities: tuple[np.ndarray, np.ndarray]
) -> Iterator[str]:
    """Yield a sentence about the coordinates that a limit holds where they are, with the key that frees them.

    Args:
        positions: lower and upper limits of q, m or rad, (n_q) each.
        velocities: the same of v, m/s or rad/s, (n_v) each.
    """
    still = _held(robot.velocity_names, velocities)
    if still:
        undriven = [name for name, width in _efforts(robot) if name in still and width == 0]
        effort = ""
        if undriven:
            effort = f"; {_quoted(undriven)} {_have(undriven)} an effort limit of 0, too, which limits.effort replaces"
        yield (
            f"The velocity limit of {_quoted(still)} is 0, so that {_it(still)} cannot move; limits.velocity gives "
            f"{'them others' if len(still) > 1 else 'it another'}{effort}."
        )
    for name, lower, upper in zip(robot.configuration_names, *positions, strict=True):
        if lower == upper:
            yield (
                f"'{name}' cannot move: its limits are [{lower:g}, {upper:g}]; limits.position.{name} gives it others."
            )


def _held(names: Sequence[str], limits: tuple[np.ndarray, np.ndarray]) -> list[str]:
    return [name for name, lower, upper in zip(names, *limits, strict=True) if lower == upper]


def _efforts(robot: Robot) -> Iterator[tuple[str, float]]:
    widths = robot.upper_effort - robot.lower_effort
    return zip(robot.velocity_names, widths.tolist(), strict=True)


def _quoted(names: Sequence[str]) -> str:
    *first, last = [f"'{name}'" for name in names]
    return f"{', '.join(first)} and {last}" if first else last


def _it(names: Sequence[str]) -> str:
    return "they" if len(names) > 1 else "it"


def _have(names: Sequence[str]) -> str:
    return "have" if len(names) > 1 else "has"
