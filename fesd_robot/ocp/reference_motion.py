"""The motion that the costs compare with and the solver starts from: its protocol, and jumps over a line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pinocchio as pin

from fesd_robot.instants import SAME_PART
from fesd_robot.ocp.vectors import with_values
from fesd_robot.orientations import angles_of, quaternion_entries, quaternion_of, turn_entries, turn_of, unit_entries
from fesd_robot.robot import Robot, interpolated, measured_deviation, turned_by, with_turn

DIFFERENCE_STEP = 1e-6
"""Step of difference quotients for the reference velocity, as a fraction of the duration."""


ROUNDED_KINK = 0.025
"""Of a jump's time: how far from a take-off or landing, where its slope jumps, the reference begins to bend."""

KNOTS_OF_A_TURN = 8
"""Pieces of the spline that follows an orientation along a line."""


class ReferenceMotion(Protocol):
    """A motion over the nominal duration, s."""

    def configuration(self, time: float) -> np.ndarray:
        """Return the configuration at a time, (n_q)."""
        ...

    def velocity(self, time: float) -> np.ndarray:
        """Return the velocity consistent with the configuration, (n_v)."""
        ...

    @property
    def knots(self) -> np.ndarray:
        """Times between which a cubic polynomial follows it closely, the start and the end among them, s, (n >= 2)."""
        ...


@dataclass(frozen=True)
class LineMotion:
    """q(t) along the line from start to goal on the configuration manifold, raised by `lift` on each of `count` jumps.

    With s from 0 to 1 in every flight: q = line(s) + lift 4 s (1 - s), and of an orientation R = R_line(s) exp(4 s (1 -
    s) log(R_takeoff^T R_apex)). Before and after a flight it stands still.

    Attributes:
        apex: name of a coordinate, or of an angle of an orientation -> its value in the middle of a jump, m or rad.
        stance: fraction of every jump's time that is no flight, half of it before and half after.
    """

    robot: Robot
    duration: float
    start: np.ndarray
    goal: np.ndarray
    count: int
    apex: Mapping[str, float]
    stance: float = 0.0

    def configuration(self, time: float) -> np.ndarray:
        """Return the configuration at a time, (n_q)."""
        return self._at(time, self._jump(time))

    def velocity(self, time: float) -> np.ndarray:
        """Return the velocity consistent with the configuration, (n_v); at a take-off that of the jump that begins."""
        step = DIFFERENCE_STEP * self.duration
        jump = self._jump(time)
        ahead = time + step <= self.duration * (jump + 1) / self.count + 0.5 * step
        first, second = (time, time + step) if ahead else (time - step, time)
        before, after = self._at(first, jump), self._at(second, jump)
        return np.asarray(pin.difference(self.robot.model, before, after)) / step

    @property
    def knots(self) -> np.ndarray:
        """Start and end; both sides of every take-off and landing, between which a kink is rounded; more for turns."""
        found = np.array([0.0, 1.0])
        if self.apex:
            kinks = [jump + at for jump in range(self.count) for at in (0.5 * self.stance, 1.0 - 0.5 * self.stance)]
            found = np.add.outer(kinks, (-ROUNDED_KINK, ROUNDED_KINK)).ravel() / self.count
        if unit_entries(self.robot.configuration_names):
            found = np.concatenate([found, np.linspace(0.0, 1.0, 1 + KNOTS_OF_A_TURN * self.count)])
        return self.duration * np.unique(np.clip(np.append(found, [0.0, 1.0]), 0.0, 1.0).round(9))

    def _jump(self, time: float) -> int:
        return min(int(time / self.duration * self.count + SAME_PART), self.count - 1)

    def _at(self, time: float, jump: int) -> np.ndarray:
        s = time / self.duration * self.count - jump
        s = min(max((s - 0.5 * self.stance) / (1.0 - self.stance), 0.0), 1.0)
        line = self._line((jump + s) / self.count)
        if not self.apex:
            return line
        names, takeoff = self.robot.configuration_names, self._line(jump / self.count)
        top, turning = with_values(self.robot, self.apex, takeoff), quaternion_entries(names)
        circles = turn_entries(names)
        turns = {entry for joint in turning for entry in (*angles_of(joint), *quaternion_of(joint))}
        turns |= {entry for joint in circles for entry in (joint, *turn_of(joint))}
        for name, apex in self.apex.items():
            if name not in turns:
                coordinate = names.index(name)
                line[coordinate] += (apex - takeoff[coordinate]) * 4.0 * s * (1.0 - s)
        for joint, at in turning.items():
            if any(entry in self.apex for entry in (*angles_of(joint), *quaternion_of(joint))):
                line[at] = with_turn(line[at], takeoff[at], top[at], 4.0 * s * (1.0 - s))
        for joint, at in circles.items():
            if any(entry in self.apex for entry in (joint, *turn_of(joint))):
                angle = measured_deviation(names, top, takeoff)[joint]
                line[at] = turned_by(line[at], angle * 4.0 * s * (1.0 - s))
        return np.asarray(pin.normalize(self.robot.model, line))

    def _line(self, s: float) -> np.ndarray:
        return interpolated(self.robot, self.start, self.goal, s)
