"""An optimal control problem with conditions between its intervals, as one MPCC."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.fesd import Condition, FesdOptions, OptimalControlProblem, Transcription
from fesd_robot.mpcc import Block, Mpcc


def transcribe(ocp: OptimalControlProblem, options: FesdOptions) -> Transcription:
    """Return a problem discretised by FESD, with its conditions if it has any."""
    if not ocp.conditions:
        return Transcription(ocp, options)
    return ConditionedTranscription(replace(ocp, conditions=()), options, tuple(ocp.conditions))


@dataclass(frozen=True)
class ConditionedTranscription(Transcription):
    """A transcription of which every condition is one more block, over variables that are there without it.

    Attributes:
        conditions: what is held or weighed besides the intervals' own equations and costs.
    """

    conditions: tuple[Condition, ...] = ()

    @cached_property
    def problem(self) -> Mpcc:
        """The MPCC: that of the intervals, and a block for each condition."""
        plain = self._plain.problem
        blocks = [self._block(condition) for condition in self.conditions]
        return replace(plain, blocks=[*plain.blocks, *(block for block in blocks if block.copies)])

    @cached_property
    def _plain(self) -> Transcription:
        return Transcription(self.ocp, self.options)

    def _block(self, condition: Condition) -> Block:
        places = list(self._places(condition))
        which = [list(condition.intervals).index(k) for k, _, _ in places]
        empty, size = ca.SX(0, 1), condition.variables.numel()
        cost = sum(condition.cost.values(), ca.SX(0))
        return Block(
            copy_names=[where for _, where, _ in places],
            function=ca.Function(
                "condition", [condition.variables, condition.parameters], [cost, condition.rows, empty, empty]
            ),
            index=np.array([index for _, _, index in places], dtype=int).reshape(-1, size).T,
            parameters=condition.parameter_values[:, which],
            lower=condition.lower,
            upper=condition.upper,
            constraint_names=list(condition.row_names),
            pair_names=[],
        )

    def _places(self, condition: Condition) -> Iterator[tuple[int, str, np.ndarray]]:
        """Yield (interval, where in words, indices of the variables) of every place of a condition."""
        if condition.place == "period":
            yield (
                condition.intervals[0],
                "the motion",
                np.concatenate([self._state(0), self._state(len(self.elements))]),
            )
            return
        for k in condition.intervals:
            if condition.place == "stages":
                yield from ((k, where, index) for where, index in self._points(k))
            elif condition.place == "ends":
                yield k, f"interval {k}", self._state(k + 1)
            elif condition.place == "intervals":
                yield k, f"interval {k}", np.concatenate([self._state(k), self._state(k + 1)])
            elif k + 1 < len(self.elements):
                both = [self._state(k + 1), self._control(k), self._state(k + 2), self._control(k + 1)]
                yield k, f"interval {k} to {k + 1}", np.concatenate(both)

    def _points(self, k: int) -> Iterator[tuple[str, np.ndarray]]:
        """Yield (where in words, indices of (x, u, z)) of every stage and own right end of an interval."""
        layout, first = self.layouts[self.elements[k]], self.offsets[k]
        for n in range(layout.elements):
            for j in range(layout.stages + layout.end_state):
                x, z = layout.state(n, j), layout.algebraic(n, j)
                own = [first + np.arange(x.start, x.stop), self._control(k), first + np.arange(z.start, z.stop)]
                point = f"stage {j + 1}" if j < layout.stages else "right end"
                yield f"interval {k}, element {n}, {point}", np.concatenate(own)

    def _state(self, k: int) -> np.ndarray:
        """Indices of the state that interval k starts from; k = N gives the end of the horizon."""
        return self._left(k)[: self.ocp.system.state.numel()]

    def _control(self, k: int) -> np.ndarray:
        return self.offsets[k] + np.arange(self.ocp.system.control.numel())

    def cost_terms(self, w: np.ndarray) -> dict[str, float]:
        """Return every term of the objective at w by name."""
        totals = self._plain.cost_terms(w)
        for condition in self.conditions:
            places = list(self._places(condition))
            if not condition.cost or not places:
                continue
            block = self._block(condition)
            terms = ca.Function(
                "terms", [condition.variables, condition.parameters], [ca.vertcat(*condition.cost.values())]
            )
            values = np.asarray(ca.DM(terms.map(block.copies)(w[block.index], block.parameters)).full())
            for name, row in zip(condition.cost, values, strict=True):
                totals[name] = totals.get(name, 0.0) + float(row.sum())
        return totals
