"""A point mass over the ground, and motions of it whose finite elements are exact polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.contact import Contact, ContactOptions, ContactSystem, MultibodyDynamics, StepOptions, contact_system
from fesd_robot.fesd import Element, FesdOptions, OptimalControlProblem, Tableau, Transcription, make_tableau
from fesd_robot.fesd.polishing import conditions_of, read_branch

GRAVITY, FRICTION, AUXILIARY_FORCE = 10.0, 0.3, 100.0
RADAU = make_tableau("radau_iia", 2)

FORMS = {
    "multipliers": ContactOptions(form="multipliers", auxiliary_force=AUXILIARY_FORCE),
    "steps": ContactOptions(form="steps", auxiliary_force=AUXILIARY_FORCE),
    "steps, no gate": ContactOptions(form="steps", steps=StepOptions(gate=False), auxiliary_force=AUXILIARY_FORCE),
    "steps, true gap": ContactOptions(form="steps", steps=StepOptions(gap="true"), auxiliary_force=AUXILIARY_FORCE),
    "steps, published": ContactOptions(
        form="steps", steps=StepOptions(gap="true", gate=False), auxiliary_force=AUXILIARY_FORCE
    ),
}


def point_mass(friction: float = FRICTION) -> tuple[MultibodyDynamics, list[Contact]]:
    """m = 1, q = (x, z), v = (x', z'), no control; the ground is z = 0."""
    q, v, none = ca.SX.sym("q", 2), ca.SX.sym("v", 2), ca.SX.sym("u", 0)
    dynamics = MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=none,
        configuration_derivative=v,
        mass_matrix=ca.SX.eye(2),
        force=ca.SX(ca.DM([0.0, -GRAVITY])),
        configuration_names=["x", "z"],
        velocity_names=["x", "z"],
        control_names=[],
    )
    contact = Contact("foot", q[1], ca.SX(ca.DM([0.0, 1.0])), ca.SX(ca.DM([1.0, 0.0])), friction)
    return dynamics, [contact]


def two_contacts() -> tuple[MultibodyDynamics, list[Contact]]:
    """The same with a wall behind it at x = 0, which has no friction."""
    dynamics, (ground,) = point_mass()
    x = dynamics.configuration[0]
    wall = Contact("wall", x, ca.SX(ca.DM([1.0, 0.0])), ca.SX(ca.DM([0.0, 1.0])), 0.0)
    return dynamics, [ground, wall]


@dataclass
class Motion:
    """Elements one after the other, each with constant Filippov multipliers, starting from `state` (x, z, x', z', t).

    The state is then a polynomial of degree two in numerical time, which two stages represent exactly.
    """

    options: ContactOptions
    state: np.ndarray
    tableau: Tableau = RADAU
    elements: list[Element] = field(default_factory=list)
    time: float = 0.0
    interval: int = 0
    friction: float = FRICTION

    def add(self, duration: float, plus: float = 0.0, minus: float = 0.0, *, settled: bool = False) -> None:
        """Append an element; `settled` puts the velocity exactly at zero where it ends up at round-off."""
        left = self.state
        free = 1.0 - plus - minus
        slope = np.array(
            [AUXILIARY_FORCE * self.friction * (minus - plus), AUXILIARY_FORCE * (plus + minus) - GRAVITY * free]
        )

        def at(tau: float) -> np.ndarray:
            position = left[:2] + free * (left[2:4] * tau + 0.5 * slope * tau**2)
            return np.concatenate([position, left[2:4] + slope * tau, [left[4] + free * tau]])

        fractions = self.tableau.c if self.tableau.ends_at_stage else np.append(self.tableau.c, 1.0)
        states = [at(duration * fraction) for fraction in fractions]
        if settled:
            states[-1][np.abs(states[-1]) < 1e-12] = 0.0
        before = self.elements[-1] if self.elements else None
        points = [self._with_gap(state) for state in states]
        multipliers = [(plus, minus)] * len(points)
        self.elements.append(
            Element(
                interval=self.interval,
                start=self.time,
                step=duration,
                x_left=self._with_gap(left),
                z_left=before.z[-1] if before else self.algebraic(left, plus, minus),
                x=np.array(points),
                z=np.array([self.algebraic(s, *both) for s, both in zip(states, multipliers, strict=True)]),
                u=np.ones(1),
                slopes=np.zeros((self.tableau.stages, len(points[0]))),
            )
        )
        self.state = states[-1]
        self.time += duration

    def _with_gap(self, state: np.ndarray) -> np.ndarray:
        return np.append(state, state[1]) if self.options.steps.gap == "integrated" else state

    def algebraic(self, state: np.ndarray, plus: float, minus: float) -> np.ndarray:
        """The algebraic variables that belong to a state and to the multipliers theta_+ and theta_-."""
        if self.options.form == "multipliers":
            return np.array([plus, minus, 1 - plus - minus] if self.friction > 0 else [plus])
        beta = plus + minus
        x_speed, z_speed = state[2:4]
        flying = float(beta == 0 and state[1] >= 0)
        gate = 1 - flying if self.options.steps.gate else 1.0
        sliding = plus / beta if beta > 0 else float(x_speed > 0)
        parting = 1 - beta if flying == 0 else float(z_speed > 0)
        if flying and self.options.steps.gate:
            parting = 0.5
        steps = 3 if self.friction > 0 else 2
        c = np.array([state[1], gate * z_speed, gate * x_speed])[:steps]
        alpha = np.array([flying, parting, sliding])[:steps]
        return np.concatenate([alpha, np.maximum(-c, 0), np.maximum(c, 0), [(1 - flying) * (1 - parting)]])

    def system(self) -> ContactSystem:
        """The contact system that the motion is one of."""
        return contact_system(*point_mass(self.friction), self.options)

    def transcription(self, mode: str | None = None) -> Transcription:
        """The problem of finding the motion with as many elements in as many intervals, without cost."""
        counts = [sum(e.interval == k for e in self.elements) for k in range(self.interval + 1)]
        if mode is None:
            mode = "theta_sum" if self.options.form == "multipliers" else "lambda_sum"
        system = self.system()
        n = system.system.state.numel()
        lower, free, ones = np.full(n, -np.inf), np.full(n, np.inf), np.ones((1, len(counts)))
        if system.integrated_gap:
            lower[-1] = system.gap_lower
        start = self.elements[0].x_left
        longest = max(element.step for element in self.elements)
        ocp = OptimalControlProblem(
            system=system.system,
            duration=self.time,
            intervals=len(counts),
            parameters=np.zeros((0, len(counts))),
            initial_lower=start,
            initial_upper=start,
            state_lower=lower,
            state_upper=free,
            terminal_lower=-free,
            terminal_upper=free,
            control_lower=ones[:, 0],
            control_upper=ones[:, 0],
            state_guess=lambda _: start,
            control_guess=ones,
        )
        return Transcription(
            ocp,
            FesdOptions(
                tableau=self.tableau,
                elements=tuple(counts),
                cross_complementarity=mode,  # type: ignore[arg-type]
                step_equilibration="none",
                step_freedom=longest * sum(counts) / self.time,
            ),
        )

    def vector(self) -> np.ndarray:
        """The motion as a point of its problem."""
        parts = [self.elements[0].x_left, self.elements[0].z_left]
        interval = -1
        for element in self.elements:
            if element.interval != interval:
                parts.append(element.u)
                interval = element.interval
            parts.append(np.array([element.step]))
            parts += [both for x, z in zip(element.x, element.z, strict=True) for both in (x, z)]
        return np.concatenate(parts)


def branch_of(system: ContactSystem, elements: Sequence[Element]) -> Branch:
    """The branch of elements one after the other, in which no flight is too low and no element too short to count."""
    return read_branch(conditions_of(system.system), elements, np.zeros(len(elements)), 0.0)


def landing(options: ContactOptions, start: Sequence[float] = (0, 1, 4, 0, 0), stance: float = 0.2) -> Motion:
    """The point mass of benchmark (i) 3: flight, inelastic impact with friction, sliding stance.

    z falls to 0 at √(2 z0 / g) with velocity -√20 for z0 = 1; the clock then stands still for √20 / a_n, and in stance
    it runs at the rate γ = a_n / (a_n + g).
    """
    motion = Motion(options, np.array(start, dtype=float))
    z, z_speed = motion.state[[1, 3]]
    fall = (z_speed + np.sqrt(z_speed**2 + 2 * GRAVITY * z)) / GRAVITY
    motion.add(fall, settled=True)
    motion.add(-motion.state[3] / AUXILIARY_FORCE, plus=1.0, settled=True)
    motion.add(stance, plus=GRAVITY / (AUXILIARY_FORCE + GRAVITY), settled=True)
    return motion
