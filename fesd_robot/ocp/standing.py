"""Configurations in which contacts touch, by inverse kinematics, and those that postures give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar, cast

import casadi as ca
import numpy as np
from pydantic import ValidationError

from fesd_robot.contact import Contact
from fesd_robot.nlp import FREE, NlpSettings, ipopt_options
from fesd_robot.ocp.vectors import StateLimits, initial_configuration, limits_of, with_unit_entries, with_values
from fesd_robot.orientations import layered, turn_entries
from fesd_robot.robot import FLYER_HEIGHT, ROOT_HEIGHT, ROOT_PITCH, Robot, changes_alone
from fesd_robot.running import Identity
from fesd_robot.task import Configured, KeyPath, Task

GAP_TOLERANCE = 1e-9
"""m; a contact this close to what it touches stands on it."""

_CONVERGED = 1e-15
"""m; the search ends with gaps this small: they are rounding alone, and need no offset in the equations."""

_DECIMALS = 10
"""Of the coordinates found, m or rad, where these suffice."""

_MAX_STEPS = 200

_LEAST_DAMPING, _FIRST_DAMPING, _MOST_DAMPING = 1e-12, 1e-6, 1e10
"""Of the Levenberg-Marquardt steps, in units of the largest square of a column of the Jacobian."""

_UNDECIDED = 1e-6
"""Weight of the distance from where the search starts beside that of 1 from a preferred value."""

_SETTINGS = NlpSettings(FREE, tolerance=1e-10)

_DEFAULT_ADJUST = (ROOT_HEIGHT, ROOT_PITCH)
"""Coordinates adjusted by default: the first for one contact, both for several."""

Section = TypeVar("Section", bound=Configured)


@dataclass(frozen=True)
class Standing:
    """Contacts that touch at the start, at the goal or at a waypoint.

    Attributes:
        path: key path of the section that asks for it.
        contacts: names of the contacts.
        adjust: names of the configuration coordinates that are found so that these touch.
        prefer: name of a coordinate of these -> value that it should have, m or rad.
    """

    path: KeyPath
    contacts: Sequence[str]
    adjust: Sequence[str]
    prefer: Mapping[str, float]


def standings_of(task: Task, robot: Robot) -> list[Standing]:
    """Return every `stand_on` of a task, with its defaults.

    Raises:
        TaskError: coordinates to adjust that the robot does not have, or that are no length or angle.
    """
    standings = (_standing(task, robot, path, state) for path, state in task.states)
    return [standing for standing in standings if standing is not None]


def with_configurations(task: Task, robot: Robot, contacts: Sequence[Contact], configuration: ca.SX) -> Task:
    """Return the task with the configurations that its postures and `stand_on` give; these stay, and change no more.

    What a goal or waypoint leaves out is, while its contacts are brought to touch, as at the start.

    Args:
        task: with names and values that suit the robot.
        contacts: of the task.
        configuration: q, SX symbols (n_q) of their expressions.

    Raises:
        TaskError: contacts that cannot touch, or a tolerance of a coordinate that the section gives no value.
    """
    search = _Search(task, robot, contacts, configuration)
    initial = search.completed(("initial",), task.initial, initial_configuration(task, robot))
    task = task.model_copy(update={"initial": initial})
    start = initial_configuration(task, robot)
    goal = search.completed(("goal",), task.goal, start)
    waypoints = [search.completed(("waypoints", str(i)), each, start) for i, each in enumerate(task.waypoints)]
    return task.model_copy(update={"goal": goal, "waypoints": waypoints})


def posture_of(task: Task, robot: Robot, name: str | None) -> Mapping[str, float]:
    """Return the values of a posture by coordinate, the task's own before one of the model file; none without name."""
    if name is None:
        return {}
    return task.postures[name] if name in task.postures else robot.postures[name]


