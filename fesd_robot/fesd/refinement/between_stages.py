"""Where a trajectory leaves its bounds between the stages of an element, at which alone a transcription holds them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.added_rows import SLACK, BoundBetween
from fesd_robot.fesd.path_between import PLACES, PathBetween
from fesd_robot.fesd.polishing import BranchMotion, ElementConditions
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

BETWEEN = 24
"""Equal parts of an element at whose ends it is looked at."""

VIOLATION = 1e-7
"""Violation of a bound of a state between stages above which it is held there too, in the unit of the state."""

VIOLATION_OF_MULTIPLIERS = 1e-8
"""The same of a multiplier: a force of a ten-thousandth of the robot's weight."""

VIOLATION_OF_PRODUCTS = 1e-10
"""The same of a multiplier that is a product, as what is unused of a cone, (mu f_n)^2 - f_t^2: where the force is small
it is the square of a force, of a hundred-thousandth of the weight."""

VIOLATION_OF_SPARES = 1e-6
"""The same of what a multiplier has to spare beyond its least, which no law of mechanics asks for."""

PENETRATION = 2e-6
"""What a gap may be negative between stages, m: a foot that lands without acceleration has a flat gap, all of which a
stricter bound would touch."""

GAPS_BETWEEN = 8 * BETWEEN
"""Equal parts of an element at whose ends gaps are looked at: a foot that grazes the ground does it in a moment."""

CLEARANCE = 1e-6
"""Gap, m, that is held in an element in the middle of a flight in which a foot has touched the ground: an impact there
is none of the plan's, however small."""

HELD = np.arange(1, PLACES) * BETWEEN // PLACES
"""Which of their ends are places at which a path constraint is held between stages."""

STRICTER, AGAIN_STRICTER = 1.5, 4.0
"""A path constraint that is held in an element and violated there becomes stricter by this times the violation, and by
what it has to spare at the places where it is held; the second is for one that has become stricter already."""


class Violated(NamedTuple):
    """A bound, and by how much it is violated."""

    violation: float
    bound: BoundBetween | PathBetween


def violated_between_stages(motion: BranchMotion) -> list[Violated]:
    """Return the bounds that are violated between the stages of elements and not held there, the least violated first.

    Looked at are the states with their limits, gaps among them, the path constraints, and the multipliers of the
    conditions, which are not negative: at the left boundary, where controls jump, a negative one is a contact that
    pulls or leaves its cone. The multipliers of a contact that opens inside a control interval, not in an impact, have
    to be zero when it does: a force that ends although neither state nor control jumps is that of a motion that is not
    the only one (Painleve).

    Args:
        motion: of a collocation scheme.
    """
    transcription, conditions, branch = motion.transcription, motion.polisher.conditions, motion.branch
    ocp, tableau = transcription.ocp, transcription.options.tableau
    fractions = np.linspace(0, 1, BETWEEN + 1)
    of_states, of_stages = lagrange(tableau.nodes, fractions), lagrange(tableau.c, fractions)
    n_x = ocp.system.state.numel()
    signed = {one.H for one in conditions.members} | {one.G for one in conditions.members if one.condition.continuous}
    multipliers = sorted({v for one in signed for v in conditions.variables(one) if v >= n_x})
    gaps = {one.invariant_state: at for at, one in enumerate(conditions.members) if one.invariant_state is not None}
    products = _products_among(multipliers, ocp.system)
    simple = [i for i in multipliers if all(i != one.variable for one in products)]
    elements = motion.elements
    paths = [
        _Path(transcription, i)
        for i, one in enumerate(ocp.constraints)
        if one.kind == "path" and one.row_names and not one.on_request
    ]
    whole = [e for e, without in enumerate(branch.without_length) if not without and elements[e].step > 0]
    found: list[Violated] = list(_ends_of_contact(conditions, elements, branch, whole, n_x))
    found += _gaps(transcription, gaps, elements, branch, whole)
    for e in whole:
        x = of_states @ np.vstack([elements[e].x_left, elements[e].x[: tableau.stages]])
        z = of_stages @ elements[e].z[: tableau.stages]
        for i, (lower, upper) in enumerate(zip(ocp.state_lower, ocp.state_upper, strict=True)):
            found += _violated((e, i), x[1:, i], (-np.inf if i in gaps else lower, upper), VIOLATION)
        for i in simple:
            found += _violated((e, i), z[:, i - n_x], (0.0, np.inf), VIOLATION_OF_MULTIPLIERS)
        zero = conditions.vanishing(branch.factors[e])  # no bound keeps these away from there
        for i in {
            one.spare
            for one, factor in zip(conditions.members, branch.factors[e], strict=False)
            if one.spare is not None and factor is ActiveFactor.G
        }:
            missing = float(-z[:, i - n_x].min())
            if missing > VIOLATION_OF_SPARES:
                found.append(Violated(missing, BoundBetween(e, i, -1, 0.0, of_mode=True)))
        own = [one for one in products if one.variable not in zero]
        found += _products(own, e, x, z, transcription.parameters[:, elements[e].interval], n_x)
        for path in paths:
            path.look(elements[e], e, x, z)
    found += [one for path in paths for one in path.found()]
    held = set(transcription.added.bounds)
    return sorted((one for one in found if one.bound not in held), key=lambda one: one.violation)


