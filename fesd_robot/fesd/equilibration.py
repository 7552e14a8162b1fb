"""Step equilibration: equal steps between switches, so that the steps of an interval are determined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import ModelError
from fesd_robot.fesd.element import Rows
from fesd_robot.fesd.options import FesdOptions

Sums = tuple[ca.SX, ca.SX]
"""Sums of G (boundaries included) and of H over the points of an element, SX (n_pairs) each."""


@dataclass
class Equilibration:
    """Terms and rows that the step equilibration of an interval adds to its NLP.

    Attributes:
        cost: rho times a measure of unequal steps; zero for the exact modes.
        equations: rows to be held at zero.
        complementarities: pairs and vanishing constraints, each scalar a condition.
        guess: values of the auxiliary variables that belong to given steps and G, H.
    """

    cost: ca.SX = field(default_factory=lambda: ca.SX(0))
    equations: list[Rows] = field(default_factory=list)
    complementarities: list[Complementarity] = field(default_factory=list)
    guess: ca.SX = field(default_factory=lambda: ca.SX(0, 1))

    def add(self, kind: str, place: Place, G: ca.SX, H: ca.SX, *, vanishing: bool = False) -> None:
        """Add a condition for every entry of G and H."""
        names = [str(i) for i in range(G.numel())] if G.numel() > 1 else [""]
        self.complementarities += [
            Complementarity(Label(kind, name, place=place), G[i], H[i], vanishing=vanishing)
            for i, name in enumerate(names)
        ]


def indicator(before: Sums, after: Sums) -> ca.SX:
    """Return eta of two neighbouring elements, zero exactly where a pair changes its active side between them.

    ``nu_i = sG_B,i sG_F,i + sH_B,i sH_F,i``, ``eta = prod_i nu_i``. The product runs over pairs, not over switching
    functions: in the Heaviside form the pairs (lambda_n, alpha) and (lambda_p, 1 - alpha) of one function have a factor
    each, so that eta stays positive while sliding and vanishes where a sliding mode begins or ends.

    Source: Nurkanovic et al., arXiv 2205.05337, eq. (33)-(36).
    """
    nu = before[0] * after[0] + before[1] * after[1]
    product = ca.SX(1)
    for i in range(nu.numel()):
        product *= nu[i]
    return product


def equilibrate(
    options: FesdOptions,
    steps: Sequence[ca.SX],
    sums: tuple[Sequence[Sums], Sequence[Sums]],
    mean_step: float,
    auxiliary: ca.SX,
) -> Equilibration:
    """Return the terms of a mode of step equilibration.

    ``mean``: cost rho sum (h_n - h_mean)^2; ``difference``: rho sum (h_{n+1} - h_n)^2; ``difference_tanh``:
    rho sum tanh(eta / sigma_se) (h_{n+1} - h_n)^2; ``difference_product``: rho sum eta (h_{n+1} - h_n)^2; ``direct``:
    eta (h_{n+1} - h_n) = 0, relaxed like the pairs; ``linear_complementarity``: the same by pairs that are linear in
    all variables;
    ``none``: nothing. The first two also act across switches and so bias an optimum; the others do not.

    Args:
        steps: h_n.
        sums: of every element as that before a boundary, and as that after it.
        mean_step: h_mean.
        auxiliary: variables of the ``linear_complementarity`` mode.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.3.
    """
    mode, rho, result = options.step_equilibration, options.equilibration_weight, Equilibration()
    if mode == "none" or not options.switch_detection:
        return result
    if mode == "mean":
        result.cost = rho * ca.sumsqr(ca.vertcat(*steps) - mean_step)
        return result
    if mode == "difference":
        result.cost = rho * ca.sumsqr(ca.diff(ca.vertcat(*steps)))
        return result
    count = auxiliary.numel() // max(len(steps) - 1, 1)
    for n in range(len(steps) - 1):
        difference = steps[n + 1] - steps[n]
        if mode == "linear_complementarity":
            own = auxiliary[n * count : (n + 1) * count]
            _linear(result, Place(name=f"steps {n} and {n + 1}"), difference, sums[0][n], sums[1][n + 1], own)
            continue
        eta = indicator(sums[0][n], sums[1][n + 1])
        if mode == "direct":
            # eta has no slope at a switch, so that the equation itself would be degenerate there; as two pairs it is
            # relaxed with all others.
            where = Place(name=f"steps {n} and {n + 1}")
            result.add("second step not longer", where, difference, eta, vanishing=True)
            result.add("second step not shorter", where, -difference, eta, vanishing=True)
        else:
            weight = ca.tanh(eta / options.equilibration_width) if mode == "difference_tanh" else eta
            result.cost += rho * weight * difference**2
    return result


def refuse_vanishing(options: FesdOptions, system: ComplementaritySystem) -> None:
    """Raise if the indicator would overlook switches that are no complementarity pairs.

    Raises:
        ModelError: a mode that uses eta, and a system with vanishing constraints.
    """
    if not system.switches_in_pairs and options.step_equilibration not in ("mean", "difference", "none"):
        raise ModelError(
            f"step equilibration '{options.step_equilibration}' needs every switch in a complementarity pair; this "
            "system also has vanishing constraints (valid: mean, difference, none)"
        )


def _linear(result: Equilibration, where: Place, difference: ca.SX, before: Sums, after: Sums, own: ca.SX) -> None:
    """Add eta _|_ d+ + d-, h_{n+1} - h_n = d+ - d-, eta = min_i max(min(sG_B, sG_F), min(sH_B, sH_F)).

    A minimum m of a and b is 0 <= a - m _|_ b - m >= 0, a maximum M is 0 <= M - a _|_ M - b >= 0.
    """
    n = before[0].numel()
    least_G, least_H, largest = own[:n], own[n : 2 * n], own[2 * n : 3 * n]
    chain, sides = own[3 * n : 4 * n - 1], own[4 * n - 1 :]
    eta = largest[0]
    guesses = [ca.fmin(before[0], after[0]), ca.fmin(before[1], after[1])]
    guesses.append(ca.fmax(guesses[0], guesses[1]))
    eta_guess, chain_guess = guesses[2][0], []
    result.add("least G", where, before[0] - least_G, after[0] - least_G)
    result.add("least H", where, before[1] - least_H, after[1] - least_H)
    result.add("no switch of a pair", where, largest - least_G, largest - least_H)
    for i in range(1, n):
        result.add(f"no switch up to pair {i}", where, eta - chain[i - 1], largest[i] - chain[i - 1])
        eta, eta_guess = chain[i - 1], ca.fmin(eta_guess, guesses[2][i])
        chain_guess.append(eta_guess)
    result.add("equal unless a switch", where, eta, sides[0] + sides[1])
    result.equations.append(Rows("step difference", difference - sides[0] + sides[1], place=where))
    split = [ca.fmax(difference, 0), ca.fmax(-difference, 0)]
    result.guess = ca.vertcat(result.guess, *guesses, *chain_guess, *split)
