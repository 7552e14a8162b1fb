"""Bodies in space that are let go: closed forms, and laws that no motion may break."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import Plan, load_task, simulate
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from tests.bodies_in_space import BALL, MASS, box, written

GRAVITY = 9.81


def ends(plan: Plan, names: tuple[str, ...]) -> np.ndarray:
    """Return the values of coordinates at the end of a motion."""
    return np.array([plan.trajectory.configuration[name][-1] for name in names])


@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 200])
def test_a_mass_thrown_in_any_direction_slides_straight_on(tmp_path: Path, degrees: float) -> None:
    """Touchdown, impulse, stop and place of rest are those of one dimension along the throw, to 1e-9."""
    friction, speed, height = 0.5, 3.2, 0.2
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    vx, vy = (speed * along).tolist()
    task = written(
        tmp_path,
        MASS,
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{type: plane, friction: {friction}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 1.5, intervals: 6}\n"
        f"initial: {{configuration: {{x: 0, y: 0, z: {height}}}, velocity: {{x: {vx!r}, y: {vy!r}, z: 0}}}}\n"
        "goal: {configuration: {}, soft: true}\n",
    )
    motion = simulate(load_task(task))
    landing = np.sqrt(2 * height / GRAVITY)
    after = speed - friction * GRAVITY * landing
    stop = landing + after / (friction * GRAVITY)
    assert [switch.kind for switch in motion.switches] == ["touchdown", "slip_to_stick"]
    assert [switch.time for switch in motion.switches] == pytest.approx([landing, stop], abs=1e-9)
    (impulse,) = motion.impulses
    friction_impulse = -friction * GRAVITY * landing * along
    assert (impulse.tangential, impulse.lateral) == pytest.approx(tuple(friction_impulse), abs=1e-9)
    distance = speed * landing + after**2 / (2 * friction * GRAVITY)
    np.testing.assert_allclose(ends(motion, ("x", "y")), distance * along, atol=1e-9)
    assert motion.outcome.contacts["foot"].slides[0].distance == pytest.approx(distance - speed * landing, abs=1e-9)


def test_a_ball_with_spin_rolls_when_mechanics_says(tmp_path: Path) -> None:
    """The velocity of the point that touches keeps its direction and falls by 7/2 mu g; then the ball rolls on."""
    friction, radius = 0.3, 0.1
    task = written(
        tmp_path,
        BALL,
        "robot: {model: model.urdf, root: free_flyer}\n"
        f"ground: {{type: plane, friction: {friction}}}\n"
        f"contacts: {{rim: {{type: circle, frame: ball, radius: {radius}}}}}\n"
        "horizon: {duration: 1, intervals: 5}\n"
        "initial:\n"
        "  configuration: {root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.1}\n"
        "  velocity: {root_joint.vx: 2, root_joint.vy: 0.5, root_joint.wx: 3, root_joint.wy: -5, root_joint.wz: 4}\n"
        "goal: {configuration: {}, soft: true}\n",
    )
    motion = simulate(load_task(task))
    velocity, spin = np.array([2.0, 0.5, 0.0]), np.array([3.0, -5.0, 4.0])
    sliding = velocity + np.cross(spin, [0.0, 0.0, -radius])
    speed = np.linalg.norm(sliding)
    rolls = speed / (3.5 * friction * GRAVITY)
    assert [(switch.kind, switch.time) for switch in motion.switches] == [
        ("slip_to_stick", pytest.approx(rolls, abs=1e-9))
    ]
    loss = friction * GRAVITY * sliding / speed
    place = velocity * rolls - 0.5 * loss * rolls**2 + (velocity - loss * rolls) * (1 - rolls)
    np.testing.assert_allclose(ends(motion, ("root_joint.x", "root_joint.y")), place[:2], atol=1e-9)
    quaternion = np.array([motion.trajectory.configuration[f"root_joint.q{axis}"] for axis in "xyzw"])
    np.testing.assert_allclose(np.linalg.norm(quaternion, axis=0), 1, atol=1e-12)


def test_a_ball_in_flight_turns_many_times_in_one_interval(tmp_path: Path) -> None:
    """Its orientation is a turn by spin times time about its spin, however many turns an interval takes."""
    spin, duration = np.array([12.0, -20.0, 30.0]), 1.1
    task = written(
        tmp_path,
        BALL,
        "robot: {model: model.urdf, root: free_flyer}\n"
        "ground: {type: plane, friction: 0.3}\n"
        "contacts: {rim: {type: circle, frame: ball, radius: 0.1}}\n"
        f"horizon: {{duration: {duration}, intervals: 1}}\n"
        "initial:\n"
        "  configuration: {root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.2}\n"
        "  velocity: {root_joint.vx: 2, root_joint.vz: 8, root_joint.wx: 12, root_joint.wy: -20, root_joint.wz: 30}\n"
        "goal: {configuration: {}, soft: true}\n",
    )
    motion = simulate(load_task(task))
    half = np.linalg.norm(spin) * duration / 2
    quaternion = np.array([*(np.sin(half) * spin / np.linalg.norm(spin)), np.cos(half)])
    end = ends(motion, tuple(f"root_joint.q{axis}" for axis in "xyzw"))
    assert half > 4 * np.pi
    assert abs(end @ quaternion) == pytest.approx(1, abs=1e-12)
    rise = 0.2 + 8 * duration - GRAVITY * duration**2 / 2
    np.testing.assert_allclose(ends(motion, ("root_joint.x", "root_joint.z")), [2 * duration, rise], atol=1e-9)


@pytest.mark.parametrize("friction", [0.05, 0.6])
def test_a_ball_thrown_with_spin_bounces_as_mechanics_says(tmp_path: Path, friction: float) -> None:
    """v_z turns to -e v_z at every bounce, and the rim's velocity keeps its direction: friction takes mu times the
    normal impulse, or 2/7 of the mass times that velocity, which stops it. Place and velocities after two bounces."""
    restitution, radius, mass, rising = 0.6, 0.1, 0.5, 1.5
    velocity, spin = np.array([2.0, 0.5, rising]), np.array([3.0, -5.0, 4.0])
    task = written(
        tmp_path,
        BALL,
        "robot: {model: model.urdf, root: free_flyer}\n"
        f"ground: {{type: plane, friction: {friction}, restitution: {restitution}}}\n"
        f"contacts: {{rim: {{type: circle, frame: ball, radius: {radius}}}}}\n"
        "horizon: {duration: 0.55, intervals: 3}\n"
        "initial:\n"
        "  configuration: {root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.1}\n"
        f"  velocity: {{root_joint.vx: 2, root_joint.vy: 0.5, root_joint.vz: {rising}, root_joint.wx: 3, "
        "root_joint.wy: -5, root_joint.wz: 4}\n"
        "goal: {configuration: {}, soft: true}\n",
    )
    motion = simulate(load_task(task))
    place, time, arm = np.zeros(2), 0.0, np.array([0.0, 0.0, -radius])
    for hit in motion.impulses:
        flight = 2 * velocity[2] / GRAVITY
        place, time = place + velocity[:2] * flight, time + flight
        normal, sliding = mass * (1 + restitution) * velocity[2], (velocity + np.cross(spin, arm))[:2]
        speed = float(np.linalg.norm(sliding))
        impulse = -min(friction * normal, 2 / 7 * mass * speed) * sliding / max(speed, 1e-300)
        assert hit.time == pytest.approx(time, abs=1e-9)
        assert (hit.normal, hit.tangential, hit.lateral) == pytest.approx((normal, *impulse), abs=1e-7)
        spin = spin + np.cross(arm, [*impulse, 0.0]) / (0.4 * mass * radius**2)
        velocity = np.array([*(velocity[:2] + impulse / mass), restitution * velocity[2]])
    assert len(motion.impulses) == 2
    np.testing.assert_allclose(
        ends(motion, ("root_joint.x", "root_joint.y")), place + velocity[:2] * (0.55 - time), atol=1e-7
    )
    assert motion.audit.max_impact_law_error <= 1e-8


@pytest.mark.parametrize("restitution", [0.0, 0.6])
@pytest.mark.parametrize(
    "orientation",
    [(0.0, 0.0, 0.0, 1.0), (0.2, 0.0, 0.0, 0.98), (0.3, 0.2, 0.1, 0.927)],
    ids=["flat", "on an edge", "on a corner"],
)
def test_a_dropped_box_gains_no_energy_and_stays_above_the_ground(
    tmp_path: Path, orientation: tuple[float, ...], restitution: float
) -> None:
    """Energy never rises from one sample to the next, no corner is below 1e-6 m, and every force is in its cone."""
    friction = 0.4
    quaternion = np.array(orientation) / np.linalg.norm(orientation)
    values = ", ".join(f"root_joint.q{axis}: {float(value)!r}" for axis, value in zip("xyzw", quaternion, strict=True))
    corners = ", ".join(f"c{n}: {{frame: c{n}}}" for n in range(8))
    task = load_task(
        written(
            tmp_path,
            box(),
            "robot: {model: model.urdf, root: free_flyer}\n"
            f"ground: {{type: plane, friction: {friction}, restitution: {restitution}}}\n"
            f"contacts: {{{corners}}}\n"
            "horizon: {duration: 0.3, intervals: 3}\n"
            f"initial: {{configuration: {{root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.24, {values}}}, "
            "velocity: {root_joint.vx: 0.8, root_joint.vy: 0.3}}\n"
            "goal: {configuration: {}, soft: true}\n",
        )
    )
    motion = simulate(task)
    physics = numeric_physics(formulate(task, driven=False))
    q, v = (
        np.column_stack(list(part.values())) for part in (motion.trajectory.configuration, motion.trajectory.velocity)
    )
    energy = np.array([physics.energy(*state) for state in zip(q, v, strict=True)])
    assert motion.impulses
    assert np.diff(energy).max() <= 1e-9 * energy[0]
    assert min(physics.gaps(each).min() for each in q) >= -1e-6
    assert motion.audit.max_impact_law_error <= 1e-8
    assert motion.audit.max_friction_cone_violation <= 1e-8
