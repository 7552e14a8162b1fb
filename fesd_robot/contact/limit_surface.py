"""Limit surfaces: the friction under an object that slides and turns on a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Complementarity, HeldAt, Label
from fesd_robot.contact.kinds import (
    BACKWARDS,
    FORWARDS,
    FRICTION_ACROSS_SLIDING,
    FRICTION_AGAINST_SLIDING,
    FRICTION_WITH_SLIDING,
    LEFTWARDS,
    RIGHTWARDS,
    SLIDING_INSIDE_SURFACE,
)
from fesd_robot.contact.model import ContactSystem, MultibodyDynamics

_ODD = np.sqrt([1.0, 2.0, 3.0]) / np.sqrt(6.0)
"""A direction in which no slide ends."""

_ACROSS = np.linalg.svd(_ODD[None])[2][1:]
"""Two axes across it."""

SPEED = "speed"
"""Subject of the condition on the speed of a slide."""


def with_limit_surfaces(contact_system: ContactSystem, dynamics: MultibodyDynamics) -> ContactSystem:
    """Return the contact system in which objects rub on a table, exactly, with an ellipsoid for their limit surface.

    The friction tau_k = F_k g_k on the m coordinates of an object keeps to ``|g| <= 1``, and takes as much power as it
    can. With the velocities v~_k = F_k / F_1 v_k, in m/s where F_1 is a force, the speed of the slide gamma >= 0, and
    the part of the surface that is unused, kappa = 1 - |g|^2 >= 0,

    - an object slides only with its friction on the surface: ``v_k != 0 => kappa = 0`` between all points of a finite
      element, and ``gamma != 0 => kappa = 0`` at the stages;
    - its friction is against the slide: ``v~ + gamma g = 0`` at the stages, and ``max(g . v~, 0) = 0`` between all
      points of an element, in which a slide does not turn back;
    - where a slide ends v~ is zero and says nothing about the direction: g is parallel to the slope of v~ there.

    So g is -v~ / |v~| where it slides, in any direction, and anything inside the ellipsoid where it rests. The force
    fades with the clock, whose rate theta_ODE is a factor of it and of every condition: while the clock stands still
    nothing is left of them, so that friction has no impulse.

    Args:
        contact_system: in the multiplier form.
        dynamics: whose `limit_surfaces` have coordinates with limits F.

    Source: Goyal, Ruina, Papadopoulos, Planar sliding with dry friction, Wear 143 (1991), for limit surfaces; Howe and
    Cutkosky, Practical force-motion models for sliding manipulation, International Journal of Robotics Research 15
    (1996), for the ellipsoid. Its form as vanishing constraints is ours.
    """
    surfaces = [_Surface.of(name, number, dynamics) for number, name in enumerate(dynamics.limit_surfaces)]
    if not surfaces:
        return contact_system
    system, rate = contact_system.system, contact_system.theta_ode
    right_hand_side, speed = ca.SX(system.right_hand_side), system.control[-1]
    first = dynamics.configuration.numel()
    of_joints = dict(zip(_alone(dynamics), contact_system.theta_joints, strict=True))
    for one in surfaces:
        for row, limit, fraction in zip(one.rows, one.limits, one.fractions, strict=True):
            right_hand_side[first + row] += speed * rate * limit * fraction
            of_joints[row] = (-rate * fraction, ca.SX(0))

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.concatenate([system.guess(x, u, p), *(one.guess(x[first:]) for one in surfaces)])

    count = len(surfaces)
    return replace(
        contact_system,
        system=replace(
            system,
            right_hand_side=right_hand_side,
            algebraic=ca.vertcat(system.algebraic, *(one.variables for one in surfaces)),
            residual=ca.vertcat(system.residual, *(one.used - ca.sumsqr(one.fraction) for one in surfaces)),
            algebraic_lower=np.concatenate([system.algebraic_lower, *(one.lower for one in surfaces)]),
            algebraic_upper=np.concatenate([system.algebraic_upper, *(one.upper for one in surfaces)]),
            guess=guess,
            algebraic_names=[*system.algebraic_names, *(name for one in surfaces for name in one.names)],
            complementarities=[
                *system.complementarities,
                *(condition for one in surfaces for condition in one.conditions(rate)),
            ],
        ),
        theta_joints=[of_joints[row] for row in sorted(of_joints)] if count else contact_system.theta_joints,
    )


def _alone(dynamics: MultibodyDynamics) -> list[int]:
    """Return the velocity coordinates with dry friction that belong to no limit surface."""
    shared = {name for names in dynamics.limit_surfaces.values() for name in names}
    names = enumerate(dynamics.velocity_names)
    return [i for i, name in names if dynamics.dry_friction.get(name, 0.0) > 0 and name not in shared]


@dataclass(frozen=True)
class _Surface:
    """The variables of one limit surface.

    Attributes:
        name: of the surface.
        coordinates: names of its velocity coordinates.
        rows: which these are.
        limits: F, N or N m.
        velocities: v, SX scalars.
        fraction: g, SX (m).
        used: |g|^2, SX scalar.
        speed: gamma, m/s, SX scalar.
    """

    name: str
    coordinates: Sequence[str]
    rows: Sequence[int]
    limits: Sequence[float]
    velocities: Sequence[ca.SX]
    fraction: ca.SX
    used: ca.SX
    speed: ca.SX

    @classmethod
    def of(cls, name: str, number: int, dynamics: MultibodyDynamics) -> _Surface:
        """Return the variables of a surface of a mechanism."""
        coordinates = tuple(dynamics.limit_surfaces[name])
        rows = [list(dynamics.velocity_names).index(one) for one in coordinates]
        return cls(
            name,
            coordinates,
            rows,
            [float(dynamics.dry_friction[one]) for one in coordinates],
            [dynamics.velocity[row] for row in rows],
            ca.SX.sym(f"fraction{number}", len(rows)),
            ca.SX.sym(f"used{number}"),
            ca.SX.sym(f"slide{number}"),
        )

    @property
    def fractions(self) -> list[ca.SX]:
        """Entries of g."""
        return list(ca.vertsplit(self.fraction))

    @property
    def variables(self) -> ca.SX:
        """All algebraic variables."""
        return ca.vertcat(self.fraction, self.used, self.speed)

    @property
    def names(self) -> list[str]:
        """Their names."""
        return [*(f"friction[{one}]" for one in self.coordinates), f"used[{self.name}]", f"speed[{self.name}]"]

    @property
    def lower(self) -> np.ndarray:
        """Their lower bounds."""
        return np.append(np.full(len(self.rows), -np.inf), [0.0, 0.0])

    @property
    def upper(self) -> np.ndarray:
        """Their upper bounds."""
        return np.append(np.full(len(self.rows), np.inf), [1.0, np.inf])

    @property
    def scaled(self) -> list[ca.SX]:
        """The velocities v~, m/s."""
        return [limit / self.limits[0] * v for limit, v in zip(self.limits, self.velocities, strict=True)]

    def guess(self, velocity: np.ndarray) -> np.ndarray:
        """Return a start of the variables: friction against the slide, inside the surface."""
        scaled = np.array(self.limits) / self.limits[0] * velocity[list(self.rows)]
        size = float(np.linalg.norm(scaled))
        fraction = -0.5 * scaled / max(size, np.finfo(float).tiny)
        return np.concatenate([fraction, [float(fraction @ fraction), size]])

    def conditions(self, rate: ca.SX) -> Iterator[Complementarity]:
        """Yield the vanishing constraints.

        Args:
            rate: theta_ODE.
        """
        unused, idle = 1 - self.used, tuple(ca.vertsplit(self.variables))
        complement = None if rate.is_constant() else rate

        def inside(subject: str, G: ca.SX, held_at: HeldAt = HeldAt.POINTS) -> Complementarity:
            return Complementarity(
                Label(SLIDING_INSIDE_SURFACE, subject, joint=self.name),
                G,
                unused,
                vanishing=True,
                complement=complement,
                level="velocity",
                held_at=held_at,
                vector_component=True,
                idle=idle,
            )

        def against(kind: str, subject: str, G: ca.SX, held_at: HeldAt) -> Complementarity:
            return Complementarity(
                Label(kind, subject, joint=self.name),
                G,
                rate,
                vanishing=True,
                level="velocity",
                held_at=held_at,
                implied_by=((SLIDING_INSIDE_SURFACE, ActiveFactor.G),),
                idle=idle,
                vanishes_at_rest=self.speed if kind == FRICTION_AGAINST_SLIDING else None,
                only_at_rest=kind == FRICTION_ACROSS_SLIDING,
            )

        for name, velocity in zip(self.coordinates, self.velocities, strict=True):
            yield inside(f"{name} {BACKWARDS}", -velocity)
            yield inside(f"{name} {FORWARDS}", velocity)
        yield inside(SPEED, self.speed, HeldAt.STAGES)
        for name, velocity, fraction in zip(self.coordinates, self.scaled, self.fractions, strict=True):
            left = velocity + self.speed * fraction
            yield against(FRICTION_AGAINST_SLIDING, f"{name} {FORWARDS}", left, HeldAt.STAGES)
            yield against(FRICTION_AGAINST_SLIDING, f"{name} {BACKWARDS}", -left, HeldAt.STAGES)
        for number, across in enumerate(self._across()):
            for side, G in ((LEFTWARDS, across), (RIGHTWARDS, -across)):
                yield against(FRICTION_ACROSS_SLIDING, f"{side} {number}", G, HeldAt.STAGES)
        power = ca.dot(self.fraction, ca.vertcat(*self.scaled))
        yield against(FRICTION_WITH_SLIDING, "", power, HeldAt.POINTS_AND_STAGES)

    def _across(self) -> list[ca.SX]:
        """Return as many products as make the friction parallel to the slide: g x v~, in space along two axes.

        Three are one too many, and none of two may be left out for every direction: the axes are those across one in
        which, to a digit, nothing is pushed.
        """
        scaled = ca.vertcat(*self.scaled)
        if len(self.rows) == 2:
            return [self.fraction[0] * scaled[1] - self.fraction[1] * scaled[0]]
        product = ca.cross(self.fraction, scaled)
        return [ca.dot(ca.SX(axis), product) for axis in _ACROSS]
