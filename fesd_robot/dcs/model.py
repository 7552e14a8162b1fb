"""The part of all nonsmooth models besides their switches, checked and with the defaults filled in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs.checks import as_expression, as_symbols, check_content, check_distinct, check_shape
from fesd_robot.errors import DimensionError, ModelError

GuessFunction = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(x, u, p) -> values."""

OMITTED: Any = None
"""A field that is filled in when the value is made."""


@checked
@dataclass(frozen=True, eq=False)
class Model:
    """States, controls, parameters and algebraic equations that switches are added to.

    All parts but the state may be left out, and expressions may be numbers. The attributes of a model are complete:
    symbols as SX columns, expressions as SX, bounds as arrays, names as lists.

    Args:
        state: x, SX symbols (n_x).
        control, parameters: u and p, SX symbols; none if omitted.
        algebraic: z, the model's own algebraic variables, SX symbols (n_z); none if omitted.
        equations: SX (n_z) in x, u, z, p, held at zero.
        algebraic_lower, algebraic_upper: bounds of z, (n_z); none if omitted.
        algebraic_guess: values of z, (n_z), or (x, u, p) -> values; zeros if omitted.
        quadratures: name -> integrand, SX scalar in x, u, z, p, that a simulation accumulates.
        mass_matrix: E, SX (n_x, n_x); identity if omitted.
        state_names, control_names, algebraic_names: for messages and results; x0, u0, z0, ... if omitted.

    Raises:
        DimensionError: an expression, bound, guess or list of names of the wrong shape.
        ModelError: no state, a symbol that occurs twice or is none, an unknown symbol in the mass matrix, bounds that
            are not in order, a guess that is not finite.
    """

    state: ca.SX
    control: ca.SX = OMITTED
    parameters: ca.SX = OMITTED
    algebraic: ca.SX = OMITTED
    equations: ca.SX = OMITTED
    algebraic_lower: np.ndarray = OMITTED
    algebraic_upper: np.ndarray = OMITTED
    algebraic_guess: np.ndarray | GuessFunction = OMITTED
    quadratures: Mapping[str, ca.SX] = OMITTED
    mass_matrix: ca.SX = OMITTED
    state_names: Sequence[str] = OMITTED
    control_names: Sequence[str] = OMITTED
    algebraic_names: Sequence[str] = OMITTED

    def __post_init__(self) -> None:
        for name in ("state", "control", "parameters", "algebraic"):
            object.__setattr__(self, name, as_symbols(name, getattr(self, name)))
        n_x, n_u, n_z = (part.numel() for part in (self.state, self.control, self.algebraic))
        if not n_x:
            raise ModelError("state is empty, need at least one differential state")
        self._complete(n_x, n_u, n_z)
        check_distinct(self.symbols)
        check_shape("mass_matrix", self.mass_matrix, (n_x, n_x))
        check_content("mass_matrix", self.mass_matrix, self.symbols)
        check_shape("equations", self.equations, (n_z, 1), ", one equation an algebraic variable")
        for name, integrand in self.quadratures.items():
            check_shape(f"quadratures['{name}']", integrand, (1, 1))
        for what, n in (("state_names", n_x), ("control_names", n_u), ("algebraic_names", n_z)):
            if len(getattr(self, what)) != n:
                raise DimensionError(f"{what} has shape ({len(getattr(self, what))},), expected ({n},)")
        for i in np.flatnonzero(~(self.algebraic_lower <= self.algebraic_upper)):
            raise ModelError(
                f"algebraic_lower[{i}] is {self.algebraic_lower[i]:g} and algebraic_upper[{i}] is "
                f"{self.algebraic_upper[i]:g}, must be in increasing order"
            )

    def _complete(self, n_x: int, n_u: int, n_z: int) -> None:
        """Fill in what was omitted, and turn numbers into expressions and arrays."""
        complete = {
            "mass_matrix": ca.SX.eye(n_x)
            if self.mass_matrix is None
            else as_expression("mass_matrix", self.mass_matrix),
            "equations": ca.SX(0, 1) if self.equations is None else as_expression("equations", self.equations),
            "quadratures": {
                name: as_expression(f"quadratures['{name}']", integrand)
                for name, integrand in (self.quadratures or {}).items()
            },
            "algebraic_lower": _numbers("algebraic_lower", self.algebraic_lower, n_z, -np.inf),
            "algebraic_upper": _numbers("algebraic_upper", self.algebraic_upper, n_z, np.inf),
            "algebraic_guess": self.algebraic_guess
            if callable(self.algebraic_guess)
            else _finite("algebraic_guess", _numbers("algebraic_guess", self.algebraic_guess, n_z, 0.0)),
            "state_names": list(self.state_names or [f"x{i}" for i in range(n_x)]),
            "control_names": list(self.control_names or [f"u{i}" for i in range(n_u)]),
            "algebraic_names": list(self.algebraic_names or [f"z{i}" for i in range(n_z)]),
        }
        for name, value in complete.items():
            object.__setattr__(self, name, value)

    def check_contents(self, further: Mapping[str, ca.SX] | None = None) -> None:
        """Check what equations and quadratures use; which symbols that may be is known once there are switches.

        Args:
            further: name -> symbols of a group that they may use besides x, u, z, p.

        Raises:
            ModelError: an unknown symbol, a symbol that occurs twice, a constant that is not finite.
        """
        groups = {**self.symbols, **(further or {})}
        check_distinct(groups)
        check_content("equations", self.equations, groups)
        for name, integrand in self.quadratures.items():
            check_content(f"quadratures['{name}']", integrand, groups)

    @cached_property
    def symbols(self) -> dict[str, ca.SX]:
        """Name of every group of symbols -> its symbols."""
        return {
            "state": self.state,
            "control": self.control,
            "algebraic": self.algebraic,
            "parameters": self.parameters,
        }

    @property
    def continuous(self) -> dict[str, ca.SX]:
        """The groups that a switching function may depend on."""
        return {"state": self.state, "parameters": self.parameters}

    @property
    def discontinuous(self) -> dict[str, ca.SX]:
        """The groups that a switching function may not depend on."""
        return {"control": self.control, "algebraic": self.algebraic}

    def guess(self, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the guess of the model's own algebraic variables at a state, (n_z).

        Raises:
            DimensionError: a guess function that returns another number of values.
        """
        if not callable(self.algebraic_guess):
            return self.algebraic_guess
        values = np.asarray(self.algebraic_guess(x, u, p), dtype=float)  # a column if it comes from a casadi function
        n_z = self.algebraic.numel()
        if values.shape not in ((n_z,), (n_z, 1)):
            raise DimensionError(f"algebraic_guess returned shape {values.shape}, expected ({n_z},)")
        return values.reshape(n_z)


def _numbers(name: str, given: np.ndarray | None, n: int, default: float) -> np.ndarray:
    if given is None:
        return np.full(n, default)
    values = np.asarray(given, dtype=float)
    if values.shape != (n,):
        raise DimensionError(f"{name} has shape {values.shape}, expected ({n},)")
    return values


def _finite(name: str, values: np.ndarray) -> np.ndarray:
    for i in np.flatnonzero(~np.isfinite(values)):
        raise ModelError(f"{name}[{i}] is {values[i]}, must be finite")
    return values
