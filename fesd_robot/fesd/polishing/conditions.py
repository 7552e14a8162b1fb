"""The factors of a system's complementarity conditions, in a form that bounds can hold at zero."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Complementarity, HeldAt, Label
from fesd_robot.dcs import ABOVE_LAW, IMPACT_LAW, ComplementaritySystem
from fesd_robot.running import check_time, kept_with_first


@dataclass(frozen=True)
class Quantity:
    """A scalar function of state and algebraic variables that can be held at zero, or at one side of it.

    Attributes:
        expression: SX in x and z.
        variables: those of which it is a sum, and those that vanish with it, as indices into (x, z); empty if it needs
            a row of its own.
        sign, offset: of a quantity that is sign * variable + offset.
        row: which of the rows it is; None if it is made of variables.
    """

    expression: ca.SX
    variables: tuple[int, ...]
    sign: float
    offset: float
    row: int | None


@dataclass(frozen=True)
class ConditionFactors:
    """A complementarity condition and the quantities that its factors are.

    Attributes:
        condition: of the system.
        G, H: indices of quantities; G is `direction`, +1 or -1, times its quantity.
        complement: index of a quantity; None if there is none.
        invariant_state: index of the state that stays at zero by itself while H is not zero; None if there is none.
        spare: index of the algebraic variable by which H is larger than its least, into (x, z); None if there is none.
    """

    condition: Complementarity
    G: int
    direction: int
    H: int
    complement: int | None
    invariant_state: int | None
    spare: int | None

    def quantity(self, factor: ActiveFactor) -> int:
        """Return the index of the quantity that a factor is."""
        if factor is ActiveFactor.COMPLEMENT:
            assert self.complement is not None, self.condition.label
            return self.complement
        return self.G if factor is ActiveFactor.G else self.H


@dataclass(frozen=True)
class JumpFactors:
    """A condition of the jump at the left boundary of an element.

    Attributes:
        condition: of the system's jump.
        G: index of a quantity, at the left boundary after the jump; None if it is a law.
        direction: G of the condition is `direction`, +1 or -1, times its quantity, or its law.
        law: number of the impulse whose law it is; None if it is none.
        variables: those whose sum is H, as indices into y.
        impulse: number of the impulse that it belongs to.
    """

    condition: Complementarity
    G: int | None
    direction: int
    law: int | None
    variables: tuple[int, ...]
    impulse: int


@dataclass(frozen=True)
class ElementConditions:
    """All complementarity conditions of a system and the quantities they are made of.

    Attributes:
        members: pairs first, then vanishing constraints, each in the order of the system.
        quantities: each once; two switching functions of opposite sign are one quantity.
        values: (x, z) -> all quantities.
        rows: (x, z) -> those that need a row, `row_count` of them.
        with_initial_value: (quantity, e) of the conditions that add their initial G, each once.
        algebraic: variables z of the system.
        jumps: conditions of the jump at the left boundary, if there may be one.
        jump_values: (x, y) -> the laws of its impulses, `laws` of them, and then every H of `jumps`.
    """

    members: tuple[ConditionFactors, ...]
    quantities: tuple[Quantity, ...]
    values: ca.Function
    rows: ca.Function
    row_count: int
    with_initial_value: tuple[tuple[int, float], ...]
    jumps: tuple[JumpFactors, ...] = ()
    jump_values: ca.Function | None = None
    laws: int = 0
    algebraic: ca.SX = field(default_factory=ca.SX, compare=False)

    @cached_property
    def labels(self) -> tuple[Label, ...]:
        """One a member, and one a condition of the jump."""
        own = tuple(member.condition.label for member in self.members)
        return own + tuple(jump.condition.label for jump in self.jumps)

    def goes_on(self, before: Sequence[ActiveFactor], factors: Sequence[ActiveFactor]) -> bool:
        """Return whether an element has the mode of the one before it, and no impulse acts between them."""
        count = len(self.members)
        return tuple(before[:count]) == tuple(factors[:count]) and not self.jumping(factors)

    def jumping(self, factors: Sequence[ActiveFactor]) -> bool:
        """Return whether an impulse acts at the left boundary of an element."""
        return any(factor is ActiveFactor.G for factor in factors[len(self.members) :])

    @cached_property
    def shares(self) -> dict[str, list[int]]:
        """Name of a joint -> its members whose H are shares of the clock's rate."""
        groups: dict[str, list[int]] = {}
        for i, member in enumerate(self.members):
            if member.condition.rate_share:
                assert member.condition.label.joint is not None
                groups.setdefault(member.condition.label.joint, []).append(i)
        return groups

    @cached_property
    def vanish_together(self) -> bool:
        """Whether variables vanish with the H of others, or where the clock stands still."""
        return any(member.condition.vanish_together or member.condition.idle for member in self.members)

    @cached_property
    def idle(self) -> list[tuple[int, ...]]:
        """For every member the algebraic variables that are zero where the clock stands still, indices into z."""
        return [tuple(self._of_z(symbol) for symbol in member.condition.idle) for member in self.members]

    @cached_property
    def vanishing_at_rest(self) -> list[int | None]:
        """For every member the algebraic variable that is zero where rest begins, an index into z; None for none."""
        symbols = [member.condition.vanishes_at_rest for member in self.members]
        return [None if symbol is None else self._of_z(symbol) for symbol in symbols]

    def _of_z(self, symbol: ca.SX) -> int:
        return int(np.flatnonzero(ca.DM(ca.jacobian(symbol, self.algebraic)).full().ravel())[0])

    def met(self, i: int, factors: Sequence[ActiveFactor]) -> bool:
        """Return whether others imply a condition in an element.

        Args:
            i: its number.
            factors: active factors of all conditions of an element.
        """
        return any(factors[k] is factor for k, factor in self._implying[i])

    def uses_initial_value(self, i: int, factors: Sequence[ActiveFactor]) -> bool:
        """Return whether a condition of an element is about how the element begins: that of an impact with restitution.

        Where the clock of its contact runs the conditions without a memory hold G at zero from both sides, at the left
        boundary, too, and the condition is theirs.

        Args:
            i: its number.
            factors: active factors of all conditions of an element.
        """
        own, complement = self.members[i].condition, ActiveFactor.COMPLEMENT
        of_contact = [k for k, label in enumerate(self.labels) if label.contact == own.label.contact]
        return own.initial_value_factor > 0 and any(factors[k] is complement for k in of_contact)

    @cached_property
    def _implying(self) -> list[list[tuple[int, ActiveFactor]]]:
        def about(label: Label) -> tuple[str | None, str | None]:
            return label.contact, label.joint

        return [
            [
                (k, factor)
                for kind, factor in own.condition.implied_by
                for k, other in enumerate(self.labels)
                if kind == other.kind and about(own.condition.label) == about(other)
            ]
            for own in self.members
        ]

    @cached_property
    def vector_groups(self) -> list[list[int]]:
        """Members that have the same kind of active factor, by contact or limit surface."""
        groups: dict[tuple[str, str | None, str | None], list[int]] = {}
        for i, member in enumerate(self.members):
            if member.condition.vector_component:
                label = member.condition.label
                groups.setdefault((label.kind, label.contact, label.joint), []).append(i)
        return list(groups.values())

    @cached_property
    def implied_by_rest(self) -> list[int]:
        """Rows of quantities that are zero where a contact does not move, whatever the algebraic variables are."""
        return self._rows_of(
            one for one in self.members if one.condition.implied_by and one.condition.vanishes_at_rest is None
        )

    @cached_property
    def between_all_points(self) -> list[int]:
        """Rows of quantities that keep their sign between all points of an element."""
        return self._rows_of(member for member in self.members if member.condition.held_at is HeldAt.POINTS_AND_STAGES)

    def _rows_of(self, members: Iterable[ConditionFactors]) -> list[int]:
        rows = [self.quantities[member.G].row for member in members]
        return sorted({row for row in rows if row is not None})

    def stopped(self, i: int, factors: Sequence[ActiveFactor]) -> bool:
        """Return whether what a condition is about does not move in an element, so that others imply the condition.

        Args:
            i: its number.
            factors: active factors of all conditions of an element.
        """
        return any(factors[k] is factor is ActiveFactor.G for k, factor in self._implying[i])

    def moving(self, i: int, factors: Sequence[ActiveFactor]) -> bool:
        """Return whether what an idle condition is about moves in an element.

        Args:
            i: its number.
            factors: active factors of all conditions of an element.
        """
        joint = self.members[i].condition.label.joint
        own = [k for group in self.vector_groups for k in group if self.labels[k].joint == joint]
        return ActiveFactor.COMPLEMENT not in factors and any(factors[k] is ActiveFactor.H for k in own)

    @cached_property
    def rests(self) -> frozenset[int]:
        """Of the shares of every joint the last one: where the others vanish the row of their sum determines it."""
        return frozenset(group[-1] for group in self.shares.values())

    def variables(self, quantity: int) -> set[int]:
        """Return the variables of which a quantity is a sum, empty if it is none."""
        return set(self.quantities[quantity].variables)

    def vanishing(self, factors: Sequence[ActiveFactor | None]) -> set[int]:
        """Return the variables that factors hold at zero: all of which an H that vanishes is the sum.

        Args:
            factors: active factors of the members in an element, those of the jump may follow; None if undecided.
        """
        own = zip(self.members, factors, strict=False)
        return {v for member, factor in own if factor is ActiveFactor.H for v in self.variables(member.H)}


