"""Systems with set-valued step functions, alpha_i in step(c_i(x)), as a dynamic complementarity system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs.checks import (
    as_expression,
    as_symbols,
    check_content,
    check_shape,
    check_switching,
    check_unique,
)
from fesd_robot.dcs.model import GuessFunction, ModelParts, model_parts
from fesd_robot.dcs.system import ComplementaritySystem
from fesd_robot.errors import DimensionError, ModelError

BELOW, ABOVE = "lambda_n _|_ alpha", "lambda_p _|_ 1 - alpha"
"""Kinds of the two pairs of a step: where its switching function is negative, and where it is positive."""

UNDECIDED = 1e-10
"""A switching function this close to zero leaves its step undecided in a guess."""


def heaviside(
    *,
    state: ca.SX,
    alpha: ca.SX,
    switching: ca.SX,
    right_hand_side: ca.SX,
    control: ca.SX | None = None,
    parameters: ca.SX | None = None,
    mass_matrix: ca.SX | None = None,
    lifted: Sequence[tuple[str, ca.SX, ca.SX]] = (),
    excluded: Mapping[int, ca.SX] | None = None,
    vanishing: Sequence[Complementarity] = (),
    regularisation_weight: float = 0.0,
    state_names: Sequence[str] | None = None,
    control_names: Sequence[str] | None = None,
    step_names: Sequence[str] | None = None,
    algebraic: ca.SX | None = None,
    equations: ca.SX | None = None,
    algebraic_lower: np.ndarray | None = None,
    algebraic_upper: np.ndarray | None = None,
    algebraic_guess: np.ndarray | GuessFunction | None = None,
    algebraic_names: Sequence[str] | None = None,
    quadratures: Mapping[str, ca.SX] | None = None,
) -> ComplementaritySystem:
    """Return x' = E^-1 f(x, u, alpha), alpha_i in step(c_i), as complementarity conditions.

    The step is the solution of a small linear program; its optimality conditions are
    ``c_i = lp_i - ln_i, 0 <= ln_i  _|_  alpha_i >= 0, 0 <= lp_i  _|_  1 - alpha_i >= 0``.
    z = (alpha, ln, lp, lifted, algebraic), G = (ln, lp), H = (alpha, 1 - alpha).

    Args:
        state: x, SX symbols (n_x).
        alpha: SX symbols (n_c), one per step function.
        switching: c, SX (n_c) in x, p; may depend on alpha where a condition is gated by another step.
        right_hand_side: f, SX (n_x).
        control, parameters: SX symbols; none if omitted.
        mass_matrix: E, SX (n_x, n_x); identity if omitted.
        lifted: (name, symbol, definition) of products that become variables; a definition may use earlier symbols.
        excluded: step index -> H of ln_i instead of alpha_i; must vanish only where alpha_i does.
        vanishing: vanishing constraints, their G a function of the state.
        regularisation_weight: epsilon of the cost epsilon ||alpha||^2 at every stage.
        state_names, control_names, step_names: names for messages and results.
        algebraic: the model's own algebraic variables, SX symbols (n); none if omitted.
        equations: SX (n), held at zero.
        algebraic_lower, algebraic_upper: bounds of the model's own algebraic variables, (n); none if omitted.
        algebraic_guess: their values, (n), or (x, u, p) -> values; zeros if omitted.
        algebraic_names: their names.
        quadratures: name -> integrand, SX scalar.

    Returns:
        the system; `describe` names the value of every step in a mode.

    Raises:
        DimensionError: an expression, bound, guess or list of names of the wrong shape.
        ModelError: an unknown symbol, a symbol that occurs twice, a constant that is not finite, a switching function
            of the control or of algebraic variables, two lifted products of one name, an excluded H of no step.

    Source: Nurkanovic et al., arXiv 2303.18066, eq. (6)-(8).
    """
    alpha = as_symbols("alpha", alpha)
    products, definitions = _products(lifted)
    parts = model_parts(
        state=state,
        control=control,
        parameters=parameters,
        algebraic=algebraic,
        equations=equations,
        algebraic_lower=algebraic_lower,
        algebraic_upper=algebraic_upper,
        algebraic_guess=algebraic_guess,
        quadratures=quadratures,
        mass_matrix=mass_matrix,
        state_names=state_names,
        control_names=control_names,
        algebraic_names=algebraic_names,
        further={"alpha": alpha, "lifted": products},
    )
    n_c, n_x, n_lifted = alpha.numel(), parts.state.numel(), products.numel()
    steps = list(step_names or [f"step{i}" for i in range(n_c)])
    if len(steps) != n_c:
        raise DimensionError(f"step_names has {len(steps)} entries for {n_c} step variables alpha")
    switching = as_expression("switching", switching)
    check_shape("switching", switching, (n_c, 1), ", one entry a step variable alpha")
    check_switching("switching", switching, {**parts.continuous, "alpha": alpha}, parts.discontinuous)
    for i, (name, definition) in enumerate(definitions.items()):
        known = {**parts.symbols, "alpha": alpha, "earlier lifted products": products[:i]}
        check_content(f"lifted product '{name}'", definition, known)
    right_hand_side = as_expression("right_hand_side", right_hand_side)
    check_shape("right_hand_side", right_hand_side, (n_x, 1))
    check_content("right_hand_side", right_hand_side, {**parts.symbols, "alpha": alpha, "lifted": products})
    local = {"alpha": alpha, "lifted": products, "algebraic": parts.algebraic}
    _check_vanishing(vanishing, parts.state, local)
    negative, positive = ca.SX.sym("lambda_n", n_c), ca.SX.sym("lambda_p", n_c)
    defined = ca.vertcat(ca.SX(0, 1), *definitions.values())
    below = _excluded(alpha, excluded or {}, local)
    return ComplementaritySystem(
        state=parts.state,
        control=parts.control,
        parameters=parts.parameters,
        algebraic=ca.vertcat(alpha, negative, positive, products, parts.algebraic),
        mass_matrix=parts.mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(switching - positive + negative, products - defined),
        algebraic_lower=np.concatenate([np.zeros(3 * n_c), np.full(n_lifted, -np.inf), parts.algebraic_lower]),
        algebraic_upper=np.concatenate([np.ones(n_c), np.full(2 * n_c + n_lifted, np.inf), parts.algebraic_upper]),
        regularisation=regularisation_weight * ca.sumsqr(alpha),
        guess=_guess(parts, alpha, switching, products, defined),
        state_names=parts.state_names,
        control_names=parts.control_names,
        algebraic_names=[f"{kind}[{s}]" for kind in ("alpha", "lambda_n", "lambda_p") for s in steps]
        + [*definitions, *parts.algebraic_names],
        complementarities=[
            *(Complementarity(Label(BELOW, s), negative[i], below[i]) for i, s in enumerate(steps)),
            *(Complementarity(Label(ABOVE, s), positive[i], 1 - alpha[i]) for i, s in enumerate(steps)),
            *vanishing,
        ],
        equations=parts.equations,
        quadratures=parts.quadratures,
        lifted=definitions,
        describe=lambda active: _describe(steps, active),
    )


def _products(lifted: Sequence[tuple[str, ca.SX, ca.SX]]) -> tuple[ca.SX, dict[str, ca.SX]]:
    """Return the symbols of the lifted products and name -> definition."""
    check_unique("lifted products", [name for name, _, _ in lifted])
    symbols, definitions = [ca.SX(0, 1)], {}
    for name, symbol, definition in lifted:
        symbols.append(as_symbols(f"the symbol of lifted product '{name}'", symbol))
        check_shape(f"the symbol of lifted product '{name}'", symbols[-1], (1, 1))
        definitions[name] = as_expression(f"lifted product '{name}'", definition)
        check_shape(f"lifted product '{name}'", definitions[name], (1, 1))
    return ca.vertcat(*symbols), definitions


def _excluded(alpha: ca.SX, excluded: Mapping[int, ca.SX], local: Mapping[str, ca.SX]) -> ca.SX:
    """Return H of every lambda_n, alpha unless another one is given."""
    below, n_c = ca.SX(alpha), alpha.numel()
    for i, value in excluded.items():
        name = f"excluded[{i}]"
        if not 0 <= i < n_c:
            raise ModelError(f"{name} belongs to no step, the indices are 0 to {n_c - 1}")
        expression = as_expression(name, value)
        check_shape(name, expression, (1, 1))
        check_content(name, expression, local)
        below[i] = expression
    return below


def _check_vanishing(vanishing: Sequence[Complementarity], state: ca.SX, local: Mapping[str, ca.SX]) -> None:
    """Check that switching functions are functions of the state, H and complement of the variables of one point."""
    for condition in vanishing:
        for name, factor, symbols in (
            ("G", condition.G, {"state": state}),
            ("H", condition.H, local),
            ("complement", condition.complement, local),
        ):
            if factor is not None:
                check_content(f"{name} of vanishing constraint '{condition.label}'", factor, symbols)


def _guess(parts: ModelParts, alpha: ca.SX, switching: ca.SX, products: ca.SX, definitions: ca.SX) -> GuessFunction:
    """Return (x, u, p) -> z with the steps that fit the signs of the switching functions."""
    symbols, explicit = [products[i] for i in range(products.numel())], list[ca.SX]()
    for i in range(len(symbols)):
        explicit += ca.substitute([definitions[i]], symbols[:i], explicit)
    conditions = ca.Function("conditions", [parts.state, alpha, parts.parameters], [switching])
    arguments = [parts.state, parts.control, alpha, parts.algebraic, parts.parameters]
    lifted = ca.Function("lifted", arguments, [ca.vertcat(ca.SX(0, 1), *explicit)])
    n_c = alpha.numel()

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        value = np.full(n_c, 0.5)
        for _ in range(n_c + 1):
            c = np.asarray(conditions(x, value, p)).ravel()
            value = np.where(c > UNDECIDED, 1.0, np.where(c < -UNDECIDED, 0.0, 0.5))
        own = parts.algebraic_guess(x, u, p)
        product = np.asarray(lifted(x, u, value, own, p)).ravel()
        return np.concatenate([value, np.maximum(-c, 0.0), np.maximum(c, 0.0), product, own])

    return guess


def _describe(steps: Sequence[str], active: np.ndarray) -> str:
    """Return the value of every step where given H, those of alpha and then of 1 - alpha, may be positive."""
    words = {(True, False): "= 1", (False, True): "= 0", (True, True): "in [0, 1]", (False, False): "undefined"}
    positive, below_one = np.asarray(active, dtype=bool).reshape(2, len(steps))
    return ", ".join(f"{s} {words[bool(a), bool(b)]}" for s, a, b in zip(steps, positive, below_one, strict=True))
