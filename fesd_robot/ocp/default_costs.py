"""Default weights: a deviation of the robot's own size over the whole motion costs the same whatever the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.ocp.actuation import Actuation
from fesd_robot.orientations import deviation_names
from fesd_robot.robot import Robot, deviation_units, velocity_units
from fesd_robot.task import CircleBoxContact, CircleCircleContact, CircleContact, SingleContact, Task

CONFIGURATION, VELOCITY, CONTROL, SLIPPING = 10.0, 0.1, 1.0, 10.0
"""What a deviation of one unit of `RobotScales` costs, over the whole duration; for slipping: one such work."""

TERMINAL_CONFIGURATION, TERMINAL_VELOCITY = 100.0, 1.0
"""What a distance of one unit of `RobotScales` from the goal costs at the end."""


@dataclass(frozen=True)
class RobotScales:
    """Units that belong to a robot and its motion.

    Attributes:
        mass: of the whole robot, kg.
        length: distance from the centre of mass to the farthest contact or centre of a link at the start, m.
        time: sqrt(length / gravity), s; without gravity a tenth of the duration.
        duration: of the motion, s.
    """

    mass: float
    length: float
    time: float
    duration: float

    @property
    def force(self) -> float:
        """Mass times length over time squared, N: the weight."""
        return self.mass * self.length / self.time**2

    def of(self, unit: str) -> float:
        """Return the robot's scale of a quantity, in its unit: a length, angle, speed, force or torque."""
        scales = {
            "m": self.length,
            "rad": 1.0,
            "1": 1.0,
            "m/s": self.length / self.time,
            "rad/s": 1.0 / self.time,
            "N": self.force,
            "N m": self.force * self.length,
        }
        return scales[unit]

    def weights(self, units: Mapping[str, str], cost: float, duration: float) -> dict[str, float]:
        """Return name -> cost / (duration scale^2), in three significant digits."""
        return {name: float(f"{cost / (duration * self.of(unit) ** 2):.3g}") for name, unit in units.items()}


def scales_of(task: Task, robot: Robot, configuration: np.ndarray, duration: float) -> RobotScales:
    """Return the units of a robot.

    Args:
        configuration: at the start, (n_q).
        duration: of the motion, s.
    """
    model = robot.model
    data = model.createData()
    center = pin.centerOfMass(model, data, configuration)
    pin.updateFramePlacements(model, data)
    reached = [
        float(np.linalg.norm(data.oMi[joint].act(model.inertias[joint].lever) - center))
        for joint in range(1, model.njoints)
        if model.inertias[joint].mass > 0
    ]
    for contact in task.single_contacts.values():
        for frame, radius in _points(contact):
            reached.append(float(np.linalg.norm(data.oMf[robot.frame_id(frame)].translation - center)) + radius)
    length = max(reached, default=0.0) or 1.0
    gravity = float(np.linalg.norm(model.gravity.linear))
    time = float(np.sqrt(length / gravity)) if gravity > 0 else 0.1 * duration
    return RobotScales(pin.computeTotalMass(model) or 1.0, length, time, duration)


def _points(contact: SingleContact) -> Sequence[tuple[str, float]]:
    """Return the frames that a contact belongs to, and how far its surface is from each, m."""
    if isinstance(contact, CircleCircleContact):
        assert contact.other_radius is not None
        return [(contact.frame, contact.radius), (contact.other_frame, contact.other_radius)]
    if isinstance(contact, CircleBoxContact):
        assert contact.other_size is not None
        return [(contact.frame, contact.radius), (contact.other_frame, float(np.linalg.norm(contact.other_size)) / 2)]
    return [(contact.touching_frame, contact.radius if isinstance(contact, CircleContact) else 0.0)]


def with_default_costs(task: Task, robot: Robot, actuation: Actuation, scales: RobotScales) -> Task:
    """Return the task with weights for every term of the cost that has a default and was left out.

    Args:
        task: with the whole configuration of its goal.
        actuation: names and units of the controls.
        scales: units of the robot, in which deviations are counted.
    """
    costs, goal = task.costs, task.goal
    positions, velocities = deviation_units(robot), velocity_units(robot)
    ends = {name: positions[name] for name in deviation_names(goal.configuration)} if goal.has_points else positions
    work = scales.force * scales.length
    controls = dict(zip(actuation.names, actuation.units, strict=True))
    defaults = {
        "configuration": scales.weights(positions, CONFIGURATION, scales.duration),
        "velocity": scales.weights(velocities, VELOCITY, scales.duration),
        "control": scales.weights(controls, CONTROL, scales.duration),
        "slipping": dict.fromkeys(task.contacts, float(f"{SLIPPING / work:.3g}")),
    }
    if goal.periodic is None:
        defaults["terminal_configuration"] = scales.weights(ends, TERMINAL_CONFIGURATION, 1.0)
        defaults["terminal_velocity"] = scales.weights(velocities, TERMINAL_VELOCITY, 1.0)
    missing = {key: weights for key, weights in defaults.items() if getattr(costs, key) is None}
    return task.model_copy(update={"costs": costs.model_copy(update=missing)})