@kept_with_first
def conditions_of(system: ComplementaritySystem) -> ElementConditions:
    """Return the conditions that a system puts on an element; they are made once.

    An H is a sum of variables that are not negative: to hold it at zero fixes them one by one, which leaves an
    interior-point method more room than one row would.
    """
    quantities = _Quantities(system)
    members = []
    for condition in (*system.pairs, *system.vanishing):
        check_time()
        G, direction = quantities.index(condition.G, either_sign=condition.vanishing)
        invariant = quantities.known[G].variables if condition.invariant else ()
        members.append(
            ConditionFactors(
                condition=condition,
                G=G,
                direction=direction,
                H=quantities.index(condition.H, vanish_together=condition.vanish_together)[0],
                complement=None if condition.complement is None else quantities.index(condition.complement)[0],
                invariant_state=invariant[0] if invariant else None,
                spare=None if condition.spare is None else quantities.variable(condition.spare),
            )
        )
    x_z = [system.state, system.algebraic]
    with_initial_value = [
        (member.G, member.condition.initial_value_factor) for member in members if member.condition.initial_value_factor
    ]
    jumps = _jump_factors(system, quantities)
    return ElementConditions(
        with_initial_value=tuple(dict.fromkeys(with_initial_value)),
        members=tuple(members),
        quantities=tuple(quantities.known),
        values=ca.Function("quantities", x_z, [ca.vertcat(*[one.expression for one in quantities.known])]),
        rows=ca.Function("rows", x_z, [ca.densify(ca.vertcat(ca.SX(0, 1), *quantities.rows))]),
        row_count=len(quantities.rows),
        jumps=jumps,
        jump_values=_jump_values(system, jumps),
        laws=len(system.impulses),
        algebraic=system.algebraic,
    )


