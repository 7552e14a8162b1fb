"""Contact pairs on real robots: gap, directions and Pinocchio's own numbers fit together."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import (
    CircleOnBox,
    CircleOnCircle,
    CircleOnSurface,
    ContactGeometry,
    PointOnSurface,
    Scene,
    TwoBodies,
    contact_of,
)
from fesd_robot.errors import RobotError
from fesd_robot.recovery.between_bodies import closest
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import Robot, configuration_derivative, load_robot

from .grounds import GROUNDS, HILLS

DISCS = Path(__file__).parent / "models" / "discs.urdf"
HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"
WALKER = Path(__file__).parents[1] / "robot" / "models" / "walker.xml"

CASES: dict[str, tuple[Path, ContactGeometry]] = {
    **{
        f"foot, {name}": (HOPPER, PointOnSurface("foot", ground))
        for name, ground in GROUNDS.items()
        if "raised" not in name
    },
    **{f"disc, {name}": (DISCS, CircleOnSurface("first", 0.2, GROUNDS[name])) for name in GROUNDS if "raised" in name},
    "wheel on a leg": (WALKER, CircleOnSurface("foot", 0.1, HILLS.raised(0.1))),
    "two discs": (DISCS, CircleOnCircle("first", 0.2, "second", 0.3)),
    "shank and foot": (HOPPER, CircleOnCircle("foot", 0.02, "body", 0.07)),
    "disc and box": (DISCS, CircleOnBox("first", 0.2, "second", (0.5, 0.3))),
    "foot and box": (HOPPER, CircleOnBox("foot", 0.02, "body", (0.3, 0.1))),
}
each_case = pytest.mark.parametrize(("source", "geometry"), CASES.values(), ids=CASES.keys())


def expressions(robot: Robot, geometry: ContactGeometry) -> ca.Function:
    """Return (q, v) -> gap, its rate by differentiation, J_n, J_t."""
    q, v = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    contact = contact_of(robot, q, geometry, name="it", friction=0.4)
    rate = ca.jtimes(contact.gap, q, configuration_derivative(robot, q, v))
    return ca.Function("contact", [q, v], [contact.gap, rate, contact.normal, contact.tangents])


def states(robot: Robot, count: int = 4) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(3)
    moved = [rng.uniform(-0.6, 0.6, robot.model.nv) for _ in range(count)]
    return [(pin.integrate(robot.model, robot.neutral, v), rng.normal(size=robot.model.nv)) for v in moved]


@each_case
def test_gap_and_rates_by_finite_differences(source: Path, geometry: ContactGeometry) -> None:
    """Along random motions d/dt f_c = J_n v, by differences of the gap and by CasADi's differentiation."""
    robot = load_robot(source)
    function, step = expressions(robot, geometry), 1e-6
    for q, v in states(robot):
        _, rate, normal, _ = (np.asarray(value.full()).ravel() for value in function(q, v))
        ends = [float(function(pin.integrate(robot.model, q, h * v), v)[0]) for h in (-step, step)]
        assert normal @ v == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-7)
        assert normal @ v == pytest.approx(rate[0], abs=1e-11)


@each_case
def test_expressions_and_pinocchio_agree(source: Path, geometry: ContactGeometry) -> None:
    """Gap, J_n and J_t as expressions are those that the audit computes with Pinocchio and scipy."""
    robot = load_robot(source)
    function = expressions(robot, geometry)
    physics = NumericPhysics(robot, Scene({}, {"it": geometry}), {"it": 0.4}, lambda _: np.zeros((0, 0)))
    for q, v in states(robot):
        gap, _, normal, tangent = (np.asarray(value.full()).ravel() for value in function(q, v))
        assert physics.gaps(q) == pytest.approx(gap, abs=1e-12)
        assert physics.contact_jacobian(q) == pytest.approx(np.array([normal, tangent]), abs=1e-9)


