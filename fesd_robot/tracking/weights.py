"""Weights of a tracking controller, in units of the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np

from fesd_robot.errors import OptionError, nearest
from fesd_robot.ocp import MotionProblem
from fesd_robot.robot import velocity_units


@dataclass(frozen=True)
class TrackingWeights:
    """Departures that cost as much as each other: the cost of a departure e is (e / scale)^2 a second.

    The defaults are one set for all robots: roots and bodies are held more closely than joints, and the speed of joints
    hardly counts.

    Args:
        root_position: of the robot's root, m; body_position: of free bodies, m, which only contacts move.
        root_velocity: of roots and free bodies, m/s.
        root_angle, root_rate: of their orientation, rad and rad/s.
        hinge_angle, hinge_rate: of joints that turn, rad and rad/s.
        slide_position, slide_velocity: of joints that slide, m and m/s.
        effort: of a control, as a part of half the width of its limits.
        end: the end counts as much as this many seconds of the motion, s.
        position, velocity: name of a velocity coordinate -> its own scale, in the place of those above, m or rad and
            m/s or rad/s.
        control: name of a control -> its own scale, N or N m.

    Raises:
        OptionError: a scale that is not a number greater than 0.
    """

    root_position: float = 0.01
    body_position: float = 0.02
    root_velocity: float = 0.2
    root_angle: float = 0.05
    root_rate: float = 0.5
    hinge_angle: float = 0.2
    hinge_rate: float = 10.0
    slide_position: float = 0.02
    slide_velocity: float = 0.5
    effort: float = 0.2
    end: float = 0.02
    position: Mapping[str, float] = field(default_factory=dict)
    velocity: Mapping[str, float] = field(default_factory=dict)
    control: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            scales = value if isinstance(value, Mapping) else {None: value}
            for name, scale in scales.items():
                if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0 < scale < math.inf:
                    key = each.name if name is None else f"{each.name}['{name}']"
                    raise OptionError(f"{key}: found {scale!r}, expected a number greater than 0")

    def of_state(self, motion: MotionProblem) -> np.ndarray:
        """Return the weight of every entry of a departure, displacement before velocity, (2 n_v).

        Raises:
            OptionError: a name that no coordinate of the robot has.
        """
        robot = motion.robot
        units, roots = velocity_units(robot), set(robot.root_names)
        kinds = {
            (True, True): (self.root_position, self.root_velocity),
            (True, False): (self.root_angle, self.root_rate),
            (False, True): (self.slide_position, self.slide_velocity),
            (False, False): (self.hinge_angle, self.hinge_rate),
        }
        scales = np.array([kinds[name in roots, units[name] == "m/s"] for name in robot.velocity_names]).T
        for i, name in enumerate(robot.velocity_names):
            if name in roots and units[name] == "m/s" and robot.body_of(name) is not None:
                scales[0, i] = self.body_position
        for own, row, key in ((self.position, scales[0], "position"), (self.velocity, scales[1], "velocity")):
            for name, scale in own.items():
                row[_index(name, robot.velocity_names, key, "velocity coordinate")] = scale
        return np.asarray(scales.ravel() ** -2.0)

    def of_control(self, motion: MotionProblem) -> np.ndarray:
        """Return the weight of every control, (n_u).

        Raises:
            OptionError: a name that no control has.
        """
        drive = motion.actuation
        scales = self.effort * (drive.upper - drive.lower) / 2
        for name, scale in self.control.items():
            scales[_index(name, drive.names, "control", "control")] = scale
        return np.asarray(scales**-2.0)


def _index(name: str, names: list[str], key: str, kind: str) -> int:
    if name not in names:
        raise OptionError(f"{key}: found '{name}', expected a {kind}{nearest(name, names)}")
    return list(names).index(name)
