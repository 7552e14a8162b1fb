"""Bodies beside a robot: one model with the coordinates, the inertia and the shapes of all."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, load_robot, mass_matrix, nonlinear_effects
from fesd_robot.robot.bodies import beside
from fesd_robot.robot.root import ROOTS, Root
from fesd_robot.robot.simple_body import UniformSolid, ball, box, cylinder, simple_body

MODELS = Path(__file__).parents[2] / "models"
NOWHERE = np.zeros(3)


@pytest.fixture(scope="module")
def arm() -> Robot:
    """A robot with a fixed root whose joints have all properties, and links and joints of one name."""
    properties = {"armature": {"elbow": 0.3}, "damping": {"shoulder": 0.2}, "dry_friction": {"elbow": 0.7}}
    return load_robot(MODELS / "pushing_arm" / "pushing_arm.urdf", **properties)


def numbers(robot: Robot, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return M and h of the CasADi expressions."""
    names = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    function = ca.Function("dynamics", [*names], [mass_matrix(robot, names[0]), nonlinear_effects(robot, *names)])
    mass, effects = function(q, v)
    return np.array(mass), np.array(effects).ravel()


@pytest.mark.parametrize("root", ROOTS)
def test_the_dynamics_are_those_of_each_alone(arm: Robot, root: Root) -> None:
    """Mass matrix and nonlinear effects are blocks: those of the robot, and those of every body by itself."""
    other = load_robot(MODELS / "pusher_slider" / "pusher_slider.urdf", armature={"slider_x": 0.4})
    bodies = {"crate": simple_body("crate", box((0.2, 0.3, 0.4), 0.5), root), "other": other}
    merged = beside(arm, bodies, {"crate": np.array([1.0, 2.0, 3.0]), "other": NOWHERE})
    assert merged.configuration_names[:5] == arm.configuration_names
    rng, parts, start = np.random.default_rng(2), [arm, *bodies.values()], 0
    q, v = [pin.randomConfiguration(part.model, -np.ones(part.model.nq), np.ones(part.model.nq)) for part in parts], []
    v = [rng.normal(size=part.model.nv) for part in parts]
    mass, effects = numbers(merged, np.concatenate(q), np.concatenate(v))
    for part, own_q, own_v in zip(parts, q, v, strict=True):
        if part.model.nv:
            own_mass, own_effects = numbers(part, own_q, own_v)
            rows = slice(start, start + part.model.nv)
            np.testing.assert_allclose(mass[rows, rows], own_mass, atol=1e-14)
            np.testing.assert_allclose(effects[rows], own_effects, atol=1e-12)
            mass[rows, rows] = 0.0
            start += part.model.nv
    assert not mass.any()


def test_properties_of_joints_stay(arm: Robot) -> None:
    """Armature, damping, dry friction, limits and efforts of all parts are in the merged model."""
    merged = beside(arm, {"second": arm}, {"second": NOWHERE})
    for array in ("armature", "damping", "upperDryFrictionLimit", "upperPositionLimit", "velocityLimit"):
        own = getattr(arm.model, array)
        np.testing.assert_array_equal(getattr(merged.model, array), np.concatenate([own, own]))
    np.testing.assert_array_equal(merged.driven, np.concatenate([arm.driven, arm.driven]))
    assert merged.dry_friction == {"elbow": 0.7, "second.elbow": 0.7}
    assert merged.frame_id("second.tip") != merged.frame_id("tip")
    assert merged.body_of("second.tip") == "second" and merged.body_of("tip") is None


