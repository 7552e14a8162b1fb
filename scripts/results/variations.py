"""Variations of the shipped tasks that no setting was made for: robot, ground, goal, weights, limits, grid, guess."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot import Task, load_task
from fesd_robot.ocp import formulate
from fesd_robot.task import FreeDuration

ROOT = Path(__file__).resolve().parents[2]

MANY, TEN, FEW = 12, 10, 4
"""Variations of a task, of the monopeds, and of other tasks that take minutes."""


@dataclass(frozen=True)
class Varied:
    """What can be varied in a task, beside what every task has.

    Attributes:
        coordinate: whose distance from start to goal is varied; None where the ground allows no other.
        end: which of them is moved.
        efforts: keys of limits of controls; by default those of `limits.effort`.
        count: number of variations.
    """

    coordinate: str | None
    end: str = "goal"
    efforts: tuple[str, ...] = ()
    count: int = MANY


VARIED = {
    "biped_step": Varied("root_x"),
    "block_push": Varied("root_x", efforts=("robot.actuators.push.upper",)),
    "cart_pole_friction": Varied("pole"),
    "double_pendulum_wall": Varied("shoulder", end="initial"),
    "hopper_downhill": Varied("root_x"),
    "hopper_five_jumps": Varied("root_x", count=FEW),
    "hopper_one_jump": Varied("root_x", efforts=("robot.actuators.leg_force.lower", "robot.actuators.leg_force.upper")),
    "hopper_stairs": Varied("root_x", count=FEW),
    "hopper_wedge": Varied("root_x"),
    "monoped_three_holes": Varied("root_x", count=TEN),
    "monoped_two_jumps": Varied("root_x", count=TEN),
    "published_hopper_five_jumps": Varied("root_x", count=FEW),
    "published_hopper_one_jump": Varied(
        "root_x", efforts=("robot.actuators.leg_force.lower", "robot.actuators.leg_force.upper")
    ),
    "pusher_slider": Varied("slider_x"),
    "solo12_jump": Varied("root_x"),
    "wheel_hills": Varied(None),
    "arm_push": Varied("box_x", count=FEW),
    "biped_walk": Varied(None, count=FEW),
    "solo12_bound": Varied(None, count=FEW),
    "block_slope": Varied(None, efforts=("robot.actuators.push.upper",), count=FEW),
    "puck_shot": Varied("slider_x", count=FEW),
    "gripper_lift": Varied("box_z", count=FEW),
    "hopper_in_space": Varied(
        "root_x", efforts=("robot.actuators.leg_force.lower", "robot.actuators.leg_force.upper"), count=FEW
    ),
    "pick_and_place": Varied("ball.root_joint.x", count=FEW),
}
"""Name of a task -> what is varied in it; new ones at the end, for their numbers seed the draws."""

KINDS = ("weight", "ground", "goal", "duration", "grid", "limits", "robot", "guess")
"""In the order in which the variations of a task take them."""


@dataclass(frozen=True)
class Variation:
    """A changed task.

    Attributes:
        name: of the shipped task.
        seed: of the variation.
        what: is changed, in words.
        overrides: keys of the task and their values.
        other_guess: only the initial guess is another one, so that the motions are those of the task.
        wider: the task has no motion that the variation forbids, and both cost the same.
    """

    name: str
    seed: int
    what: str
    overrides: tuple[str, ...] = ()
    other_guess: bool = False
    wider: bool = False

    def task(self, *further: str) -> Task:
        """Return the task.

        Args:
            further: overrides beside the variation's own.
        """
        return load_task(ROOT / "tasks" / f"{self.name}.yaml", [*self.overrides, *further])


def variations() -> list[Variation]:
    """Return all variations of all tasks; the same every time."""
    found = []
    for number, (name, varied) in enumerate(VARIED.items()):
        task = load_task(ROOT / "tasks" / f"{name}.yaml")
        impossible = {"robot"} if ":" in task.robot.model else set()
        impossible |= set() if varied.coordinate else {"goal"}
        impossible |= set() if _weighed(task) else {"weight"}
        kinds = [kind for kind in KINDS if kind not in impossible]
        for seed in range(varied.count):
            draw = np.random.default_rng([number, seed])
            kind = kinds[(seed + 2 * number) % len(kinds)]  # those with few get different ones
            found.append(_variation(name, seed, task, varied, kind, draw))
    return found


def _variation(name: str, seed: int, task: Task, varied: Varied, kind: str, draw: np.random.Generator) -> Variation:
    """Return one variation of a kind."""
    if kind == "weight":
        term, factor = str(draw.choice(_weighed(task))), round(float(10 ** draw.uniform(-1, 1)), 3)
        weights = getattr(task.costs, term)
        keys = tuple(f"costs.{term}.{key}={factor * weight:.6g}" for key, weight in weights.items())
        return Variation(name, seed, f"weights of {term} x {factor:g}", keys)
    if kind == "guess":
        return Variation(name, seed, f"initial guess {seed + 1}", (f"solver.seed={seed + 1}",), other_guess=True)
    if kind == "robot":
        factor = round(float(draw.uniform(0.8, 1.2)), 3)
        return Variation(name, seed, f"masses x {factor:g}", (f"robot.scale.mass={factor}",))
    if kind == "goal":
        fixed, moved = (task.initial, task.goal) if varied.end == "goal" else (task.goal, task.initial)
        assert varied.coordinate
        start, end = (part.configuration.get(varied.coordinate, 0.0) for part in (fixed, moved))
        value = round(start + float(draw.uniform(0.8, 1.15)) * (end - start), 4)
        what, key = f"{varied.end} {varied.coordinate} = {value:g}", f"{varied.end}.configuration.{varied.coordinate}"
        return Variation(name, seed, what, (f"{key}={value}",))
    if kind == "limits":
        return _other_limits(name, seed, task, varied, round(float(draw.uniform(0.85, 1.5)), 3))
    if kind == "ground":
        value = round(task.ground.friction * float(draw.uniform(0.75, 1.4)), 3)
        return Variation(name, seed, f"friction {value:g}", (f"ground.friction={value}",))
    duration, intervals = task.horizon.duration, task.horizon.intervals
    assert not isinstance(duration, FreeDuration)
    if kind == "duration":
        duration = round(duration * float(draw.uniform(0.85, 1.25)), 3)
        return Variation(name, seed, f"duration {duration:g} s", _other_grid(task, duration, intervals))
    intervals = round(intervals * float(draw.choice([draw.uniform(0.6, 0.9), draw.uniform(1.1, 1.6)])))
    return Variation(name, seed, f"{intervals} intervals", _other_grid(task, duration, intervals))


def _weighed(task: Task) -> list[str]:
    """Return the terms of the cost that have weights by name."""
    return [term for term in ("configuration", "velocity", "control") if getattr(task.costs, term)]


def _other_grid(task: Task, duration: float, intervals: int) -> tuple[str, ...]:
    """Return the keys of another grid, with waypoints at the nearest ends of intervals."""
    points = [point.model_dump(mode="json", exclude_unset=True) for point in task.waypoints]
    for point in points:
        if "time" in point:
            k = round(point["time"] / task.horizon.duration * intervals)
            point["time"] = k * duration / intervals
    keys = (f"horizon.duration={duration}", f"horizon.intervals={intervals}")
    return (*keys, f"waypoints={json.dumps(points)}") if any("time" in point for point in points) else keys


def _other_limits(name: str, seed: int, task: Task, varied: Varied, factor: float) -> Variation:
    """Return the variation in which all controls have other limits."""
    if varied.efforts:
        keys = tuple(f"{key}={factor * _at(task, key):.6g}" for key in varied.efforts)
    else:
        limits = _efforts(task).items()
        keys = tuple(
            f"limits.effort.{joint}=[{factor * low:.6g}, {factor * high:.6g}]" for joint, (low, high) in limits
        )
    return Variation(name, seed, f"limits of controls x {factor:g}", keys, wider=factor >= 1)


def _efforts(task: Task) -> dict[str, tuple[float, float]]:
    """Return the limits of the controls of a task's joints, its own or those of its model."""
    if task.limits.effort:
        return dict(task.limits.effort)
    robot = formulate(task).robot
    limits = zip(robot.velocity_names, robot.lower_effort, robot.upper_effort, robot.driven, strict=True)
    return {name: (float(low), float(high)) for name, low, high, driven in limits if driven}


def _at(task: Task, key: str) -> float:
    """Return the number at a key of a task."""
    value: Any = task
    for part in key.split("."):
        value = value[part] if isinstance(value, dict) else getattr(value, part)
    return float(value)
