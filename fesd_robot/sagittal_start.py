"""A start in space from the motion of the same robot in its x-z plane, where the task is the same on both sides."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.adapters import numeric_physics
from fesd_robot.branch_of_modes import branch_in_modes
from fesd_robot.contact import ContactMode, contact_modes
from fesd_robot.fesd import Element, Transcription
from fesd_robot.fesd.neighbours import with_counts
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.force_variables import ForceVariables
from fesd_robot.mpcc import (
    REGULARISED,
    BranchPoint,
    BranchSolver,
    HomotopyOptions,
    MpccSolution,
    NlpReport,
    Trial,
)
from fesd_robot.neighbourhood import with_fewer_elements
from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.sagittal import SagittalTwin, sagittal_twin, space_configuration, space_velocity
from fesd_robot.recovery.contact_rows import stacked_rows
from fesd_robot.recovery.elements import ElementReader
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot.root import ROOT_PITCH
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import Stop
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.task import Task

logger = logging.getLogger(__name__)

ITERATIONS, UPDATES = 80, 6
"""Of IPOPT before the elements that have shrunk to nothing are taken out, and how often that happens: their multipliers
are not determined, and IPOPT does not end at a motion that is right."""

SETTLING = Trial(REGULARISED, iterations=40, violation=np.inf)
"""How elements that shrink are found; so regularised, IPOPT does not end at an exact motion."""


def sagittal_start(
    motion: MotionProblem,
    planned: Callable[[Task], Sequence[SolvedMotion]],
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion in space that does what the motion of a task's twin in the plane does.

    The plane's motion is searched, which takes a fraction of the time there: a quadruped has half of the joints and
    half of the contacts. In space every foot has its part of the force, and the branch NLP is solved from there; its
    costs and constraints are those of the task in space.

    Args:
        motion: the formulated task, in space.
        planned: a task -> its motion, searched: refined, which has shown that it is true, and as it was before.
        options: of the homotopy.
        deadline: of the task.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Returns:
        None where the task has no twin, as one that turns or goes sideways, or where that leads to no motion.
    """
    twin = sagittal_twin(motion)
    if twin is None:
        return None
    logger.info("both sides of the robot are asked for the same: the motion is planned in the x-z plane first")
    lifted = (_lifted(_Lift(motion, twin, one), options, deadline, progress, stop) for one in planned(twin.task))
    return next((one for one in lifted if one), None)


