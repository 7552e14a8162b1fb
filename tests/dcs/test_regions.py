"""Regions as products of steps: they agree with Stewart's form, and no product has more than two factors."""

from __future__ import annotations

from itertools import product

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, heaviside_from_regions, stewart
from fesd_robot.dcs.regions import region_multipliers
from fesd_robot.errors import ModelError

from .models import MODEL, SIGN_MATRICES, P, U, X, by_signs, fields, random_point, values

each_matrix = pytest.mark.parametrize("kind", SIGN_MATRICES)


def _system(*subsystems: Subsystem) -> ComplementaritySystem:
    return heaviside_from_regions(MODEL, subsystems)


def _theta(kind: str) -> ca.Function:
    """Alpha -> theta, the lifted products by their definitions."""
    signs = np.array(SIGN_MATRICES[kind])
    alpha = ca.SX.sym("alpha", signs.shape[1])
    theta, lifted = region_multipliers(signs, alpha, [f"c{k}" for k in range(signs.shape[1])])
    for _, symbol, definition in reversed(lifted):
        theta = ca.substitute(theta, symbol, definition)
    return ca.Function("theta", [alpha], [theta])


@each_matrix
def test_theta_is_a_partition(kind: str) -> None:
    """Theta is the product over the non-zero signs, sums to one for any alpha and is 0 or 1 where alpha is."""
    theta, signs = _theta(kind), np.array(SIGN_MATRICES[kind])
    rng = np.random.default_rng(0)
    for alpha in rng.uniform(-1, 2, size=(20, signs.shape[1])):
        value = theta(alpha).full().ravel()
        assert value.sum() == pytest.approx(1, abs=1e-13)
        assert value == pytest.approx(np.prod(np.where(signs == 0, 1, (1 - signs) / 2 + signs * alpha), axis=1))
    for corner in product((-1, 1), repeat=signs.shape[1]):
        inside = [(row * np.array(corner) >= 0).all() for row in signs]
        assert theta((np.array(corner) + 1) / 2).full().ravel().tolist() == [float(value) for value in inside]


@each_matrix
def test_products_of_more_than_two_are_lifted_once(kind: str) -> None:
    """The lifted products are the proper beginnings of length two and more, each once; what is left is quadratic."""
    signs = np.array(SIGN_MATRICES[kind])
    beginnings = set()
    for row in signs:
        chosen = [(k, sign) for k, sign in enumerate(row) if sign]
        beginnings |= {tuple(chosen[:i]) for i in range(2, len(chosen))}
    alpha = ca.SX.sym("alpha", signs.shape[1])
    theta, lifted = region_multipliers(signs, alpha, [f"c{k}" for k in range(signs.shape[1])])
    assert len(lifted) == len({name for name, _, _ in lifted}) == len(beginnings)
    everything = ca.vertcat(alpha, *[symbol for _, symbol, _ in lifted])
    for expression in [*ca.vertsplit(theta), *[definition for _, _, definition in lifted]]:
        assert ca.is_quadratic(expression, everything)
    assert bool(lifted) == (np.abs(signs).sum(axis=1).max() > 2)


def test_names_of_lifted_products() -> None:
    """A lifted product is called by its factors; its definition is found under that name, and its variable."""
    system = _system(by_signs("sparse of three"))
    name = "(1 - alpha[c1]) * (1 - alpha[c2])"
    assert list(system.lifted) == [name]
    assert list(system.algebraic_names) == [
        *(f"{kind}[{step}]" for kind in ("alpha", "lambda_n", "lambda_p") for step in ("c1", "c2", "c3")),
        name,
    ]
    definition = ca.Function("definition", [system.algebraic], [system.lifted[name]])
    assert float(definition([0.25, 0.5, 9, 0, 0, 0, 0, 0, 0, 9])) == 0.375


@each_matrix
@pytest.mark.parametrize("seed", range(12))
def test_both_forms_agree(kind: str, seed: int) -> None:
    """At a random state, on boundaries too, both forms guess the same right-hand side without a residual."""
    subsystem, (x, u, p) = by_signs(kind), random_point(seed)
    steps, indicators = _system(subsystem), stewart(MODEL, subsystem)
    rates = []
    for system in (steps, indicators):
        at_guess = values(system, x, u, system.guess(x, u, p), p)
        assert np.abs(at_guess["residual"]).max() <= 1e-14
        assert np.abs(at_guess["G"] * at_guess["H"]).max() <= 1e-10
        rates.append(at_guess["right_hand_side"])
    assert rates[0] == pytest.approx(rates[1], abs=1e-13)


def test_subsystems_multiply() -> None:
    """The steps of all subsystems stand behind each other under their subsystem's name; the fields add up."""
    left = by_signs("one", name="left")
    right = by_signs("dense of three", name="right", fields=fields(8, seed=1))
    drift = ca.vertcat(U, 0)
    steps, indicators = (form(MODEL, [left, right], drift) for form in (heaviside_from_regions, stewart))
    assert steps.algebraic.numel() == 3 * 4 + 4
    assert list(steps.algebraic_names[:4]) == [
        f"alpha[{s}]" for s in ("left: c1", "right: c1", "right: c2", "right: c3")
    ]
    for seed in range(6):
        x, u, p = random_point(seed)
        rates = [values(s, x, u, s.guess(x, u, p), p)["right_hand_side"] for s in (steps, indicators)]
        assert rates[0] == pytest.approx(rates[1], abs=1e-13)
    assert steps.describe is not None
    assert (
        steps.describe(np.array([1, 1, 1, 0, 0, 0, 1, 1], dtype=bool))
        == "left: c1 = 1, right: c1 = 1, right: c2 in [0, 1], right: c3 = 0"
    )


def test_own_algebraic_variables_and_quadratures() -> None:
    """They take part in fields, equations and integrands, after the lifted products."""
    z = ca.SX.sym("z")
    model = Model(
        state=X,
        control=U,
        parameters=P,
        algebraic=z,
        equations=z - X[0],
        algebraic_guess=lambda x, u, p: x[:1],
        quadratures={"work": z * U[0]},
    )
    system = heaviside_from_regions(model, by_signs("dense of three", fields=fields(8) * z))
    x, u, p = random_point(4)
    value = system.guess(x, u, p)
    at_guess = values(system, x, u, value, p)
    plain = _system(by_signs("dense of three"))
    field = values(plain, x, u, plain.guess(x, u, p), p)["right_hand_side"]
    assert value[-1] == x[0] and len(value) == 9 + 4 + 1
    assert at_guess["equations"].tolist() == [0] and len(at_guess["residual"]) == 3 + 4
    assert at_guess["right_hand_side"] == pytest.approx(x[0] * field)
    work = ca.Function("work", system.arguments, [system.quadratures["work"]])
    assert float(work(x, u, value, p)) == pytest.approx(x[0] * u[0])


def test_indicators_are_refused() -> None:
    """Regions by indicators have no steps; the message names the form that takes them."""
    with pytest.raises(ModelError) as caught:
        _system(Subsystem(fields=fields(2), indicator=X[:2], name="arm"))
    assert str(caught.value) == (
        "subsystem 'arm' is given by indicators, step functions need switching and sign_matrix (use stewart for "
        "indicators)"
    )
