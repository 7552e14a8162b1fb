"""What the audit has found, in words."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.audit_record import ENTRIES, Audit, AuditScales
from fesd_robot.plans.findings import findings_of, findings_of_notes
from fesd_robot.plans.measured import Measured
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.contacts import ReplayNote
from fesd_robot.replay.intervals import MotionReplay, replay_intervals

from .motions import tumble


def audit_with(values: dict[str, float]) -> tuple[Audit, dict[str, Measured]]:
    """An audit of these values, each measured at one place, and zeros."""
    audit = Audit.of({**dict.fromkeys(ENTRIES, 0.0), **values}, AuditScales(weight=1.0, turnover=1.0))
    return audit, {name: Measured(value, 0.25, 3, "foot") for name, value in values.items()}


@pytest.mark.parametrize("name", ENTRIES)
def test_every_entry_has_its_words(name: str) -> None:
    """A violation says where, when, at which contact or coordinate, by how much, and what may help."""
    size = -0.125 if ENTRIES[name].smallest else 0.125
    size *= 10
    (finding,) = findings_of(*audit_with({name: size}))
    assert (finding.entry, finding.time, finding.interval, finding.subject) == (name, 0.25, 3, "foot")
    assert finding.value == size
    assert finding.sentence.startswith("At t = 0.25 s (interval 3) ")
    assert "1.25" in finding.sentence and finding.sentence.endswith(" may help.")
    assert "{" not in finding.sentence


def test_a_violation_without_a_place_is_a_sentence() -> None:
    """What is true of the whole motion has no time."""
    audit, _ = audit_with({"max_slip_distance_violation": 0.5})
    (finding,) = findings_of(audit, {"max_slip_distance_violation": Measured(0.5, subject="foot")})
    assert finding.sentence.startswith("Contact 'foot' slips 0.5 m too far in all: its task limits the distance; ")


def test_causes_come_first_and_the_worst_of_them() -> None:
    """A contact that opens under a force explains its replay; of others the largest in units of its tolerance leads."""
    values = {"max_replay_angle_error": 9.0, "min_gap": -0.02, "max_energy_error": np.nan, "max_force_at_opening": 1.0}
    found = findings_of(*audit_with(values))
    assert [one.entry for one in found] == [
        "max_force_at_opening",
        "max_energy_error",
        "min_gap",
        "max_replay_angle_error",
    ]


def test_every_note_of_a_replay_is_said_once(physics: NumericPhysics) -> None:
    """The first interval that notes it is named, however many do."""
    intervals = replay_intervals(tumble(), physics).intervals
    assert findings_of_notes(MotionReplay(intervals)) == []
    noted = tuple(type(one)(**{**vars(one), "notes": frozenset(ReplayNote)}) for one in intervals)
    found = findings_of_notes(MotionReplay(noted))
    assert len(found) == len(ReplayNote) and {one.entry for one in found} == {"replay"}
    assert all(one.sentence.startswith("From t = 0 s on (interval 0) ") for one in found)


def test_plans_keep_findings_and_may_have_none(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> None:
    """They are in plan.json; one of an earlier version without them and without the newer entries is read as well."""
    findings = findings_of(*audit_with({"max_force_at_opening": 1.0}))
    found = plan.model_copy(update={"audit": plan.audit.model_copy(update={"findings": findings})})
    assert read_plan(write_plan(found, tmp_path_factory.mktemp("plan"))).audit.findings == findings
    old = plan.audit.model_dump(exclude={"findings", "max_force_at_opening", "max_improper_slide_time"})
    read = Audit.model_validate(old)
    assert (read.findings, read.max_force_at_opening, read.max_improper_slide_time) == ([], None, None)
