"""A start on the contact sequence of the robot that is let go, for contacts that bounce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, Complementarity
from fesd_robot.contact import FRICTION_AFTER_IMPACT, ContactMode, Modes, factors_of
from fesd_robot.errors import SolverError
from fesd_robot.exactness import ROUNDED
from fesd_robot.fesd import Element, Transcription
from fesd_robot.fesd.neighbours import KnownTrajectory, on_grid
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import MpccSolution, Run
from fesd_robot.ocp import MotionProblem, numeric_physics
from fesd_robot.recovery import NumericPhysics
from fesd_robot.replay import contact_dynamics, motion_in_modes
from fesd_robot.simulation import ControlSchedule, Hit, Piece, SimulatedMotion
from fesd_robot.simulation.drive import drive
from fesd_robot.starts.force_variables import ForceVariables
from fesd_robot.starts.known import exact_start

_Factors = tuple[ActiveFactor, ...]


def needs_simulated_start(motion: MotionProblem) -> bool:
    """Return whether a motion is first looked for on the contact sequence of the robot that is let go.

    If a contact bounces, nothing but contacts switches, and impacts are elements in which the clock stands still.
    """
    labels = [one.label for one in motion.ocp.system.complementarities]
    bounces = any(contact.restitution > 0 for contact in motion.contacts)
    freezes = motion.ocp.system.jump is None
    return bounces and freezes and all(label.contact is not None for label in labels)


def simulated_start(
    motion: MotionProblem, transcription: Transcription, run: Run
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion with the contact sequence of the robot that is let go, without controls.

    It falls and bounces as it does by itself; the elements of that motion are cut at the ends of control intervals, and
    the branch NLP is solved from there. A homotopy has to find every bounce, and where it is, from a guess without any.
    Other starts (`solver.seed`) are simulated with constant controls, drawn at random within a tenth of their limits.

    Args:
        motion, transcription: the task.
        run: of all NLPs.

    Returns:
        None where that motion does not go on, or no exact motion is found from it.
    """
    physics, names = numeric_physics(motion), motion.actuation.names
    controls, seed = np.zeros(len(names)), motion.task.solver.seed
    if seed:
        share = 0.1 * np.random.default_rng(seed).uniform(-1.0, 1.0, len(names))
        limit = np.minimum(np.abs(motion.actuation.lower), np.abs(motion.actuation.upper))
        controls = share * np.where(np.isfinite(limit), limit, 0.0)
    schedule = ControlSchedule(np.array([0.0, motion.grid.nominal]), controls[None])
    ends = motion.endpoints
    try:
        driven = drive(physics, ends.initial_configuration, ends.initial_velocity, schedule)
    except SolverError:
        return None
    known = _Known(motion, transcription, physics, driven).elements()
    return exact_start(on_grid(known, transcription), run)


