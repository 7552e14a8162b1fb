"""The audit passes motions in closed form, and every entry sees its own fault."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import fields, replace
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import Plane
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.plans import Plan
from fesd_robot.plans.audit import MotionLimits, _Energies, audit
from fesd_robot.plans.audit_record import ENTRIES, Audit
from fesd_robot.plans.measured import Measured, Names
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.physics import NumericPhysics, split_contact_force
from fesd_robot.robot import kinetic_energy, load_robot, potential_energy
from fesd_robot.task import load_task
from fesd_robot.task.audit import AuditLimits

from .conftest import TASK
from .motions import FRICTION, MASS, STOP, Segment, collision, drop, jacobian, motion_of, stance, tumble

ENDS = {"tumble": [0.1, 0.2], "drop": [0.15, 0.3], "stance": [0.05, 0.1]}

NAMES = Names(
    contacts=["foot"],
    configuration={"root_x": "m", "root_z": "m", "root_pitch": "rad", "leg": "m"},
    velocity={"root_x": "m/s", "root_z": "m/s", "root_pitch": "rad/s", "leg": "m/s"},
    controls={"torque": "N m", "leg": "N"},
)

MET = dict.fromkeys(
    (
        "max_slip_violation",
        "max_slip_distance_violation",
        "max_reserve_violation",
        "max_constraint_violation",
        "max_goal_violation",
        "max_waypoint_violation",
        "max_simultaneous_control",
    ),
    Measured(0.0),
)

TRUE_REPLAY = dict.fromkeys((name for name in ENTRIES if name.startswith("max_replay")), Measured(0.0))
"""What the replay says about a motion in closed form, as `test_replay_record` shows."""


KEYS = {field.name for field in fields(MotionLimits)}


def audit_of(motion: PhysicalMotion, physics: NumericPhysics, **limits: Any) -> Audit:
    """Audit a motion; the clock is compared with itself and the hopper's limits hold unless others are given."""
    given: dict[str, Any] = {
        "interval_ends": motion.clock if motion.clock.size else np.zeros(1),
        "names": NAMES,
        "others": {**MET, **TRUE_REPLAY},
    }
    bounds = {
        "position": (np.array([-1, 0, -3.15, 0.1]), np.array([5.1, 1.5, 3.15, 0.5])),
        "velocity": (np.full(4, -10.0), np.full(4, 10.0)),
        "control": (np.full(2, -50.0), np.full(2, 50.0)),
    }
    given["limits"] = MotionLimits(**{**bounds, **{key: limits.pop(key) for key in KEYS & limits.keys()}})
    if not motion.clock.size:
        motion = replace(motion, clock=np.zeros(1))
    return audit(motion, physics, **{**given, **limits})


EXACT = {
    "flight with a torque": (tumble, ENDS["tumble"]),
    "flight, impact, stance": (drop, ENDS["drop"]),
    "rest on a compliant leg": (stance, ENDS["stance"]),
    "slip to the right": (lambda: stance(FRICTION, 0.6), ENDS["stance"]),
    "slip to the left": (lambda: stance(-FRICTION, -0.6), ENDS["stance"]),
    "stance at the point of lift-off": (lambda: stance(push=-1.0791), ENDS["stance"]),
    "impact": (lambda: collision(STOP), [0.0]),
    "impact that slides": (lambda: collision(STOP, -FRICTION * STOP), [0.0]),
}


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_motion_passes(name: str, physics: NumericPhysics) -> None:
    """A motion in closed form has no violation, and no entry is larger than rounding."""
    make, ends = EXACT[name]
    found = audit_of(make(), physics, interval_ends=np.array(ends))
    assert found.violations == []
    usual = {name: entry.tolerance for name, entry in ENTRIES.items() if name != "max_energy_error"}
    assert {name: found.tolerances[name] for name in usual} == usual
    assert found.min_gap >= -1e-12
    worst = {entry: getattr(found, entry) for entry in ENTRIES if entry != "min_gap"}
    assert max(worst.values()) < 1e-9, worst


