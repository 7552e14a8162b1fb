"""The linearised equations of motion against differences of Pinocchio's own algorithms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import expm

from fesd_robot.contact import ContactMode
from fesd_robot.ocp import MotionProblem, formulate, numeric_physics
from fesd_robot.recovery import NumericPhysics
from fesd_robot.replay import contact_dynamics, motion_in_modes
from fesd_robot.task import load_task
from fesd_robot.tracking import ContactState, ModeDynamics

FLIGHT, STICK, SLIP = ContactMode.FLIGHT, ContactMode.STICK, ContactMode.SLIP_FORWARDS

STEPS = 10
"""Of the midpoint rule in 2 ms."""

CASES = {
    "hopper_one_jump": [[FLIGHT], [STICK], [SLIP]],
    "hopper_in_space": [[FLIGHT], [STICK], [SLIP]],
    "solo12_jump": [[FLIGHT, FLIGHT], [STICK, STICK], [SLIP, STICK]],
    "solo12_jump_in_space": [[FLIGHT] * 4, [STICK] * 4, [STICK, SLIP, FLIGHT, STICK]],
    "block_slope": [[STICK, STICK], [SLIP, SLIP]],
    "gripper_lift": [[STICK, STICK, FLIGHT, FLIGHT]],
    "wheel_hills": [[STICK], [SLIP]],
    "cart_pole_friction": [[FLIGHT]],
}
"""Task -> modes of its contacts; a combination that the task has not as many contacts for is cut."""


def _state(motion: MotionProblem, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a state near the start of the task that moves, and controls."""
    random, robot, drive = np.random.default_rng(seed), motion.robot, motion.actuation
    physics = numeric_physics(motion)
    n_v = len(robot.velocity_names)
    q = physics.integrate(motion.endpoints.initial_configuration, 0.1 * random.standard_normal(n_v))
    scale = np.where(np.isfinite(drive.upper), drive.upper, 1.0)
    return q, random.standard_normal(n_v), 0.03 * scale * random.standard_normal(len(drive.names))


def _with_directions(
    physics: NumericPhysics, modes: list[ContactMode], q: np.ndarray, v: np.ndarray
) -> list[ContactMode]:
    """Return the modes in which contacts in the plane slide the way they move."""
    along = (physics.contact_jacobian(q) @ v).reshape(len(modes), -1)[:, 1]
    backwards = ContactMode.SLIP_BACKWARDS
    return [
        backwards if mode is SLIP and physics.rows == 2 and speed < 0 else mode
        for mode, speed in zip(modes, along, strict=True)
    ]


def _acceleration(physics: NumericPhysics, modes: list[ContactMode]) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    def of(q: np.ndarray, v: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return motion_in_modes(contact_dynamics(physics, q, v, u), modes)

    return of


@pytest.mark.parametrize(("name", "modes"), [(name, modes) for name, all_ in CASES.items() for modes in all_])
def test_departures_grow_as_those_of_the_rigid_bodies(name: str, modes: list[ContactMode]) -> None:
    """Over 2 ms a small departure becomes that of two integrations of Pinocchio's dynamics, to 1e-3 of the largest."""
    motion = formulate(load_task(f"tasks/{name}.yaml"), driven=False)
    physics = numeric_physics(motion)
    modes = modes[: len(motion.contacts)]
    q, v, u = _state(motion, seed=4)
    move = _acceleration(physics, _with_directions(physics, modes, q, v))
    acceleration, force = move(q, v, u)
    sliding = np.array([mode is SLIP for mode in modes])
    state = ContactState(np.array([mode is not FLIGHT for mode in modes]), sliding, np.zeros(0, dtype=int))
    linear = ModeDynamics(motion).along(state, q[None], v[None], u[None], acceleration[None], force[None])
    n_v, n_u, period, step = len(v), len(u), 2e-3, 1e-5
    rates = np.zeros((2 * n_v + n_u,) * 2)
    rates[: 2 * n_v] = np.hstack([linear.state[0], linear.control[0]])
    expected = expm(rates * period)[: 2 * n_v]

    def moved(at: np.ndarray, speed: np.ndarray, control: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
        h = span / STEPS
        for _ in range(STEPS):
            a, _ = move(at, speed, control)
            middle = physics.integrate(at, 0.5 * h * speed)
            a, _ = move(middle, speed + 0.5 * h * a, control)
            at, speed = physics.integrate(at, h * (speed + 0.5 * h * a)), speed + h * a
        return at, speed

    start = moved(q, v, u, -period / 2)
    found = np.zeros_like(expected)
    for column in range(2 * n_v + n_u):
        departure = np.zeros(2 * n_v + n_u)
        departure[column] = step
        ends = [
            moved(
                physics.integrate(start[0], sign * departure[:n_v]),
                start[1] + sign * departure[n_v : 2 * n_v],
                u + sign * departure[2 * n_v :],
                period,
            )
            for sign in (1, -1)
        ]
        reference = moved(*start, u, period)[0]
        d = physics.difference(reference, ends[0][0]) - physics.difference(reference, ends[1][0])
        found[:, column] = np.concatenate([d, ends[0][1] - ends[1][1]]) / (2 * step)
    error = np.abs(found - expected)
    assert error.max() <= 1e-3 * np.abs(expected).max()
