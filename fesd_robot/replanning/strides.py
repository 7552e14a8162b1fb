"""Some strides of a gait, one after the other, as one motion that has no end in view but the gait itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.errors import PlanFileError
from fesd_robot.fesd import (
    AddedRows,
    Clock,
    ControlGrid,
    Element,
    OptimalControlProblem,
    Span,
    TrajectoryConstraint,
    Transcription,
)
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.instants import SAME_PART
from fesd_robot.mpcc import Mpcc
from fesd_robot.nlp.real_time import PrimalDual
from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.problem import PERIOD
from fesd_robot.ocp.reference_spline import ReferenceSpline
from fesd_robot.ocp.vectors import vector
from fesd_robot.replanning.horizon import Horizon
from fesd_robot.replanning.mirror_image import MirrorImage

STRIDES = 2
"""Of a horizon."""

LEAST = 1.0
"""Least barrier parameter as a part of the largest one: feet that swing low and fast need the room."""

FITS = 1e-4
"""Violation of equations up to which motions one after the other are one; gaps at both ends of a gait differ."""

SAME_COST = 1e-6
"""Relative difference up to which the cost of a gait counts as that of its mirror image."""


class Strides:
    """A gait again and again.

    A stride is what repeats: the whole plan, or of a plan with a mirror the plan and its image. The horizon begins in
    the state of the plan and ends in that of the gait, so the gait is its solution.

    Args:
        plan: the motion of a plan with a periodic goal, on a grid that moves.
        problem: its task, formulated.
        count: strides.

    Attributes:
        motion: of all strides.
        phases: of a stride.
        duration: of a stride, s.
        advance: what q gains in a stride, (n_q).
        change: what x gains when the plan, or its image, goes on, (n_x).
        plans: of a stride, 1, or 2 with a mirror.
        image: mirror image of the gait.
        horizon: the motion as a nonlinear program whose first stride passes.

    Raises:
        PlanFileError: constraints in a part of the plan, or a mirror image that is no motion of the same robot, or has
            another cost.
    """

    def __init__(self, plan: BranchMotion, problem: MotionProblem, count: int = STRIDES) -> None:
        periodic = problem.task.goal.periodic
        assert periodic is not None
        self.image, self.plans = MirrorImage.of(problem), 2 if periodic.mirror else 1
        first, n_q = plan.elements[0], len(problem.robot.configuration_names)
        self.change = plan.elements[-1].x[-1] - self.image.state(first.x_before)
        begin = 2 * n_q + 1  # robots of periodic goals have as many velocities as coordinates
        gaps = problem.contact_system.gap_states
        self.change[n_q : 2 * n_q] = self.change[begin : begin + gaps] = 0.0
        self.change[:n_q] = vector(problem.robot.configuration_names, periodic.stride, 0.0)
        self._task, self._count, self._own_intervals = problem, count, plan.transcription.grid.intervals
        self.motion = self._repeated(plan, count * self.plans)
        self.phases = self.plans * len(plan.transcription.grid.phases)
        self._change_of_stride = self._after(np.zeros(len(first.x_before)), self.plans)
        self.advance = self._change_of_stride[:n_q]
        self.duration = float(self._change_of_stride[2 * n_q])
        names = {name: i for i, name in enumerate(plan.transcription.ocp.system.state_names)}
        self._changes_of_variables = np.array(
            [
                self._change_of_stride[names[label.subject]] if label.kind == "state" else 0.0
                for label in self.motion.transcription.problem.variables
            ]
        )
        self._check(plan)
        self.horizon = Horizon(self.motion, self.phases, LEAST)
        later = self._later_variables()
        rows = _later_rows(self.motion.polisher.problem, later)
        self._renumbering = later, *self.horizon.solver.renumbering(later, rows)

    def shifted(self, own: PrimalDual) -> PrimalDual:
        """Return a point whose first stride has passed: it begins with the second one, and ends as the gait does.

        Args:
            own: a point of the horizon's solver.
        """
        settled = self.horizon.settled
        pairs = (settled.x, own.x), (settled.lam, own.lam), (settled.z, own.z)
        x, lam, z = (
            np.where(numbers < 0, other, values[numbers])
            for numbers, (other, values) in zip(self._renumbering, pairs, strict=True)
        )
        x = x - np.where(self._renumbering[0] < 0, 0.0, self._changes_of_variables)
        return self.horizon.solver.at(x, replace(settled, lam=lam, z=z))

    def gains(self, time: np.ndarray, gain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times, s, and gains of a stride, (m, n_u, 2 n_v), from those of the plan."""
        if self.plans == 1:
            return time, gain
        return np.concatenate([time, time + self.duration / 2]), np.concatenate([gain, self.image.gain(gain)])

    def _after(self, x: np.ndarray, plans: int) -> np.ndarray:
        """Return what becomes of states, (..., n_x), in some repetitions of the plan."""
        for _ in range(plans):
            x = self.image.state(x) + self.change
        return x

    def _repeated(self, plan: BranchMotion, count: int) -> BranchMotion:
        """Return the plan `count` times, each time but the first as the image of the one before."""
        own = plan.transcription
        elements, branches, added = [plan.elements], [plan.branch], [own.added]
        length, intervals, number = own.ocp.duration, own.grid.intervals, sum(own.elements)
        for _ in range(count - 1):
            image = self.image.elements(elements[-1], plan)
            elements.append([self._later_element(one, intervals, length) for one in image])
            branches.append(self.image.branch(branches[-1]))
            last = self.image.added(added[-1], plan)
            added.append(
                AddedRows(
                    tuple(replace(one, element=one.element + number) for one in last.bounds),
                    tuple(replace(one, element=one.element + number) for one in last.paths),
                )
            )
        grid = own.grid
        transcription = Transcription(
            self._problem(plan, count),
            replace(own.options, elements=own.elements * count),
            AddedRows(
                tuple(bound for one in added for bound in one.bounds),
                tuple(path for one in added for path in one.paths),
            ),
            ControlGrid(grid.lengths * count, grid.phases * count, moving=True, knots=(intervals * count,)),
        )
        first = branches[0]
        branch = Branch(
            first.conditions,
            tuple(factors for one in branches for factors in one.factors),
            first.without_length * count,
        )
        w = transcription.pack([one for each in elements for one in each])
        return BranchMotion(BranchTranscription(transcription), w, branch)

    def _later_element(self, one: Element, intervals: int, length: float) -> Element:
        return replace(
            one,
            interval=one.interval + intervals,
            start=one.start + length,
            x_left=one.x_left + self.change,
            x=one.x + self.change,
        )

    def _problem(self, plan: BranchMotion, count: int) -> OptimalControlProblem:
        """Return the problem of a horizon that begins and ends in the gait."""
        ocp, elements, parts = plan.transcription.ocp, plan.elements, self._task.parts
        assert ocp.clock is not None
        start, pace = elements[0].x_before, float(elements[0].u[-1])
        end, n = self._after(start, count), ocp.clock.state
        low, high = np.full(len(end), -np.inf), np.full(len(end), np.inf)
        low[:n] = high[:n] = end[:n]
        travels = self.change != 0.0
        control_lower, control_upper = ocp.control_lower.copy(), ocp.control_upper.copy()
        control_lower[-1] = control_upper[-1] = pace
        spline = self._reference(parts.reference_spline, ocp.duration, count)
        values = parts.values
        return replace(
            ocp,
            duration=ocp.duration * count,
            intervals=ocp.intervals * count,
            parameters=np.zeros((0, ocp.intervals * count)),
            initial_lower=start,
            initial_upper=start,
            state_lower=np.where(travels, -np.inf, ocp.state_lower),
            state_upper=np.where(travels, np.inf, ocp.state_upper),
            last_state_upper=np.full(len(end), np.inf),
            terminal_lower=low,
            terminal_upper=high,
            control_lower=control_lower,
            control_upper=control_upper,
            state_guess=lambda time: start,
            control_guess=np.tile(ocp.control_guess[:, :1], ocp.intervals * count),
            clock=Clock(n, lambda time: np.concatenate([spline.parameters(time), values])),
            constraints=[_everywhere(one, ocp.duration, count) for one in ocp.constraints if one.name != PERIOD],
        )

    def _reference(self, own: ReferenceSpline, duration: float, count: int) -> ReferenceSpline:
        """Return a reference again and again."""
        pieces = int(np.searchsorted(own.knots, (1.0 - SAME_PART) * duration))
        n_q = len(own.names)
        sources, signs = (each[:n_q] for each in self.image.states)
        knots, starts, coefficients = [own.knots[:pieces]], [own.starts[:pieces]], [own.coefficients[:pieces]]
        for number in range(1, count):
            knots.append(own.knots[:pieces] + number * duration)
            starts.append(starts[-1][:, sources] * signs + self.change[:n_q])
            coefficients.append(coefficients[-1][:, :, sources] * signs)
        end = own.starts[pieces]
        for _ in range(count - 1):
            end = end[sources] * signs + self.change[:n_q]
        return ReferenceSpline.of_pieces(
            own.names,
            np.append(np.concatenate(knots), count * duration),
            np.concatenate(starts),
            np.concatenate(coefficients),
            end,
        )

    def _later_variables(self) -> np.ndarray:
        """Return of every variable the one that is a stride later, (n), -1 in the last stride."""
        indices = self.motion.transcription.indices
        intervals = self.plans * self._own_intervals
        size = len(indices.point(0))
        later = np.full(len(self.motion.w), -1)
        later[:size] = indices.point(intervals)
        moved = np.arange(indices.offsets[intervals], len(later))
        later[size : size + len(moved)] = moved
        return later

    def _check(self, plan: BranchMotion) -> None:
        violation, cost = _measured(self.motion)
        own = _measured(plan)[1] * self.plans * self._count
        if violation > FITS:
            raise PlanFileError(
                f"found a gait that goes on with a violation of {violation:.1g}, expected one whose every stride, or "
                "mirror image, is a motion of the robot"
            )
        if abs(cost - own) > SAME_COST * abs(own):
            raise PlanFileError(
                f"found a gait with a cost of {own:.6g} whose strides and mirror images cost {cost:.6g}, expected the "
                "same costs of what is mirrored"
            )


