"""Default weights: a deviation of the robot's own size costs the same per second whatever the robot.

They come from the model alone: neither where the robot happens to be nor the time that is left changes them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.exactness import LAST_BITS
from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.rolling import Rolling
from fesd_robot.ocp.vectors import endpoints_of
from fesd_robot.orientations import deviation_names
from fesd_robot.robot import Robot, deviation_units, measured_deviation, root_height, velocity_units
from fesd_robot.task import CircleBoxContact, CircleCircleContact, CircleContact, Jumps, SingleContact, Task

CONFIGURATION, VELOCITY, CONTROL, SLIPPING = 10.0, 0.1, 1.0, 10.0
"""What a deviation of one unit of `RobotScales` costs per second; for slipping: one such work."""

LARGEST = 1e9
"""m and kg; robots that reach farther or weigh more, or less than its inverse, are mistakes."""

WITHOUT_GRAVITY = 0.1
"""s; the time that belongs to a robot where nothing falls."""

POSTURES = ("standing", "half_sitting", "home")
"""Names of the posture that a model file offers as its own."""

TERMINAL_CONFIGURATION, TERMINAL_VELOCITY = 100.0, 1.0
"""What a distance of one unit of `RobotScales` from the goal costs at the end."""

IN_PLACE = 0.05
"""Units of `RobotScales` by which no coordinate of a jump in place ends elsewhere, and its apex is at least higher."""


@dataclass(frozen=True)
class RobotScales:
    """Units that belong to a robot and its motion.

    Attributes:
        mass: of the whole robot, kg.
        length: of the robot or a body, from its centre of mass to its farthest contact or centre of a link in the
            posture of `reference_posture`, m; that of the largest.
        time: sqrt(length / gravity), s; without gravity `WITHOUT_GRAVITY`.
    """

    mass: float
    length: float
    time: float

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

    def weights(self, units: Mapping[str, str], cost: float) -> dict[str, float]:
        """Return name -> cost / scale^2, in three significant digits."""
        return {name: float(f"{cost / self.of(unit) ** 2:.3g}") for name, unit in units.items()}


def scales_of(task: Task, robot: Robot) -> RobotScales:
    """Return the units of a robot.

    Args:
        task: with its contacts in their places.
        robot: with frames there.

    Raises:
        TaskError: a robot whose squares of scales are none that a computer has.
    """
    model = robot.model
    data, trees = model.createData(), dict[int, list[tuple[float, np.ndarray]]]()
    pin.framesForwardKinematics(model, data, reference_posture(robot))
    for joint in range(1, model.njoints):
        if (mass := model.inertias[joint].mass) > 0:
            own = trees.setdefault(_root_of(model, joint), [])
            own.append((mass, data.oMi[joint].act(model.inertias[joint].lever)))
    centers = {root: sum(m * p for m, p in own) / sum(m for m, _ in own) for root, own in trees.items()}
    reached = [float(np.linalg.norm(p - centers[root])) for root, own in trees.items() for _, p in own]
    for contact in task.single_contacts.values():
        for name, radius in _points(contact):
            frame = model.frames[robot.frame_id(name)]
            if (root := _root_of(model, frame.parentJoint)) in centers:
                place = data.oMf[robot.frame_id(name)].translation
                reached.append(float(np.linalg.norm(place - centers[root])) + radius)
    farthest = max(reached, default=0.0)
    length = farthest if farthest > LAST_BITS else 1.0  # all of it is in one place
    mass = pin.computeTotalMass(model) or 1.0
    if not all(1 / LARGEST < size < LARGEST for size in (length, mass)):
        raise task.error(
            "robot",
            f"found a robot of {mass:g} kg that reaches {length:g} m with its contacts, expected both between "
            f"{1 / LARGEST:g} and {LARGEST:g}",
        )
    gravity = float(np.linalg.norm(model.gravity.linear))
    time = float(np.sqrt(length / gravity)) if gravity > 0 else WITHOUT_GRAVITY
    return RobotScales(mass, length, time)


def reference_posture(robot: Robot) -> np.ndarray:
    """Return the posture in which a robot is measured, (n_q): the first of `POSTURES` that its file names, else the
    neutral one with everything that slides at the end that is farther from zero, both within the limits."""
    q, model = np.array(robot.neutral), robot.model
    named = next((robot.postures[name] for name in POSTURES if name in robot.postures), None)
    for joint in range(1, model.njoints):
        i = model.joints[joint].idx_q
        if model.joints[joint].nq != 1:
            continue
        ends = [end for end in (robot.lower_position[i], robot.upper_position[i]) if np.isfinite(end)]
        if named is not None:
            q[i] = named.get(robot.configuration_names[i], q[i])
        elif ends and model.joints[joint].shortname().startswith("JointModelP"):
            q[i] = max(ends, key=abs)
        q[i] = np.clip(q[i], robot.lower_position[i], robot.upper_position[i])
    return q


def _root_of(model: pin.Model, joint: int) -> int:
    """Return the first joint between the world and a joint, 0 for what is fixed to the world."""
    return next((one for one in model.supports[joint] if one), 0)


def _points(contact: SingleContact) -> Sequence[tuple[str, float]]:
    """Return the frames that a contact belongs to, and how far its surface is from each, m."""
    if isinstance(contact, CircleCircleContact):
        assert contact.other_radius is not None
        return [(contact.frame, contact.radius), (contact.other_frame, contact.other_radius)]
    if isinstance(contact, CircleBoxContact):
        assert contact.other_size is not None
        return [(contact.frame, contact.radius), (contact.other_frame, float(np.linalg.norm(contact.other_size)) / 2)]
    return [(contact.touching_frame, contact.radius if isinstance(contact, CircleContact) else 0.0)]


def with_default_costs(
    task: Task, robot: Robot, actuation: Actuation, scales: RobotScales, rollings: Sequence[Rolling] = ()
) -> Task:
    """Return the task with weights for every term of the cost that has a default and was left out.

    What rolls has none on its way where a coordinate that it needs has no goal: the reference slides there, and effort
    decides how it moves. The height of a jump in place has another one, see `apex_in_place`.

    Args:
        task: with the whole configuration of its goal.
        actuation: names and units of the controls.
        scales: units of the robot, in which deviations are counted.
        rollings: what rolls.
    """
    costs, goal = task.costs, task.goal
    free = {name for one in rollings for name in one.free_in(goal)}
    following = [one for one in rollings if one.free_in(goal)]
    on_the_way = {name for one in following for name in one.tied}
    rates = {name for one in following for name in one.rates}
    positions, velocities = deviation_units(robot), velocity_units(robot)
    ends = {name: positions[name] for name in deviation_names(goal.configuration)} if goal.has_points else positions
    work = scales.force * scales.length
    controls = dict(zip(actuation.names, actuation.units, strict=True))
    defaults = {
        "configuration": scales.weights(_without(positions, on_the_way), CONFIGURATION),
        "velocity": scales.weights(_without(velocities, rates), VELOCITY),
        "control": scales.weights(controls, CONTROL),
        "slipping": dict.fromkeys(task.rigid_contacts, float(f"{SLIPPING / work:.3g}")),
    }
    if goal.periodic is None:
        defaults["terminal_configuration"] = scales.weights(_without(ends, free), TERMINAL_CONFIGURATION)
        defaults["terminal_velocity"] = scales.weights(velocities, TERMINAL_VELOCITY)
    defaults["configuration"] |= apex_in_place(task, robot, scales)
    missing = {key: weights for key, weights in defaults.items() if getattr(costs, key) is None}
    return task.model_copy(update={"costs": costs.model_copy(update=missing)})


def apex_in_place(task: Task, robot: Robot, scales: RobotScales) -> dict[str, float]:
    """Return the weight of the height of a jump in place, name -> cost per square and second, nothing for other tasks.

    Nothing but its apex asks such a robot to leave the ground, and a jump takes more effort than the deviation of a
    robot that stands costs by its own size. So the apex is a goal: to miss it by all of its height costs as much a
    second as to miss a goal by the robot's size.
    """
    if not isinstance(task.reference, Jumps) or task.goal.periodic is not None:
        return {}
    apex, ends = task.reference.apex, endpoints_of(task, robot)
    height = root_height(list(apex))
    if height is None:
        return {}
    names = robot.configuration_names
    moved = measured_deviation(names, ends.goal_configuration, ends.initial_configuration)
    if any(abs(moved[name]) > IN_PLACE * scales.of(unit) for name, unit in deviation_units(robot).items()):
        return {}
    rise = apex[height] - float(ends.initial_configuration[names.index(height)])
    return {height: float(f"{TERMINAL_CONFIGURATION / rise**2:.3g}")} if rise > IN_PLACE * scales.length else {}


def _without(units: Mapping[str, str], names: Set[str]) -> dict[str, str]:
    return {name: unit for name, unit in units.items() if name not in names}
