"""Set-valued step functions as complementarity conditions: consistent guesses, gates, lifted products, shapes."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs import ComplementaritySystem, heaviside
from fesd_robot.errors import DimensionError, ModelError

from .models import build

X, U, P = ca.SX.sym("x", 3), ca.SX.sym("u", 1), ca.SX.sym("p", 2)
ALPHA = ca.SX.sym("alpha", 2)


def _plain(**parts: Any) -> ComplementaritySystem:
    """Two steps, of x0 and of x1² - x2 + p0 p1."""
    arguments: dict[str, Any] = {
        "state": X,
        "control": U,
        "parameters": P,
        "alpha": ALPHA,
        "switching": ca.vertcat(X[0], X[1] ** 2 - X[2] + P[0] * P[1]),
        "right_hand_side": ca.vertcat(1 - 2 * ALPHA[0], ALPHA[1] + U, ALPHA[0] * ALPHA[1]),
    }
    return build(heaviside, **{**arguments, **parts})


def _lifted() -> ComplementaritySystem:
    """The same with a product of both steps, and that product times alpha0 again, as variables."""
    first, second = ca.SX.sym("first"), ca.SX.sym("second")
    product = ALPHA[0] * (1 - ALPHA[1])
    return _plain(lifted=[("first", first, product), ("second", second, first * ALPHA[0] + 1)])


def _gated() -> ComplementaritySystem:
    """The second step matters only where the first is not 1."""
    return _plain(switching=ca.vertcat(X[0], (1 - ALPHA[0]) * X[1]))


def _evaluate(system: ComplementaritySystem, *arguments: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    function = ca.Function("all", system.arguments, [system.residual, system.G, system.H])
    x, u, z, p = arguments
    return tuple(np.asarray(value).ravel() for value in function(x, u, z, p))


@pytest.mark.parametrize("build", [_plain, _lifted, _gated])
@pytest.mark.parametrize("seed", range(20))
def test_the_guess_is_consistent(build: Any, seed: int) -> None:
    """At a random state the guess has no residual, respects its bounds and is complementary, also on a boundary."""
    system = build()
    rng = np.random.default_rng(seed)
    x, u, p = rng.normal(size=3), rng.normal(size=1), rng.normal(size=2)
    if seed % 4 == 0:
        x[0] = 0.0
    z = system.guess(x, u, p)
    residual, G, H = _evaluate(system, x, u, z, p)
    assert np.abs(residual).max() <= 1e-14
    assert (G >= 0).all() and (H >= 0).all()
    assert np.abs(G * H).max() == 0
    assert (z >= system.algebraic_lower).all() and (z <= system.algebraic_upper).all()
    alpha = z[:2]
    expected = 0.5 if x[0] == 0 else float(x[0] > 0)
    assert alpha[0] == expected
    assert np.isin(alpha, [0, 0.5, 1]).all()


def test_the_conditions_select_the_step() -> None:
    """Complementary points are those with alpha = 1 above, alpha = 0 below and any alpha on the boundary."""
    system = _plain()
    u, p = np.zeros(1), np.zeros(2)

    def complementary(level: float, alpha: float) -> bool:
        x = np.array([level, 1.0, 0.0])
        z = np.array([alpha, 1.0, max(-level, 0.0), 0.0, max(level, 0.0), 1.0])
        residual, G, H = _evaluate(system, x, u, z, p)
        assert np.abs(residual).max() == 0
        return bool((H >= 0).all() and np.abs(G * H).max() == 0)

    for level, valid in ((2.0, {1.0}), (-0.1, {0.0}), (0.0, {0.0, 0.3, 1.0})):
        assert {alpha for alpha in (-0.2, 0.0, 0.3, 1.0, 1.2) if complementary(level, alpha)} == valid


def test_a_gate_shuts_the_second_step() -> None:
    """With alpha0 = 1 the gated condition is vacuous, whatever the sign behind the gate."""
    system = _gated()
    u, p = np.zeros(1), np.zeros(2)
    for behind in (-3.0, 4.0):
        open_air = system.guess(np.array([1.0, behind, 0.0]), u, p)
        assert open_air[:6].tolist() == [1.0, 0.5, 0.0, 0.0, 1.0, 0.0]
        closed = system.guess(np.array([-1.0, behind, 0.0]), u, p)
        assert closed[1] == float(behind > 0)
        assert closed[[3, 5]].tolist() == [max(-behind, 0.0), max(behind, 0.0)]


def test_lifted_products_have_their_definitions_as_residuals() -> None:
    """A lifted symbol is a variable without bounds whose residual is the distance from its definition."""
    system = _lifted()
    x, u, p = np.array([1.0, 2.0, 5.0]), np.zeros(1), np.zeros(2)
    z = system.guess(x, u, p)
    assert z.tolist() == [1, 0, 0, 1, 1, 0, 1, 2]
    moved, _, _ = _evaluate(system, x, u, z + np.eye(8)[6] * 0.25, p)
    assert moved.tolist() == [0, 0, 0.25, -0.25]
    assert system.algebraic_lower[6:].tolist() == [-np.inf] * 2
    assert list(system.algebraic_names[-2:]) == ["first", "second"]


def test_another_h_can_take_the_place_of_alpha() -> None:
    """The lambda_n of a step excludes what it is given to exclude, the others their alpha."""
    system = _plain(excluded={1: 1 - ALPHA[0]})
    x, u, p, z = np.zeros(3), np.zeros(1), np.zeros(2), np.array([0.2, 0.7, 0, 0, 0, 0])
    assert _evaluate(system, x, u, z, p)[2] == pytest.approx([0.2, 0.8, 0.8, 0.3])
    assert _evaluate(_plain(), x, u, z, p)[2] == pytest.approx([0.2, 0.7, 0.8, 0.3])


def test_names_and_defaults() -> None:
    """Everything has a name, given or made up; E is the identity; the regularisation is epsilon ||alpha||²."""
    system = _plain(regularisation_weight=0.5)
    assert list(system.state_names) == ["x0", "x1", "x2"]
    assert list(system.control_names) == ["u0"]
    assert list(system.algebraic_names) == [
        f"{kind}[{step}]" for kind in ("alpha", "lambda_n", "lambda_p") for step in ("step0", "step1")
    ]
    assert str(system.pairs[2].label) == "lambda_p _|_ 1 - alpha [step0]"
    assert system.mass_matrix.is_constant() and np.array_equal(ca.evalf(system.mass_matrix).full(), np.eye(3))
    cost = ca.Function("cost", [system.algebraic], [system.regularisation])
    assert float(cost([0.5, 2, 9, 9, 9, 9])) == 0.5 * 4.25
    named = _plain(state_names=["a", "b", "c"], names=["left", "right"], control_names=["push"])
    assert list(named.state_names) == ["a", "b", "c"]
    assert named.algebraic_names[3] == "lambda_n[right]"


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"switching": X[0]}, r"switching has shape \(1, 1\), expected \(2, 1\), one entry a step variable alpha"),
        ({"right_hand_side": X[:2]}, r"right_hand_side has shape \(2, 1\), expected \(3, 1\)"),
        ({"mass_matrix": ca.SX.eye(2)}, r"mass_matrix has shape \(2, 2\), expected \(3, 3\)"),
        ({"state_names": ["x"]}, r"state_names has shape \(1,\), expected \(3,\)"),
        (
            {"lifted": [("pair", ca.SX.sym("pair"), X[:2])]},
            r"lifted product 'pair' has shape \(2, 1\), expected \(1, 1\)",
        ),
        ({"excluded": {0: ALPHA}}, r"excluded\[0\] has shape \(2, 1\), expected \(1, 1\)"),
        ({"algebraic": ca.SX.sym("z")}, r"equations has shape \(0, 1\), expected \(1, 1\), one equation an algebraic"),
        ({"control_names": ["a", "b"]}, r"control_names has shape \(2,\), expected \(1,\)"),
        ({"names": ["one"]}, r"names has shape \(1,\), expected \(2,\), one a step variable alpha"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_wrong_lengths_are_refused(parts: dict[str, Any], message: str) -> None:
    """An expression or list of names of the wrong length is named with its shape and the expected one."""
    with pytest.raises(DimensionError, match=message):
        _plain(**parts)


def test_own_algebraic_variables_come_last() -> None:
    """The model's own algebraic variables follow the lifted products, with their bounds, names and guess."""
    z, first = ca.SX.sym("z", 2), ca.SX.sym("first")
    system = _plain(
        lifted=[("first", first, ALPHA[0] * z[0])],
        algebraic=z,
        equations=ca.vertcat(z[0] - X[1] - U, z[1] - first),
        algebraic_lower=np.array([-5.0, 0.0]),
        algebraic_guess=lambda x, u, p: np.array([x[1] + u[0], x[1] + u[0]]),
        algebraic_names=["force", "power"],
        quadratures={"power": z[1] * ALPHA[1], "time": 1},
    )
    x, u, p = np.array([1.0, 2.0, 5.0]), np.array([0.5]), np.zeros(2)
    value = system.guess(x, u, p)
    assert value.tolist() == [1, 0, 0, 1, 1, 0, 2.5, 2.5, 2.5]
    assert list(system.algebraic_names[6:]) == ["first", "force", "power"]
    assert system.algebraic_lower[6:].tolist() == [-np.inf, -5, 0]
    assert (system.algebraic_upper[6:] == np.inf).all()
    function = ca.Function("e", system.arguments, [system.residual, system.equations, *system.quadratures.values()])
    residual, equations, power, time = function(x, u, value, p)
    assert residual.full().ravel().tolist() == [0] * 3 and equations.full().ravel().tolist() == [0] * 2
    assert float(function(x, u, value + np.eye(9)[7], p)[1][0]) == 1
    assert (float(power), float(time)) == (0, 1)
    assert float(function(x, u, np.ones(9), p)[2]) == 1


