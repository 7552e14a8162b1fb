"""Models that are wrong or nearly so: limits, followers and axes that a file writes, and what the robot has of them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, frame_jacobian, immovable_joints, load_robot
from fesd_robot.robot.joints import Prismatic
from fesd_robot.robot.tree import directions

INERTIAL = (
    '<inertial><origin xyz="0 0 -0.1"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
)


def urdf(knee: str, kind: str = "revolute", *, axis: str = "0 1 0", origin: str = "") -> str:
    """Return a leg whose hip turns in [-2, 2] at 20 rad/s and 40 N m, and whose knee has the given elements."""
    return (
        '<robot name="leg"><link name="base"/>'
        f'<link name="thigh">{INERTIAL}</link><link name="shank">{INERTIAL}</link><link name="foot"/>'
        '<joint name="hip" type="revolute"><parent link="base"/><child link="thigh"/><axis xyz="0 1 0"/>'
        '<limit lower="-2" upper="2" velocity="20" effort="40"/></joint>'
        f'<joint name="knee" type="{kind}"><parent link="thigh"/><child link="shank"/>'
        f'<origin xyz="0 0 -0.3" {origin}/><axis xyz="{axis}"/>{knee}</joint>'
        '<joint name="ankle" type="fixed"><parent link="shank"/><child link="foot"/><origin xyz="0 0 -0.3"/></joint>'
        "</robot>"
    )


def limit(lower: float = -2.5, upper: float = 0.0, velocity: float = 20.0, effort: float = 40.0) -> str:
    """Return a <limit>."""
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'


def follows(multiplier: float, offset: float = 0.0) -> str:
    """Return the <mimic> of a joint that follows the hip."""
    return f'<mimic joint="hip" multiplier="{multiplier}" offset="{offset}"/>'


def mjcf(
    rest: str, *, left: str = 'range="0 0.04"', right: str = 'range="0 0.04"', axis: str = "1 0 0", body: str = ""
) -> str:
    """Return a hand with two sliding fingers."""
    return (
        '<mujoco model="hand"><worldbody><body name="hand"><joint name="lift" type="slide" axis="0 0 1" range="-1 1"/>'
        '<geom type="box" size="0.05 0.03 0.02" mass="0.5"/>'
        f'<body name="left" {body}><joint name="left" type="slide" axis="{axis}" {left}/>'
        '<geom type="box" size="0.01 0.01 0.03" mass="0.1"/></body>'
        f'<body name="right"><joint name="right" type="slide" axis="-1 0 0" {right}/>'
        f'<geom type="box" size="0.01 0.01 0.03" mass="0.1"/></body></body></worldbody>{rest}</mujoco>'
    )


def equality(polycoef: str = "0 1", first: str = "right", second: str = "left") -> str:
    """Return an equality with which a finger follows the other."""
    return f'<equality><joint joint1="{first}" joint2="{second}" polycoef="{polycoef} 0 0 0"/></equality>'


TENDON = (
    '<tendon><fixed name="split"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>'
    '<actuator><motor name="grip" tendon="split" ctrlrange="-30 30"/></actuator>'
)


def motor(joint: str, gear: float = 1.0) -> str:
    """Return a motor of 10 N."""
    return f'<actuator><motor joint="{joint}" gear="{gear}" ctrlrange="-10 10"/></actuator>'


def loaded(folder: Path, text: str) -> Robot:
    """Return the robot of a file with a text."""
    file = folder / ("robot.xml" if text.startswith("<mujoco") else "robot.urdf")
    file.write_text(text)
    return load_robot(file)


REFUSED = {
    "revolute joint, lower > upper": (urdf(limit(0, -2.5)), "limits [0, -2.5] of joint 'knee', lower > upper"),
    "prismatic joint, lower > upper": (urdf(limit(0.3, 0.1), "prismatic"), "limits [0.3, 0.1] of joint 'knee'"),
    "negative velocity": (urdf(limit(velocity=-1)), "velocity -1 in the <limit> of joint 'knee'"),
    "negative effort": (urdf(limit(effort=-1)), "effort -1 in the <limit> of joint 'knee'"),
    "negative velocity, continuous": (urdf(limit(velocity=-1), "continuous"), "velocity -1 in the <limit> of joint"),
    "negative effort of a follower": (urdf(limit(effort=-5) + follows(1)), "effort -5 in the <limit> of joint 'knee'"),
    "follower and leader with no common value": (
        urdf(limit(3, 4) + follows(1)),
        "joint 'knee' with limits [3, 4], which follows 'hip' as 1 hip, and 'hip' with limits [-2, 2], where it is in "
        "[-2, 2], expected limits that both can keep",
    ),
    "an offset out of range": (urdf(limit(-1, 1) + follows(-0.5, 3)), "which follows 'hip' as -0.5 hip + 3, and 'hip'"),
    "a follower that stands still": (urdf(limit() + follows(0)), "'knee' mimics another one with multiplier 0"),
    "MJCF, lower > upper": (
        mjcf("", left='range="0.04 0"'),
        "found range [0.04, 0] of joint 'left', which MuJoCo takes as no limit",
    ),
    "MJCF, no common value": (
        mjcf(equality("0.1 1")),
        "joint 'right' with limits [0, 0.04], which follows 'left' as 1 left + 0.1, and 'left' with limits [0, 0.04]",
    ),
    "MJCF, a range of no width": (mjcf("", left='range="0.02 0.02"'), "found range [0.02, 0.02] of joint 'left'"),
    "MJCF, ctrlrange the wrong way round": (
        mjcf('<actuator><motor joint="left" ctrlrange="1 -1"/></actuator>'),
        "found ctrlrange [1, -1] of actuator",
    ),
}
"""What is wrong -> the file, and what its error says."""


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_kept_is_refused(case: str, tmp_path: Path) -> None:
    """The error names the file, the joint and what was found."""
    text, words = REFUSED[case]
    with pytest.raises(RobotError) as caught:
        loaded(tmp_path, text)
    assert words in " ".join(str(caught.value).split())


def position(robot: Robot, name: str) -> tuple[float, float]:
    """Return the limits of a coordinate."""
    k = robot.configuration_names.index(name)
    return float(robot.lower_position[k]), float(robot.upper_position[k])


def velocity(robot: Robot, name: str) -> float:
    """Return the limit of a velocity."""
    return float(robot.velocity_limit[robot.velocity_names.index(name)])


def effort(robot: Robot, name: str) -> tuple[float, float]:
    """Return the limits of the force on a coordinate."""
    k = robot.velocity_names.index(name)
    return float(robot.lower_effort[k]), float(robot.upper_effort[k])


def warned(robot: Robot) -> str:
    """Return what is said about joints that cannot move."""
    limits = -robot.velocity_limit, robot.velocity_limit
    return " ".join(immovable_joints(robot, (robot.lower_position, robot.upper_position), limits))


def said(robot: Robot) -> str:
    """Return what is said about the limits and about what is left out."""
    return " ".join([*robot.limit_notes.values(), *robot.notes])


def axis(robot: Robot, name: str) -> list[float]:
    """Return the axis of a joint."""
    linear, angular = directions(robot.model.joints[robot.model.getJointId(name)])
    return [float(entry) for entry in linear + angular]


def placement(robot: Robot, name: str) -> np.ndarray:
    """Return the rotation of a joint on its parent."""
    return np.array(robot.model.jointPlacements[robot.model.getJointId(name)].rotation)


def planar(robot: Robot, frame: str = "foot") -> bool:
    """Return whether a frame stays in the x-z plane, exactly."""
    import casadi as ca

    q = ca.SX.sym("q", robot.model.nq)
    return not ca.sparsify(ca.simplify(frame_jacobian(robot, q, frame)[1, :])).nnz()


ACCEPTED: dict[str, tuple[str, Callable[[Robot], bool]]] = {
    "no range is [0, 0] as in URDF": (
        urdf('<limit velocity="20" effort="40"/>'),
        lambda robot: (
            position(robot, "knee") == (0, 0)
            and "The file gives 'knee' no range, which URDF takes as [0, 0]; limits.position.knee gives it one"
            in said(robot)
            and "'knee' cannot move" in warned(robot)
        ),
    ),
    "one end only": (
        urdf('<limit lower="-1" velocity="20" effort="40"/>'),
        lambda robot: (
            position(robot, "knee") == (-1, 0)
            and "no upper limit, which URDF takes as [-1, 0]" in said(robot)
            and not warned(robot)
        ),
    ),
    "a written range of no width": (
        urdf(limit(0, 0)),
        lambda robot: "'knee' cannot move: its limits are [0, 0]" in warned(robot) and not said(robot),
    ),
    "a velocity of 0": (
        urdf(limit(velocity=0)),
        lambda robot: (
            "velocity limit of 'knee' is 0, so that it cannot move; limits.velocity" in warned(robot)
            and "effort" not in warned(robot)
        ),
    ),
    "a velocity and an effort of 0": (
        urdf(limit(velocity=0, effort=0)),
        lambda robot: "'knee' has an effort limit of 0, too, which limits.effort replaces" in warned(robot),
    ),
    "an effort of 0 is a joint without motor": (
        urdf(limit(effort=0)),
        lambda robot: effort(robot, "knee") == (0, 0) and not warned(robot) and not said(robot),
    ),
    "the range of a continuous joint": (
        urdf(limit(-3.14, 3.14), "continuous"),
        lambda robot: "range of the continuous joint 'knee' is not read: [-3.14, 3.14] rad" in said(robot),
    ),
    "a continuous joint without <limit>": (
        urdf("", "continuous"),
        lambda robot: np.isinf(position(robot, "knee.cos")).all() and not said(robot) and not warned(robot),
    ),
    "a follower with an offset": (
        urdf(limit(-2.5, 0) + follows(1, 1)),
        lambda robot: (
            position(robot, "hip") == (-2, -1)
            and "limits of 'hip' are [-2, -1]: 'knee', which follows as 1 hip + 1, has [-2.5, 0]" in said(robot)
        ),
    ),
    "a follower twice as fast, the other way": (
        urdf(limit(-1, 0.5, velocity=4) + follows(-2)),
        lambda robot: position(robot, "hip") == (-0.25, 0.5) and velocity(robot, "hip") == 2,
    ),
    "a follower within its limits": (
        urdf(limit(-2, 2) + follows(0.5)),
        lambda robot: position(robot, "hip") == (-2, 2) and velocity(robot, "hip") == 20 and not said(robot),
    ),
    "a follower whose limits are the leader's but for rounding": (
        urdf(limit(-1.4000000001, 1.3999999999) + follows(0.7)),
        lambda robot: position(robot, "hip") == (-2, 2) and not said(robot),
    ),
    "a follower at one value only": (
        urdf(limit(2, 3) + follows(1)),
        lambda robot: position(robot, "hip") == (2, 2) and "'hip' cannot move" in warned(robot),
    ),
    "a follower without range": (
        urdf('<limit velocity="20" effort="40"/>' + follows(1)),
        lambda robot: (
            position(robot, "hip") == (-2, 2) and "gives 'knee' no range; 'hip', which it follows" in said(robot)
        ),
    ),
    "a follower with a velocity of 0": (
        urdf(limit(-2, 2, velocity=0) + follows(1)),
        lambda robot: "velocity limit of 'hip' is 0" in warned(robot) and "'knee', which follows" in said(robot),
    ),
    "the effort of a follower, which has no motor": (
        urdf(limit(-2, 2, effort=7) + follows(2)),
        lambda robot: effort(robot, "hip") == (-40, 40),
    ),
    "an axis with round-off": (
        urdf(limit(), axis="1e-7 1 -1e-8"),
        lambda robot: axis(robot, "knee") == [0, 1, 0] and planar(robot) and "axes of knee" in said(robot),
    ),
    "an axis against y with round-off": (
        urdf(limit(), axis="2.2e-8 -1 4.4e-8"),
        lambda robot: axis(robot, "knee") == [0, -1, 0] and planar(robot),
    ),
    "a slanted slide with round-off": (
        urdf(limit(0, 0.2), "prismatic", axis="0.6 1e-8 0.8"),
        lambda robot: np.allclose(axis(robot, "knee"), [0.6, 0, 0.8], atol=1e-15) and planar(robot),
    ),
    "a continuous axis with round-off": (
        urdf("", "continuous", axis="0 1 -3e-7"),
        lambda robot: axis(robot, "knee") == [0, 1, 0] and planar(robot),
    ),
    "the axis of a follower with round-off": (
        urdf(limit(-2, 2) + follows(1), axis="1e-7 1 0"),
        lambda robot: planar(robot) and "axes of knee" in said(robot),
    ),
    "an axis that is meant to be slanted": (
        urdf(limit(), axis="1e-4 1 0"),
        lambda robot: not planar(robot) and not said(robot),
    ),
    "a right angle of few digits": (
        urdf(limit(), axis="0 0 -1", origin='rpy="1.5708 0 0"'),
        lambda robot: planar(robot) and "right angles" in said(robot),
    ),
    "an angle about y with round-off about x": (
        urdf(limit(), origin='rpy="1e-7 0.5 -2e-8"'),
        lambda robot: (
            planar(robot) and np.allclose(placement(robot, "knee")[0], [np.cos(0.5), 0, np.sin(0.5)], atol=1e-7)
        ),
    ),
    "an angle that is meant to be slanted": (
        urdf(limit(), origin='rpy="0.001 0 0"'),
        lambda robot: not planar(robot) and not said(robot),
    ),
    "MJCF: a tendon over a finger and one that follows": (
        mjcf(equality() + TENDON),
        lambda robot: dict(robot.drives["grip"].force) == {"left": 1.0} and robot.drives["grip"].upper == 30,
    ),
    "MJCF: the follower is half as fast": (
        mjcf(equality("0 0.5") + TENDON),
        lambda robot: dict(robot.drives["grip"].force) == {"left": 0.75},
    ),
    "MJCF: a tendon whose fingers push against each other": (
        mjcf(equality("0 -1") + TENDON, right='range="-0.04 0"'),
        lambda robot: "grip" not in robot.drives and "push a joint and one that follows it against" in said(robot),
    ),
    "MJCF: a motor on the follower": (
        mjcf(equality("0 -0.5") + motor("right", 2.0), right='range="-1 1"'),
        lambda robot: effort(robot, "left") == (-10, 10) and robot.driven[robot.velocity_names.index("left")],
    ),
    "MJCF: the follower has the smaller range": (
        mjcf(equality("0.01 2"), right='range="0 0.05"'),
        lambda robot: (
            np.allclose(position(robot, "left"), (0, 0.02)) and "'right', which follows as 2 left" in said(robot)
        ),
    ),
    "MJCF: the leader comes after its follower": (
        mjcf(equality("0 2", "left", "right"), left='range="0 0.04"', right='range="0 0.01"'),
        lambda robot: np.allclose(position(robot, "left"), (0, 0.02)),
    ),
    "MJCF: a follower without range": (
        mjcf(equality(), right=""),
        lambda robot: position(robot, "left") == (0, 0.04) and "limits of" not in said(robot),
    ),
    "MJCF: an axis with round-off": (
        mjcf("", axis="1 1e-8 0"),
        lambda robot: axis(robot, "left") == [1, 0, 0] and isinstance(robot.tree.links[1].joint, Prismatic),
    ),
    "MJCF: a quaternion with round-off": (
        mjcf("", body='quat="1 0 1e-7 1e-8"'),
        lambda robot: np.array_equal(placement(robot, "left"), np.eye(3)) and "right angles" in said(robot),
    ),
    "MJCF: no limit": (
        mjcf("", left=""),
        lambda robot: np.isinf(position(robot, "left")).all() and not warned(robot),
    ),
}
"""What is borderline -> the file, and what the robot has to have of it."""


@pytest.mark.parametrize("case", ACCEPTED)
def test_what_is_borderline_is_read_as_it_is_meant(case: str, tmp_path: Path) -> None:
    """Limits, forces and axes are those that the file means, and what is changed or in the way is said."""
    text, holds = ACCEPTED[case]
    robot = loaded(tmp_path, text)
    assert holds(robot), (robot.limit_notes, robot.notes, warned(robot), position(robot, robot.configuration_names[0]))


def test_a_follower_keeps_within_its_limits(tmp_path: Path) -> None:
    """At both ends of the leader's range the follower is within its own, and at one of them at its end."""
    generator = np.random.default_rng(3)
    for _ in range(20):
        ratio, offset = generator.uniform(0.3, 2) * generator.choice([-1, 1]), generator.uniform(-0.5, 0.5)
        lower, upper = generator.uniform(-3, -0.6), generator.uniform(0.6, 3)
        robot = loaded(tmp_path, urdf(limit(lower, upper) + follows(ratio, offset)))
        ends = np.array(position(robot, "hip"))
        followed = np.sort(ratio * ends + offset)
        assert lower - 1e-9 <= followed[0] and followed[1] <= upper + 1e-9
        assert all(abs(end) == 2 or np.abs(ratio * end + offset - [lower, upper]).min() < 1e-9 for end in ends)


def test_errors_name_the_file(tmp_path: Path) -> None:
    """The sentence begins with the address of the file."""
    with pytest.raises(RobotError, match=re.escape(f"{tmp_path / 'robot.urdf'}: found limits")):
        loaded(tmp_path, urdf(limit(1, 0)))
