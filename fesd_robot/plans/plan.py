"""The result of planning: a trajectory in physical time, what the contacts did, and how far to trust it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from fesd_robot.arguments import checked
from fesd_robot.contact import ContactMode
from fesd_robot.lazy import by_name
from fesd_robot.plans.audit_record import Audit
from fesd_robot.plans.finite_elements import FiniteElements
from fesd_robot.plans.full_model import FullModelMotion
from fesd_robot.plans.gains import TrackingGains
from fesd_robot.plans.joint_friction import JointFrictionHistory, JointSwitch
from fesd_robot.plans.landing_order import LandingOrder
from fesd_robot.plans.outcome import Outcome
from fesd_robot.plans.record import Array, Record
from fesd_robot.plans.replay_record import ReplaySummary

if TYPE_CHECKING:
    from fesd_robot.plans.sampling import MotionAt, Side

SCHEMA_VERSION: Literal[2] = 2


class Trajectory(Record):
    """Sampled motion in physical time; an impact has two samples at the same time, before and after.

    Attributes:
        time: physical time, s, shape (n,), non-decreasing.
        configuration: name of a configuration coordinate -> values, m or rad, shape (n,).
        velocity: name of a velocity coordinate -> values, m/s or rad/s, shape (n,).
        acceleration: the same names -> values, m/s² or rad/s², shape (n,); of a motion that was sampled again at a
            rate, empty otherwise.
    """

    time: Array
    configuration: dict[str, Array]
    velocity: dict[str, Array]
    acceleration: dict[str, Array] = Field(default_factory=dict)


class ContactHistory(Record):
    """One contact along `Trajectory.time`; an impact has two samples at the same time, before and after.

    Attributes:
        gap: true signed distance, m, shape (n,).
        normal_force: N, shape (n,); zero in flight.
        tangential_force: N, shape (n,); positive along the ground's tangent in the x-z plane.
        lateral_force: N, shape (n,), along the second tangent, y on level ground; None of a contact in the plane.
        mode: what it does at each sample: flight, impact, stick or slip; a compliant contact flight or touch.
    """

    gap: Array
    normal_force: Array
    tangential_force: Array
    lateral_force: Array | None = None
    mode: list[Literal[ContactMode.FLIGHT, ContactMode.IMPACT, ContactMode.STICK, ContactMode.SLIP, ContactMode.TOUCH]]

    @property
    def force(self) -> np.ndarray:
        """Normal force and those along the tangents, N, (n, 2), in space (n, 3)."""
        across = [] if self.lateral_force is None else [self.lateral_force]
        return np.column_stack([self.normal_force, self.tangential_force, *across])

    @property
    def friction(self) -> np.ndarray:
        """Size of the tangential force, N, (n,)."""
        return np.asarray(np.linalg.norm(self.force[:, 1:], axis=1))


class Switch(Record):
    """A change of contact mode at one moment; `time` in s of physical time."""

    time: float
    contact: str
    kind: Literal["touchdown", "takeoff", "stick_to_slip", "slip_to_stick", "slip_reversal"]


class Impulse(Record):
    """The impulse of one contact at one impact, N s, between its two samples at `time`, s of physical time."""

    time: float
    contact: str
    normal: float
    tangential: float
    lateral: float | None = None


class Status(Record):
    """Four separate answers and their conjunction.

    Attributes:
        solved: all of the answers below are good enough for the tolerances asked for.
        nlp: how the last NLP ended, in the words of `fesd_robot.mpcc.NlpStatus`.
        complementarity: largest product G H over all pairs, recomputed from the returned point.
        exact: the smooth problem on the sequence of contacts was solved, so that products are zero to round-off.
        natural_residual: largest min(G, H) over all pairs, recomputed from the returned point.
        constraint_violation: max-norm of all equality, inequality and bound violations, recomputed.
        stationarity: ``S``, ``M``, ``C``, ``W`` or ``none`` of a solved problem, else ``unknown``.
        b_stationary: ``certified`` if no feasible direction descends to first order, ``refuted`` if one does.
        b_stationary_reason: where a direction descends and what became of following it if it is refuted; how far the
            linearised cost falls at most if it is unknown and that was found; else empty.
        biactive: complementarity pairs of which both sides are zero.
        unresolved: pairs of which neither side is small enough to count as zero for the two answers above.
        audit_passed: every entry of `Audit.violations` is empty.
        near_miss: all that is missing is that entries of the audit are beyond their limits by a few per cent.
        given_up: in plans of version 0.1.0, that the motion of another start cost less.
        message: one sentence for the reader.
    """

    solved: bool
    nlp: str
    complementarity: float
    exact: bool = False
    natural_residual: float
    constraint_violation: float
    stationarity: Literal["S", "M", "C", "W", "none", "unknown"]
    b_stationary: Literal["certified", "refuted", "unknown"] = "unknown"
    b_stationary_reason: str = ""
    biactive: int = 0
    unresolved: int = 0
    audit_passed: bool
    near_miss: bool = False
    given_up: bool = False
    message: str


class Units(Record):
    """Unit of every coordinate and control by name."""

    configuration: dict[str, str]
    velocity: dict[str, str]
    controls: dict[str, str]


class HomotopyStep(Record):
    """One NLP of the homotopy: `sigma` relaxes the gap's conditions, `velocity_level_sigma` those on velocities."""

    sigma: float
    velocity_level_sigma: float
    status: str
    iterations: int
    objective: float
    complementarity: float
    constraint_violation: float
    seconds: float


