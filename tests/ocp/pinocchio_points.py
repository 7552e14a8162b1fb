"""Frames and centre of mass by Pinocchio's numeric algorithms, and trajectory constraints as numbers."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp import MotionProblem
from fesd_robot.robot import Robot


def frame(robot: Robot, name: str, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and rotation of a frame in the world."""
    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    index = robot.frame_id(name)
    velocity = pin.getFrameVelocity(model, data, index, pin.LOCAL_WORLD_ALIGNED).linear
    return data.oMf[index].translation.copy(), velocity.copy(), data.oMf[index].rotation.copy()


def center_of_mass(robot: Robot, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the centre of mass."""
    data = robot.model.createData()
    pin.centerOfMass(robot.model, data, q, v)
    return data.com[0].copy(), data.vcom[0].copy()


def constraint(motion: MotionProblem, name: str) -> TrajectoryConstraint:
    """The trajectory constraint of this name."""
    return next(one for one in motion.ocp.constraints if one.name == name)


def rows(one: TrajectoryConstraint, *y: Sequence[float] | np.ndarray) -> np.ndarray:
    """Values of its rows where y is the given parts one after the other."""
    values = ca.Function("rows", [one.variables, one.parameters], [one.rows])
    return np.asarray(values(np.concatenate(y), one.parameter_values[:, :1])).ravel()


def costs(one: TrajectoryConstraint, *y: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Values of its costs."""
    values = ca.Function("costs", [one.variables, one.parameters], [ca.vertcat(*one.cost.values())])
    numbers = np.asarray(values(np.concatenate(y), one.parameter_values[:, :1])).ravel()
    return dict(zip(one.cost, numbers.tolist(), strict=True))


def states(count: int = 4) -> np.ndarray:
    """Random states of the hopper (q, v, clock, gap), (count, 10)."""
    return np.random.default_rng(5).uniform(0.1, 0.5, size=(count, 10))
