"""The finite elements of a solution, in numbers from which another solve can start."""

from __future__ import annotations

from typing import Literal

from fesd_robot.plans.record import Array, Record


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
