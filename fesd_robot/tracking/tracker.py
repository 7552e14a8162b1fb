"""A controller that follows a plan by its landings: what a robot does until a foot really lands, and from then on."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.arguments import checked
from fesd_robot.errors import OptionError
from fesd_robot.ocp import MotionProblem, formulate, numeric_physics
from fesd_robot.plans import Plan, ReferenceSegment, TrackingGains, task_of
from fesd_robot.tracking.gains import tracking_gains

HOLD = 1e-3
"""s; a controller's usual period."""

WINDOW = 0.03
"""s before and after a landing of the plan, in which it is taken when it happens."""

TOUCHING = 1e-4
"""m; a contact with a smaller gap touches, where nobody says which do."""


@dataclass(frozen=True)
class _Segment:
    """A segment of the reference: its arrays as they are looked up, who lands at its beginning, and from when on."""

    time: list[float]
    configuration: np.ndarray
    velocity: np.ndarray
    control: np.ndarray
    impulse: np.ndarray
    gain: np.ndarray
    landed: np.ndarray
    awaited: float

    def mean_control(self, k: int, time: float, hold: float) -> np.ndarray:
        """Return the mean of the feed-forward from a time, s, at or behind row k, over the hold that follows."""
        until = time + hold
        last = k
        while last + 1 < len(self.time) and self.time[last + 1] < until:
            last += 1
        if last == k or not hold:
            return self.control[k]
        ahead = self.impulse[last] + (until - self.time[last]) * self.control[last]
        return (ahead - self.impulse[k] - (time - self.time[k]) * self.control[k]) / hold


