"""Every complementarity of a system as a choice: which of its factors vanishes in a finite element."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem


class Choice(Enum):
    """The factor of a complementarity that vanishes in an element."""

    SHARE = "share"
    """The partner b of a pair, or the share of an exclusion, is zero at every stage."""
    LEVEL = "level"
    """The multiplier a of a pair is zero, or the level of an exclusion is at most zero, at every point."""
    REST = "rest"
    """The rest of an exclusion is zero at every stage."""


@dataclass(frozen=True)
class Quantity:
    """A scalar function of state and algebraic variables that can be held at zero, or at one side of it.

    Attributes:
        expression: SX in x and z.
        variables: those of which it is a sum, as indices into (x, z); empty if it needs a row of its own.
        sign, offset: of a quantity that is sign * variable + offset.
        row: which of the rows it is, -1 if it is made of variables.
    """

    expression: ca.SX
    variables: tuple[int, ...]
    sign: float
    offset: float
    row: int


@dataclass(frozen=True)
class Alternative:
    """max(level, 0) share rest = 0, or a b = 0 with level a and share b.

    Attributes:
        name: for messages.
        rank: 0 decides where contact is, 1 what happens there.
        level, share, rest: indices of quantities; no rest: -1.
        direction: the level is this times its quantity, +1 or -1.
        one_sided: the level may be negative.
        kept: index of the state that stays at zero by itself while the share is not zero, -1 if there is none.
    """

    name: str
    rank: int
    level: int
    share: int
    rest: int
    direction: int
    one_sided: bool
    kept: int


@dataclass(frozen=True)
class Alternatives:
    """All complementarities of a system and the quantities they are made of.

    Attributes:
        members: in the order of the system, pairs first.
        quantities: each once; two levels of opposite sign are one quantity.
        values: (x, z) -> all quantities.
        rows: (x, z) -> those that need a row, `row_count` of them.
    """

    members: tuple[Alternative, ...]
    quantities: tuple[Quantity, ...]
    values: ca.Function
    rows: ca.Function
    row_count: int


def alternatives_of(system: ComplementaritySystem) -> Alternatives:
    """Return the alternatives that a system leaves an element.

    A share is a sum of variables that are not negative: to hold it at zero fixes them one by one, which leaves an
    interior-point method more room than one row would.
    """
    arguments = ca.vertcat(system.state, system.algebraic)
    n_x = system.state.numel()
    nonnegative = np.concatenate([np.zeros(n_x, bool), system.algebraic_lower >= 0])
    found: list[Quantity] = []
    rows: list[ca.SX] = []

    def index_of(expression: ca.SX, *, either_sign: bool = False) -> tuple[int, int]:
        for i, known in enumerate(found):
            if ca.is_equal(known.expression, expression, 10):
                return i, 1
            if either_sign and ca.is_equal(known.expression, ca.simplify(-expression), 10):
                return i, -1
            if either_sign and (known.expression + expression).is_zero():
                return i, -1
        variables, sign, offset = _affine(expression, arguments, nonnegative)
        if not variables:
            rows.append(expression)
        found.append(Quantity(expression, variables, sign, offset, -1 if variables else len(rows) - 1))
        return len(found) - 1, 1

    members = [
        Alternative(name, 0, index_of(a)[0], index_of(b)[0], -1, 1, False, -1)
        for name, a, b in zip(
            system.pair_names, ca.vertsplit(system.multiplier), ca.vertsplit(system.partner), strict=True
        )
    ]
    for exclusion in system.exclusions:
        level, direction = index_of(exclusion.level, either_sign=True)
        quantity = found[level]
        members.append(
            Alternative(
                name=exclusion.name,
                rank=exclusion.rank,
                level=level,
                share=index_of(exclusion.share)[0],
                rest=-1 if exclusion.rest is None else index_of(exclusion.rest)[0],
                direction=direction,
                one_sided=True,
                kept=quantity.variables[0] if exclusion.kept and quantity.variables else -1,
            )
        )
    x_z = [system.state, system.algebraic]
    return Alternatives(
        members=tuple(members),
        quantities=tuple(found),
        values=ca.Function("quantities", x_z, [ca.vertcat(*[one.expression for one in found])]),
        rows=ca.Function("rows", x_z, [ca.densify(ca.vertcat(ca.SX(0, 1), *rows))]),
        row_count=len(rows),
    )


def _affine(expression: ca.SX, arguments: ca.SX, nonnegative: np.ndarray) -> tuple[tuple[int, ...], float, float]:
    """Return (variables, sign, offset) of +-v + c or of a sum of variables that are not negative; else no variables."""
    slope = ca.jacobian(expression, arguments)
    if ca.symvar(slope):
        return (), 0.0, 0.0
    coefficients = np.asarray(ca.evalf(slope).full()).ravel()
    offset = float(ca.Function("offset", [arguments], [expression])(np.zeros(arguments.numel())))
    where = np.flatnonzero(coefficients)
    if len(where) == 1 and abs(coefficients[where[0]]) == 1:
        return (int(where[0]),), float(coefficients[where[0]]), offset
    if len(where) and offset == 0 and (coefficients[where] > 0).all() and nonnegative[where].all():
        return tuple(int(i) for i in where), 1.0, 0.0
    return (), 0.0, 0.0
