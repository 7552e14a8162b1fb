"""What a robot knows about itself."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import load_robot, with_joint_properties
from fesd_robot.robot.units import configuration_units, velocity_units

MODELS = Path(__file__).parent / "models"


def test_every_coordinate_has_its_own_name(case):
    """Names are as many as entries, and no two are the same."""
    robot = case.robot
    assert len(set(robot.configuration_names)) == robot.model.nq
    assert len(set(robot.velocity_names)) == robot.model.nv
    assert "" not in robot.configuration_names + robot.velocity_names


def test_names_of_curved_joints():
    """Planar, unbounded and free joints name each entry."""
    robot = load_robot(MODELS / "zoo.urdf")
    assert robot.configuration_names[:6] == ["slide.x", "slide.y", "slide.cos", "slide.sin", "wheel.cos", "wheel.sin"]
    assert robot.configuration_names[6:13] == [f"float.{s}" for s in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    assert robot.configuration_names[13:] == ["piston", "finger"]
    assert robot.velocity_names[:4] == ["slide.vx", "slide.vy", "slide.wz", "wheel"]
    assert robot.velocity_names[4:10] == [f"float.{s}" for s in ("vx", "vy", "vz", "wx", "wy", "wz")]


def test_every_coordinate_has_a_unit(case):
    """Units follow the names one by one, and no coordinate is without."""
    configuration, velocity = configuration_units(case.robot), velocity_units(case.robot)
    assert list(configuration) == case.robot.configuration_names
    assert list(velocity) == case.robot.velocity_names
    assert set(configuration.values()) <= {"m", "rad", "1"}
    assert set(velocity.values()) <= {"m/s", "rad/s"}


def test_units_follow_the_kind_of_joint():
    """Sliding and turning joints, also several on one body, have their own units."""
    robot = load_robot(MODELS / "crawler.xml")
    configuration, velocity = configuration_units(robot), velocity_units(robot)
    assert [configuration[name] for name in ("floating.x", "floating.qx", "shoulder", "rail")] == ["m", "1", "rad", "m"]
    assert [velocity[name] for name in ("floating.vx", "floating.wx", "rail", "elbow")] == ["m/s", "rad/s"] * 2


def test_limits_are_infinite_where_there_are_none(case):
    """No limit is NaN or a huge number, arrays have the right lengths, and unit entries are unlimited."""
    robot = case.robot
    for limits, size in (
        (robot.lower_position, robot.model.nq),
        (robot.upper_position, robot.model.nq),
        (robot.velocity_limit, robot.model.nv),
        (robot.upper_effort, robot.model.nv),
    ):
        assert limits.shape == (size,)
        assert (np.isinf(limits) | (np.abs(limits) < 1e19)).all()
    assert (robot.lower_position <= robot.upper_position).all()
    assert (robot.velocity_limit >= 0).all()
    assert (robot.upper_effort >= 0).all()
    for name, lower, upper in zip(robot.configuration_names, robot.lower_position, robot.upper_position, strict=True):
        if name.rpartition(".")[2] in ("cos", "sin", "qx", "qy", "qz", "qw"):
            assert (lower, upper) == (-np.inf, np.inf)


def test_limits_of_the_file_are_kept():
    """Limits of a limited joint are those of the file."""
    robot = load_robot(MODELS / "zoo.urdf")
    index = robot.velocity_names.index("piston")
    assert (robot.velocity_limit[index], robot.upper_effort[index]) == (2.0, 20.0)
    index = robot.configuration_names.index("piston")
    assert (robot.lower_position[index], robot.upper_position[index]) == (-0.1, 0.3)


def test_neutral_is_a_configuration(case):
    """The neutral configuration lies on the manifold."""
    assert pin.isNormalized(case.robot.model, case.robot.neutral)


def test_friction_that_is_left_out_is_noted():
    """Damping and dry friction enter the motion and are no notes; dry friction that is left out is one."""
    robot = load_robot(MODELS / "zoo.urdf")
    assert "friction" not in " ".join(robot.notes) and "damping" not in " ".join(robot.notes)
    assert robot.dry_friction == {"finger": 0.2}
    without = with_joint_properties(robot, armature={}, damping={}, dry_friction=False)
    assert "Dry friction of joints (finger: 0.2; N or N m)." in without.notes
    assert not without.dry_friction


def test_dry_friction_is_replaced_by_name():
    """A task's limits take the place of the file's, and the others stay."""
    robot = load_robot(MODELS / "zoo.urdf", dry_friction={"piston": 3.0})
    assert robot.dry_friction == {"piston": 3.0, "finger": 0.2}
    with pytest.raises(RobotError, match="no joint 'pistn'"):
        load_robot(MODELS / "zoo.urdf", dry_friction={"pistn": 3.0})


def test_a_robot_is_frozen(hopper):
    """Neither attributes nor limits can be changed by accident."""
    with pytest.raises(FrozenInstanceError):
        hopper.name = "other"
    with pytest.raises(ValueError, match="read-only"):
        hopper.lower_position[0] = 0.0


def test_frames_are_found_by_name(case):
    """Every frame name leads to a frame of that name."""
    for name in case.robot.frame_names:
        assert case.robot.model.frames[case.robot.frame_id(name)].name == name


def test_links_go_before_joints_of_the_same_name():
    """Where a link and another joint share a name, the name means the link."""
    robot = load_robot("example-robot-data:anymal_c", root="free_flyer")
    assert robot.model.frames[robot.frame_id("LF_HAA")].type == pin.FrameType.BODY


def test_frames_that_share_a_name_are_refused(hopper):
    """A name for two different places is ambiguous."""
    model = pin.Model(hopper.model)
    model.addFrame(pin.Frame("foot", 4, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    robot = type(hopper)(**{**vars(hopper), "model": model})
    with pytest.raises(RobotError, match="several frames called 'foot' at different places"):
        robot.frame_id("foot")


def test_shapes_are_read_on_demand(hopper):
    """Shapes are read once, when asked for."""
    robot = load_robot("example-robot-data:solo12", root="free_flyer")
    assert "visual_model" not in vars(robot)
    assert len(robot.visual_model.geometryObjects) == 17
    assert robot.visual_model is robot.visual_model
    assert len(hopper.visual_model.geometryObjects) == 3


def test_missing_meshes_are_an_error_only_when_drawn(tmp_path):
    """A robot without its meshes can be planned for, but not drawn."""
    file = tmp_path / "robot.urdf"
    file.write_text(
        '<robot name="r"><link name="a"/><link name="b"><visual><geometry><mesh filename="package://r/b.stl"/>'
        '</geometry></visual></link><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
        "</robot>"
    )
    robot = load_robot(file)
    with pytest.raises(RobotError, match=r"link 'b', mesh package://r/b\.stl: found no such file"):
        _ = robot.visual_model
