"""Piecewise smooth systems for both complementarity forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields as fields_of
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem, Model, StepFunctions, Subsystem, heaviside

X, U, P = ca.SX.sym("x", 3), ca.SX.sym("u", 2), ca.SX.sym("p", 2)
MODEL = Model(state=X, control=U, parameters=P)
SWITCHING = ca.vertcat(X[0] - 0.25, X[1] * P[0], X[2] + X[0] ** 2 - P[1])
"""Up to three switching functions; the second vanishes with x1."""

SIGN_MATRICES = {
    "one": [[-1], [1]],
    "dense": [[1, 1], [1, -1], [-1, 1], [-1, -1]],
    "sparse": [[1, 0], [-1, 1], [-1, -1]],
    "dense of three": list(product((1, -1), repeat=3)),
    "sparse of three": [[-1, -1, -1], [1, 0, 0], [-1, 1, 0], [-1, -1, 1]],
    "mixed of three": [[0, 1, 1], [-1, 1, -1], [1, 1, -1], [1, -1, 0], [-1, -1, 0]],
}


def fields(n_f: int, seed: int = 0) -> ca.SX:
    """Smooth functions of x, u and p, (3, n_f), all different."""
    rng = np.random.default_rng(seed)
    arguments = ca.vertcat(X, U, P)
    return ca.horzcat(*[ca.sin(ca.mtimes(ca.DM(rng.normal(size=(3, 7))), arguments)) + i for i in range(n_f)])


def by_signs(kind: str, **parts: Any) -> Subsystem:
    """Regions by one of the sign matrices."""
    signs = np.array(SIGN_MATRICES[kind])
    arguments = {"fields": fields(len(signs)), "switching": SWITCHING[: signs.shape[1]], "sign_matrix": signs}
    return Subsystem(**{**arguments, **parts})


def build(form: Callable[..., ComplementaritySystem], **parts: Any) -> ComplementaritySystem:
    """Return the system that a form makes of the parts of its model, of its step functions, and its own arguments."""
    kinds = (Model, StepFunctions) if form is heaviside else (Model,)
    return form(*[_taken(kind, parts) for kind in kinds], **parts)


def _taken(kind: type, parts: dict[str, Any]) -> Any:
    return kind(**{field.name: parts.pop(field.name) for field in fields_of(kind) if field.name in parts})


def values(system: ComplementaritySystem, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray) -> dict[str, Any]:
    """Everything a system consists of, in numbers."""
    names = ("right_hand_side", "residual", "equations", "G", "H")
    function = ca.Function("values", system.arguments, [getattr(system, name) for name in names])
    return {name: value.full().ravel() for name, value in zip(names, function(x, u, z, p), strict=True)}


def random_point(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, u, p; every third state is on one switching surface or on two."""
    rng = np.random.default_rng(seed)
    x, u, p = rng.normal(size=3), rng.normal(size=2), rng.normal(size=2)
    if seed % 3 == 0:
        x[1] = 0.0
    if seed % 6 == 0:
        x[0] = 0.25
    return x, u, p
