"""False plans: each breaks one law of rigid bodies, and the audit says which one, where, when and at which contact."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import names_of, numeric_physics
from fesd_robot.plans.audit import MotionLimits, audit
from fesd_robot.plans.audit_record import Audit, Finding
from fesd_robot.plans.findings import findings_of_notes
from fesd_robot.plans.measured import Names
from fesd_robot.plans.replay_record import replay_entries
from fesd_robot.plans.stage_forces import StageForces
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.intervals import replay_intervals
from fesd_robot.task import load_task

from ..replay.bodies import GRAVITY, ROD_LENGTH, point, rod
from .driven import Span, driven
from .motions import FRICTION, STOP, Hit, Segment, motion_of, stance, tumble

TASKS = Path(__file__).parents[2] / "tasks"
HOPPER = Names(
    contacts=["foot"],
    configuration={"root_x": "m", "root_z": "m", "root_pitch": "rad", "leg": "m"},
    velocity={"root_x": "m/s", "root_z": "m/s", "root_pitch": "rad/s", "leg": "m/s"},
    controls={"torque": "N m", "force": "N"},
)
POINT = Names(["foot"], {"x": "m", "z": "m"}, {"x": "m/s", "z": "m/s"}, {"push_x": "N", "push_z": "N"})
ROD = Names(
    ["tip"],
    {"x": "m", "z": "m", "pitch": "rad"},
    {"x": "m/s", "z": "m/s", "pitch": "rad/s"},
    {"push_x": "N", "push_z": "N", "torque": "N m"},
)


def audited(
    motion: PhysicalMotion,
    physics: NumericPhysics,
    names: Names,
    position_limits: tuple[np.ndarray, np.ndarray] | None = None,
) -> Audit:
    """Return the audit with its replay, of a motion without limits unless some are given."""
    replay = replay_intervals(motion, physics)

    def free(units: dict[str, str]) -> tuple[np.ndarray, np.ndarray]:
        return np.full(len(units), -np.inf), np.full(len(units), np.inf)

    found = audit(
        motion,
        physics,
        names=names,
        interval_ends=motion.clock,
        limits=MotionLimits(
            position=position_limits or free(names.configuration),
            velocity=free(names.velocity),
            control=free(names.controls),
        ),
        others=replay_entries(replay, motion, names),
    )
    return found.model_copy(update={"findings": [*found.findings, *findings_of_notes(replay)]})


def about(found: Audit, entry: str) -> Finding:
    """Return the finding of an entry, which has to be violated."""
    assert entry in found.violations
    return next(finding for finding in found.findings if finding.entry == entry)


def consequences(found: Audit) -> set[str]:
    """Return the violations but those of the replay."""
    return {name for name in found.violations if not name.startswith("max_replay")}


def limits(names: Names, **upper: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position limits of which only these upper ones are finite."""
    return np.full(len(names.configuration), -np.inf), np.array([upper.get(n, np.inf) for n in names.configuration])


def paradox(spans: list[Span]) -> PhysicalMotion:
    """A rod at 1.1 rad whose tip slides ahead at 1 m/s and turns so fast that it may slide on, improperly, or lift."""
    angle, turning, physics = 1.1, 8.0, rod(2.0)
    q = np.array([0.0, ROD_LENGTH / 2 * math.sin(angle), -angle])
    upwards, along = physics.contact_jacobian(q) @ np.array([0.0, 0.0, turning])
    return driven(physics, q, [-1.0 - along, -upwards, turning], spans)


NOTHING = [0.0, 0.0, 0.0]


def test_a_slide_on_an_improper_branch() -> None:
    """The friction of a rod's leading tip presses it into the ground: the force obeys Coulomb's law and is none."""
    motion = paradox([Span(0, 0.005, ContactMode.SLIP_BACKWARDS, NOTHING)])
    assert motion.force[:, 0, 0].min() > 20
    found = audited(motion, rod(2.0), ROD)
    assert consequences(found) == {"max_improper_slide_time"}
    assert found.max_improper_slide_time == pytest.approx(0.005)
    finding = found.findings[0]
    assert (finding.entry, finding.time, finding.subject) == ("max_improper_slide_time", 0.0, "tip")
    assert "At t = 0 s (interval 0) contact 'tip' begins to slide for 0.005 s in a mode that is not" in finding.sentence
    note = found.findings[-1]
    assert note.entry == "replay" and note.interval == 0
    assert "From t = 0 s on (interval 0) several motions obey Coulomb's law" in note.sentence


