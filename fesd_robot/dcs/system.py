"""The dynamic complementarity system that every nonsmooth model is reduced to before it is discretised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, HeldAt
from fesd_robot.dcs.jump import Impulse, Jump
from fesd_robot.errors import DimensionError


@dataclass(frozen=True, eq=False)
class ComplementaritySystem:
    """A nonsmooth system: E(x) x' = f(x, u, z, p), 0 = g(x, u, z, p), 0 = e(x, u, z, p), and complementarities.

    In ``0 <= G(z) complementary to H(z) >= 0`` the multipliers G of switching functions are continuous in time (up to
    the exceptions their model names), H are not; finite elements with switch detection rest on this difference. The
    G of a vanishing constraint is a function of the state.

    Args:
        state, control, parameters, algebraic: SX columns x (n_x), u (n_u), p (n_p), z (n_z).
        mass_matrix: E, SX (n_x, n_x).
        right_hand_side: f, SX (n_x).
        residual: g, SX: the relations between the switching functions of x and the multipliers, lifted products, and
            copies of controls.
        complementarities: the conditions; G and H of those that are no vanishing constraints are functions of z.
        algebraic_lower, algebraic_upper: bounds of z.
        state_lower: lower bounds of x that belong to the system, as a gap's; a simulation keeps them, and a problem of
            optimal control states its own. None if there are none.
        regularisation: cost added at every stage, not multiplied by a step; picks one z where several are valid.
        regularisation_name: name of that term of the cost.
        guess: (x, u, p) -> z, numbers consistent with the state.
        equations: e, SX: further algebraic equations of the model, none if omitted.
        quadratures: name -> integrand in x, u, z, p that a simulation accumulates.
        lifted: name -> definition of every product that became an algebraic variable, to be looked at.
        describe: (n_pairs) booleans, where H may be positive -> the regions or step values in words; behind them, of a
            system that jumps, whether each impulse acts where the mode begins.
        control_copies: number of an algebraic variable -> number of the control that a row of the system says it is: a
            smooth problem that holds one at zero holds the other one, too, and leaves that row out.
        jump: what may happen to the state between two finite elements; None if the state is continuous.
        state_names, control_names, algebraic_names: one name an entry.

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
    algebraic_lower: np.ndarray
    algebraic_upper: np.ndarray
    regularisation: ca.SX
    guess: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    state_names: Sequence[str]
    control_names: Sequence[str]
    algebraic_names: Sequence[str]
    complementarities: Sequence[Complementarity] = ()
    regularisation_name: str = "regularisation of the step functions"
    equations: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    quadratures: Mapping[str, ca.SX] = field(default_factory=dict)
    lifted: Mapping[str, ca.SX] = field(default_factory=dict)
    describe: Callable[[np.ndarray], str] | None = None
    state_lower: np.ndarray | None = None
    control_copies: Mapping[int, int] = field(default_factory=dict)
    jump: Jump | None = None

    def __post_init__(self) -> None:
        n_x, n_u, n_z = (part.numel() for part in (self.state, self.control, self.algebraic))
        for what, shape, expected in (
            ("mass_matrix", self.mass_matrix.shape, (n_x, n_x)),
            ("right_hand_side", self.right_hand_side.shape, (n_x, 1)),
            ("equations", self.equations.shape, (self.equations.numel(), 1)),
            *((f"quadratures['{name}']", integrand.shape, (1, 1)) for name, integrand in self.quadratures.items()),
            ("algebraic_lower", self.algebraic_lower.shape, (n_z,)),
            ("algebraic_upper", self.algebraic_upper.shape, (n_z,)),
            ("state_lower", (n_x,) if self.state_lower is None else self.state_lower.shape, (n_x,)),
            ("state_names", (len(self.state_names),), (n_x,)),
            ("control_names", (len(self.control_names),), (n_u,)),
            ("algebraic_names", (len(self.algebraic_names),), (n_z,)),
        ):
            if tuple(shape) != tuple(expected):
                raise DimensionError(f"complementarity system: {what} has shape {shape}, expected {expected}")

    @cached_property
    def compiled(self) -> dict[Any, Any]:
        """What was made of this system once, to be used again."""
        return {}

    def in_words(self, mode: np.ndarray) -> str:
        """Return the regions or step values of a mode, (n_pairs) booleans where H may be positive."""
        if self.describe:
            return self.describe(mode)
        return ", ".join(str(pair.label) for pair, active in zip(self.pairs, mode, strict=True) if active)

    @cached_property
    def switches_in_pairs(self) -> bool:
        """Whether every switch is one of a pair: no vanishing constraints but those that follow an impulse."""
        return all(one.held_at is HeldAt.LEFT_BOUNDARY and self.jump is not None for one in self.vanishing)

    @cached_property
    def impulses(self) -> tuple[Impulse, ...]:
        """The impulses that make the state jump, none where it is continuous."""
        return () if self.jump is None else self.jump.impulses

    @property
    def arguments(self) -> list[ca.SX]:
        """[x, u, z, p], the arguments of every function of this system."""
        return [self.state, self.control, self.algebraic, self.parameters]

    @cached_property
    def pairs(self) -> tuple[Complementarity, ...]:
        """The conditions 0 <= G complementary to H >= 0."""
        return tuple(condition for condition in self.complementarities if not condition.vanishing)

    @cached_property
    def vanishing(self) -> tuple[Complementarity, ...]:
        """The vanishing constraints max(G, 0) H = 0."""
        return tuple(condition for condition in self.complementarities if condition.vanishing)

    @cached_property
    def G(self) -> ca.SX:
        """G of all pairs, SX (n_pairs)."""
        return ca.vertcat(ca.SX(0, 1), *[pair.G for pair in self.pairs])

    @cached_property
    def H(self) -> ca.SX:
        """H of all pairs, SX (n_pairs)."""
        return ca.vertcat(ca.SX(0, 1), *[pair.H for pair in self.pairs])
