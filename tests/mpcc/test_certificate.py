"""The certificate of a solution: the strongest kind, and whether no direction descends."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc, certify

X, Y, Z = (W := ca.SX.sym("w", 3))[0], W[1], W[2]


def _problem(f: ca.SX, **parts: ca.SX | np.ndarray) -> Mpcc:
    return Mpcc.from_expressions(w=W, f=f, G=X, H=Y, start=np.zeros(3), **parts)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("problem", "kind", "verdict", "biactive"),
    [
        (_problem(X + Y + Z**2), "S", "certified", 1),
        (_problem(X - Y + Z**2), "W", "refuted", 1),
        (_problem(-X - Y + Z**2), "C", "refuted", 1),
        (
            _problem(X + Y - Z, g=ca.vertcat(Z - 4 * X, Z - 4 * Y), g_lower=np.full(2, -np.inf), g_upper=np.zeros(2)),
            "M",
            "certified",
            1,
        ),
    ],
    ids=["corner", "descent along one side", "descent along both", "no multipliers of the right sign"],
)
def test_known_points(problem: Mpcc, kind: str, verdict: str, biactive: int) -> None:
    """At the origin, where both sides of the pair vanish."""
    found = certify(problem, np.zeros(3))
    assert (found.b_stationary, found.biactive, found.unresolved) == (verdict, biactive, 0)
    assert found.kind == kind


def test_an_ordinary_point_is_certified() -> None:
    """Where one side of every pair is positive, a minimum is S- and so B-stationary."""
    found = certify(_problem((X - 1) ** 2 + (Y - 2) ** 2 + Z**2), np.array([0.0, 2.0, 0.0]))
    assert (found.kind, found.b_stationary, found.biactive) == ("S", "certified", 0)


def test_no_stationary_point() -> None:
    """A point with a slope that no multiplier takes is none, and refuted."""
    found = certify(_problem((X - 1) ** 2 + (Y - 2) ** 2 + Z), np.array([0.0, 2.0, 0.0]))
    assert (found.kind, found.b_stationary) == ("none", "refuted")