def test_the_contact_point_of_a_closed_gap_lies_on_both_bodies() -> None:
    """Where the gap is closed the contact point is on its own rim and on the surface or the other circle."""
    robot = load_robot(DISCS)
    for ground in (GROUNDS["level"], GROUNDS["slope"], HILLS, GROUNDS["left of a wall"]):
        on_ground = CircleOnSurface("first", 0.2, ground.raised(0.2))
        physics = NumericPhysics(robot, Scene({}, {"it": on_ground}), {"it": 0.4}, lambda _: np.zeros((0, 0)))
        for x in (-0.7, 0.1, 1.0):
            q = np.array([x, 0.5, 0.3, 0, 0, 0])
            for _ in range(50):
                normal = physics.contact_jacobian(q)[0]
                q = q - physics.gaps(q)[0] * normal / (normal @ normal)
            (point,) = physics.contact_points(q)
            assert ground.distance(point) == pytest.approx(0, abs=1e-6)
            assert np.linalg.norm(point - [q[0], 0, q[1]]) == pytest.approx(0.2, abs=1e-12)
    discs = Scene({}, {"it": CircleOnCircle("first", 0.2, "second", 0.3)})
    physics = NumericPhysics(robot, discs, {"it": 0.4}, lambda _: np.zeros((0, 0)))
    q = np.array([0.3 + 0.5 * 0.6, 0.1 + 0.5 * 0.8, 0, 0.3, 0.1, 0])
    assert physics.gaps(q) == pytest.approx([0], abs=1e-15)
    np.testing.assert_allclose(physics.contact_points(q), [[0.3 + 0.3 * 0.6, 0, 0.1 + 0.3 * 0.8]], atol=1e-15)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
@pytest.mark.parametrize(
    ("center", "gap", "side"),
    [
        ((0.6, 0.1), 0.15, (1, 0)),
        ((-0.6, -0.14), 0.15, (-1, 0)),
        ((0.2, 0.5), 0.15, (0, 1)),
        ((-0.1, -0.3), -0.05, (0, -1)),
        ((0.25 + 0.3, 0.15 + 0.4), 0.3, (0.6, 0.8)),
        ((0.2, 0.02), -0.25, (1, 0)),  # the centre is in the box
    ],
)
def test_a_disc_meets_sides_and_corners_of_a_box(
    turn: float, center: tuple[float, float], gap: float, side: tuple[float, float]
) -> None:
    """Gap and direction are those of the nearest point of the box, however it is turned, in both computations."""
    robot, geometry = load_robot(DISCS), CircleOnBox("first", 0.2, "second", (0.5, 0.3))
    turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])  # about +y, of x and z
    q = np.array([*(turned @ center + [0.3, -0.1]), 0.4, 0.3, -0.1, -turn])  # the second joint turns about -y
    values = [np.asarray(value.full()).ravel() for value in expressions(robot, geometry)(q, np.zeros(6))]
    physics = NumericPhysics(robot, Scene({}, {"it": geometry}), {"it": 0.4}, lambda _: np.zeros((0, 0)))
    direction = turned @ side
    assert values[0] == pytest.approx([gap], abs=1e-12) and physics.gaps(q) == pytest.approx([gap], abs=1e-12)
    assert values[2][:2] == pytest.approx(direction, abs=1e-9)
    assert values[2][3:5] == pytest.approx(-direction, abs=1e-9)
    (point,) = physics.contact_points(q)
    assert point[[0, 2]] == pytest.approx(q[:2] - 0.2 * direction, abs=1e-9)


def test_a_box_that_is_not_seen_from_the_side_is_refused(tmp_path: Path) -> None:
    """The sides of a box lie in the x-z plane: the y axis of its frame has to be that of the world."""
    file = tmp_path / "discs.urdf"
    text = DISCS.read_text(encoding="utf-8")
    lying = (
        "<link name='lying'/><joint name='lying' type='fixed'><parent link='second'/><child link='lying'/>"
        "<origin xyz='0 0 0' rpy='1.5708 0 0'/></joint></robot>"
    )
    file.write_text(text.replace("</robot>", lying), encoding="utf-8")
    robot = load_robot(file)
    q = ca.SX.sym("q", robot.model.nq)
    with pytest.raises(RobotError, match="contact 'hand': the y axis of frame 'lying' points along"):
        contact_of(robot, q, CircleOnBox("first", 0.2, "lying", (0.5, 0.3)), name="hand", friction=0.5)


