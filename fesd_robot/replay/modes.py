"""Rigid-body motion in prescribed contact modes, and the modes that Coulomb's law allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from fesd_robot.recovery.contact_rows import by_contact, cone_facets, normal_rows, tangential_rows
from fesd_robot.replay.dynamics import ContactDynamics
from fesd_robot.replay.headings import beginning_headings
from fesd_robot.replay.joints import joints_in_motion
from fesd_robot.replay.mode import ADMISSIBLE, ZERO_TANGENTIAL_VELOCITY, JointModes, Mode, Modes, scale_of
from fesd_robot.replay.splits import widest_split

_SINGULAR = 1e-10
"""Ratio of singular values, or normalised determinant, that counts as zero."""


@dataclass(frozen=True)
class ModeMotion:
    """The motion that a choice of modes means, and how well it obeys Coulomb's law.

    Attributes:
        modes: of every contact, (n_c).
        acceleration: a, (n_v).
        force: normal and tangential, N, (n_c, rows).
        margin: smallest distance to a bound of the forces, as a ratio of the largest force; negative where a contact
            pulls or leaves the friction cone.
        motion_margin: the same for accelerations: open contacts must part, slip must begin in its direction, and the
            constraints must hold.
        joints: modes of the joints with dry friction, (n_f), as the friction law chooses them in these modes.
        proper: whether the normal accelerations of the closed contacts grow with their normal forces: the matrix
            between them, W_nn - mu s W_nt with sticking tangents eliminated, is a P-matrix. In a mode that is not,
            forces act in the wrong sense (Painleve).
        headings: direction in which every contact slides that slides forwards, (n_c, n_t).
    """

    modes: Modes
    acceleration: np.ndarray
    force: np.ndarray
    margin: float
    motion_margin: float
    proper: bool
    joints: JointModes
    headings: np.ndarray

    @property
    def admissible(self) -> bool:
        """Whether Coulomb's law and unilateral contact allow the modes."""
        return min(self.margin, self.motion_margin) >= -ADMISSIBLE


