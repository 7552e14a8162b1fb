"""Models whose masses or lengths are scaled: laws of similarity, whatever the file's format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, load_robot
from fesd_robot.robot.load import load_scaled
from fesd_robot.robot.scaled import ModelScale

MODELS = Path(__file__).parents[2] / "models"
ARM = """
<mujoco><compiler angle="radian"/><worldbody>
  <body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0"/>
    <inertial pos="0 0 -0.2" mass="2" diaginertia="0.1 0.1 0.02"/><geom type="capsule" size="0.05 0.2" pos="0 0 -0.2"/>
    <body name="lower" pos="0 0 -0.4"><joint name="elbow" axis="0 1 0"/>
      <inertial pos="0 0.01 -0.15" mass="1" diaginertia="0.05 0.04 0.01"/><geom type="box" size="0.04 0.05 0.15"/>
    </body></body></worldbody></mujoco>
"""
URDF = """
<robot name="arm"><link name="base"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit effort="9" velocity="9"/></joint>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision>
    <visual><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.07"/></geometry></visual></link>
  <joint name="weld" type="fixed"><parent link="upper"/><child link="bracket"/><origin xyz="0.1 0 -0.3"/></joint>
  <link name="bracket"><inertial><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0.02 0"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision></link>
  <joint name="elbow" type="revolute"><parent link="bracket"/><child link="lower"/>
    <origin xyz="0 0 -0.1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
  <link name="lower"><inertial><origin xyz="0 0.01 -0.15"/><mass value="1"/>
    <inertia ixx="0.05" iyy="0.04" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>