@checked
class Tracker:
    """A controller that follows a plan.

        u = u_ref - K (q (-) q_ref, v - v_ref),  within the limits of the motors

    The reference goes by landings, not by the clock alone: until a contact that lands in the plan really touches, the
    reference from before it goes on, at constant velocity; from then on the reference from after it is followed, also
    backwards. A landing is looked for from 30 ms before its planned time on, after a short flight from its middle on;
    30 ms after that time it counts as having happened.

    Args:
        plan: exact, with its finite elements.
        gains: from `tracking_gains`, `proportional_gains` or `feed_forward`; default: those of the plan, else those of
            `tracking_gains`.
        hold: how long a control is held, s; the feed-forward is its mean over this time.
        window: s.
        motion: the task of the plan, formulated; default: it is formulated.

    Raises:
        PlanFileError: a plan that is not solved or has no finite elements.
        TaskError: the model of the robot cannot be read any more.
        OptionError: gains of another plan's robot.

    Source: Rijnen, Biemond, van de Wouw, Saccon, Nijmeijer, Hybrid systems with state-triggered jumps:
    sensitivity-based stability analysis with application to trajectory tracking, 2020 (reference spreading).
    """

    def __init__(
        self,
        plan: Plan,
        gains: TrackingGains | None = None,
        *,
        hold: float = HOLD,
        window: float = WINDOW,
        motion: MotionProblem | None = None,
    ) -> None:
        motion = formulate(task_of(plan), driven=False) if motion is None else motion
        gains = gains or plan.gains or tracking_gains(plan, motion=motion)
        _check_names(gains, motion)
        robot = motion.robot
        self.gains = gains
        self._model = robot.model if robot.model.nq != robot.model.nv else None
        self._sizes = {"q": robot.model.nq, "v": robot.model.nv}
        self._physics = numeric_physics(motion)
        self._hold, self._window = hold, window
        contacts = list(gains.contact_names)
        self._contacts = contacts
        self._segments = [
            _Segment(
                each.time.tolist(),
                each.configuration,
                each.velocity,
                each.control,
                np.vstack(
                    [
                        np.zeros(len(gains.control_names)),
                        np.cumsum(each.control[:-1] * np.diff(each.time)[:, None], axis=0),
                    ]
                ),
                each.gain,
                np.array([contacts.index(name) for name in each.landed], dtype=int),
                _awaited(plan, each, window),
            )
            for each in gains.segments
        ]
        self._lower, self._upper = gains.lower, gains.upper
        self._error = np.zeros(2 * robot.model.nv)
        self.reset()

    def reset(self, time: float | None = None) -> None:
        """Begin again at a time, s; default: the start of the plan."""
        starts = [each.time[0] for each in self._segments]
        self._now = 0 if time is None else max(int(np.searchsorted(starts, time, side="right")) - 1, 0)

    @property
    def landings(self) -> int:
        """How many landings of the plan have happened or passed."""
        return self._now

    def action(
        self,
        time: float,
        configuration: np.ndarray,
        velocity: np.ndarray,
        contacts: np.ndarray | Sequence[bool] | Mapping[str, bool] | None = None,
    ) -> np.ndarray:
        """Return the controls, N or N m, (n_u), in the order of `gains.control_names`.

        Args:
            time: since the start of the plan, s; not earlier than in the call before, or `reset`.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order, by the names of the gains.
            contacts: which contacts touch, in the order of `gains.contact_names` or by name; default: those whose gap
                is below 0.1 mm.

        Raises:
            OptionError: arrays of the wrong length, or contacts of unknown names.
        """
        if len(configuration) != self._sizes["q"] or len(velocity) != self._sizes["v"]:
            raise OptionError(
                f"found q of {len(configuration)} and v of {len(velocity)} entries, expected {self._sizes['q']} and "
                f"{self._sizes['v']}"
            )
        self._follow_landings(time, configuration, contacts)
        segment, k, reference, speed = self._reference(time)
        n_v, error = self._sizes["v"], self._error
        if self._model is None:
            np.subtract(configuration, reference, out=error[:n_v])
        else:
            error[:n_v] = pin.difference(self._model, reference, configuration)
        np.subtract(velocity, speed, out=error[n_v:])
        control = segment.mean_control(k, time, self._hold) - segment.gain[k] @ error
        return np.minimum(np.maximum(control, self._lower), self._upper)

    def reference(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return q, (n_q), and v, (n_v), that are followed at a time, s, with the landings that happened until now."""
        return self._reference(time)[2:]

    def _reference(self, time: float) -> tuple[_Segment, int, np.ndarray, np.ndarray]:
        """Return the segment that is followed, the row of its control and gain, and the reference q and v."""
        segment = self._segments[self._now]
        k = max(bisect_right(segment.time, time) - 1, 0)
        beyond, speed = time - segment.time[k], segment.velocity[k]
        if k + 1 == len(segment.time) and self._now + 1 == len(self._segments):  # after the end the plan stands still
            beyond, speed = 0.0, np.zeros_like(speed)
        elif k + 1 < len(segment.time) and beyond > 0:
            share = beyond / (segment.time[k + 1] - segment.time[k])
            speed = speed + share * (segment.velocity[k + 1] - speed)
        moved = beyond * 0.5 * (segment.velocity[k] + speed) if beyond else 0.0
        if self._model is None or not beyond:
            return segment, k, segment.configuration[k] + moved, speed
        return segment, k, np.asarray(pin.integrate(self._model, segment.configuration[k], moved)), speed

    def _follow_landings(
        self,
        time: float,
        configuration: np.ndarray,
        contacts: np.ndarray | Sequence[bool] | Mapping[str, bool] | None,
    ) -> None:
        while self._now + 1 < len(self._segments):
            planned = self._segments[self._now].time[-1]
            if time < self._segments[self._now + 1].awaited:
                return
            if time <= planned + self._window:
                touching = self._touching(configuration, contacts)
                if not touching[self._segments[self._now + 1].landed].all():
                    return
            self._now += 1

    def _touching(
        self,
        configuration: np.ndarray,
        contacts: np.ndarray | Sequence[bool] | Mapping[str, bool] | None,
    ) -> np.ndarray:
        """Return which contacts touch, (n_c) of bool."""
        if contacts is None:
            return self._physics.gaps(configuration) < TOUCHING
        if isinstance(contacts, Mapping):
            if unknown := set(contacts) - set(self._contacts):
                raise OptionError(f"contacts: found '{min(unknown)}', expected names of {', '.join(self._contacts)}")
            return np.array([bool(contacts.get(name, False)) for name in self._contacts])
        if len(contacts) != len(self._contacts):
            raise OptionError(
                f"contacts: found {len(contacts)} values, expected one of {', '.join(self._contacts)} each"
            )
        return np.asarray(contacts, dtype=bool)


def _awaited(plan: Plan, segment: ReferenceSegment, window: float) -> float:
    """Return from when on the landing that begins a segment is looked for, s: in the second half of a short flight."""
    landing = float(segment.time[0])
    left = [one.time for one in plan.switches if one.kind == "takeoff" and one.contact in segment.landed]
    flight = landing - max((time for time in left if time < landing), default=plan.trajectory.time[0])
    return landing - min(window, 0.5 * flight)


def _check_names(gains: TrackingGains, motion: MotionProblem) -> None:
    pairs = (
        ("coordinates", gains.configuration_names, motion.robot.configuration_names),
        ("velocities", gains.velocity_names, motion.robot.velocity_names),
        ("controls", gains.control_names, motion.actuation.names),
        ("contacts", gains.contact_names, [contact.name for contact in motion.contacts]),
    )
    for what, found, expected in pairs:
        if list(found) != list(expected):
            raise OptionError(
                f"gains of {gains.plan}: found the {what} {', '.join(found)}, expected those of the plan's robot, "
                f"{', '.join(expected)}"
            )