def _everywhere(constraint: TrajectoryConstraint, duration: float, count: int) -> TrajectoryConstraint:
    """Return a constraint that holds in all of a plan, for all of its repetitions."""
    if constraint.intervals != Span(0.0, duration):
        raise PlanFileError(f"found constraint '{constraint.name}' in a part of a gait, expected one that holds always")
    return replace(constraint, intervals=Span(0.0, duration * count))


def _later_rows(problem: Mpcc, variables: np.ndarray) -> np.ndarray:
    """Return of every row of a problem the one that says the same of later variables, -1 where there is none."""
    result, first = [], 0
    for block in problem.blocks:
        rows = len(block.lower)
        places = {tuple(column): copy for copy, column in enumerate(block.index.T.tolist())}
        for column in variables[block.index].T.tolist():
            copy = places.get(tuple(column), -1)
            result.append(np.full(rows, -1) if copy < 0 else first + copy * rows + np.arange(rows))
        first += rows * block.copies
    return np.concatenate(result)


def _measured(motion: BranchMotion) -> tuple[float, float]:
    """Return the violation of equations and bounds by a motion, and its cost."""
    bounds, w = motion.polisher.bounds(motion.branch), motion.w
    parts = [block.evaluate(w)[:2] for block in motion.polisher.problem.blocks]
    g = np.concatenate([rows.ravel(order="F") for _, rows in parts])
    beyond = [bounds.g_lower - g, g - bounds.g_upper, bounds.lower - w, w - bounds.upper]
    return max(float(each.max(initial=0.0)) for each in beyond), float(sum(cost.sum() for cost, _ in parts))
