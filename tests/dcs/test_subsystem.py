"""Regions must tile the state space; a description that does not is refused with the reason."""

from __future__ import annotations

from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import Subsystem
from fesd_robot.errors import DimensionError, ModelError, OptionError

from .models import SIGN_MATRICES, X, by_signs

C = X[:2]


@pytest.mark.parametrize("kind", SIGN_MATRICES)
def test_regions_that_tile_are_accepted(kind: str) -> None:
    """Dense and sparse sign matrices are valid in any order of rows and columns, and with any column negated."""
    rng = np.random.default_rng(0)
    signs = np.array(SIGN_MATRICES[kind])
    for _ in range(5):
        turned = rng.permutation(rng.permutation(signs, axis=0), axis=1) * rng.choice([-1, 1], size=signs.shape[1])
        kept = by_signs(kind, sign_matrix=turned).sign_matrix
        assert kept is not None and np.array_equal(kept, turned)


@pytest.mark.parametrize("kind", SIGN_MATRICES)
def test_every_row_is_needed(kind: str) -> None:
    """Without any one row a sign vector is left out, and the message names one that the row matches."""
    signs = np.array(SIGN_MATRICES[kind])
    for i in range(len(signs) if len(signs) > 2 else 0):
        with pytest.raises(ModelError, match="no region for the signs") as caught:
            by_signs(kind, fields=np.ones((3, len(signs) - 1)), sign_matrix=np.delete(signs, i, axis=0))
        named = str(caught.value).split("(")[1].split(")")[0].split(", ")
        assert all(sign == 0 or (word == "+") == (sign > 0) for word, sign in zip(named, signs[i], strict=True))


def test_random_sign_matrices_are_judged_by_enumeration() -> None:
    """A matrix is accepted if and only if every sign vector matches exactly one of its rows."""
    rng = np.random.default_rng(1)
    accepted = 0
    for _ in range(2000):
        n_c = int(rng.integers(1, 4))
        signs = rng.choice([-1, 0, 1], size=(int(rng.integers(2, 5)), n_c), p=[0.4, 0.2, 0.4])
        vectors = np.array(list(product((1, -1), repeat=n_c)))
        matches = [int(sum((row * vector >= 0).all() for row in signs)) for vector in vectors]
        try:
            Subsystem(fields=np.zeros((1, len(signs))), switching=X[:n_c], sign_matrix=signs)
            valid = True
        except ModelError:
            valid = False
        assert valid == (set(matches) == {1})
        accepted += valid
    assert accepted > 50


def test_numbers_and_defaults() -> None:
    """Numbers become expressions, regions are R1, R2, ..., and what was given cannot be changed afterwards."""
    numbers = Subsystem(fields=[[3, 1]], switching=X[0], sign_matrix=[[-1], [1]])
    assert isinstance(numbers.fields, ca.SX) and numbers.fields.shape == (1, 2)
    assert numbers.name == "regions" and list(numbers.region_names) == ["R1", "R2"]
    assert numbers.sign_matrix is not None
    with pytest.raises(ValueError, match="read-only"):
        numbers.sign_matrix[0, 0] = 1
    named = Subsystem(fields=ca.DM([[3, 1]]), indicator=ca.vertcat(X[0], X[1]), region_names=["low", "high"])
    assert list(named.region_names) == ["low", "high"] and named.switching is None


TWO: dict[str, Any] = {"fields": np.eye(2), "switching": X[0], "sign_matrix": [[-1], [1]]}
FOUR: dict[str, Any] = {"fields": np.ones((1, 4)), "switching": C, "sign_matrix": SIGN_MATRICES["dense"]}


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        (
            {**TWO, "fields": np.ones((1, 1))},
            ModelError,
            "subsystem 'regions' has 1 regions, need at least two (nothing switches else)",
        ),
        (
            {**TWO, "fields": "f"},
            ModelError,
            "fields of subsystem 'regions' is of type str, must be a casadi SX or numbers",
        ),
        (
            {**TWO, "region_names": ["a"]},
            DimensionError,
            "region_names of subsystem 'regions' has shape (1,), expected (2,)",
        ),
        (
            {**TWO, "region_names": ["a", "a"]},
            ModelError,
            "two regions of subsystem 'regions' are called 'a', every one needs a name of its own",
        ),
        (
            {**TWO, "indicator": C},
            ModelError,
            "the regions of subsystem 'regions' are given by switching and sign_matrix and indicator, must be either "
            "switching and sign_matrix or indicator",
        ),
        (
            {"fields": np.eye(2), "switching": X[0], "name": "arm"},
            ModelError,
            "the regions of subsystem 'arm' are given by switching, must be either switching and sign_matrix or "
            "indicator",
        ),
        (
            {"fields": np.eye(2)},
            ModelError,
            "the regions of subsystem 'regions' are given by nothing, must be either switching and sign_matrix or "
            "indicator",
        ),
        (
            {"fields": np.eye(2), "indicator": X},
            DimensionError,
            "indicator of subsystem 'regions' has shape (3, 1), expected (2, 1)",
        ),
        (
            {**FOUR, "switching": C.T},
            DimensionError,
            "switching of subsystem 'regions' has shape (1, 2), expected (2, 1)",
        ),
        (
            {**FOUR, "sign_matrix": [[1], [-1]]},
            DimensionError,
            "sign_matrix of subsystem 'regions' has shape (2, 1), expected (4, 2), one row a region and one column a "
            "switching function",
        ),
        (
            {**TWO, "sign_matrix": [["+"], ["-"]]},
            OptionError,
            "Subsystem: sign_matrix: found [['+'], ['-']], expected numbers or an array of them or None",
        ),
        (
            {**TWO, "sign_matrix": [[-1], [0.5]]},
            ModelError,
            "sign_matrix of subsystem 'regions' has 0.5 at [1, 0], must be -1, 0 or 1",
        ),
        (
            {**TWO, "sign_matrix": [[1], [1]]},
            ModelError,
            "the regions R1 and R2 of subsystem 'regions' overlap (rows 0 and 1 of sign_matrix), two rows must have "
            "opposite signs in some column",
        ),
        (
            {**FOUR, "sign_matrix": [[1, 1], [1, -1], [0, -1], [-1, 1]], "region_names": list("abcd")},
            ModelError,
            "the regions b and c of subsystem 'regions' overlap (rows 1 and 2 of sign_matrix), two rows must have "
            "opposite signs in some column",
        ),
        (
            {**FOUR, "fields": np.ones((1, 3)), "sign_matrix": [[1, 1], [-1, 1], [-1, -1]]},
            ModelError,
            "no region for the signs (+, -) of the switching functions of subsystem 'regions'",
        ),
    ],
)
def test_what_is_no_tiling_is_refused(parts: dict[str, Any], error: type[Exception], message: str) -> None:
    """The message names the offending part, what it is and what it must be."""
    with pytest.raises(error) as caught:
        Subsystem(**parts)
    assert str(caught.value) == message
