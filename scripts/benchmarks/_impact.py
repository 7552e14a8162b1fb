"""The planar problems of IMPACT as its files pose them, in its own steps: explicit Euler, with all of its pairs.

Source: github.com/JonasPflaume/IMPACT at f56f140, experiments/{cart_transporter,box,push_t,push_circle}; equations and
weights are written here anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from scripts.benchmarks._peer_problems import (
    Cargo,
    Motion,
    Problem,
    Stage,
    box_sides,
    planned_slider,
    planned_t,
    pushed_box,
    pushed_t,
)

CART = Cargo(cargo=0.1, cart=0.2)

BOX = (0.3, 0.4)
"""Half of width and height, m."""

RADIUS, DRAG = 0.3, 0.1 * 9.81
"""Of the disk, m, and its friction on the table by its velocity, N s/m."""


def _disk(x: ca.SX, u: ca.SX) -> Stage:
    """A disk and a point that pushes it; u is normal and tangential force, and the velocity of the point."""
    friction, arm = 0.1, x[2:] - x[:2]
    distance = ca.sqrt(ca.sumsqr(arm) + 1e-9)
    normal, tangential = u[0], u[1]
    force = (-normal * arm + tangential * ca.vertcat(-arm[1], arm[0])) / distance
    cone = ca.vertcat(friction * normal - tangential, friction * normal + tangential)
    return Stage(ca.vertcat(force / DRAG, u[2:]), normal, distance - RADIUS, positive=cone)


def _planned_disk(times: np.ndarray, plan: Plan) -> Motion:
    """The finger of the task has a radius, by which the point that pushes is nearer to the disk."""
    at = plan.at(np.minimum(times, plan.trajectory.time[-1])).configuration
    disk, tip = (np.column_stack([at[f"{of}_x"], at[f"{of}_z"]]) for of in ("disk.root", "tip"))
    outwards = tip - disk
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    states = np.hstack([disk, tip - plan.task["contacts"]["push"]["radius"] * outwards])
    rates, (x, y) = np.diff(states, axis=0) / np.diff(times)[:, None], outwards[:-1].T
    force = DRAG * rates[:, :2]
    normal = np.maximum(-(force[:, 0] * x + force[:, 1] * y), 0)
    return states, np.column_stack([normal, force[:, 1] * x - force[:, 0] * y, rates[:, 2:]])


_AWAY = 1.5 * np.cos(np.radians(225))
_BEHIND = _AWAY - RADIUS * np.cos(np.radians(225))


def _line(start: tuple[float, ...], goal: tuple[float, ...], steps: int) -> np.ndarray:
    """Return states on the straight line between two."""
    return np.linspace(start, goal, steps + 1)


def _standing(start: tuple[float, ...], steps: int) -> np.ndarray:
    """Return the same state at all steps."""
    return np.tile(np.array(start, float), (steps + 1, 1))


_CART = Problem(
    program="cart_transporter/cart_transporter_impact_multiple",
    words=["0", "0", "0", "0", "1", "0", "0", "0"],
    stage=CART.stage,
    start=(0, 0, 0, 0),
    goal=(1, 0, 0, 0),
    step=0.02,
    weights=[1e-6] * 4,
    last=[5000] * 4,
    guess=_standing((0, 0, 0, 0), 300),
    planned=CART.planned,
)

PROBLEMS: Mapping[str, Problem] = {
    "impact_cart": _CART,
    "impact_cart, both a metre on": replace(_CART, words=["0", "0", "0", "0", "1", "1", "0", "0"], goal=(1, 1, 0, 0)),
    "impact_box": Problem(
        program="box/box_impact_multiple",
        words=["0", "0", "0", "0.1", "0.1", "1.0"],
        stage=pushed_box(*BOX, 0.5 * 0.1 * 9.81, 0.5 * 0.1 * 9.81 * 0.5 * float(np.hypot(*BOX))),
        start=(0, 0, 0),
        goal=(0.1, 0.1, 1),
        step=0.05,
        weights=[1e-3] * 6,
        last=[100] * 3,
        guess=_line((0, 0, 0), (0.1, 0.1, 1), 50),
        planned=partial(planned_slider, box_sides(*BOX)),
    ),
    "impact_disk": Problem(
        program="push_circle/push_circle_impact_multiple",
        words=["1.5", "225", "120"],
        stage=_disk,
        start=(0, 0, _AWAY, _AWAY),
        goal=(_AWAY, _AWAY, _BEHIND, _BEHIND),
        step=0.05,
        weights=[1e-2] * 4,
        last=[100] * 4,
        guess=_standing((0, 0, _AWAY, _AWAY), 120),
        planned=_planned_disk,
    ),
    "impact_push_t": Problem(
        program="push_t/push_t_impact_multiple",
        words=["0", "0", "0", "0.05", "0.05", "1.5708"],
        stage=pushed_t(0.1),
        start=(0, 0, 0),
        goal=(0.05, 0.05, 1.5708),
        step=0.05,
        weights=[1e-2] * 24,
        last=[100] * 3,
        guess=_line((0, 0, 0), (0.05, 0.05, 1.5708), 50),
        planned=planned_t,
    ),
}


def problem_of(plan: Plan) -> Problem | None:
    """Return the problem of which a plan is, if any."""
    moved = plan.name == "impact_cart" and plan.task["goal"]["configuration"]["cart"] > 0
    return PROBLEMS.get(plan.name + ", both a metre on" * moved)
