"""The dynamic complementarity system that every nonsmooth model is reduced to before it is discretised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.errors import DimensionError


@dataclass(frozen=True)
class Exclusion:
    """Where level(x) > 0, share(z) = 0 or rest(z) = 0: max(level, 0) * share * rest = 0 with share, rest >= 0.

    Within a finite element the condition is held between every point and every stage. The level is a function of the
    state, so that the left boundary of an element takes part without variables of its own.

    Attributes:
        name: what the condition forbids, for messages.
        level, share, rest: SX in x, z, z; no `rest` means 1.
        boundary_only: hold the condition for the left boundary of each element only.
        rank: 0 decides where contact is, 1 what happens there; a homotopy may relax rank 1 further than rank 0.
        kept: the level is one of the states, and where it is zero and the share is not, the other conditions keep it
            there: its rate vanishes. A smooth problem then asks for it once, where the share begins.
    """

    name: str
    level: ca.SX
    share: ca.SX
    rest: ca.SX | None = None
    boundary_only: bool = False
    rank: int = 0
    kept: bool = False


@dataclass(frozen=True)
class ComplementaritySystem:
    """E(x) x' = f(x, u, z, p), 0 = g(x, z, p), 0 = e(x, u, z, p), 0 <= a(z) complementary to b(z) >= 0.

    The multipliers a are continuous in time (up to the exceptions their model names), their partners b are not; finite
    elements with switch detection rest on this difference.

    Args:
        state, control, parameters, algebraic: SX columns x (n_x), u (n_u), p (n_p), z (n_z).
        mass_matrix: E, SX (n_x, n_x).
        right_hand_side: f, SX (n_x).
        residual: g, SX: the relations between the switching functions of x and the multipliers, and lifted products.
        multiplier, partner: a and b, SX columns of one length.
        algebraic_lower, algebraic_upper: bounds of z.
        selection: cost added at every stage, not multiplied by a step; picks one z where several are valid.
        guess: (x, u, p) -> z, numbers consistent with the state.
        exclusions: further conditions between state and algebraic variables.
        equations: e, SX: further algebraic equations of the model, none if omitted.
        quadratures: name -> integrand in x, u, z, p that a simulation accumulates.
        lifted: name -> definition of every product that became an algebraic variable, to be looked at.
        describe: (n_pairs) booleans, where the partner may be positive -> the regions or step values in words.
        state_names, control_names, algebraic_names, pair_names: one name an entry.

    Raises:
        DimensionError: an expression or a list of names of the wrong length.
    """

    state: ca.SX
    control: ca.SX
    parameters: ca.SX
    algebraic: ca.SX
    mass_matrix: ca.SX
    right_hand_side: ca.SX
    residual: ca.SX
    multiplier: ca.SX
    partner: ca.SX
    algebraic_lower: np.ndarray
    algebraic_upper: np.ndarray
    selection: ca.SX
    guess: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    state_names: Sequence[str]
    control_names: Sequence[str]
    algebraic_names: Sequence[str]
    pair_names: Sequence[str]
    exclusions: Sequence[Exclusion] = ()
    equations: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    quadratures: Mapping[str, ca.SX] = field(default_factory=dict)
    lifted: Mapping[str, ca.SX] = field(default_factory=dict)
    describe: Callable[[np.ndarray], str] | None = None

    def __post_init__(self) -> None:
        n_x, n_u, n_z, n_pairs = (part.numel() for part in (self.state, self.control, self.algebraic, self.multiplier))
        for what, found, expected in (
            ("mass_matrix", self.mass_matrix.shape, (n_x, n_x)),
            ("right_hand_side", self.right_hand_side.shape, (n_x, 1)),
            ("partner", self.partner.shape, (n_pairs, 1)),
            ("equations", self.equations.shape, (self.equations.numel(), 1)),
            *((f"quadratures['{name}']", integrand.shape, (1, 1)) for name, integrand in self.quadratures.items()),
            ("algebraic_lower", self.algebraic_lower.shape, (n_z,)),
            ("algebraic_upper", self.algebraic_upper.shape, (n_z,)),
            ("state_names", (len(self.state_names),), (n_x,)),
            ("control_names", (len(self.control_names),), (n_u,)),
            ("algebraic_names", (len(self.algebraic_names),), (n_z,)),
            ("pair_names", (len(self.pair_names),), (n_pairs,)),
        ):
            if tuple(found) != tuple(expected):
                raise DimensionError(f"complementarity system: {what} has shape {found}, expected {expected}")

    @property
    def arguments(self) -> list[ca.SX]:
        """[x, u, z, p], the arguments of every function of this system."""
        return [self.state, self.control, self.algebraic, self.parameters]
