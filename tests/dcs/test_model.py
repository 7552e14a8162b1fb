"""What is common to all forms is checked alike in all of them."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import Model, heaviside, heaviside_from_regions, stewart
from fesd_robot.errors import DimensionError, FesdRobotError, ModelError

from .models import P, U, X, build, by_signs

Z, LOST, ALPHA = ca.SX.sym("z", 2), ca.SX.sym("lost"), ca.SX.sym("alpha")
REGIONS: dict[str, Any] = {"state": X, "control": U, "parameters": P, "subsystems": by_signs("one")}
STEPS: dict[str, Any] = {
    "state": X,
    "control": U,
    "parameters": P,
    "alpha": ALPHA,
    "switching": X[0],
    "right_hand_side": X * ALPHA,
}
OWN: dict[str, Any] = {"algebraic": Z, "equations": Z - U}
FORMS = [(stewart, REGIONS), (heaviside_from_regions, REGIONS), (heaviside, STEPS)]


@pytest.mark.parametrize(("form", "model"), FORMS, ids=[form.__name__ for form, _ in FORMS])
@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        ({"state": None}, ModelError, "state is empty, need at least one differential state"),
        ({"state": X.T}, DimensionError, "state has shape (1, 3), expected (3, 1)"),
        ({"state": ca.MX.sym("x")}, ModelError, "state is of type MX, must be a casadi SX or numbers"),
        (
            {"state": ca.vertcat(X[0], X[1] ** 2, X[2])},
            ModelError,
            "state[1] is sq(x_1), must be a symbol (ca.SX.sym)",
        ),
        ({"state": ca.SX(3, 1)}, ModelError, "state[0] is 00, must be a symbol (ca.SX.sym)"),
        (
            {"state": ca.vertcat(X, X[1])},
            ModelError,
            "the symbol x_1 is twice in state, every variable needs a symbol of its own",
        ),
        (
            {"parameters": ca.vertcat(P, U[0])},
            ModelError,
            "the symbol u_0 is in control and in parameters, every variable needs a symbol of its own",
        ),
        ({"mass_matrix": np.eye(2)}, DimensionError, "mass_matrix has shape (2, 2), expected (3, 3)"),
        (
            {"mass_matrix": ca.SX.eye(3) * LOST},
            ModelError,
            "mass_matrix uses lost, not found in state or control or parameters",
        ),
        (
            {"algebraic": Z, "equations": Z[0]},
            DimensionError,
            "equations has shape (1, 1), expected (2, 1), one equation an algebraic variable",
        ),
        (
            {"equations": X[0]},
            DimensionError,
            "equations has shape (1, 1), expected (0, 1), one equation an algebraic variable",
        ),
        ({**OWN, "equations": [1, np.nan]}, ModelError, "equations contains the constant nan, must be finite"),
        ({**OWN, "algebraic_lower": 0}, DimensionError, "algebraic_lower has shape (), expected (2,)"),
        ({**OWN, "algebraic_upper": np.ones(3)}, DimensionError, "algebraic_upper has shape (3,), expected (2,)"),
        (
            {**OWN, "algebraic_lower": [0, 2], "algebraic_upper": [0, 1]},
            ModelError,
            "algebraic_lower[1] is 2 and algebraic_upper[1] is 1, must be in increasing order",
        ),
        (
            {**OWN, "algebraic_lower": [0, np.nan]},
            ModelError,
            "algebraic_lower[1] is nan and algebraic_upper[1] is inf, must be in increasing order",
        ),
        ({**OWN, "algebraic_guess": [1]}, DimensionError, "algebraic_guess has shape (1,), expected (2,)"),
        ({**OWN, "algebraic_guess": [1, np.inf]}, ModelError, "algebraic_guess[1] is inf, must be finite"),
        ({**OWN, "algebraic_names": ["z"]}, DimensionError, "algebraic_names has shape (1,), expected (2,)"),
        ({"state_names": ["x"]}, DimensionError, "state_names has shape (1,), expected (3,)"),
        ({"control_names": ["u"]}, DimensionError, "control_names has shape (1,), expected (2,)"),
        ({"quadratures": {"work": X}}, DimensionError, "quadratures['work'] has shape (3, 1), expected (1, 1)"),
        (
            {"quadratures": {"work": "x"}},
            ModelError,
            "quadratures['work'] is of type str, must be a casadi SX or numbers",
        ),
    ],
)
def test_wrong_parts_are_refused(
    form: Any, model: dict[str, Any], parts: dict[str, Any], error: type[FesdRobotError], message: str
) -> None:
    """Whichever form a model is given in, the message names the part, what it is and what it must be."""
    with pytest.raises(error) as caught:
        build(form, **{**model, **parts})
    assert str(caught.value) == message


@pytest.mark.parametrize(("form", "model"), FORMS, ids=[form.__name__ for form, _ in FORMS])
def test_defaults(form: Any, model: dict[str, Any]) -> None:
    """Own algebraic variables are unbounded, start at zero and are called z0, z1; without any, no equations."""
    system = build(form, **model, **OWN)
    assert list(system.algebraic_names[-2:]) == ["z0", "z1"]
    assert system.algebraic_lower[-2:].tolist() == [-np.inf] * 2
    assert system.algebraic_upper[-2:].tolist() == [np.inf] * 2
    assert system.guess(np.ones(3), np.ones(2), np.ones(2))[-2:].tolist() == [0, 0]
    bare = build(form, **model)
    assert bare.equations.shape == (0, 1) and bare.quadratures == {}
    assert bare.algebraic.numel() == system.algebraic.numel() - 2
    assert np.array_equal(ca.evalf(bare.mass_matrix).full(), np.eye(3))


def test_a_model_is_complete_when_it_is_made() -> None:
    """Whatever was left out or given as numbers is there: symbols and expressions as SX, bounds as arrays, names."""
    model = Model(X, algebraic=Z, equations=[1, 2], algebraic_lower=[0, 1], quadratures={"time": 1})
    assert model.control.shape == model.parameters.shape == (0, 1)
    assert isinstance(model.equations, ca.SX) and isinstance(model.quadratures["time"], ca.SX)
    assert model.algebraic_lower.tolist() == [0.0, 1.0] and model.algebraic_upper.tolist() == [np.inf] * 2
    assert list(model.state_names) == ["x0", "x1", "x2"] and list(model.control_names) == []
    assert np.array_equal(ca.evalf(model.mass_matrix).full(), np.eye(3))
    assert model.guess(np.ones(3), np.zeros(0), np.zeros(0)).tolist() == [0.0, 0.0]


def test_what_a_model_is_made_of_is_checked_without_switches() -> None:
    """A wrong part is refused when the model is made; what equations may use is known with the switches only."""
    with pytest.raises(DimensionError, match="mass_matrix has shape"):
        Model(X, mass_matrix=np.eye(2))
    model = Model(X, algebraic=Z, equations=Z - ALPHA)
    with pytest.raises(ModelError) as caught:
        model.check_contents()
    assert str(caught.value) == "equations uses alpha, not found in state or algebraic"
    model.check_contents({"alpha": ALPHA})