def test_shapes_are_where_the_bodies_are(arm: Robot) -> None:
    """What is drawn of a body beside the robot is where it is drawn of the body alone, moved to its place."""
    place = np.array([0.5, -0.2, 0.1])
    for root in ROOTS:
        body = simple_body("can", cylinder(0.1, 0.3, "y", 1.0), root)
        merged = beside(arm, {"can": body}, {"can": place})
        drawn = merged.visual_model.geometryObjects[-1]
        assert [drawn.name for drawn in merged.visual_model.geometryObjects][-1] == "can.middle 0 shape"
        data = merged.model.createData()
        pin.framesForwardKinematics(merged.model, data, merged.neutral)
        at = data.oMi[drawn.parentJoint] * drawn.placement
        np.testing.assert_allclose(at.translation, place, atol=1e-15)
        np.testing.assert_allclose(np.abs(at.rotation[:, 2]), [0, 1, 0], atol=1e-15)
        low, high = (data.oMf[merged.frame_id(f"can.{end}")].translation for end in ("low", "high"))
        np.testing.assert_allclose([low, high], np.outer([-1, 1], [0, 0.15, 0]) + place, atol=1e-15)
        assert [shape.body for shape in merged.collision_shapes][-1] == "can"


@pytest.mark.parametrize(
    ("solid", "inertia"),
    [
        (box((0.2, 0.3, 0.6), 1.2), np.array([0.3**2 + 0.6**2, 0.2**2 + 0.6**2, 0.2**2 + 0.3**2]) * 1.2 / 12),
        (ball(0.1, 0.5), np.full(3, 0.4 * 0.5 * 0.1**2)),
        (cylinder(0.1, 0.4, "z", 0.6), 0.6 * np.array([0.1**2 / 4 + 0.4**2 / 12] * 2 + [0.1**2 / 2])),
        (cylinder(0.1, 0.4, "x", 0.6), 0.6 * np.array([0.1**2 / 2] + [0.1**2 / 4 + 0.4**2 / 12] * 2)),
    ],
    ids=["box", "ball", "cylinder along z", "cylinder along x"],
)
def test_simple_bodies_are_solid(solid: UniformSolid, inertia: np.ndarray) -> None:
    """The inertia is that of a solid about its middle."""
    model = simple_body("body", solid, "free_flyer").model
    np.testing.assert_allclose(model.inertias[1].inertia, np.diag(inertia), atol=1e-15)
    np.testing.assert_array_equal(model.inertias[1].lever, np.zeros(3))


def test_corners_have_the_names_of_their_sides() -> None:
    """Front is along x, left along y, top along z."""
    robot = simple_body("crate", box((0.2, 0.4, 0.6), 1.0), "fixed")
    places = {frame.name: frame.placement.translation.tolist() for frame in robot.model.frames}
    assert places["front_left_top"] == [0.1, 0.2, 0.3]
    assert places["rear_right_bottom"] == [-0.1, -0.2, -0.3]
    assert len(places) == 2 + 8


@pytest.mark.parametrize("name", ["elbow", "tip", "box"])
def test_a_name_that_the_robot_has_is_refused(arm: Robot, name: str) -> None:
    """A body may not be called like a joint or a frame of the robot."""
    with pytest.raises(RobotError, match=f"found a body named '{name}' beside a robot with the"):
        beside(arm, {name: simple_body(name, ball(0.1, 1.0), "free_flyer")}, {name: NOWHERE})


def test_joints_that_mimic_others_still_do(arm: Robot) -> None:
    """A body whose file lets a joint follow another one has the same inertia beside a robot as alone."""
    zoo = load_robot(Path(__file__).parent / "models" / "zoo.urdf")
    assert any(link.mimics for link in zoo.tree.links)
    merged = beside(arm, {"zoo": zoo}, {"zoo": NOWHERE})
    q = pin.randomConfiguration(zoo.model, -np.ones(zoo.model.nq), np.ones(zoo.model.nq))
    whole, _ = numbers(merged, np.concatenate([arm.neutral, q]), np.zeros(merged.model.nv))
    own, _ = numbers(zoo, q, np.zeros(zoo.model.nv))
    np.testing.assert_allclose(whole[arm.model.nv :, arm.model.nv :], own, atol=1e-14)
