"""Piecewise smooth systems given by regions, reduced to set-valued step functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fesd_robot.dcs.heaviside import heaviside
from fesd_robot.dcs.model import GuessFunction, model_parts
from fesd_robot.dcs.subsystem import Subsystem, checked_subsystems, labels
from fesd_robot.dcs.system import ComplementaritySystem
from fesd_robot.errors import ModelError

Lifted = dict[tuple[tuple[int, int], ...], tuple[str, ca.SX, ca.SX]]
"""((index of a step, sign), ...) of a product -> its name, symbol and definition."""


def heaviside_from_regions(
    *,
    state: ca.SX,
    subsystems: Subsystem | Sequence[Subsystem],
    drift: ca.SX | None = None,
    control: ca.SX | None = None,
    parameters: ca.SX | None = None,
    algebraic: ca.SX | None = None,
    equations: ca.SX | None = None,
    algebraic_lower: np.ndarray | None = None,
    algebraic_upper: np.ndarray | None = None,
    algebraic_guess: np.ndarray | GuessFunction | None = None,
    quadratures: Mapping[str, ca.SX] | None = None,
    mass_matrix: ca.SX | None = None,
    state_names: Sequence[str] | None = None,
    control_names: Sequence[str] | None = None,
    algebraic_names: Sequence[str] | None = None,
) -> ComplementaritySystem:
    """Return E x' = f_0 + sum_s F_s theta_s with theta from the steps alpha_k of the switching functions c_k.

    ``theta_j = prod_k ((1 - S_jk) / 2 + S_jk alpha_k)`` over the k with S_jk != 0. A product of more than two factors
    is lifted: its first factors become a variable, which regions that begin with the same factors share, so that
    theta is a product of two at most. z = (alpha, lambda_n, lambda_p, lifted, algebraic) as in `heaviside`, the steps
    of all subsystems behind each other.

    Args: as in `stewart`; every subsystem is given by `switching` and `sign_matrix`.

    Returns:
        the system; `describe` names the values of the steps "c1", "c2", ..., `lifted` has the lifted products.

    Raises:
        DimensionError: an expression, bound, guess or list of names of the wrong shape.
        ModelError: a subsystem given by indicators, or what `stewart` refuses.

    Source: Nurkanovic et al., arXiv 2303.18066 and its journal version 2307.03482.
    """
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
    )
    found, right_hand_side = checked_subsystems(subsystems, drift, parts)
    switching = []
    for subsystem in found:
        if subsystem.switching is None:
            raise ModelError(
                f"subsystem '{subsystem.name}' is given by indicators, step functions need switching and sign_matrix "
                "(use stewart for indicators)"
            )
        switching.append(subsystem.switching)
    steps = labels(found, [[f"c{k + 1}" for k in range(c.numel())] for c in switching])
    alphas, lifted = [], []
    for subsystem, names in zip(found, steps, strict=True):
        assert subsystem.sign_matrix is not None
        alpha = ca.SX.sym(f"alpha_{subsystem.name}", len(names))
        theta, products = region_multipliers(subsystem.sign_matrix, alpha, names)
        right_hand_side += ca.mtimes(subsystem.fields, theta)
        alphas.append(alpha)
        lifted += products
    return heaviside(
        state=parts.state,
        alpha=ca.vertcat(*alphas),
        switching=ca.vertcat(*switching),
        right_hand_side=right_hand_side,
        control=parts.control,
        parameters=parts.parameters,
        mass_matrix=parts.mass_matrix,
        lifted=lifted,
        state_names=parts.state_names,
        control_names=parts.control_names,
        step_names=[name for names in steps for name in names],
        algebraic=parts.algebraic,
        equations=parts.equations,
        algebraic_lower=parts.algebraic_lower,
        algebraic_upper=parts.algebraic_upper,
        algebraic_guess=parts.algebraic_guess,
        algebraic_names=parts.algebraic_names,
        quadratures=parts.quadratures,
    )


def region_multipliers(
    sign_matrix: np.ndarray, alpha: ca.SX, step_names: Sequence[str]
) -> tuple[ca.SX, list[tuple[str, ca.SX, ca.SX]]]:
    """Return theta of every region and the products lifted for it.

    ``theta_j = prod_k ((1 - S_jk) / 2 + S_jk alpha_k)`` over the k with S_jk != 0.

    Args:
        sign_matrix: S, (n_f, n_c).
        alpha: SX symbols (n_c).
        step_names: one a step, for the names of the products.

    Returns:
        theta, SX (n_f), products of at most two factors; (name, symbol, definition) of the lifted products, each
        after those that its definition uses.

    Source: Nurkanovic et al., arXiv 2303.18066 and its journal version 2307.03482.
    """
    lifted: Lifted = {}
    theta = []
    for row in sign_matrix:
        chosen = [(int(k), int(row[k])) for k in np.flatnonzero(row)]
        product, words = ca.SX(1), []
        for i, (k, sign) in enumerate(chosen, start=1):
            product *= alpha[k] if sign > 0 else 1 - alpha[k]
            words.append(f"alpha[{step_names[k]}]" if sign > 0 else f"(1 - alpha[{step_names[k]}])")
            if 1 < i < len(chosen):  # the last factor is multiplied where theta is used
                key = tuple(chosen[:i])
                if key not in lifted:
                    lifted[key] = (" * ".join(words), ca.SX.sym(f"product{len(lifted)}"), product)
                product = lifted[key][1]
        theta.append(product)
    return ca.vertcat(*theta), list(lifted.values())
