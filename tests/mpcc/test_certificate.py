"""The certificate of a solution: the strongest kind, and whether no direction descends."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc, b_stationarity, certify, derivatives, stationarity
from fesd_robot.mpcc.derivatives import Linearisation, linearise

from .known import X, Y, Z, mpcc, upper_rows


def _problem(f: ca.SX, **parts: Any) -> Mpcc:
    return mpcc(f, X, Y, [0, 0, 0], **parts)


@pytest.mark.parametrize(
    ("problem", "kind", "verdict", "biactive"),
    [
        (_problem(X + Y + Z**2), "S", "certified", 1),
        (_problem(X - Y + Z**2), "W", "refuted", 1),
        (_problem(-X - Y + Z**2), "C", "refuted", 1),
        (
            _problem(X + Y - Z, **upper_rows(Z - 4 * X, Z - 4 * Y)),
            "M",
            "certified",
            1,
        ),
    ],
    ids=["corner", "descent along one side", "descent along both", "no multipliers of the right sign"],
)
def test_known_points(problem: Mpcc, kind: str, verdict: str, biactive: int) -> None:
    """At the origin, where both sides of the pair vanish."""
    certificate = certify(problem, np.zeros(3))
    assert (certificate.b_stationary, certificate.biactive, certificate.unresolved) == (verdict, biactive, 0)
    assert certificate.kind == kind


def test_an_ordinary_point_is_certified() -> None:
    """Where one side of every pair is positive, a minimum is S- and so B-stationary."""
    certificate = certify(_problem((X - 1) ** 2 + (Y - 2) ** 2 + Z**2), np.array([0.0, 2.0, 0.0]))
    assert (certificate.kind, certificate.b_stationary, certificate.biactive) == ("S", "certified", 0)


def test_no_stationary_point() -> None:
    """A point with a slope that no multiplier takes is none, and refuted."""
    certificate = certify(_problem((X - 1) ** 2 + (Y - 2) ** 2 + Z), np.array([0.0, 2.0, 0.0]))
    assert (certificate.kind, certificate.b_stationary) == ("none", "refuted")
    assert certificate.bound <= certificate.slope < 0.0


def test_the_problem_is_linearised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both answers of a certificate, the kind and the descent, come from one expansion."""
    problem, points = _problem(X + Y - Z, **upper_rows(Z - 4 * X, Z - 4 * Y)), []
    expected = certify(problem, np.zeros(3))

    def counted(problem: Mpcc, w: np.ndarray) -> Linearisation:
        points.append(w)
        return linearise(problem, w)

    for module in (derivatives, stationarity, b_stationarity):
        monkeypatch.setattr(module, "linearise", counted)
    assert certify(problem, np.zeros(3)) == expected
    assert len(points) == 1


def test_a_direction_that_is_not_wanted_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A problem that descends along y alone is certified without y, and the kind is not asked for with it."""
    problem, kinds = _problem(X - Y + Z**2), []
    found = stationarity.stationarity
    monkeypatch.setattr(
        stationarity, "stationarity", lambda *args, **options: kinds.append(1) or found(*args, **options)
    )

    def without(direction: np.ndarray) -> Mpcc:
        assert direction[1] > 0
        return _problem(X + Z**2, bounds=(None, np.array([np.inf, 0.0, np.inf])))

    assert certify(problem, np.zeros(3)).b_stationary == "refuted" and kinds == [1]
    certificate = certify(problem, np.zeros(3), without=without)
    assert (certificate.kind, certificate.b_stationary) == ("S", "certified") and kinds == [1]


def test_a_direction_that_stands_is_returned() -> None:
    """Where the caller keeps a direction of descent, the certificate is that without the question."""
    problem = _problem(X - Y + Z**2)
    certificate, expected = certify(problem, np.zeros(3), without=lambda direction: None), certify(problem, np.zeros(3))
    assert certificate.b_stationary == "refuted" and certificate.kind == expected.kind == "W"
    assert certificate.direction == pytest.approx(expected.direction)
