"""Stewart's form: the smallest indicator has the region, sparse signs become dense, several subsystems multiply."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem, Subsystem, stewart
from fesd_robot.errors import DimensionError, ModelError

from .models import SIGN_MATRICES, SWITCHING, P, U, X, build, by_signs, fields, random_point, values


def _system(*subsystems: Subsystem, **parts: Any) -> ComplementaritySystem:
    return build(stewart, state=X, control=U, parameters=P, subsystems=subsystems, **parts)


@pytest.mark.parametrize(
    ("kind", "regions"),
    [("one", 2), ("dense", 4), ("sparse", 4), ("dense of three", 8), ("sparse of three", 8), ("mixed of three", 8)],
)
def test_sizes(kind: str, regions: int) -> None:
    """A dense region has theta, lambda and a pair of its own; a subsystem has one mu."""
    system = _system(by_signs(kind))
    assert system.algebraic.numel() == 2 * regions + 1
    assert system.residual.numel() == regions + 1
    assert system.G.numel() == system.H.numel() == len(system.pairs) == regions
    assert system.algebraic_lower.tolist() == [0] * 2 * regions + [-np.inf]
    assert (system.algebraic_upper == np.inf).all()


def test_names_of_expanded_rows() -> None:
    """A region that does not depend on a sign appears once for each value of it, with the signs behind its name."""
    regions = ["R1(+,+)", "R1(+,-)", "R2", "R3"]
    expected = [f"{kind}[{region}]" for kind in ("theta", "lambda") for region in regions]
    system = _system(by_signs("sparse"))
    assert list(system.algebraic_names) == [*expected, "mu"]
    assert [str(pair.label) for pair in system.pairs] == [f"lambda _|_ theta [{region}]" for region in regions]
    assert list(system.state_names) == ["x0", "x1", "x2"] and list(system.control_names) == ["u0", "u1"]


@pytest.mark.parametrize("kind", SIGN_MATRICES)
@pytest.mark.parametrize("seed", range(12))
def test_the_guess_is_consistent(kind: str, seed: int) -> None:
    """At a random state the guess has no residual, is complementary, and has the field of the region it is in."""
    subsystem = by_signs(kind)
    system = _system(subsystem)
    x, u, p = random_point(seed)
    z = system.guess(x, u, p)
    at_guess = values(system, x, u, z, p)
    assert np.abs(at_guess["residual"]).max() <= 1e-14
    assert (z >= system.algebraic_lower).all()
    assert (at_guess["G"] * at_guess["H"]).max() <= 1e-10
    if seed % 3:  # not on a boundary
        function = ca.Function("parts", [X, U, P], [SWITCHING, subsystem.fields])
        c, columns = (value.full() for value in function(x, u, p))
        assert subsystem.sign_matrix is not None
        inside = [(row * c[: len(row), 0] >= 0).all() for row in subsystem.sign_matrix]
        assert sum(inside) == 1
        assert at_guess["right_hand_side"] == pytest.approx(columns[:, inside.index(True)], abs=1e-14)


def test_regions_by_indicators() -> None:
    """With three indicators the smallest has theta = 1, equal ones share, and lambda is the distance to it."""
    g = ca.vertcat(X[0], X[1], X[2] + P[0])
    system = _system(Subsystem(fields=fields(3), indicator=g, region_names=["a", "b", "c"]))
    u, p = np.zeros(2), np.array([1.0, 0.0])
    assert system.guess(np.array([3.0, 2.0, 0.5]), u, p).tolist() == [0, 0, 1, 1.5, 0.5, 0, 1.5]
    assert system.guess(np.array([2.0, 2.0, 4.0]), u, p).tolist() == [0.5, 0.5, 0, 0, 0, 3, 2]
    assert system.guess(np.array([1.0, 1.0, 0.0]), u, p)[:3].tolist() == [1 / 3] * 3
    assert system.guess(np.array([1.0, 1.0 + 1e-11, 9.0]), u, p)[:3].tolist() == [0.5, 0.5, 0]


def test_subsystems_multiply() -> None:
    """Each subsystem has its own multipliers; the right-hand side is the drift plus the field of each."""
    left, right = by_signs("one", name="left"), by_signs("sparse", name="right", fields=fields(3, seed=1))
    drift = ca.vertcat(U, P[0])
    system = _system(left, right, drift=drift)
    assert system.algebraic.numel() == 5 + 9 and system.residual.numel() == 3 + 5
    assert system.algebraic_names[4] == "mu[left]" and system.algebraic_names[5] == "theta[right: R1(+,+)]"
    x, u, p = random_point(1)
    z = system.guess(x, u, p)
    total = np.append(u, p[0])
    for subsystem in (left, right):
        alone = _system(subsystem)
        total = total + values(alone, x, u, alone.guess(x, u, p), p)["right_hand_side"]
    assert values(system, x, u, z, p)["right_hand_side"] == pytest.approx(total, abs=1e-14)
    assert np.concatenate([_system(part).guess(x, u, p) for part in (left, right)]).tolist() == z.tolist()
    assert np.abs(values(system, x, u, z + np.eye(14)[0], p)["residual"]).tolist() == [0, 0, 1, 0, 0, 0, 0, 0]


def test_own_algebraic_variables_and_quadratures() -> None:
    """The model's own algebraic variables come last, act in the fields, and their equations have no other rows."""
    z = ca.SX.sym("z", 2)
    subsystem = by_signs("one", fields=fields(2) * z[0])
    system = _system(
        subsystem,
        drift=ca.vertcat(z, 0),
        algebraic=z,
        equations=ca.vertcat(z[0] - X[0] - U[0], z[1] ** 2 - 4),
        algebraic_upper=np.array([np.inf, 3.0]),
        algebraic_guess=lambda x, u, p: ca.DM([x[0] + u[0], 2]),
        quadratures={"effort": ca.sumsqr(U) * z[1], "time": 1},
        mass_matrix=ca.diag(ca.vertcat(1, 2 + X[0] ** 2, 1)),
        algebraic_names=["force", "root"],
    )
    x, u, p = random_point(2)
    value = system.guess(x, u, p)
    assert value[5:] == pytest.approx([x[0] + u[0], 2])
    at_guess = values(system, x, u, value, p)
    plain = _system(by_signs("one"))
    field = values(plain, x, u, plain.guess(x, u, p), p)["right_hand_side"]
    assert at_guess["right_hand_side"] == pytest.approx(value[5] * field + [value[5], 2, 0])
    assert np.abs(at_guess["equations"]).max() <= 1e-15 and len(at_guess["residual"]) == 3
    assert list(system.algebraic_names[5:]) == ["force", "root"]
    assert system.algebraic_upper[5:].tolist() == [np.inf, 3]
    integrands = ca.Function("q", system.arguments, list(system.quadratures.values()))(x, u, value, p)
    assert [float(q) for q in integrands] == pytest.approx([2 * (u @ u), 1])
    assert system.mass_matrix.shape == (3, 3)


