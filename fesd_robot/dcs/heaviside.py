"""Systems with set-valued step functions, alpha_i in step(c_i(x)), as a dynamic complementarity system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fesd_robot.dcs.system import ComplementaritySystem, Exclusion
from fesd_robot.errors import DimensionError


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
    negative_partner: Mapping[int, ca.SX] | None = None,
    exclusions: Sequence[Exclusion] = (),
    selection_weight: float = 0.0,
    state_names: Sequence[str] | None = None,
    control_names: Sequence[str] | None = None,
    step_names: Sequence[str] | None = None,
) -> ComplementaritySystem:
    """Return x' = E^-1 f(x, u, alpha), alpha_i in step(c_i), as complementarity conditions.

    The step is the solution of a small linear program; its optimality conditions are
    ``c_i = lp_i - ln_i, 0 <= ln_i  _|_  alpha_i >= 0, 0 <= lp_i  _|_  1 - alpha_i >= 0``.
    z = (alpha, ln, lp, lifted), a = (ln, lp), b = (alpha, 1 - alpha).

    Args:
        state: x, SX symbols (n_x).
        alpha: SX symbols (n_c), one per step function.
        switching: c, SX (n_c); may depend on alpha where a condition is gated by another step.
        right_hand_side: f, SX (n_x).
        control, parameters: SX symbols; none if omitted.
        mass_matrix: E, SX (n_x, n_x); identity if omitted.
        lifted: (name, symbol, definition) of products that become variables; a definition may use earlier symbols.
        negative_partner: step index -> what ln_i excludes instead of alpha_i; must vanish only where alpha_i does.
        selection_weight: epsilon of the cost epsilon ||alpha||^2 at every stage.
        state_names, control_names, step_names: names for messages and results.

    Raises:
        DimensionError: `switching` and `alpha` differ in length.

    Source: Nurkanovic et al., arXiv 2303.18066, eq. (6)-(8).
    """
    n_c, n_x = alpha.numel(), state.numel()
    if switching.numel() != n_c:
        raise DimensionError(f"switching has {switching.numel()} entries for {n_c} step variables alpha")
    control = ca.SX(0, 1) if control is None else control
    parameters = ca.SX(0, 1) if parameters is None else parameters
    negative, positive = ca.SX.sym("lambda_n", n_c), ca.SX.sym("lambda_p", n_c)
    products = ca.vertcat(*[symbol for _, symbol, _ in lifted]) if lifted else ca.SX(0, 1)
    definitions = ca.vertcat(*[definition for _, _, definition in lifted]) if lifted else ca.SX(0, 1)
    excluded = ca.SX(alpha)
    for i, partner in (negative_partner or {}).items():
        excluded[i] = partner
    steps = list(step_names or [f"step{i}" for i in range(n_c)])

    explicit = definitions
    for _ in range(len(lifted)):
        explicit = ca.substitute(explicit, products, definitions)
    evaluate = ca.Function("steps", [state, control, alpha, parameters], [switching, explicit])

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        value = np.full(n_c, 0.5)
        for _ in range(n_c + 1):
            c = np.asarray(evaluate(x, u, value, p)[0]).ravel()
            value = np.where(c > 1e-10, 1.0, np.where(c < -1e-10, 0.0, 0.5))
        product = np.asarray(evaluate(x, u, value, p)[1]).ravel()
        return np.concatenate([value, np.maximum(-c, 0.0), np.maximum(c, 0.0), product])

    return ComplementaritySystem(
        state=state,
        control=control,
        parameters=parameters,
        algebraic=ca.vertcat(alpha, negative, positive, products),
        mass_matrix=ca.SX.eye(n_x) if mass_matrix is None else mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(switching - positive + negative, products - definitions),
        multiplier=ca.vertcat(negative, positive),
        partner=ca.vertcat(excluded, 1 - alpha),
        algebraic_lower=np.concatenate([np.zeros(3 * n_c), np.full(len(lifted), -np.inf)]),
        algebraic_upper=np.concatenate([np.ones(n_c), np.full(2 * n_c + len(lifted), np.inf)]),
        selection=selection_weight * ca.sumsqr(alpha),
        guess=guess,
        state_names=list(state_names or [f"x{i}" for i in range(n_x)]),
        control_names=list(control_names or [f"u{i}" for i in range(control.numel())]),
        algebraic_names=[f"{kind}[{s}]" for kind in ("alpha", "lambda_n", "lambda_p") for s in steps]
        + [name for name, _, _ in lifted],
        exclusions=exclusions,
        pair_names=[f"lambda_n _|_ alpha [{s}]" for s in steps] + [f"lambda_p _|_ 1 - alpha [{s}]" for s in steps],
    )
