"""Rigid-body motion in prescribed contact modes, and the modes that Coulomb's law allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import SINGULAR
from fesd_robot.recovery import by_contact, cone_facets, normal_rows, tangential_rows
from fesd_robot.replay.beginning import may_begin
from fesd_robot.replay.dynamics import ContactDynamics
from fesd_robot.replay.headings import beginning_headings
from fesd_robot.replay.joints import joints_in_motion
from fesd_robot.replay.mode_motion import ADMISSIBLE, ZERO_TANGENTIAL_VELOCITY, ModeMotion, scale_of
from fesd_robot.replay.pivoting import pivoted
from fesd_robot.replay.splits import widest_split

_SOFT = 1e4
"""Compliance of contacts along their tangents, as a ratio of the one along their normals, where they are redundant."""

_PLANES = 30
"""At most, that are added to a friction cone."""

_MOVED = 1e-6
"""Acceleration by forces that hold nothing, as a ratio of that by others, from which they move anything."""


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
    solution, _ = _held(dynamics, rows, (dynamics.compliance @ spread)[rows])
    return np.asarray(dynamics.acceleration + dynamics.response @ (spread @ solution))


def force_margin(dynamics: ContactDynamics, modes: Modes) -> float:
    """Return `ModeMotion.margin` of prescribed modes; infinite in flight."""
    return _forces(dynamics, modes)[1]


def rated_modes(dynamics: ContactDynamics, closed: np.ndarray, left: Modes | None = None) -> list[ModeMotion]:
    """Return every choice of modes for the closed contacts: admissible ones first, then proper ones.

    Admissible is what Coulomb's law with unilateral contact allows: a contact in flight must not approach
    (J_n a + (dJ_n/dt) v >= 0), a closed one must not pull (f_n >= 0), a sticking one keeps |f_t| <= mu f_n, and one
    that begins to slip moves along its direction.

    Of them those with the fewest slips come first, then those that keep farthest from a bound. A contact with a
    tangential velocity can only slip along it or part; contacts that are not closed are in flight. In space, where all
    slides are proper, only the choice that pivoting finds is returned.

    Args:
        dynamics: of the state, without dry friction of joints.
        closed: contacts that touch and have no normal velocity, (n_c) of bool.
        left: modes that have just ceased to be possible, which are left out; they may be admissible still, by less
            than `ADMISSIBLE`.

    Source: Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts (1996), chapter 6.
    """
    if dynamics.rows > 2 and slips_are_proper(dynamics, closed):
        stays = tuple(options[0] for options in _options(dynamics, closed))
        found = pivoted(
            dynamics, closed, stays, left, lambda with_headings, modes: _rated(with_headings, modes, closed)
        )
        if found is not None:
            return [found]
    options = list(product(*_options(dynamics, closed)))
    allowed = [modes for modes in options if modes != left or len(options) == 1]
    likely = [modes for modes in allowed if _may_begin(dynamics, modes)]
    choices = [_rated(dynamics, modes, closed) for modes in likely]
    if not any(choice.admissible for choice in choices):
        choices += [_rated(dynamics, modes, closed) for modes in allowed if modes not in likely]
    return sorted(choices, key=_plausibility)


def _may_begin(dynamics: ContactDynamics, modes: Modes) -> bool:
    starting = _starting(dynamics, modes)
    if not starting or len(dynamics.joints.rows):
        return True
    headings = dynamics.headings.copy()
    headings[starting] = 0.0
    return may_begin(dynamics, modes, starting, *_constraints(replace(dynamics, headings=headings), modes))


def _starting(dynamics: ContactDynamics, modes: Modes) -> list[int]:
    """Return the contacts in space that begin to slide in given modes, against friction."""
    return [
        i
        for i, mode in enumerate(modes)
        if mode.direction and dynamics.rows > 2 and dynamics.friction[i] > 0 and not _slides(dynamics, i)
    ]


def _plausibility(motion: ModeMotion) -> tuple[bool, bool, int, float]:
    distance = motion.margin if motion.admissible else min(motion.margin, motion.motion_margin)
    return not motion.admissible, not motion.proper, sum(abs(mode.direction) for mode in motion.modes), -distance


def _options(dynamics: ContactDynamics, closed: np.ndarray) -> Iterator[Sequence[ContactMode]]:
    in_space, velocities = dynamics.rows > 2, tangential_rows(dynamics.velocity, dynamics.rows)
    for touches, mu, velocity in zip(closed, dynamics.friction, velocities, strict=True):
        slides = float(np.linalg.norm(velocity)) > ZERO_TANGENTIAL_VELOCITY
        if not touches:
            yield (ContactMode.FLIGHT,)
        elif mu == 0 or (slides and in_space):
            yield (ContactMode.SLIP, ContactMode.FLIGHT)
        elif slides:
            yield (ContactMode.SLIP_FORWARDS if velocity[0] > 0 else ContactMode.SLIP_BACKWARDS, ContactMode.FLIGHT)
        elif in_space:
            yield (ContactMode.STICK, ContactMode.SLIP, ContactMode.FLIGHT)
        else:
            yield (ContactMode.STICK, ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS, ContactMode.FLIGHT)


def _constraints(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of J that are held, (m), and how m unknown forces are spread on the rows of J, (rows n_c, m)."""
    rows: list[int] = []
    columns: list[np.ndarray] = []
    size, unit = dynamics.rows, np.eye(dynamics.rows * len(modes))
    for i, mode in enumerate(modes):
        if mode is ContactMode.FLIGHT:
            continue
        normal, tangents = size * i, range(size * i + 1, size * (i + 1))
        rows.append(normal)
        columns.append(slip_direction(dynamics, i, mode))
        if mode is ContactMode.STICK:
            rows += tangents
            columns += [unit[row] for row in tangents]
    return np.array(rows, dtype=int), np.array(columns).reshape(len(rows), size * len(modes)).T


