"""Dry friction of joints and of limit surfaces in numbers: what a force leaves unused, and how fast a unit slides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.robot import Robot


@dataclass(frozen=True)
class DryFriction:
    """Velocity coordinates with dry friction, one by one or several with one limit surface: n_f coordinates.

    The friction of a unit is f_k = -F_k e_k where it slides, with the direction e of its scaled velocity
    v~_k = F_k / F_1 v_k; of a single coordinate that is a sign.

    Attributes:
        coordinates: numbers of the velocity coordinates, (n_f).
        limit: F, N or N m, (n_f).
        units: of every joint, and every limit surface, the numbers of its coordinates among these.
    """

    coordinates: np.ndarray
    limit: np.ndarray
    units: tuple[np.ndarray, ...]

    @classmethod
    def of_joints(cls, coordinates: np.ndarray, limit: np.ndarray) -> DryFriction:
        """Return the dry friction of joints, each by itself.

        Args:
            coordinates: numbers of the velocity coordinates, (n_f).
            limit: F, N or N m, (n_f).
        """
        return cls(coordinates, limit, tuple(np.array([i]) for i in range(len(coordinates))))

    @classmethod
    def of(cls, robot: Robot) -> DryFriction:
        """Return the dry friction of a robot."""
        limits, names = robot.dry_friction_limits, robot.velocity_names
        coordinates = np.flatnonzero(limits)
        at = {names[row]: i for i, row in enumerate(coordinates)}
        surfaces = [np.array([at[name] for name in own]) for own in robot.limit_surfaces.values()]
        shared = {int(i) for own in surfaces for i in own}
        alone = [np.array([i]) for i in range(len(coordinates)) if i not in shared]
        units = sorted([*alone, *surfaces], key=lambda own: int(own[0]))
        return cls(coordinates, limits[coordinates], tuple(units))

    @cached_property
    def surfaces(self) -> tuple[np.ndarray, ...]:
        """The units of several coordinates."""
        return tuple(unit for unit in self.units if len(unit) > 1)

    @cached_property
    def firsts(self) -> frozenset[int]:
        """Numbers of the first coordinate of every unit, which stands for it where it begins or ceases to slide."""
        return frozenset(int(unit[0]) for unit in self.units)

    def unused(self, unit: np.ndarray, force: np.ndarray) -> float:
        """Return what a force leaves of the limit of a unit, F_1 (1 - |f / F|), N or N m.

        Args:
            unit: one of `units`.
            force: of all coordinates, N or N m, (n_f).
        """
        first = float(self.limit[unit[0]])
        return first * (1.0 - float(np.linalg.norm(force[unit] / self.limit[unit])))

    def scaled(self, unit: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return v~ of a unit, m/s or rad/s.

        Args:
            unit: one of `units`.
            velocity: of all coordinates with dry friction, m/s or rad/s, (n_f).
        """
        return np.asarray(self.limit[unit] / self.limit[unit[0]] * velocity[unit])

    def resting(self, velocity: np.ndarray, slow: float) -> np.ndarray:
        """Return which coordinates belong to a unit that does not slide, (n_f) of bool.

        Args:
            velocity: of all coordinates with dry friction, (n_f).
            slow: speed, m/s or rad/s, up to which nothing slides.
        """
        rests = np.zeros(len(self.limit), dtype=bool)
        for unit in self.units:
            rests[unit] = np.abs(velocity[unit]).max() <= slow
        return rests

    def headings(
        self, velocity: np.ndarray, before: np.ndarray | None = None, *, slow: float, through_zero: bool = False
    ) -> np.ndarray:
        """Return the directions e in which units slide, (n_f); 1 of a single coordinate, whose mode has the sign.

        Args:
            velocity: of all coordinates with dry friction, (n_f).
            before: directions shortly before, (n_f), which a unit without a velocity keeps; zeros if omitted.
            slow: speed, m/s, up to which a velocity has no direction.
            through_zero: whether a velocity that has turned round, as it does just beyond the end of a slide, keeps the
                sign of its direction.
        """
        result = np.ones(len(self.limit))
        for unit in self.surfaces:
            own, known = self.scaled(unit, velocity), np.zeros(len(unit)) if before is None else before[unit]
            size = float(np.linalg.norm(own))
            sign = -1.0 if through_zero and float(own @ known) < 0 else 1.0
            result[unit] = sign * own / size if size > slow else known
        return result
