"""The whole optimal control problem as one MPCC, and the way back from its solution to a trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Label, LateLabels, Place
from fesd_robot.dcs import ComplementaritySystem, Jump
from fesd_robot.errors import DimensionError, ModelError
from fesd_robot.fesd.added_rows import NO_ROWS, AddedRows
from fesd_robot.fesd.constraints import TrajectoryConstraint, constraint_block, constraint_costs
from fesd_robot.fesd.element import Rows, rate_function, states_function
from fesd_robot.fesd.element_blocks import conditions_block, is_large, stages_block
from fesd_robot.fesd.grid import ControlGrid
from fesd_robot.fesd.grid_rows import grid_blocks
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.interval import Interval, build_interval, step_bounds
from fesd_robot.fesd.layout import IntervalLayout, layout_of
from fesd_robot.fesd.ocp import OcpEquations, OptimalControlProblem
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.trajectory import Element, interval_elements
from fesd_robot.mpcc import Block, BlockEquations, Mpcc
from fesd_robot.running import kept_with_first

REMEMBERED = 8
"""Problems that are kept for when they are needed again."""


@checked
@dataclass(frozen=True)
class Transcription:
    """An optimal control problem discretised by FESD.

    The variables are ordered in time: (x, z) at the start, then interval by interval.

    Attributes:
        ocp: the problem.
        options: the discretisation; the form is chosen.
        added: rows that refinement adds.
        given_grid: the control intervals of a problem whose grid moves; None where it is uniform.
    """

    ocp: OptimalControlProblem
    options: FesdOptions
    added: AddedRows = NO_ROWS
    given_grid: ControlGrid | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", self.options.with_form("integral"))
        if (self.given_grid is None) != (self.ocp.clock is None):
            raise ModelError("a problem with a clock needs a moving grid, and one without has none")

    @cached_property
    def grid(self) -> ControlGrid:
        """The control intervals."""
        return self.given_grid or ControlGrid.uniform(self.ocp.duration, self.ocp.intervals)

    @cached_property
    def parameters(self) -> np.ndarray:
        """Values of the system's parameters on each interval, (n_p, N)."""
        if self.ocp.clock is None:
            return self.ocp.parameters
        nodes = self.grid.nodes
        return np.array([self.ocp.clock.parameters(float(at)) for at in (nodes[:-1] + nodes[1:]) / 2]).T

    @cached_property
    def control_guess(self) -> np.ndarray:
        """Start of the controls, (n_u, N)."""
        guess = self.ocp.control_guess
        return guess if self.given_grid is None else np.tile(guess[:, :1], self.grid.intervals)

    @cached_property
    def constraints(self) -> list[TrajectoryConstraint]:
        """The constraints of the problem, in the intervals of the grid."""
        return [constraint.on(self.grid) for constraint in self.ocp.constraints]

    @cached_property
    def elements(self) -> tuple[int, ...]:
        """Finite elements of every interval."""
        count = self.options.elements
        elements = (count,) * self.grid.intervals if isinstance(count, int) else tuple(count)
        if len(elements) != self.grid.intervals or min(elements) < 1:
            raise DimensionError(f"elements must be one positive number per interval, found {elements}")
        return elements

    @cached_property
    def intervals(self) -> dict[int, Interval]:
        """The equations of an interval by number of elements."""
        return {
            count: build_interval(
                self.ocp.equations, replace(self.options, elements=count), count, within=not self.element_blocks
            )
            for count in sorted(set(self.elements))
        }

    @cached_property
    def element_blocks(self) -> bool:
        """Whether elements, and stages, have blocks of their own, which follow those of the intervals."""
        return self.options.form == "integral" and is_large(self.ocp.system, self.options.tableau.stages, self.elements)

    @cached_property
    def layouts(self) -> dict[int, IntervalLayout]:
        """Where the variables of an interval sit, by number of elements."""
        return {count: layout_of(self.ocp.system, self.options, count) for count in set(self.elements)}

    @cached_property
    def indices(self) -> TrajectoryIndices:
        """Where the variables of the trajectory sit among those of the MPCC."""
        return TrajectoryIndices(self.layouts, self.elements)

    @cached_property
    def problem(self) -> Mpcc:
        """The MPCC; equal transcriptions share one."""
        return _shared_problem(self)

    def _problem(self) -> Mpcc:
        lower, upper, start = self.bounds_and_start()
        blocks = [self._initial_block()]
        for count, interval in self.intervals.items():
            where = [k for k, c in enumerate(self.elements) if c == count]
            index = np.array([np.concatenate([self.indices.point(k), self.indices.own(k)]) for k in where]).T
            places = [Place(interval=k) for k in where]
            blocks.append(Block(interval.equations, places, index, self.parameters[:, where]))
        if self.element_blocks:
            blocks.append(conditions_block(self.ocp.system, self.options, self.indices))
            blocks.append(stages_block(self.ocp.equations, self.options.tableau, self.indices, self.parameters))
        blocks += [self._terminal_block(), *(block for block in self._constraint_blocks if block.copies)]
        blocks += self.added.blocks(self.indices, self.options.tableau, self.constraints)
        if self.ocp.clock is not None:
            blocks += grid_blocks(self.grid, self.indices, self.ocp)
        variables = LateLabels(len(start), self._variable_labels)
        return Mpcc(lower=lower, upper=upper, start=start, blocks=blocks, variables=variables)

    def _variable_labels(self) -> list[Label]:
        """Return the label of every variable, in the order of the trajectory."""
        system, start = self.ocp.system, Place(name="the start")
        labels = [Label("state", name, place=start) for name in system.state_names]
        labels += [Label("algebraic variable", name, place=start) for name in system.algebraic_names]
        own = {count: layout.labels(system) for count, layout in self.layouts.items()}
        return labels + [label.at(Place(interval=k)) for k, count in enumerate(self.elements) for label in own[count]]

    @cached_property
    def _constraint_blocks(self) -> list[Block]:
        """The block of every path, boundary and coupling constraint."""
        return [constraint_block(constraint, self.indices) for constraint in self._held]

    @property
    def _held(self) -> list[TrajectoryConstraint]:
        """The constraints that hold without being asked for."""
        return [constraint for constraint in self.constraints if not constraint.on_request]

    def _initial_block(self) -> Block:
        """Return the block of step functions at x(0), which give G at the very first boundary."""
        index = np.concatenate([self.indices.point(0), self.indices.control(0)]).reshape(-1, 1)
        return Block(_initial_equations(self.ocp.system), [Place(name="the start")], index, self.parameters[:, :1])

    def _terminal_block(self) -> Block:
        index = self.indices.state(self.grid.intervals).reshape(-1, 1)
        return Block(_terminal_equations(self.ocp.equations), [Place(name="the end")], index, self.parameters[:, -1:])

    def bounds_and_start(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return lower and upper bounds and the initial point of the MPCC's variables."""
        ocp, system = self.ocp, self.ocp.system
        lower = [ocp.initial_lower, system.algebraic_lower]
        upper = [ocp.initial_upper, system.algebraic_upper]
        x0 = np.clip(ocp.state_guess(0.0), ocp.initial_lower, ocp.initial_upper)
        left = np.concatenate([x0, system.guess(x0, self.control_guess[:, 0], self.parameters[:, 0])])
        start = [left]
        for k, count in enumerate(self.elements):
            low_k, high_k, start_k = self._interval_start(k, count, left)
            lower.append(low_k)
            upper.append(high_k)
            start.append(start_k)
            left = start_k[self.layouts[count].end(count - 1)]
        low, high, w = np.concatenate(lower), np.concatenate(upper), np.concatenate(start)
        end = self.indices.state(self.grid.intervals)
        low[end] = np.maximum(low[end], ocp.terminal_lower)
        high[end] = np.minimum(high[end], ocp.terminal_upper)
        return low, high, np.clip(w, low, high)

    def _interval_start(self, k: int, count: int, left: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return bounds and initial values of an interval's own variables; ``left`` is the point before it."""
        ocp, system, layout, tableau = self.ocp, self.ocp.system, self.layouts[count], self.options.tableau
        begin, length = float(self.grid.nodes[k]), self.grid.lengths[k]
        step = length / count
        u, p, state_upper = self.control_guess[:, k], self.parameters[:, k], ocp.state_upper
        if k == self.grid.intervals - 1:
            state_upper = np.minimum(state_upper, ocp.last_state_upper)
        low, high, start = np.full(layout.size, -np.inf), np.full(layout.size, np.inf), np.zeros(layout.size)
        low[: layout.n_u], high[: layout.n_u], start[: layout.n_u] = ocp.control_lower, ocp.control_upper, u

        def put_jump(jump: Jump, n: int) -> None:
            states, where = list(jump.states), layout.jump(n)
            infinite = np.full(len(jump.algebraic_lower), np.inf)
            low[where] = np.concatenate([ocp.state_lower[states], jump.algebraic_lower])
            high[where] = np.concatenate([state_upper[states], infinite])
            start[layout.jumped(n)] = ocp.state_guess(begin + n * step)[states]

        for n in range(count):
            at = layout.step(n)
            low[at], high[at] = step_bounds(ocp.equations, self.options, count)
            start[at] = step
            if system.jump is not None:
                put_jump(system.jump, n)
            for j in range(layout.stages + layout.own_end):
                fraction = 1.0 if j == layout.stages else tableau.c[j]
                x = ocp.state_guess(begin + (n + fraction) * step)
                z = system.guess(x, u, p)
                if layout.stage_states or j == layout.stages:
                    at_x = layout.state(n, j)
                    low[at_x], high[at_x], start[at_x] = ocp.state_lower, state_upper, x
                at_z = layout.algebraic(n, j)
                low[at_z], high[at_z] = system.algebraic_lower, system.algebraic_upper
                if j < layout.stages or layout.end_algebraic:
                    start[at_z] = z
                if layout.slopes and j < layout.stages:
                    start[layout.slope(n, j)] = np.asarray(self._rate(x, u, z, p)).ravel()
        if layout.auxiliary:
            low[layout.auxiliaries] = 0.0
            guess = self.intervals[count].auxiliary(np.concatenate([left, start]))
            start[layout.auxiliaries] = np.asarray(guess).ravel()
        return low, high, start

    @cached_property
    def _rate(self) -> ca.Function:
        return rate_function(self.ocp.system)

    def unpack(self, w: np.ndarray) -> list[Element]:
        """Return the finite elements in time order from a point of the MPCC."""
        elements: list[Element] = []
        time = 0.0
        for k, count in enumerate(self.elements):
            own, left = self.interval_variables(w, k)
            elements += interval_elements(self.layouts[count], self._states[count], own, left, interval=k, start=time)
            time = elements[-1].end
        return elements

    def pack(self, elements: Sequence[Element]) -> np.ndarray:
        """Return the point of the MPCC that these elements are, the inverse of `unpack`.

        Args:
            elements: as many as the problem has, in time order, of the same scheme; their intervals need not agree.

        Raises:
            DimensionError: another number of elements, or elements with another number of points.
        """
        if len(elements) != sum(self.elements):
            raise DimensionError(f"{len(elements)} elements for a problem with {sum(self.elements)}")
        first = elements[0]
        w = self.problem.start.copy()
        w[self.indices.point(0)] = np.concatenate([first.x_before, first.z_left])
        remaining = iter(elements)
        for k, count in enumerate(self.elements):
            own, _ = self.interval_variables(w, k)  # a view
            for n in range(count):
                self.pack_element(own, n, next(remaining), self.layouts[count])
            if self.layouts[count].auxiliary:
                guess = self.intervals[count].auxiliary(np.concatenate([w[self.indices.point(k)], own]))
                own[self.layouts[count].auxiliaries] = np.asarray(guess).ravel()
        return w

    def pack_element(self, own: np.ndarray, n: int, element: Element, layout: IntervalLayout) -> None:
        """Write an element into the own variables of an interval, as its n-th.

        Args:
            own: the variables, (layout.size); changed.
            n: number of the element in the interval.
            element: with as many points as the layout's elements have.
            layout: order of the variables.

        Raises:
            DimensionError: an element with another number of stages.
        """
        own[: layout.n_u], own[layout.step(n)] = element.u, element.step
        own[layout.jump(n)] = element.jump
        own[layout.jumped(n)] = element.x_left[list(layout.jump_states)]
        if len(element.slopes) != layout.stages:
            raise DimensionError(f"an element with {len(element.slopes)} stages for a scheme with {layout.stages}")
        for j in range(layout.stages):
            own[layout.algebraic(n, j)] = element.z[j]
            own[layout.slope(n, j)] = element.slopes[j] if layout.slopes else []
            own[layout.state(n, j)] = element.x[j] if layout.stage_states else []
        if layout.own_end:
            own[layout.end(n)] = np.concatenate([element.x[-1], element.z[-1]])

    def interval_variables(self, w: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the own variables of interval k and the (x, z) it starts from."""
        size = self.layouts[self.elements[k]].size
        return w[self.indices.offsets[k] : self.indices.offsets[k] + size], w[self.indices.point(k)]

    @cached_property
    def _states(self) -> dict[int, ca.Function]:
        return {count: states_function(layout, self.options.tableau) for count, layout in self.layouts.items()}

    def controls(self, w: np.ndarray) -> np.ndarray:
        """Return the controls at a point of the MPCC, (n_u, N)."""
        return w[self.indices.offsets[None, :] + np.arange(self.ocp.system.control.numel())[:, None]]

    def cost_terms(self, w: np.ndarray) -> dict[str, float]:
        """Return every term of the objective at w by name."""
        totals: dict[str, float] = {}
        for block, interval in zip(self.problem.blocks[1:], self.intervals.values(), strict=False):
            values = interval.cost_terms.map(block.copies)(w[block.index], block.values)
            for name, row in zip(interval.cost, np.asarray(ca.DM(values).full()), strict=True):
                totals[name] = totals.get(name, 0.0) + float(row.sum())
        regularisation = self.ocp.system.regularisation_name
        if regularisation in totals:
            totals[regularisation] += float(self.problem.blocks[0].evaluate(w)[0].sum())
        values = _terminal_terms(self.ocp.equations).call(
            [w[self.indices.state(self.grid.intervals)], self.parameters[:, -1]]
        )
        for name, value in zip(self.ocp.terminal_cost, values, strict=True):
            totals[name] = totals.get(name, 0.0) + float(value)
        for constraint, block in zip(self._held, self._constraint_blocks, strict=True):
            for name, cost in constraint_costs(constraint, block, w).items():
                totals[name] = totals.get(name, 0.0) + cost
        return totals


@lru_cache(maxsize=REMEMBERED)
def _shared_problem(transcription: Transcription) -> Mpcc:
    return transcription._problem()


@kept_with_first
def _initial_equations(system: ComplementaritySystem) -> BlockEquations:
    return BlockEquations(
        name="initial",
        variables=ca.vertcat(system.state, system.algebraic, system.control),
        parameters=system.parameters,
        cost=system.regularisation,
        rows=system.residual,
        lower=np.zeros(system.residual.numel()),
        upper=np.zeros(system.residual.numel()),
        constraints=Rows("step functions", system.residual).labels,
        complementarities=system.pairs,
    )


@kept_with_first
def _terminal_equations(ocp: OcpEquations) -> BlockEquations:
    return BlockEquations(
        name="end",
        variables=ocp.system.state,
        parameters=ocp.system.parameters,
        cost=sum(ocp.terminal_cost.values(), ca.SX(0)),
        rows=ca.SX(0, 1),
        lower=np.zeros(0),
        upper=np.zeros(0),
        constraints=[],
    )


@kept_with_first
def _terminal_terms(ocp: OcpEquations) -> ca.Function:
    """Return (x, p) -> terms of the terminal cost."""
    return ca.Function("terminal", [ocp.system.state, ocp.system.parameters], list(ocp.terminal_cost.values()))
