"""The motion of a plan at any time, by the polynomials of its finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.errors import PlanFileError
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.instants import SAME_TIME
from fesd_robot.orientations import with_unit_quaternions

if TYPE_CHECKING:
    from fesd_robot.plans.plan import Plan
    from fesd_robot.recovery import ElementPolynomials

Side = Literal["before", "after"]

SIDES: tuple[Side, ...] = ("before", "after")

Value = float | np.ndarray
"""A number at one time, an array of shape (m,) at m times."""


@dataclass(frozen=True)
class ContactForce:
    """The force of a contact on the robot, N: normal and along the ground's tangent, and what the contact does.

    Attributes:
        normal, tangential, lateral: N, the last along the second tangent, y on level ground; None of a planar contact.
        mode: `ContactMode`: flight, impact, stick or slip.
    """

    normal: Value
    tangential: Value
    mode: ContactMode | np.ndarray
    lateral: Value | None = None


@dataclass(frozen=True)
class MotionAt:
    """A motion at one time or at m times: every value is a number or an array of shape (m,).

    Attributes:
        time: physical time, s.
        configuration: name of a configuration coordinate -> m or rad.
        velocity: name of a velocity coordinate -> m/s or rad/s.
        acceleration: name of a velocity coordinate -> m/s² or rad/s²; NaN after an impact at the very end, which no
            motion follows, and before one at the very start.
        controls: name -> N or N m.
        contacts: name -> force.
        joint_friction: name of a velocity coordinate with dry friction -> force on it, N or N m.
        joint_modes: the same names -> `ContactMode`: stick or slip.
    """

    time: Value
    configuration: dict[str, Value]
    velocity: dict[str, Value]
    acceleration: dict[str, Value]
    controls: dict[str, Value]
    contacts: dict[str, ContactForce]
    joint_friction: dict[str, Value]
    joint_modes: dict[str, ContactMode | np.ndarray]


class PlannedMotion:
    """A plan as a function of time.

    Args:
        plan: with its finite elements.

    Raises:
        PlanFileError: a plan without them, or with samples that are not theirs.
    """

    def __init__(self, plan: Plan) -> None:
        elements = plan.finite_elements
        if elements is None:
            raise PlanFileError(
                f"{plan.name}: found a plan without its finite elements, which say how it moves between its samples; "
                "expected an exact plan of this version, as fesd-robot plan leaves for a solved task"
            )
        self._plan = plan
        self._q, self._v = list(plan.trajectory.configuration), list(plan.trajectory.velocity)
        self._clock = elements.states.index("clock")
        count, n_x = len(elements.step), len(elements.states)
        points = elements.states_at.reshape(count, -1, n_x)
        lefts = np.vstack([elements.left[None, :n_x], points[:-1, -1]])
        if elements.lefts is not None:
            lefts = elements.lefts.reshape(count, n_x)
        running, first = self._rows_of_elements(points)
        nodes = np.concatenate([lefts[running, None], points[running, : elements.stages]], axis=1)
        rows = first[:, None] + np.arange(elements.stages)
        self._rows, self._interval = first, np.rint(elements.interval[running]).astype(int)
        self._start, self._end = elements.left[:n_x], points[-1, -1]
        self.polynomials = self._polynomials(elements.scheme, elements.stages, nodes, rows)

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the motion, s."""
        return float(self._plan.trajectory.time[0]), float(self._plan.trajectory.time[-1])

    @property
    def impacts(self) -> np.ndarray:
        """Times with two samples and a jump of a velocity between them, s, in order."""
        time, velocity = self._plan.trajectory.time, np.array(list(self._plan.trajectory.velocity.values()))
        jumps = np.abs(np.diff(velocity, axis=1)).max(axis=0) > NO_VELOCITY
        return time[1:][(np.diff(time) <= SAME_TIME) & jumps]

    def at(self, time: float | Sequence[float] | np.ndarray, side: Side | Sequence[Side] = "before") -> MotionAt:
        """Return the motion at a time or several; see `Plan.at`."""
        moments = np.asarray(time, dtype=float)
        flat, sides = np.atleast_1d(moments), _sides(side, moments)
        self._refuse_outside(flat)
        values = self.polynomials(flat, sides == "after")
        state, rate, element = values.state, values.rate, values.element
        self._meet_ends(flat, sides, state, rate)
        n_q, n_v, n_c = len(self._q), len(self._v), len(self._plan.contacts)
        configuration = with_unit_quaternions(self._q, state[:, :n_q])
        rows = self._force_rows
        force = values.carried[:, : rows * n_c].reshape(len(flat), n_c, rows)
        interval, row = self._interval[element], self._rows[element]

        def given(value: np.ndarray) -> Value:
            return value if moments.ndim else value[0].item()

        def named(names: Sequence[str], columns: np.ndarray) -> dict[str, Value]:
            return {name: given(column) for name, column in zip(names, columns.T, strict=True)}

        def modes(history: Sequence[ContactMode]) -> ContactMode | np.ndarray:
            return np.array([history[k] for k in row], dtype=object) if moments.ndim else history[row[0]]

        plan, joints = self._plan, self._plan.joint_friction
        return MotionAt(
            time=given(flat),
            configuration=named(self._q, configuration),
            velocity=named(self._v, state[:, n_q : n_q + n_v]),
            acceleration=named(self._v, rate[:, n_q : n_q + n_v]),
            controls={name: given(each[interval]) for name, each in plan.controls.items() if name != "time"},
            contacts={
                name: ContactForce(
                    given(force[:, i, 0]),
                    given(force[:, i, 1]),
                    modes(history.mode),
                    given(force[:, i, 2]) if rows > 2 else None,
                )
                for i, (name, history) in enumerate(plan.contacts.items())
            },
            joint_friction=named(list(joints), values.carried[:, rows * n_c :]),
            joint_modes={name: modes(joint.mode) for name, joint in joints.items()},
        )

    @property
    def _force_rows(self) -> int:
        """Parts of a contact's force: two in the plane, three in space."""
        return 3 if self._plan.in_space else 2

    def _rows_of_elements(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the elements in which the clock runs, and the sample of the first stage of each.

        The samples of a plan are all points of these, and one more at the start and after every impact. Those of an
        element in which the clock stands still are no samples, so that a plan itself says which ones these are.
        """
        trajectory = self._plan.trajectory
        samples = np.column_stack([*trajectory.configuration.values(), *trajectory.velocity.values(), trajectory.time])
        states, n_q = points[:, :, : self._clock + 1], len(self._q)
        unit = np.concatenate([with_unit_quaternions(self._q, states[..., :n_q]), states[..., n_q:]], axis=-1)
        running, first, row, per_element = list[int](), list[int](), 0, states.shape[1]
        for number, each in enumerate(zip(states, unit, strict=True)):
            for k in (row, row + 1):
                if any(np.array_equal(samples[k : k + per_element], one) for one in each):
                    running.append(number)
                    first.append(k)
                    row = k + per_element
                    break
        if not running or len(samples) - row > 1:
            raise PlanFileError(
                f"{self._plan.name}: found finite elements of another motion than that of the samples, expected a plan "
                "as fesd-robot plan leaves it"
            )
        return np.array(running), np.array(first)

    def _polynomials(self, scheme: str, stages: int, nodes: np.ndarray, rows: np.ndarray) -> ElementPolynomials:
        from fesd_robot.recovery import ElementPolynomials  # takes long to import

        forces = [each for one in self._plan.contacts.values() for each in one.force.T]
        columns = [*forces, *(joint.force for joint in self._plan.joint_friction.values())]
        carried = np.stack([each[rows] for each in columns], axis=-1) if columns else np.zeros((*rows.shape, 0))
        return ElementPolynomials(scheme, stages, nodes, carried, self._clock)  # type: ignore[arg-type]

    def _meet_ends(self, time: np.ndarray, sides: np.ndarray, state: np.ndarray, rate: np.ndarray) -> None:
        """Put the states before an impact at the very start and after one at the very end into their places."""
        (first, last), impacts = self.span, self.impacts
        for moment, side, beyond in ((first, "before", self._start), (last, "after", self._end)):
            if np.any(np.abs(impacts - moment) <= SAME_TIME):
                there = (np.abs(time - moment) <= SAME_TIME) & (sides == side)
                state[there], rate[there] = beyond, np.nan

    def _refuse_outside(self, time: np.ndarray) -> None:
        first, last = self.span
        outside = ~((time >= first - SAME_TIME) & (time <= last + SAME_TIME))
        if outside.any():
            raise PlanFileError(
                f"{self._plan.name}: found the time {time[outside][0]:g} s, expected one within the motion, from "
                f"{first:g} s to {last:g} s"
            )


def _sides(side: Side | Sequence[Side], time: np.ndarray) -> np.ndarray:
    sides = np.atleast_1d(np.asarray(side, dtype=object))
    for each in sides.tolist():
        if each not in SIDES:
            raise PlanFileError(f"found the side '{each}', expected 'before' or 'after'")
    if sides.size not in (1, time.size) or time.ndim > 1:
        raise PlanFileError(
            f"found times of shape {time.shape} and {sides.size} sides, expected a time or a list of times, and one "
            "side or one for every time"
        )
    return np.broadcast_to(sides, np.atleast_1d(time).shape)


class _ByIdentity:
    """A plan as a key: plans are frozen, but their arrays cannot be hashed."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def __hash__(self) -> int:
        return id(self.plan)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByIdentity) and other.plan is self.plan


@lru_cache(maxsize=8)
def _cached(key: _ByIdentity) -> PlannedMotion:
    return PlannedMotion(key.plan)


def planned_motion(plan: Plan) -> PlannedMotion:
    """Return a plan as a function of time, made once for a plan."""
    return _cached(_ByIdentity(plan))