def test_a_biped_that_slides_on_a_branch_which_the_law_does_not_reach() -> None:
    """At rest with friction 0.8 its feet may stick; a slide that its own friction presses on obeys the law, too."""
    motion = formulate(load_task(TASKS / "biped_step.yaml", ["ground.friction=0.8"]))
    physics, robot = numeric_physics(motion), motion.robot
    modes = (ContactMode.SLIP_BACKWARDS, ContactMode.STICK)
    spans = [Span(0, 0.01, modes, [56.9, 23.64, -40.65, -35.61])]
    false = driven(physics, motion.endpoints.initial_configuration, np.zeros(robot.model.nv), spans)
    assert false.force[:, 0, 0].min() > 5
    found = audited(false, physics, names_of(motion))
    assert consequences(found) == {"max_improper_slide_time"}
    assert 0.008 < found.max_improper_slide_time <= 0.01
    finding = about(found, "max_improper_slide_time")
    assert (finding.interval, finding.subject) == (0, "left")
    assert any(name.startswith("max_replay") for name in found.violations)
    assert "several motions obey Coulomb's law" in found.findings[-1].sentence


def test_a_proper_slide_is_none(physics: NumericPhysics) -> None:
    """The hopper's foot slides in a proper mode, as its friction says: nothing is found."""
    found = audited(stance(FRICTION, 0.6), physics, HOPPER)
    assert (found.violations, found.findings, found.max_improper_slide_time) == ([], [], 0)


@pytest.mark.parametrize(("interval", "opens"), [(0, True), (1, False)])
def test_a_contact_that_opens_under_a_force(interval: int, opens: bool) -> None:
    """Within a control interval a force cannot end at once; where the control jumps it may."""
    spans = [Span(0, 0.004, ContactMode.SLIP_BACKWARDS, NOTHING), Span(interval, 0.006, ContactMode.FLIGHT, NOTHING)]
    motion = paradox(spans)
    found = audited(motion, rod(2.0), ROD)
    assert ("max_force_at_opening" in found.violations) == opens
    if opens:
        assert found.max_force_at_opening == pytest.approx(motion.force[2, 0, 0], rel=1e-6)
        sentence = about(found, "max_force_at_opening").sentence
        assert sentence.startswith("At t = 0.004 s (interval 0) contact 'tip' opens while it still carries 22.1 N: the")


def test_a_foot_that_sticks_beyond_its_cone() -> None:
    """A push of 1.04 times what friction holds, in the last interval, and the point does not move."""
    most = 0.5 * GRAVITY
    spans = [Span(k, 0.05, ContactMode.STICK, [part * most, 0.0]) for k, part in ((0, 0.9), (1, 1.04))]
    found = audited(driven(point(0.5), [0.0, 0.0], [0.0, 0.0], spans), point(0.5), POINT)
    assert consequences(found) == {"max_friction_cone_violation"}
    finding = about(found, "max_friction_cone_violation")
    assert finding.value == pytest.approx(0.04 * most) and finding.interval == 1
    assert "(interval 1) contact 'foot' needs 0.196 N of friction more than there is" in finding.sentence
    assert "a coefficient of 0.52 where it has 0.5" in finding.sentence


def test_a_force_that_pulls_before_the_first_stage() -> None:
    """A rod that turns about its tip, and is braked, pulls at it for 5 ms; the first stage comes after 17 ms."""
    half, braking, physics = ROD_LENGTH / 2, 12.0, rod(2.0)
    control = [-half * braking, 0.0, -braking * ROD_LENGTH**2 / 12.0]
    spans = [Span(0, 0.05, ContactMode.STICK, control)]
    motion = driven(physics, [0.0, half, -math.pi / 2], [4.1 * half, 0.0, 4.1], spans)
    found = audited(motion, physics, ROD)
    assert found.violations == ["max_normal_force_violation"]
    finding = about(found, "max_normal_force_violation")
    assert finding.value == pytest.approx(half * 4.1**2 - GRAVITY, rel=1e-6)
    assert finding.sentence.startswith("At t = 0 s (interval 0) contact 'tip' pulls with 0.276 N: what touches can")
    assert StageForces(motion, physics, ROD).pulling().value == 0


