"""The equations of one finite element, in the three forms of a Runge-Kutta scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from fesd_robot.complementarity import NOWHERE, Label, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.layout import IntervalLayout
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.running import kept_with_first

DYNAMICS, CONTINUITY = "dynamics", "continuity"
"""Kinds of rows that determine the states of an element; their subjects are names of states."""

REMEMBERED = 16
"""Layouts of intervals whose functions are kept."""

JUMP = "jump"
"""Kind of the rows that determine what happens at the left boundary of an element."""


@dataclass(frozen=True)
class Rows:
    """Rows of one kind that are held at zero.

    Attributes:
        kind: what they are.
        expression: SX (n).
        subjects: what each of them is about, (n); numbers if omitted, nothing for a single row.
        place: where they hold.
    """

    kind: str
    expression: ca.SX
    subjects: Sequence[str] = ()
    place: Place = NOWHERE

    @property
    def labels(self) -> list[Label]:
        """One a row."""
        count = self.expression.numel()
        subjects = self.subjects or ([""] if count == 1 else [str(i) for i in range(count)])
        return [Label(self.kind, subject, place=self.place) for subject in subjects]


@dataclass(frozen=True)
class SystemFunctions:
    """A complementarity system as CasADi functions, so that it can be evaluated at every point of an element."""

    dynamics: ca.Function
    residual: ca.Function
    equations: ca.Function
    sides: ca.Function
    jump: ca.Function
    state_names: Sequence[str]

    @classmethod
    def of(cls, system: ComplementaritySystem) -> SystemFunctions:
        """Return the functions of a system; they are made once."""
        return _functions(system)

    @classmethod
    def _of(cls, system: ComplementaritySystem) -> SystemFunctions:
        jump = system.jump
        jumping = [ca.SX(0, 1), ca.SX(0, 1)] if jump is None else [jump.symbols, jump.residual]
        return cls(
            dynamics=ca.Function("dynamics", system.arguments, [system.mass_matrix, system.right_hand_side]),
            residual=ca.Function("residual", system.arguments, [system.residual]),
            equations=ca.Function("equations", system.arguments, [system.equations]),
            sides=ca.Function("sides", [system.algebraic], [system.G, system.H]),
            jump=ca.Function("jump", [system.state, jumping[0], system.parameters], [jumping[1]]),
            state_names=system.state_names,
        )


@kept_with_first
def _functions(system: ComplementaritySystem) -> SystemFunctions:
    return SystemFunctions._of(system)


@dataclass(frozen=True)
class ElementPoints:
    """One finite element as expressions of the interval's variables.

    Attributes:
        h: step.
        left: (x, z) at the left boundary, after a jump if there may be one.
        stages: (x, z) at the stages.
        right: (x, z) at the right boundary; its z are those of the last stage if it has none of its own.
        slopes: K_j at the stages, (n_x) each; times h in the integral form, whose K_j are the collocation polynomial's.
        own_right: whether the right boundary has algebraic variables of its own.
        before: x at the left boundary before the jump; that of `left` if there is none.
        jump: y of the jump, SX (0) if there is none.
    """

    h: ca.SX
    left: tuple[ca.SX, ca.SX]
    stages: list[tuple[ca.SX, ca.SX]]
    right: tuple[ca.SX, ca.SX]
    slopes: list[ca.SX]
    own_right: bool
    before: ca.SX
    jump: ca.SX

    @property
    def points(self) -> list[tuple[ca.SX, ca.SX]]:
        """The left boundary and every point with algebraic variables of its own."""
        return [self.left, *self.stages] + ([self.right] if self.own_right else [])


def read_elements(layout: IntervalLayout, tableau: Tableau, left: ca.SX, own: ca.SX) -> list[ElementPoints]:
    """Return the elements of an interval from its variables; ``left`` is the (x, z) it starts from."""
    n_x = layout.n_x
    boundary = (left[:n_x], left[n_x:])
    elements = []
    for n in range(layout.elements):
        h, before = own[layout.step(n)], boundary[0]
        if layout.jump_size:
            after = ca.SX(before)
            after[list(layout.jump_states)] = own[layout.jumped(n).tolist()]
            boundary = (after, boundary[1])
        z = [own[layout.algebraic(n, j)] for j in range(layout.stages)]
        if layout.slopes:
            slopes = [own[layout.slope(n, j)] for j in range(layout.stages)]
        if layout.stage_states:
            x = [own[layout.state(n, j)] for j in range(layout.stages)]
        else:
            x = [boundary[0] + h * _combination(tableau.A[j], slopes) for j in range(layout.stages)]
        if not layout.slopes:
            slopes = [_combination(row, [boundary[0], *x]) for row in tableau.derivative]
        end = (own[layout.state(n, layout.stages)], own[layout.algebraic(n, layout.stages)])
        stages, jump = list(zip(x, z, strict=True)), own[layout.jump(n)]
        elements.append(ElementPoints(h, boundary, stages, end, slopes, layout.end_algebraic, before, jump))
        boundary = end
    return elements


def element_equations(
    element: ElementPoints,
    functions: SystemFunctions,
    options: FesdOptions,
    layout: IntervalLayout,
    u: ca.SX,
    p: ca.SX,
    *,
    dynamics: bool = True,
) -> list[Rows]:
    """Return the scheme's equations of an element, to be held at zero, those with E and f only if `dynamics`.

    ``E(X_j) K_j = f(X_j, u, Z_j)``, ``0 = g(X_j, Z_j)``, ``0 = e(X_j, u, Z_j)``; integral form: h K_j is the slope of
    the polynomial through X_0..X_ns and the right end lies on it; lifted form: ``X_j = X_0 + h sum_r a_jr K_r``; both
    other forms: ``X_end = X_0 + h sum_r b_r K_r``.

    Source: Nurkanovic et al., arXiv 2205.05337, eq. (24)-(32).
    """
    tableau, names = options.tableau, functions.state_names
    x_left = element.left[0]
    rows: list[Rows] = []
    if layout.jump_size:
        rows.append(Rows(JUMP, functions.jump(element.before, element.jump, p), place=Place(point=0)))
    for j, (x, z) in enumerate(element.stages):
        where = Place(stage=j + 1)
        if dynamics:
            E, f = functions.dynamics(x, u, z, p)
            scale = element.h if options.form == "integral" else ca.SX(1)
            rows.append(Rows(DYNAMICS, ca.mtimes(E, element.slopes[j]) - scale * f, names, where))
        if options.form == "lifted":
            stage = x_left + element.h * _combination(tableau.A[j], element.slopes)
            rows.append(Rows("state", stage - x, names, where))
        rows += _algebraic_rows(functions, (x, u, z, p), where)
    x, z = element.right
    end = Place(name="right end")
    if layout.end_state:
        if options.form == "integral":
            state = _combination(tableau.end, [x_left, *[stage for stage, _ in element.stages]])
        else:
            state = x_left + element.h * _combination(tableau.b, element.slopes)
        rows.append(Rows(CONTINUITY, state - x, names, end))
    if layout.end_algebraic:
        rows += _algebraic_rows(functions, (x, u, z, p), end)
    return rows


def _algebraic_rows(functions: SystemFunctions, point: tuple[ca.SX, ca.SX, ca.SX, ca.SX], where: Place) -> list[Rows]:
    """Return the rows of the algebraic equations at a point (x, u, z, p)."""
    rows = [Rows("step functions", functions.residual(*point), place=where)]
    if functions.equations.size1_out(0):
        rows.append(Rows("equations", functions.equations(*point), place=where))
    return rows


@kept_with_first
def rate_function(system: ComplementaritySystem) -> ca.Function:
    """Return (x, u, z, p) -> dx/dt = E^-1 f."""
    return ca.Function("rate", system.arguments, [ca.solve(system.mass_matrix, system.right_hand_side)])


@lru_cache(maxsize=REMEMBERED)
def states_function(layout: IntervalLayout, tableau: Tableau) -> ca.Function:
    """Return (x_left, own) -> (states, slopes) of an interval, (n_x, points) and (n_x, stages) of all elements.

    The states are those at the stages, and at the right end where it is not a stage.
    """
    left, own = ca.SX.sym("left", layout.n_x), ca.SX.sym("own", layout.size)
    parts = read_elements(layout, tableau, ca.vertcat(left, ca.SX.zeros(layout.n_z)), own)
    last = tableau.stages - tableau.ends_at_stage  # the last stage may have a state of its own as right end
    states = [x for part in parts for x in [*[x for x, _ in part.stages[:last]], part.right[0]]]
    slopes = [slope for part in parts for slope in part.slopes]
    return ca.Function("states", [left, own], [ca.horzcat(*states), ca.horzcat(*slopes)])


def _combination(weights: np.ndarray, values: Sequence[ca.SX]) -> ca.SX:
    return sum((weight * value for weight, value in zip(weights, values, strict=True)), ca.SX.zeros(values[0].numel()))
