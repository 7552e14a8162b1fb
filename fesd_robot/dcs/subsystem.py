"""One set of regions of a piecewise smooth system, with a vector field on each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs.checks import as_expression, check_content, check_shape, check_switching, check_unique
from fesd_robot.dcs.model import Model
from fesd_robot.errors import DimensionError, ModelError


@checked
@dataclass(frozen=True, eq=False)
class Subsystem:
    """Regions R_i that tile the state space, and the vector field f_i that holds on each.

    Either ``R_i = {x | S_ik c_k(x) > 0 for every k with S_ik != 0}`` or ``R_i = {x | g_i(x) < g_j(x) for all j != i}``.

    Args:
        fields: SX or numbers (n_x, n_f), column i is f_i(x, u, z, p).
        switching: c, SX (n_c) in x, p.
        sign_matrix: S (n_f, n_c) with entries -1, 0 and 1; 0 where a region does not depend on the sign.
        indicator: g, SX (n_f) in x, p.
        name: for messages and results.
        region_names: one a region; R1, R2, ... if omitted.

    Raises:
        DimensionError: a part of the wrong shape.
        ModelError: both or neither description of the regions, an entry of S that is no sign, regions that overlap or
            leave a sign vector out, fewer than two regions.

    Source: Nurkanovic et al., arXiv 2205.05337, section 2 (indicators); arXiv 2303.18066 (signs).
    """

    fields: ca.SX
    switching: ca.SX | None = None
    sign_matrix: np.ndarray | None = None
    indicator: ca.SX | None = None
    name: str = "regions"
    region_names: Sequence[str] = ()

    def __post_init__(self) -> None:
        where = f"of subsystem '{self.name}'"
        fields = as_expression(f"fields {where}", self.fields)
        n_f = fields.shape[1]
        if n_f < 2:
            raise ModelError(f"subsystem '{self.name}' has {n_f} regions, need at least two (nothing switches else)")
        names = list(self.region_names or [f"R{i + 1}" for i in range(n_f)])
        if len(names) != n_f:
            raise DimensionError(f"region_names {where} has shape ({len(names)},), expected ({n_f},)")
        check_unique(f"regions {where}", names)
        object.__setattr__(self, "fields", fields)
        object.__setattr__(self, "region_names", names)
        by_signs = self.switching is not None and self.sign_matrix is not None
        by_indicator = self.switching is None and self.sign_matrix is None and self.indicator is not None
        if not by_indicator and (not by_signs or self.indicator is not None):
            parts = ("switching", "sign_matrix", "indicator")
            given = " and ".join(part for part in parts if getattr(self, part) is not None) or "nothing"
            raise ModelError(
                f"the regions {where} are given by {given}, must be either switching and sign_matrix or indicator"
            )
        if by_indicator:
            indicator = as_expression(f"indicator {where}", self.indicator)
            check_shape(f"indicator {where}", indicator, (n_f, 1))
            object.__setattr__(self, "indicator", indicator)
            return
        switching = as_expression(f"switching {where}", self.switching)
        check_shape(f"switching {where}", switching, (max(switching.numel(), 1), 1))
        object.__setattr__(self, "switching", switching)
        signs = _signs(self.sign_matrix, (n_f, switching.numel()), where)
        _check_tiling(signs, names, where)
        object.__setattr__(self, "sign_matrix", signs)

    def check(self, model: Model) -> None:
        """Check the expressions against the symbols of the model they are used in.

        Raises:
            DimensionError: fields whose length is not that of the state.
            ModelError: an unknown symbol, a constant that is not finite, regions that depend on what may jump.
        """
        where = f"of subsystem '{self.name}'"
        check_shape(f"fields {where}", self.fields, (model.state.numel(), self.fields.shape[1]))
        check_content(f"fields {where}", self.fields, model.symbols)
        for what in ("switching", "indicator"):
            if getattr(self, what) is not None:
                check_switching(f"{what} {where}", getattr(self, what), model.continuous, model.discontinuous)


def checked_subsystems(
    subsystems: Subsystem | Sequence[Subsystem], drift: ca.SX | None, model: Model
) -> tuple[list[Subsystem], ca.SX]:
    """Return the subsystems and the drift of a model, checked; no drift is (n_x) zeros.

    Raises:
        DimensionError: an expression whose length is not that of the state.
        ModelError: no subsystem, two of one name, or what `Subsystem.check` refuses.
    """
    checked = [subsystems] if isinstance(subsystems, Subsystem) else list(subsystems)
    if not checked:
        raise ModelError("subsystems is empty, need at least one set of regions")
    check_unique("subsystems", [subsystem.name for subsystem in checked])
    for subsystem in checked:
        subsystem.check(model)
    n_x = model.state.numel()
    common = ca.SX.zeros(n_x) if drift is None else as_expression("drift", drift)
    check_shape("drift", common, (n_x, 1))
    check_content("drift", common, model.symbols)
    return checked, common


def labels(subsystems: Sequence[Subsystem], names: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the names of every subsystem's regions or steps, behind the subsystem's own if there are several."""
    if len(subsystems) == 1:
        return [list(names[0])]
    return [[f"{s.name}: {name}" for name in own] for s, own in zip(subsystems, names, strict=True)]


def _signs(given: object, shape: tuple[int, int], where: str) -> np.ndarray:
    values = np.asarray(given, dtype=float)
    if values.shape != shape:
        raise DimensionError(
            f"sign_matrix {where} has shape {values.shape}, expected {shape}, one row a region and one column a "
            "switching function"
        )
    for i, k in np.argwhere(~np.isin(values, (-1, 0, 1))):
        raise ModelError(f"sign_matrix {where} has {values[i, k]:g} at [{i}, {k}], must be -1, 0 or 1")
    signs = values.astype(int)
    signs.setflags(write=False)
    return signs


def _check_tiling(signs: np.ndarray, names: Sequence[str], where: str) -> None:
    """Check that every vector of signs belongs to exactly one row."""
    n_f, n_c = signs.shape
    for i in range(n_f):
        for j in range(i):
            if not (signs[i] * signs[j] < 0).any():
                raise ModelError(
                    f"the regions {names[j]} and {names[i]} {where} overlap (rows {j} and {i} of sign_matrix), two "
                    "rows must have opposite signs in some column"
                )
    if _volume(signs) == 2**n_c:
        return
    rows, missing = signs, list[str]()
    for k in range(n_c):
        # Rows do not overlap, so they cover a half of what remains if and only if their parts of it add up.
        halves = {sign: rows[rows[:, k] * sign >= 0] for sign in (1, -1)}
        sign = 1 if _volume(halves[1][:, k + 1 :]) < 2 ** (n_c - k - 1) else -1
        rows, missing = halves[sign], [*missing, "+" if sign > 0 else "-"]
    raise ModelError(f"no region for the signs ({', '.join(missing)}) of the switching functions {where}")


def _volume(rows: np.ndarray) -> int:
    """Return the number of sign vectors in all rows together."""
    return int((2 ** (rows == 0).sum(axis=1)).sum())
