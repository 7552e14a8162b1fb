"""MPCCs from elsewhere: files of the suites, in which CasADi's functions are text, and problems of CasADi's `Opti`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import ModelError, nearest
from fesd_robot.mpcc.problem import Mpcc

INFINITE = 1e19
"""Size from which a bound in a file is none, as solvers of nonlinear programs have it."""

OBJECTIVES = ("augmented_objective_fun", "f_fun")
"""Keys of the objective: that of NOSBENCH, with its costs of steps, and that of MPECLib's conversion."""

NEEDED = ("w0", "lbw", "ubw", "G_fun", "H_fun")
"""Keys of every file, beside its objective."""

UNUSED = ("w", "p", "objective_fun", "name", "family")
"""Keys that files have and nobody needs: symbols, an objective without costs of steps, names."""

KNOWN = (*NEEDED, *OBJECTIVES, "p0", "g_fun", "lbg", "ubg", "lbG", "ubG", "lbH", "ubH", *UNUSED)
"""All keys."""


@checked
def read_casadi_json(file: str | Path) -> Mpcc:
    """Read an MPCC from a JSON file whose functions CasADi has serialized, as those of NOSBENCH and MPECLib.

    min f(w, p0) s.t. lbw <= w <= ubw, lbg <= g(w, p0) <= ubg, 0 <= G(w, p0) complementary to H(w, p0) >= 0. Keys: `w0`,
    `lbw`, `ubw`; `p0` where functions have parameters; `augmented_objective_fun` or `f_fun`; `g_fun` with `lbg`, `ubg`;
    `G_fun` and `H_fun`; and perhaps `lbG`, `lbH`, `ubH`, by which a pair is one of a mixed complementarity problem:

    - lbH finite: 0 <= G complementary to H - lbH >= 0, and H <= ubH is a row;
    - ubH alone finite: 0 <= G complementary to ubH - H >= 0, with -G in the place of G if lbG is none;
    - both finite and lbG none: G may be positive at lbH only and negative at ubH only; G is then the difference of two
      variables that are added behind w;
    - neither finite: G = 0; lbH = ubH and lbG none: H = lbH, and G is free.

    Args:
        file: its path.

    Returns:
        The MPCC; its first variables are those of the file.

    Raises:
        ModelError: no such file, no JSON, a key that is missing or unknown, a function or a list that does not fit.

    Source: MPCCs of Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022; mixed complementarity as in GAMS (Ferris, Munson
    2000).
    """
    path = Path(file)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror}, expected an MPCC in a JSON file") from error
    except ValueError as error:
        raise ModelError(f"{path}: no JSON ({error}), expected an MPCC as NOSBENCH and MPECLib have it") from error
    if not isinstance(data, dict):
        raise ModelError(f"{path}: found a {type(data).__name__}, expected an object with w0, lbw, ubw, G_fun, H_fun")
    for key in data:
        if key not in KNOWN:
            raise ModelError(f"{path}: unknown key '{key}'{nearest(key, KNOWN)}, expected {', '.join(KNOWN)}")
    return _Reader(path, data).problem()


class _Reader:
    """One file, whose values are checked as they are read."""

    def __init__(self, path: Path, data: dict[str, Any]) -> None:
        self._path, self._data = path, data

    def problem(self) -> Mpcc:
        """The MPCC of the file."""
        start = self._numbers("w0")
        n = len(start)
        w, p = ca.SX.sym("w", n), self._numbers("p0") if "p0" in self._data else np.zeros(0)
        objective = next((key for key in OBJECTIVES if key in self._data), OBJECTIVES[0])
        f, G, H = (self._expression(key, w, p) for key in (objective, "G_fun", "H_fun"))
        g = self._expression("g_fun", w, p) if self._data.get("g_fun") else ca.SX(0, 1)
        if f.numel() != 1:
            raise ModelError(f"{self._path}: {objective} has {f.numel()} values, expected 1")
        if G.numel() != H.numel():
            raise ModelError(f"{self._path}: G_fun has {G.numel()} values, H_fun has {H.numel()}: they form pairs")
        lower, upper = self._bounds("lbw", "ubw", n)
        g_lower, g_upper = self._bounds("lbg", "ubg", g.numel()) if g.numel() else (np.zeros(0), np.zeros(0))
        if np.isfinite(self._numbers("ubG", G.numel(), np.inf)).any():
            raise ModelError(f"{self._path}: ubG is finite, expected bounds of mixed complementarity on H alone")
        pairs = _of_mixed_pairs(
            G, H, self._numbers("lbG", G.numel(), 0.0), *self._bounds("lbH", "ubH", H.numel(), (0.0, np.inf))
        )
        added = pairs.added.numel()
        return Mpcc.from_expressions(
            ca.vertcat(w, pairs.added),
            f,
            start=np.append(start, np.zeros(added)),
            g=ca.vertcat(g, pairs.rows),
            G=pairs.G,
            H=pairs.H,
            bounds=(np.append(lower, np.zeros(added)), np.append(upper, np.full(added, np.inf))),
            g_bounds=(np.append(g_lower, pairs.lower), np.append(g_upper, pairs.upper)),
        )

    def _numbers(self, key: str, size: int | None = None, default: float | None = None) -> np.ndarray:
        """The list of numbers under a key, one number standing for as many as needed."""
        value = self._data.get(key)
        if value is None and default is not None and size is not None:
            return np.full(size, default)
        try:
            array = np.atleast_1d(np.array(value, dtype=float)).ravel()
        except (TypeError, ValueError):
            array = np.array([np.nan])
        if np.isnan(array).any():
            raise ModelError(f"{self._path}: {key} is {str(value)[:40]}, expected a list of numbers")
        if size is not None and len(array) == 1 != size:
            array = np.full(size, array[0])
        if size is not None and len(array) != size:
            raise ModelError(f"{self._path}: {key} has {len(array)} numbers, expected {size}")
        return np.where(np.abs(array) >= INFINITE, np.copysign(np.inf, array), array)

    def _bounds(
        self, low: str, high: str, size: int, default: tuple[float, float] = (-np.inf, np.inf)
    ) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = self._numbers(low, size, default[0]), self._numbers(high, size, default[1])
        if (lower > upper).any():
            at = int(np.argmax(lower > upper))
            found = f"{low}[{at}] is {lower[at]:g} and {high}[{at}] is {upper[at]:g}"
            raise ModelError(f"{self._path}: {found}, expected the upper bound not to be less")
        return lower, upper

    def _expression(self, key: str, w: ca.SX, p: np.ndarray) -> ca.SX:
        """The function under a key at w and p0."""
        try:
            function = ca.Function.deserialize(self._data[key])
        except KeyError:
            raise ModelError(f"{self._path}: {key} is missing, expected a function serialized by CasADi") from None
        except Exception as error:  # CasADi raises what its bindings make of it
            raise ModelError(f"{self._path}: {key} is no function serialized by CasADi") from error
        sizes = [function.numel_in(i) for i in range(function.n_in())]
        if sizes not in ([w.numel()], [w.numel(), len(p)]):
            expected = f"{w.numel()}, and {len(p)} of p0" if len(p) else f"{w.numel()}"
            raise ModelError(f"{self._path}: {key} takes {sizes} numbers, expected {expected}")
        return ca.vec(ca.SX(function(*(w, ca.DM(p))[: len(sizes)])))