class Attempt(Record):
    """One attempt at the task.

    Attributes:
        changes: ``section.key`` of the task -> value, of everything that was changed for it.
        kept: whether the plan is that of this attempt; False for all of them in plans that do not say it.
        solved, objective, iterations, seconds, message: what came of it, s with the time to build it.
        given_up: in plans of version 0.1.0, that the motion of another start cost less.
    """

    changes: dict[str, Any]
    kept: bool = False
    solved: bool
    objective: float
    iterations: int
    seconds: float
    message: str
    given_up: bool = False


class Refinement(Record):
    """How an exact motion was refined.

    Attributes:
        rounds, seconds: how often, and how long it took.
        elements: finite elements of the refined motion.
        largest_local_error: estimated error that an element of it makes, relative to one plus the largest value of each
            state; the largest of all.
    """

    rounds: int
    seconds: float
    elements: int
    largest_local_error: float


class TriedSequence(Record):
    """A sequence of phases that was solved.

    Attributes:
        what: where it came from, or what was changed, in words.
        sequence: what every contact does, phase by phase: F flies, S sticks, + and - slip along and against the
            tangent, L slips; ! in front of a phase that begins with an impact.
        cost: None where no motion was found, or none that costs less.
        seconds: since the first sequence was solved.
        kept: whether it was the cheapest so far.
    """

    what: str
    sequence: str
    cost: float | None
    seconds: float
    kept: bool


class LocalSearch(Record):
    """How cheaper neighbours of an exact motion were looked for.

    Attributes:
        seconds, iterations: how long it took, IPOPT iterations.
        trials: neighbours that were tried.
        cost_before: of the exact motion that was found first.
        moves: what was changed, one after the other, in words, with the cost afterwards, which may rise first.
        sequences: of phases that were solved, in this order; None where the control grid did not move.
    """

    seconds: float
    iterations: int
    trials: int
    cost_before: float
    moves: list[str]
    sequences: list[TriedSequence] | None = None


class Statistics(Record):
    """Sizes, effort and cost of the solve; `attempts` are all there were, the others describe the one that was kept.

    Attributes:
        iterations: of IPOPT, in `homotopy` and in the search.
        homotopy: every NLP but the trials of the search: of the homotopy, of polishing, refinement and descent.
        stages: of every element; more than `method.stages` where refinement added some; None in plans that do not say
            it.
        search: None if the motion is not exact, and in plans that do not say it.
        refinement: None if the motion is not exact, and in plans that do not say it.
    """

    variables: int
    constraints: int
    pairs: int
    stages: int | None = None
    search: LocalSearch | None = None
    refinement: Refinement | None = None
    iterations: int
    build_seconds: float
    solve_seconds: float
    objective: float
    cost_terms: dict[str, float]
    homotopy: list[HomotopyStep]
    attempts: list[Attempt] = Field(default_factory=list)

    @property
    def kept_attempt(self) -> Attempt | None:
        """The attempt that the plan is of, None if none is written down.

        Plans that do not say it are of the cheapest solved one, else of the first.
        """
        solved = [each for each in self.attempts if each.solved]
        cheapest = min(solved, key=lambda each: each.objective) if solved else next(iter(self.attempts), None)
        return next((each for each in self.attempts if each.kept), cheapest)

    @property
    def settings_tried(self) -> int:
        """How many settings were tried one after the other."""
        return 1 + sum(bool(each.changes) for each in self.attempts)


