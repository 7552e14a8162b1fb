"""Rigid-body motion in prescribed contact modes, and the modes that Coulomb's law allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from fesd_robot.recovery.contact_rows import by_contact, normal_rows, tangential_rows
from fesd_robot.replay.dynamics import ContactDynamics
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
        force: normal and tangential, N, (n_c, 2).
        margin: smallest distance to a bound of the forces, as a ratio of the largest force; negative where a contact
            pulls or leaves the friction cone.
        motion_margin: the same for accelerations: open contacts must part, slip must begin in its direction, and the
            constraints must hold.
        joints: modes of the joints with dry friction, (n_f), as the friction law chooses them in these modes.
        proper: whether the normal accelerations of the closed contacts grow with their normal forces: the matrix
            between them, W_nn - mu s W_nt with sticking tangents eliminated, is a P-matrix. In a mode that is not,
            forces act in the wrong sense (Painleve).
    """

    modes: Modes
    acceleration: np.ndarray
    force: np.ndarray
    margin: float
    motion_margin: float
    proper: bool
    joints: JointModes

    @property
    def admissible(self) -> bool:
        """Whether Coulomb's law and unilateral contact allow the modes."""
        return min(self.margin, self.motion_margin) >= -ADMISSIBLE


def motion_in_modes(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Return acceleration (n_v) and contact forces (n_c, 2) in prescribed modes.

        M a + h + D v - B u = J^T f + tau_f
        closed: J_n a + (dJ_n/dt) v = 0;  stick: J_t a + (dJ_t/dt) v = 0;  slip: f_t = -mu s f_n;  flight: f = 0

    Where contacts are redundant, the acceleration is the only one, and the forces are a division between them that
    keeps to the friction cones if there is one.

    Args:
        dynamics: of the state, with the modes of its joints.
        modes: of every contact, (n_c).
    """
    forces, _, _ = _forces(dynamics, modes)
    return dynamics.acceleration + dynamics.response @ forces, by_contact(forces)


def acceleration_in_modes(dynamics: ContactDynamics, modes: Modes) -> np.ndarray:
    """Return the acceleration in prescribed modes, (n_v), as `motion_in_modes` does, without dividing the forces."""
    rows, spread = _constraints(modes, dynamics.friction)
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
    choices = [_rated(dynamics, modes, closed) for modes in product(*_options(dynamics, closed))]
    return sorted(choices, key=_plausibility)


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
    for touches, mu, speed in zip(closed, dynamics.friction, tangential_rows(dynamics.velocity), strict=True):
        if not touches:
            yield (Mode.FLIGHT,)
        elif mu == 0 or speed > ZERO_TANGENTIAL_VELOCITY:
            yield (Mode.SLIP_FORWARDS, Mode.FLIGHT)
        elif speed < -ZERO_TANGENTIAL_VELOCITY:
            yield (Mode.SLIP_BACKWARDS, Mode.FLIGHT)
        else:
            yield (Mode.STICK, Mode.SLIP_FORWARDS, Mode.SLIP_BACKWARDS, Mode.FLIGHT)


def _constraints(modes: Modes, friction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of J that are held, (m), and how m unknown forces are spread on the rows of J, (2 n_c, m)."""
    rows: list[int] = []
    columns: list[np.ndarray] = []
    unit = np.eye(2 * len(modes))
    for i, mode in enumerate(modes):
        if mode is Mode.FLIGHT:
            continue
        rows.append(2 * i)
        columns.append(unit[2 * i] - friction[i] * mode.direction * unit[2 * i + 1])
        if mode is Mode.STICK:
            rows.append(2 * i + 1)
            columns.append(unit[2 * i + 1])
    return np.array(rows, dtype=int), np.array(columns).reshape(len(rows), 2 * len(modes)).T


def _forces(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, float, float]:
    """Stacked forces (2 n_c), their margin, and by how much the constraints fail relative to the accelerations."""
    rows, spread = _constraints(modes, dynamics.friction)
    if not rows.size:
        return np.zeros(len(dynamics.free)), np.inf, 0.0
    matrix, wanted = (dynamics.compliance @ spread)[rows], -dynamics.free[rows]
    solution, _, rank, _ = np.linalg.lstsq(matrix, wanted, rcond=_SINGULAR)
    bounds = _bounds(modes, dynamics.friction, spread)
    if rank < len(rows):
        solution = widest_split(solution, dynamics.jacobian.T @ spread, bounds, np.zeros(len(bounds)))
    unmet = float(np.abs(matrix @ solution - wanted).max()) / scale_of(dynamics.free)
    return spread @ solution, float((bounds @ solution).min()) / scale_of(solution), unmet


def _bounds(modes: Modes, friction: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Rows of what must not be negative: f_n of closed contacts, mu f_n - f_t and mu f_n + f_t of sticking ones."""
    rows: list[np.ndarray] = []
    for i, mode in enumerate(modes):
        normal, tangential = spread[2 * i], spread[2 * i + 1]
        if mode is Mode.STICK:
            rows += [friction[i] * normal - tangential, friction[i] * normal + tangential]
        if mode is not Mode.FLIGHT:
            rows.append(normal)
    return np.array(rows)


def _rated(without: ContactDynamics, modes: Modes, closed: np.ndarray) -> ModeMotion:
    chosen = joints_in_motion(without, lambda dynamics: _forces(dynamics, modes)[0])
    dynamics = chosen.dynamics
    forces, margin, unmet = _forces(dynamics, modes)
    following = dynamics.free + dynamics.compliance @ forces
    needed = [-unmet]
    for i in np.flatnonzero(closed):
        if modes[i] is Mode.FLIGHT:
            needed.append(normal_rows(following)[i] / scale_of(dynamics.free))
        elif dynamics.friction[i] > 0 and abs(tangential_rows(dynamics.velocity)[i]) <= ZERO_TANGENTIAL_VELOCITY:
            needed.append(modes[i].direction * tangential_rows(following)[i] / scale_of(dynamics.free))
    return ModeMotion(
        modes=modes,
        acceleration=dynamics.acceleration + dynamics.response @ forces,
        force=by_contact(forces),
        margin=min(margin, chosen.margin),
        motion_margin=float(min(*needed, chosen.motion_margin)),
        proper=is_proper(dynamics, modes),
        joints=chosen.modes,
    )


def is_proper(dynamics: ContactDynamics, modes: Modes) -> bool:
    """Return `ModeMotion.proper` of prescribed modes: no principal minor of W_nn - mu s W_nt is negative.

    For one slipping contact this is W_nn - mu s W_nt > 0. Redundant contacts make minors zero, which is allowed.

    Source: Genot and Brogliato, New results on Painleve paradoxes, European Journal of Mechanics A 18 (1999).
    """
    closed = [i for i, mode in enumerate(modes) if mode is not Mode.FLIGHT]
    if not any(modes[i].direction for i in closed):
        return True
    normal = [2 * i for i in closed]
    sticking = [2 * i + 1 for i in closed if modes[i] is Mode.STICK]
    w = dynamics.compliance
    columns = np.column_stack(
        [w[:, 2 * i] - dynamics.friction[i] * modes[i].direction * w[:, 2 * i + 1] for i in closed]
    )
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
    slips = (Mode.SLIP_FORWARDS, Mode.SLIP_BACKWARDS)
    return all(is_proper(dynamics, modes) for modes in product(*(slips if on else (Mode.FLIGHT,) for on in closed)))