def turned_over(motion: PhysicalMotion, physics: NumericPhysics) -> float:
    """Return what the motion turns over in an interval, of a robot so large that the limit is not the least one."""
    return _Energies(motion, physics).turnover


def test_the_torque_of_a_tumble_and_its_fall_turn_energy_over(physics: NumericPhysics) -> None:
    """The work of its torque, and its rise and fall by the weight, over two intervals."""
    torque = 0.5 * (0.5 * 0.2 + 0.5 * 0.5 / 0.275 * 0.2**2)
    height = [1.0 + t - 9.81 / 2 * t**2 for t in (0.0, 0.1, 0.2)]
    potential = 1.1 * 9.81 * (height[1] - height[0] + height[1] - height[2])
    assert turned_over(tumble(), physics) == pytest.approx((torque + potential) / 2)


def test_friction_turns_energy_over(physics: NumericPhysics) -> None:
    """A slide's friction takes F_t times the way, and the torque that keeps it upright does no work."""
    motion, still = stance(FRICTION, 0.6), stance(FRICTION, 0.0)
    way, force = motion.configuration[-1, 0], abs(motion.force[1, 0, 1])
    standing = still.configuration[-1, 0]
    assert turned_over(motion, physics) - turned_over(still, physics) == pytest.approx(
        force * (way - abs(standing)) / 2, rel=1e-6
    )


def test_what_a_contact_adds_is_no_work(physics: NumericPhysics) -> None:
    """Friction along the slide obeys the equations of motion, and its work F_t s in the worse interval is an error."""
    motion = stance(-FRICTION, 0.6)
    found = audit_of(motion, physics, interval_ends=np.array(ENDS["stance"]))
    force, way = abs(motion.force[1, 0, 1]), motion.configuration[:, 0]
    middle = int(np.flatnonzero(motion.interval == 0)[-1])
    gained = force * max(way[middle] - way[0], way[-1] - way[middle])
    assert found.max_dynamics_error < 1e-9 and found.max_energy_error == pytest.approx(gained, rel=1e-6)


def test_a_loss_in_an_impact_is_turned_over(physics: NumericPhysics) -> None:
    """An impact alone turns over the energy that it takes, 0.5 m v^2 of the reduced mass, in its one interval."""
    assert turned_over(collision(4 * STOP, speed=4.0), physics) == pytest.approx(0.5 * STOP * 4.0**2)
    assert turned_over(collision(0.0, speed=0.0), physics) == 0.0


def test_the_limit_of_the_energy_is_a_part_of_what_is_turned_over(physics: NumericPhysics) -> None:
    """An impact at 20 m/s takes 18 J, of which 0.2 % are the limit; where nothing is turned over it is 10 mJ."""
    limits = [audit_of(collision(v * STOP, speed=v), physics).tolerances["max_energy_error"] for v in (0.0, 20.0)]
    assert limits == pytest.approx([1e-2, 2e-3 * 0.5 * STOP * 20.0**2])


@pytest.mark.parametrize("restitution", [0.3, 1.0])
def test_an_impact_is_held_against_its_restitution(physics: NumericPhysics, restitution: float) -> None:
    """With e the foot has to part with e times its approach: 1 + e times the impulse that stops it does that, one that
    only stops it misses the law by e, and one that returns more than it came with gains 0.5 m (v+^2 - v-^2)."""
    own = copy(physics)
    own.restitution = np.array([restitution])
    bounced, stopped, faster = (audit_of(collision(factor * STOP), own) for factor in (1 + restitution, 1.0, 2.5))
    assert bounced.violations == []
    assert bounced.max_impact_law_error <= 1e-12
    assert bounced.max_impact_energy_gain == pytest.approx(0.0, abs=1e-12)
    assert stopped.max_impact_law_error == pytest.approx(restitution, abs=1e-12)
    assert faster.max_impact_law_error == pytest.approx(1.5 - restitution, abs=1e-12)
    assert faster.max_impact_energy_gain == pytest.approx(0.5 * STOP * (1.5**2 - 1), abs=1e-12)


