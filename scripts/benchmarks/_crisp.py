"""CRISP's cart transport, pushed box and pushed T as its files pose them, in its own steps, with all instances.

Source: github.com/ComputationalRobotics/CRISP at 9199a78, src/examples/{Transp,pushbox,pushT}; equations and weights
are written here anew. The transport has the 27 instances of its baseline LCQPow, the box the 18 of its file.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import casadi as ca
import numpy as np

from fesd_robot.plans import Plan
from scripts.benchmarks._peer_problems import Cargo, Problem, box_sides, planned_slider, planned_t, pushed_box, pushed_t

CART = Cargo(cargo=1.0, cart=2.0, ahead=0.02)

BOX = (0.5, 0.25)
"""Half of width and height, m."""

INSTANCES = {
    f"crisp_transport, {first:g} to {last:g} m, {before:g} to {after:g} m/s": (
        (3.0 + first, 3.0, float(before), float(before)),
        (float(last), 0.0, float(after), float(after)),
    )
    for before, after in ((0, 0), (-3, 0), (-4, -2))
    for first in (0, -0.5, 0.5)
    for last in (0, -0.5, 0.5)
}
"""Case -> start and goal of the transport: x1, x2, v1 and v2, m and m/s."""

GOALS = {
    f"crisp_push_box, {degrees} degrees": (3 * float(np.cos(angle)), 3 * float(np.sin(angle)), float(angle))
    for degrees, angle in ((degrees, np.radians(degrees)) for degrees in range(0, 360, 20))
}
"""Case -> goal of the box: x, y and angle, m and rad."""


def _turned(state: ca.SX, goal: ca.DM) -> ca.SX:
    """Return the distance from a goal: of angles that of their cosines and of their sines."""
    turn = ca.vertcat(ca.cos(state[2]) - ca.cos(goal[2]), ca.sin(state[2]) - ca.sin(goal[2]))
    return ca.vertcat(state[:2] - goal[:2], turn)


PROBLEMS: Mapping[str, Problem] = {
    **{
        case: Problem(
            program="crisp_transport",
            words=[repr(number) for number in (*start, *goal)],
            stage=CART.stage,
            start=start,
            goal=goal,
            step=0.02,
            weights=(1e-4, 1e-4, 0, 0),
            last=(1e5, 1e5, 10, 10),
            guess=np.zeros((200, 4)),
            ends=CART.ends,
            planned=CART.planned,
        )
        for case, (start, goal) in INSTANCES.items()
    },
    **{
        case: Problem(
            program="crisp_push_box",
            words=[repr(number) for number in goal],
            stage=pushed_box(*BOX, 4.9, 4.9 * 0.4 * float(np.hypot(*BOX))),
            start=(0, 0, 0),
            goal=goal,
            step=0.02,
            weights=(0, 0, 1e-3, 1e-3, 1e-3, 1e-3),
            last=(100, 100, 100),
            guess=np.zeros((100, 3)),
            planned=partial(planned_slider, box_sides(*BOX)),
        )
        for case, goal in GOALS.items()
    },
    "crisp_push_t": Problem(
        program="crisp_push_t",
        words=[],
        stage=pushed_t(1.0),
        start=(0.24722, 0.0141359, -2.95844),
        goal=(0.036, -0.143, -2.637),
        step=0.05,
        weights=[0.0] * 2 + [0.01] * 8 + [0.0] * 14,
        last=[100] * 4,
        tracking=1.0,
        distance=_turned,
        guess=np.zeros((50, 3)),
        planned=planned_t,
    ),
}


def problem_of(plan: Plan) -> Problem | None:
    """Return the problem of which a plan is, if any: the instance with its start and goal."""
    goal, before = plan.task["goal"], plan.task["initial"]
    if plan.name == "crisp_transport":
        first, last = before["configuration"]["cargo"], goal["frames"]["cargo"]["position"][0]
        speeds = f"{before['velocity'].get('cart', 0):g} to {goal['velocity']['cart']:g} m/s"
        return PROBLEMS[f"{plan.name}, {first:g} to {last:g} m, {speeds}"]
    if plan.name == "crisp_push_box":
        return PROBLEMS[f"{plan.name}, {-np.degrees(goal['configuration']['root_pitch']):.0f} degrees"]
    return PROBLEMS.get(plan.name)
