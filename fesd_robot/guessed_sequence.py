"""Starts on a guessed contact sequence: that of the initial guess, or one on which feet step in turn."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.branch_of_modes import branch_in_modes
from fesd_robot.complementarity import Branch
from fesd_robot.contact import ContactMode
from fesd_robot.fesd import Element, Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.force_variables import ForceVariables
from fesd_robot.known_sequence import cheaper_start, exact_start
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, NlpReport
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.formulate import gap_function
from fesd_robot.stepping import steppings
from fesd_robot.strategies.attempts import Stop
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import with_overrides
from fesd_robot.task import Task

TOUCHING = 0.2
"""Part of the largest height of a contact up to which it touches the ground in the guess."""

LOW = 2e-3
"""m, height up to which it touches whatever the largest is."""

LEAST_FORCE, LARGEST_FORCE = 0.02, 3.0
"""Of the weight: normal force of a contact that touches in the guess."""

SLIDING = 10 * LOW
"""m, path of a contact that touches all along the guess, from which it slides."""

CREEPING = 1e-3
"""Of that path, in an interval, up to which it sticks there."""

logger = logging.getLogger(__name__)


def needs_guessed_start(motion: MotionProblem) -> bool:
    """Return whether a motion is first looked for on the contact sequence of its guess: with several feet in space."""
    return motion.in_space and len(motion.contacts) > 1


def with_own_starts(task: Task) -> Task:
    """Return a task with one initial guess, where it leaves open how many and its motion begins on guessed contacts.

    Another guess has the same contacts, or none that lead to a motion; two starts at once have one core each for a
    search that uses every core that is free.

    Args:
        task: the task.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    if task.solver.starts is not None or task.solver.warm_start or not needs_guessed_start(formulate(task)):
        return task
    return with_overrides(task, {"solver.starts": 1})


