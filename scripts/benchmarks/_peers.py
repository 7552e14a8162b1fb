"""What problems of peers take from plans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.plans import Plan


@dataclass(frozen=True)
class Push:
    """A force, N, at a side of a slider: its arm and the least and the largest there, m, and its direction."""

    side: str
    force: float
    arm: float
    arms: tuple[float, float]
    direction: tuple[float, ...]


def push_at(plan: Plan, time: float) -> Push:
    """Return what a plan pushes a slider with at a time, s."""
    k = int(np.searchsorted(plan.controls["time"], time, side="right")) - 1
    (sets,), actuators = plan.task["robot"]["one_at_a_time"].values(), plan.task["robot"]["actuators"]
    found = []
    for side, names in sets.items():
        forces = [plan.controls[name][k] for name in names]
        arms = [-actuators[name]["force"]["root_pitch"] for name in names]
        total = sum(forces)
        arm = float(np.dot(forces, arms)) / total if total else float(np.mean(arms))
        words = [actuators[names[0]]["force"][name] for name in ("root_x", "root_z")]
        direction = tuple(0.0 if "sin" in word else -1.0 if word.startswith("-") else 1.0 for word in words)
        found.append(Push(side, float(total), arm, (min(arms), max(arms)), direction))
    return max(found, key=lambda push: push.force)


def slider_states(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Return x, y and angle of a slider, m and rad, (n, 3)."""
    at = plan.at(np.minimum(times, plan.trajectory.time[-1])).configuration
    return np.column_stack([at["root_x"], at["root_z"], -np.asarray(at["root_pitch"])])


def cargo_states(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Return places and velocities of cargo and cart, m and m/s, (n, 4)."""
    at = plan.at(np.minimum(times, plan.trajectory.time[-1]))
    (cart, cargo), (speed, slide) = (
        [np.asarray(of[name]) for name in ("cart", "cargo")] for of in (at.configuration, at.velocity)
    )
    return np.column_stack([cart + cargo, cart, speed + slide, speed])
