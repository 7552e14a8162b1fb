"""The whole optimal control problem as one MPCC, and the way back from its solution to a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.errors import DimensionError
from fesd_robot.fesd.interval import IntervalFunctions, IntervalLayout, build_interval, layout_of, step_bounds
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.mpcc import Block, Mpcc


@dataclass(frozen=True)
class Element:
    """A solved finite element.

    Attributes:
        interval: control interval it belongs to.
        start, step: numerical time of its left end and its length.
        x_left, z_left: state and algebraic variables at the left boundary (continuous from the element before).
        x, z: at the points (stages, and the right end if it is not a stage), shapes (points, n_x), (points, n_z).
        u: control, (n_u).
    """

    interval: int
    start: float
    step: float
    x_left: np.ndarray
    z_left: np.ndarray
    x: np.ndarray
    z: np.ndarray
    u: np.ndarray


@dataclass(frozen=True)
class Transcription:
    """An optimal control problem discretised by FESD.

    The variables are ordered in time: (x, z) at the start, then interval by interval.
    """

    ocp: OptimalControlProblem
    options: FesdOptions

    @cached_property
    def elements(self) -> tuple[int, ...]:
        """Finite elements of every interval."""
        count = self.options.elements
        elements = (count,) * self.ocp.intervals if isinstance(count, int) else tuple(count)
        if len(elements) != self.ocp.intervals or min(elements) < 1:
            raise DimensionError(f"elements must be one positive number per interval, found {elements}")
        return elements

    @cached_property
    def intervals(self) -> dict[int, IntervalFunctions]:
        """The interval functions by number of elements."""
        return {count: build_interval(self.ocp, self.options, count) for count in sorted(set(self.elements))}

    @cached_property
    def layouts(self) -> dict[int, IntervalLayout]:
        """Where the variables of an interval sit, by number of elements."""
        return {count: layout_of(self.ocp, self.options, count) for count in set(self.elements)}

    @cached_property
    def offsets(self) -> np.ndarray:
        """Index of the first variable of every interval."""
        sizes = [self.layouts[count].size for count in self.elements]
        return self._point_size + np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)

    @property
    def _point_size(self) -> int:
        return int(self.ocp.system.state.numel() + self.ocp.system.algebraic.numel())

    def _left(self, k: int) -> np.ndarray:
        """Indices of the (x, z) that interval k starts from; k = N gives the end of the horizon."""
        if k == 0:
            return np.arange(self._point_size)
        layout = self.layouts[self.elements[k - 1]]
        point = layout.point(layout.elements - 1, layout.points - 1)
        return self.offsets[k - 1] + np.arange(point.start, point.stop)

    @cached_property
    def problem(self) -> Mpcc:
        """The MPCC."""
        lower, upper, start = self.bounds_and_start()
        blocks = [self._initial_block()]
        for count, functions in self.intervals.items():
            where = [k for k, c in enumerate(self.elements) if c == count]
            own = np.arange(functions.layout.size)
            n_g = functions.block.size1_out(1)
            blocks.append(
                Block(
                    copy_names=[f"interval {k}" for k in where],
                    function=functions.block,
                    index=np.array([np.concatenate([self._left(k), self.offsets[k] + own]) for k in where]).T,
                    parameters=self.ocp.parameters[:, where],
                    lower=np.zeros(n_g),
                    upper=np.zeros(n_g),
                    constraint_names=functions.constraint_names,
                    pair_names=functions.pair_names,
                    one_sided=functions.one_sided,
                    ranks=functions.ranks,
                )
            )
        blocks.append(self._terminal_block())
        return Mpcc(lower=lower, upper=upper, start=start, blocks=blocks)

    def _initial_block(self) -> Block:
        """The step functions at x(0) give the multipliers at the very first boundary."""
        system = self.ocp.system
        own = ca.vertcat(system.state, system.algebraic, system.control)
        function = ca.Function(
            "initial", [own, system.parameters], [system.selection, system.residual, system.multiplier, system.partner]
        )
        n_g = function.size1_out(1)
        index = np.concatenate([self._left(0), self.offsets[0] + np.arange(system.control.numel())])
        return Block(
            copy_names=["the start"],
            function=function,
            index=index.reshape(-1, 1),
            parameters=self.ocp.parameters[:, :1],
            lower=np.zeros(n_g),
            upper=np.zeros(n_g),
            constraint_names=[f"step functions: {i}" for i in range(n_g)],
            pair_names=list(system.pair_names),
        )

    def _terminal_block(self) -> Block:
        system = self.ocp.system
        cost = sum(self.ocp.terminal_cost.values(), ca.SX(0))
        empty = ca.SX(0, 1)
        return Block(
            copy_names=["the end"],
            function=ca.Function("end", [system.state, empty], [cost, empty, empty, empty]),
            index=self._left(self.ocp.intervals)[: system.state.numel()].reshape(-1, 1),
            parameters=np.zeros((0, 1)),
            lower=np.zeros(0),
            upper=np.zeros(0),
            constraint_names=[],
            pair_names=[],
        )

    def bounds_and_start(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return lower and upper bounds and the initial point of the MPCC's variables."""
        ocp, system = self.ocp, self.ocp.system
        point_lower = np.concatenate([ocp.state_lower, system.algebraic_lower])
        point_upper = np.concatenate([ocp.state_upper, system.algebraic_upper])
        lower = [ocp.initial_lower, system.algebraic_lower]
        upper = [ocp.initial_upper, system.algebraic_upper]
        x0 = np.clip(ocp.state_guess(0.0), ocp.initial_lower, ocp.initial_upper)
        start = [x0, system.guess(x0, ocp.control_guess[:, 0], ocp.parameters[:, 0])]
        interval_length = ocp.duration / ocp.intervals
        fractions = list(self.options.tableau.c) + ([] if self.options.tableau.ends_at_stage else [1.0])
        for k, count in enumerate(self.elements):
            step = interval_length / count
            step_lower, step_upper = step_bounds(ocp, self.options, count)
            u, p = ocp.control_guess[:, k], ocp.parameters[:, k]
            lower.append(ocp.control_lower)
            upper.append(ocp.control_upper)
            start.append(u)
            for n in range(count):
                lower += [np.array([step_lower])] + [point_lower] * len(fractions)
                upper += [np.array([step_upper])] + [point_upper] * len(fractions)
                start.append(np.array([step]))
                for fraction in fractions:
                    x = ocp.state_guess(k * interval_length + (n + fraction) * step)
                    start += [x, system.guess(x, u, p)]
        low, high, w = np.concatenate(lower), np.concatenate(upper), np.concatenate(start)
        end = self._left(ocp.intervals)[: system.state.numel()]
        low[end] = np.maximum(low[end], ocp.terminal_lower)
        high[end] = np.minimum(high[end], ocp.terminal_upper)
        return low, high, np.clip(w, low, high)

    def unpack(self, w: np.ndarray) -> list[Element]:
        """Return the finite elements in time order from a point of the MPCC."""
        n_x = self.ocp.system.state.numel()
        found: list[Element] = []
        time = 0.0
        for k, count in enumerate(self.elements):
            layout = self.layouts[count]
            own = w[self.offsets[k] : self.offsets[k] + layout.size]
            boundary = w[self._left(k)]
            for n in range(count):
                points = np.array([own[layout.point(n, j)] for j in range(layout.points)])
                step = float(own[layout.step(n)])
                found.append(
                    Element(
                        interval=k,
                        start=time,
                        step=step,
                        x_left=boundary[:n_x],
                        z_left=boundary[n_x:],
                        x=points[:, :n_x],
                        z=points[:, n_x:],
                        u=own[: layout.n_u],
                    )
                )
                time += step
                boundary = points[-1]
        return found

    def controls(self, w: np.ndarray) -> np.ndarray:
        """Return the controls at a point of the MPCC, (n_u, N)."""
        return w[self.offsets[None, :] + np.arange(self.ocp.system.control.numel())[:, None]]

    def cost_terms(self, w: np.ndarray) -> dict[str, float]:
        """Return every term of the objective at w by name."""
        totals: dict[str, float] = {}
        for block, functions in zip(self.problem.blocks[1:-1], self.intervals.values(), strict=True):
            values = functions.cost_terms.map(block.copies)(w[block.index], block.parameters)
            for name, row in zip(functions.cost_names, np.asarray(ca.DM(values).full()), strict=True):
                totals[name] = totals.get(name, 0.0) + float(row.sum())
        if "choice of alpha" in totals:
            totals["choice of alpha"] += float(self.problem.blocks[0].evaluate(w)[0].sum())
        terminal = ca.Function("terminal", [self.ocp.system.state], list(self.ocp.terminal_cost.values()))
        values = terminal.call([w[self._left(self.ocp.intervals)[: self.ocp.system.state.numel()]]])
        for name, value in zip(self.ocp.terminal_cost, values, strict=True):
            totals[name] = totals.get(name, 0.0) + float(value)
        return totals