def _jump_factors(system: ComplementaritySystem, quantities: _Quantities) -> tuple[JumpFactors, ...]:
    """Return the conditions of the system's jump, in its order."""
    jump, factors = system.jump, []
    if jump is None:
        return ()
    contacts = [impulse.contact for impulse in jump.impulses]
    nonnegative = np.concatenate([np.zeros(len(jump.states), bool), jump.algebraic_lower >= 0])
    for condition in jump.complementarities(system.pairs):
        impulse = contacts.index(str(condition.label.contact))
        is_law, direction = condition.label.kind == IMPACT_LAW, 1
        index: int | None = None
        if is_law:
            direction = 1 if condition.label.subject == ABOVE_LAW else -1
        else:
            index, direction = quantities.index(condition.G, either_sign=condition.vanishing)
        variables = _affine(condition.H, jump.symbols, nonnegative)[0]
        law = impulse if is_law else None
        factors.append(JumpFactors(condition, index, direction, law, variables, impulse))
    return tuple(factors)


def _jump_values(system: ComplementaritySystem, jumps: Sequence[JumpFactors]) -> ca.Function | None:
    if system.jump is None:
        return None
    values = [*(impulse.law for impulse in system.impulses), *(one.condition.H for one in jumps)]
    return ca.Function("jump", [system.state, system.jump.symbols], [ca.densify(ca.vertcat(*values))])


class _Quantities:
    """Collects quantities, each once."""

    def __init__(self, system: ComplementaritySystem) -> None:
        self.known: list[Quantity] = []
        self.rows: list[ca.SX] = []
        self._arguments = ca.vertcat(system.state, system.algebraic)
        self._nonnegative = np.concatenate([np.zeros(system.state.numel(), bool), system.algebraic_lower >= 0])

    def index(
        self, expression: ca.SX, *, either_sign: bool = False, vanish_together: Sequence[ca.SX] = ()
    ) -> tuple[int, int]:
        """Return the index of the quantity that is the expression, and 1, or -1 if it is its negative."""
        for i, known in enumerate(self.known):
            if ca.is_equal(known.expression, expression, 10):
                return i, 1
            if either_sign and ca.is_equal(known.expression, ca.simplify(-expression), 10):
                return i, -1
            if either_sign and (known.expression + expression).is_zero():
                return i, -1
        variables, sign, offset = _affine(expression, self._arguments, self._nonnegative)
        for one in vanish_together:
            variables += _affine(one, self._arguments, self._nonnegative)[0]
        row = None if variables else len(self.rows)
        if not variables:
            self.rows.append(expression)
        self.known.append(Quantity(expression, variables, sign, offset, row))
        return len(self.known) - 1, 1

    def variable(self, symbol: ca.SX) -> int:
        """Return the index of a state or an algebraic variable."""
        return _affine(symbol, self._arguments, self._nonnegative)[0][0]


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