def slip_direction(dynamics: ContactDynamics, contact: int, mode: ContactMode) -> np.ndarray:
    """Return how a unit of normal force acts on the rows, (rows n_c): on the normal, and against a slip."""
    size = dynamics.rows
    direction = np.zeros(size * len(dynamics.friction))
    direction[size * contact] = 1.0
    along = slice(size * contact + 1, size * (contact + 1))
    direction[along] = -dynamics.friction[contact] * mode.direction * dynamics.headings[contact]
    return direction


def _forces(dynamics: ContactDynamics, modes: Modes) -> tuple[np.ndarray, float, float]:
    """Return stacked forces (rows n_c), their margin, and the error of the constraints relative to accelerations."""
    rows, spread = _constraints(dynamics, modes)
    if not rows.size:
        return np.zeros(len(dynamics.free)), np.inf, 0.0
    matrix = (dynamics.compliance @ spread)[rows]
    solution, rank = _held(dynamics, rows, matrix)
    if rank < len(rows):
        solution = _divided(dynamics, modes, spread, solution)
    unmet = float(np.abs(matrix @ solution + dynamics.free[rows]).max()) / scale_of(dynamics.free)
    forces = spread @ solution
    return forces, _least_room(dynamics, modes, forces) / scale_of(solution), unmet


