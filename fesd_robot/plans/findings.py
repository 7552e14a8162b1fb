"""Findings of an audit in words: where, when, what is impossible there, and what would help."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fesd_robot.plans.audit_record import ENTRIES, Audit, Finding
from fesd_robot.plans.measured import Measured
from fesd_robot.replay import MotionReplay, ReplayNote

REPLAY = "replay"
"""Entry of a finding that is a note of the replay."""


@dataclass(frozen=True)
class _Words:
    """A sentence ``WHAT: WHY; HELP may help``, with the fields {subject} and {value}.

    `rank` is zero for what causes other violations, and two for what is mostly caused by others.
    """

    what: str
    why: str
    help: str
    rank: int = 1


_EXACT = "a smaller method.accuracy"
_SMOOTHER = f"{_EXACT}, another initial guess (solver.seed), more horizon.intervals, or smaller limits of the controls"
_SOLVED = "a smaller solver.tolerance, or another initial guess (solver.seed)"
_POSTURE = "smaller friction, another posture there, or another initial guess (solver.seed)"
_NOT_FOLLOWED = "rigid bodies with Coulomb friction do not follow the plan from its own state with its own controls"
_REPLAYED = f"{_EXACT}, or, where a contact slides or opens, {_POSTURE}"

_WORDS = {
    "min_gap": _Words("contact {subject} is {value} inside what it touches", "bodies do not enter each other", _EXACT),
    "max_gap_drift": _Words(
        "the gap of contact {subject} and the one at which the plan switches are {value} apart",
        "contact begins where bodies do not touch",
        f"{_EXACT}, or a larger method.formulation.baumgarte_gain",
    ),
    "max_clock_error": _Words(
        "the physical time is {value} from the control grid", "controls change at another time", _SOLVED
    ),
    "max_theta_sum_error": _Words(
        "the multipliers of contact miss their definition by {value}", "the forces are those of no mode", _SOLVED
    ),
    "max_friction_cone_violation": _Words(
        "contact {subject} needs {value} of friction more than there is", "it would slip", _SMOOTHER
    ),
    "max_stick_slip_violation": _Words(
        "contact {subject} slides by {value} without all of its friction against the slide",
        "Coulomb friction of a slide is mu times the normal force and opposes it",
        _SOLVED,
    ),
    "max_normal_force_violation": _Words(
        "contact {subject} pulls with {value}", "what touches can only push", _SMOOTHER
    ),
    "max_impact_law_error": _Words(
        "the impact of contact {subject} misses the impact law by {value}",
        "no impulses within the friction cone give this velocity, or it is not that of the restitution",
        _SOLVED,
    ),
    "max_impact_energy_gain": _Words(
        "the impact of contact {subject} adds {value}",
        "no impact gains energy, although Newton's law of restitution with friction may ask for it",
        "a smaller restitution, smaller friction, or another posture there",
    ),
    "max_dynamics_error": _Words(
        "forces have no source, {value}", "controls and closed contacts do not give the acceleration", _EXACT
    ),
    "max_position_limit_violation": _Words("{subject} is {value} beyond its limit", "the joint ends there", _EXACT),
    "max_velocity_limit_violation": _Words("{subject} is {value} beyond its limit", "it cannot be faster", _EXACT),
    "max_control_limit_violation": _Words("{subject} is {value} beyond its limit", "it cannot be stronger", _SOLVED),
    "max_position_defect": _Words(
        "{subject} has moved {value} from where its velocity leads", "positions are integrals of velocities", _EXACT
    ),
    "max_energy_error": _Words(
        "energy of {value} has come or gone within the interval",
        "work of controls and friction and the losses of impacts do not account for it",
        _EXACT,
    ),
    "max_slip_violation": _Words("contact {subject} slips at {value}", "its task forbids that it slips", _SOLVED),
    "max_slip_distance_violation": _Words(
        "contact {subject} slips {value} too far in all", "its task limits the distance", _EXACT
    ),
    "max_reserve_violation": _Words(
        "contact {subject} uses {value} of its cone of friction more than it may",
        "its task keeps a reserve where it sticks",
        "slipping: forbidden, more time, or a smaller reserve.friction",
    ),
    "max_constraint_violation": _Words("constraint {subject} is violated by {value}", "the task demands it", _EXACT),
    "max_goal_violation": _Words(
        "{subject} misses goal, start, period or duration by {value}",
        "the task demands it",
        "more time, higher limits, a larger goal.tolerance, or goal.soft: true",
    ),
    "max_waypoint_violation": _Words(
        "{subject} misses its waypoint by {value}", "the task demands it", "more time, higher limits, or more tolerance"
    ),
    "max_replay_position_error": _Words("{subject} is {value} off", _NOT_FOLLOWED, _REPLAYED, rank=2),
    "max_replay_angle_error": _Words("{subject} is {value} off", _NOT_FOLLOWED, _REPLAYED, rank=2),
    "max_replay_velocity_error": _Words("the velocity of {subject} is {value} off", _NOT_FOLLOWED, _REPLAYED, rank=2),
    "max_replay_angular_velocity_error": _Words(
        "the velocity of {subject} is {value} off", _NOT_FOLLOWED, _REPLAYED, rank=2
    ),
    "max_improper_slide_time": _Words(
        "contact {subject} begins to slide for {value} in a mode that is not proper",
        "a larger normal force would press it into the ground, so that bodies in contact do not build it up (Painleve)",
        _POSTURE,
        rank=0,
    ),
    "max_joint_friction_violation": _Words(
        "joint {subject} needs {value} of dry friction more than it has", "it would slide", _SMOOTHER
    ),
    "max_joint_slide_violation": _Words(
        "joint {subject} slides by {value} without all of its dry friction against the slide",
        "dry friction of a joint that moves is its limit and opposes the motion",
        _SOLVED,
    ),
    "max_compliant_force_error": _Words(
        "the force of compliant contact {subject} is {value} off that of its spring and damper",
        "its compression decides its force",
        _SOLVED,
    ),
    "max_simultaneous_control": _Words(
        "control {subject} has {value} while another set of its group acts", "one of them acts at a time", _SOLVED
    ),
    "max_quaternion_norm_error": _Words(
        "the length of the quaternion of {subject} is {value} off one",
        "only unit quaternions are rotations",
        _EXACT,
    ),
    "max_force_at_opening": _Words(
        "contact {subject} opens while it still carries {value}",
        "the force would have to end without a cause",
        _POSTURE,
        rank=0,
    ),
}

_NOTES = {
    ReplayNote.NOT_UNIQUE: _Words(
        "several motions obey Coulomb's law", "rigid bodies do not decide between them", _POSTURE
    ),
    ReplayNote.IMPROPER: _Words(
        "all motions that obey Coulomb's law slide in a mode that is not proper",
        "a larger normal force would press the contact into the ground (Painleve)",
        _POSTURE,
    ),
    ReplayNote.NO_MODE: _Words(
        "no motion obeys Coulomb's law", "rigid bodies cannot go on without an impact (Painleve)", _POSTURE
    ),
    ReplayNote.UNFINISHED_IMPACT: _Words(
        "an impact does not end", "contacts go on approaching under their impulses", _POSTURE
    ),
    ReplayNote.MANY_EVENTS: _Words("contacts open and close too often", "the replay has stopped looking", _POSTURE),
    ReplayNote.MANY_STEPS: _Words(
        "rigid bodies have no motion that goes on", "forces grow beyond any bound in the replay", _POSTURE
    ),
    ReplayNote.FAILED: _Words("the motion cannot be integrated", "its states or forces are no numbers", _SOLVED),
    ReplayNote.IN_TURN: _Words(
        "contacts that hit at the same instant do so one after the other",
        "rigid bodies do not say in which order, and other orders lead elsewhere",
        _POSTURE,
    ),
}


def findings_of(audit: Audit, measured: Mapping[str, Measured]) -> list[Finding]:
    """Return a finding for every violated entry: causes before consequences, and of them the worst first.

    Args:
        audit: with its violations.
        measured: name of an entry -> worst value and its place.
    """

    def order(name: str) -> tuple[int, float]:
        excess = abs(measured[name].value) / audit.tolerances[name]
        return _WORDS[name].rank, -np.inf if np.isnan(excess) else -excess

    return [_finding(name, measured[name]) for name in sorted(audit.violations, key=order)]


def findings_of_notes(replay: MotionReplay) -> list[Finding]:
    """Return a finding for everything that a replay notes, at the first interval that does, without repetition."""
    found: dict[ReplayNote, Finding] = {}
    for one in replay.intervals:
        for note in sorted(one.notes):
            words = _NOTES[note]
            sentence = f"From t = {one.start:.4g} s on (interval {one.interval}) {_said(words, words.what)}"
            place = {"time": one.start, "interval": one.interval}
            found.setdefault(note, Finding(entry=REPLAY, **place, sentence=sentence))
    return list(found.values())


def _finding(name: str, measured: Measured) -> Finding:
    value = f"{abs(measured.value):.3g} {measured.unit or ENTRIES[name].unit}".rstrip()
    what = _WORDS[name].what.format(subject=f"'{measured.subject}'" if measured.subject else "it", value=value)
    detail = f" ({measured.detail})" if measured.detail else ""
    said = _said(_WORDS[name], what + detail)
    if measured.time is not None:
        sentence = f"At t = {measured.time:.4g} s (interval {measured.interval}) {said}"
    else:
        sentence = said[0].upper() + said[1:]
    return Finding(
        entry=name,
        time=measured.time,
        interval=measured.interval,
        subject=measured.subject,
        value=measured.value,
        sentence=sentence,
    )


def _said(words: _Words, what: str) -> str:
    return f"{what}: {words.why}; {words.help} may help."
