"""One control interval of finite elements as CasADi functions of its own variables."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.fesd.cross import cross_pairs, excluded_pairs
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.options import FesdOptions


@dataclass(frozen=True)
class IntervalLayout:
    """Where the variables of an interval sit: u, then per element h and per point (x, z).

    Points are the stages, and the right end if it is not a stage.
    """

    n_x: int
    n_z: int
    n_u: int
    points: int
    elements: int

    @property
    def size(self) -> int:
        """Number of variables of the interval, without the point it starts from."""
        return self.n_u + self.elements * (1 + self.points * (self.n_x + self.n_z))

    def step(self, element: int) -> int:
        """Index of h."""
        return self.n_u + element * (1 + self.points * (self.n_x + self.n_z))

    def point(self, element: int, point: int) -> slice:
        """Indices of (x, z) at a point."""
        first = self.step(element) + 1 + point * (self.n_x + self.n_z)
        return slice(first, first + self.n_x + self.n_z)


@dataclass(frozen=True)
class IntervalFunctions:
    """The interval as functions of w = (point it starts from, own variables) and parameters p."""

    layout: IntervalLayout
    block: ca.Function
    cost_terms: ca.Function
    cost_names: list[str]
    constraint_names: list[str]
    pair_names: list[str]
    one_sided: np.ndarray
    ranks: np.ndarray


def layout_of(ocp: OptimalControlProblem, options: FesdOptions, elements: int) -> IntervalLayout:
    """Return the layout of an interval with this many elements."""
    system = ocp.system
    points = options.tableau.stages + (0 if options.tableau.ends_at_stage else 1)
    return IntervalLayout(system.state.numel(), system.algebraic.numel(), system.control.numel(), points, elements)


def build_interval(ocp: OptimalControlProblem, options: FesdOptions, elements: int) -> IntervalFunctions:
    """Return the equations of one control interval.

    Per element n and stage j, with the collocation polynomial through X_0 (end of the element before) and X_1..X_ns:
    ``E(X_j) sum_r d_jr X_r = h_n f(X_j, u, Z_j)``, ``0 = g(X_j, u, Z_j)``; cross complementarity of the element; and
    once per interval ``sum_n h_n = T/N``. The running cost is ``sum_n h_n sum_j b_j L(X_j, u, Z_j)``.

    A scheme whose last node is not 1 has one more point at the right end, with algebraic variables of its own, so that
    the multipliers there can take part in the cross complementarity of both neighbours.

    Source: Nurkanovic et al., arXiv 2205.05337, eq. (24)-(32).
    """
    system, tableau = ocp.system, options.tableau
    layout = layout_of(ocp, options, elements)
    n_x, n_z = layout.n_x, layout.n_z
    dynamics = ca.Function("dynamics", system.arguments, [system.mass_matrix, system.right_hand_side])
    residual = ca.Function("residual", system.arguments, [system.residual])
    sides = ca.Function("sides", [system.algebraic], [system.multiplier, system.partner])
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
    steps = [own[layout.step(n)] for n in range(elements)]
    integral, chosen = ca.SX.zeros(len(ocp.running_cost), 1), ca.SX(0)
    boundary = left
    for n, h in enumerate(steps):
        points = [own[layout.point(n, j)] for j in range(layout.points)]
        nodes = [boundary[:n_x]] + [point[:n_x] for point in points[: tableau.stages]]
        for j, point in enumerate(points):
            x, z = point[:n_x], point[n_x:]
            where = f"element {n}, " + (f"stage {j + 1}" if j < tableau.stages else "right end")
            if j < tableau.stages:
                E, f = dynamics(x, u, z, p)
                slope = sum((d * node for d, node in zip(tableau.derivative[j], nodes, strict=True)), ca.SX.zeros(n_x))
                equations.append((f"dynamics, {where}", ca.mtimes(E, slope) - h * f))
                integral += h * tableau.b[j] * running(x, u, z, p)
            else:
                end = sum((e * node for e, node in zip(tableau.end, nodes, strict=True)), ca.SX.zeros(n_x))
                equations.append((f"continuity, {where}", end - x))
            equations.append((f"step functions, {where}", residual(x, u, z, p)))
            chosen += selection(z)
        all_sides = [sides(point[n_x:]) for point in [boundary, *points]]
        found = cross_pairs([a for a, _ in all_sides], [b for _, b in all_sides[1:]], options.cross_complementarity)
        pairs += [(f"element {n}, {where}", a, b) for where, a, b in found]
        exclusions += [
            (f"element {n}, {where}", level, share, rank)
            for where, level, share, rank in excluded_pairs(
                system, [boundary, *points], tableau.stages, options.cross_complementarity
            )
        ]
        boundary = points[-1]
    equations.append(("sum of steps", sum(steps[1:], steps[0]) - ocp.duration / ocp.intervals))
    equations.append(("end of interval", interval_end(boundary[:n_x], p)))

    terms = dict(zip(ocp.running_cost, ca.vertsplit(integral), strict=True)) if ocp.running_cost else {}
    if not system.selection.is_zero():
        terms["choice of alpha"] = chosen
    if options.step_equilibration == "mean":
        terms["step equilibration"] = options.equilibration_weight * ca.sumsqr(ca.vertcat(*steps) - mean_step)
    elif options.step_equilibration == "difference":
        terms["step equilibration"] = options.equilibration_weight * ca.sumsqr(ca.diff(ca.vertcat(*steps)))
    w = ca.vertcat(left, own)
    two_sided = sum(a.numel() for _, a, _ in pairs)
    cost = ca.vertcat(*terms.values())
    return IntervalFunctions(
        layout=layout,
        block=ca.Function(
            "interval",
            [w, p],
            [
                ca.sum1(cost),
                ca.vertcat(*[row for _, row in equations]),
                ca.vertcat(ca.SX(0, 1), *[a for _, a, _ in pairs], *[a for _, a, _, _ in exclusions]),
                ca.vertcat(ca.SX(0, 1), *[b for _, _, b in pairs], *[b for _, _, b, _ in exclusions]),
            ],
        ),
        cost_terms=ca.Function("cost_terms", [w, p], [cost]),
        cost_names=list(terms),
        constraint_names=_labels(ocp, equations),
        pair_names=[f"{name}, {where}" for where, a, _ in pairs for name in system.pair_names[: a.numel()]]
        + [where for where, _, _, _ in exclusions],
        one_sided=np.array([False] * two_sided + [True] * len(exclusions), dtype=bool),
        ranks=np.array([0] * two_sided + [rank for _, _, _, rank in exclusions], dtype=int),
    )


def _labels(ocp: OptimalControlProblem, equations: list[tuple[str, ca.SX]]) -> list[str]:
    labels = []
    for where, rows in equations:
        if where.startswith(("dynamics", "continuity")):
            names: list[str] = list(ocp.system.state_names)
        elif where == "end of interval":
            names = list(ocp.interval_end_names)
        else:
            names = [str(i) for i in range(rows.numel())]
        labels += [f"{where}: {name}" for name in names] if len(names) > 1 or names[:1] != ["0"] else [where]
    return labels


def step_bounds(ocp: OptimalControlProblem, options: FesdOptions, elements: int) -> tuple[float, float]:
    """Return the bounds of a step, 0 <= h <= (1 + gamma_h) h_mean; fixed steps for gamma_h = 0."""
    mean = ocp.duration / ocp.intervals / elements
    return (0.0, (1.0 + options.step_freedom) * mean) if options.step_freedom > 0 else (mean, mean)
