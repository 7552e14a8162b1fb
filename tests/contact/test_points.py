"""Contact points on real robots: gap and directions fit together, and only planar motion is accepted."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import Plane, point_contact
from fesd_robot.errors import RobotError
from fesd_robot.robot import configuration_derivative, load_robot

HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"
WALKER = Path(__file__).parents[1] / "robot" / "models" / "walker.xml"


@pytest.mark.parametrize("source", [HOPPER, WALKER], ids=["hopper", "walker"])
@pytest.mark.parametrize("ground", [Plane(height=0.1), Plane(slope=0.3)], ids=["level", "sloped"])
def test_normal_and_tangent_are_derivatives(source: Path, ground: Plane) -> None:
    """d/dt f_c = J_n v, and J_t v is the velocity of the point along the ground, at random states."""
    robot = load_robot(source)
    q, v = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    contact = point_contact(robot, q, ground, name="tip", frame="foot", friction=0.6)
    sideways = point_contact(robot, q, Plane(slope=ground.slope - np.pi / 2), name="wall", frame="foot", friction=0)
    rates = ca.jtimes(ca.vertcat(contact.gap, sideways.gap), q, configuration_derivative(robot, q, v))
    velocities = ca.vertcat(ca.dot(contact.normal, v), ca.dot(contact.tangents, v))
    both = ca.Function("both", [q, v], [rates, velocities])
    assert (contact.name, contact.friction) == ("tip", 0.6)
    rng = np.random.default_rng(4)
    for _ in range(3):
        at = robot.neutral + rng.uniform(-0.3, 0.3, robot.model.nq)
        values, expected = (np.asarray(value).ravel() for value in both(at, rng.normal(size=robot.model.nv)))
        assert values == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("source", "root", "frame"),
    [("example-robot-data:solo12", "free_flyer", "FL_FOOT"), ("example-robot-data:solo12", "fixed", "FL_FOOT")],
    ids=["free-flyer", "joints that swing sideways"],
)
def test_a_frame_that_leaves_the_plane_is_refused(source: str, root: str, frame: str) -> None:
    """A root or joint that can move the point along y makes planar friction wrong, and is named."""
    robot = load_robot(source, root=root)  # type: ignore[arg-type]
    q = ca.SX.sym("q", robot.model.nq)
    with pytest.raises(RobotError, match=f"contact 'toe': frame '{frame}' can leave the x-z plane"):
        point_contact(robot, q, Plane(), name="toe", frame=frame, friction=0.5)


def test_an_unknown_frame_is_refused() -> None:
    """A frame that the robot does not have is an error of the robot."""
    robot = load_robot(HOPPER)
    with pytest.raises(RobotError, match="'toe'"):
        point_contact(robot, ca.SX.sym("q", 4), Plane(), name="foot", frame="toe", friction=0.5)