@dataclass(frozen=True)
class _Pairs:
    """Pairs with both sides non-negative, and the rows and variables that mixed ones have beside them."""

    G: ca.SX
    H: ca.SX
    rows: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    added: ca.SX


def _of_mixed_pairs(G: ca.SX, H: ca.SX, G_low: np.ndarray, H_low: np.ndarray, H_high: np.ndarray) -> _Pairs:
    """Return pairs for those of a mixed complementarity problem, H_low <= H <= H_high complementary to G."""
    sides: list[tuple[ca.SX, ca.SX]] = []
    rows: list[tuple[ca.SX, float, float]] = []
    added: list[ca.SX] = []
    for i, (low, high) in enumerate(zip(H_low, H_high, strict=True)):
        signed = bool(np.isfinite(G_low[i]))
        if np.isinf(low) and np.isinf(high):
            rows.append((G[i], 0.0, 0.0))
        elif np.isinf(low):
            sides.append((G[i] if signed else -G[i], high - H[i]))
        elif np.isinf(high) or signed:
            sides.append((G[i] - G_low[i] if signed else G[i], H[i] - low))
            if np.isfinite(high):
                rows.append((H[i], -np.inf, high))
        elif low == high:
            rows.append((H[i], low, high))
        else:
            above, below = ca.SX.sym(f"above_{i}"), ca.SX.sym(f"below_{i}")
            added += [above, below]
            rows.append((G[i] - above + below, 0.0, 0.0))
            sides += [(above, H[i] - low), (below, high - H[i])]
    return _Pairs(
        G=ca.vertcat(ca.SX(0, 1), *(one for one, _ in sides)),
        H=ca.vertcat(ca.SX(0, 1), *(one for _, one in sides)),
        rows=ca.vertcat(ca.SX(0, 1), *(row for row, _, _ in rows)),
        lower=np.array([low for _, low, _ in rows]),
        upper=np.array([high for _, _, high in rows]),
        added=ca.vertcat(ca.SX(0, 1), *added),
    )


@partial(checked, exact=True)
def from_opti(opti: ca.Opti, pairs: Sequence[tuple[ca.MX, ca.MX]]) -> Mpcc:
    """Return the MPCC of CasADi's `Opti` with complementarity pairs 0 <= G complementary to H >= 0.

    Objective, constraints, values of parameters and initial values are those that the `Opti` has; it needs no solver.

    Args:
        opti: with `minimize` and `subject_to` called, but not for the pairs.
        pairs: (G, H) in the variables and parameters of it, columns of one shape each.

    Returns:
        The MPCC; its variables are those of `opti.x`.

    Raises:
        ModelError: sides of different shape, a parameter without value, or a function that CasADi cannot expand.
    """
    for i, (one, other) in enumerate(pairs):
        if one.shape != other.shape:
            raise ModelError(f"pair {i}: G has shape {one.shape}, H has shape {other.shape}, expected one shape")
    G, H = (ca.vertcat(ca.MX(0, 1), *(ca.vec(pair[side]) for pair in pairs)) for side in (0, 1))
    try:
        p = np.asarray(opti.debug.value(opti.p, opti.initial())).ravel()
    except RuntimeError:
        p = np.array([np.nan])
    if np.isnan(p).any():
        raise ModelError("Opti: a parameter has no value, expected one by set_value")
    try:
        start, lower, upper = (
            np.asarray(opti.debug.value(value, opti.initial())).ravel() for value in (opti.x, opti.lbg, opti.ubg)
        )
        function = ca.Function("opti", [opti.x, opti.p], [opti.f, opti.g, G, H]).expand()
    except RuntimeError as error:
        raise ModelError(f"Opti: found {str(error).strip().splitlines()[-1]}, expected what CasADi expands") from error
    w = ca.SX.sym("w", opti.x.numel())
    f, g, G_of_w, H_of_w = function(w, ca.DM(p))
    return Mpcc.from_expressions(w, f, start=start, g=g, G=G_of_w, H=H_of_w, g_bounds=(lower, upper))
