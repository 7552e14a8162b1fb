"""What all nonsmooth models have in common besides their switches, checked and with the defaults filled in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.dcs.checks import as_expression, as_symbols, check_content, check_distinct, check_shape
from fesd_robot.errors import DimensionError, ModelError

GuessFunction = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(x, u, p) -> values."""


@dataclass(frozen=True)
class ModelParts:
    """Symbols, mass matrix, algebraic equations, quadratures and names of a model.

    Attributes:
        state, control, parameters, algebraic: SX columns of symbols; algebraic are the model's own variables.
        mass_matrix: E, SX (n_x, n_x).
        equations: SX (number of algebraic).
        quadratures: name -> SX scalar.
        algebraic_lower, algebraic_upper: bounds, one an algebraic variable.
        algebraic_guess: (x, u, p) -> values of the algebraic variables.
        state_names, control_names, algebraic_names: one an entry.
    """

    state: ca.SX
    control: ca.SX
    parameters: ca.SX
    algebraic: ca.SX
    mass_matrix: ca.SX
    equations: ca.SX
    quadratures: Mapping[str, ca.SX]
    algebraic_lower: np.ndarray
    algebraic_upper: np.ndarray
    algebraic_guess: GuessFunction
    state_names: list[str]
    control_names: list[str]
    algebraic_names: list[str]

    @property
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


def model_parts(
    *,
    state: ca.SX,
    control: ca.SX | None,
    parameters: ca.SX | None,
    algebraic: ca.SX | None,
    equations: ca.SX | None,
    algebraic_lower: np.ndarray | None,
    algebraic_upper: np.ndarray | None,
    algebraic_guess: np.ndarray | GuessFunction | None,
    quadratures: Mapping[str, ca.SX] | None,
    mass_matrix: ca.SX | None,
    state_names: Sequence[str] | None,
    control_names: Sequence[str] | None,
    algebraic_names: Sequence[str] | None,
    further: Mapping[str, ca.SX] | None = None,
) -> ModelParts:
    """Return the parts of a model, checked; the arguments are those of `stewart`.

    Args:
        further: groups of symbols that equations and quadratures may use besides x, u, z, p.

    Raises:
        DimensionError: an expression, bound, guess or list of names of the wrong shape.
        ModelError: an unknown symbol, a symbol that occurs twice, a constant that is not finite, no state.
    """
    x, u, p, z = (
        as_symbols(name, value)
        for name, value in (
            ("state", state),
            ("control", control),
            ("parameters", parameters),
            ("algebraic", algebraic),
        )
    )
    n_x, n_z = x.numel(), z.numel()
    if not n_x:
        raise ModelError("state is empty, need at least one differential state")
    parts = ModelParts(
        state=x,
        control=u,
        parameters=p,
        algebraic=z,
        mass_matrix=ca.SX.eye(n_x) if mass_matrix is None else as_expression("mass_matrix", mass_matrix),
        equations=ca.SX(0, 1) if equations is None else as_expression("equations", equations),
        quadratures={name: as_expression(f"quadratures['{name}']", q) for name, q in (quadratures or {}).items()},
        algebraic_lower=_numbers("algebraic_lower", algebraic_lower, n_z, -np.inf),
        algebraic_upper=_numbers("algebraic_upper", algebraic_upper, n_z, np.inf),
        algebraic_guess=_guess(algebraic_guess, n_z),
        state_names=list(state_names or [f"x{i}" for i in range(n_x)]),
        control_names=list(control_names or [f"u{i}" for i in range(u.numel())]),
        algebraic_names=list(algebraic_names or [f"z{i}" for i in range(n_z)]),
    )
    groups = {**parts.symbols, **(further or {})}
    check_distinct(groups)
    check_shape("mass_matrix", parts.mass_matrix, (n_x, n_x))
    check_content("mass_matrix", parts.mass_matrix, parts.symbols)
    check_shape("equations", parts.equations, (n_z, 1), ", one equation an algebraic variable")
    check_content("equations", parts.equations, groups)
    for name, integrand in parts.quadratures.items():
        check_shape(f"quadratures['{name}']", integrand, (1, 1))
        check_content(f"quadratures['{name}']", integrand, groups)
    for what, names, n in (
        ("state_names", parts.state_names, n_x),
        ("control_names", parts.control_names, u.numel()),
        ("algebraic_names", parts.algebraic_names, n_z),
    ):
        if len(names) != n:
            raise DimensionError(f"{what} has shape ({len(names)},), expected ({n},)")
    for i in np.flatnonzero(~(parts.algebraic_lower <= parts.algebraic_upper)):
        raise ModelError(
            f"algebraic_lower[{i}] is {parts.algebraic_lower[i]:g} and algebraic_upper[{i}] is "
            f"{parts.algebraic_upper[i]:g}, must be in increasing order"
        )
    return parts


def _numbers(name: str, given: np.ndarray | None, n: int, default: float) -> np.ndarray:
    if given is None:
        return np.full(n, default)
    values = np.asarray(given, dtype=float)
    if values.shape != (n,):
        raise DimensionError(f"{name} has shape {values.shape}, expected ({n},)")
    return values


def _guess(given: np.ndarray | GuessFunction | None, n: int) -> GuessFunction:
    if not callable(given):
        values = _numbers("algebraic_guess", given, n, 0.0)
        for i in np.flatnonzero(~np.isfinite(values)):
            raise ModelError(f"algebraic_guess[{i}] is {values[i]}, must be finite")
        return lambda x, u, p: values
    function = given

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        values = np.asarray(function(x, u, p), dtype=float)  # a column if it comes from a casadi function
        if values.shape not in ((n,), (n, 1)):
            raise DimensionError(f"algebraic_guess returned shape {values.shape}, expected ({n},)")
        return values.reshape(n)

    return guess
