"""One simulation step: modes first, relaxed NLPs where that fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError
from fesd_robot.fesd.adaptive.ambiguity import repelling
from fesd_robot.fesd.adaptive.point_modes import PointModes
from fesd_robot.fesd.mode_sequence import FoundModes, StepInput
from fesd_robot.fesd.modes import ModeEquations, Modes
from fesd_robot.fesd.ocp import initial_value_problem
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.search import ACTIVE_G, ModeSearch
from fesd_robot.fesd.simulation import Note
from fesd_robot.fesd.trajectory import Element, interval_elements
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, RelaxedNlp, Run, assemble, solve
from fesd_robot.mpcc.relaxations import relaxation_named

HOMOTOPY_STARTS = ((1e-2, 0.1, 1.0), (1.0, 0.1, 1.0), (1.0, 0.35, 100.0), (1e-1, 0.1, 1.0), (1e-4, 0.1, 1.0))
"""First sigma, factor and velocity level ratio of a step's homotopy, and those that are tried when it fails."""

ROBOTS = "; a task or a plan is simulated from event to event, without control intervals, by fesd_robot.simulate"
"""Advice where a step with contact fails."""


@checked
@dataclass(frozen=True)
class SimulationSettings:
    """How the steps of a simulation are solved, and what their results must satisfy.

    Attributes:
        tolerance: how negative G or H may be.
        homotopy: of a step whose modes are not found directly; its first sigma, factor and velocity level ratio are
            those of `HOMOTOPY_STARTS`.
        state_lower, state_upper: bounds of the state, (n_x); if omitted, those of the system alone.
        sensitivities: also compute the derivatives of the end state.
    """

    tolerance: float = 1e-10
    homotopy: HomotopyOptions = field(default_factory=lambda: HomotopyOptions(tolerance=1e-9, max_iterations=200))
    state_lower: np.ndarray | None = None
    state_upper: np.ndarray | None = None
    sensitivities: bool = False

    def state_bounds(self, n_x: int) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of the state, (n_x) each.

        Raises:
            DimensionError: bounds of another length.
        """
        bounds = []
        for name, given, infinite in (
            ("state_lower", self.state_lower, -np.inf),
            ("state_upper", self.state_upper, np.inf),
        ):
            bounds.append(np.full(n_x, infinite) if given is None else np.asarray(given, dtype=float))
            if bounds[-1].shape != (n_x,):
                raise DimensionError(f"{name} has shape {bounds[-1].shape}, expected ({n_x},)")
        return bounds[0], bounds[1]


@dataclass(frozen=True)
class SolvedStep:
    """The own variables of a step and its modes, and how it was solved."""

    own: np.ndarray
    modes: Modes
    method: str
    trials: int
    iterations: int
    residual: float


@dataclass(frozen=True)
class StepFailure:
    """Why a step could not be solved, and the residual of the last attempt."""

    reason: str
    residual: float


@dataclass(frozen=True)
class Stepper:
    """Solves one step after the other; what does not change between them is built once."""

    system: ComplementaritySystem
    options: FesdOptions
    length: float
    settings: SimulationSettings

    @cached_property
    def equations(self) -> ModeEquations:
        """The step for prescribed modes."""
        assert isinstance(self.options.elements, int)
        return ModeEquations(self.system, self.options, self.options.elements)

    @cached_property
    def search(self) -> ModeSearch:
        """The search for modes."""
        return ModeSearch(self.equations, self.settings.tolerance, *self.state_bounds)

    @cached_property
    def state_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the state, (n_x) each; the system's own hold, too."""
        lower, upper = self.settings.state_bounds(self.system.state.numel())
        return (lower if self.system.state_lower is None else np.maximum(lower, self.system.state_lower)), upper

    @property
    def direct(self) -> bool:
        """Whether steps of equal length between switches are what the options ask for, and pairs are all there is."""
        alike = self.options.step_equilibration != "difference" or self.equations.elements <= 2
        jump = self.system.jump
        possible = self.options.switch_detection and jump.is_square if jump is not None else True
        known = self.system.switches_in_pairs and possible
        return known and (alike or not self.options.switch_detection)

    def _leavable(self, step: StepInput, found: FoundModes) -> bool:
        """Return whether the modes of a solved step are not the only ones where they begin."""
        left = np.concatenate([step.x, step.z])
        elements = interval_elements(
            self.equations.layout, self.search.states, found.own, left, interval=0, start=0.0
        )  # fmt: skip
        return bool(self.ambiguities(elements, list(self.last_of_elements(found.modes)), step.p))

    def ambiguities(self, elements: Sequence[Element], modes: Sequence[np.ndarray], p: np.ndarray) -> list[Note]:
        """Return where other motions go on from the beginning of a mode, too.

        Args:
            elements: of a step.
            modes: theirs, behind that of the element before if there is one.
            p: parameters.
        """
        if not self.direct or not self.options.switch_detection or self.system.jump is not None:
            return []
        before = modes[-len(elements) - 1] if len(modes) > len(elements) else None
        notes = []
        for element, mode in zip(elements, modes[-len(elements) :], strict=True):
            if (before is None or (mode != before).any()) and element.step > 0.0:
                point = (element.x_left, element.u, element.z_left, p)
                closed = np.asarray(self.points.sides(*point)[0] <= ACTIVE_G)
                own = self.points.solve(*point, mode)
                right = own.right(closed)
                text = repelling(self.points, point, mode, closed, own.rate, begins=True) if right else None
                notes += [Note(element.start, text)] if text else []
            before = mode
        return notes

    @cached_property
    def points(self) -> PointModes:
        """The modes of single points."""
        return PointModes.of(self.system)

    def last_of_elements(self, modes: Modes) -> Modes:
        """Return the mode of every element."""
        stages = self.equations.layout.stages
        return modes if self.options.switch_detection else modes[stages - 1 :: stages]

    def solve(self, step: StepInput, likely: list[np.ndarray]) -> SolvedStep | StepFailure:
        """Solve one step; ``likely`` are modes it probably starts in."""
        if self.direct:
            direct = self.search.solve(step, likely)
            if direct and self.search.out_of_elements and self._leavable(step, direct):
                reason = f"{self.search.reason}; what fits in them is a mode that can be left at once"
                return StepFailure(reason, direct.residual)
            if direct:
                return SolvedStep(direct.own, direct.modes, "modes", direct.trials, direct.iterations, direct.residual)
            if self.search.passed_bound:
                return StepFailure(self.search.reason, self.search.passed_bound)
        return self._homotopy(step)

    def _problem(self, step: StepInput) -> Transcription:
        lower, upper = self.state_bounds
        problem = initial_value_problem(self.system, step.x, self.length, control=step.u, parameters=step.p)
        return Transcription(replace(problem, state_lower=lower, state_upper=upper), self.options)

    def _homotopy(self, step: StepInput) -> SolvedStep | StepFailure:
        transcription, solver = self._problem(step), self.settings.homotopy
        if not self._built:
            relaxation, steering = relaxation_named(solver.relaxation), solver.steering
            self._built.append((transcription, assemble(transcription.problem, relaxation, steering=steering)))
        template, nlp = self._built[0]
        lower, upper, start = transcription.bounds_and_start()
        problem = replace(template.problem, lower=lower, upper=upper, start=start)
        iterations = 0
        for trial, (sigma, factor, ratio) in enumerate(HOMOTOPY_STARTS, start=1):
            sigma = max(sigma, solver.tolerance)
            homotopy = replace(solver, sigma_start=sigma, sigma_factor=factor, velocity_level_ratio=ratio)
            solution = solve(problem, Run(homotopy), nlp=nlp)
            iterations += solution.iterations
            if solution.feasible:  # a step has no objective of its own that an NLP would have to converge in
                return self._finished(step, solution, trial, iterations)
        worst = solution.residuals
        reason = f"{self.search.reason}; " if self.direct and self.search.reason else ""
        in_contact = any(condition.label.contact for condition in self.system.complementarities)
        return StepFailure(
            f"{reason}{solution.status}: violation {worst.constraint_violation:.1e} at {worst.worst_constraint}, "
            f"complementarity {worst.complementarity:.1e} at {worst.worst_pair}{ROBOTS if in_contact else ''}",
            max(worst.constraint_violation, worst.complementarity),
        )

    def _finished(self, step: StepInput, solution: MpccSolution, trial: int, iterations: int) -> SolvedStep:
        """Return the result of a homotopy, solved exactly in its own modes if that is possible."""
        own = solution.w[-self.equations.layout.size :]
        modes = self.equations.read_modes(own, step.x, step.p)
        exact = self.search.check(step, own, modes) if self.direct else None
        if exact:
            iterations += exact.iterations
            return SolvedStep(exact.own, modes, "homotopy, modes", trial, iterations, exact.residual)
        residual = max(solution.residuals.constraint_violation, solution.residuals.complementarity)
        return SolvedStep(own, modes, "homotopy", trial, iterations, residual)

    @cached_property
    def _built(self) -> list[tuple[Transcription, RelaxedNlp]]:
        return []
