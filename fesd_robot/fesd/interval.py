"""One control interval of finite elements as expressions of its own variables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.cross import cross_pairs, vanishing_pairs
from fesd_robot.fesd.element import ElementPoints, Rows, SystemFunctions, element_equations, read_elements
from fesd_robot.fesd.equilibration import Equilibration, equilibrate, refuse_vanishing
from fesd_robot.fesd.layout import IntervalLayout, layout_of
from fesd_robot.fesd.ocp import OcpEquations
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.mpcc import BlockEquations
from fesd_robot.running import check_time, kept_with_first

EQUILIBRATION = "step equilibration"
"""Name of a cost term that belongs to the method."""


@dataclass(frozen=True, eq=False)
class Interval:
    """A control interval as expressions of w = (point it starts from, own variables) and parameters p.

    Attributes:
        layout: order of the own variables.
        variables, parameters: w and p, SX symbols.
        cost: name -> term of the cost, SX scalar.
        own_cost: what of their sum the interval's block has.
        while_relaxed: what is added to their sum while the velocity level is relaxed by `sigma`, SX scalar.
        if_exploited: what is added instead where a relaxed cost is negative all the same.
        sigma: SX symbol.
        rows: SX (n_g); `lower`, `upper`, `labels`: their bounds and what they are.
        complementarities: the conditions.
        auxiliary: w -> values of the auxiliary variables that fit the others.
    """

    layout: IntervalLayout
    variables: ca.SX
    parameters: ca.SX
    cost: dict[str, ca.SX]
    own_cost: ca.SX
    while_relaxed: ca.SX
    if_exploited: ca.SX
    sigma: ca.SX
    rows: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    labels: list[Label]
    complementarities: list[Complementarity]
    auxiliary: ca.Function

    @cached_property
    def cost_terms(self) -> ca.Function:
        """(w, p) -> terms of the cost, in the order of `cost`."""
        return ca.Function(
            "cost_terms", [self.variables, self.parameters], [ca.vertcat(*self.cost.values(), ca.SX(0, 1))]
        )

    @cached_property
    def equations(self) -> BlockEquations:
        """Those of its block."""
        return BlockEquations(
            name="interval",
            variables=self.variables,
            parameters=self.parameters,
            cost=self.own_cost,
            rows=self.rows,
            lower=self.lower,
            upper=self.upper,
            constraints=self.labels,
            complementarities=self.complementarities,
            while_relaxed=self.while_relaxed,
            if_exploited=self.if_exploited,
            sigma=self.sigma,
        )


@kept_with_first
def build_interval(ocp: OcpEquations, options: FesdOptions, elements: int, *, within: bool = True) -> Interval:
    """Return the equations of one control interval; they are made once.

    Per element the scheme's equations (`element_equations`) and the pairs of cross complementarity; once per interval
    ``sum_n h_n = T/N`` and the step equilibration. The running cost is ``sum_n h_n sum_j b_j L(X_j, u, Z_j)``.

    A scheme whose last stage is not the right end has one more point there, with algebraic variables of its own, so
    that G at the boundary can take part in the cross complementarity of both neighbours. Without switch detection the
    steps are fixed and a pair is held at each stage by itself.

    Args:
        ocp: of the problem; its constraints beyond single elements are not part of an interval.
        options: scheme, form, cross complementarity and step equilibration.
        elements: number of elements.
        within: whether it has dynamics, running cost and conditions of its elements; else these have blocks of their
            own (`fesd.element_blocks`).

    Raises:
        ModelError: a step equilibration that would overlook vanishing constraints.
        OutOfTime: the time limit comes meanwhile.

    Source: Nurkanovic et al., arXiv 2205.05337, eq. (24)-(36).
    """
    system = ocp.system
    refuse_vanishing(options, system)
    layout = layout_of(system, options, elements)
    functions = SystemFunctions.of(system)
    left, own = ca.SX.sym("left", layout.n_x + layout.n_z), ca.SX.sym("own", layout.size)
    p = ca.SX.sym("p", system.parameters.sparsity())
    parts = read_elements(layout, options.tableau, left, own)
    steps = [part.h for part in parts]

    rows: list[Rows] = []
    pairs: list[Complementarity] = []
    vanishing: list[Complementarity] = []
    sums: list[tuple[ca.SX, ca.SX]] = []
    boundary: list[ca.SX] = []
    for n, part in enumerate(parts):
        check_time()
        here = Place(element=n)
        equations = element_equations(part, functions, options, layout, own[: layout.n_u], p, dynamics=within)
        rows += [replace(one, place=one.place.within(here)) for one in equations]
        own_pairs, own_vanishing = element_conditions(system, options, part, functions, layout.stages)
        pairs += _at(here, own_pairs if within else [])
        vanishing += _at(here, own_vanishing if within else [])
        sides = [functions.sides(z) for _, z in part.points]
        sums.append((sum((G for G, _ in sides[1:]), sides[0][0]), sum((H for _, H in sides[2:]), sides[1][1])))
        boundary.append(sides[0][0])
    interval_end = ca.Function("interval_end", [system.state, system.parameters], [ocp.interval_end])
    if not ocp.moving:
        rows.append(Rows("sum of steps", sum(steps[1:], steps[0]) - ocp.duration / ocp.intervals))
    rows.append(Rows("end of interval", interval_end(parts[-1].right[0], p), ocp.interval_end_names))
    mean_step = ocp.duration / ocp.intervals / elements
    sums_before = _with_jumps(system, sums, boundary)
    equal = equilibrate(options, steps, (sums_before, sums), mean_step, own[layout.auxiliaries])
    rows += equal.equations
    bounded = _stage_bounds(ocp, layout, [x for part in parts for x, _ in part.stages])
    w, held = ca.vertcat(left, own), sum(one.expression.numel() for one in rows)
    running, regularised = _cost_terms(ocp, options, parts, own[: layout.n_u], p)
    costs, sigma = {**running, **regularised, **_equilibration_cost(equal)}, ca.SX.sym("sigma")
    added = partial(_added, ocp, options, parts if within else [], own[: layout.n_u], p, sigma)
    return Interval(
        layout=layout,
        variables=w,
        parameters=p,
        cost=costs,
        own_cost=sum((term for name, term in costs.items() if within or name not in running), ca.SX(0)),
        while_relaxed=added("always"),
        if_exploited=added("if_exploited"),
        sigma=sigma,
        rows=ca.vertcat(*[one.expression for one in rows], bounded.rows),
        lower=np.concatenate([np.zeros(held), bounded.lower]),
        upper=np.concatenate([np.zeros(held), bounded.upper]),
        labels=[label for one in rows for label in one.labels] + bounded.labels,
        complementarities=[
            *pairs,
            *(one for one in equal.complementarities if not one.vanishing),
            *vanishing,
            *(one for one in equal.complementarities if one.vanishing),
        ],
        auxiliary=ca.Function("auxiliary", [w], [equal.guess]),
    )


def element_conditions(
    system: ComplementaritySystem, options: FesdOptions, part: ElementPoints, functions: SystemFunctions, stages: int
) -> tuple[list[Complementarity], list[Complementarity]]:
    """Return the pairs of an element, and its vanishing constraints.

    Args:
        system: with these conditions; functions: of it.
        options: cross complementarity.
        part: the element, of a scheme with `stages` stages.
    """
    mode = options.cross_complementarity if options.switch_detection else "plain"
    sides = [functions.sides(z) for _, z in part.points]
    G, H = [G for G, _ in sides], [H for _, H in sides]
    jump = jump_conditions(system, part)
    return (
        [*cross_pairs(system.pairs, G, H, mode), *(one for one in jump if not one.vanishing)],
        [*vanishing_pairs(system, part.points, stages, mode), *(one for one in jump if one.vanishing)],
    )


def jump_conditions(system: ComplementaritySystem, part: ElementPoints) -> list[Complementarity]:
    """Return the conditions of the jump at the left boundary of an element."""
    if system.jump is None:
        return []
    conditions = system.jump.complementarities(system.pairs)
    factors = [ca.vertcat(*[getattr(one, side) for one in conditions]) for side in ("G", "H")]
    values = ca.Function("jump", [system.state, system.jump.symbols, system.algebraic], factors)
    G, H = values(part.before, part.jump, part.left[1])
    after, own = values(part.left[0], part.jump, part.left[1])[0], len(conditions) - len(system.jump.conditions)
    place = Place(point=0)
    return [
        replace(one, label=one.label.at(place), G=(G if i < own else after)[i], H=H[i])
        for i, one in enumerate(conditions)
    ]


def _with_jumps(
    system: ComplementaritySystem, sums: Sequence[tuple[ca.SX, ca.SX]], boundary: Sequence[ca.SX]
) -> list[tuple[ca.SX, ca.SX]]:
    """Return the sums of every element but the last, as those of the element before a boundary.

    Where an impulse may act, G at the boundary takes the place of its sum, of which it is a part: zero also where an
    elastic impact lies between two flights.

    Source: Nurkanovic et al., arXiv 2305.17003, the step equilibration.
    """
    before = []
    for (G, H), at_end in zip(sums, boundary[1:], strict=False):
        if system.impulses:
            G = ca.SX(G)
            for impulse in system.impulses:
                G[impulse.pair] = at_end[impulse.pair]
        before.append((G, H))
    return before


def _at(place: Place, conditions: list[Complementarity]) -> list[Complementarity]:
    return [replace(one, label=one.label.at(place)) for one in conditions]


def _cost_terms(
    ocp: OcpEquations, options: FesdOptions, parts: Sequence[ElementPoints], u: ca.SX, p: ca.SX
) -> tuple[dict[str, ca.SX], dict[str, ca.SX]]:
    """Return the running costs, integrated, and the regularisation, if there is one."""
    system = ocp.system
    running = running_costs(ocp)
    integral = sum(
        (h * running(x, u, z, p) for h, x, z in _quadrature(options, parts)), ca.SX.zeros(len(ocp.running_cost), 1)
    )
    regularisation = ca.Function("regularisation", [system.algebraic], [system.regularisation])
    regularised = sum((regularisation(z) for part in parts for _, z in part.points[1:]), ca.SX(0))
    terms = dict(zip(ocp.running_cost, ca.vertsplit(integral), strict=True)) if ocp.running_cost else {}
    return terms, {} if system.regularisation.is_zero() else {system.regularisation_name: regularised}


def running_costs(ocp: OcpEquations) -> ca.Function:
    """Return (x, u, z, p) -> all running costs, in the problem's order."""
    costs = ca.vertcat(*ocp.running_cost.values(), ca.SX(0, 1))
    return ca.Function("running", ocp.system.arguments, [costs])


