"""Dry friction of joints in the replay: closed forms, the law on random states, and MuJoCo's friction loss."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from fesd_robot.contact import ContactMode, Scene
from fesd_robot.recovery import DryFriction
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.dynamics import ContactDynamics, JointDynamics, contact_dynamics
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.replay.joints import joints_in_motion
from fesd_robot.robot import load_robot

from .bodies import GRAVITY, body

CHAIN = """
<mujoco model="chain">
  <option gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody>
    <body name="a" pos="0 0 1">
      <joint name="first" axis="0 1 0" damping="0.1" frictionloss="0.7"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" mass="1.2"/>
      <body name="b" pos="0 0 -0.4">
        <joint name="second" axis="0 1 0" frictionloss="0.3"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="0.8"/>
        <body name="c" pos="0 0 -0.3">
          <joint name="third" type="slide" axis="0 0 1" frictionloss="2"/>
          <geom type="sphere" size="0.05" mass="0.5"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def pendulum(folder: Path, friction: float, *, mass: float = 1.0, length: float = 0.6) -> NumericPhysics:
    """A point mass on a light bar that hangs from a hinge with dry friction, N m, and a motor."""
    file = folder / "pendulum.urdf"
    file.write_text(
        f"<robot name='p'><link name='world'/><link name='bar'><inertial><origin xyz='0 0 {-length}' rpy='0 0 0'/>"
        f"<mass value='{mass}'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='hinge' type='revolute'><parent link='world'/><child link='bar'/><axis xyz='0 1 0'/>"
        f"<limit lower='-9' upper='9' velocity='99' effort='1'/><dynamics friction='{friction}'/></joint></robot>",
        encoding="utf-8",
    )
    return NumericPhysics(load_robot(file), Scene({}, {}), {}, lambda _: np.eye(1))


def block(friction: float, points: dict[str, tuple[float, float]] | None = None) -> NumericPhysics:
    """A block of 2 kg on a rail with dry friction, N."""
    physics = body(2.0, 1.0, points or {}, friction=0.0, coordinates=("x",))
    physics.dry_friction, physics.friction_coordinates = np.array([friction]), np.array([0])
    physics.rubbing = DryFriction.of_joints(
        physics.friction_coordinates, physics.dry_friction[physics.friction_coordinates]
    )
    return physics


@pytest.mark.parametrize("push", [0.0, -1.0, 2.5])
def test_a_block_stops_and_sticks(push: float) -> None:
    """t = m v / (F - u), x = m v^2 / (2 (F - u)), and there it stays."""
    result = replay_motion(block(3.0), np.zeros(1), np.array([1.5]), np.array([push]), 12.0, start=1.0)
    time = 2.0 * 1.5 / (3.0 - push)
    assert [event.kind for event in result.joint_events] == ["slip_to_stick"]
    assert result.joint_events[0].time == pytest.approx(1.0 + time, abs=5e-9)
    np.testing.assert_allclose(result.configuration, [0.5 * 1.5 * time], atol=1e-9)
    assert abs(result.velocity[0]) < 1e-12 and not result.notes


def test_a_block_turns_round() -> None:
    """A pull of 5 N against 3 N of friction: back with u - F after the stop at m v / (u + F)."""
    result = replay_motion(block(3.0), np.zeros(1), np.array([1.5]), np.array([-5.0]), 1.0)
    time = 2.0 * 1.5 / 8.0
    assert [event.kind for event in result.joint_events] == ["slip_reversal"]
    assert result.joint_events[0].time == pytest.approx(time, abs=1e-9)
    assert result.velocity[0] == pytest.approx(-(1 - time), abs=1e-9)


