"""Forces that act on a robot beside its controls and contacts, in words."""

from __future__ import annotations

import numpy as np

from fesd_robot.robot import STANDARD_GRAVITY, Robot
from fesd_robot.task import listed


def described_forces(robot: Robot) -> list[str]:
    """Return what gravity is where it is not the usual one, and damping, springs and dry friction where there are some.

    Args:
        robot: with what the task says about it.
    """
    damping = {name: d for name, d in zip(robot.velocity_names, robot.model.damping, strict=True) if d > 0}
    springs = [f"{robot.velocity_names[v]} {stiffness:g} from {rest:g}" for v, _, stiffness, rest in robot.springs]
    return [
        *_gravity(robot.model.gravity.linear),
        *([f"Damping: {listed(damping)} (N s/m or N m s/rad)."] if damping else []),
        *([f"Springs: {', '.join(springs)} (N/m from m, or N m/rad from rad)."] if springs else []),
        *([f"Dry friction: {listed(robot.dry_friction)} (N or N m)."] if robot.dry_friction else []),
    ]


def _gravity(gravity: np.ndarray) -> list[str]:
    if np.array_equal(gravity, [0.0, 0.0, -STANDARD_GRAVITY]):
        return []
    if not np.any(gravity):
        return ["Gravity: none."]
    return [f"Gravity: [{', '.join(f'{part:g}' for part in gravity)}] m/s2 along x, y and z."]