def relaxed_difference(ocp: OcpEquations, when: Literal["always", "if_exploited"]) -> ca.Function | None:
    """Return (x, u, z, p, sigma) -> by how much relaxed costs are larger than the costs; None if there are none."""
    if not ocp.relaxed_costs:
        return None
    sigma = ca.SX.sym("sigma")
    differences = [getattr(one, when)(sigma) - ocp.running_cost[name] for name, one in ocp.relaxed_costs.items()]
    return ca.Function("difference", [*ocp.system.arguments, sigma], [sum(differences[1:], differences[0])])


def _added(
    ocp: OcpEquations,
    options: FesdOptions,
    parts: Sequence[ElementPoints],
    u: ca.SX,
    p: ca.SX,
    sigma: ca.SX,
    when: Literal["always", "if_exploited"],
) -> ca.SX:
    """Return by how much relaxed costs are larger than the costs, integrated."""
    difference = relaxed_difference(ocp, when)
    if difference is None:
        return ca.SX(0)
    return sum((h * difference(x, u, z, p, sigma) for h, x, z in _quadrature(options, parts)), ca.SX(0))


def _quadrature(options: FesdOptions, parts: Sequence[ElementPoints]) -> Iterator[tuple[ca.SX, ca.SX, ca.SX]]:
    """Yield the weight of every stage in an integral over numerical time, and its x and z."""
    for part in parts:
        for weight, (x, z) in zip(options.tableau.b, part.stages, strict=True):
            yield part.h * weight, x, z