def frame_motion(robot: Robot, frame: str, q: np.ndarray, v: np.ndarray, step: float) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, pin.integrate(robot.model, q, step * v))
    return data.oMf[robot.frame_id(frame)].copy()


@pytest.mark.parametrize("name", [name for name in CASES if not name.startswith("foot")])
def test_the_tangential_velocity_is_that_of_the_material_point(name: str) -> None:
    """J_t v is the velocity of the body's point at the contact along the surface, by finite differences."""
    source, geometry = CASES[name]
    robot = load_robot(source)
    function, step = expressions(robot, geometry), 1e-6
    for q, v in states(robot):
        here = frame_motion(robot, geometry.frame, q, v, 0.0)
        if isinstance(geometry, TwoBodies):
            other = frame_motion(robot, geometry.other_frame, q, v, 0.0)
            gap, normal = closest(geometry, here.translation, other.translation, other.rotation)
            tangent = np.array([normal[2], 0, -normal[0]])
            bodies = [(geometry.frame, geometry.radius), (geometry.other_frame, geometry.radius + gap)]
        else:
            bodies = [(geometry.frame, geometry.radius)]
            tangent = np.asarray(geometry.path.axes(here.translation).tangent)
            normal = np.array([-tangent[2], 0, tangent[0]])
        velocities = []
        for frame, reach in bodies:
            fixed = frame_motion(robot, frame, q, v, 0.0).actInv(here.translation - reach * normal)
            ends = [frame_motion(robot, frame, q, v, h).act(fixed) for h in (-step, step)]
            velocities.append(tangent @ (ends[1] - ends[0]) / (2 * step))
        tangential = np.asarray(function(q, v)[3].full()).ravel() @ v
        assert tangential == pytest.approx(velocities[0] - sum(velocities[1:]), abs=1e-7)


def test_a_rolling_disc_does_not_slide() -> None:
    """With x' = r w the touching point of a disc on level ground rests; two gears that mesh do not slide either."""
    robot = load_robot(DISCS)
    disc = expressions(robot, CircleOnSurface("first", 0.2, GROUNDS["level"].raised(0.2)))
    v = np.array([0.2 * 3.0, 0, 3.0, 0, 0, 0])  # turning about +y rolls towards +x
    assert float(ca.dot(disc(np.zeros(6), v)[3], v)) == pytest.approx(0, abs=1e-15)
    gears = expressions(robot, CircleOnCircle("first", 0.2, "second", 0.3))
    v = np.array([0, 0, 3.0, 0, 0, 2.0])  # the second joint turns about -y
    assert float(ca.dot(gears(np.array([0.5, 0, 0, 0, 0, 0]), v)[3], v)) == pytest.approx(0, abs=1e-15)


def test_circles_at_one_place_have_finite_derivatives() -> None:
    """A start guess that puts two centres on each other does not make the expressions undefined."""
    function = expressions(load_robot(DISCS), CircleOnCircle("first", 0.2, "second", 0.3))
    values = function(np.zeros(6), np.ones(6))
    assert np.isfinite(np.concatenate([np.asarray(value.full()).ravel() for value in values])).all()
    assert float(values[0]) == pytest.approx(-0.5)
    touching = function(np.array([0.3, 0.4, 0, 0, 0, 0]), np.ones(6))
    assert abs(float(touching[0])) <= 1e-16


def test_a_wheel_that_turns_sideways_is_refused() -> None:
    """A circle whose body can turn out of the plane is an error of the robot that names contact and frame."""
    robot = load_robot("example-robot-data:solo12", root="free_flyer")
    q = ca.SX.sym("q", robot.model.nq)
    with pytest.raises(RobotError, match="contact 'wheel': frame 'FL_FOOT' can leave the x-z plane"):
        contact_of(robot, q, CircleOnSurface("FL_FOOT", 0.1, HILLS), name="wheel", friction=0.5)
    fixed = load_robot("example-robot-data:solo12")
    q = ca.SX.sym("q", fixed.model.nq)
    with pytest.raises(RobotError, match="contact 'wheel': frame 'FL_SHOULDER' can turn out of the x-z plane"):
        contact_of(fixed, q, CircleOnSurface("FL_SHOULDER", 0.1, HILLS), name="wheel", friction=0.5)
