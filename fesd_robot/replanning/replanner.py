"""A plan that is solved again at the rate of a controller, from the state in which the robot is."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.contact import ContactMode
from fesd_robot.errors import OptionError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning.another_plan import AnotherPlan, with_goal
from fesd_robot.replanning.followed import Followed
from fesd_robot.replanning.measured import MeasuredState
from fesd_robot.replanning.policy import LANDING, ContactEvent, Policy, landing
from fesd_robot.replanning.strides import STRIDES, Strides
from fesd_robot.task import Task

PERIOD = 0.01
"""s; how often it is meant to be called."""

LAST = 2e-3
"""s; what is left of a phase, or of the plan, that is too short to be planned again."""

TOUCHING = 1e-4
"""m; a contact with a smaller gap touches."""

NEAR = 2e-3
"""m; in a gait a contact with a smaller gap touches once it is due: feet come down slowly, and may miss the ground."""

PATIENCE = 2e-3
"""s; how long a policy of a gait waits for a landing that is due."""

EXACT = 1e-6
"""Violation of equations at which no further step is made."""

ITERATIONS, ITERATIONS_OF_GAITS = 4, 8
"""Steps of an update, at most; of a gait, whose plan does not wait for a robot that has left it."""

SHIFTING = 2
"""Steps that follow the time, before the measurement, at most."""

AWAY = 1.5
"""Periods by which a measurement may be away from the time that was prepared for; else all is prepared anew."""

MISSED = 1e-3
"""Violation of bounds of the rest of a plan above which its goal counts as missed."""

STANDING = 0.2
"""s for which the robot is to stand, from every instant on once a plan is over."""

ACCEPTED = 1e-3
"""Violation of equations up to which the result of an update is taken."""


@dataclass(frozen=True)
class Update:
    """One update.

    Attributes:
        time: of the measurement, s.
        prepare_seconds, feedback_seconds: before and after it.
        iterations: steps that were made.
        first, violation: of equations behind the first and the last step.
        beyond: by how much bounds are violated.
        status, reason: of the policy.
    """

    time: float
    prepare_seconds: float
    feedback_seconds: float
    iterations: int
    first: float
    violation: float
    beyond: float
    status: str
    reason: str


@dataclass
class Statistics:
    """What the updates of a replanner took.

    Attributes:
        updates: in their order.
    """

    updates: list[Update] = field(default_factory=list)

    def seconds(self, what: str = "feedback_seconds") -> tuple[float, float]:
        """Return the median and the 99th percentile of a duration of all updates, s."""
        values = [getattr(each, what) for each in self.updates]
        return float(np.median(values)), float(np.percentile(values, 99))


@checked
class Replanner:
    """Plans the rest of a plan again from measured states.

    The sequence of contacts is kept, the durations of its phases are free. An update makes Newton steps with exact
    derivatives on the rest of the plan: `prepare` does all that does not need the measurement, `update` what is left.
    A phase begins when its contacts land, or when it is due.

    Of a gait, a plan with a periodic goal, some strides are planned; whenever one has passed another one follows. Where
    an update fails the gait itself goes on, and the next update begins nearer.

    Args:
        plan: exact, on a grid that follows the contacts (`method.grid: phases`).
        period: s between updates.
        iterations: steps of an update, at most; further ones are made while equations are violated by more than 1e-6;
            default: 4, and 8 of a gait.
        search: whether another plan is looked for in another process where the last phase of a plan cannot reach the
            goal; `search` follows it from the end of the running one on.
        strides: of a gait that are planned; other plans have none.
        motion: its task, formulated; default: it is formulated.

    Attributes:
        statistics: of all updates.

    Raises:
        PlanFileError: a plan that is not solved, without its finite elements, of another grid, with impulses between
            elements, or a gait that `Strides` does not know how to go on with.
        TaskError: the model of the robot cannot be read any more.
        OptionError: a period that is not positive.

    Source: Diehl, Bock, Schloeder, A real-time iteration scheme for nonlinear optimization in optimal feedback control,
    2005.
    """

    def __init__(
        self,
        plan: Plan,
        *,
        period: float = PERIOD,
        iterations: int | None = None,
        search: bool = False,
        strides: int = STRIDES,
        motion: MotionProblem | None = None,
    ) -> None:
        if not 0 < period < np.inf:
            raise OptionError(f"period: found {period!r} s, expected a number greater than 0")
        if iterations is not None and iterations < 1:
            raise OptionError(f"iterations: found {iterations!r}, expected a number of at least 1")
        if strides < 2:
            raise OptionError(f"strides: found {strides!r}, expected a number of at least 2")
        self.motion = formulate(task_of(plan)) if motion is None else motion
        robot = self.motion.robot
        self._n_q, self._n_v = len(robot.configuration_names), len(robot.velocity_names)
        self._model = robot.model if self._n_q != self._n_v else None
        self._measured = MeasuredState(self.motion)
        self._limits = self.motion.actuation.lower, self.motion.actuation.upper
        self.period, self._searches = period, search
        self.statistics = Statistics()
        self._another: AnotherPlan | None = None
        self._changed = False
        self._first = self._current = Followed(plan, self.motion, strides)
        self._iterations = iterations or (ITERATIONS if self.strides is None else ITERATIONS_OF_GAITS)
        self.reset()

    def reset(self, plan: Plan | None = None, time: float = 0.0) -> None:
        """Begin again at the start of a plan.

        Args:
            plan: of the same task, perhaps with another start or goal; default: the one that it was made from.
            time: at which the plan begins, s.

        Raises:
            PlanFileError: as for a new replanner.
        """
        if self._another is not None:
            self._another.end()
        self._another = None
        self._policy: Policy | None = None
        self._follow(self._first if plan is None else Followed(plan, self._motion_of(task_of(plan))), time)
        self.prepare()

    def _motion_of(self, task: Task) -> MotionProblem:
        """Return a task formulated, on the equations that are there if they are its own."""
        try:
            return self.motion.with_numbers_of(task)
        except OptionError:
            return formulate(task)

    def _follow(self, followed: Followed, time: float) -> None:
        """Begin a plan at a time, s."""
        self._current, self._offset, self._origin = followed, time, np.zeros(self._n_q)
        horizon = followed.horizon
        self._horizon, self._modes = horizon, followed.modes
        self._goal: dict[str, float] = {}
        horizon.with_numbers(horizon.motion.transcription.ocp)
        horizon.solver.barrier = horizon.barriers[0]
        self._point = self._start = horizon.settled
        self._stands = False
        self._phase, self._time = 0, float(horizon.phase_ends(self._point.x)[0])
        self._begun = self._time
        self._flown = np.zeros(len(self._modes[0]), dtype=bool)
        self._ready = False

    @property
    def policy(self) -> Policy | None:
        """The last policy, None before the first update."""
        return self._policy

    @property
    def strides(self) -> Strides | None:
        """The strides of a gait, None of a plan with a goal."""
        return self._current.strides

    @property
    def phase(self) -> int:
        """Number of the phase that runs."""
        return self._phase

    def prepare(self, time: float | None = None) -> None:
        """Make ready for the next measurement: shift, linearise, factorise.

        Args:
            time: of that measurement, s; default: a period after the last one.
        """
        begin = clock.perf_counter()
        if time is not None:
            self._time = time - self._offset
        elif self._policy is not None:
            self._time += self.period
        self._prepare_at(self._time)
        self._prepare_seconds = clock.perf_counter() - begin

    def update(
        self,
        time: float,
        configuration: np.ndarray,
        velocity: np.ndarray,
        contacts: np.ndarray | None = None,
        goal: Mapping[str, float] | None = None,
    ) -> Policy:
        """Return the policy from a measured state on.

        Args:
            time: s, since the start of the plan that it was made from.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order.
            contacts: which contacts touch, (n_c) of bool, beside those with a gap below 0.1 mm.
            goal: other values of configuration coordinates in the task's goal, m or rad, from now on; default: those
                of the last call. An update with another goal takes longer.

        Raises:
            OptionError: arrays of the wrong length, or coordinates that are not in the goal.
        """
        if len(configuration) != self._n_q or len(velocity) != self._n_v:
            raise OptionError(
                f"found q of {len(configuration)} and v of {len(velocity)} entries, expected {self._n_q} and "
                f"{self._n_v}"
            )
        begin = clock.perf_counter()
        gaps = self._measured.physics.gaps(configuration)
        touching = gaps < TOUCHING
        if contacts is not None:
            touching |= contacts
        self._flown |= ~touching
        if goal is not None and dict(goal) != self._goal:
            self._aim(goal)
        while following := self._following(time - self._offset, touching, gaps < NEAR):
            self._enter(following, time)
        own = time - self._offset
        if abs(own - self._time) > AWAY * self.period or not self._ready:
            self._time = own
            self._prepare_at(own)
        policy, found = self._from(own, configuration - self._origin, velocity)
        self._policy = policy
        self._time, self._ready = own, False
        seconds = clock.perf_counter() - begin
        found = replace(found, time=time, prepare_seconds=self._prepare_seconds, feedback_seconds=seconds)
        self.statistics.updates.append(found)
        return policy

    def search(self, *, wait: bool = False) -> bool:
        """Follow another plan if there is one, once the running one is over; return whether it begins.

        Args:
            wait: whether the search for it is waited for.
        """
        another = self._another
        if another is None or self._time < self._horizon.duration - LAST:
            return False
        found = another.wait() if wait else another.look()
        if found is None:
            return False
        another.end()
        self._another = None
        self._follow(Followed(found, self._motion_of(another.task)), self._offset + self._time + self.period)
        self._time -= self.period
        self._changed = True
        return True

    def _aim(self, goal: Mapping[str, float]) -> None:
        """Give the goal other values."""
        task = self._current.motion.task
        if unknown := [name for name in goal if name not in task.goal.configuration]:
            known = ", ".join(task.goal.configuration)
            raise OptionError(f"goal: found '{unknown[0]}', expected coordinates of the task's goal: {known}")
        self._goal = dict(goal)
        self._horizon.with_numbers(self._current.motion.with_numbers_of(with_goal(task, goal)).ocp)
        self._horizon.eased(further=True)
        self._ready = False

    def _from(self, time: float, q: np.ndarray, v: np.ndarray) -> tuple[Policy, Update]:
        horizon, place = self._horizon, self._horizon.state(self._element)
        solver, predicted = horizon.solver, self._shifted[place]
        state = self._measured.in_modes(list(self._modes[self._phase]), time, q, v, predicted)
        moved = np.zeros(solver.size)
        moved[place] = state - predicted
        iterate = solver.step(moved).iterate
        violation, beyond = solver.violation(iterate.x)
        first, count = violation, 1
        if violation > ACCEPTED:
            horizon.eased(further=True)
        while violation > EXACT and np.isfinite(violation) and count < self._iterations:
            solver.prepare(iterate)
            iterate = solver.step().iterate
            violation, beyond = solver.violation(iterate.x)
            count += 1
        reason = ""
        if not violation <= ACCEPTED:
            reason = f"equations would be violated by {violation:.1g}"
        elif horizon.runs_backwards(iterate.x, self._element):
            reason = "a phase would run backwards"
        status = "old" if reason else "changed" if self._changed else "kept"
        found = Update(time, 0.0, 0.0, count, first, violation, beyond, status, reason)
        if reason:  # a result that came nearer is where the next update begins, once it is good it counts
            self._start = iterate if violation < first else self._point
            return self._old(time, reason), found
        self._point = self._start = iterate
        if count == 1:
            horizon.eased(further=False)
        self._changed = False
        self._look_for_another(beyond)
        return self._policy_of(time, status), found

    def _look_for_another(self, beyond: float) -> None:
        """Begin to look for a plan from where this one ends, where its last phase cannot reach the goal."""
        last = self._phase + 1 == len(self._modes)
        if not (self._searches and last and beyond > MISSED and self._another is None):
            return
        current = self._current
        end = self._horizon.end(self._point.x)[: self._n_q]
        task = with_goal(current.motion.task, self._goal)
        motion = current.motion.with_numbers_of(task)
        self._another = AnotherPlan(motion, current.plan, end, self._motion_of)

    def _old(self, time: float, reason: str) -> Policy:
        if self._current.strides is not None:
            self._point = self._horizon.settled
            return self._policy_of(time, "old", reason)
        if self._policy is None:
            return self._policy_of(self._time, "old", reason)
        return replace(self._policy, status="old", reason=reason)

    def _following(self, time: float, touching: np.ndarray, near: np.ndarray) -> int | None:
        """Return a later phase that has begun: its contacts have landed, or it is due and nothing lands before.

        A landing may come early, but of contacts that were never seen off not in the first half of a short flight. In a
        gait it is also over where it is due and its contacts are near, or where it is long overdue.
        """
        ends, modes = self._horizon.phase_ends(self._point.x), self._modes
        for phase in range(self._phase + 1, len(modes)):
            lands = landing(modes[phase - 1], modes[phase])
            if not lands:
                if time >= ends[phase] - LAST:
                    return phase
            elif not touching[lands].all():
                late = time >= ends[phase] + LANDING or (near[lands].all() and time >= ends[phase] - LAST)
                return phase if late and self._current.strides is not None else None
            elif phase == self._phase + 1 and self._flown[lands].all():
                return phase
            else:
                flight = ends[phase] - max(ends[self._takeoff(phase - 1, i)] for i in lands)
                return phase if time >= ends[phase] - min(LANDING, 0.5 * flight) else None
        return None

    def _takeoff(self, phase: int, contact: int) -> int:
        """Return the phase in which the flight begins that a contact is in, in some phase."""
        while phase > 0 and self._modes[phase - 1][contact] is ContactMode.FLIGHT:
            phase -= 1
        return phase

    def _enter(self, phase: int, time: float) -> None:
        """Go on with a later phase; behind the first stride of a gait it is one of the next horizon."""
        strides = self._current.strides
        if strides is not None and phase >= strides.phases:
            phase -= strides.phases
            self._point = self._start = strides.shifted(self._start)
            self._offset += strides.duration
            self._origin = self._origin + strides.advance
        self._phase, self._begun, self._ready = phase, time - self._offset, False
        self._flown = np.zeros(len(self._modes[0]), dtype=bool)

    def _prepare_at(self, time: float) -> None:
        horizon, x = self._horizon, self._start.x
        if time > horizon.duration - LAST:
            self._stand(time)
        else:
            self._element = element = horizon.place(x, time, self._phase, LAST)
            begin, end = horizon.span(x, element)
            within = min(max(time, begin), end - LAST)
            self._shifted = horizon.begun_at(x, element, within) if end - begin > LAST else x
        horizon.restrict(self._shifted, self._element, whole=self._stands)
        if self._stands:
            horizon.lasts_until(time + STANDING)
        solver, self._ready = horizon.solver, True
        solver.prepare(solver.at(self._shifted, self._start))
        for _ in range(SHIFTING):
            shifted = solver.step().iterate
            if not EXACT < solver.violation(shifted.x)[0] <= ACCEPTED:
                break
            solver.prepare(shifted)
            self._shifted = shifted.x

    def _stand(self, time: float) -> None:
        """Let the motion rest at its end, for some time from now on."""
        if not self._stands:
            self._shifted, self._element = self._horizon.at_rest(self._start.x, time, STANDING)
            self._horizon.eased(further=True)
        else:
            self._shifted = self._horizon.later(self._start.x, self._element, time)
        self._stands = True

    def _policy_of(self, time: float, status: str = "kept", reason: str = "") -> Policy:
        x, run, first = self._point.x, self._horizon.running, self._element
        left, states = x[run.left[first:]], x[run.states[first:]]
        n_x, ticks = self._n_q + self._n_v, self._horizon.clock
        offset = self._offset
        values = np.concatenate([left[:, None, :n_x], states[..., :n_x]], axis=1)
        values[..., : self._n_q] += self._origin
        phase_ends = offset + self._horizon.phase_ends(x)[self._phase :]
        phase_ends[0] = offset + self._begun
        modes = tuple(self._modes[self._phase :])
        events = tuple(
            ContactEvent(float(phase_ends[p + 1]), name, _kind(before, after))
            for p in range(len(modes) - 1)
            for name, before, after in zip(self._current.contacts, modes[p], modes[p + 1], strict=True)
            if before is not after
        )
        return Policy(
            offset + time,
            offset + time + 3 * self.period,
            events,
            status,
            reason,
            offset + left[:, ticks],
            offset + states[:, -1, ticks],
            run.phases[first:],
            self._horizon.nodes,
            values,
            x[run.controls[first:]][:, : len(self._limits[0])],
            modes,
            phase_ends,
            self._phase,
            self._current.gains,
            self._flown.copy(),
            np.inf if self._current.strides is None else PATIENCE,
            self._limits,
            (self._n_q, self._n_v),
            self._model,
        )


def _kind(before: ContactMode, after: ContactMode) -> str:
    if before is ContactMode.FLIGHT:
        return "touchdown"
    if after is ContactMode.FLIGHT:
        return "takeoff"
    if before is ContactMode.STICK:
        return "stick_to_slip"
    return "slip_to_stick" if after is ContactMode.STICK else "slip_reversal"
