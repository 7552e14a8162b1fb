"""MuJoCo files: numbers computed by MuJoCo itself, and everything that Pinocchio would silently drop is refused."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import frame_placement, kinetic_energy, load_robot, potential_energy

MODELS = Path(__file__).parent / "models"


def _energies_and_place(robot, q, v, frame):
    q, v = ca.SX(ca.DM(q)), ca.SX(ca.DM(v))
    expressions = (kinetic_energy(robot, q, v), potential_energy(robot, q), frame_placement(robot, q, frame)[1])
    return [ca.evalf(expression).full().ravel() for expression in expressions]


def test_walker_agrees_with_mujoco():
    """Energies and the foot's place at a given qpos and qvel are those of MuJoCo 4.0."""
    robot = load_robot(MODELS / "walker.xml")
    kinetic, potential, foot = _energies_and_place(
        robot, [0.968, 1.115, -0.122, 0.501, -0.443], [-0.292, 0.883, 0.58, 0.092, 0.67], "foot"
    )
    assert kinetic == pytest.approx(5.829984174588974, rel=1e-12)
    assert potential == pytest.approx(103.80034390795744, rel=1e-12)
    assert foot == pytest.approx([1.324845314275051, 0.0, 0.5515969267454784], rel=1e-12)


def test_crawler_agrees_with_mujoco():
    """Free, ball and combined joints, gravity and a tilted start: energies and places are those of MuJoCo 4.0."""
    robot = load_robot(MODELS / "crawler.xml")
    w, x, y, z = 0.9609726126708027, -0.0059998290073099, 0.05999829007309902, 0.26999230532894564
    wrist = [0.7372529211353657, 0.05001715882872224, -0.07802676777280668, 0.6692295851283034]
    q = [1.22, -1.278, 1.209, x, y, z, w, -1.01, -0.116, -0.433, *wrist, -0.141]
    world_velocity = np.array([-0.668, -1.055, -0.391])
    local_velocity = pin.Quaternion(w, x, y, z).matrix().T @ world_velocity
    v = [*local_velocity, 0.482, -0.239, 0.958, -0.2, 0.024, 1.546, 0.545, -0.505, -0.183, 0.541]
    kinetic, potential, finger = _energies_and_place(robot, q, v, "finger")
    assert kinetic == pytest.approx(2.632814499852971, rel=1e-12)
    assert potential == pytest.approx(19.71231129333314, rel=1e-12)
    assert finger == pytest.approx([1.5537007113648456, -1.7407962142903812, 1.0377410298680194], rel=1e-12)