def test_a_task_can_set_limits(physics: NumericPhysics) -> None:
    """A given limit takes the default's place, and the audit keeps both; the other limits stay."""
    usual = audit_of(sunk(drop()), physics)
    given = audit_of(sunk(drop()), physics, entries={"min_gap": 0.02})
    assert usual.violations == ["min_gap"] and given.violations == []
    assert given.tolerances == {**usual.tolerances, "min_gap": 0.02} and given.defaults == {"min_gap": 1e-3}
    assert usual.defaults == {}
    stricter = audit_of(replace(drop(), theta_sum_error=1e-7), physics, entries={"max_theta_sum_error": 1e-8})
    assert stricter.violations == ["max_theta_sum_error"]


def test_a_task_names_the_entries() -> None:
    """The limits that a task can set are those of all entries, in their order, and it sets none by default."""
    assert list(AuditLimits.model_fields) == list(ENTRIES)
    assert AuditLimits().given == {} and AuditLimits(min_gap=0.01).given == {"min_gap": 0.01}


def test_resting_force(physics: NumericPhysics) -> None:
    """Pinocchio's constrained acceleration at rest without control is the closed form, with 0.89925 N on the foot."""
    motion = stance()
    q, v = motion.configuration[0], motion.velocity[0]
    normal = physics.contact_jacobian(q)[:1]
    inverse = np.linalg.inv(physics.mass_matrix(q))
    bias = physics.required_force(q, v, np.zeros(4), np.zeros(2))
    force = np.linalg.solve(normal @ inverse @ normal.T, normal @ inverse @ bias)
    assert force == pytest.approx([0.89925], abs=1e-10)
    np.testing.assert_allclose(motion.acceleration[1], inverse @ (normal.T @ force - bias), atol=1e-12)
    np.testing.assert_allclose(motion.force[1, 0], [force.item(), 0], atol=1e-12)


def test_drop_has_published_times_and_impulse(physics: NumericPhysics) -> None:
    """The drop lands after 0.2019 s with 1.9809 m/s, impulse 0.18158 N s, and goes on with 1.8158 m/s."""
    motion = drop()
    (impact,) = motion.impacts
    before, after = motion.velocity[impact.before], motion.velocity[impact.after]
    assert motion.time[impact.after] == pytest.approx(0.20192751093846089, abs=1e-12)
    assert before[1] == pytest.approx(-1.98090888230630134, abs=1e-12)
    assert impact.impulse[0] == pytest.approx([0.18158331421141096, 0.0], abs=1e-12)
    np.testing.assert_allclose(after[[1, 3]], -1.81583331421141096, atol=1e-12)


def sunk(motion: PhysicalMotion) -> PhysicalMotion:
    down = np.array([0, 0.01, 0, 0])
    return replace(motion, configuration=motion.configuration - down, gap_state=motion.gap_state - 0.01)


def pushed(motion: PhysicalMotion, sample: int, force: np.ndarray) -> PhysicalMotion:
    """Change the acceleration of one sample by what a generalized force would do."""
    acceleration = motion.acceleration.copy()
    acceleration[sample] += force / MASS
    return replace(motion, acceleration=acceleration)


def dragged(motion: PhysicalMotion) -> PhysicalMotion:
    """The foot stuck by 1 N of friction, more than the cone has."""
    return pushed(motion, -1, jacobian(motion.configuration[-1])[1])


def gifted(motion: PhysicalMotion) -> PhysicalMotion:
    """From the second control interval on everything moves faster, and nothing was paid."""
    velocity = motion.velocity.copy()
    later = motion.interval == 1
    velocity[later, 0] += 0.5
    configuration = motion.configuration.copy()
    configuration[later, 0] += 0.5 * (motion.time[later] - motion.time[~later][-1])
    return replace(motion, velocity=velocity, configuration=configuration)