def test_a_pendulum_comes_to_rest_where_its_friction_holds_it(tmp_path: Path) -> None:
    """It swings from 1 rad to where the work of friction has taken its energy, and sticks there.

    m g l (cos phi - cos 1) = F (1 - phi) at the end phi, where m g l |sin phi| <= F.
    """
    friction = 2.0
    physics = pendulum(tmp_path, friction)
    weight = 1.0 * GRAVITY * 0.6
    result = replay_motion(physics, np.ones(1), np.zeros(1), np.zeros(1), 3.0)
    end = float(result.configuration[0])
    assert weight * math.sin(1.0) > friction > weight * abs(math.sin(end))
    assert weight * (math.cos(end) - math.cos(1.0)) == pytest.approx(friction * (1.0 - end), abs=1e-8)
    assert [event.kind for event in result.joint_events] == ["slip_to_stick"]
    assert abs(result.velocity[0]) < 1e-12


def test_a_pendulum_that_its_friction_holds_does_not_move(tmp_path: Path) -> None:
    """With m g l sin(phi) below F it stays, to the last digit, and a motor that adds to it breaks it away."""
    physics = pendulum(tmp_path, 3.0)
    still = replay_motion(physics, np.array([0.5]), np.zeros(1), np.zeros(1), 1.0)
    assert (still.configuration[0], still.velocity[0], still.joint_events) == (0.5, 0.0, ())
    moved = replay_motion(physics, np.array([0.5]), np.zeros(1), np.array([-1.0]), 0.2)
    assert moved.velocity[0] < -0.1


@pytest.mark.parametrize("seed", range(4))
def test_the_modes_are_those_that_obey_the_law(seed: int) -> None:
    """On random states of five joints pivoting finds the one choice among 3^5 that obeys the law of every joint."""
    random = np.random.default_rng(seed)
    for _ in range(10):
        n = 5
        root = random.normal(size=(n, n))
        inverse = root @ root.T + 0.1 * np.eye(n)
        limit, velocity = random.uniform(0.1, 2, n), random.choice([0.0, 0.0, 1.0, -1.0], n)
        free = inverse @ random.normal(scale=2.0, size=n)
        none = np.zeros((0, n))
        joints = JointDynamics(
            rows=np.arange(n),
            limit=limit,
            velocity=velocity,
            response=inverse,
            headings=np.ones(n),
            force=np.zeros(n),
            by_contacts=np.zeros((n, 0)),
            rubbing=DryFriction.of_joints(np.arange(n), limit),
        )
        dynamics = ContactDynamics(
            none, np.zeros(0), free, none.T, none @ none.T, np.zeros(0), np.zeros(0), np.zeros((0, 1)), joints
        )
        found = joints_in_motion(dynamics, lambda _: np.zeros(0))
        obeying = []
        for modes in itertools.product(
            (ContactMode.STICK, ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS), repeat=n
        ):
            if any(v and mode.direction != np.sign(v) for v, mode in zip(velocity, modes, strict=True)):
                continue
            held = [mode is ContactMode.STICK for mode in modes]
            force = -limit * [mode.direction for mode in modes]
            rows = np.flatnonzero(held)
            force[rows] = -np.linalg.solve(inverse[np.ix_(rows, rows)], (free + inverse @ force)[rows])
            acceleration = free + inverse @ force
            if all(
                abs(force[i]) <= limit[i] if held[i] else velocity[i] or mode.direction * acceleration[i] > 0
                for i, mode in enumerate(modes)
            ):
                obeying.append(modes)
        assert [found.modes] == obeying
        assert min(found.margin, found.motion_margin) > 0


def test_sticking_joints_and_contacts_share_a_load() -> None:
    """A foot on a stuck vertical slide over the ground: the ground carries what the friction of the slide does not.

    The slide sticks with the contact closed: whatever share each has, nothing moves, and both obey their laws.
    """
    physics = body(2.0, 1.0, {"foot": (0.0, 0.0)}, friction=0.3, coordinates=("z",))
    physics.dry_friction, physics.friction_coordinates = np.array([5.0]), np.array([0])
    physics.rubbing = DryFriction.of_joints(
        physics.friction_coordinates, physics.dry_friction[physics.friction_coordinates]
    )
    result = replay_motion(physics, np.zeros(1), np.zeros(1), np.zeros(1), 0.5)
    np.testing.assert_allclose([result.configuration[0], result.velocity[0]], 0, atol=1e-12)
    lifted = replay_motion(physics, np.zeros(1), np.zeros(1), np.array([2 * GRAVITY + 6.0]), 0.5)
    assert lifted.velocity[0] == pytest.approx(0.5 * (6.0 - 5.0) / 2.0, abs=1e-9)