def test_joints_of_one_body_keep_their_names():
    """Several joints on one body, a ball and a free joint are named entry by entry."""
    robot = load_robot(MODELS / "crawler.xml", armature={"elbow": 0.5})
    base = [f"floating.{s}" for s in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    ball = [f"wrist.{s}" for s in ("qx", "qy", "qz", "qw")]
    assert robot.configuration_names == [*base, "shoulder", "elbow", "rail", *ball, "grip"]
    twist = [f"floating.{s}" for s in ("vx", "vy", "vz", "wx", "wy", "wz")]
    turn = [f"wrist.{s}" for s in ("wx", "wy", "wz")]
    assert robot.velocity_names == [*twist, "shoulder", "elbow", "rail", *turn, "grip"]
    armature = dict(zip(robot.velocity_names, robot.model.armature, strict=True))
    assert (armature["shoulder"], armature["elbow"], armature["wrist.wy"]) == (0.02, 0.5, 0.01)


def test_limits_are_those_of_the_file():
    """Free and ball joints are unlimited, ranges are read, and of asymmetric efforts the smaller side counts."""
    robot = load_robot(MODELS / "crawler.xml")
    lower = dict(zip(robot.configuration_names, robot.lower_position, strict=True))
    upper = dict(zip(robot.configuration_names, robot.upper_position, strict=True))
    assert (lower["elbow"], upper["elbow"], lower["rail"], upper["rail"]) == (-1.0, 1.0, -0.5, 0.2)
    for name in ("floating.x", "floating.qw", "wrist.qx", "shoulder"):
        assert (lower[name], upper[name]) == (-np.inf, np.inf)
    assert dict(zip(robot.velocity_names, robot.effort_limit, strict=True))["elbow"] == 2.0


def test_what_is_left_out_is_noted():
    """Springs, damping of ball joints, actuators and asymmetric efforts of the file are in the notes."""
    notes = " ".join(load_robot(MODELS / "crawler.xml").notes)
    for word in ("springs", "damping of ball joints", "Actuators", "Asymmetric effort"):
        assert word in notes


def _body(inside: str = "", attributes: str = 'name="b"') -> str:
    return f'<body {attributes}><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{inside}</body>'


HINGE = '<joint name="j" axis="0 1 0"/>'
LIFTED = _body(_body(HINGE), 'name="base" pos="0 0 1"')
TURNED = _body(_body(HINGE), 'name="base" quat="0 0 0 1"')
SLIDING = _body('<joint name="s" type="slide" range="-1 2"/>')
SHIFTED = _body('<joint name="h" ref="0.1" range="-1 2"/>')
SCREW = _body('<joint name="h" type="screw"/>')


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<include file="x.xml"/>', "<include> is not supported"),
        (f"<worldbody><frame>{_body(HINGE)}</frame></worldbody>", "<frame> is not supported"),
        (f"<worldbody>{_body(HINGE)}{_body(HINGE)}</worldbody>", "exactly one body, the robot's first, but has 2"),
        ("<worldbody/>", "exactly one body, the robot's first, but has 0"),
        (f"<worldbody>{_body(HINGE + _body('', ''))}</worldbody>", "every <body> needs a name"),
        (
            f'<worldbody>{_body(HINGE)}</worldbody><equality><joint joint1="j"/></equality>',
            "<equality> constraints are not supported",
        ),
        (
            f"<worldbody>{LIFTED}</worldbody>",
            "the pose of body 'base', which is fixed to the world, would be lost",
        ),
        (
            f"<worldbody>{TURNED}</worldbody>",
            "remove its attribute 'quat'",
        ),
        (
            f"<worldbody>{SLIDING}</worldbody>",
            "Pinocchio scales the range of a sliding joint",
        ),
        (
            f'<compiler angle="radian"/><worldbody>{SHIFTED}</worldbody>',
            "Pinocchio shifts the range of a joint by its reference position",
        ),
        (f"<worldbody>{SCREW}</worldbody>", "cannot be read: .*Unknown joint type"),
        (f'<option gravity="down"/><worldbody>{_body(HINGE)}</worldbody>', "'down' is not a list of numbers"),
    ],
)
def test_a_file_that_would_be_read_in_part_is_refused(tmp_path, content, message):
    """Whatever Pinocchio drops or misreads is a RobotError that says so."""
    file = tmp_path / "robot.xml"
    file.write_text(f'<mujoco model="m">{content}</mujoco>')
    with pytest.raises(RobotError, match=message):
        load_robot(file)


def test_a_second_root_is_refused():
    """A file with its own free joint takes no other root."""
    with pytest.raises(RobotError, match="its own free root joint 'floating'; set root to 'fixed' instead of 'planar'"):
        load_robot(MODELS / "crawler.xml", root="planar")


@pytest.mark.parametrize(("root", "size"), [("planar", 4), ("free_flyer", 7)])
def test_a_root_is_put_under_the_first_body(tmp_path, root, size):
    """A first body without joint gets the root asked for, and its pose is a start, not a place."""
    file = tmp_path / "robot.xml"
    file.write_text(f'<mujoco model="m"><worldbody>{LIFTED}</worldbody></mujoco>')
    robot = load_robot(file, root=root)
    assert robot.model.nq == size + 1
    _, position = frame_placement(robot, ca.SX(ca.DM(robot.neutral)), "base")
    assert np.array_equal(ca.evalf(position).full().ravel(), np.zeros(3))


def test_shapes_of_a_mujoco_file():
    """The shapes to draw come with the file."""
    assert len(load_robot(MODELS / "walker.xml").visual_model.geometryObjects) == 4