def motion_in_modes(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Return acceleration (n_v) and contact forces (n_c, rows) in prescribed modes.

        M a + h + D v - B u = J^T f + tau_f
        closed: J_n a + (dJ_n/dt) v = 0;  stick: J_t a + (dJ_t/dt) v = 0;  slip: f_t = -mu s f_n e;  flight: f = 0

    with the directions e of `ContactDynamics.headings`.

    Where contacts are redundant, the acceleration is the only one, and the forces are a division between them that
    keeps to the friction cones if there is one.

    Args:
        dynamics: of the state, with the modes of its joints.
        modes: of every contact, (n_c).
    """
    forces, _, _ = _forces(dynamics, modes)
    return dynamics.acceleration + dynamics.response @ forces, by_contact(forces, dynamics.rows)


def acceleration_in_modes(dynamics: ContactDynamics, modes: Modes) -> np.ndarray:
    """Return the acceleration in prescribed modes, (n_v), as `motion_in_modes` does, without dividing the forces."""
    rows, spread = _constraints(dynamics, modes)
    solution = np.linalg.lstsq((dynamics.compliance @ spread)[rows], -dynamics.free[rows], rcond=_SINGULAR)[0]
    return np.asarray(dynamics.acceleration + dynamics.response @ (spread @ solution))


def force_margin(dynamics: ContactDynamics, modes: Modes) -> float:
    """Return `ModeMotion.margin` of prescribed modes; infinite in flight."""
    return _forces(dynamics, modes)[1]


def rated_modes(dynamics: ContactDynamics, closed: np.ndarray) -> list[ModeMotion]:
    """Return every choice of modes for the closed contacts: admissible ones first, then proper ones.

    Of them those with the fewest slips come first, then those that keep farthest from a bound. A contact with a
    tangential velocity can only slip along it or part; contacts that are not closed are in flight.

    Args:
        dynamics: of the state, without dry friction of joints.
        closed: contacts that touch and have no normal velocity, (n_c) of bool.
    """
    if dynamics.rows > 2 and slips_are_proper(dynamics, closed):
        found = _pivoted(dynamics, closed)
        if found is not None:
            return [found]
    choices = [_rated(dynamics, modes, closed) for modes in product(*_options(dynamics, closed))]
    return sorted(choices, key=_plausibility)


def _pivoted(dynamics: ContactDynamics, closed: np.ndarray) -> ModeMotion | None:
    """Return admissible modes of contacts in space, found by pivoting; None if that leads nowhere.

    From the modes in which all closed contacts stay, every one that violates the law changes to the mode that the
    violation points to: one that pulls parts, one outside its friction cone slides, one that approaches stays. Where
    all slides are proper the motion in such modes is the only one, and it need not be compared with others.
    """
    stays = [options[0] for options in _options(dynamics, closed)]
    modes, seen = list(stays), set[Modes]()
    while tuple(modes) not in seen:
        seen.add(tuple(modes))
        motion = _rated(dynamics, tuple(modes), closed)
        if motion.admissible:
            return motion
        parting = normal_rows(dynamics.jacobian @ motion.acceleration + _drift(dynamics), dynamics.rows)
        for i in np.flatnonzero(closed).tolist():
            push, friction = motion.force[i, 0], float(np.linalg.norm(motion.force[i, 1:]))
            if modes[i] is Mode.FLIGHT:
                modes[i] = stays[i] if parting[i] < 0 else Mode.FLIGHT
            elif push < 0:
                modes[i] = Mode.FLIGHT
            elif modes[i] is Mode.STICK and friction > dynamics.friction[i] * push:
                modes[i] = Mode.SLIP_FORWARDS
    return None


def _drift(dynamics: ContactDynamics) -> np.ndarray:
    return np.asarray(dynamics.free - dynamics.jacobian @ dynamics.acceleration)


def admissible_modes(dynamics: ContactDynamics, closed: np.ndarray) -> list[ModeMotion]:
    """Return the modes that Coulomb's law with unilateral contact allows, proper ones first.

    A contact in flight must not approach (J_n a + (dJ_n/dt) v >= 0), a closed one must not pull (f_n >= 0), a sticking
    one keeps |f_t| <= mu f_n, and one that begins to slip moves along its direction.

    Args:
        dynamics, closed: as in `rated_modes`.

    Source: Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts (1996), chapter 6.
    """
    return [choice for choice in rated_modes(dynamics, closed) if choice.admissible]


def _plausibility(motion: ModeMotion) -> tuple[bool, bool, int, float]:
    distance = motion.margin if motion.admissible else min(motion.margin, motion.motion_margin)
    return not motion.admissible, not motion.proper, sum(abs(mode.direction) for mode in motion.modes), -distance


def _options(dynamics: ContactDynamics, closed: np.ndarray) -> Iterator[Sequence[Mode]]:
    in_space, velocities = dynamics.rows > 2, tangential_rows(dynamics.velocity, dynamics.rows)
    for touches, mu, velocity in zip(closed, dynamics.friction, velocities, strict=True):
        slides = float(np.linalg.norm(velocity)) > ZERO_TANGENTIAL_VELOCITY
        if not touches:
            yield (Mode.FLIGHT,)
        elif mu == 0 or (slides and (in_space or velocity[0] > 0)):
            yield (Mode.SLIP_FORWARDS, Mode.FLIGHT)
        elif slides:
            yield (Mode.SLIP_BACKWARDS, Mode.FLIGHT)
        elif in_space:
            yield (Mode.STICK, Mode.SLIP_FORWARDS, Mode.FLIGHT)
        else:
            yield (Mode.STICK, Mode.SLIP_FORWARDS, Mode.SLIP_BACKWARDS, Mode.FLIGHT)


def _constraints(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Rows of J that are held, (m), and how m unknown forces are spread on the rows of J, (rows n_c, m)."""
    rows: list[int] = []
    columns: list[np.ndarray] = []
    size, unit = dynamics.rows, np.eye(dynamics.rows * len(modes))
    for i, mode in enumerate(modes):
        if mode is Mode.FLIGHT:
            continue
        normal, tangents = size * i, range(size * i + 1, size * (i + 1))
        rows.append(normal)
        columns.append(slip_direction(dynamics, i, mode))
        if mode is Mode.STICK:
            rows += tangents
            columns += [unit[row] for row in tangents]
    return np.array(rows, dtype=int), np.array(columns).reshape(len(rows), size * len(modes)).T


def slip_direction(dynamics: ContactDynamics, contact: int, mode: Mode) -> np.ndarray:
    """Return how a unit of normal force acts on the rows, (rows n_c): on the normal, and against a slip."""
    size = dynamics.rows
    direction = np.zeros(size * len(dynamics.friction))
    direction[size * contact] = 1.0
    along = slice(size * contact + 1, size * (contact + 1))
    direction[along] = -dynamics.friction[contact] * mode.direction * dynamics.headings[contact]
    return direction


def _forces(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, float, float]:
    """Stacked forces (rows n_c), their margin, and by how much the constraints fail relative to the accelerations."""
    rows, spread = _constraints(dynamics, modes)
    if not rows.size:
        return np.zeros(len(dynamics.free)), np.inf, 0.0
    matrix, wanted = (dynamics.compliance @ spread)[rows], -dynamics.free[rows]
    solution, _, rank, _ = np.linalg.lstsq(matrix, wanted, rcond=_SINGULAR)
    if rank < len(rows):
        bounds = _bounds(dynamics, modes, spread)
        solution = widest_split(solution, dynamics.jacobian.T @ spread, bounds, np.zeros(len(bounds)))
    unmet = float(np.abs(matrix @ solution - wanted).max()) / scale_of(dynamics.free)
    forces = spread @ solution
    return forces, _least_room(dynamics, modes, forces) / scale_of(solution), unmet


def _least_room(dynamics: ContactDynamics, modes: Modes, forces: np.ndarray) -> float:
    """Smallest of what must not be negative: f_n of closed contacts, mu f_n - |f_t| of sticking ones."""
    least = np.inf
    for force, mu, mode in zip(by_contact(forces, dynamics.rows), dynamics.friction, modes, strict=True):
        if mode is Mode.STICK:
            least = min(least, float(mu * force[0] - np.linalg.norm(force[1:])))
        if mode is not Mode.FLIGHT:
            least = min(least, float(force[0]))
    return least


def _bounds(dynamics: ContactDynamics, modes: Modes, spread: np.ndarray) -> np.ndarray:
    """Rows of what must not be negative: f_n of closed contacts, and the facets of the cones of sticking ones."""
    rows: list[np.ndarray] = []
    facets = cone_facets(dynamics.rows - 1)
    for i, mode in enumerate(modes):
        own = spread[dynamics.rows * i : dynamics.rows * (i + 1)]
        if mode is Mode.STICK:
            rows += [dynamics.friction[i] * own[0] - facet @ own[1:] for facet in facets]
        if mode is not Mode.FLIGHT:
            rows.append(own[0])
    return np.array(rows)


def _rated(without: ContactDynamics, modes: Modes, closed: np.ndarray) -> ModeMotion:
    starting = [
        i
        for i, mode in enumerate(modes)
        if mode.direction and without.rows > 2 and without.friction[i] > 0 and not _slides(without, i)
    ]
    without = with_beginning_headings(without, modes, starting)
    chosen = joints_in_motion(without, lambda dynamics: _forces(dynamics, modes)[0])
    dynamics = chosen.dynamics
    forces, margin, unmet = _forces(dynamics, modes)
    following = dynamics.free + dynamics.compliance @ forces
    parting, drifting = normal_rows(following, dynamics.rows), tangential_rows(following, dynamics.rows)
    needed = [-unmet]
    for i in np.flatnonzero(closed).tolist():
        if modes[i] is Mode.FLIGHT:
            needed.append(parting[i] / scale_of(dynamics.free))
        elif dynamics.friction[i] > 0 and not _slides(dynamics, i):
            needed.append(_beginning(dynamics, i, modes[i], drifting[i]))
    return ModeMotion(
        modes=modes,
        acceleration=dynamics.acceleration + dynamics.response @ forces,
        force=by_contact(forces, dynamics.rows),
        margin=min(margin, chosen.margin),
        motion_margin=float(min(*needed, chosen.motion_margin)),
        proper=is_proper(dynamics, modes),
        joints=chosen.modes,
        headings=dynamics.headings,
    )


def _beginning(dynamics: ContactDynamics, contact: int, mode: Mode, acceleration: np.ndarray) -> float:
    """Return the acceleration along its slide of a contact that begins to, as a ratio; -1 without a direction."""
    heading = dynamics.headings[contact]
    if mode.direction and not heading.any():
        return -1.0
    return mode.direction * float(heading @ acceleration) / scale_of(dynamics.free)


def _slides(dynamics: ContactDynamics, contact: int) -> bool:
    velocity = tangential_rows(dynamics.velocity, dynamics.rows)[contact]
    return float(np.linalg.norm(velocity)) > ZERO_TANGENTIAL_VELOCITY


def with_beginning_headings(dynamics: ContactDynamics, modes: Modes, starting: Sequence[int]) -> ContactDynamics:
    """Return the dynamics with directions of the contacts in space that begin to slide: see `beginning_headings`.

    Args:
        dynamics: of the state.
        modes: of every contact, (n_c).
        starting: numbers of those that begin to slide.
    """
    if not starting:
        return dynamics
    held = tuple(Mode.STICK if i in starting else mode for i, mode in enumerate(modes))
    pulls = -tangential_rows(_forces(dynamics, held)[0], dynamics.rows)

    def drift(headings: np.ndarray) -> np.ndarray:
        forces, _, _ = _forces(replace(dynamics, headings=headings), modes)
        return tangential_rows(dynamics.free + dynamics.compliance @ forces, dynamics.rows)

    return replace(dynamics, headings=beginning_headings(drift, pulls, dynamics.headings, starting))


def is_proper(dynamics: ContactDynamics, modes: Modes) -> bool:
    """Return `ModeMotion.proper` of prescribed modes: no principal minor of W_nn - mu s W_nt is negative.

    For one slipping contact this is W_nn - mu s W_nt > 0. Redundant contacts make minors zero, which is allowed.

    Source: Genot and Brogliato, New results on Painleve paradoxes, European Journal of Mechanics A 18 (1999).
    """
    closed = [i for i, mode in enumerate(modes) if mode is not Mode.FLIGHT]
    if not any(modes[i].direction for i in closed):
        return True
    size, w = dynamics.rows, dynamics.compliance
    normal = [size * i for i in closed]
    sticking = [row for i in closed if modes[i] is Mode.STICK for row in range(size * i + 1, size * (i + 1))]
    columns = np.column_stack([w @ slip_direction(dynamics, i, modes[i]) for i in closed])
    held = np.linalg.pinv(w[np.ix_(sticking, sticking)], rcond=_SINGULAR, hermitian=True)
    matrix = columns[normal] - w[np.ix_(normal, sticking)] @ held @ columns[sticking]
    size = np.sqrt(w[normal, normal])
    matrix = matrix / np.outer(size, size)
    return all(
        np.linalg.det(matrix[np.ix_(part, part)]) > -_SINGULAR
        for count in range(1, len(closed) + 1)
        for part in map(list, combinations(range(len(closed)), count))
    )


def slips_are_proper(dynamics: ContactDynamics, closed: np.ndarray) -> bool:
    """Return whether all closed contacts may slip in any directions without a mode that is not proper.

    Then the accelerations of a state are the only ones; else sticking and parting may both be possible.

    Args:
        dynamics, closed: as in `rated_modes`.
    """
    if dynamics.rows > 2:
        return is_proper(*_in_worst_directions(dynamics, closed))
    slips = (Mode.SLIP_FORWARDS, Mode.SLIP_BACKWARDS)
    return all(is_proper(dynamics, modes) for modes in product(*(slips if on else (Mode.FLIGHT,) for on in closed)))


def _in_worst_directions(dynamics: ContactDynamics, closed: np.ndarray) -> tuple[ContactDynamics, Modes]:
    """Return every closed contact sliding in the direction in which friction presses it into the ground most."""
    size = dynamics.rows
    coupling = [dynamics.compliance[size * i, size * i + 1 : size * (i + 1)] for i in range(len(closed))]
    modes = tuple(Mode.SLIP_FORWARDS if on else Mode.FLIGHT for on in closed)
    size_of = np.maximum(np.linalg.norm(coupling, axis=1, keepdims=True), 1e-300)
    return replace(dynamics, headings=np.array(coupling) / size_of), modes
