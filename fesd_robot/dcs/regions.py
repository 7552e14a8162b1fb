"""Piecewise smooth systems given by regions, reduced to set-valued step functions."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs.heaviside import heaviside
from fesd_robot.dcs.model import Model
from fesd_robot.dcs.step_functions import StepFunctions
from fesd_robot.dcs.subsystem import Subsystem, checked_subsystems, labels
from fesd_robot.dcs.system import ComplementaritySystem
from fesd_robot.errors import ModelError

Lifted = dict[tuple[tuple[int, int], ...], tuple[str, ca.SX, ca.SX]]
"""((index of a step, sign), ...) of a product -> its name, symbol and definition."""


@checked
def heaviside_from_regions(
    model: Model, subsystems: Subsystem | Sequence[Subsystem], drift: ca.SX | None = None
) -> ComplementaritySystem:
    """Return E x' = f_0 + sum_s F_s theta_s with theta from the steps alpha_k of the switching functions c_k.

    ``theta_j = prod_k ((1 - S_jk) / 2 + S_jk alpha_k)`` over the k with S_jk != 0. A product of more than two factors
    is lifted: its first factors become a variable, which regions that begin with the same factors share, so that
    theta is a product of two at most. z = (alpha, lambda_n, lambda_p, lifted, algebraic) as in `heaviside`, the steps
    of all subsystems behind each other.

    Args:
        model: state, control, mass matrix and algebraic equations.
        subsystems: the sets of regions, each given by `switching` and `sign_matrix`.
        drift: f_0, SX (n_x) in x, u, z, p: what holds in all regions; zero if omitted.

    Returns:
        the system; `describe` names the values of the steps "c1", "c2", ..., `lifted` has the lifted products.

    Raises:
        DimensionError: an expression of the wrong shape.
        ModelError: a subsystem given by indicators, or what `stewart` refuses.

    Source: Nurkanovic et al., arXiv 2303.18066 and its journal version 2307.03482.
    """
    model.check_contents()
    checked, right_hand_side = checked_subsystems(subsystems, drift, model)
    switching = []
    for subsystem in checked:
        if subsystem.switching is None:
            raise ModelError(
                f"subsystem '{subsystem.name}' is given by indicators, step functions need switching and sign_matrix "
                "(use stewart for indicators)"
            )
        switching.append(subsystem.switching)
    steps = labels(checked, [[f"c{k + 1}" for k in range(c.numel())] for c in switching])
    alphas, lifted = [], []
    for subsystem, names in zip(checked, steps, strict=True):
        assert subsystem.sign_matrix is not None
        alpha = ca.SX.sym(f"alpha_{subsystem.name}", len(names))
        theta, products = region_multipliers(subsystem.sign_matrix, alpha, names)
        right_hand_side += ca.mtimes(subsystem.fields, theta)
        alphas.append(alpha)
        lifted += products
    step_functions = StepFunctions(
        ca.vertcat(*alphas), ca.vertcat(*switching), names=[name for names in steps for name in names]
    )
    return heaviside(model, step_functions, right_hand_side, lifted=lifted)


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