def touching_configuration(
    robot: Robot,
    contacts: Sequence[Contact],
    configuration: ca.SX,
    adjust: Sequence[str],
    start: np.ndarray,
    limits: StateLimits,
    within: float = GAP_TOLERANCE,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the configuration (n_q) in which contacts touch, or are nearest to it, and their gaps, m, (n_c).

    Levenberg-Marquardt steps on the gaps, projected onto the limits: of several such configurations the one that they
    lead to, and the start itself where the contacts touch in it.

    Args:
        contacts: that should touch.
        configuration: q, SX symbols (n_q) of their expressions.
        adjust: names of the coordinates that may change, lengths or angles.
        start: q where the search begins, (n_q).
        limits: of the positions, which the coordinates keep to.
        within: gaps with which the start itself is one, m.
    """
    function = _touching(robot, Identity(configuration, *contacts), tuple(adjust))
    lower, upper = _adjusted_limits(robot, adjust, limits)

    def at(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q = _with_adjusted(robot, adjust, start, values)
        gap, slope = function(q)
        return q, np.asarray(gap).ravel(), np.asarray(slope.full())

    values, damping = np.clip(_adjusted(robot, adjust, start), lower, upper), _FIRST_DAMPING
    q, gap, slope = at(values)
    if np.abs(gap).max() <= within:
        return q, gap
    for _ in range(_MAX_STEPS):
        if np.abs(gap).max() <= _CONVERGED or damping > _MOST_DAMPING:
            break
        trial = np.clip(values + _step(gap, slope, (values, lower, upper), damping), lower, upper)
        q_trial, gap_trial, slope_trial = at(trial)
        if gap_trial @ gap_trial < gap @ gap:
            values, q, gap, slope = trial, q_trial, gap_trial, slope_trial
            damping = max(damping / 10, _LEAST_DAMPING)
        else:
            damping *= 10
    rounded = at(np.clip(np.round(values, _DECIMALS) + 0.0, lower, upper))
    return rounded[:2] if np.abs(rounded[1]).max() <= within else (q, gap)


@lru_cache(maxsize=16)
def _touching(robot: Robot, parts: Identity, adjust: tuple[str, ...]) -> ca.Function:
    """Return q -> gaps, (n_c), and how they change with the coordinates that are adjusted, (n_c, n).

    Args:
        parts: q and the contacts.
    """
    configuration, *contacts = cast(tuple[Any, ...], parts.parts)
    gaps = ca.vertcat(*[contact.gap for contact in contacts])
    slopes, rates = ca.horzcat(*[contact.normal for contact in contacts]).T, list(robot.velocity_names)
    by_place = ca.jacobian(gaps, configuration)  # of a free flyer, whose velocity is in its own axes
    columns = [
        slopes[:, rates.index(name)] if name in rates else by_place[:, robot.configuration_names.index(name)]
        for name in adjust
    ]
    return ca.Function("touching", [configuration], [gaps, ca.horzcat(*columns)])


def preferred_configuration(
    robot: Robot,
    contacts: Sequence[Contact],
    configuration: ca.SX,
    standing: Standing,
    start: np.ndarray,
    limits: StateLimits,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the configuration (n_q) nearest to the preferred one in which contacts touch, and their gaps, m, (n_c).

        min  sum_{i preferred} (q_i - p_i)^2 + epsilon sum_{i adjusted} (q_i - start_i)^2   with   g_c(q) = 0

    within the limits, where epsilon decides what the preferences leave open; solved by IPOPT from where the contacts
    touch. If they cannot, that configuration is as `touching_configuration` says.

    Args:
        contacts: that should touch.
        configuration: q, SX symbols (n_q) of their expressions.
        standing: coordinates that may change, and preferences.
        start: q where the search begins, (n_q).
        limits: of the positions, which the coordinates keep to.
    """
    names = robot.configuration_names
    start = _with_adjusted(robot, list(standing.prefer), start, np.array(list(standing.prefer.values())))
    q, gaps = touching_configuration(robot, contacts, configuration, standing.adjust, start, limits)
    if not standing.prefer or np.abs(gaps).max() > GAP_TOLERANCE:
        return q, gaps
    adjust = standing.adjust
    free, weights = ca.SX.sym("adjusted", len(adjust)), [float(name in standing.prefer) for name in standing.adjust]
    whole = ca.SX(ca.DM(q))
    for name, value in zip(adjust, ca.vertsplit(free), strict=True):
        whole[_entries(names, name)] = ca.vertcat(*([value] if name in names else [ca.cos(value), ca.sin(value)]))
    distances = ca.DM(np.array(weights) + _UNDECIDED) * (free - ca.DM(_adjusted(robot, adjust, start))) ** 2
    touching = ca.substitute(ca.vertcat(*[contact.gap for contact in contacts]), configuration, whole)
    options: dict[str, Any] = {"ipopt": ipopt_options(_SETTINGS), "print_time": False}
    solver = ca.nlpsol("standing", "ipopt", {"x": free, "f": ca.sum1(distances), "g": touching}, options)
    lower, upper = _adjusted_limits(robot, adjust, limits)
    found = solver(x0=_adjusted(robot, adjust, q), lbx=lower, ubx=upper, lbg=0.0, ubg=0.0)
    q = _with_adjusted(robot, adjust, q, np.clip(np.asarray(found["x"]).ravel(), lower, upper))
    return touching_configuration(robot, contacts, configuration, standing.adjust, q, limits)


def _entries(names: Sequence[str], name: str) -> slice:
    """Return the entries of q of a coordinate, or of the angle of a joint without limits."""
    if name in names:
        return slice(names.index(name), names.index(name) + 1)
    return turn_entries(names)[name]


def _adjusted(robot: Robot, names: Sequence[str], q: np.ndarray) -> np.ndarray:
    """Return the values of coordinates and angles of a configuration (n_q), m or rad, (n)."""
    own = [q[_entries(robot.configuration_names, name)] for name in names]
    return np.array([each[0] if len(each) == 1 else np.arctan2(each[1], each[0]) for each in own])


def _with_adjusted(robot: Robot, names: Sequence[str], q: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a configuration (n_q) with other values of coordinates and angles, m or rad, (n)."""
    found = q.copy()
    for name, value in zip(names, values, strict=True):
        single = name in robot.configuration_names
        found[_entries(robot.configuration_names, name)] = value if single else (np.cos(value), np.sin(value))
    return found


def _adjusted_limits(robot: Robot, names: Sequence[str], limits: StateLimits) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits of coordinates and angles, (n) each; angles have none here."""
    own = [_entries(robot.configuration_names, name) for name in names]
    lower, upper = ([each[at.start] for at in own] for each in (limits.lower_position, limits.upper_position))
    return np.array(lower), np.array(upper)


def _step(
    gap: np.ndarray, slope: np.ndarray, bounded: tuple[np.ndarray, np.ndarray, np.ndarray], damping: float
) -> np.ndarray:
    """Return a damped Gauss-Newton step of those of the (values, lower, upper) that do not press against a limit."""
    values, lower, upper = bounded
    gradient = slope.T @ gap
    free = ~(((values <= lower) & (gradient > 0)) | ((values >= upper) & (gradient < 0)))
    step, columns = np.zeros(len(values)), slope[:, free]
    scale = (columns**2).sum(axis=0).max(initial=0.0)
    if scale > 0:
        rows = np.vstack([columns, np.sqrt(damping * scale) * np.eye(columns.shape[1])])
        step[free] = np.linalg.lstsq(rows, -np.concatenate([gap, np.zeros(columns.shape[1])]), rcond=None)[0]
    return step


class _Search:
    """Completes the sections of one task."""

    def __init__(self, task: Task, robot: Robot, contacts: Sequence[Contact], configuration: ca.SX) -> None:
        self.task, self.robot, self.configuration = task, robot, configuration
        self.contacts = {contact.name: contact for contact in contacts}
        self.limits = limits_of(task, robot)

    def completed(self, path: KeyPath, section: Section, base: np.ndarray) -> Section:
        """Return a section with its whole configuration; coordinates left out are as in `base` (n_q)."""
        posture = posture_of(self.task, self.robot, section.posture)
        values = with_unit_entries(self.robot, layered(posture, section.configuration), base)
        if section.complete and values == section.configuration:
            return section
        standing = _standing(self.task, self.robot, path, section)
        if standing is not None:
            values |= self._found(standing, values, base)
        try:
            return section.completed(values)
        except ValidationError as error:
            problem = error.errors()[0]["ctx"]
            raise self.task.error((*path, *problem["at"]), problem["sentence"]) from error

    def _found(self, standing: Standing, values: Mapping[str, float], base: np.ndarray) -> dict[str, float]:
        """Return the adjusted coordinates by name."""
        start = with_values(self.robot, values, base)
        contacts = [self.contacts[name] for name in standing.contacts]
        q, gaps = preferred_configuration(self.robot, contacts, self.configuration, standing, start, self.limits)
        worst = int(np.argmax(np.abs(gaps)))
        if not abs(gaps[worst]) <= GAP_TOLERANCE:
            raise self.task.error((*standing.path, "stand_on"), self._impossible(standing, worst, q, gaps[worst]))
        names = self.robot.configuration_names
        found = [k for name in standing.adjust for k in range(len(names))[_entries(names, name)]]
        return {names[k]: float(q[k]) for k in found}

    def _impossible(self, standing: Standing, worst: int, q: np.ndarray, gap: float) -> str:
        stopped = []
        for name in (one for one in standing.adjust if one in self.robot.configuration_names):
            i = self.robot.configuration_names.index(name)
            if q[i] in (self.limits.lower_position[i], self.limits.upper_position[i]):
                stopped.append(f"{name} is at its limit {q[i]:.6g}")
        where = "away from what it should touch" if gap > 0 else "inside what it should touch"
        fewer = ", or fewer contacts" if len(standing.contacts) > 1 else ""
        return (
            f"found contact '{standing.contacts[worst]}' {abs(gap):.4g} m {where}, however {_and(standing.adjust)} "
            f"{'are' if len(standing.adjust) > 1 else 'is'} adjusted{f' ({_and(stopped)})' if stopped else ''}; "
            f"expected {_and(standing.contacts)} within reach{' at once' if fewer else ''}: other coordinates in "
            f"stand_on.adjust or in the configuration{fewer}"
        )


def _standing(task: Task, robot: Robot, path: KeyPath, section: Configured) -> Standing | None:
    """Return the `stand_on` of a section with its defaults."""
    wanted = section.standing
    if wanted is None:
        return None
    adjust = wanted.adjust or _default_adjust(task, robot, wanted.contacts)
    if not adjust and not wanted.prefer:
        raise task.error(
            (*path, "stand_on"),
            "found no coordinates to adjust for a robot without root_z, expected stand_on.contacts and stand_on.adjust "
            f"with some of {', '.join(robot.configuration_names)}",
        )
    asked = [("adjust", str(i), name) for i, name in enumerate(adjust)]
    asked += [("prefer", name, name) for name in wanted.prefer]
    for section_key, key, name in asked:
        if not changes_alone(name, robot.velocity_names, robot.configuration_names):
            raise task.error(
                (*path, "stand_on", section_key, key),
                f"found '{name}', which changes together with others, expected a length or an angle that one joint "
                "changes alone",
            )
    return Standing(path, wanted.contacts, [*dict.fromkeys([*adjust, *wanted.prefer])], wanted.prefer)


def _default_adjust(task: Task, robot: Robot, contacts: Sequence[str]) -> list[str]:
    """Return the height, and for several contacts the pitch, of the robot and of every body that contacts belong to."""
    frames: dict[str | None, list[str]] = {}
    for name in contacts:
        frame = task.single_contacts[name].frame
        frames.setdefault(robot.body_of(frame), []).append(frame)
    found = []
    for own in frames.values():
        sagittal = robot.roots_under(own[0], _DEFAULT_ADJUST[: len(own)])
        found += [name for name in sagittal if name in robot.velocity_names]
        found += [] if sagittal else robot.roots_under(own[0], [FLYER_HEIGHT])
    return found


def _and(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
