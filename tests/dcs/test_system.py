"""A complementarity system checks its shapes when it is made."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError


def _bouncing(**changes: Any) -> ComplementaritySystem:
    """x'' = lambda with 0 <= lambda _|_ gap >= 0, the gap a variable of its own; control and parameter are unused."""
    x, u, p, z = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p"), ca.SX.sym("z", 2)
    system = ComplementaritySystem(
        state=x,
        control=u,
        parameters=p,
        algebraic=z,
        mass_matrix=ca.SX.eye(2),
        right_hand_side=ca.vertcat(x[1], z[0]),
        residual=z[1] - x[0],
        algebraic_lower=np.zeros(2),
        algebraic_upper=np.full(2, np.inf),
        regularisation=ca.SX(0),
        guess=lambda x, u, p: np.array([0.0, x[0]]),
        state_names=["height", "speed"],
        control_names=["u"],
        algebraic_names=["force", "gap"],
        complementarities=[Complementarity(Label("contact"), z[1], z[0])],
    )
    return replace(system, **changes)


def test_arguments_are_in_the_order_of_every_function() -> None:
    """x, u, z, p."""
    system = _bouncing()
    function = ca.Function("f", system.arguments, [system.right_hand_side, system.residual])
    rate, residual = function([2.0, -1.0], 0.0, [3.0, 2.0], 0.0)
    assert np.asarray(rate).ravel().tolist() == [-1, 3]
    assert float(residual) == 0
    assert system.vanishing == ()
    assert system.equations.shape == (0, 1) and not system.quadratures and not system.lifted


def test_vanishing_constraints_are_no_pairs() -> None:
    """Pairs and vanishing constraints are distinguished, each in the order given; G and H are those of the pairs."""
    system = _bouncing()
    (contact,) = system.pairs
    none_above = Complementarity(Label("none above"), system.state[0], system.algebraic[0], vanishing=True)
    both = replace(system, complementarities=[none_above, contact])
    assert both.pairs == (contact,) and both.vanishing == (none_above,)
    assert ca.is_equal(both.G, system.algebraic[1]) and ca.is_equal(both.H, system.algebraic[0])
    neither = replace(system, complementarities=[])
    assert neither.G.shape == neither.H.shape == (0, 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass_matrix": ca.SX.eye(3)}, "mass_matrix has shape (3, 3), expected (2, 2)"),
        ({"right_hand_side": ca.SX(1, 1)}, "right_hand_side has shape (1, 1), expected (2, 1)"),
        ({"equations": ca.SX(1, 2)}, "equations has shape (1, 2), expected (2, 1)"),
        ({"quadratures": {"work": ca.SX(2, 1)}}, "quadratures['work'] has shape (2, 1), expected (1, 1)"),
        ({"algebraic_lower": np.zeros(1)}, "algebraic_lower has shape (1,), expected (2,)"),
        ({"algebraic_upper": np.zeros((2, 1))}, "algebraic_upper has shape (2, 1), expected (2,)"),
        ({"state_names": ["height"]}, "state_names has shape (1,), expected (2,)"),
        ({"control_names": []}, "control_names has shape (0,), expected (1,)"),
        ({"algebraic_names": ["force"]}, "algebraic_names has shape (1,), expected (2,)"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_wrong_shapes_are_refused(changes: dict[str, Any], message: str) -> None:
    """The part that does not fit is named with its shape and the expected one."""
    with pytest.raises(DimensionError) as caught:
        _bouncing(**changes)
    assert str(caught.value) == f"complementarity system: {message}"
