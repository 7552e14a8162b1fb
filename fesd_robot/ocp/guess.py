"""The initial guess of the solver, where it is not the reference itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.ocp.reference_file import read_motion
from fesd_robot.ocp.reference_motion import ReferenceMotion
from fesd_robot.ocp.reference_types import SampledMotion, between
from fesd_robot.robot import Robot
from fesd_robot.task import Task

WAVES = 3
"""Number of sine waves that a perturbation is made of."""

PERTURBATION = 0.1
"""Standard deviation of the longest wave's height, m or rad."""


@dataclass(frozen=True)
class PerturbedMotion:
    """A motion q(t) moved along sum_k c_k sin(k pi t / T) / k in every velocity coordinate.

    The c_k are normally distributed with deviation `PERTURBATION`; start and end stay where they are.

    Attributes:
        motion: what is perturbed.
        heights: c_k, (WAVES, n_v).
        duration: T, s.
    """

    robot: Robot
    motion: ReferenceMotion
    heights: np.ndarray
    duration: float

    def configuration(self, time: float) -> np.ndarray:
        """Return the configuration at a time, (n_q)."""
        waves = np.arange(1, WAVES + 1)
        perturbation = (np.sin(waves * np.pi * time / self.duration) / waves) @ self.heights
        return np.asarray(pin.integrate(self.robot.model, self.motion.configuration(time), perturbation))

    @property
    def knots(self) -> np.ndarray:
        """Those of what is perturbed."""
        return self.motion.knots

    def velocity(self, time: float) -> np.ndarray:
        """Return the velocity consistent with the configuration to first order in the perturbation, (n_v)."""
        waves = np.arange(1, WAVES + 1)
        rate = np.cos(waves * np.pi * time / self.duration) * np.pi / self.duration
        return np.asarray(self.motion.velocity(time) + rate @ self.heights)


def guess_of(task: Task, robot: Robot, reference: ReferenceMotion, duration: float) -> ReferenceMotion:
    """Return the initial guess: an earlier motion stretched to the duration, or the reference, perturbed by the seed.

    Raises:
        TaskError: the file of `solver.warm_start` cannot be used.
    """
    motion, name = reference, task.solver.warm_start
    if name is not None:
        times, rows = read_motion(task, "solver.warm_start", name, robot)
        times = (times - times[0]) * duration / max(times[-1] - times[0], 1e-300)
        motion = SampledMotion(
            robot, lambda time: between(robot, times, rows, time), duration, np.array([0.0, duration])
        )
    if task.solver.seed:
        heights = np.random.default_rng(task.solver.seed).normal(0.0, PERTURBATION, (WAVES, robot.model.nv))
        motion = PerturbedMotion(robot, motion, heights, duration)
    return motion