def _lifted(
    lift: _Lift,
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion in space near a motion in the plane; other args as in `sagittal_start`."""
    if not lift.planar.solution.exact:
        return None
    polisher, problem, begin = BranchTranscription(lift.transcription), lift.transcription.problem, time.perf_counter()
    solver = BranchSolver(
        problem, polisher, options, deadline.remaining, few_evaluations=False, stop=stop, progress=progress
    )
    end = solver.exact(_settled(lift.point(), solver, polisher), iterations=ITERATIONS, updates=UPDATES)
    if end is None:
        return None
    nothing = replace(lift.planar.solution, reports=[], solve_seconds=0.0)
    solution = solver.solution(end, nothing, time.perf_counter() - begin)
    if not any(end.branch.without_length):
        return polisher, solution
    # Elements that have shrunk are left out: their modes are undetermined, and a certificate would go through all.
    least = [1] * len(lift.transcription.elements)
    return with_fewer_elements(polisher, solution, least, options, deadline, progress, stop)


def _settled(start: BranchPoint, solver: BranchSolver, polisher: BranchTranscription) -> BranchPoint:
    """Return a point near the motion without the elements that shrink to nothing on the way there."""
    for _ in range(UPDATES):
        found = solver.tried(start, SETTLING)
        if found is None or not np.isfinite(found.w).all():
            return start
        branch = polisher.updated_branch(found.branch, found.w) or found.branch
        same, start = branch == start.branch, BranchPoint(found.w, branch)
        if same:
            break
    return start


@dataclass(frozen=True)
class _Lift:
    """A motion in the plane as finite elements in space."""

    motion: MotionProblem
    twin: SagittalTwin
    planar: SolvedMotion

    @cached_property
    def transcription(self) -> Transcription:
        """In space, with the elements and the scheme of the motion in the plane."""
        own = self.planar.transcription
        options = replace(self.motion.fesd, tableau=own.options.tableau)
        return with_counts(Transcription(self.motion.ocp, options), own.elements)

    @cached_property
    def _reader(self) -> ElementReader:
        planar = self.planar.motion
        return ElementReader(
            self.planar.transcription.options.tableau,
            planar.dynamics,
            planar.contacts,
            planar.contact_system,
            planar.auxiliary_force,
            self.planar.branch,
        )

    @cached_property
    def _variables(self) -> ForceVariables:
        return ForceVariables(self.motion)

    @cached_property
    def _feet(self) -> np.ndarray:
        """Which contact in the plane stands for each in space, (n_c)."""
        names = [contact.name for contact in self.planar.motion.contacts]
        return np.array([names.index(self.twin.contacts[contact.name]) for contact in self.motion.contacts])

    def point(self) -> BranchPoint:
        """Return the elements as a point of the transcription, and its branch."""
        planar = self.planar
        elements: list[Element] = []
        efforts: list[np.ndarray] = []
        modes: list[dict[str, ContactMode]] = []
        start = 0.0
        for e, element in enumerate(planar.transcription.unpack(planar.solution.w)):
            own = contact_modes(planar.branch, e)
            modes.append({name: own[stands] for name, stands in self.twin.contacts.items()})
            lifted, effort = self._element(e, element, start, elements[-1] if elements else None)
            elements.append(lifted)
            efforts.append(effort)
            start = elements[-1].end
        w = self.transcription.pack(self._holding_still(elements, efforts))
        branch = branch_in_modes(BranchTranscription(self.transcription), w, modes)
        branch = replace(branch, without_length=planar.branch.without_length)
        return BranchPoint(w, branch, freer=False)

    def _element(
        self, number: int, element: Element, start: float, before: Element | None
    ) -> tuple[Element, np.ndarray]:
        """Return an element in space, and the efforts of joints that do not move in the plane.

        Args:
            number, element: of the plane.
            start: numerical time of its left end.
            before: the element before it, in space.
        """
        physics = self._reader.read(number, element)
        feet, counts = self._feet, np.bincount(self._feet)
        share = 1.0 / counts[feet][:, None]
        x = np.array([self._state(one) for one in element.x])
        x_left = before.x[-1] if before else self._state(element.x_left)
        speed, limits = float(element.u[-1]), self.motion.task.limits.speed_of_time
        control = np.append(self._control(element.u), np.clip(speed, limits.lower, limits.upper))
        if physics.frozen:
            impulse = np.abs(physics.impulse[:, 0]).max()
            force = physics.impulse / max(impulse, 1e-300) * self.motion.auxiliary_force
            forces = np.tile(self._in_space(force[feet] * share * counts.max()), (len(element.z), 1, 1))
            rates, step = np.ones(len(forces)), impulse / counts.max() / self.motion.auxiliary_force
        else:
            forces = np.array([self._in_space(one[feet] * share) for one in physics.force])
            rates = np.array([self._variables.rate(one, control[-1]) for one in forces])
            step = (self._reader.clock(element.x[-1]) - self._reader.clock(element.x_left)) / rates.mean()
        z = np.array([self._variables.at(f, control, 1.0, r) for f, r in zip(forces, rates, strict=True)])
        z_left = before.z[-1] if before else z[0]
        scheme = self.transcription.options.tableau
        slopes = np.linalg.lstsq(scheme.A, x[: scheme.stages] - x_left, rcond=None)[0] / max(step, 1e-12)
        effort = self._holding(x, slopes, rates, forces * (not physics.frozen))
        return Element(element.interval, start, max(step, 0.0), x_left, z_left, x, z, control, slopes), effort

    @cached_property
    def _physics(self) -> NumericPhysics:
        return numeric_physics(self.motion)

    @cached_property
    def _held(self) -> list[tuple[int, int]]:
        """Controls of the joints that do not move in the plane, and their velocity coordinates."""
        names, velocities = self.motion.actuation.names, self.motion.robot.velocity_names
        return [(names.index(name), velocities.index(name)) for name in self.twin.locked if name in names]

    def _holding(self, x: np.ndarray, slopes: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return the mean effort that holds the joints that do not move in the plane, M a + h - J^T f, (n_held).

        Args:
            x, slopes: states at the stages, and their derivatives in numerical time, (n_s, n_x).
            rates: of the clock there.
            forces: on the contacts there, N, (n_s, n_c, 3).
        """
        n_q, n_v = len(self.motion.robot.configuration_names), len(self.motion.robot.velocity_names)
        nothing, rows = np.zeros(len(self.motion.actuation.names)), [row for _, row in self._held]
        efforts = []
        for one, slope, rate, force in zip(x, slopes, rates, forces, strict=False):
            q, v, a = one[:n_q], one[n_q : n_q + n_v], slope[n_q : n_q + n_v] / rate
            pushing = self._physics.contact_jacobian(q).T @ stacked_rows(force)
            efforts.append((self._physics.required_force(q, v, a, nothing) - pushing)[rows])
        return np.mean(efforts, axis=0)

    def _holding_still(self, elements: Sequence[Element], efforts: Sequence[np.ndarray]) -> list[Element]:
        """Return the elements with controls that hold these joints: the mean over the control interval."""
        clock = len(self.motion.robot.configuration_names) + len(self.motion.robot.velocity_names)
        lengths = np.array([one.x[-1, clock] - one.x_left[clock] for one in elements])
        intervals = np.array([one.interval for one in elements])
        columns, found = [column for column, _ in self._held], []
        for element in elements:
            weights = np.where(intervals == element.interval, np.maximum(lengths, 1e-9), 0.0)
            u = element.u.copy()
            u[columns] = np.average(efforts, axis=0, weights=weights)
            found.append(replace(element, u=u))
        return found

    def _in_space(self, forces: np.ndarray) -> np.ndarray:
        """Return normal, tangential and lateral forces, (n_c, 3), of those in the plane, (n_c, 2)."""
        return np.column_stack([forces, np.zeros(len(forces))])

    def _control(self, u: np.ndarray) -> np.ndarray:
        """Return the controls in space: a leader's is that of all joints it moves together."""
        planar, unison = self.planar.motion.actuation.names, self.twin.unison
        parts = {name: value / unison[name] for name, value in zip(planar, u[:-1].tolist(), strict=True)}
        efforts = self.twin.joints(parts, at_rest=True)
        return np.array([efforts[name] for name in self.motion.actuation.names])

    def _state(self, x: np.ndarray) -> np.ndarray:
        """Return a state in space: configuration, velocity, clock and integrated gaps."""
        q, v, gaps = self._reader.split(x)
        planar, robot = self.planar.motion.robot, self.motion.robot
        configuration = dict(zip(planar.configuration_names, q.tolist(), strict=True))
        velocity = dict(zip(planar.velocity_names, v.tolist(), strict=True))
        return np.concatenate(
            [
                space_configuration(self.twin, robot, configuration),
                space_velocity(self.twin, robot, velocity, configuration[ROOT_PITCH]),
                [self._reader.clock(x)],
                gaps[self._feet],
            ]
        )