def test_an_impact_has_no_impulse_of_dry_friction() -> None:
    """A mass that falls in a guide with friction lands at the speed of (g - F / m), and stops by the ground alone."""
    physics = body(2.0, 1.0, {"foot": (0.0, 0.0)}, friction=0.0, coordinates=("z",))
    physics.dry_friction, physics.friction_coordinates = np.array([5.0]), np.array([0])
    physics.rubbing = DryFriction.of_joints(
        physics.friction_coordinates, physics.dry_friction[physics.friction_coordinates]
    )
    height, pull = 0.3, GRAVITY - 2.5
    result = replay_motion(physics, np.array([height]), np.array([-0.5]), np.zeros(1), 1.0)
    assert [event.kind for event in result.events] == ["touchdown"]
    time = (-0.5 + math.sqrt(0.25 + 2 * pull * height)) / pull
    assert result.events[0].time == pytest.approx(time, abs=1e-8)
    assert abs(result.velocity[0]) < 1e-12 and not result.notes


@pytest.mark.parametrize("seed", range(3))
def test_friction_of_sliding_joints_is_mujocos(tmp_path: Path, seed: int) -> None:
    """Inverse dynamics of joints that slide fast: size and sign of the friction are MuJoCo's, to 1e-10.

    MuJoCo's friction loss gives way at low speed; at a rad/s and more it is at its limit, as here.
    """
    file = tmp_path / "chain.xml"
    file.write_text(CHAIN, encoding="utf-8")
    model, random = mujoco.MjModel.from_xml_path(str(file)), np.random.default_rng(seed)
    physics = NumericPhysics(load_robot(file), Scene({}, {}), {}, lambda _: np.zeros((3, 0)))
    np.testing.assert_allclose(physics.dry_friction, [0.7, 0.3, 2.0])
    for _ in range(20):
        data = mujoco.MjData(model)
        data.qpos[:] = random.uniform(-1, 1, 3)
        data.qvel[:] = random.choice([-1, 1], 3) * random.uniform(1, 3, 3)
        modes = tuple(ContactMode.SLIP_FORWARDS if v > 0 else ContactMode.SLIP_BACKWARDS for v in data.qvel)
        dynamics = contact_dynamics(physics, data.qpos, data.qvel, np.zeros(0)).in_joint_modes(modes)
        # The acceleration without any motor: MuJoCo's inverse dynamics of it must find that none is needed.
        data.qacc[:] = dynamics.acceleration
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(data.qfrc_inverse, 0, atol=1e-10)
        np.testing.assert_allclose(dynamics.joint_force(np.zeros(0)), data.qfrc_constraint, atol=1e-10)


def test_a_contact_that_slides_in_a_guide_with_friction() -> None:
    """A point that slides on the ground and in a guide at once has the friction of both: mu m g + F."""
    physics = body(2.0, 1.0, {"foot": (0.0, 0.0)}, friction=0.3, coordinates=("z", "x"))
    physics.dry_friction, physics.friction_coordinates = np.array([0.0, 4.0]), np.array([1])
    physics.rubbing = DryFriction.of_joints(
        physics.friction_coordinates, physics.dry_friction[physics.friction_coordinates]
    )
    slowing = 0.3 * GRAVITY + 4.0 / 2.0
    result = replay_motion(physics, np.zeros(2), np.array([0.0, 1.0]), np.zeros(2), 1.0)
    assert result.configuration[1] == pytest.approx(0.5 / slowing, abs=1e-8)
    assert {event.kind for event in (*result.events, *result.joint_events)} == {"slip_to_stick"}
    assert result.joint_events[0].time == pytest.approx(1 / slowing, abs=1e-8)