def test_lifted_definitions_can_be_looked_at() -> None:
    """`lifted` has a definition for every name, in terms of the symbols that are variables of the system."""
    system = _lifted()
    assert list(system.lifted) == ["first", "second"]
    function = ca.Function("definitions", [system.algebraic], [ca.vertcat(*system.lifted.values())])
    assert np.asarray(function([0.5, 0.25, 0, 0, 0, 0, 7, 0])).ravel().tolist() == [0.375, 4.5]


def test_a_mode_in_words() -> None:
    """A step is one where only alpha may be positive, zero where only 1 - alpha may, anything where both may."""
    describe = _plain(names=["left", "right"]).describe
    assert describe is not None
    assert describe(np.array([1, 1, 0, 0])) == "left = 1, right = 1"
    assert describe(np.array([0, 1, 1, 0])) == "left = 0, right = 1"
    assert describe(np.array([1, 0, 1, 0])) == "left in [0, 1], right undefined"


def _vanishing(G: ca.SX, H: ca.SX, complement: ca.SX | None = None) -> Complementarity:
    return Complementarity(Label("no"), G, H, vanishing=True, complement=complement)


Z, LOST, FIRST, SECOND = (ca.SX.sym(name) for name in ("z", "lost", "first", "second"))


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            {"switching": ca.vertcat(X[0], U)},
            "switching depends on u of control, which may jump: its multipliers would not be continuous in time "
            "(valid: state, parameters, alpha; make u a state to switch on it)",
        ),
        (
            {"switching": ca.vertcat(X[0], Z), "algebraic": Z, "equations": Z},
            "switching depends on z of algebraic, which may jump: its multipliers would not be continuous in time "
            "(valid: state, parameters, alpha; make z a state to switch on it)",
        ),
        (
            {"right_hand_side": X * LOST},
            "right_hand_side uses lost, not found in state or control or parameters or alpha",
        ),
        (
            {"right_hand_side": X * ca.SX.sym("u")},
            "right_hand_side uses u, not found in state or control or parameters or alpha; u there has the same name "
            "but is another symbol",
        ),
        ({"right_hand_side": X / ca.SX(0)}, "right_hand_side contains the constant inf, must be finite"),
        ({"right_hand_side": None}, "right_hand_side is of type NoneType, must be a casadi SX or numbers"),
        ({"alpha": ALPHA + X[:2]}, "alpha[0] is (alpha_0+x_0), must be a symbol (ca.SX.sym)"),
        ({"control": X[0]}, "the symbol x_0 is in state and in control, every variable needs a symbol of its own"),
        (
            {"lifted": [("second", SECOND, FIRST), ("first", FIRST, ALPHA[0])]},
            "lifted product 'second' uses first, not found in state or control or parameters or alpha",
        ),
        (
            {"lifted": [("first", FIRST, ALPHA[0]), ("first", SECOND, ALPHA[1])]},
            "two lifted products are called 'first', every one needs a name of its own",
        ),
        ({"excluded": {2: 1 - ALPHA[0]}}, "excluded[2] belongs to no step, the indices are 0 to 1"),
        ({"excluded": {1: X[0]}}, "excluded[1] uses x_0, not found in alpha"),
        ({"vanishing": [_vanishing(U, ALPHA[0])]}, "G of vanishing constraint 'no' uses u, not found in state"),
        ({"vanishing": [_vanishing(X[0], X[1])]}, "H of vanishing constraint 'no' uses x_1, not found in alpha"),
        (
            {"vanishing": [_vanishing(X[0], ALPHA[0], U)]},
            "complement of vanishing constraint 'no' uses u, not found in alpha",
        ),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_contradictions_are_refused(parts: dict[str, Any], message: str) -> None:
    """What is wrong in a model is named, with what would be valid."""
    with pytest.raises(ModelError) as caught:
        _plain(**parts)
    assert str(caught.value) == message
