"""Bodies on surfaces that vary along y: closed forms, and laws that no motion may break."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot import Plan, Task, load_task, simulate
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.recovery.physics import NumericPhysics
from tests.bodies_in_space import BALL, MASS, written

GRAVITY, FRICTION = 9.81, 0.3
SLOPE, LATERAL_SLOPE = 0.3, -0.5
SOFT = "goal: {configuration: {}, soft: true}\n"


def tilted(velocity: np.ndarray) -> str:
    """A mass on a tilted plane, from x = y = 0 with a velocity along it."""
    vx, vy, vz = velocity.tolist()
    return (
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{slope: {SLOPE}, lateral_slope: {LATERAL_SLOPE}, friction: {FRICTION}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 0.5, intervals: 4}\n"
        f"initial: {{configuration: {{x: 0, y: 0, z: 0}}, velocity: {{x: {vx!r}, y: {vy!r}, z: {vz!r}}}}}\n{SOFT}"
    )


def axes_of_the_plane() -> tuple[np.ndarray, np.ndarray]:
    """The unit normal, and the direction straight down, of the tilted plane."""
    normal = np.array([-np.tan(SLOPE), -np.tan(LATERAL_SLOPE), 1.0])
    normal /= np.linalg.norm(normal)
    down = normal[2] * normal - [0, 0, 1]
    return normal, down / np.linalg.norm(down)


def ends(plan: Plan, kind: str, names: str = "xyz") -> np.ndarray:
    return np.array([getattr(plan.trajectory, kind)[name][-1] for name in names])


def lawful(task: Task, motion: Plan) -> NumericPhysics:
    """Hold that nothing sinks by more than 1e-6 m, that energy never rises, and that the audit finds nothing."""
    physics = numeric_physics(formulate(task, driven=False))
    q, v = (
        np.column_stack(list(part.values())) for part in (motion.trajectory.configuration, motion.trajectory.velocity)
    )
    energy = np.array([physics.energy(*state) for state in zip(q, v, strict=True)])
    assert motion.impulses
    assert np.diff(energy).max() <= 1e-9 * np.abs(energy).max()
    assert min(physics.gaps(each).min() for each in q) >= -1e-6
    assert motion.audit.max_impact_law_error <= 1e-8
    assert motion.audit.max_friction_cone_violation <= 1e-8
    return physics


def test_a_mass_slides_straight_down_a_tilted_plane(tmp_path: Path) -> None:
    """From rest its acceleration down the steepest line is g (sin a - mu cos a), in whatever direction that is."""
    motion = simulate(load_task(written(tmp_path, MASS, tilted(np.zeros(3)))))
    normal, down = axes_of_the_plane()
    acceleration = GRAVITY * (np.sqrt(1 - normal[2] ** 2) - FRICTION * normal[2])
    assert ends(motion, "configuration") == pytest.approx(0.5 * acceleration * 0.5**2 * down, abs=1e-9)
    assert ends(motion, "velocity") == pytest.approx(0.5 * acceleration * down, abs=1e-9)
    assert motion.contacts["foot"].normal_force[1:-1] == pytest.approx(GRAVITY * normal[2], abs=1e-9)


def test_a_mass_that_is_launched_across_the_slope_turns_downhill(tmp_path: Path) -> None:
    """Its path is that of a mass under weight and friction against its velocity, as scipy integrates it."""
    normal, down = axes_of_the_plane()
    start = 1.5 * np.cross(normal, down)
    motion = simulate(load_task(written(tmp_path, MASS, tilted(start))))

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        weight = GRAVITY * (normal[2] * normal - [0, 0, 1])
        return np.concatenate([y[3:], weight - FRICTION * GRAVITY * normal[2] * y[3:] / np.linalg.norm(y[3:])])

    exact = solve_ivp(rate, [0, 0.5], np.concatenate([np.zeros(3), start]), rtol=1e-11, atol=1e-12).y[:, -1]
    assert ends(motion, "configuration") == pytest.approx(exact[:3], abs=1e-8)
    assert ends(motion, "velocity") == pytest.approx(exact[3:], abs=1e-8)
    force, velocity = motion.contacts["foot"].force[-1], ends(motion, "velocity")
    assert np.linalg.norm(force[1:]) == pytest.approx(FRICTION * force[0], abs=1e-9)
    assert velocity @ start > 0 and velocity @ down > 0


def hills(folder: Path) -> None:
    """Write a height map of 20 x 17 points with hills of 0.1 m."""
    x, y = np.linspace(-1, 1, 20), np.linspace(-1, 1, 17)
    rows = [f"{a},{b},{0.1 * np.sin(4 * a) * np.cos(3 * b)}" for b in y for a in x]
    (folder / "map.csv").write_text("x,y,z  # m\n" + "\n".join(rows), encoding="utf-8")


def test_a_ball_dropped_on_hills_neither_sinks_nor_gains_energy(tmp_path: Path) -> None:
    """It hits the flank of a hill, rolls and stays on it; the touching point is on the hills themselves to 2e-5 m."""
    hills(tmp_path)
    task = load_task(
        written(
            tmp_path,
            BALL,
            "robot: {model: model.urdf, root: free_flyer}\n"
            "ground: {type: height_map, file: map.csv, friction: 0.3}\n"
            "contacts: {rim: {type: circle, frame: ball, radius: 0.1}}\n"
            "horizon: {duration: 0.6, intervals: 3}\n"
            "initial:\n"
            "  configuration: {root_joint.x: 0, root_joint.y: 0.1, root_joint.z: 0.3}\n"
            f"  velocity: {{root_joint.vx: 0.3, root_joint.vy: 0.2}}\n{SOFT}",
        )
    )
    motion = simulate(task)
    physics = lawful(task, motion)
    ground, touching = physics.scene.surfaces["ground"], 0
    q = np.column_stack(list(motion.trajectory.configuration.values()))
    for each, mode in zip(q, motion.contacts["rim"].mode, strict=True):
        if mode in ("stick", "slip"):
            touching += 1
            assert abs(ground.distance(physics.contact_points(each)[0])) <= 2.5e-5
    assert touching > 10


def test_a_mass_slides_off_a_box_and_lands(tmp_path: Path) -> None:
    """On the box its own friction acts; it leaves over the rounded edge, falls clear of the side, and stops below."""
    task = load_task(
        written(
            tmp_path,
            MASS,
            "robot: {model: model.urdf, root: fixed}\n"
            "ground: {friction: 0.3}\n"
            "surfaces:\n"
            "  table: {type: box, center: [0, 0, 0.1], size: [0.4, 0.4, 0.2], yaw: 0.5, friction: 0.1, "
            "edge_radius: 0.02}\n"
            "contacts: {top: {frame: mass, surface: table}, floor: {frame: mass}}\n"
            "horizon: {duration: 0.6, intervals: 3}\n"
            f"initial: {{configuration: {{x: 0, y: 0, z: 0.2}}, velocity: {{x: 0.9, y: 0.2}}}}\n{SOFT}",
        )
    )
    motion = simulate(task)
    lawful(task, motion)
    assert [(one.kind, one.contact) for one in motion.switches] == [
        ("takeoff", "top"),
        ("touchdown", "floor"),
        ("slip_to_stick", "floor"),
    ]
    # Straight on with a deceleration of 0.1 g, up to where the top begins to bend.
    time, speed = motion.trajectory.time, np.hypot(0.9, 0.2)
    on_top = time <= 0.15
    place = np.hypot(motion.trajectory.configuration["x"], motion.trajectory.configuration["y"])
    assert on_top.sum() >= 3
    expected = speed * time[on_top] - 0.5 * 0.1 * GRAVITY * time[on_top] ** 2
    assert place[on_top] == pytest.approx(expected, abs=1e-9)


def test_a_ball_meets_a_wall_that_faces_any_direction(tmp_path: Path) -> None:
    """The wall takes the velocity along its normal away; friction there is its own."""
    facing = 2.5
    task = load_task(
        written(
            tmp_path,
            BALL,
            "robot: {model: model.urdf, root: free_flyer}\n"
            f"ground: {{friction: 0, walls: {{end: {{place: [0.5, 0], facing: {facing}, friction: 0}}}}}}\n"
            "contacts:\n"
            "  rim: {type: circle, frame: ball, radius: 0.1}\n"
            "  side: {type: circle, frame: ball, radius: 0.1, surface: end}\n"
            "horizon: {duration: 0.6, intervals: 3}\n"
            "initial:\n"
            "  configuration: {root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.1}\n"
            f"  velocity: {{root_joint.vx: 2}}\n{SOFT}",
        )
    )
    motion = simulate(task)
    lawful(task, motion)
    normal, velocity = np.array([np.cos(facing), np.sin(facing)]), np.array([2.0, 0.0])
    hit = (0.1 + 0.5 * normal[0]) / (velocity @ normal)
    (impulse,) = motion.impulses
    assert (impulse.contact, impulse.time) == ("side", pytest.approx(hit, abs=1e-9))
    assert impulse.normal == pytest.approx(-0.5 * (velocity @ normal), abs=1e-9)
    place = velocity * hit + (velocity - velocity @ normal * normal) * (0.6 - hit)
    found = np.array([motion.trajectory.configuration[f"root_joint.{axis}"][-1] for axis in "xy"])
    assert found == pytest.approx(place, abs=1e-8)


def test_a_ball_rolls_along_a_lying_cylinder(tmp_path: Path) -> None:
    """Dropped on its ridge, with a velocity askew, it rolls off to a side without sinking or gaining energy."""
    task = load_task(
        written(
            tmp_path,
            BALL,
            "robot: {model: model.urdf, root: free_flyer}\n"
            "surfaces:\n"
            "  log: {type: cylinder, axis: x, yaw: 0.7, center: [0, 0, 0.2], radius: 0.2, length: 1, friction: 0.5}\n"
            "contacts: {rim: {type: circle, frame: ball, radius: 0.1, surface: log}}\n"
            "horizon: {duration: 0.6, intervals: 3}\n"
            "initial:\n"
            "  configuration: {root_joint.x: 0, root_joint.y: 0, root_joint.z: 0.52}\n"
            f"  velocity: {{root_joint.vx: 0.3, root_joint.vy: 0.2}}\n{SOFT}",
        )
    )
    motion = simulate(task)
    lawful(task, motion)
    x, y, z = (motion.trajectory.configuration[f"root_joint.{axis}"] for axis in "xyz")
    away = np.hypot(-np.sin(0.7) * x + np.cos(0.7) * y, z - 0.2)
    assert away.min() == pytest.approx(0.3, abs=1e-6)
    assert "stick" in motion.contacts["rim"].mode
