"""A round finger with friction pushes a box that stands on three feet, or on its four corners."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot import Plan, load_task, simulate
from fesd_robot.contact import ContactMode
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.dynamics import contact_dynamics
from fesd_robot.replay.modes import rated_modes
from tests.bodies_in_space import MASS, written
from tests.replay.moreau_in_space import step_through

GRAVITY, FLOOR = 9.81, 0.3
FEET = {"a": (-0.08, -0.1), "b": (-0.08, 0.1), "c": (0.08, 0.0)}


def pushed(folder: Path, crate: str, floor: str, friction: float, start: str) -> Path:
    """Write the task of a box of 0.2, 0.3 and 0.2 m and a finger of 1 kg at its side."""
    sizes = "" if "type: box" in crate else "other_size: [0.2, 0.3, 0.2], "
    model = MASS.replace('velocity="20" effort="0"', 'velocity="20" effort="20"')
    return written(
        folder,
        model,
        "robot: {model: model.urdf}\n"
        f"bodies: {{crate: {crate}}}\n"
        f"ground: {{type: plane, friction: {FLOOR}}}\n"
        f"contacts:\n{floor}"
        f"  finger: {{type: circle_box, frame: mass, radius: 0.05, other_frame: crate, {sizes}friction: {friction}}}\n"
        "horizon: {duration: 0.5, intervals: 2}\n"
        f"initial: {{configuration: {{x: -0.15, z: 0.1, crate.root_joint.z: 0.1{start}}}}}\n"
        "goal: {soft: true}\n",
    )


def on_feet(folder: Path, friction: float, start: str) -> Path:
    frames = "".join(
        f"<link name='{name}'/><joint name='{name}' type='fixed'><parent link='crate'/><child link='{name}'/>"
        f"<origin xyz='{x} {y} -0.1'/></joint>"
        for name, (x, y) in FEET.items()
    )
    (folder / "crate.urdf").write_text(
        "<robot name='crate'><link name='crate'><inertial><mass value='2'/><inertia ixx='0.0217' iyy='0.0133' "
        f"izz='0.0217' ixy='0' ixz='0' iyz='0'/></inertial></link>{frames}</robot>",
        encoding="utf-8",
    )
    floor = "".join(f"  {name}: {{frame: crate.{name}}}\n" for name in FEET)
    return pushed(folder, "{model: crate.urdf, root: free_flyer}", floor, friction, start)


def on_corners(folder: Path, friction: float, start: str) -> Path:
    crate = "{type: box, size: [0.2, 0.3, 0.2], mass: 2, root: free_flyer}"
    return pushed(folder, crate, "  floor: {body: crate}\n", friction, start)


def driven(task: Path, push: tuple[float, float, float]) -> tuple[Plan, NumericPhysics, np.ndarray, np.ndarray]:
    """Return a motion under a constant push, N, its physics, and its states."""
    motion = simulate(load_task(task), dict(zip("xyz", push, strict=True)))
    physics = numeric_physics(formulate(load_task(task), driven=False))
    places, speeds = motion.trajectory.configuration, motion.trajectory.velocity
    return motion, physics, np.column_stack(list(places.values())), np.column_stack(list(speeds.values()))


@pytest.mark.parametrize(
    ("friction", "start", "push"),
    [(0.5, ", y: 0.05", (12.0, 0.0, GRAVITY)), (0.4, ", y: -0.06", (14.0, -1.0, 8.8))],
    ids=["level", "slides down and aside"],
)
def test_a_box_on_three_feet_goes_where_small_steps_take_it(
    tmp_path: Path, friction: float, start: str, push: tuple[float, float, float]
) -> None:
    """They turn, stick, slide and part; Moreau's steps of 1e-3 s end within 1e-3 (m and of a quaternion), and four
    times longer ones at least twice as far away."""
    motion, physics, q, v = driven(on_feet(tmp_path, friction, start), push)
    kinds = {(switch.contact, switch.kind) for switch in motion.switches}
    assert {("finger", "stick_to_slip"), ("finger", "takeoff")} <= kinds
    coarse, fine = (
        np.abs(step_through(physics, q[0], v[0], np.array(push), 0.5, step) - q[-1]).max() for step in (4e-3, 1e-3)
    )
    assert fine < 1e-3
    assert fine < 0.5 * coarse
    assert motion.status.audit_passed
    assert "not the only motion" not in motion.status.message


@pytest.mark.parametrize(
    ("friction", "start", "push"),
    [
        (0.3, "", (12.0, 0.0, GRAVITY)),
        (0.5, ", y: 0.05", (12.0, 0.0, GRAVITY)),
        (0.5, ", y: 0.05", (12.0, 3.0, 8.8)),
        (0.3, ", y: -0.08", (15.0, -1.0, 10.8)),
    ],
    ids=["straight", "turning", "sliding down and aside", "sliding up"],
)
def test_the_pressure_under_a_box_on_four_corners_is_linear(
    tmp_path: Path, friction: float, start: str, push: tuple[float, float, float]
) -> None:
    """Both diagonals carry half of the weight, no energy is created, the audit finds no fault.

    Where the box turns, another share would move it otherwise, and the motion says so.
    """
    motion, physics, q, v = driven(on_corners(tmp_path, friction, start), push)
    pushing = motion.contacts["finger"].normal_force > 1e-6
    corners = np.column_stack([motion.contacts[f"floor_{n}"].normal_force for n in range(1, 5)])
    np.testing.assert_allclose(corners[:, 0] + corners[:, 3], corners[:, 1] + corners[:, 2], atol=1e-5)
    energy = np.array([physics.energy(*state) for state in zip(q, v, strict=True)])
    spent = energy - (q[:, :3] - q[0, :3]) @ push
    assert np.diff(spent).max() <= 1e-7
    assert pushing[:10].all()
    assert motion.status.audit_passed
    assert ("not the only motion" in motion.status.message) == bool(start)


def test_a_finger_that_is_held_at_its_height_carries_no_weight(tmp_path: Path) -> None:
    """Its friction could carry a part of the box, or press on it, and the simulation says so; it takes the motion in
    which it does neither, a = (F - mu M g) / (M + m)."""
    task = on_corners(tmp_path, 0.3, "")
    task.write_text(
        task.read_text(encoding="utf-8")
        .replace("{model: model.urdf}", "{model: model.urdf, locked: {z: 0.1}}")
        .replace(" z: 0.1, crate", " crate"),
        encoding="utf-8",
    )
    motion = simulate(load_task(task), {"x": 12.0, "y": 0.0})
    expected = (12.0 - FLOOR * 2 * GRAVITY) / 3 * 0.5**2 / 2
    assert motion.trajectory.configuration["crate.root_joint.x"][-1] == pytest.approx(expected, rel=1e-3)
    assert motion.status.audit_passed
    assert "not the only motion" in motion.status.message


@pytest.mark.parametrize("part", [0.9, 0.999, 1.001])
def test_a_box_on_corners_sticks_up_to_the_limit_of_all_together(tmp_path: Path, part: float) -> None:
    """Pushed at its middle in any direction, it sticks on all corners if and only if the push is at most mu M g.

    Only a division of friction in proportion to the normal forces keeps to the cones at the limit.
    """
    task = on_corners(tmp_path, 0.0, ", y: 1")
    physics = numeric_physics(formulate(load_task(task), driven=False))
    q, still = np.array([-1.0, 1.0, 0.1, 0, 0, 0.1, 0, 0, 0, 1.0]), np.zeros(9)
    alone = contact_dynamics(physics, q, still, np.zeros(3))
    for along in (0.0, 0.5, 1.6, 4.0):
        force = np.zeros(9)
        force[3:5] = part * FLOOR * 2 * GRAVITY * np.array([np.cos(along), np.sin(along)])
        moved = np.linalg.solve(physics.mass_matrix(q), force)
        dynamics = replace(alone, acceleration=alone.acceleration + moved, free=alone.free + alone.jacobian @ moved)
        (best,) = rated_modes(dynamics, np.array([True] * 4 + [False]))
        assert best.admissible
        assert best.modes == (*[ContactMode.STICK if part < 1 else ContactMode.SLIP] * 4, ContactMode.FLIGHT)
        expected = max(0.0, part - 1) * FLOOR * GRAVITY
        np.testing.assert_allclose(
            best.acceleration[3:5], [expected * np.cos(along), expected * np.sin(along)], atol=1e-9
        )
        assert (np.linalg.norm(best.force[:, 1:], axis=1) <= FLOOR * best.force[:, 0] + 1e-9).all()