def with_bounds_between(motion: BranchMotion, bounds: Sequence[BoundBetween | PathBetween]) -> BranchMotion:
    """Return a trajectory with further bounds between stages, from which it may be far."""
    added = motion.transcription.added
    new = [one for one in bounds if isinstance(one, BoundBetween) and one not in added.bounds]
    paths = {(one.constraint, one.element): one for one in [*added.paths, *bounds] if isinstance(one, PathBetween)}
    added = replace(added, bounds=(*added.bounds, *new), paths=tuple(paths.values()))
    return BranchMotion.of(replace(motion.transcription, added=added), motion.w, motion.branch)


class _Path:
    """A path constraint of a problem and where it is violated between stages.

    Where it is, it is to be held in all elements of the interval, for their lengths are free: a violation would else
    move next door. Where it is held already, it becomes stricter.
    """

    def __init__(self, transcription: Transcription, number: int) -> None:
        self._number, constraint = number, transcription.constraints[number]
        self._constraint = constraint
        self._rows = ca.Function("rows", [constraint.variables, constraint.parameters], [constraint.rows])
        self._held = {one.element: one.margin for one in transcription.added.paths if one.constraint == number}
        self._excess: dict[int, dict[int, float]] = {}
        self._room: dict[int, float] = {}

    def look(self, element: Element, e: int, x: np.ndarray, z: np.ndarray) -> None:
        """Note by how much an element violates the constraint.

        Args:
            element, e: the element, and its number.
            x, z: at equal distances, (n, n_x) and (n, n_z).
        """
        constraint = self._constraint
        if element.interval not in constraint.numbers:
            return
        p = constraint.parameter_values[:, list(constraint.numbers).index(element.interval)]
        u = np.tile(element.u, (len(x), 1))
        values = np.asarray(self._rows(np.hstack([x, u, z]).T, p).full())
        excess = np.maximum(constraint.lower[:, None] - values, values - constraint.upper[:, None])
        worst = excess[excess.max(axis=1).argmax()]
        self._excess.setdefault(element.interval, {})[e] = float(worst.max())
        self._room[e] = float(-worst[HELD].max())

    def found(self) -> Iterator[Violated]:
        """Yield where the constraint is to be held."""
        for excess in self._excess.values():
            worst = max(excess.values())
            if worst > max(VIOLATION, self._constraint.spare):
                for e in excess:
                    yield Violated(worst, PathBetween(self._number, e, self._margin(e, excess[e], worst)))

    def _margin(self, e: int, own: float, worst: float) -> float:
        """Return by how much the constraint is to be stricter in an element, where it is held.

        Args:
            e: number of the element.
            own, worst: largest violation in the element, and in its interval.
        """
        if e not in self._held:
            return 0.0
        room = self._room[e] if own > VIOLATION else 0.0
        return max(self._held[e], room) + (AGAIN_STRICTER if self._held[e] > 0 else STRICTER) * worst


class _Product(NamedTuple):
    """A multiplier that is a product of other algebraic variables, by a row of the system: what is unused of a cone.

    Attributes:
        variable: its index among (x, z).
        missing: (x, z, p) -> the multiplier less that product.
    """

    variable: int
    missing: ca.Function


