"""The entries of an audit: the one table of what is measured, in which unit, and how large it may be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from pydantic import Field

from fesd_robot.plans.record import Record

NEAR_MISS = 0.1
"""Of a limit; an entry that is beyond it by no more than this misses it nearly."""


@dataclass(frozen=True)
class AuditScales:
    """How large a robot and its motion are.

    Attributes:
        weight: of the robot under standard gravity, N.
        turnover: energy that the motion turns over in a control interval, on average, J: the work of controls, contacts
            and damping, the losses of impacts, and what potential energy changes, each without its sign.
    """

    weight: float
    turnover: float


@dataclass(frozen=True)
class AuditEntry:
    """Unit, tolerance and words of one entry of an audit.

    Args:
        meaning: what is measured, in words.
        unit: of the value; empty for a pure number.
        tolerance: the largest value that passes; of a smallest value, how far below zero it may lie.
        weight_ratio: the tolerance of a force is at least this times the robot's weight.
        turnover_ratio: the tolerance of an energy is at least this times what the motion turns over in an interval.
        smallest: whether the value is the smallest of all, so that it passes down to minus its tolerance.
    """

    meaning: str
    unit: str
    tolerance: float
    weight_ratio: float = 0.0
    turnover_ratio: float = 0.0
    smallest: bool = False

    def limit(self, scales: AuditScales) -> float:
        """Return the tolerance for a robot and a motion of this size."""
        return max(self.tolerance, self.weight_ratio * scales.weight, self.turnover_ratio * scales.turnover)

    def excess(self, value: float) -> float:
        """Return the number that is compared with the limit: a value, or the negative of a smallest one."""
        return -value if self.smallest else value

    def passes(self, value: float, limit: float) -> bool:
        """Return whether a value keeps to its limit; NaN does not."""
        return self.excess(value) <= limit

    def bound(self, limit: float) -> str:
        """Return the limit as an inequality in words, e.g. ``<= 0.001``."""
        return f">= -{limit:g}" if self.smallest else f"<= {limit:g}"


class Finding(Record):
    """One thing that is not as it should be, in words.

    Attributes:
        entry: of the audit, or ``replay`` for what the replay notes, which is no violation by itself.
        time: s; None if it has no place in time.
        interval: number of the control interval.
        subject: name of a contact, a coordinate, a control or a constraint.
        value: of the entry; None of a note.
        sentence: where, when, what, why that is impossible, and what would help.
    """

    entry: str
    time: float | None = None
    interval: int | None = None
    subject: str = ""
    value: float | None = None
    sentence: str


class Audit(Record):
    """Physics recomputed from the trajectory with Pinocchio's numeric algorithms.

    Every entry is a field annotated with its `AuditEntry`, so that meaning, unit and tolerance stand beside its name;
    `ENTRIES` lists them. One that is None was not checked; an entry added later may be None, so that earlier plans
    can still be read.

    Attributes:
        tolerances: the limit each entry was compared with.
        defaults: name of an entry whose limit the task gives -> the default in whose place it is.
        violations: names of the entries beyond their limit.
        findings: one for every violation, causes before consequences and the worst first, and what the replay notes;
            empty in plans that do not say it.
    """

    min_gap: Annotated[
        float | None,
        AuditEntry("the smallest true gap over all contacts, at stages and between them", "m", 1e-3, smallest=True),
    ] = None
    max_gap_drift: Annotated[
        float, AuditEntry("the largest difference between the true gap and the integrated one", "m", 5e-3)
    ]
    max_clock_error: Annotated[float, AuditEntry("the largest |t(k) - t_k| over the control grid", "s", 1e-6)]
    max_theta_sum_error: Annotated[float, AuditEntry("the largest |sum of the multipliers - 1|", "", 1e-6)]
    max_friction_cone_violation: Annotated[
        float,
        AuditEntry(
            "the largest excess of a tangential force over mu times the normal force, at stages and, in the planned "
            "modes, at the ends of elements and between stages",
            "N",
            1e-2,
            weight_ratio=1e-4,
        ),
    ]
    max_stick_slip_violation: Annotated[
        float,
        AuditEntry(
            "the largest min(tangential speed, unused friction) of a closed contact, and the largest power in W that "
            "friction adds; zero if every contact either sticks or slips against its friction",
            "m/s or N",
            1e-2,
        ),
    ]
    max_impact_law_error: Annotated[
        float,
        AuditEntry(
            "the largest difference between the normal velocity after an impact and -e times that before, with the "
            "coefficient of restitution e, as a ratio of the approach where that is faster than 1 m/s, and the "
            "largest part of M (v+ - v-) that impulses within the friction cone do not explain",
            "m/s or N s",
            1e-3,
        ),
    ]
    max_normal_force_violation: Annotated[
        float,
        AuditEntry(
            "the largest pulling (negative) normal force, at stages and, in the planned modes, at the ends of elements "
            "and between stages",
            "N",
            1e-2,
            weight_ratio=1e-4,
        ),
    ]
    max_dynamics_error: Annotated[
        float,
        AuditEntry(
            "the largest part of M a + h - B u that contacts and dry friction cannot supply",
            "relative",
            1e-3,
        ),
    ]
    max_position_limit_violation: Annotated[
        float, AuditEntry("the largest excess over a position limit, at stages and between them", "m or rad", 1e-6)
    ]
    max_velocity_limit_violation: Annotated[
        float, AuditEntry("the largest excess over a velocity limit, at stages and between them", "m/s or rad/s", 1e-6)
    ]
    max_control_limit_violation: Annotated[
        float, AuditEntry("the largest excess over a limit of the controls", "N or N m", 1e-6)
    ]
    max_position_defect: Annotated[
        float,
        AuditEntry(
            "the largest difference between the change of configuration and the integral of the velocity over a "
            "control interval",
            "m or rad",
            1e-3,
        ),
    ]
    max_energy_error: Annotated[
        float,
        AuditEntry(
            "the largest mismatch of the energy balance over a control interval, in which contacts add no energy",
            "J",
            1e-2,
            turnover_ratio=2e-3,
        ),
    ]
    max_slip_violation: Annotated[
        float | None,
        AuditEntry(
            "the largest tangential velocity of a closed contact that may not slip, outside impacts", "m/s", 1e-3
        ),
    ] = None
    max_slip_distance_violation: Annotated[
        float | None,
        AuditEntry("the largest excess of what a contact slips in all over the distance that it may slip", "m", 1e-6),
    ] = None
    max_reserve_violation: Annotated[
        float | None,
        AuditEntry(
            "the largest part of its cone of friction that a contact uses beyond what its reserve leaves it, where it "
            "sticks or comes to rest",
            "",
            1e-2,
        ),
    ] = None
    max_constraint_violation: Annotated[
        float | None,
        AuditEntry("the largest violation of the task's constraints, at stages and between them", "m", 1e-6),
    ] = None
    max_goal_violation: Annotated[
        float | None,
        AuditEntry(
            "the largest violation of the hard goals, the start, a period and the bounds of a free duration",
            "m, rad or per s",
            1e-6,
        ),
    ] = None
    max_waypoint_violation: Annotated[
        float | None, AuditEntry("the largest violation of the waypoints' hard targets", "m, rad or per s", 1e-6)
    ] = None
    max_replay_position_error: Annotated[
        float | None,
        AuditEntry(
            "the largest error of a position at the end of a control interval, against rigid bodies with Coulomb "
            "friction that start from the plan's state at its beginning with the plan's controls",
            "m",
            1e-4,
        ),
    ] = None
    max_replay_angle_error: Annotated[float | None, AuditEntry("the same of an angle", "rad", 1e-3)] = None
    max_replay_velocity_error: Annotated[
        float | None, AuditEntry("the same of a velocity, also directly after an impact", "m/s", 1e-2)
    ] = None
    max_replay_angular_velocity_error: Annotated[
        float | None, AuditEntry("the same of an angular velocity, also directly after an impact", "rad/s", 1e-1)
    ] = None
    max_improper_slide_time: Annotated[
        float | None,
        AuditEntry(
            "the time in which a contact slides although a larger normal force would press it into the ground "
            "(Painleve's paradox)",
            "s",
            1e-6,
        ),
    ] = None
    max_force_at_opening: Annotated[
        float | None,
        AuditEntry(
            "the largest normal force that a contact still carries when it opens inside a control interval without an "
            "impact",
            "N",
            1e-1,
            weight_ratio=1e-3,
        ),
    ] = None
    max_joint_friction_violation: Annotated[
        float | None,
        AuditEntry(
            "the largest excess of the dry friction of a joint over its limit, at stages and, in the planned modes, at "
            "the ends of elements and between stages",
            "N or N m",
            1e-2,
        ),
    ] = None
    max_joint_slide_violation: Annotated[
        float | None,
        AuditEntry(
            "the largest min(speed, unused friction) of a joint with dry friction, and the largest power in W that "
            "this friction adds; zero if every joint either sticks or slides against its friction",
            "m/s, rad/s, N or N m",
            1e-2,
        ),
    ] = None
    max_compliant_force_error: Annotated[
        float | None,
        AuditEntry(
            "the largest difference of the force of a compliant contact from max(0, -stiffness gap - damping times the "
            "rate of the gap); zero without such contacts",
            "N",
            1e-2,
        ),
    ] = None
    max_quaternion_norm_error: Annotated[
        float | None,
        AuditEntry(
            "the largest difference of the length of a quaternion from one, at stages and between them; zero without "
            "quaternions",
            "",
            1e-8,
        ),
    ] = None
    max_impact_energy_gain: Annotated[
        float | None,
        AuditEntry(
            "the largest rise of the kinetic energy in an impact",
            "J",
            1e-3,
            turnover_ratio=2e-4,
        ),
    ] = None
    max_simultaneous_control: Annotated[
        float | None,
        AuditEntry(
            "the largest control of a second set of a group of which one set acts at a time; zero without such groups",
            "N or N m",
            1e-6,
        ),
    ] = None
    tolerances: dict[str, float]
    defaults: dict[str, float] = Field(default_factory=dict)
    violations: list[str]
    findings: list[Finding] = Field(default_factory=list)

    @classmethod
    def of(
        cls, values: Mapping[str, float], scales: AuditScales, given: Mapping[str, float] = MappingProxyType({})
    ) -> Audit:
        """Return the audit of measured values, each compared with its tolerance.

        Args:
            values: name of an entry -> value.
            scales: of the robot and its motion.
            given: name of an entry -> limit that the task asks for in place of the default.
        """
        usual = {name: entry.limit(scales) for name, entry in ENTRIES.items()}
        limits = {**usual, **given}
        violations = [name for name, value in values.items() if not ENTRIES[name].passes(value, limits[name])]
        defaults = {name: usual[name] for name in given}
        return cls(**dict(values), tolerances=limits, defaults=defaults, violations=violations)

    def ratio(self, name: str) -> float:
        """Return an entry that was checked in units of its limit, more than 1 beyond it and infinite for NaN."""
        ratio = ENTRIES[name].excess(getattr(self, name)) / self.tolerances[name]
        return math.inf if math.isnan(ratio) else ratio

    @property
    def near_misses(self) -> list[str]:
        """Names of the violated entries if none is beyond its limit by more than `NEAR_MISS` of it; else none."""
        return self.violations if all(map(self.nearly, self.violations)) else []

    def nearly(self, name: str) -> bool:
        """Return whether an entry is beyond its limit by no more than `NEAR_MISS` of it."""
        return name in ENTRIES and 1 < self.ratio(name) <= 1 + NEAR_MISS

    @property
    def worst(self) -> tuple[float, str]:
        """The largest ratio of an entry that was checked to its limit, infinite for NaN, and the entry's name."""
        return max((self.ratio(name), name) for name in ENTRIES if getattr(self, name) is not None)


ENTRIES: dict[str, AuditEntry] = {
    name: note for name, field in Audit.model_fields.items() for note in field.metadata if isinstance(note, AuditEntry)
}
"""Name of an entry of an audit -> what it measures and how large it may be."""