def test_a_limit_exceeded_between_stages(physics: NumericPhysics) -> None:
    """A body thrown up has its apex after 0.05 s, 0.3 mm above a limit that both stages keep."""
    fall, rise = np.array([0.0, -GRAVITY, 0.0, 0.0]), 0.05 * GRAVITY
    parts = [Segment(k, 0.1, fall) for k in range(2)]
    motion = motion_of(np.array([0.0, 1.0, 0.0, 0.3]), np.array([0.0, rise, 0.0, 0.0]), parts)
    apex = 1.0 + 0.05 * rise / 2
    assert motion.configuration[:, 1].max() < apex - 1e-3
    found = audited(motion, physics, HOPPER, limits(HOPPER, root_z=apex - 3e-4))
    assert found.violations == ["max_position_limit_violation"]
    finding = about(found, "max_position_limit_violation")
    assert (finding.time, finding.subject) == (pytest.approx(0.05), "root_z")
    assert finding.sentence.startswith("At t = 0.05 s (interval 0) 'root_z' is 0.0003 m beyond its limit")
    assert "method.accuracy" in finding.sentence


@pytest.mark.parametrize("early", [0.0, 2e-3])
def test_an_impact_at_the_wrong_time(early: float, physics: NumericPhysics) -> None:
    """A foot that stops 2 ms before it meets the ground, 4 mm above it, is not where its replay is."""
    fall_time = math.sqrt(0.4 / GRAVITY) - early
    fall, normal = np.array([0.0, -GRAVITY, 0.0, 0.0]), GRAVITY * STOP
    sink = np.array([0.0, -GRAVITY + normal / 1.1, 0.0, -normal / 0.1])
    parts = [
        Segment(0, fall_time, fall),
        Hit(GRAVITY * fall_time * STOP),
        Segment(1, 0.3 - fall_time, sink, "stick", (normal, 0.0)),
    ]
    found = audited(motion_of(np.array([0.0, 0.7, 0.0, 0.5]), np.zeros(4), parts), physics, HOPPER)
    if not early:
        assert found.violations == []
        return
    assert {"max_replay_position_error", "max_replay_velocity_error"} <= set(found.violations)
    assert not consequences(found)
    finding = about(found, "max_replay_velocity_error")
    assert (finding.interval, finding.subject) == (1, "leg")
    assert "At t = 0.1999 s (interval 1) the velocity of 'leg'" in finding.sentence
    assert "m/s in the plan" in finding.sentence and "m/s in its replay" in finding.sentence


def test_energy_from_nowhere(physics: NumericPhysics) -> None:
    """In the middle of a flight all moves faster by 0.1 m/s, and nothing was paid."""
    motion = tumble()
    later = motion.time > 0.15
    velocity = motion.velocity.copy()
    velocity[later, 0] += 0.1
    found = audited(replace(motion, velocity=velocity), physics, HOPPER)
    assert {"max_energy_error", "max_replay_velocity_error"} <= set(found.violations)
    energy, replay = (about(found, f"max_{entry}_error") for entry in ("energy", "replay_velocity"))
    assert energy.sentence.startswith("At t = 0.2 s (interval 1) energy of 0.11")
    assert (replay.subject, replay.interval, replay.value) == ("root_x", 1, pytest.approx(0.1))
    assert "1.1 m/s in the plan, 1 m/s in its replay" in replay.sentence


def test_friction_along_its_slide(physics: NumericPhysics) -> None:
    """A foot that friction drives on."""
    found = audited(stance(-FRICTION, 0.6), physics, HOPPER)
    assert "max_stick_slip_violation" in found.violations
    finding = about(found, "max_stick_slip_violation")
    assert finding.subject == "foot" and finding.time == pytest.approx(0.1)
    assert "(interval 1) contact 'foot' slides by" in finding.sentence
