"""Systems with set-valued step functions, alpha_i in step(c_i(x)), as a dynamic complementarity system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs.checks import as_expression, as_symbols, check_content, check_shape, check_unique
from fesd_robot.dcs.model import GuessFunction, Model
from fesd_robot.dcs.step_functions import StepFunctions
from fesd_robot.dcs.system import ComplementaritySystem

BELOW, ABOVE = "lambda_n _|_ alpha", "lambda_p _|_ 1 - alpha"
"""Kinds of the two pairs of a step: where its switching function is negative, and where it is positive."""

UNDECIDED_SWITCHING = 1e-10
"""A switching function this close to zero leaves its step undecided in a guess."""


@checked
def heaviside(
    model: Model,
    steps: StepFunctions,
    right_hand_side: ca.SX,
    *,
    lifted: Sequence[tuple[str, ca.SX, ca.SX]] = (),
    vanishing: Sequence[Complementarity] = (),
    regularisation_weight: float = 0.0,
) -> ComplementaritySystem:
    """Return E x' = f(x, u, z, p, alpha), alpha_i in step(c_i), as complementarity conditions.

    The step is the solution of a small linear program; its optimality conditions are
    ``c_i = lp_i - ln_i, 0 <= ln_i  _|_  alpha_i >= 0, 0 <= lp_i  _|_  1 - alpha_i >= 0``.
    z = (alpha, ln, lp, lifted, algebraic), G = (ln, lp), H = (alpha, 1 - alpha).

    Args:
        model: state, control, mass matrix and algebraic equations; equations and quadratures may use alpha and the
            lifted products.
        steps: alpha and c.
        right_hand_side: f, SX (n_x).
        lifted: (name, symbol, definition) of products that become variables; a definition may use earlier symbols.
        vanishing: vanishing constraints, their G a function of the state.
        regularisation_weight: epsilon of the cost epsilon ||alpha||^2 at every stage.

    Returns:
        the system; `describe` names the value of every step in a mode.

    Raises:
        DimensionError: an expression of the wrong shape.
        ModelError: an unknown symbol, a symbol that occurs twice, a constant that is not finite, a switching function
            of the control or of algebraic variables, two lifted products of one name.

    Source: Nurkanovic et al., arXiv 2303.18066, eq. (6)-(8).
    """
    alpha = steps.alpha
    products, definitions = _products(lifted)
    model.check_contents({"alpha": alpha, "lifted": products})
    n_c, n_lifted = alpha.numel(), products.numel()
    local = {"alpha": alpha, "lifted": products, "algebraic": model.algebraic}
    steps.check(model, local)
    for i, (name, definition) in enumerate(definitions.items()):
        known = {**model.symbols, "alpha": alpha, "earlier lifted products": products[:i]}
        check_content(f"lifted product '{name}'", definition, known)
    right_hand_side = as_expression("right_hand_side", right_hand_side)
    check_shape("right_hand_side", right_hand_side, (model.state.numel(), 1))
    check_content("right_hand_side", right_hand_side, {**model.symbols, "alpha": alpha, "lifted": products})
    _check_vanishing(vanishing, model.state, local)
    negative, positive = ca.SX.sym("lambda_n", n_c), ca.SX.sym("lambda_p", n_c)
    defined = ca.vertcat(ca.SX(0, 1), *definitions.values())
    below = steps.below
    return ComplementaritySystem(
        state=model.state,
        control=model.control,
        parameters=model.parameters,
        algebraic=ca.vertcat(alpha, negative, positive, products, model.algebraic),
        mass_matrix=model.mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(steps.switching - positive + negative, products - defined),
        algebraic_lower=np.concatenate([np.zeros(3 * n_c), np.full(n_lifted, -np.inf), model.algebraic_lower]),
        algebraic_upper=np.concatenate([np.ones(n_c), np.full(2 * n_c + n_lifted, np.inf), model.algebraic_upper]),
        regularisation=regularisation_weight * ca.sumsqr(alpha),
        guess=_guess(model, steps, products, defined),
        state_names=model.state_names,
        control_names=model.control_names,
        algebraic_names=[f"{kind}[{s}]" for kind in ("alpha", "lambda_n", "lambda_p") for s in steps.names]
        + [*definitions, *model.algebraic_names],
        complementarities=[
            *(Complementarity(Label(BELOW, s), negative[i], below[i]) for i, s in enumerate(steps.names)),
            *(Complementarity(Label(ABOVE, s), positive[i], 1 - alpha[i]) for i, s in enumerate(steps.names)),
            *vanishing,
        ],
        equations=model.equations,
        quadratures=model.quadratures,
        lifted=definitions,
        describe=lambda active: _describe(steps.names, active),
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


def _guess(model: Model, steps: StepFunctions, products: ca.SX, definitions: ca.SX) -> GuessFunction:
    """Return (x, u, p) -> z with the steps that fit the signs of the switching functions."""
    symbols, explicit = [products[i] for i in range(products.numel())], list[ca.SX]()
    for i in range(len(symbols)):
        explicit += ca.substitute([definitions[i]], symbols[:i], explicit)
    alpha = steps.alpha
    conditions = ca.Function("conditions", [model.state, alpha, model.parameters], [steps.switching])
    arguments = [model.state, model.control, alpha, model.algebraic, model.parameters]
    lifted = ca.Function("lifted", arguments, [ca.vertcat(ca.SX(0, 1), *explicit)])
    n_c = alpha.numel()

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        value = np.full(n_c, 0.5)
        for _ in range(n_c + 1):
            c = np.asarray(conditions(x, value, p)).ravel()
            value = np.where(c > UNDECIDED_SWITCHING, 1.0, np.where(c < -UNDECIDED_SWITCHING, 0.0, 0.5))
        own = model.guess(x, u, p)
        product = np.asarray(lifted(x, u, value, own, p)).ravel()
        return np.concatenate([value, np.maximum(-c, 0.0), np.maximum(c, 0.0), product, own])

    return guess


def _describe(steps: Sequence[str], active: np.ndarray) -> str:
    """Return the value of every step where given H, those of alpha and then of 1 - alpha, may be positive."""
    words = {(True, False): "= 1", (False, True): "= 0", (True, True): "in [0, 1]", (False, False): "undefined"}
    positive, below_one = np.asarray(active, dtype=bool).reshape(2, len(steps))
    return ", ".join(f"{s} {words[bool(a), bool(b)]}" for s, a, b in zip(steps, positive, below_one, strict=True))