def _held(dynamics: ContactDynamics, rows: np.ndarray, matrix: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the forces, (m), that hold rows of J, (m), and the rank.

    Redundant ones have least norm in the plane. In space, where with friction even the acceleration may depend on how
    they share a load, they share it like springs of vanishing compliance eps C, softer along the tangents,

        (A + eps C) f = -free  for eps -> 0:   A f = -free,  U^T C f = 0,  U^T A = 0

    so that the pressure on the corners of a box is linear over its base, and none of it hangs on friction at its side.

    Args:
        matrix: A, acceleration of the rows by these forces, (m, m).
    """
    wanted = -dynamics.free[rows]
    if dynamics.rows == 2:
        solution, _, rank, _ = np.linalg.lstsq(matrix, wanted, rcond=SINGULAR)
        return solution, int(rank)
    left, sizes, right = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(sizes > SINGULAR * sizes[0]))
    solution = right[:rank].T @ ((wanted @ left[:, :rank]) / sizes[:rank])
    if rank < len(rows):
        stretched = left[:, rank:].T * np.where(rows % dynamics.rows == 0, 1.0, _SOFT)
        free = right[rank:].T
        solution = solution - free @ np.linalg.lstsq(stretched @ free, stretched @ solution, rcond=SINGULAR)[0]
    return solution, rank


def _least_room(dynamics: ContactDynamics, modes: Modes, forces: np.ndarray) -> float:
    """Return the smallest nonnegative value: f_n of closed contacts, mu f_n - |f_t| of sticking ones."""
    least = np.inf
    for force, mu, mode in zip(by_contact(forces, dynamics.rows), dynamics.friction, modes, strict=True):
        if mode is ContactMode.STICK:
            least = min(least, float(mu * force[0] - np.linalg.norm(force[1:])))
        if mode is not ContactMode.FLIGHT:
            least = min(least, float(force[0]))
    return least


def _divided(dynamics: ContactDynamics, modes: Modes, spread: np.ndarray, solution: np.ndarray) -> np.ndarray:
    """Return forces, (m), with the resultant of others that keep to the friction cones if any do.

    In space every cone is bounded by planes, and by one more through the force that leaves it, until none does or no
    division is inside all planes.
    """
    directions, bounds = dynamics.jacobian.T @ spread, _bounds(dynamics, modes, spread)
    if dynamics.rows == 2:
        return widest_split(solution, directions, bounds, np.zeros(len(bounds)))
    for _ in range(_PLANES):
        forces = spread @ solution
        if _least_room(dynamics, modes, forces) >= 0:
            break
        bounds = np.vstack([bounds, *_touching(dynamics, modes, spread, forces)])
        solution = widest_split(solution, directions, bounds, np.zeros(len(bounds)))
        if (bounds @ solution).min() < 0:
            break
    return solution


def _bounds(dynamics: ContactDynamics, modes: Modes, spread: np.ndarray) -> np.ndarray:
    """Return rows of nonnegative values: f_n of closed contacts, planes that touch the cones of sticking ones."""
    rows: list[np.ndarray] = []
    facets = cone_facets(dynamics.rows - 1)
    for i, mode in enumerate(modes):
        own = spread[dynamics.rows * i : dynamics.rows * (i + 1)]
        if mode is ContactMode.STICK:
            rows += [dynamics.friction[i] * own[0] - facet @ own[1:] / np.linalg.norm(facet) for facet in facets]
        if mode is not ContactMode.FLIGHT:
            rows.append(own[0])
    return np.array(rows)


def _touching(dynamics: ContactDynamics, modes: Modes, spread: np.ndarray, forces: np.ndarray) -> list[np.ndarray]:
    """Return the rows of planes that touch the cones of sticking contacts beside their forces."""
    rows = list[np.ndarray]()
    for i, force in enumerate(by_contact(forces, dynamics.rows)):
        size = float(np.linalg.norm(force[1:]))
        if modes[i] is ContactMode.STICK and size > 0:
            own = spread[dynamics.rows * i : dynamics.rows * (i + 1)]
            rows.append(dynamics.friction[i] * own[0] - (force[1:] / size) @ own[1:])
    return rows


def _rated(without: ContactDynamics, modes: Modes, closed: np.ndarray) -> ModeMotion:
    without = with_beginning_headings(without, modes, _starting(without, modes))
    chosen = joints_in_motion(without, lambda dynamics: _forces(dynamics, modes)[0])
    dynamics = chosen.dynamics
    forces, margin, unmet = _forces(dynamics, modes)
    following = dynamics.free + dynamics.compliance @ forces
    parting, drifting = normal_rows(following, dynamics.rows), tangential_rows(following, dynamics.rows)
    needed = [-unmet]
    for i in np.flatnonzero(closed).tolist():
        if modes[i] is ContactMode.FLIGHT:
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
        joint_headings=dynamics.joints.headings,
        shared_otherwise=margin > ADMISSIBLE and _loads_move(dynamics, modes),
    )


def _loads_move(dynamics: ContactDynamics, modes: Modes) -> bool:
    """Return whether forces that hold nothing accelerate anything: in space, where contacts are redundant and slide."""
    if dynamics.rows == 2 or not any(mode.direction for mode in modes):
        return False
    rows, spread = _constraints(dynamics, modes)
    _, sizes, right = np.linalg.svd((dynamics.compliance @ spread)[rows])
    free = spread @ right[np.count_nonzero(sizes > SINGULAR * sizes[0]) :].T
    return bool(np.abs(dynamics.response @ free).max(initial=0.0) > _MOVED * sizes[0])


def _beginning(dynamics: ContactDynamics, contact: int, mode: ContactMode, acceleration: np.ndarray) -> float:
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
    held = tuple(ContactMode.STICK if i in starting else mode for i, mode in enumerate(modes))
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
    closed = [i for i, mode in enumerate(modes) if mode is not ContactMode.FLIGHT]
    if not any(modes[i].direction for i in closed):
        return True
    size, w = dynamics.rows, dynamics.compliance
    normal = [size * i for i in closed]
    sticking = [row for i in closed if modes[i] is ContactMode.STICK for row in range(size * i + 1, size * (i + 1))]
    columns = np.column_stack([w @ slip_direction(dynamics, i, modes[i]) for i in closed])
    held = np.linalg.pinv(w[np.ix_(sticking, sticking)], rcond=SINGULAR, hermitian=True)
    matrix = columns[normal] - w[np.ix_(normal, sticking)] @ held @ columns[sticking]
    size = np.sqrt(w[normal, normal])
    matrix = matrix / np.outer(size, size)
    return all(
        np.linalg.det(matrix[np.ix_(part, part)]) > -SINGULAR
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
    slips = (ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS)
    return all(
        is_proper(dynamics, modes) for modes in product(*(slips if on else (ContactMode.FLIGHT,) for on in closed))
    )


def _in_worst_directions(dynamics: ContactDynamics, closed: np.ndarray) -> tuple[ContactDynamics, Modes]:
    """Return every closed contact sliding in the direction in which friction presses it into the ground most."""
    size = dynamics.rows
    coupling = [dynamics.compliance[size * i, size * i + 1 : size * (i + 1)] for i in range(len(closed))]
    modes = tuple(ContactMode.SLIP if on else ContactMode.FLIGHT for on in closed)
    size_of = np.maximum(np.linalg.norm(coupling, axis=1, keepdims=True), 1e-300)
    return replace(dynamics, headings=np.array(coupling) / size_of), modes
