"""Piecewise smooth systems in the form of Stewart, regions by the smallest of several indicators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs.model import Model
from fesd_robot.dcs.subsystem import Subsystem, checked_subsystems, labels
from fesd_robot.dcs.system import ComplementaritySystem

EQUAL_INDICATORS = 1e-10
"""Indicators this close to the smallest share theta in a guess."""


@dataclass(frozen=True)
class _Block:
    """One subsystem in indicator form: g, the fields, a name for each region, and theta, lambda, mu."""

    indicator: ca.SX
    fields: ca.SX
    regions: list[str]
    theta: ca.SX
    lambda_: ca.SX
    mu: ca.SX


@checked
def stewart(
    model: Model, subsystems: Subsystem | Sequence[Subsystem], drift: ca.SX | None = None
) -> ComplementaritySystem:
    """Return E x' = f_0 + sum_s F_s theta_s, theta_s in the regions of subsystem s, as complementarity conditions.

    In every subsystem theta minimizes g^T theta over the unit simplex; the optimality conditions are
    ``g_i - lambda_i - mu = 0, 0 <= lambda_i  _|_  theta_i >= 0, sum_i theta_i = 1``. Regions by signs have g = -S c;
    a row of S with zeros becomes its rows without, which share the field and are named like "R1(+,-)".
    z = (theta, lambda, mu of the first subsystem, of the second, ..., algebraic), G = lambda, H = theta.

    Args:
        model: state, control, mass matrix and algebraic equations.
        subsystems: the sets of regions, independent of each other; each has multipliers of its own.
        drift: f_0, SX (n_x) in x, u, z, p: what holds in all regions; zero if omitted.

    Returns:
        the system; `describe` names the regions of a mode, "R1 | R2" while sliding between two.

    Raises:
        DimensionError: an expression of the wrong shape.
        ModelError: an unknown symbol, a constant that is not finite, regions that depend on control or algebraic
            variables, no subsystem, two subsystems of one name.

    Source: Nurkanovic et al., arXiv 2205.05337, section 2; Stewart, Numer. Math. 58 (1990).
    """
    model.check_contents()
    checked, right_hand_side = checked_subsystems(subsystems, drift, model)
    blocks = [_block(subsystem) for subsystem in checked]
    indicators = ca.vertcat(*[block.indicator for block in blocks])
    evaluate = ca.Function("indicators", [model.state, model.parameters], [indicators])
    sizes = [block.theta.numel() for block in blocks]
    residual, lower = [], []
    for block, n in zip(blocks, sizes, strict=True):
        right_hand_side += ca.mtimes(block.fields, block.theta)
        residual += [block.indicator - block.lambda_ - block.mu, ca.sum1(block.theta) - 1]
        lower += [np.zeros(2 * n), [-np.inf]]

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        values = []
        for g in np.split(np.asarray(evaluate(x, p)).ravel(), np.cumsum(sizes)[:-1]):
            least = g <= g.min() + EQUAL_INDICATORS
            values += [least / least.sum(), g - g.min(), [g.min()]]
        return np.concatenate([*values, model.guess(x, u, p)])

    regions = labels(checked, [block.regions for block in blocks])
    names = [
        [*(f"theta[{r}]" for r in own), *(f"lambda[{r}]" for r in own), f"mu[{s.name}]" if len(checked) > 1 else "mu"]
        for s, own in zip(checked, regions, strict=True)
    ]
    variables = [part for block in blocks for part in (block.theta, block.lambda_, block.mu)]
    return ComplementaritySystem(
        state=model.state,
        control=model.control,
        parameters=model.parameters,
        algebraic=ca.vertcat(*variables, model.algebraic),
        mass_matrix=model.mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(*residual),
        algebraic_lower=np.concatenate([*lower, model.algebraic_lower]),
        algebraic_upper=np.concatenate([np.full(2 * sum(sizes) + len(sizes), np.inf), model.algebraic_upper]),
        regularisation=ca.SX(0),
        guess=guess,
        state_names=model.state_names,
        control_names=model.control_names,
        algebraic_names=[*(name for own in names for name in own), *model.algebraic_names],
        complementarities=[
            Complementarity(Label("lambda _|_ theta", subject=region), block.lambda_[i], block.theta[i])
            for block, own in zip(blocks, regions, strict=True)
            for i, region in enumerate(own)
        ],
        equations=model.equations,
        quadratures=model.quadratures,
        describe=lambda active: _describe([(s.name, b.regions) for s, b in zip(checked, blocks, strict=True)], active),
    )


def _block(subsystem: Subsystem) -> _Block:
    """Return a subsystem by indicators; its regions by signs become dense, as g = -S c is wrong for zeros in S."""
    indicator, fields, regions = subsystem.indicator, subsystem.fields, list(subsystem.region_names)
    if indicator is None:
        rows, source, names = [], [], []
        assert subsystem.sign_matrix is not None and subsystem.switching is not None
        for i, row in enumerate(subsystem.sign_matrix):
            dense = list(product(*[(sign,) if sign else (1, -1) for sign in row]))
            rows += dense
            source += [i] * len(dense)
            for signs in dense:
                suffix = ",".join("+" if sign > 0 else "-" for sign in signs)
                names.append(f"{regions[i]}({suffix})" if len(dense) > 1 else regions[i])
        indicator, fields, regions = -ca.mtimes(ca.DM(np.array(rows)), subsystem.switching), fields[:, source], names
    n = len(regions)
    theta, lambda_ = ca.SX.sym(f"theta_{subsystem.name}", n), ca.SX.sym(f"lambda_{subsystem.name}", n)
    return _Block(indicator, fields, regions, theta, lambda_, ca.SX.sym(f"mu_{subsystem.name}"))


def _describe(regions: Sequence[tuple[str, Sequence[str]]], active: np.ndarray) -> str:
    """Return the regions whose theta may be positive, by subsystem."""
    remaining, words = iter(np.asarray(active, dtype=bool)), []
    for name, own in regions:
        chosen = " | ".join([region for region in own if next(remaining)]) or "no region"
        words.append(f"{name}: {chosen}" if len(regions) > 1 else chosen)
    return ", ".join(words)
