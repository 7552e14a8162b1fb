"""The robot's part in the figures of a plan: bodies, contact points, energy, power, limits and reference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnSurface, ContactGeometry, Scene, TwoBodies
from fesd_robot.contact.ground import LATERAL, Axes
from fesd_robot.errors import FesdRobotError
from fesd_robot.ocp import (
    Actuation,
    StateLimits,
    build_actuation,
    endpoints_of,
    limits_of,
    load_task_robot,
    reference_of,
    scene_of,
    time_grid,
)
from fesd_robot.plans import Plan, check_task_and_robot, control_interval
from fesd_robot.recovery import closest, tangents_between
from fesd_robot.render.figures.silhouettes import Silhouettes
from fesd_robot.render.outputs import ground_visual
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.robot import Robot
from fesd_robot.task import Task

REFERENCE_SAMPLES, PATH_SAMPLES = 120, 120


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """A planned motion with its robot.

    Attributes:
        task: with its contacts in their places.
        plan: the plan.
        configuration, velocity: along `Trajectory.time`, shapes (n, n_q) and (n, n_v).
    """

    task: Task
    robot: Robot
    plan: Plan
    configuration: np.ndarray
    velocity: np.ndarray

    @cached_property
    def _data(self) -> pin.Data:
        return self.robot.model.createData()

    @cached_property
    def scene(self) -> Scene:
        """What the contacts touch."""
        return scene_of(self.task)

    @cached_property
    def ground(self) -> GroundVisual:
        """The ground as a line."""
        return ground_visual(self.task)

    @cached_property
    def limits(self) -> StateLimits:
        """Of configuration and velocity."""
        return limits_of(self.task, self.robot)

    @cached_property
    def actuation(self) -> Actuation:
        """Directions and bounds of the controls."""
        return build_actuation(self.task, self.robot)

    @cached_property
    def silhouettes(self) -> Silhouettes:
        """The outlines of the robot's shapes."""
        places = {name: one.touching_frame for name, one in self.task.single_contacts.items()}
        return Silhouettes(self.robot, places)

    @cached_property
    def center_of_mass(self) -> np.ndarray:
        """Along `Trajectory.time`, m, (n, 3)."""
        model, data = self.robot.model, self.robot.model.createData()
        return np.array([pin.centerOfMass(model, data, q).copy() for q in self.configuration])

    @cached_property
    def energies(self) -> dict[str, np.ndarray]:
        """``kinetic`` (with armature), ``potential`` (gravity and springs) and ``total`` energy, J, (n) each."""
        model, data = self.robot.model, self.robot.model.createData()
        kinetic = np.empty(len(self.configuration))
        for k, (q, v) in enumerate(zip(self.configuration, self.velocity, strict=True)):
            upper = np.triu(pin.crba(model, data, q))
            kinetic[k] = 0.5 * v @ (upper + np.triu(upper, 1).T) @ v
        weight = float(pin.computeTotalMass(model)) * model.gravity.linear
        potential = -self.center_of_mass @ weight
        for _, entry, stiffness, rest in self.robot.springs:
            potential = potential + 0.5 * stiffness * (self.configuration[:, entry] - rest) ** 2
        return {"kinetic": kinetic, "potential": potential, "total": kinetic + potential}

    @cached_property
    def power(self) -> dict[str, np.ndarray]:
        """What every control does, u_i (Bᵀ v)_i, along `Trajectory.time`, W, (n) each."""
        interval = control_interval(self.plan)
        rates = np.array(
            [np.asarray(self.actuation.matrix(q)).T @ v for q, v in zip(self.configuration, self.velocity, strict=True)]
        )
        return {name: self.plan.controls[name][interval] * rates[:, i] for i, name in enumerate(self.actuation.names)}

    @cached_property
    def reference(self) -> tuple[np.ndarray, np.ndarray]:
        """Times, s, (m,), and the configurations of the reference motion, (m, n_q); of a free duration, stretched."""
        grid = time_grid(self.task)
        motion = reference_of(self.task, self.robot, endpoints_of(self.task, self.robot), self.limits, grid)
        times = np.linspace(0.0, grid.nominal, REFERENCE_SAMPLES)
        end = float(self.plan.trajectory.time[-1]) if grid.free else grid.nominal
        return times * end / grid.nominal, np.array([motion.configuration(time) for time in times])

    @cached_property
    def contact_paths(self) -> list[np.ndarray]:
        """Where every contact touches or would touch, x, z in m, thinned to what can be seen, (m, 2) each."""
        last = len(self.configuration) - 1
        samples = [*range(0, last, max(last // PATH_SAMPLES, 1)), last]
        return [np.array([self.touching(name, sample)[0] for sample in samples]) for name in self.plan.contacts]

    def touching(self, name: str, sample: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where a contact touches or would touch, and its force there, x, z in m and N, (2,) each.."""
        pin.framesForwardKinematics(self.robot.model, self._data, self.configuration[sample])
        history = self.plan.contacts[name]
        point, (normal, tangent, lateral) = _place(self.robot, self._data, self.scene.geometries[name])
        force = history.normal_force[sample] * normal + history.tangential_force[sample] * tangent
        if history.lateral_force is not None:
            force = force + history.lateral_force[sample] * lateral
        return point[[0, 2]], force[[0, 2]]


def _place(robot: Robot, data: pin.Data, geometry: ContactGeometry) -> tuple[np.ndarray, Axes]:
    """Return the point that touches and the directions in which the contact pushes, (3,) each."""
    pose = data.oMf[robot.frame_id(geometry.frame)]
    center = np.array(pose.translation)
    if isinstance(geometry, TwoBodies):
        other = data.oMf[robot.frame_id(geometry.other_frame)]
        _, normal = closest(geometry, center, np.array(other.translation), np.array(other.rotation))
        tangent, *across = tangents_between(geometry, normal)
        return center - geometry.radius * normal, Axes(normal, tangent, across[0] if across else LATERAL)
    if isinstance(geometry, CircleOnSurface):
        axes = geometry.path.axes(center)
        return center - geometry.radius * axes.normal, axes
    return center, geometry.surface.axes(center)


def robot_motion(plan: Plan, task: Task) -> RobotMotion:
    """Return a plan with its robot.

    Raises:
        TaskError: a file that the task names cannot be read any more.
        FesdRobotError: the trajectory is not finite.
    """
    task, robot = load_task_robot(task)
    check_task_and_robot(plan, task, robot)
    trajectory = plan.trajectory
    q = np.column_stack([trajectory.configuration[name] for name in robot.configuration_names])
    v = np.column_stack([trajectory.velocity[name] for name in robot.velocity_names])
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        raise FesdRobotError("the trajectory is not finite everywhere, expected numbers: the robot cannot be drawn")
    return RobotMotion(task, robot, plan, np.array([pin.normalize(robot.model, each) for each in q]), v)