def _products_among(multipliers: Sequence[int], system: ComplementaritySystem) -> list[_Product]:
    """Return the multipliers that are products."""
    n_x, found = system.state.numel(), []
    symbols = [system.state, system.algebraic, system.parameters]
    for i in multipliers:
        slopes = ca.jacobian(system.residual, system.algebraic[i - n_x])
        for row in range(system.residual.numel()):
            own = system.residual[row]
            if slopes[row].is_one() and any(ca.which_depends(own, system.algebraic, 2)):
                found.append(_Product(i, ca.Function("missing", symbols, [own])))
    return found


def _products(
    products: Sequence[_Product], e: int, x: np.ndarray, z: np.ndarray, p: np.ndarray, n_x: int
) -> Iterator[Violated]:
    """Yield by how much multipliers that are products are negative, and bounds of their own polynomials that cure it.

    These do not multiply, and their bounds have some slack: both is added to the bound.

    Args:
        e: number of the element.
        x, z: at equal distances, (n, n_x) and (n, n_z).
        p: parameters of its interval.
    """
    for one in products:
        own = z[:, one.variable - n_x]
        missing = np.asarray(one.missing(x.T, z.T, np.tile(p[:, None], len(x))).full()).ravel()
        violation = float((missing - own).max())
        if violation > VIOLATION_OF_PRODUCTS:
            limit = STRICTER * max(float(missing[int((missing - own).argmax())]), 0.0) + SLACK
            yield Violated(violation, BoundBetween(e, one.variable, -1, limit))


def _gaps(
    transcription: Transcription,
    gaps: Mapping[int, int],
    elements: Sequence[Element],
    branch: Branch,
    whole: Sequence[int],
) -> Iterator[Violated]:
    """Yield by how much gaps pass their lower limits, and their bound: a little below, within a flight a little above.

    Args:
        gaps: state -> number of the condition that holds it at zero.
        whole: numbers of the elements with a length.
    """
    tableau = transcription.options.tableau
    of_states = lagrange(tableau.nodes, np.linspace(0, 1, GAPS_BETWEEN + 1))
    for n, e in enumerate(whole):
        x = of_states @ np.vstack([elements[e].x_left, elements[e].x[: tableau.stages]])
        around = whole[max(n - 1, 0) : n + 2]
        for state, at in gaps.items():
            lower = float(transcription.ocp.state_lower[state])
            in_flight = all(branch.factors[one][at] is ActiveFactor.H for one in around)
            excess = lower - float(x[1:, state].min()) - (0.0 if in_flight else PENETRATION)
            if excess > VIOLATION:
                limit = lower + (CLEARANCE if in_flight else -PENETRATION)
                yield Violated(excess, BoundBetween(e, state, -1, limit, of_mode=in_flight))


def _ends_of_contact(
    conditions: ElementConditions, elements: Sequence[Element], branch: Branch, whole: Sequence[int], n_x: int
) -> Iterator[Violated]:
    """Yield the multipliers of contacts that end at once inside a control interval, and their upper bound.

    Not where an impact follows: as another foot lands, a foot may leave the ground with a force.

    Args:
        whole: numbers of the elements with a length.
    """
    for e, following in pairwise(whole):
        impact = ActiveFactor.COMPLEMENT in branch.factors[following] or conditions.jumping(branch.factors[following])
        if impact or elements[e].interval != elements[following].interval:
            continue
        for at, member in enumerate(conditions.members):
            before, after = branch.factors[e][at], branch.factors[following][at]
            if member.invariant_state is None or before is not ActiveFactor.G or after is not ActiveFactor.H:
                continue
            for variable in conditions.variables(member.H):
                value = float(elements[e].z[len(elements[e].slopes) - 1, variable - n_x])
                if value > VIOLATION_OF_MULTIPLIERS:
                    yield Violated(value, BoundBetween(e, variable, 1, 0.0, end_only=True))


def _violated(
    where: tuple[int, int], values: np.ndarray, bounds: tuple[float, float], least: float
) -> Iterator[Violated]:
    """Yield by how much values of a variable of an element violate their bounds, where it is by more than the least."""
    for sign, limit in zip((-1, 1), bounds, strict=True):
        excess = float((sign * (values - limit)).max())
        if np.isfinite(limit) and excess > least:
            yield Violated(excess, BoundBetween(*where, sign, float(limit)))
