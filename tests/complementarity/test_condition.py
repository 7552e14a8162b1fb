"""A complementarity condition checks its factors when it is made."""

from __future__ import annotations

from typing import Any

import casadi as ca
import pytest

from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.errors import DimensionError, FesdRobotError, ModelError

G, H, TWO = ca.SX.sym("G"), ca.SX.sym("H"), ca.SX.sym("x", 2)
LABEL = Label("force at a distance", "foot")


def test_defaults() -> None:
    """A condition is a pair of the position level at every point, with no third factor."""
    pair = Complementarity(LABEL, G, H)
    assert not pair.vanishing and pair.complement is None and pair.level == "position"
    assert not pair.invariant and pair.held_at is HeldAt.POINTS


@pytest.mark.parametrize(
    ("factors", "error", "message"),
    [
        ({"G": TWO}, DimensionError, "G of 'force at a distance [foot]' has shape (2, 1), expected (1, 1)"),
        ({"H": TWO.T}, DimensionError, "H of 'force at a distance [foot]' has shape (1, 2), expected (1, 1)"),
        (
            {"vanishing": True, "complement": ca.SX(0, 1)},
            DimensionError,
            "complement of 'force at a distance [foot]' has shape (0, 1), expected (1, 1)",
        ),
        (
            {"complement": 1 - H},
            ModelError,
            "'force at a distance [foot]' has a complement, which only a vanishing constraint can have",
        ),
    ],
)
def test_what_is_no_condition_is_refused(factors: dict[str, Any], error: type[FesdRobotError], message: str) -> None:
    """A factor that is no scalar, and a third factor of a pair, are named with the condition."""
    with pytest.raises(error) as caught:
        Complementarity(**{"label": LABEL, "G": G, "H": H, **factors})
    assert str(caught.value) == message


def test_a_vanishing_constraint_may_have_a_complement() -> None:
    """max(G, 0) H C = 0 has three factors."""
    condition = Complementarity(LABEL, G, H, vanishing=True, complement=1 - H)
    assert condition.complement is not None and ca.is_equal(condition.complement, 1 - H, 1)