def _equilibration_cost(equal: Equilibration) -> dict[str, ca.SX]:
    return {} if equal.cost.is_zero() else {EQUILIBRATION: equal.cost}


@dataclass(frozen=True)
class _Bounded:
    rows: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    labels: list[Label]


def _stage_bounds(ocp: OcpEquations, layout: IntervalLayout, stages: list[ca.SX]) -> _Bounded:
    """Return the bounds on stage states that are expressions instead of variables."""
    finite = np.isfinite(ocp.state_lower) | np.isfinite(ocp.state_upper)
    if layout.stage_states or not finite.any():
        return _Bounded(ca.SX(0, 1), np.zeros(0), np.zeros(0), [])
    where = np.flatnonzero(finite).tolist()
    labels = [
        Label(
            "bound",
            ocp.system.state_names[i],
            place=Place(element=k // layout.stages, stage=k % layout.stages + 1),
        )
        for k in range(len(stages))
        for i in where
    ]
    rows = ca.vertcat(*[x[where] for x in stages])
    repeated = [np.tile(bound[finite], len(stages)) for bound in (ocp.state_lower, ocp.state_upper)]
    return _Bounded(rows, repeated[0], repeated[1], labels)


def step_bounds(ocp: OcpEquations, options: FesdOptions, elements: int) -> tuple[float, float]:
    """Return the bounds of a step, 0 <= h <= (1 + gamma_h) h_mean; fixed steps without switch detection.

    On a moving grid they are positive only, for the clock holds the lengths.
    """
    if ocp.moving:
        return 0.0, np.inf
    mean = ocp.duration / ocp.intervals / elements
    free = options.switch_detection and options.gamma > 0
    return (0.0, (1.0 + options.gamma) * mean) if free else (mean, mean)