@dataclass(frozen=True)
class _Known:
    """The finite elements of a simulated motion: one for every step of the integrator, one for every impact."""

    motion: MotionProblem
    transcription: Transcription
    physics: NumericPhysics
    driven: SimulatedMotion

    def elements(self) -> KnownTrajectory:
        """Return them with their branch."""
        elements: list[Element] = []
        factors: list[_Factors] = []
        hits = list(self.driven.hits)
        for number, piece in enumerate(self.driven.pieces):
            while hits and hits[0].pieces <= number:
                self._add_impact(hits.pop(0), elements, factors)
            self._add_motion(piece, elements, factors)
        for hit in hits:
            self._add_impact(hit, elements, factors)
        labels = tuple(one.label for one in self._conditions)
        branch = Branch(labels, tuple(factors), (False,) * len(factors))
        return KnownTrajectory(elements, branch, self.transcription.options.tableau, self._clock)

    @cached_property
    def _conditions(self) -> list[Complementarity]:
        return [member.condition for member in BranchTranscription(self.transcription).conditions.members]

    @cached_property
    def _variables(self) -> ForceVariables:
        return ForceVariables(self.motion)

    @property
    def _fractions(self) -> np.ndarray:
        tableau = self.transcription.options.tableau
        return np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])

    def _state(self, time: float, q: np.ndarray, v: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """Return the state of the system; gaps of contacts that touch are zero, and so are slip distances."""
        x = np.zeros(self.transcription.ocp.system.state.numel())
        n, count = len(q) + len(v), self.motion.contact_system.gap_states
        x[: n + 1] = np.concatenate([q, v, [time]])
        x[n + 1 : n + 1 + count] = np.where(touching, 0.0, np.maximum(self.physics.gaps(q), 0.0))
        return x

    def _add_motion(self, piece: Piece, elements: list[Element], factors: list[_Factors]) -> None:
        modes, touching = piece.contacts.modes, piece.contacts.closed
        q, v = piece.state(0.5 * (piece.start + piece.end))
        force = motion_in_modes(contact_dynamics(self.physics, q, v, piece.control), modes)[1]
        times = piece.start + (piece.end - piece.start) * np.append(0.0, self._fractions)
        states = np.array([self._state(time, *piece.state(time), touching) for time in times])
        self._add(states, force, piece.control, piece.end - piece.start, elements)
        factors.append(self._of_modes(modes, piece.contacts.compliant))

    def _add_impact(self, hit: Hit, elements: list[Element], factors: list[_Factors]) -> None:
        impulse, a_n = hit.impact.impulse, self.motion.auxiliary_force
        part = impulse[:, 0] > ROUNDED * impulse[:, 0].max()
        if not impulse[:, 0].max() > 0:
            return
        touching = part | (self.physics.gaps(hit.configuration) <= 0.0)
        steps = np.append(0.0, self._fractions)[:, None]
        velocities = hit.before + steps * (hit.impact.velocity - hit.before)
        states = np.array([self._state(hit.time, hit.configuration, v, touching) for v in velocities])
        largest = np.maximum(impulse[:, :1], ROUNDED * impulse[:, 0].max())
        force = np.where(part[:, None], a_n * impulse / largest, 0.0)
        control = self.driven.pieces[min(hit.pieces, len(self.driven.pieces) - 1)].control
        self._add(states, force, control, float(impulse[:, 0].max()) / a_n, elements)
        rows = (self.physics.contact_jacobian(hit.configuration) @ velocities.T).reshape(
            len(part), self.physics.rows, -1
        )
        tangential = rows[:, 1] if self.physics.rows == 2 else np.linalg.norm(rows[:, 1:], axis=1)
        compliant = self.driven.pieces[max(min(hit.pieces, len(self.driven.pieces)) - 1, 0)].contacts.compliant
        factors.append(self._of_impact(part, tangential, compliant))

    def _add(
        self, states: np.ndarray, force: np.ndarray, control: np.ndarray, length: float, elements: list[Element]
    ) -> None:
        """Add an element: `length` is its physical time, or its numerical time where the clock stands still."""
        z, u = self._variables.of(force, np.append(control, 1.0))
        u[-1] = u[-1] if states[-1, self._clock] > states[0, self._clock] else 1.0
        start = elements[-1].end if elements else 0.0
        left = elements[-1].z[-1] if elements else z
        slopes = np.zeros((self.transcription.options.tableau.stages, states.shape[1]))
        repeated = np.tile(z, (len(states) - 1, 1))
        elements.append(Element(0, start, length, states[0], left, states[1:], repeated, u, slopes))

    @property
    def _clock(self) -> int:
        return len(self.motion.robot.configuration_names) + len(self.motion.robot.velocity_names)

    def _of_modes(self, modes: Modes, compliant: Modes) -> _Factors:
        """Return the active factors while the clock runs."""
        return factors_of(self._conditions, {**self._by_name(modes), **self._compliant(compliant)})

    def _of_impact(self, part: np.ndarray, tangential: np.ndarray, compliant: Modes) -> _Factors:
        """Return the active factors of an impact.

        Args:
            part: contacts that take part in it, (n_c) of bool.
            tangential: their velocities at the points of the element, in space the speeds, m/s, (n_c, points).
            compliant: modes of the compliant contacts, (n_s).
        """
        during, after = (
            self._by_name(
                [_hit(velocity) if on else ContactMode.FLIGHT for on, velocity in zip(part, own, strict=True)]
            )
            | self._compliant(compliant)
            for own in (tangential.mean(axis=1), tangential[:, -1])
        )
        return tuple(
            factor
            for one in self._conditions
            for factor in factors_of([one], after if one.label.kind == FRICTION_AFTER_IMPACT else during)
        )

    def _by_name(self, modes: Sequence[ContactMode]) -> dict[str, ContactMode]:
        return dict(zip((contact.name for contact in self.motion.contacts), modes, strict=True))

    def _compliant(self, modes: Modes) -> dict[str, ContactMode]:
        return dict(zip((contact.name for contact in self.motion.compliant), modes, strict=True))


def _hit(velocity: float) -> ContactMode:
    """Return the mode of an impact with a tangential velocity, m/s."""
    sides = {0: ContactMode.IMPACT_STICK, 1: ContactMode.IMPACT_FORWARDS, -1: ContactMode.IMPACT_BACKWARDS}
    return sides[int(np.sign(np.round(velocity, 9)))]