def guessed_start(
    motion: MotionProblem,
    transcription: Transcription,
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion with the contact sequence of the initial guess.

    A contact sticks in the control intervals in which the guess has it on the ground, and flies in the others; it lands
    softly, so that no interval needs an impact. One that never leaves the ground there, and yet moves on it, slides
    while it does. The forces are those of least size that move the robot as the guess does. The branch NLP is solved
    from there; where it does not converge its neighbours are tried, as in `repair`. The sequence is a start, no more:
    the local search changes it wherever that pays, and adds impacts.

    A homotopy instead has a pair for every contact at every stage: with four feet in space it has not found a motion in
    ten minutes where this takes seconds.

    Args:
        motion, transcription: the task.
        options: of the homotopy.
        deadline: of the task.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Returns:
        None where the guess has no contact sequence that leads to a motion.
    """
    w, branch = _Sequence(motion, transcription, transcription.ocp.state_guess, touching(motion)).point()
    return exact_start(transcription, w, branch, options, deadline, progress, stop)


def stepping_start(
    motion: MotionProblem,
    transcription: Transcription,
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the cheapest exact motion of those on which feet step in turn (`stepping.steppings`).

    They are looked for where the initial guess says that feet stick all the time which end elsewhere, as a straight
    line does: no motion has that contact sequence.

    Args:
        motion, transcription, options, deadline, progress, stop: as of `guessed_start`.

    Returns:
        None where the guess has feet that end elsewhere leave the ground, or where no such motion is found.
    """
    orders = steppings(motion)
    if not orders:
        return None
    held = np.all(touching(motion), axis=0)
    if not all(held[foot.contact] for foot in orders[0].feet if foot.steps):
        return None
    cheapest, below = None, np.inf
    for stepping in orders:
        start = _Sequence(motion, transcription, stepping.state, stepping.touching).point()
        found = cheaper_start(transcription, start, options, deadline, progress, stop, below)
        if found:
            cheapest, below = found, found[1].residuals.objective
        came = f"cost {below:.6g}" if found else "no motion" if cheapest is None else "none that is cheaper"
        logger.info("feet step in the order %s: %s", stepping.order, came)
    return cheapest


def touching(motion: MotionProblem) -> np.ndarray:
    """Return which contacts touch in which interval of the guess, of other starts of the reference, (N, n_c)."""
    ends, gap = _interval_ends(motion), gap_function(motion.dynamics, motion.contacts)
    at = motion.reference.configuration if motion.task.solver.seed else motion.ocp.state_guess
    n_q = len(motion.robot.configuration_names)
    gaps = np.array([np.asarray(gap(at(time)[:n_q])).ravel() for time in (ends[:-1] + ends[1:]) / 2])
    highest: np.ndarray = gaps.max(axis=0)
    return np.less_equal(gaps, np.maximum(LOW, TOUCHING * highest))


def _interval_ends(motion: MotionProblem) -> np.ndarray:
    """Return where control intervals begin and end in the initial guess, s, (N + 1)."""
    return np.linspace(0.0, motion.ocp.duration, motion.ocp.intervals + 1)


@dataclass(frozen=True)
class _Sequence:
    """A guess as finite elements, all of an interval in one mode.

    Attributes:
        motion, transcription: the task.
        moving: time, s -> state, of which configuration and velocity, (n_q + n_v), are taken.
        touching: which contacts touch in which interval, (N, n_c).
    """

    motion: MotionProblem
    transcription: Transcription
    moving: Callable[[float], np.ndarray]
    touching: np.ndarray

    @cached_property
    def _variables(self) -> ForceVariables:
        return ForceVariables(self.motion)

    @cached_property
    def _ends(self) -> np.ndarray:
        return _interval_ends(self.motion)

    @cached_property
    def _rigid(self) -> ca.Function:
        """(q, v, u) -> M, B u - h, B, (J_n, J_t)^T of all contacts, (n_v, n_c (1 + n_t)), and gaps, (n_c)."""
        dynamics, contacts = self.motion.dynamics, self.motion.contacts
        symbols = [dynamics.configuration, dynamics.velocity, dynamics.control]
        directions = ca.horzcat(*[ca.horzcat(contact.normal, contact.tangents) for contact in contacts])
        gaps = ca.vertcat(*[contact.gap for contact in contacts])
        actuation = ca.jacobian(dynamics.force, dynamics.control)
        return ca.Function("rigid", symbols, [dynamics.mass_matrix, dynamics.force, actuation, directions, gaps])

    def _evaluated(self, x: np.ndarray) -> list[np.ndarray]:
        n_q, n_v = len(self.motion.robot.configuration_names), len(self.motion.robot.velocity_names)
        u = np.zeros(self.motion.dynamics.control.numel())
        v = x[n_q : n_q + n_v] if len(x) > n_q else np.zeros(n_v)
        return [np.asarray(ca.DM(part).full()) for part in self._rigid(x[:n_q], v, u)]

    @cached_property
    def sliding(self) -> np.ndarray:
        """Which contacts slide in which interval: those that touch all along, where they move, (N, n_c) of bool."""
        contacts, n_q = self.motion.contacts, len(self.motion.robot.configuration_names)
        n_v, paths = len(self.motion.robot.velocity_names), np.zeros(self.touching.shape)
        for path, begin, end in zip(paths, self._ends[:-1], self._ends[1:], strict=True):
            x = self.moving((begin + end) / 2)
            velocities = (self._evaluated(x)[3].T @ x[n_q : n_q + n_v]).reshape(len(contacts), -1)
            path[:] = (end - begin) * np.linalg.norm(velocities[:, 1:], axis=1)
        moves = paths > CREEPING * paths.sum(axis=0)
        slides = np.array(
            [c.friction > 0 and self.motion.task.contacts[c.name].slipping == "allowed" for c in contacts]
        )
        return np.asarray(moves & slides & self.touching.all(axis=0) & (paths.sum(axis=0) > SLIDING))

    def point(self) -> tuple[np.ndarray, Branch]:
        """Return the guess as a point of the transcription, and its branch."""
        ocp, tableau = self.transcription.ocp, self.transcription.options.tableau
        fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
        elements: list[Element] = []
        nothing = np.zeros((tableau.stages, ocp.system.state.numel()))
        for k, count in enumerate(self.transcription.elements):
            z, u = self._forces(k)
            step = (self._ends[k + 1] - self._ends[k]) / count
            for n in range(count):
                start = self._ends[k] + n * step
                x = np.array([self._state(start + c * step, k) for c in fractions])
                left = elements[-1] if elements else None
                x_left = left.x[-1] if left else self._state(0.0, 0)
                z_left = left.z[-1] if left else z
                elements.append(Element(k, start, step, x_left, z_left, x, np.tile(z, (len(x), 1)), u, nothing))
        w = self.transcription.pack(elements)
        names = [contact.name for contact in self.motion.contacts]
        modes = [
            {
                name: (ContactMode.SLIP if slides else ContactMode.STICK) if touches else ContactMode.FLIGHT
                for name, touches, slides in zip(names, own, sliding, strict=True)
            }
            for own, sliding in np.repeat(
                np.stack([self.touching, self.sliding], 1), self.transcription.elements, axis=0
            )
        ]
        return w, branch_in_modes(BranchTranscription(self.transcription), w, modes)

    def _state(self, time: float, interval: int) -> np.ndarray:
        """Return the state of the guess, its gaps zero where a contact touches."""
        x, contacts = self.transcription.ocp.state_guess(time).copy(), len(self.motion.contacts)
        moving = len(self.motion.robot.configuration_names) + len(self.motion.robot.velocity_names)
        x[:moving], first = self.moving(time)[:moving], moving + 1
        x[first : first + contacts] = np.maximum(self._evaluated(x)[4].ravel(), 0.0)
        x[first : first + contacts][self.touching[interval]] = 0.0
        return x

    def _forces(self, interval: int) -> tuple[np.ndarray, np.ndarray]:
        """Return algebraic variables and control of an interval.

        Of M a = B u - h + J^T lambda the solution that is nearest to equal shares of the weight.
        """
        contacts, robot = self.motion.contacts, self.motion.robot
        n_q, n_v = len(robot.configuration_names), len(robot.velocity_names)
        begin, end = self._ends[interval : interval + 2]
        velocity = [self.moving(time)[n_q : n_q + n_v] for time in (begin, end)]
        mass, force, actuation, directions, _ = self._evaluated(self.moving((begin + end) / 2))
        width, touching = directions.shape[1] // len(contacts), np.flatnonzero(self.touching[interval])
        weight = self.motion.scales.force
        shares = np.zeros((len(contacts), width))
        shares[touching, 0] = weight / max(len(touching), 1)
        own = (touching[:, None] * width + np.arange(width)).ravel()
        needed = mass @ (velocity[1] - velocity[0]) / (end - begin) - force.ravel() - directions @ shares.ravel()
        found = np.linalg.lstsq(np.hstack([actuation, directions[:, own]]), needed, rcond=1e-9)[0]
        u, rest = found[: actuation.shape[1]], found[actuation.shape[1] :]
        forces = shares.copy()
        forces[touching] += rest.reshape(len(touching), width)
        forces[touching, 0] = np.clip(forces[touching, 0], LEAST_FORCE * weight, LARGEST_FORCE * weight)
        return self._variables.of(forces, np.append(u, 1.0))
