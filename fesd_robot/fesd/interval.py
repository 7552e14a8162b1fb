"""One control interval of finite elements as CasADi functions of its own variables."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.fesd.cross import cross_pairs, excluded_pairs
from fesd_robot.fesd.element import SystemFunctions, element_equations, read_elements
from fesd_robot.fesd.equilibration import equilibrate, refuse_exclusions
from fesd_robot.fesd.layout import IntervalLayout, layout_of
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.options import FesdOptions


@dataclass(frozen=True)
class IntervalFunctions:
    """The interval as functions of w = (point it starts from, own variables) and parameters p.

    Attributes:
        layout: order of the own variables.
        block: (w, p) -> (f, g, G, H).
        lower, upper: bounds of g.
        cost_terms: (w, p) -> terms of f.
        auxiliary: w -> values of the auxiliary variables that fit the others.
        cost_names, constraint_names, pair_names: what the rows are.
        one_sided, ranks: of the pairs.
    """

    layout: IntervalLayout
    block: ca.Function
    lower: np.ndarray
    upper: np.ndarray
    cost_terms: ca.Function
    auxiliary: ca.Function
    cost_names: list[str]
    constraint_names: list[str]
    pair_names: list[str]
    one_sided: np.ndarray
    ranks: np.ndarray


def build_interval(ocp: OptimalControlProblem, options: FesdOptions, elements: int) -> IntervalFunctions:
    """Return the equations of one control interval.

    Per element the scheme's equations (`element_equations`) and the pairs of cross complementarity; once per interval
    ``sum_n h_n = T/N`` and the step equilibration. The running cost is ``sum_n h_n sum_j b_j L(X_j, u, Z_j)``.

    A scheme whose last stage is not the right end has one more point there, with algebraic variables of its own, so
    that the multipliers at the boundary can take part in the cross complementarity of both neighbours. Without switch
    detection the steps are fixed and a pair is held at each stage by itself.

    Source: Nurkanovic et al., arXiv 2205.05337, eq. (24)-(36).
    """
    system, tableau = ocp.system, options.tableau
    refuse_exclusions(options, len(system.exclusions))
    layout = layout_of(system, options, elements)
    n_x, n_z = layout.n_x, layout.n_z
    functions = SystemFunctions.of(system)
    selection = ca.Function("selection", [system.algebraic], [system.selection])
    running = ca.Function("running", system.arguments, [ca.vertcat(*ocp.running_cost.values(), ca.SX(0, 1))])
    interval_end = ca.Function("interval_end", [system.state, system.parameters], [ocp.interval_end])

    left, own = ca.SX.sym("left", n_x + n_z), ca.SX.sym("own", layout.size)
    p = ca.SX.sym("p", system.parameters.sparsity())
    u = own[: layout.n_u]
    mean_step = ocp.duration / ocp.intervals / elements

    equations: list[tuple[str, ca.SX]] = []
    pairs: list[tuple[str, ca.SX, ca.SX]] = []
    exclusions: list[tuple[str, ca.SX, ca.SX, int]] = []
    sums: list[tuple[ca.SX, ca.SX]] = []
    integral, chosen = ca.SX.zeros(len(ocp.running_cost), 1), ca.SX(0)
    parts = read_elements(layout, tableau, left, own)
    steps = [part.h for part in parts]
    for n, part in enumerate(parts):
        rows = element_equations(part, functions, options, layout, u, p)
        equations += [(where.replace(", ", f", element {n}, ", 1), row) for where, row in rows]
        for j, (x, z) in enumerate(part.stages):
            integral += part.h * tableau.b[j] * running(x, u, z, p)
        chosen += sum((selection(z) for _, z in part.points[1:]), ca.SX(0))
        sides = [functions.sides(z) for _, z in part.points]
        multipliers, partners = [a for a, _ in sides], [b for _, b in sides[1:]]
        mode = options.cross_complementarity if options.switch_detection else "plain"
        pairs += [(f"element {n}, {where}", a, b) for where, a, b in cross_pairs(multipliers, partners, mode)]
        exclusions += [
            (f"element {n}, {where}", level, share, rank)
            for where, level, share, rank in excluded_pairs(system, part.points, layout.stages, mode)
        ]
        sums.append((sum(multipliers[1:], multipliers[0]), sum(partners[1:], partners[0])))
    end = parts[-1].right
    equations.append(("sum of steps", sum(steps[1:], steps[0]) - ocp.duration / ocp.intervals))
    equations.append(("end of interval", interval_end(end[0], p)))
    equal = equilibrate(options, steps, sums, mean_step, own[layout.auxiliaries])
    equations += equal.equations
    exclusions += [(where, a, b, 0) for where, a, b in equal.one_sided]
    bounded = _stage_bounds(ocp, layout, [x for part in parts for x, _ in part.stages])

    terms = dict(zip(ocp.running_cost, ca.vertsplit(integral), strict=True)) if ocp.running_cost else {}
    if not system.selection.is_zero():
        terms["regularisation of the step functions"] = chosen
    if not equal.cost.is_zero():
        terms["step equilibration"] = equal.cost
    w = ca.vertcat(left, own)
    cost = ca.vertcat(*terms.values(), ca.SX(0, 1))
    G = [a for _, a, _ in pairs] + [a for _, a, _ in equal.pairs] + [a for _, a, _, _ in exclusions]
    H = [b for _, _, b in pairs] + [b for _, _, b in equal.pairs] + [b for _, _, b, _ in exclusions]
    two_sided = sum(a.numel() for _, a, _ in pairs + equal.pairs)
    held = sum(row.numel() for _, row in equations)
    return IntervalFunctions(
        layout=layout,
        block=ca.Function(
            "interval",
            [w, p],
            [
                ca.sum1(cost),
                ca.vertcat(*[row for _, row in equations], bounded.rows),
                ca.vertcat(ca.SX(0, 1), *G),
                ca.vertcat(ca.SX(0, 1), *H),
            ],
        ),
        lower=np.concatenate([np.zeros(held), bounded.lower]),
        upper=np.concatenate([np.zeros(held), bounded.upper]),
        cost_terms=ca.Function("cost_terms", [w, p], [cost]),
        auxiliary=ca.Function("auxiliary", [w], [equal.guess]),
        cost_names=list(terms),
        constraint_names=_labels(ocp, equations) + bounded.names,
        pair_names=[f"{name}, {where}" for where, a, _ in pairs for name in system.pair_names[: a.numel()]]
        + [f"{where}, {i}" for where, a, _ in equal.pairs for i in range(a.numel())]
        + [where for where, _, _, _ in exclusions],
        one_sided=np.array([False] * two_sided + [True] * len(exclusions), dtype=bool),
        ranks=np.array([0] * two_sided + [rank for _, _, _, rank in exclusions], dtype=int),
    )


@dataclass(frozen=True)
class _Bounded:
    rows: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    names: list[str]


def _stage_bounds(ocp: OptimalControlProblem, layout: IntervalLayout, stages: list[ca.SX]) -> _Bounded:
    """Bounds on stage states that are expressions instead of variables."""
    finite = np.isfinite(ocp.state_lower) | np.isfinite(ocp.state_upper)
    if layout.stage_states or not finite.any():
        return _Bounded(ca.SX(0, 1), np.zeros(0), np.zeros(0), [])
    where = np.flatnonzero(finite).tolist()
    names = [
        f"bound of {ocp.system.state_names[i]}, element {k // layout.stages}, stage {k % layout.stages + 1}"
        for k in range(len(stages))
        for i in where
    ]
    rows = ca.vertcat(*[x[where] for x in stages])
    repeated = [np.tile(bound[finite], len(stages)) for bound in (ocp.state_lower, ocp.state_upper)]
    return _Bounded(rows, repeated[0], repeated[1], names)


def _labels(ocp: OptimalControlProblem, equations: list[tuple[str, ca.SX]]) -> list[str]:
    labels = []
    for where, rows in equations:
        if where.startswith(("dynamics", "continuity", "state")):
            names: list[str] = list(ocp.system.state_names)
        elif where == "end of interval":
            names = list(ocp.interval_end_names)
        else:
            names = [str(i) for i in range(rows.numel())]
        labels += [f"{where}: {name}" for name in names] if len(names) > 1 or names[:1] != ["0"] else [where]
    return labels


def step_bounds(ocp: OptimalControlProblem, options: FesdOptions, elements: int) -> tuple[float, float]:
    """Return the bounds of a step, 0 <= h <= (1 + gamma_h) h_mean; fixed steps without switch detection."""
    mean = ocp.duration / ocp.intervals / elements
    free = options.switch_detection and options.gamma > 0
    return (0.0, (1.0 + options.gamma) * mean) if free else (mean, mean)