def test_an_array_is_a_guess() -> None:
    """A guess of the own algebraic variables may be numbers; without one they are zero."""
    z = ca.SX.sym("z", 2)
    parts: dict[str, Any] = {"algebraic": z, "equations": z - U}
    point = random_point(3)
    assert _system(by_signs("one"), **parts).guess(*point)[5:].tolist() == [0, 0]
    assert _system(by_signs("one"), **parts, algebraic_guess=[1, 2]).guess(*point)[5:].tolist() == [1, 2]
    wrong = _system(by_signs("one"), **parts, algebraic_guess=lambda x, u, p: x)
    with pytest.raises(DimensionError, match=r"algebraic_guess returned shape \(3,\), expected \(2,\)"):
        wrong.guess(*point)


def test_a_mode_in_words() -> None:
    """The regions whose theta may be positive are named, by subsystem if there are several."""
    one = _system(by_signs("one"))
    assert one.describe is not None
    assert [one.describe(np.array(mode, dtype=bool)) for mode in ([0, 1], [1, 1], [0, 0])] == [
        "R2",
        "R1 | R2",
        "no region",
    ]
    both = _system(by_signs("one", name="left"), by_signs("sparse", name="right"))
    assert both.describe is not None
    assert both.describe(np.array([1, 0, 0, 1, 1, 0], dtype=bool)) == "left: R1, right: R1(+,-) | R2"


LOST, Z = ca.SX.sym("lost"), ca.SX.sym("z")


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        ({"subsystems": []}, ModelError, "subsystems is empty, need at least one set of regions"),
        (
            {"subsystems": [by_signs("one"), by_signs("sparse")]},
            ModelError,
            "two subsystems are called 'regions', every one needs a name of its own",
        ),
        (
            {"subsystems": by_signs("one", fields=np.ones((2, 2)), name="arm")},
            DimensionError,
            "fields of subsystem 'arm' has shape (2, 2), expected (3, 2)",
        ),
        (
            {"subsystems": by_signs("one", fields=fields(2) * LOST)},
            ModelError,
            "fields of subsystem 'regions' uses lost, not found in state or control or parameters",
        ),
        (
            {"subsystems": by_signs("one", fields=np.full((3, 2), np.nan))},
            ModelError,
            "fields of subsystem 'regions' contains the constant nan, must be finite",
        ),
        (
            {"subsystems": by_signs("one", switching=X[0] - U[1])},
            ModelError,
            "switching of subsystem 'regions' depends on u_1 of control, which may jump: its multipliers would not be "
            "continuous in time (valid: state, parameters; make u_1 a state to switch on it)",
        ),
        (
            {"subsystems": Subsystem(fields=fields(2), indicator=ca.vertcat(Z, X[0])), "algebraic": Z, "equations": Z},
            ModelError,
            "indicator of subsystem 'regions' depends on z of algebraic, which may jump: its multipliers would not be "
            "continuous in time (valid: state, parameters; make z a state to switch on it)",
        ),
        (
            {"subsystems": Subsystem(fields=fields(2), indicator=ca.vertcat(LOST, X[0]))},
            ModelError,
            "indicator of subsystem 'regions' uses lost, not found in state or parameters",
        ),
        ({"drift": X[:2]}, DimensionError, "drift has shape (2, 1), expected (3, 1)"),
        ({"drift": X * LOST}, ModelError, "drift uses lost, not found in state or control or parameters"),
    ],
)
def test_wrong_models_are_refused(parts: dict[str, Any], error: type[Exception], message: str) -> None:
    """The message names the offending part, what it is and what it must be."""
    with pytest.raises(error) as caught:
        build(stewart, **{"state": X, "control": U, "parameters": P, "subsystems": by_signs("one"), **parts})
    assert str(caught.value) == message
