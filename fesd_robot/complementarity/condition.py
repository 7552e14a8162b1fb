"""A complementarity condition as a value that all rooms share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal

import casadi as ca

from fesd_robot.complementarity.branch import ActiveFactor
from fesd_robot.complementarity.labels import Label
from fesd_robot.errors import DimensionError, ModelError

Level = Literal["position", "velocity"]
"""Whether a switching function is one of positions or of velocities; the latter may be relaxed further.

In contact, the position level decides where contact is, the velocity level what happens there.
"""


class HeldAt(Enum):
    """Where within a finite element a condition is held."""

    POINTS = "points"
    """For G at all points, the left boundary among them."""
    LEFT_BOUNDARY = "left boundary"
    """For G at the left boundary only."""
    RIGHT_BOUNDARY = "right boundary"
    """For G at the last point only."""
    STAGES = "stages"
    """For G at the stages only, where G is a function of the algebraic variables, too."""
    POINTS_AND_STAGES = "points and stages"
    """For G of the state at every point with the algebraic variables of every stage: its sign does not change inside an
    element."""

    @property
    def algebraic(self) -> bool:
        """Whether G may be a function of the algebraic variables."""
        return self in (HeldAt.STAGES, HeldAt.POINTS_AND_STAGES)


@dataclass(frozen=True, eq=False)
class Complementarity:
    """A condition 0 <= G complementary to H >= 0, or a vanishing constraint max(G, 0) H = 0 with H >= 0.

    A vanishing constraint lets its switching function G have any sign; where G > 0 its multiplier H vanishes. With a
    `complement` C >= 0 it reads max(G, 0) H C = 0: a third factor may vanish instead.

    In a dynamic complementarity system G, H and C are scalars in the state x and the algebraic variables z: G is
    continuous in time, H is not. Finite elements with switch detection rest on this difference; only a condition for
    the stages alone may have another G, and only a pair with `continuous` sides an H that is. In the block of an MPCC
    G and H are scalars in the block's variables, and a complement is a factor of G.

    Args:
        label: what the condition is.
        G: SX scalar, the multiplier of a switching function (Stewart, Heaviside) or the switching function itself.
        H: SX scalar, the Filippov multiplier or step.
        vanishing: G may have any sign.
        complement: C, SX scalar; none if omitted.
        level: a homotopy may relax conditions of the velocity level further than those of the position level.
        invariant: G is one of the states, and where it is zero and H is not, the other conditions keep it there: its
            rate vanishes. A smooth problem asks for it once, where H begins to be positive (index reduction).
        held_at: where within a finite element it is held.
        initial_value_factor: within a finite element this times G at the left boundary is added to G at a point, so
            that the condition depends on how the element begins. Only of a vanishing constraint without a complement
            whose G is a function of the state.
        vanish_together: algebraic variables that vanish wherever H does, by rows of the system: a smooth problem that
            holds H at zero holds them there, too, and leaves those rows out.
        vector_component: G is a component of a vector: of the conditions of a contact with this H and a G of their own
            either all G are the active factor, or all H, or all complements.
        implied_by: (kind, active factor) of other conditions of the contact that imply this one: where one of them has
            that active factor, a smooth problem does not hold this one again.
        spare: an algebraic variable by which H is larger than the least that it may be where it does not vanish; of a
            vanishing constraint whose H is 0 or at least so much. A smooth problem holds it at zero or above where G is
            the active factor. None if H may be anything.
        rate_share: H is a share of the clock's rate: with those of the other conditions of its label's joint it adds
            up to that rate, by a row of the system. Where a complement vanishes the clock stands still, and all shares
            vanish whatever G is.
        idle: algebraic variables that a smooth problem holds at zero where the clock stands still, and where the
            condition then means nothing; empty if it has a meaning there.
        vanishes_at_rest: of a condition that rest implies: an algebraic variable that a smooth problem holds at zero
            where rest begins, in place of G; None if it holds the slope of G there.
        only_at_rest: of a condition that rest implies: a smooth problem holds nothing of it but that slope, because
            others imply it elsewhere.
        continuous: H of a pair is continuous in time, too: it takes part at the left boundary of a finite element, as G
            does, so that neither side is left before it is zero.

    Raises:
        DimensionError: a factor that is not a scalar.
        ModelError: a complement in a condition that is not a vanishing constraint, or an initial value of G beside one.

    Source: Luo, Pang, Ralph, Mathematical Programs with Equilibrium Constraints (1996); for vanishing constraints
    Achtziger, Kanzow, Math. Program. 114 (2008).
    """

    label: Label
    G: ca.SX
    H: ca.SX
    vanishing: bool = False
    complement: ca.SX | None = None
    level: Level = "position"
    invariant: bool = False
    held_at: HeldAt = HeldAt.POINTS
    initial_value_factor: float = 0.0
    vanish_together: tuple[ca.SX, ...] = ()
    vector_component: bool = False
    implied_by: tuple[tuple[str, ActiveFactor], ...] = ()
    spare: ca.SX | None = None
    rate_share: bool = False
    idle: tuple[ca.SX, ...] = ()
    vanishes_at_rest: ca.SX | None = None
    only_at_rest: bool = False
    continuous: bool = False

    def __post_init__(self) -> None:
        for name, factor in (("G", self.G), ("H", self.H), ("complement", self.complement), ("spare", self.spare)):
            if factor is not None and factor.shape != (1, 1):
                raise DimensionError(f"{name} of '{self.label}' has shape {factor.shape}, expected (1, 1)")
        if self.complement is not None and not self.vanishing:
            raise ModelError(f"'{self.label}' has a complement, which only a vanishing constraint can have")
        if self.initial_value_factor and (not self.vanishing or self.complement is not None):
            raise ModelError(
                f"'{self.label}' adds the initial value of G, which only a vanishing constraint without a complement "
                "can do"
            )
        if self.continuous and self.vanishing:
            raise ModelError(f"'{self.label}' has a continuous H, which only a pair can have")
        if self.spare is not None and not self.vanishing:
            raise ModelError(f"'{self.label}' has a least H, which only a vanishing constraint can have")
        if self.rate_share and self.label.joint is None:
            raise ModelError(f"'{self.label}' is about a share of no joint, whose shares add up")

    @property
    def at_least(self) -> Complementarity | None:
        """The vanishing constraint that H is 0 or has something to spare, max(-spare, 0) H C = 0; None without one."""
        if self.spare is None:
            return None
        return Complementarity(
            replace(self.label, kind=f"reserve of {self.label.kind}"),
            -self.spare,
            self.H,
            vanishing=True,
            complement=self.complement,
            level=self.level,
            held_at=HeldAt.STAGES,
        )