class SimulationNote(Record):
    """Where a simulated motion was not the only one; `time` in s."""

    time: float
    message: str


class SimulationSummary(Record):
    """How a motion was simulated.

    Attributes:
        events: changes of contacts, and of joints with dry friction.
        impacts: how many.
        steps: of the integrator.
        notes: where it was not the only motion.
    """

    events: int
    impacts: int
    steps: int
    notes: list[SimulationNote]


class Provenance(Record):
    """Where the plan comes from.

    Attributes:
        versions: package name -> version.
        git: first 12 digits of the commit that is checked out where the task lies, or ``none``; in plans of earlier
            versions what git describes it as.
        created: UTC time, ISO 8601.
        folder: absolute path of the folder where relative paths in the task start; None in plans that do not say it.
    """

    versions: dict[str, str]
    git: str
    created: str
    folder: str | None = None


class Plan(Record):
    """A planned motion, lossless in `plan.json`.

    Attributes:
        controls: ``time`` (start of each control interval, s) and one array per control name.
        contacts: contact name -> history on `trajectory.time`.
        task: the task as it was solved, with every default filled in.
        control_limits: control -> lower and upper limit, N or N m, infinite where there is none; None in plans that do
            not say it.
        full_model: the motion on all joints of the model file; None in plans that do not say it.
        outcome: by how much the goal is missed, and flights, slides and impacts of every contact; None in plans that an
            earlier version wrote, which did not measure it.
        replay: how far rigid bodies with the plan's controls come from it; None in plans that do not say it.
        joint_friction: velocity coordinate with dry friction -> history on `trajectory.time`.
        joint_switches: where these stick and slide, in time order.
        landing_orders: what another order would change of landings in which several contacts hit at once.
        warnings: sentences about bodies that go below the ground or into each other where no contact keeps them out,
            contacts that use all of their friction, and landings that depend on the order of their contacts.
        finite_elements: the solution as it was found, for `solver.warm_start`; None where it is not exact, and in plans
            that do not have it.
        gains: feedback along it, where the task asks for `output.gains`.
        simulation: of a motion that was not planned but simulated; its statistics are zero then.
    """

    schema_version: Literal[1, 2] = SCHEMA_VERSION
    name: str
    status: Status
    audit: Audit
    units: Units
    trajectory: Trajectory
    controls: dict[str, Array]
    contacts: dict[str, ContactHistory]
    switches: list[Switch]
    impulses: list[Impulse]
    statistics: Statistics
    provenance: Provenance
    task: dict[str, Any]
    control_limits: dict[str, tuple[float, float]] | None = None
    full_model: FullModelMotion | None = None
    outcome: Outcome | None = None
    replay: ReplaySummary | None = None
    joint_friction: dict[str, JointFrictionHistory] = Field(default_factory=dict)
    joint_switches: list[JointSwitch] = Field(default_factory=list)
    landing_orders: list[LandingOrder] = Field(default_factory=list)
    warnings: list[str] = Field(default_factory=list)
    finite_elements: FiniteElements | None = None
    gains: TrackingGains | None = None
    simulation: SimulationSummary | None = None

    @property
    def in_space(self) -> bool:
        """Whether contacts have forces in two tangential directions."""
        return any(one.lateral_force is not None for one in self.contacts.values())

    @checked
    def at(self, time: float | Sequence[float] | np.ndarray, side: Side | Sequence[Side] = "before") -> MotionAt:
        """Return the motion at any time, from the polynomials that the scheme has in every finite element.

        Positions and velocities are those of the collocation polynomials, accelerations their derivatives by the clock,
        forces the polynomials through those at the stages: the equations of motion hold exactly at the stages, and as
        accurately as the plan is between them.

        Args:
            time: physical time, s, or several, (m,), within the motion, in any order.
            side: at an impact, where velocities jump, and at the end of a control interval, where controls do, which
                of the two values is meant: ``before`` or ``after``; or one for every time, (m,).

        Raises:
            PlanFileError: a time outside of the motion, or a plan without its finite elements, as one that is not
                exact or that an earlier version wrote.
        """
        from fesd_robot.plans.sampling import planned_motion  # scipy takes long to import

        return planned_motion(self).at(time, side)

    def __repr__(self) -> str:
        """Return the plan in a line; its fields are many."""
        return f"<Plan {self.name}: {self.status.message}>"

    def _repr_html_(self) -> str:
        """Return the plan as a notebook shows it: its verdict in words, and the page that plays the motion."""
        return str(by_name("fesd_robot.actions", "plan_html")(self))
