"""A plan that is solved again at the rate of a controller, from the state in which the robot is."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field, replace

import numpy as np

from fesd_robot.contact import ContactMode, modes_of
from fesd_robot.errors import OptionError, PlanFileError
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.nlp.real_time import PrimalDual
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import Plan, task_of
from fesd_robot.replanning.horizon import Horizon
from fesd_robot.replanning.measured import MeasuredState
from fesd_robot.replanning.policy import LANDING, ContactEvent, FeedbackGains, Policy
from fesd_robot.starts import kept_motion
from fesd_robot.tracking import tracking_gains

PERIOD = 0.01
"""s; how often it is meant to be called."""

LAST = 2e-3
"""s; what is left of a phase, or of the plan, that is too short to be planned again."""

TOUCHING = 1e-4
"""m; a contact with a smaller gap touches."""

EXACT = 1e-6
"""Violation of equations at which no further step is made."""

ITERATIONS = 4
"""Steps of an update, at most."""

SHIFTING = 2
"""Steps that follow the time, before the measurement, at most."""

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


class Replanner:
    """Plans the rest of a plan again from measured states.

    The sequence of contacts is kept, the durations of its phases are free. An update makes Newton steps with exact
    derivatives on the rest of the plan: `prepare` does all that does not need the measurement, `update` what is left.
    A phase begins when its contacts land, or when it is due.

    Args:
        plan: exact, on a grid that follows the contacts (`method.grid: phases`).
        period: s between updates.
        iterations: steps of an update, at most; further ones are made while equations are violated by more than 1e-6.
        motion: its task, formulated; default: it is formulated.

    Attributes:
        statistics: of all updates.

    Raises:
        PlanFileError: a plan that is not solved, without its finite elements, of another grid, with impulses between
            elements, or of a motion that repeats.
        TaskError: the model of the robot cannot be read any more.
        OptionError: a period that is not positive.

    Source: Diehl, Bock, Schloeder, A real-time iteration scheme for nonlinear optimization in optimal feedback control,
    2005.
    """

    def __init__(
        self, plan: Plan, *, period: float = PERIOD, iterations: int = ITERATIONS, motion: MotionProblem | None = None
    ) -> None:
        if not period > 0:
            raise OptionError(f"period: found {period!r} s, expected a number greater than 0")
        if iterations < 1:
            raise OptionError(f"iterations: found {iterations!r}, expected a number of at least 1")
        if not plan.status.solved:
            raise PlanFileError(f"{plan.name}: found a plan that is not solved, expected one that can be followed")
        self.motion = formulate(task_of(plan)) if motion is None else motion
        whole = _moving_motion(plan, self.motion)
        robot = self.motion.robot
        self._n_q, self._n_v = len(robot.configuration_names), len(robot.velocity_names)
        self._model = robot.model if self._n_q != self._n_v else None
        self._contacts = [contact.name for contact in self.motion.contacts]
        self._measured = MeasuredState(self.motion)
        self._horizon = Horizon(whole)
        self._modes = self._modes_of_phases(whole)
        gains = tracking_gains(plan, motion=self.motion)
        ends = self._horizon.phase_ends(whole.w)
        self._gains = FeedbackGains(gains.stacked("time"), gains.stacked("gain"), ends)
        self._limits = self.motion.actuation.lower, self.motion.actuation.upper
        self.period, self._iterations = period, iterations
        self.statistics = Statistics()
        self.reset()

    def reset(self) -> None:
        """Begin again at the start of the plan."""
        self._point = self._start = self._horizon.settled
        self._horizon.solver.barrier = self._horizon.barriers[0]
        self._phase, self._time = 0, float(self._horizon.phase_ends(self._point.x)[0])
        self._begun = self._time
        self._policy: Policy | None = None
        self._ready = False
        self.prepare()

    @property
    def policy(self) -> Policy | None:
        """The last policy, None before the first update."""
        return self._policy

    @property
    def phase(self) -> int:
        """Number of the phase that runs."""
        return self._phase

    def prepare(self) -> None:
        """Make ready for a measurement one period later: shift, linearise, factorise."""
        begin = clock.perf_counter()
        if self._policy is not None:
            self._time += self.period
        self._prepare_at(self._time)
        self._prepare_seconds = clock.perf_counter() - begin

    def update(
        self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray | None = None
    ) -> Policy:
        """Return the policy from a measured state on.

        Args:
            time: since the start of the plan, s.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order.
            contacts: which contacts touch, (n_c) of bool, beside those with a gap below 0.1 mm.

        Raises:
            OptionError: arrays of the wrong length.
        """
        if len(configuration) != self._n_q or len(velocity) != self._n_v:
            raise OptionError(
                f"found q of {len(configuration)} and v of {len(velocity)} entries, expected {self._n_q} and {self._n_v}"
            )
        begin = clock.perf_counter()
        touching = self._measured.physics.gaps(configuration) < TOUCHING
        if contacts is not None:
            touching |= contacts
        if self._begins_next(time, touching):
            self._enter(self._phase + 1, time)
        elif abs(time - self._time) > 0.5 * self.period or not self._ready:
            self._time = time
            self._prepare_at(time)
        policy, found = self._from(time, configuration, velocity)
        self._policy = policy
        self._time, self._ready = time, False
        seconds = clock.perf_counter() - begin
        self.statistics.updates.append(replace(found, prepare_seconds=self._prepare_seconds, feedback_seconds=seconds))
        return policy

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
        status = "old" if reason else "kept"
        found = Update(time, 0.0, 0.0, count, first, violation, beyond, status, reason)
        if reason:  # a result that came nearer is where the next update begins, once it is good it counts
            self._start = iterate if violation < first else self._point
            return self._old(reason), found
        self._point = self._start = iterate
        if count == 1:
            horizon.eased(further=False)
        return self._policy_of(time), found

    def _old(self, reason: str) -> Policy:
        if self._policy is None:
            return self._policy_of(self._time, "old", reason)
        return replace(self._policy, status="old", reason=reason)

    def _begins_next(self, time: float, touching: np.ndarray) -> bool:
        """Return whether the next phase has begun: its contacts touch, or it is due and nothing lands in it."""
        if self._phase + 1 == len(self._modes):
            return False
        end = self._horizon.phase_ends(self._point.x)[self._phase + 1]
        lands = [
            i
            for i, (now, then) in enumerate(zip(self._modes[self._phase], self._modes[self._phase + 1], strict=True))
            if now is ContactMode.FLIGHT and then.closed
        ]
        if lands:
            return time >= end - LANDING and bool(touching[lands].all())
        return time >= end - LAST

    def _enter(self, phase: int, time: float) -> None:
        """Go on with the next phase."""
        self._phase, self._begun, self._time = phase, time, time
        self._prepare_at(time)

    def _prepare_at(self, time: float) -> None:
        horizon, x = self._horizon, self._start.x
        element = horizon.place(x, time, self._phase, LAST)
        begin, end = horizon.span(x, element)
        self._element = element
        self._shifted = horizon.begun_at(x, element, min(max(time, begin), end - LAST)) if end - begin > LAST else x
        horizon.restrict(self._shifted, element)
        solver, self._ready = horizon.solver, True
        solver.prepare(solver.at(self._shifted, self._start))
        for _ in range(SHIFTING):
            shifted = solver.step().iterate
            if not EXACT < solver.violation(shifted.x)[0] <= ACCEPTED:
                break
            solver.prepare(shifted)
            self._shifted = shifted.x

    def _modes_of_phases(self, motion: BranchMotion) -> list[tuple[ContactMode, ...]]:
        run = self._horizon.running
        result = []
        for phase in range(len(motion.transcription.grid.phases)):
            modes = modes_of(motion.branch, int(run.elements[run.first_of(phase)]))
            result.append(tuple(modes[name] for name in self._contacts))
        return result

    def _policy_of(self, time: float, status: str = "kept", reason: str = "") -> Policy:
        x, run, first = self._point.x, self._horizon.running, self._element
        left, states = x[run.left[first:]], x[run.states[first:]]
        n_x, ticks = self._n_q + self._n_v, self._horizon.clock
        phase_ends = self._horizon.phase_ends(x)[self._phase :]
        phase_ends[0] = self._begun
        modes = tuple(self._modes[self._phase :])
        events = tuple(
            ContactEvent(float(phase_ends[p + 1]), name, _kind(before, after))
            for p in range(len(modes) - 1)
            for name, before, after in zip(self._contacts, modes[p], modes[p + 1], strict=True)
            if before is not after
        )
        return Policy(
            time,
            time + 3 * self.period,
            events,
            status,
            reason,
            left[:, ticks],
            states[:, -1, ticks],
            run.phases[first:],
            self._horizon.nodes,
            np.concatenate([left[:, None, :n_x], states[..., :n_x]], axis=1),
            x[run.controls[first:]][:, : len(self._limits[0])],
            modes,
            phase_ends,
            self._phase,
            self._gains,
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


def _moving_motion(plan: Plan, motion: MotionProblem) -> BranchMotion:
    if plan.finite_elements is None:
        raise PlanFileError(f"{plan.name}: found a plan without its finite elements, expected an exact plan")
    if motion.task.goal.periodic is not None:
        raise PlanFileError(f"{plan.name}: found a motion that repeats, expected one with a goal")
    found = kept_motion(plan, motion) if motion.grid.moving else None
    if found is None:
        raise PlanFileError(
            f"{plan.name}: found a plan on a grid that stands still or with impulses between elements, expected one "
            "with method.grid: phases and method.contact: freezing"
        )
    return found
