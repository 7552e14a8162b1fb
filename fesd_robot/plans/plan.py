"""The result of planning: a trajectory in physical time, what the contacts did, and how far to trust it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer

SCHEMA_VERSION: Literal[1] = 1


def _to_array(value: Any) -> np.ndarray:
    try:
        array = np.asarray(value, dtype=float)
    except TypeError as error:
        raise ValueError("expected a list of numbers") from error
    if array.ndim != 1:
        raise ValueError(f"expected a list of numbers, found an array of {array.ndim} dimensions")
    return array


Array = Annotated[
    np.ndarray,
    BeforeValidator(_to_array),
    PlainSerializer(lambda array: array.tolist()),
]
"""A float array in Python, a list of numbers in JSON."""


class Record(BaseModel):
    """Base of all parts of a plan: frozen, closed against unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, ser_json_inf_nan="strings")


class Trajectory(Record):
    """Sampled motion in physical time; an impact stands twice at the same time, before and after.

    Attributes:
        time: physical time, s, shape (n,), non-decreasing.
        configuration: name of a configuration coordinate -> values, m or rad, shape (n,).
        velocity: name of a velocity coordinate -> values, m/s or rad/s, shape (n,).
    """

    time: Array
    configuration: dict[str, Array]
    velocity: dict[str, Array]


class ContactHistory(Record):
    """One contact along `Trajectory.time`.

    Attributes:
        gap: true signed distance, m, shape (n,).
        normal_force: N, shape (n,); zero in flight.
        tangential_force: N, shape (n,); positive along the ground's tangent.
        mode: ``flight``, ``impact``, ``stick`` or ``slip`` at each sample.
    """

    gap: Array
    normal_force: Array
    tangential_force: Array
    mode: list[Literal["flight", "impact", "stick", "slip"]]


class Switch(Record):
    """A change of contact mode; `time` in s of physical time."""

    time: float
    contact: str
    kind: Literal["touchdown", "takeoff", "stick_to_slip", "slip_to_stick", "slip_reversal"]


class Impulse(Record):
    """The impulse of one impact, N s; `time` in s of physical time."""

    time: float
    contact: str
    normal: float
    tangential: float


class Status(Record):
    """Four separate answers and their conjunction.

    Attributes:
        solved: all of the answers below are good enough for the tolerances asked for.
        nlp: the last NLP's own verdict (``converged``, ``iteration limit``, ``infeasible``, ``time limit``,
            ``interrupted`` or ``failed: ...``).
        complementarity: largest product a b over all pairs, recomputed from the returned point.
        exact: the smooth problem on the sequence of contacts was solved, so that products are zero to round-off.
        natural_residual: largest min(a, b) over all pairs, recomputed from the returned point.
        constraint_violation: max-norm of all equality, inequality and bound violations, recomputed.
        stationarity: ``S``, ``M``, ``C``, ``W`` or ``none`` of a solved problem, else ``unknown``.
        b_stationary: ``certified`` if no feasible direction descends to first order, ``refuted`` if one does.
        biactive: complementarity pairs of which both sides are zero.
        unresolved: pairs of which neither side is small enough to count as zero for the two answers above.
        audit_passed: every entry of `Audit.violations` is empty.
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
    biactive: int = 0
    unresolved: int = 0
    audit_passed: bool
    message: str


class Audit(Record):
    """Physics recomputed from the trajectory with Pinocchio's numeric algorithms.

    Attributes:
        min_gap: smallest true gap over all contacts and samples, m.
        max_gap_drift: largest difference between the true gap and the integrated one, m.
        max_clock_error: largest |t(k) - kT/N| over the control grid, s.
        max_theta_sum_error: largest |sum of the multipliers - 1|.
        max_friction_cone_violation: largest excess of |tangential| over mu * normal force, N.
        max_stick_slip_violation: largest min(tangential speed, unused friction) of a closed contact, m/s or N, and
            largest power that friction adds, W; zero if every contact either sticks or slips against its friction.
        max_impact_law_error: largest of the normal velocity left after an inelastic impact, m/s, as a share of the
            approach where that is faster than 1 m/s, and of the part of M (v+ - v-) that impulses within the friction
            cone do not explain, N s.
        max_normal_force_violation: largest pulling (negative) normal force, N.
        max_dynamics_error: largest part of M a + h - B u that closed contacts cannot supply, relative.
        max_position_limit_violation: m or rad.
        max_velocity_limit_violation: m/s or rad/s.
        max_control_limit_violation: unit of the control.
        max_position_defect: largest difference between the change of configuration and the integral of the velocity
            over a control interval, m or rad.
        max_energy_error: largest mismatch of the energy balance over a control interval, J.
        max_constraint_violation: of the task's constraints, m.
        max_goal_violation: of the hard goals, the start, a period and the bounds of a free duration, m, rad, m/s,
            rad/s or s.
        max_waypoint_violation: of the waypoints' hard targets, m, rad, m/s or rad/s; this and the two before it are
            None if they were not checked.
        tolerances: the limit each entry was compared with.
        violations: names of the entries beyond their limit.
    """

    min_gap: float
    max_gap_drift: float
    max_clock_error: float
    max_theta_sum_error: float
    max_friction_cone_violation: float
    max_stick_slip_violation: float
    max_impact_law_error: float
    max_normal_force_violation: float
    max_dynamics_error: float
    max_position_limit_violation: float
    max_velocity_limit_violation: float
    max_control_limit_violation: float
    max_position_defect: float
    max_energy_error: float
    max_constraint_violation: float | None = None
    max_goal_violation: float | None = None
    max_waypoint_violation: float | None = None
    tolerances: dict[str, float]
    violations: list[str]


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
    """One try at the task: what was changed for it, and what came of it."""

    changes: dict[str, Any]
    solved: bool
    objective: float
    iterations: int
    seconds: float
    message: str


class Statistics(Record):
    """Sizes, effort and cost of the solve; `attempts` are all tries, the others describe the one that was kept."""

    variables: int
    constraints: int
    pairs: int
    iterations: int
    build_seconds: float
    solve_seconds: float
    objective: float
    cost_terms: dict[str, float]
    homotopy: list[HomotopyStep]
    attempts: list[Attempt] = []


class Provenance(Record):
    """Where the plan comes from.

    Attributes:
        versions: package name -> version.
        git: state of the repository that the task lies in, or ``none``.
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
    """

    schema_version: Literal[1] = SCHEMA_VERSION
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
