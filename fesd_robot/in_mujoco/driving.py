"""A plan driven in MuJoCo by a controller."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.errors import OptionError
from fesd_robot.exactness import ROUNDED
from fesd_robot.in_mujoco.scene import MujocoScene
from fesd_robot.ocp import numeric_physics
from fesd_robot.plans import Plan
from fesd_robot.tracking.tracker import HOLD

OUT_OF_SIGHT = 1e3
"""m or rad, m/s or rad/s; where a state is larger, the run has ended."""


class Controller(Protocol):
    """What drives a robot."""

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the controls, N or N m, (n_u).

        Args:
            time: since the start of the plan, s.
            configuration, velocity: q, (n_q), and v, (n_v), in the order of the plan's robot.
            contacts: which contacts touch, (n_c) of bool, in the order of the task.
        """


class OpenLoop:
    """The controls of a plan by time: of every hold their mean, for they change between two of them.

    Args:
        plan: any; the controls of its last interval go on beyond its end.
        hold: how long a control holds, s.
    """

    def __init__(self, plan: Plan, hold: float = HOLD) -> None:
        values = [values for name, values in plan.controls.items() if name != "time"]
        controls = np.array(values).T.reshape(len(plan.controls["time"]), -1)
        edges = np.append(plan.controls["time"], np.inf)
        self._hold, self._starts, self._ends, self._controls = hold, edges[:-1], edges[1:], controls

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the mean of the controls from a time on, as long as they hold."""
        shares = np.minimum(self._ends, time + self._hold) - np.maximum(self._starts, time)
        return np.asarray(np.maximum(shares, 0.0) @ self._controls / self._hold)


@dataclass(frozen=True)
class Noise:
    """Normally distributed errors of what a controller is told.

    Args:
        seed: of the errors.
        length, angle: standard deviation of positions, m, and of angles, rad.
        speed, rate: of velocities, m/s, and of angular ones, rad/s.
    """

    seed: int
    length: float = 1e-3
    angle: float = 3.5e-3
    speed: float = 0.02
    rate: float = 0.05


@dataclass(frozen=True)
class Push:
    """A force on the robot's first body with a mass, for a short time.

    Args:
        time: when it begins, s.
        velocity: by how much it changes the velocity of the robot's centre of mass, m/s, (3), if nothing holds it.
        duration: s.
    """

    time: float
    velocity: Sequence[float]
    duration: float = 0.01


@dataclass(frozen=True)
class Disturbance:
    """What is different from the plan in a run, beside the scene.

    Args:
        offset: displacement of the start, m and rad, (n_v); what it would press into each other is moved apart.
        delay: between a measurement and the control that answers it, s.
        noise: of the measurements.
        pushes: in any order.
    """

    offset: np.ndarray | None = None
    delay: float = 0.0
    noise: Noise | None = None
    pushes: Sequence[Push] = ()


@dataclass(frozen=True)
class Touch:
    """A contact that begins to touch at a time, s."""

    contact: str
    time: float


@dataclass(frozen=True)
class RunRecord:
    """A run of n controls.

    Attributes:
        time: when each of them begins, s, (n), and the end, (n + 1).
        configuration, velocity: at these times, (n + 1, n_q) and (n + 1, n_v), in the order of the plan's robot.
        contacts: which contacts touch there, (n + 1, n_c) of bool.
        control: what the motors do, N or N m, (n, n_u), within their limits.
        touches: when contacts begin to touch.
        broken: whether the run ended early, because the robot was out of sight.
    """

    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    contacts: np.ndarray
    control: np.ndarray
    touches: list[Touch] = field(repr=False)
    broken: bool = False


def run(
    scene: MujocoScene,
    plan: Plan,
    controller: Controller,
    *,
    hold: float = HOLD,
    beyond: float = 0.0,
    disturbance: Disturbance | None = None,
) -> RunRecord:
    """Drive a plan's robot in MuJoCo, from the start of the plan.

    Args:
        scene: of the plan's task.
        plan: which the robot starts as.
        controller: what drives it; its controls are cut off at the limits of the motors.
        hold: how long a control holds, s, several time steps of the scene.
        beyond: how long the run goes on after the end of the plan, s.
        disturbance: what else is different.

    Raises:
        OptionError: times that are not positive, a hold that is not a number of time steps, or a push that the robot
            would not feel.
    """
    step, wanted = scene.model.opt.timestep, disturbance or Disturbance()
    each = _steps("hold", hold, step)
    late = _steps("delay", wanted.delay, hold) if wanted.delay else 0
    if beyond < 0:
        raise OptionError(f"beyond: found {beyond:g} s, expected a time that is not negative")
    span = float(plan.trajectory.time[-1] - plan.trajectory.time[0])
    count = max(int(np.ceil((span + beyond) / hold - ROUNDED)), 1)
    _check_pushes(scene, wanted.pushes, count * hold, hold)
    data, motors, coordinates = mujoco.MjData(scene.model), scene.motors, scene.coordinates
    start = _start(scene, plan, wanted.offset)
    data.qpos[:], data.qvel[:] = coordinates.to_scene(*start)
    mujoco.mj_forward(scene.model, data)
    sensors = _Sensors(scene, wanted.noise)
    touching = scene.touching(data)
    rows, controls, touches, waiting, broken = [], [], list[Touch](), deque[np.ndarray](), False
    for number in range(count):
        time = number * hold
        q, v = coordinates.to_plan(data.qpos, data.qvel)
        rows.append((time, q, v, touching))
        action = controller.action(time, *sensors.measured(q, v), touching)
        waiting.append(np.clip(np.asarray(action, dtype=float), motors.lower, motors.upper))
        control = waiting.popleft() if len(waiting) > late else waiting[0]
        controls.append(control)
        _push(scene, data, wanted.pushes, time)
        for sub in range(each):
            if sub == 0 or motors.note:  # forces on joints change with the configuration
                motors.drive(data, coordinates, control)
            mujoco.mj_step(scene.model, data)
            now = scene.touching(data)
            # The contacts are those at the beginning of the step.
            touches += [Touch(scene.contact_names[k], time + sub * step) for k in np.flatnonzero(now & ~touching)]
            touching = now
        broken = not (np.abs(data.qvel).max() < OUT_OF_SIGHT and np.abs(data.qpos).max() < OUT_OF_SIGHT)
        if broken:
            break
    q, v = coordinates.to_plan(data.qpos, data.qvel)
    if np.isfinite(q).all() and np.isfinite(v).all():
        rows.append((len(controls) * hold, q, v, touching))
    else:
        controls.pop()
    times, configuration, velocity, contacts = (np.array(column) for column in zip(*rows, strict=True))
    control = np.array(controls).reshape(len(controls), -1)
    return RunRecord(times, configuration, velocity, contacts, control, touches, broken)


def _check_pushes(scene: MujocoScene, pushes: Sequence[Push], end: float, hold: float) -> None:
    """Raise where a push is none."""
    for each in pushes:
        if not 0.0 <= each.time < end - ROUNDED:
            raise OptionError(f"push: found one at {each.time:g} s, expected a time before the run ends, {end:g} s")
        if not each.duration >= hold - ROUNDED:
            raise OptionError(f"push: found a duration of {each.duration:g} s, expected one of at least {hold:g} s")
        if np.shape(each.velocity) != (3,) or not np.isfinite(each.velocity).all():
            raise OptionError(f"push: found the velocity {each.velocity}, expected three numbers, m/s")
        if each.velocity[1] and not scene.motion.in_space:
            raise OptionError(
                f"push: found {each.velocity[1]:g} m/s along y, expected 0 for a robot that moves in the x-z plane"
            )


def _push(scene: MujocoScene, data: mujoco.MjData, pushes: Sequence[Push], time: float) -> None:
    if not pushes:
        return
    body, model = scene.first_body, scene.model
    mass = float(model.body_subtreemass[body])
    data.xfrc_applied[body, :3] = sum(
        (
            mass / each.duration * np.asarray(each.velocity, dtype=float)
            for each in pushes
            if each.time - ROUNDED <= time < each.time + each.duration - ROUNDED
        ),
        np.zeros(3),
    )


def _steps(name: str, value: float, step: float) -> int:
    steps = round(value / step)
    if not value > 0 or abs(steps * step - value) > ROUNDED or steps < 1:
        raise OptionError(f"{name}: found {value:g} s, expected a whole number of steps of {step:g} s")
    return steps


def _start(scene: MujocoScene, plan: Plan, offset: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return q and v at the start of a plan, displaced such that no gap is below zero that was not."""
    robot, trajectory = scene.motion.robot, plan.trajectory
    q = np.array([trajectory.configuration[name][0] for name in robot.configuration_names])
    v = np.array([trajectory.velocity[name][0] for name in robot.velocity_names])
    if offset is None:
        return q, v
    physics = numeric_physics(scene.motion)
    q, least = np.asarray(pin.integrate(robot.model, q, offset)), np.minimum(physics.gaps(q), 0.0)
    for _ in range(20):
        gaps = physics.gaps(q) - least
        pressed = gaps < -ROUNDED
        if not pressed.any():
            break
        normals = physics.contact_jacobian(q)[:: physics.rows][pressed]
        q = np.asarray(pin.integrate(robot.model, q, np.linalg.pinv(normals, rcond=1e-6) @ -gaps[pressed]))
    return q, v


class _Sensors:
    """What a controller is told of a state."""

    def __init__(self, scene: MujocoScene, noise: Noise | None) -> None:
        from fesd_robot.robot import velocity_units

        robot = scene.motion.robot
        self._model, self._random = robot.model, None if noise is None else np.random.default_rng(noise.seed)
        if noise is not None:
            units = velocity_units(robot)
            lengths = np.array([units[name] == "m/s" for name in robot.velocity_names])
            self._places = np.where(lengths, noise.length, noise.angle)
            self._speeds = np.where(lengths, noise.speed, noise.rate)

    def measured(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return configuration and velocity with their errors."""
        if self._random is None:
            return q, v
        wrong = self._places * self._random.standard_normal(len(v))
        return (
            np.asarray(pin.integrate(self._model, q, wrong)),
            v + self._speeds * self._random.standard_normal(len(v)),
        )
