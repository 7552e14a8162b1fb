"""What a plan and its audit say about the replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.plans import Plan
from fesd_robot.plans.audit_record import ENTRIES, AuditScales
from fesd_robot.plans.measured import Names
from fesd_robot.plans.replay_record import ReplaySummary, replay_entries, replay_summary
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.intervals import replay_intervals

from .motions import drop, tumble

NAMES = ["root_x", "root_z", "root_pitch", "leg"]
ALL_NAMES = Names(
    contacts=["foot"],
    configuration=dict(zip(NAMES, ["m", "m", "rad", "m"], strict=True)),
    velocity=dict(zip(NAMES, ["m/s", "m/s", "rad/s", "m/s"], strict=True)),
    controls={"torque": "N m", "leg": "N"},
)
REPLAY_ENTRIES = {name for name in ENTRIES if name.startswith("max_replay")}


def tumble_off_by(error: float) -> PhysicalMotion:
    """The tumble, whose end is off by `error` in pitch and pitch rate."""
    motion = tumble()
    motion.configuration[-1, 2] += error
    motion.velocity[-1, 2] += 100 * error
    return motion


def test_motions_in_closed_form_keep_all_replay_entries(physics: NumericPhysics) -> None:
    """A flight and a drop with its impact and stance obey the laws that the replay integrates."""
    for motion in (tumble(), drop()):
        entries = replay_entries(replay_intervals(motion, physics), motion, ALL_NAMES)
        assert set(entries) == REPLAY_ENTRIES
        assert max(one.value for one in entries.values()) < 1e-8


def test_errors_of_angles_and_lengths_are_told_apart(physics: NumericPhysics) -> None:
    """An error in the pitch is one in rad and rad/s only, beyond those entries' tolerances."""
    motion = tumble_off_by(0.002)
    found = replay_entries(replay_intervals(motion, physics), motion, ALL_NAMES)
    entries = {name: one.value for name, one in found.items()}
    assert entries["max_replay_angle_error"] == pytest.approx(0.002, abs=1e-8)
    assert entries["max_replay_angular_velocity_error"] == pytest.approx(0.2, abs=1e-8)
    assert max(entries["max_replay_position_error"], entries["max_replay_velocity_error"]) < 1e-8
    limits = {name: ENTRIES[name].limit(AuditScales(weight=1.0, turnover=0.0)) for name in entries}
    broken = {name for name, value in entries.items() if not ENTRIES[name].passes(value, limits[name])}
    assert broken == {"max_replay_angle_error", "max_replay_angular_velocity_error"}
    end = float(motion.configuration[-1, 2])
    for name in broken:
        assert (found[name].subject, found[name].interval, found[name].time) == ("root_pitch", 1, pytest.approx(0.2))
    words = f"{end:.5g} rad in the plan, {end - 0.002:.5g} rad in its replay"
    assert found["max_replay_angle_error"].detail == words


def test_a_summary_names_coordinate_interval_and_time(physics: NumericPhysics) -> None:
    """Median and largest error of every coordinate, and where: the last of two intervals."""
    summary = replay_summary(replay_intervals(tumble_off_by(0.002), physics), NAMES)
    pitch = summary.position["root_pitch"]
    assert (pitch.interval, pitch.time) == (1, pytest.approx(0.2))
    assert pitch.largest == pytest.approx(0.002, abs=1e-8)
    assert pitch.median == pytest.approx(0.001, abs=1e-8)
    assert summary.velocity["leg"].largest < 1e-8
    assert ReplaySummary.model_validate_json(summary.model_dump_json()) == summary


def test_a_state_that_is_no_number_passes_no_entry(physics: NumericPhysics) -> None:
    """NaN in a motion is a violation, and a note with the number of its interval."""
    motion = tumble()
    motion = replace(motion, velocity=np.where(motion.interval[:, None] == 0, np.nan, motion.velocity))
    replay = replay_intervals(motion, physics)
    entries = replay_entries(replay, motion, ALL_NAMES)
    assert not any(ENTRIES[name].passes(one.value, 1.0) for name, one in entries.items())
    assert replay_summary(replay, NAMES).notes == {"the motion cannot be integrated": [0, 1]}


def test_a_plan_has_its_replay(short_plan: Plan) -> None:
    """The audit's replay entries are the largest errors in the plan's record."""
    assert short_plan.replay is not None
    units = short_plan.units.velocity
    for entry, errors, unit in (
        ("max_replay_position_error", short_plan.replay.position, "m/s"),
        ("max_replay_angle_error", short_plan.replay.position, "rad/s"),
        ("max_replay_velocity_error", short_plan.replay.velocity, "m/s"),
        ("max_replay_angular_velocity_error", short_plan.replay.velocity, "rad/s"),
    ):
        largest = max(error.largest for name, error in errors.items() if units[name] == unit)
        assert getattr(short_plan.audit, entry) == largest