"""


@pytest.fixture(params=["urdf", "xml"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """An arm of revolute joints."""
    path = tmp_path / f"arm.{request.param}"
    path.write_text(URDF if request.param == "urdf" else ARM)
    return path


def mass_matrix(robot: Robot, q: np.ndarray) -> np.ndarray:
    data = robot.model.createData()
    return np.array(pin.crba(robot.model, data, q))


def configurations(robot: Robot) -> list[np.ndarray]:
    draw = np.random.default_rng(2)
    return [pin.integrate(robot.model, robot.neutral, draw.uniform(-1, 1, robot.model.nv)) for _ in range(3)]


def test_masses_and_lengths_scale_the_mass_matrix(file: Path) -> None:
    """Of revolute joints M(q) grows with the mass and with the square of the length."""
    own = load_robot(file)
    scaled = load_scaled(file, ModelScale(mass=3.0, length=1.5))
    for q in configurations(own):
        np.testing.assert_allclose(mass_matrix(scaled, q), 3.0 * 1.5**2 * mass_matrix(own, q), rtol=1e-12)


def test_places_scale_with_lengths(file: Path) -> None:
    """Every frame is where it was, further from the world by the factor, and so are centres of mass."""
    own, scaled = load_robot(file), load_scaled(file, ModelScale(length=0.7))
    for q in configurations(own):
        data, other = own.model.createData(), scaled.model.createData()
        pin.framesForwardKinematics(own.model, data, q)
        pin.framesForwardKinematics(scaled.model, other, q)
        for frame in range(own.model.nframes):
            np.testing.assert_allclose(other.oMf[frame].translation, 0.7 * data.oMf[frame].translation, atol=1e-12)
        np.testing.assert_allclose(
            pin.centerOfMass(scaled.model, other, q), 0.7 * pin.centerOfMass(own.model, data, q), atol=1e-12
        )


def test_a_pendulum_of_four_times_the_length_swings_half_as_fast(file: Path) -> None:
    """Without efforts, accelerations are those of the same arm in gravity, divided by the length."""
    own, scaled = load_robot(file), load_scaled(file, ModelScale(length=4.0))
    zero = np.zeros(own.model.nv)
    for q in configurations(own):
        slow = pin.aba(scaled.model, scaled.model.createData(), q, zero, zero)
        fast = pin.aba(own.model, own.model.createData(), q, zero, zero)
        np.testing.assert_allclose(slow, fast / 4.0, rtol=1e-10)


def test_shapes_scale_with_their_links(file: Path) -> None:
    """Collision shapes are larger by the factor, and further from their frames."""
    own, scaled = load_robot(file), load_scaled(file, ModelScale(length=2.0))
    assert own.collision_shapes
    for one, other in zip(own.collision_shapes, scaled.collision_shapes, strict=True):
        assert other.geometry.computeVolume() == pytest.approx(8.0 * one.geometry.computeVolume())
        np.testing.assert_allclose(other.placement.translation, 2.0 * one.placement.translation, atol=1e-12)
    for seen, larger in zip(own.visual_model.geometryObjects, scaled.visual_model.geometryObjects, strict=True):
        np.testing.assert_allclose(larger.placement.translation, 2.0 * seen.placement.translation, atol=1e-12)


def test_one_link_alone(tmp_path: Path) -> None:
    """A factor of a link is that of its body: what is fixed to it goes along, what hangs on it keeps its size."""
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    own, scaled = (
        load_robot(file),
        load_scaled(file, ModelScale(link_length={"bracket": 2.0}, link_mass={"lower": 3.0})),
    )
    upper, lower = (own.model.getJointId(name) for name in ("shoulder", "elbow"))
    np.testing.assert_allclose(scaled.model.jointPlacements[lower].translation, [0.2, 0.0, -0.8])
    np.testing.assert_allclose(scaled.model.jointPlacements[upper].translation, [0.0, 0.0, 1.0])
    assert scaled.model.inertias[upper].mass == own.model.inertias[upper].mass
    assert scaled.model.inertias[lower].mass == 3.0 * own.model.inertias[lower].mass
    np.testing.assert_allclose(scaled.model.inertias[lower].lever, own.model.inertias[lower].lever)
    with pytest.raises(RobotError, match=r"there is no link 'brackt' to scale \(did you mean 'bracket'\?\)"):
        load_scaled(file, ModelScale(link_length={"brackt": 2.0}))


def test_locked_joints_move_along(tmp_path: Path) -> None:
    """A joint that is held is scaled before it is held: the mass matrix of the rest scales as a whole."""
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    own = load_robot(file, locked={"elbow": 0.7})
    scaled = load_scaled(file, ModelScale(length=1.3), locked={"elbow": 0.7})
    np.testing.assert_allclose(mass_matrix(scaled, scaled.neutral), 1.3**2 * mass_matrix(own, own.neutral), rtol=1e-12)


def test_meshes_scale() -> None:
    """A quadruped of meshes, with coupled legs and a root in the plane, is drawn and collides larger."""
    held = {f"{leg}_HAA": 0.0 for leg in ("FL", "FR", "HL", "HR")}
    kind = {"root": "sagittal", "locked": held, "coupled": {"FR_HFE": "FL_HFE", "FR_KFE": "FL_KFE"}}
    own = load_robot("example-robot-data:solo12", **kind)  # type: ignore[arg-type]
    scaled = load_scaled("example-robot-data:solo12", ModelScale(length=1.5), **kind)  # type: ignore[arg-type]
    for robot, factor in ((own, 1.0), (scaled, 1.5)):
        assert all(np.allclose(one.meshScale, factor) for one in robot.visual_model.geometryObjects if one.meshPath)
    sizes = []
    for robot in (own, scaled):
        corners = [np.array(one.geometry.vertices()) for one in robot.visual_model.geometryObjects]
        sizes.append(max(np.ptp(each, axis=0).max() for each in corners))
    assert sizes[1] == pytest.approx(1.5 * sizes[0], rel=1e-6)


def test_factors_of_one_change_nothing(file: Path) -> None:
    """The model is the file's, bit by bit."""
    own, same = load_robot(file), load_scaled(file, ModelScale())
    assert own.model == same.model
    assert same.lengths == {}
