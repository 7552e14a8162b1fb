"""Gaits in closed loop: stride after stride, until the robot falls."""

from __future__ import annotations

import numpy as np

from fesd_robot.in_mujoco import Controller, Disturbance, mujoco_scene, run, sliding_contacts
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import Plan
from fesd_robot.replanning.strides import Strides
from fesd_robot.tracking import Tracker

STRIDES = 20

LOW, TURNED = 0.6, 1.0
"""A robot has fallen where its root is below this share of its lowest height in the plan, or turned by so much, rad."""


class Fallen(Exception):
    """The robot has fallen."""


class RepeatedTracker:
    """A tracker that begins again with every repetition of a gait.

    Args:
        tracker: of the plan.
        strides: of its gait.
    """

    def __init__(self, tracker: Tracker, strides: Strides) -> None:
        self._tracker, self._strides, self._number = tracker, strides, 0
        self._span = strides.duration / strides.plans
        tracker.reset()

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the controls, of a mirror image where the gait is one."""
        while time >= (self._number + 1) * self._span - 1e-9:
            self._number += 1
            self._tracker.reset()
        strides, image, n_q = self._strides, self._strides.image, len(configuration)
        sources, signs = image.states[0][:n_q], image.states[1][:n_q]
        q, v = configuration, velocity
        for _ in range(self._number):  # the image is its own inverse
            q = (q - strides.change[:n_q])[sources] * signs
            v, contacts = v[image.velocities[0]] * image.velocities[1], contacts[image.contacts]
        u = self._tracker.action(time - self._number * self._span, q, v, contacts)
        for _ in range(self._number):
            u = u[image.controls[0][:-1]] * image.controls[1][:-1]
        return u


class Watched:
    """A controller that ends a run where the robot falls."""

    def __init__(self, controller: Controller, motion: MotionProblem, plan: Plan) -> None:
        names = list(motion.robot.configuration_names)
        self._controller, self._height, self._pitch = controller, names.index("root_z"), names.index("root_pitch")
        self._low = LOW * float(np.min(plan.trajectory.configuration["root_z"]))

    def action(self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the controls of the other one."""
        if configuration[self._height] < self._low or abs(configuration[self._pitch]) > TURNED:
            raise Fallen(f"at {time:.2f} s")
        return self._controller.action(time, configuration, velocity, contacts)


def for_strides(
    motion: MotionProblem, plan: Plan, strides: Strides, controller: Controller, disturbance: Disturbance
) -> tuple[bool, float]:
    """Drive a gait for twenty strides; return whether the robot does not fall, and how far it stays behind, m."""
    driven = RepeatedTracker(controller, strides) if isinstance(controller, Tracker) else controller
    scene = mujoco_scene(motion, sliding=sliding_contacts(plan))
    span = float(plan.trajectory.time[-1] - plan.trajectory.time[0])
    along = list(motion.robot.configuration_names).index("root_x")
    far = STRIDES * float(strides.advance[along])
    try:
        beyond = STRIDES * strides.duration - span
        record = run(scene, plan, Watched(driven, motion, plan), beyond=beyond, disturbance=disturbance)
    except Fallen:
        return False, far
    travelled = float(record.configuration[-1, along] - record.configuration[0, along])
    return not record.broken, abs(travelled - far)