def leaping(motion: PhysicalMotion) -> PhysicalMotion:
    """At the second control interval the configuration jumps sideways without any velocity."""
    configuration = motion.configuration.copy()
    configuration[motion.interval == 1, 0] += 0.5
    return replace(motion, configuration=configuration)


def takeoff_under_force() -> PhysicalMotion:
    """A stance whose leg is pulled by 0.9 N and that ends within an interval, for no reason."""
    normal, pull = takeoff_force(), -0.9
    modes = (("stick", normal), ("flight", 0.0))
    parts = [
        Segment(
            0,
            0.02,
            np.array([0, -9.81 + (pull + force) / 1.1, 0, (pull - force) / 0.1]),
            mode,
            (force, 0.0),
            lambda _: np.array([0.0, pull]),
        )
        for mode, force in modes
    ]
    return motion_of(np.array([0, 0.4, 0, 0.4]), np.zeros(4), parts)


def takeoff_force() -> float:
    return (9.81 + 0.9 / 1.1 - 0.9 / 0.1) * STOP


INFINITE = np.full(4, np.inf)
FAULTS: dict[str, tuple[Callable[[], PhysicalMotion], dict[str, Any], set[str], float]] = {
    "sunk below the ground": (lambda: sunk(drop()), {}, {"min_gap"}, -0.01),
    "force at a distance": (
        lambda: pushed(tumble(), 1, np.array([0, 1.1, 0, 0])),
        {},
        {"max_dynamics_error"},
        1.1 / (1 + 1.1 + 0.5),
    ),
    "torque that no foot supplies": (
        lambda: pushed(stance(), 1, np.array([0, 0, 0, 0.1])),
        {},
        {"max_dynamics_error"},
        np.nan,
    ),
    "friction outside the cone": (
        lambda: dragged(drop()),
        {},
        {"max_friction_cone_violation"},
        1 - FRICTION * 0.89925,
    ),
    "friction along the motion": (
        lambda: stance(-FRICTION, 0.6),
        {},
        {"max_stick_slip_violation", "max_energy_error"},
        np.nan,
    ),
    "sliding with friction unused": (
        lambda: stance(0.2, 0.6),
        {},
        {"max_stick_slip_violation"},
        0.25 * 0.89925,
    ),
    "ground that pulls": (lambda: stance(push=-2.0), {}, {"max_normal_force_violation"}, np.nan),
    "contact that opens under its force": (takeoff_under_force, {}, {"max_force_at_opening"}, takeoff_force()),
    "impact that leaves normal velocity": (lambda: collision(0.9 * STOP), {}, {"max_impact_law_error"}, 0.1),
    "fast impact that leaves a tenth": (
        lambda: collision(0.9 * 4 * STOP, speed=4.0),
        {},
        {"max_impact_law_error"},
        0.1,
    ),
    "impact that gives back more than it took": (
        lambda: collision(2.1 * STOP),
        {},
        {"max_impact_law_error", "max_impact_energy_gain"},
        np.nan,
    ),
    "impulse outside the cone": (
        lambda: collision(STOP, 2 * FRICTION * STOP),
        {},
        {"max_impact_law_error"},
        FRICTION * STOP,
    ),
    "velocity change without impulse": (lambda: collision(STOP, kick=0.1), {}, {"max_impact_law_error"}, np.nan),
    "control above its limit": (
        tumble,
        {"control": (np.full(2, -0.4), np.full(2, 0.4))},
        {"max_control_limit_violation"},
        0.1,
    ),
    "control below its limit": (
        tumble,
        {"control": (np.array([0.7, -1.0]), np.ones(2))},
        {"max_control_limit_violation"},
        0.2,
    ),
    "position beyond its limit": (
        tumble,
        {"position": (-INFINITE, np.array([0.2, np.inf, np.inf, np.inf]))},
        {"max_position_limit_violation"},
        0.1,
    ),
    "velocity beyond its limit": (
        tumble,
        {"velocity": (np.array([-np.inf, -np.inf, -np.inf, -0.1]), INFINITE)},
        {"max_velocity_limit_violation"},
        0.1,
    ),
    "clock shifted": (drop, {"interval_ends": np.array([0.15, 0.301])}, {"max_clock_error"}, 1e-3),
    "multipliers that do not sum to one": (
        lambda: replace(drop(), theta_sum_error=1e-3),
        {},
        {"max_theta_sum_error"},
        1e-3,
    ),
    "energy from nowhere": (
        lambda: gifted(tumble()),
        {},
        {"max_energy_error"},
        0.5 * 1.1 * (1.5**2 - 1),
    ),
    "leap of the configuration": (lambda: leaping(tumble()), {}, {"max_position_defect"}, 0.5),
    "gap state that drifts": (
        lambda: replace(drop(), gap_state=drop().gap_state + 0.01),
        {},
        {"max_gap_drift"},
        0.01,
    ),
    **{
        f"{entry} of the task": (drop, {"others": {**MET, **TRUE_REPLAY, entry: Measured(missed)}}, {entry}, missed)
        for entry, missed in ((entry, 2 * ENTRIES[entry].tolerance) for entry in MET)
    },
    **{
        f"{entry} of the replay": (drop, {"others": {**MET, **TRUE_REPLAY, entry: Measured(missed)}}, {entry}, missed)
        for entry, missed in ((entry, 2 * ENTRIES[entry].tolerance) for entry in TRUE_REPLAY)
    },
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_seen_by_its_entry_alone(fault: str, physics: NumericPhysics) -> None:
    """One fault in an exact motion violates the entry made for it, by its size, and no other."""
    make, limits, entries, size = FAULTS[fault]
    found = audit_of(make(), physics, **limits)
    assert set(found.violations) == entries
    if np.isfinite(size):
        assert getattr(found, next(iter(entries))) == pytest.approx(size, rel=1e-6)


def test_every_entry_has_a_fault() -> None:
    """No entry of the audit is left without a fault that it must see.

    The hopper has no improper slide, a rod has, no dry friction in its joints, a pendulum has, no quaternion or spring.
    """
    seen = set().union(*(entries for _, _, entries, _ in FAULTS.values()))
    joints = {"max_joint_friction_violation", "max_joint_slide_violation"}  # in tests/plans/test_joint_friction.py
    springs = {"max_compliant_force_error"}  # in tests/contact/test_compliance.py
    elsewhere = {"max_quaternion_norm_error", *joints, *springs}  # in tests/plans/test_orientations.py
    assert seen == set(ENTRIES) - {"max_improper_slide_time", *elsewhere}


def test_no_gap_state_is_no_drift(physics: NumericPhysics) -> None:
    """A motion without an integrated gap has no drift."""
    motion = drop()
    found = audit_of(replace(motion, gap_state=np.zeros((len(motion.time), 0))), physics)
    assert found.max_gap_drift == 0 and found.violations == []


def test_too_much_friction_is_seen_twice(physics: NumericPhysics) -> None:
    """Sliding with twice the friction there is leaves the cone and is no sliding friction of this ground."""
    found = audit_of(stance(2 * FRICTION, 0.6), physics)
    assert set(found.violations) == {"max_friction_cone_violation", "max_stick_slip_violation"}
    assert found.max_friction_cone_violation == pytest.approx(FRICTION * 0.89925, rel=1e-9)


@pytest.mark.parametrize(
    "field",
    ["configuration", "velocity", "control", "gap_state"],
)
def test_numbers_that_are_none_do_not_pass(field: str, physics: NumericPhysics) -> None:
    """A motion that holds a NaN fails its audit."""
    motion = drop()
    values = getattr(motion, field).copy()
    values[3, 0] = np.nan
    assert audit_of(replace(motion, **{field: values}), physics).violations


def test_physics_is_the_models(hopper: MotionProblem, physics: NumericPhysics) -> None:
    """Mass matrix with armature, gap, Jacobian and energy agree with the hopper's closed forms."""
    for q in np.random.default_rng(0).uniform(0.2, 0.5, size=(5, 4)):
        v = np.array([1.0, -2.0, 3.0, 0.5])
        np.testing.assert_allclose(physics.mass_matrix(q), np.diag(MASS), atol=1e-14)
        np.testing.assert_allclose(physics.gaps(q), [q[1] - q[3] * np.cos(q[2])], atol=1e-14)
        np.testing.assert_allclose(physics.contact_jacobian(q), jacobian(q), atol=1e-14)
        energy = 0.5 * v @ (MASS * v) + 1.1 * 9.81 * q[1]
        assert physics.energy(q, v) == pytest.approx(energy, rel=1e-12)
        step = pin.difference(hopper.robot.model, q, q + 1e-6 * v) / 1e-6
        assert (physics.gaps(q + 1e-6 * step) - physics.gaps(q)) / 1e-6 == pytest.approx(jacobian(q)[:1] @ v, abs=1e-5)


def test_open_contacts_carry_nothing() -> None:
    """Splitting a generalized force gives open contacts none, closed ones theirs, and returns the rest."""
    rng = np.random.default_rng(1)
    rows, force = rng.normal(size=(4, 6)), np.array([[3.0, -1.0], [2.0, 0.5]])
    found, rest = split_contact_force(rows.T @ force.ravel(), rows, np.array([True, True]))
    np.testing.assert_allclose(found, force, atol=1e-12)
    np.testing.assert_allclose(rest, 0, atol=1e-12)
    found, rest = split_contact_force(np.ones(6), rows, np.array([False, True]))
    assert not found[0].any()
    np.testing.assert_allclose(rows[2:] @ rest, 0, atol=1e-12)
    found, rest = split_contact_force(np.ones(6), rows, np.array([False, False]))
    assert not found.any() and (rest == 1).all()


def test_damping_is_a_force_that_takes_energy() -> None:
    """A torque that overcomes the damping of the pitch is exact where there is damping, and too much where not."""
    changes = ["horizon.duration=0.3", "horizon.intervals=2", "reference.count=1"]
    motion, ends = tumble(), np.array(ENDS["tumble"])
    control = motion.control + 0.3 * motion.velocity[:, [2]] * [1.0, 0.0]
    damped = numeric_physics(formulate(load_task(TASK, [*changes, "robot.damping={root_pitch: 0.3}"])))
    found = audit_of(replace(motion, control=control), damped, interval_ends=ends)
    assert found.violations == [] and max(found.max_dynamics_error, found.max_energy_error) < 1e-9
    undamped = numeric_physics(formulate(load_task(TASK, changes)))
    found = audit_of(replace(motion, control=control), undamped, interval_ends=ends)
    assert set(found.violations) == {"max_dynamics_error", "max_energy_error"}


def test_energy_of_a_robot_with_mimic_joints() -> None:
    """The energy of the panda, whose fingers follow each other, is that of its expressions."""
    robot = load_robot("example-robot-data:panda")
    physics = NumericPhysics(robot, Plane(0.0, 0.0), {}, lambda q: np.zeros((robot.model.nv, 0)))
    at, speed = np.full(robot.model.nq, 0.3), np.linspace(-1, 1, robot.model.nv)
    q, v = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    energy = ca.Function("energy", [q, v], [kinetic_energy(robot, q, v) + potential_energy(robot, q)])
    assert physics.energy(at, speed) == pytest.approx(float(energy(at, speed)), rel=1e-12)


def test_contacts_without_friction_carry_no_tangential_force() -> None:
    """Where friction is zero a force is split along the normals alone, also where tangents would add nothing new."""
    floor, wall = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([[-1.0, 0.0], [0.0, 1.0]])
    rows, closed = np.vstack([floor, wall]), np.array([True, True])
    pushed = np.array([-3.0, 20.0])
    found, rest = split_contact_force(pushed, rows, closed, np.zeros(2))
    np.testing.assert_allclose(found, [[20.0, 0.0], [3.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(rest, 0, atol=1e-12)
    shared, _ = split_contact_force(pushed, rows, closed)
    np.testing.assert_allclose(rows.T @ shared.ravel(), pushed, atol=1e-12)
    assert np.abs(shared[:, 1]).min() > 1
    found, rest = split_contact_force(pushed, rows, np.array([True, False]), np.array([0.0, 0.5]))
    np.testing.assert_allclose(found, [[20, 0], [0, 0]], atol=1e-12)
    np.testing.assert_allclose(rest, [-3, 0], atol=1e-12)


def test_two_corners_share_friction_as_the_motion_says() -> None:
    """Of all forces that slide a block on two corners the motion's are taken; what they lack is added to both."""
    rear, front = np.array([[0.0, 1.0, 0.15], [1.0, 0.0, -0.1]]), np.array([[0.0, 1.0, -0.15], [1.0, 0.0, -0.1]])
    rows, closed = np.vstack([rear, front]), np.array([True, True])
    sliding = np.array([[7.0, -2.8], [12.0, -4.8]])  # on the edge of the cone with friction 0.4, in both corners
    found, rest = split_contact_force(rows.T @ sliding.ravel(), rows, closed, near=sliding)
    np.testing.assert_allclose(found, sliding, atol=1e-12)
    alone, _ = split_contact_force(rows.T @ sliding.ravel(), rows, closed)
    assert np.abs(alone[0, 1]) > 0.4 * alone[0, 0] + 0.5, "an equal share leaves the cone of the rear corner"
    found, rest = split_contact_force(rows.T @ sliding.ravel() + [1, 0, -0.1], rows, closed, near=sliding)
    np.testing.assert_allclose(found - sliding, [[0, 0.5], [0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(rest, 0, atol=1e-12)


@pytest.mark.parametrize("bent", [0.0, 1e-13, 1e-9, 1e-7])
def test_the_force_along_a_straight_arm_is_that_of_the_motion(bent: float) -> None:
    """An acceleration that is off by 1e-9 does not tell the force along an arm as straight as the turn of a slide.

    What is missing across the arm is added, and what nothing can tell is left over.
    """
    shoulder, lengths = 0.1, np.array([0.5, 0.5])
    angles = shoulder + np.array([0.0, bent])
    across, along = lengths * np.cos(angles), lengths * np.sin(angles)
    rows = np.array([[across.sum(), across[1]], [along.sum(), along[1]]])
    own, closed = np.array([[6.0, -3.0]]), np.array([True])
    wrong = 1e-9 * np.array([1.0, -2.0])
    found, rest = split_contact_force(rows.T @ own.ravel() + wrong, rows, closed, near=own)
    np.testing.assert_allclose(found, own, atol=1e-8)
    assert np.abs(rest).max() < 1e-8
    missing = rows.T @ [0.1, 0.1 * np.tan(shoulder)]
    found, rest = split_contact_force(rows.T @ own.ravel() + missing, rows, closed, near=own)
    np.testing.assert_allclose(rows.T @ (found - own).ravel(), missing, atol=1e-6)
    bend = np.linalg.svd(rows.T)[0][:, 1]
    _, rest = split_contact_force(rows.T @ own.ravel() + 1e-2 * bend, rows, closed, near=own)
    assert np.abs(rest).max() > 1e-3


def test_the_worst_entry_is_the_nearest_to_its_limit(plan: Plan) -> None:
    """Ratios to the limits, of smallest values with their sign changed; what was not checked does not count."""
    clean = plan.audit.model_copy(update=dict.fromkeys(ENTRIES, 0.0))
    limit = clean.tolerances["min_gap"]
    assert clean.model_copy(update={"min_gap": -0.3 * limit, "max_gap_drift": None}).worst == (0.3, "min_gap")
    assert clean.model_copy(update={"min_gap": 5.0}).worst[0] == 0.0
    assert not clean.model_copy(update={"max_clock_error": float("nan")}).worst[0] <= 0.1
