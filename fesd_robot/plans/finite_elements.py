"""The finite elements of a solution, in numbers from which another solve can start."""

from __future__ import annotations

from typing import Literal

import numpy as np

from fesd_robot.exactness import LAST_BITS
from fesd_robot.plans.record import Array, Record


class Multipliers(Record):
    """Lagrange multipliers, of which most are zero.

    Attributes:
        size: of the whole vector.
        indices: of those that are kept, (k,).
        values: of these, (k,).
    """

    size: int
    indices: list[int]
    values: Array

    @classmethod
    def of(cls, multipliers: np.ndarray) -> Multipliers:
        """Return multipliers without those that are zero to the last bits of the largest one."""
        kept = np.flatnonzero(np.abs(multipliers) > LAST_BITS * np.abs(multipliers).max(initial=0.0))
        return cls(size=len(multipliers), indices=kept.tolist(), values=multipliers[kept])

    @property
    def vector(self) -> np.ndarray:
        """All of them, (size,)."""
        vector = np.zeros(self.size)
        vector[self.indices] = self.values
        return vector


class BranchNlpRecord(Record):
    """The branch NLP that a solution solves: its grid, what refinement added to it, and its multipliers.

    Attributes:
        lengths: of the control intervals as the solver was started, s, (N,).
        phases: number of intervals of every phase.
        knots: numbers of the nodes that stay at their times.
        moving: whether the lengths are variables.
        elements: of every interval, (N,).
        bounds: bounds between stages: element, variable, sign, limit, whether at its end only, whether of its mode.
        paths: path constraints between stages: number of the constraint, element, margin.
        of_bounds, of_rows: Lagrange multipliers of the bounds of the variables and of the rows.
    """

    lengths: Array
    phases: list[int]
    knots: list[int]
    moving: bool
    elements: list[int]
    bounds: list[tuple[int, int, int, float, bool, bool]]
    paths: list[tuple[int, int, float]]
    of_bounds: Multipliers
    of_rows: Multipliers


class FiniteElements(Record):
    """An exact solution on its finite elements: E of them.

    Attributes:
        scheme, stages: of the elements, such as ``radau_iia``.
        states: names of the states.
        conditions: names of the complementarity conditions of an element.
        interval: control interval of every element, (E,).
        step: length in numerical time, (E,).
        left: state and algebraic variables at the start, (n_x + n_z,).
        states_at, algebraic_at: at the stages, and at the right end if that is none and has its own, by element and
            point, (E n_p n_x,) and (E n_p n_z,).
        slopes: of the states at the stages, (E n_s n_x,).
        controls: by element, the speed of time last, (E n_u,).
        active: of every element, the letters of the factors that are zero: G, H, or C for the complement; small ones
            for an element without length.
        lefts: state that every element starts from, (E n_x,), where impulses act between them; None where each starts
            from the end of the one before.
        nlp: the branch NLP that it solves; None in plans of earlier programs.
    """

    scheme: Literal["radau_iia", "gauss_legendre"]
    stages: int
    states: list[str]
    conditions: list[str]
    interval: Array
    step: Array
    left: Array
    states_at: Array
    algebraic_at: Array
    slopes: Array
    controls: Array
    active: list[str]
    lefts: Array | None = None
    nlp: BranchNlpRecord | None = None
