"""How far every element is from the motion of its own mode: its local error, estimated by one more stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.linalg import lstsq

from fesd_robot.complementarity import ActiveFactor, HeldAt
from fesd_robot.exactness import SINGULAR_STEP
from fesd_robot.fesd.element import (
    CONTINUITY,
    DYNAMICS,
    JUMP,
    ElementPoints,
    SystemFunctions,
    element_equations,
    read_elements,
)
from fesd_robot.fesd.layout import IntervalLayout, layout_of
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.polishing import BranchMotion, ElementConditions
from fesd_robot.fesd.refinement.parts import element_in_parts
from fesd_robot.fesd.refinement.stages import interpolated
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau, make_tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.ranges import MAX_STAGES
from fesd_robot.running import check_time

NEWTON_ITERATIONS = 12
"""Most Newton iterations for an element; from the interpolated stages 2 to 4 are enough."""

NEWTON_TOLERANCE = 1e-10
"""Largest residual of the equations of a mode, in the units of their rows."""

NEAR_BOUND = 1e-3
"""Multipliers that come nearer to zero are near their bound; one is a force of ten robot weights."""


def local_errors(motion: BranchMotion, *, parts: int = 1) -> np.ndarray:
    """Return the estimated local error of every element, (number of elements).

        e = max_i |x_i(n_s + 1) - x_i(n_s)| / (1 + max |x_i|)

    Every element is integrated again from its own left state, in its own mode and with its own control, by the scheme
    with one more stage, and the states at its right end are compared; max |x_i| is that of the whole trajectory. The
    error of an element without length is zero, that of one whose equations have no solution nearby infinite.

    Args:
        motion: of a collocation scheme with fewer than `MAX_STAGES` stages.
        parts: in how many equal parts every element is integrated again, one after the other; with several the
            estimate comes near to the error itself.

    Source: Hairer, Norsett & Wanner, Solving ODEs I, II.4 (the difference of two orders as an estimate).
    """
    elements, branch, mode = motion.elements, motion.branch, _ModeEquations.of(motion)
    scale = 1 + np.max([np.abs(element.x).max(axis=0) for element in elements], axis=0)
    tableau = motion.transcription.options.tableau
    errors = np.zeros(len(elements))
    for e, element in enumerate(elements):
        check_time()
        if branch.without_length[e] or element.step <= 0:
            continue
        end: np.ndarray | None = element.x_left
        for start in interpolated(element_in_parts(element, parts, tableau), tableau, mode.options.tableau):
            solved = None if end is None else mode.solved(replace(start, x_left=end), branch.factors[e])
            end = solved and solved.end
        errors[e] = np.inf if end is None else (np.abs(end - element.x[-1]) / scale).max()
    return errors


def multiplier_errors(motion: BranchMotion) -> np.ndarray:
    """Return the estimated errors of multipliers near their bounds at the ends of elements, (number of elements).

        e = max_i |z_i(n_s + 1) - z_i(n_s)|, both ends, over those i with a value below `NEAR_BOUND`

    Multipliers at the ends are those of the polynomials through the stages, which are less accurate than states; both
    schemes are compared as in `local_errors`. Where a contact is at the edge of its friction cone, an error is a force
    that rigid bodies would need outside of it.

    Args:
        motion: as in `local_errors`.
    """
    elements, branch, mode = motion.elements, motion.branch, _ModeEquations.of(motion)
    tableau, finer = motion.transcription.options.tableau, mode.options.tableau
    errors = np.zeros(len(elements))
    for e, element in enumerate(elements):
        check_time()
        stages = element.z[: tableau.stages]
        ends = _at_ends(tableau, stages)
        near = np.vstack([stages, ends]).min(axis=0) < NEAR_BOUND
        near &= np.abs(stages).max(axis=0) > NEAR_BOUND  # others are held at zero
        if branch.without_length[e] or element.step <= 0 or not near.any():
            continue
        (start,) = interpolated([element], tableau, finer)
        solved = mode.solved(start, branch.factors[e])
        errors[e] = np.inf if solved is None else np.abs(solved.algebraic - ends)[:, near].max()
    return errors


def _at_ends(tableau: Tableau, stages: np.ndarray) -> np.ndarray:
    """Return the polynomials through values at the stages, (n_s, n), at the ends of the element, (2, n)."""
    return np.asarray(lagrange(tableau.c, np.array([0.0, 1.0])) @ stages)


class _Solved(NamedTuple):
    """State at the right end of an element, (n_x), and algebraic variables at both ends, (2, n_z)."""

    end: np.ndarray
    algebraic: np.ndarray


@dataclass(frozen=True)
class _ModeEquations:
    """The equations of one element with one more stage than a transcription has, in a mode that is prescribed.

    Unknowns are the states and algebraic variables at its points; a jump at its left boundary lies before it. Equations
    are the scheme's, and the active factor of every condition at the stages; an invariant takes the place of the state
    that it is.
    """

    transcription: Transcription
    conditions: ElementConditions

    @classmethod
    def of(cls, motion: BranchMotion) -> _ModeEquations:
        """Return those of a trajectory."""
        return cls(motion.transcription, motion.polisher.conditions)

    @cached_property
    def options(self) -> FesdOptions:
        """Of the scheme with one more stage."""
        options = self.transcription.options
        stages = options.tableau.stages + 1
        assert stages <= MAX_STAGES
        return replace(options, tableau=make_tableau(options.tableau.scheme, stages))

    @cached_property
    def _layout(self) -> IntervalLayout:
        return layout_of(self.transcription.ocp.system, self.options, 1)

    @cached_property
    def _functions(self) -> tuple[ca.Function, list[tuple[str, str]], int]:
        """(left, own, p) -> rows and their derivative by own; kind and subject of the scheme's rows; stages' rows."""
        system, layout = self.transcription.ocp.system, self._layout
        left, own = ca.SX.sym("left", layout.n_x), ca.SX.sym("own", layout.size)
        p = ca.SX.sym("p", system.parameters.sparsity())
        part: ElementPoints = read_elements(
            layout, self.options.tableau, ca.vertcat(left, ca.SX.zeros(layout.n_z)), own
        )[0]
        scheme = element_equations(part, SystemFunctions.of(system), self.options, layout, own[: layout.n_u], p)
        names = [(one.kind, label.subject) for one in scheme for label in one.labels]
        at_stages = [ca.vertcat(self.conditions.values(x, z), z) for x, z in part.stages]
        rows = ca.vertcat(*[one.expression for one in scheme], *at_stages)
        function = ca.Function("rows", [left, own, p], [rows, ca.jacobian(rows, own)])
        return function, names, at_stages[0].numel()

    def solved(self, start: Element, factors: Sequence[ActiveFactor]) -> _Solved | None:
        """Return the ends of the element, or None if Newton's method does not converge.

        Args:
            start: the element, with the points of this scheme to start from.
            factors: the active factor of every condition.
        """
        function, _, _ = self._functions
        layout, own = self._layout, np.zeros(self._layout.size)
        self.transcription.pack_element(own, 0, start, layout)
        own[layout.jumped(0)] = start.x_left[list(layout.jump_states)]
        unknown = np.arange(layout.jump(0).stop, layout.size)
        chosen, p = self._equations(factors), self.transcription.parameters[:, start.interval]
        for _ in range(NEWTON_ITERATIONS):
            values, slope = (np.asarray(part) for part in function(start.x_left, own, p))
            residual = values.ravel()[chosen]
            if np.abs(residual).max() <= NEWTON_TOLERANCE:
                stages = np.array([own[layout.algebraic(0, j)] for j in range(layout.stages)])
                return _Solved(np.array(own[layout.state(0, layout.stages)]), _at_ends(self.options.tableau, stages))
            known = slope[np.ix_(chosen, unknown)]
            own[unknown] -= lstsq(known, residual, cond=SINGULAR_STEP, lapack_driver="gelsy")[0]
        return None

    def _equations(self, factors: Sequence[ActiveFactor]) -> np.ndarray:
        """Return the indices of the rows that are zero in a mode."""
        key = tuple(factors)
        if key not in self._known:
            _, names, width = self._functions
            held, replaced = self._held(key)
            scheme = [
                i
                for i, (kind, name) in enumerate(names)
                if kind != JUMP and (kind not in (DYNAMICS, CONTINUITY) or name not in replaced)
            ]
            stages = range(self.options.tableau.stages)
            self._known[key] = np.array([*scheme, *(len(names) + j * width + i for j in stages for i in sorted(held))])
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[ActiveFactor, ...], np.ndarray]:
        return {}

    def _held(self, factors: Sequence[ActiveFactor]) -> tuple[set[int], set[str]]:
        """Return what is zero at the stages, quantities first and algebraic variables behind them, and which states
        need no equation of their own."""
        conditions, system = self.conditions, self.transcription.ocp.system
        n_x, held, replaced = system.state.numel(), set(), set()
        sides: set[tuple[int, int]] = set()
        frozen = ActiveFactor.COMPLEMENT in factors
        for i, (member, own) in enumerate(zip(conditions.members, factors, strict=False)):
            if member.condition.held_at is HeldAt.LEFT_BOUNDARY and conditions.jumps:
                continue
            if own is ActiveFactor.G and (
                member.condition.held_at is HeldAt.RIGHT_BOUNDARY or conditions.uses_initial_value(i, factors)
            ):
                continue
            if frozen and member.condition.idle:
                held |= {len(conditions.quantities) + variable for variable in conditions.idle[i]}
                continue
            factor = ActiveFactor.H if frozen and member.condition.rate_share else own
            at = member.quantity(factor)
            if factor is ActiveFactor.G and member.invariant_state is not None:
                replaced.add(system.state_names[member.invariant_state])
            elif factor is ActiveFactor.G and member.condition.vanishing:
                sides.add((at, member.direction))
                if (at, -member.direction) not in sides:
                    continue
            several = conditions.quantities[at].variables if len(conditions.quantities[at].variables) > 1 else ()
            held |= {len(conditions.quantities) + i - n_x for i in several} or {at}
        return held, replaced
