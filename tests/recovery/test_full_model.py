"""Motions of reduced robots on all joints of their files: places, signs and efforts, against Pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import PointOnSurface, Scene
from fesd_robot.contact.ground import Plane
from fesd_robot.recovery.full_model import FullModel, FullMotion
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import Robot, load_robot
from fesd_robot.robot.load import with_frames
from fesd_robot.robot.sagittal import propose_sagittal

MODELS = Path(__file__).parents[1] / "robot" / "models"
SOLO = "example-robot-data:solo12"
HIPS = {f"{leg}_HAA": 0.0 for leg in ("FL", "FR", "HL", "HR")}
PAIRS = {"FR_HFE": "FL_HFE", "FR_KFE": "FL_KFE", "HR_HFE": "HL_HFE", "HR_KFE": "HL_KFE"}
BIPED = {"right_hip": "left_hip", "right_knee": "left_knee"}

CASES = {
    "solo12": (SOLO, "sagittal", HIPS, PAIRS, {"front": "FL_FOOT", "hind": "HR_FOOT"}),
    "solo12, a hip held aside": (SOLO, "free_flyer", {"FL_HAA": 0.3, "HR_KFE": -1.0}, {}, {"front": "FL_FOOT"}),
    "biped (MJCF)": (MODELS / "biped.xml", "sagittal", {}, BIPED, {"both": "left_foot"}),
    "walker (MJCF)": (MODELS / "walker.xml", "fixed", {"foot_joint": 0.3}, {}, {}),
    "kinova (unbounded)": ("example-robot-data:kinova", "fixed", {"j2s6s200_joint_1": 4.0}, {}, {}),
    "panda (mimic)": ("example-robot-data:panda", "fixed", {"panda_joint1": 0.3}, {}, {}),
}
"""Model, root, locked and coupled joints, and the frame of every contact."""

SLOPE = 0.2


class Case:
    """A reduced robot in random states, with random controls of all coordinates and random contact forces."""

    def __init__(self, name: str) -> None:
        source, root, locked, coupled, contacts = CASES[name]
        self.locked, self.coupled = locked, coupled
        self.robot: Robot = load_robot(source, root=root, locked=locked, coupled=coupled)
        self.full: Robot = load_robot(source, root=root)
        plane, random = Plane(slope=SLOPE), np.random.default_rng(3)
        scene = Scene({"ground": plane}, {name: PointOnSurface(frame, plane) for name, frame in contacts.items()})
        model = self.robot.model
        self.physics = NumericPhysics(self.robot, scene, dict.fromkeys(contacts, 0.5), lambda _: np.eye(model.nv))
        self.samples = [
            (
                pin.integrate(model, self.robot.neutral, random.uniform(-0.7, 0.7, model.nv)),
                *random.normal(size=(2, model.nv)),
                random.normal(size=(len(contacts), 2)),
            )
            for _ in range(4)
        ]
        self.model = FullModel(self.robot, self.full, locked, coupled, scene)
        self.motion: FullMotion = self.model.motion(self.physics, self.samples)


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param)


def test_all_frames_are_where_the_reduced_robot_has_them(case: Case) -> None:
    """With every joint at its value the frames of the full robot are those of the plan, and move as they do."""
    for q, v, *_ in case.samples:
        places = []
        for robot, at, moving in (
            (case.robot, q, v),
            (case.full, case.model.configuration(q), case.model.velocity(v)),
        ):
            model, data = robot.model, robot.model.createData()
            pin.forwardKinematics(model, data, at, moving)
            pin.updateFramePlacements(model, data)
            ids = [robot.frame_id(name) for name in case.robot.frame_names]
            places.append([data.oMf[k].homogeneous for k in ids])
            places.append([pin.getFrameVelocity(model, data, k, pin.WORLD).vector for k in ids])
        np.testing.assert_allclose(places[2], places[0], atol=1e-9)
        np.testing.assert_allclose(places[3], places[1], atol=1e-9)


def test_efforts_do_the_work_of_the_controls(case: Case) -> None:
    """Whatever the motion, the motors of the full robot have the power that the controls of the plan have."""
    root = case.robot.root_names
    free = [k for k, name in enumerate(case.robot.velocity_names) if name not in root]
    for k, (_, v, u, _) in enumerate(case.samples):
        power = case.motion.effort[k] @ case.motion.velocity[k]
        assert power == pytest.approx(v[free] @ u[free], rel=1e-9, abs=1e-9)


def test_joints_in_unison_share_their_dry_friction() -> None:
    """The friction of a pair is shared by its limits; motors keep the power of the controls, whatever it is."""
    case, random = Case("solo12"), np.random.default_rng(5)
    limits = {"FL_KFE": 0.2, "FR_KFE": 0.4}
    full = load_robot(SOLO, root="sagittal", dry_friction=limits)
    row = case.robot.velocity_names.index("FL_KFE")
    plane = Plane(slope=SLOPE)
    scene = Scene(
        {"ground": plane}, {"front": PointOnSurface("FL_FOOT", plane), "hind": PointOnSurface("HR_FOOT", plane)}
    )
    model = FullModel(case.robot, full, case.locked, case.coupled, scene)
    friction = np.zeros((len(case.samples), case.robot.model.nv))
    friction[:, row] = random.uniform(-0.6, 0.6, len(friction))
    motion = model.motion(case.physics, case.samples, friction)
    free = [k for k, name in enumerate(case.robot.velocity_names) if name not in case.robot.root_names]
    for k, (_, v, u, _) in enumerate(case.samples):
        assert motion.effort[k] @ motion.velocity[k] == pytest.approx(v[free] @ u[free], rel=1e-9, abs=1e-9)
    # Held at one acceleration, the motor of each knee makes up for its own part.
    still = [(q, np.zeros_like(v), u, f) for q, v, u, f in case.samples]
    pushed = [(q, v, u - friction[k], f) for k, (q, v, u, f) in enumerate(still)]
    rubbing, smooth = model.motion(case.physics, pushed, friction), model.motion(case.physics, still)
    knees = [motion.joints.index(name) for name in limits]
    change = (rubbing.effort - smooth.effort)[:, knees]
    np.testing.assert_allclose(change, -friction[:, [row]] * [1 / 3, 2 / 3], atol=1e-9)


def test_every_joint_is_listed_once(case: Case) -> None:
    """Locked joints stand at their value, followers beside their leaders, <mimic> joints at what the file says."""
    joints = case.motion.joints
    assert len(set(joints)) == len(joints)
    assert {*case.locked, *case.coupled} <= set(joints) and not {*case.full.root_names} & set(joints)
    for name, value in case.locked.items():
        column = joints.index(name)
        turns = np.round((case.motion.position[:, column] - value) / (2 * np.pi))
        np.testing.assert_allclose(case.motion.position[:, column], value + 2 * np.pi * turns, atol=1e-12)
        assert not case.motion.velocity[:, column].any()
    for link in case.full.tree.links:
        if link.mimics:
            (leader,) = (one.name for one in case.full.tree.links if one.v_indices == link.v_indices and one != link)
            own, led = joints.index(link.name), joints.index(leader)
            expected = link.multiplier * case.motion.position[:, led] + link.offset
            np.testing.assert_allclose(case.motion.position[:, own], expected)
            assert not case.motion.effort[:, own].any()


def test_feet_share_the_force_of_their_contact() -> None:
    """A contact of legs in unison stands for the feet of both, named as in the file; one of a single leg for itself."""
    assert Case("solo12").motion.feet == {"front": ["FL_FOOT", "FR_FOOT"], "hind": ["HR_FOOT", "HL_FOOT"]}
    assert Case("biped (MJCF)").motion.feet == {"both": ["left_foot", "right_foot"]}
    alone = Case("solo12, a hip held aside")
    assert alone.motion.feet == {"front": ["FL_FOOT"]}
    np.testing.assert_array_equal(alone.motion.foot_force, np.stack([force for *_, force in alone.samples]))


def test_places_on_legs_in_unison_share_a_force_too() -> None:
    """A contact at an offset pushes both legs by half, at the mirror image, as one with frames of the file does."""
    places = {"FL at 0.01 0.02 -0.16": ("FL_KFE", np.array([0.01, 0.02, -0.16]))}
    robot = with_frames(load_robot(SOLO, root="sagittal", locked=HIPS, coupled=PAIRS), places)
    full = with_frames(load_robot(SOLO, root="sagittal"), places)
    plane = Plane(slope=SLOPE)
    scene = Scene({"ground": plane}, {"shin": PointOnSurface(next(iter(places)), plane)})
    physics = NumericPhysics(robot, scene, {"shin": 0.5}, lambda _: np.zeros((robot.model.nv, 0)))
    model = FullModel(robot, full, HIPS, PAIRS, scene)
    q = pin.integrate(robot.model, robot.neutral, np.linspace(0.1, 0.4, robot.model.nv))
    motion = model.motion(physics, [(q, np.zeros(robot.model.nv), np.zeros(0), np.array([[30.0, 4.0]]))])
    assert motion.feet == {"shin": [next(iter(places)), f"{next(iter(places))} beside FR_KFE"]}
    assert motion.foot_force[0] == pytest.approx(np.full((2, 2), [15.0, 2.0]))
    efforts = dict(zip(motion.joints, motion.effort[0], strict=True))
    # The legs of the file are mirror images but for the centres of mass of their links.
    assert efforts["FL_HAA"] == pytest.approx(-efforts["FR_HAA"], rel=1e-3)


def test_feet_of_a_robot_whose_links_have_names_of_joints() -> None:
    """The legs of ANYmal C share the force of a contact, though several of its frames have one name."""
    source = "example-robot-data:anymal_c"
    locked, coupled = propose_sagittal(load_robot(source, root="sagittal").model)
    robot, full = (
        load_robot(source, root="sagittal", locked=locked, coupled=coupled),
        load_robot(source, root="sagittal"),
    )
    plane = Plane(slope=SLOPE)
    feet = {"front": PointOnSurface("LF_FOOT", plane), "hind": PointOnSurface("RH_FOOT", plane)}
    model = FullModel(robot, full, locked, coupled, Scene({"ground": plane}, feet))
    physics = NumericPhysics(
        robot, Scene({"ground": plane}, feet), dict.fromkeys(feet, 0.5), lambda _: np.zeros((7, 0))
    )
    sample = robot.neutral, np.zeros(7), np.zeros(0), np.array([[30.0, 4.0], [20.0, 2.0]])
    assert model.motion(physics, [sample]).feet == {"front": ["LF_FOOT", "RF_FOOT"], "hind": ["RH_FOOT", "LH_FOOT"]}


def test_the_base_is_a_pose(case: Case) -> None:
    """The base is where Pinocchio has the first link, as position and unit quaternion without jumps of sign."""
    if not case.full.root_names:
        return
    link = case.full.model.frames[case.full.model.getFrameId("root_joint")]
    for pose, (q, *_) in zip(case.motion.base, case.samples, strict=True):
        data = case.full.model.createData()
        pin.framesForwardKinematics(case.full.model, data, case.model.configuration(q))
        placement = data.oMi[link.parentJoint]
        assert pin.XYZQUATToSE3(pose).isApprox(placement, 1e-9)
    assert (np.sum(case.motion.base[1:, 3:] * case.motion.base[:-1, 3:], axis=1) >= 0).all()
