"""MuJoCo files: what is planned moves as MuJoCo moves it, and what would be left out is refused or said."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import casadi as ca
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import (
    Robot,
    damping_force,
    frame_placement,
    kinetic_energy,
    load_robot,
    potential_energy,
    rnea,
    spring_force,
)

MODELS = Path(__file__).parent / "models"
GYMNASIUM = Path(find_spec("gymnasium").submodule_search_locations[0]) / "envs" / "mujoco" / "assets"
FILES = [
    *(MODELS / f"{name}.xml" for name in ("walker", "crawler", "gripper")),
    *(GYMNASIUM / f"{name}.xml" for name in ("ant", "half_cheetah", "hopper", "humanoid", "pusher", "walker2d_v5")),
]
"""Own files, and robots as they are found: default classes, settotalmass, springs, gears, unnamed joints."""


@pytest.fixture(params=FILES, ids=lambda path: path.stem)
def mjcf(request) -> tuple[mujoco.MjModel, Robot]:
    """MuJoCo's model of a file, without contacts and limits, and the robot that is planned."""
    model = mujoco.MjModel.from_xml_path(str(request.param))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return model, load_robot(request.param)


def _states(model: mujoco.MjModel, seed: int, count: int = 3):
    """Random states and accelerations at which joints that follow others do so."""
    draw, data = np.random.default_rng(seed), mujoco.MjData(model)
    for _ in range(count):
        data.qpos, data.qvel, data.qacc = draw.normal(size=model.nq), *draw.normal(size=(2, model.nv))
        mujoco.mj_normalizeQuat(model, data.qpos)
        for index in np.flatnonzero(model.eq_active0):
            follower, leader = model.eq_obj1id[index], model.eq_obj2id[index]
            ratio = model.eq_data[index][1]
            data.qpos[model.jnt_qposadr[follower]] = _follower_position(model, index, data.qpos)
            for rates in (data.qvel, data.qacc):
                rates[model.jnt_dofadr[follower]] = ratio * rates[model.jnt_dofadr[leader]]
        mujoco.mj_inverse(model, data)
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        yield data


def _follower_position(model: mujoco.MjModel, index: int, qpos: np.ndarray) -> float:
    follower, leader = (model.jnt_qposadr[joint[index]] for joint in (model.eq_obj1id, model.eq_obj2id))
    constant, ratio = model.eq_data[index][:2]
    return model.qpos0[follower] + constant + ratio * (qpos[leader] - model.qpos0[leader])


def _names(model: mujoco.MjModel) -> list[str]:
    return [model.joint(joint).name or f"joint{joint}" for joint in range(model.njnt)]


def _configuration(model: mujoco.MjModel, robot: Robot, qpos: np.ndarray) -> np.ndarray:
    """MuJoCo's positions by the robot's names."""
    values = {}
    for name, at, kind in zip(_names(model), model.jnt_qposadr, model.jnt_type, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            values |= {f"{name}.{part}": qpos[at + k] for k, part in enumerate(["x", "y", "z", "qw", "qx", "qy", "qz"])}
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            values |= {f"{name}.{part}": qpos[at + k] for k, part in enumerate(["qw", "qx", "qy", "qz"])}
        else:
            values[name] = qpos[at]
    return np.array([values[name] for name in robot.configuration_names])


def _rates(model: mujoco.MjModel, robot: Robot, qpos: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """MuJoCo's velocities or forces by the robot's names; a free joint's linear ones in the axes of the body."""
    values = {}
    for name, at, start, kind in zip(_names(model), model.jnt_dofadr, model.jnt_qposadr, model.jnt_type, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            linear = _turn(qpos[start + 3 :]).T @ rates[at : at + 3]
            values |= {f"{name}.v{part}": linear[k] for k, part in enumerate("xyz")}
            values |= {f"{name}.w{part}": rates[at + 3 + k] for k, part in enumerate("xyz")}
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            values |= {f"{name}.w{part}": rates[at + k] for k, part in enumerate("xyz")}
        else:
            values[name] = rates[at]
    return np.array([values[name] for name in robot.velocity_names])


def _accelerations(model: mujoco.MjModel, robot: Robot, data: mujoco.MjData) -> np.ndarray:
    """The same for accelerations: axes of the body turn, those of the world do not."""
    result = _rates(model, robot, data.qpos, data.qacc)
    for name, at, start, kind in zip(_names(model), model.jnt_dofadr, model.jnt_qposadr, model.jnt_type, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            linear = robot.velocity_names.index(f"{name}.vx")
            turning, moving = data.qvel[at + 3 : at + 6], data.qvel[at : at + 3]
            result[linear : linear + 3] -= np.cross(turning, _turn(data.qpos[start + 3 :]).T @ moving)
    return result


def _turn(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion[:4]
    return pin.Quaternion(w, x, y, z).matrix()


def test_inverse_dynamics_are_those_of_mujoco(mjcf):
    """In flight the forces for random accelerations, springs and damping included, are MuJoCo's to 1e-12."""
    model, robot = mjcf
    q, v, a = (ca.SX.sym(name, size) for name, size in zip("qva", (robot.model.nq, *[robot.model.nv] * 2), strict=True))
    force = ca.Function("force", [q, v, a], [rnea(robot, q, v, a) + damping_force(robot, v) + spring_force(robot, q)])
    for data in _states(model, seed=1):
        arguments = _configuration(model, robot, data.qpos), _rates(model, robot, data.qpos, data.qvel)
        own = force(*arguments, _accelerations(model, robot, data)).full().ravel()
        expected = _rates(model, robot, data.qpos, _onto_leaders(model, data.qfrc_inverse))
        assert np.abs(own - expected).max() <= 1e-12 * (1 + np.abs(expected).max())


def _onto_leaders(model: mujoco.MjModel, force: np.ndarray) -> np.ndarray:
    """Forces of joints that follow others, moved onto these."""
    result = np.array(force)
    for index in np.flatnonzero(model.eq_active0):
        follower, leader = (model.jnt_dofadr[joint[index]] for joint in (model.eq_obj1id, model.eq_obj2id))
        result[leader] += model.eq_data[index][1] * force[follower]
    return result


def test_energies_and_mass_are_those_of_mujoco(mjcf):
    """Kinetic and potential energy, springs included, are MuJoCo's; so is the mass, which settotalmass may scale."""
    model, robot = mjcf
    q, v = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv)
    energies = ca.Function("energies", [q, v], [potential_energy(robot, q), kinetic_energy(robot, q, v)])
    for data in _states(model, seed=2):
        own = energies(_configuration(model, robot, data.qpos), _rates(model, robot, data.qpos, data.qvel))
        assert np.array([float(one) for one in own]) == pytest.approx(data.energy, rel=1e-12, abs=1e-12)
    moving = model.body_weldid != 0
    assert pin.computeTotalMass(robot.model) == pytest.approx(model.body_mass[moving].sum(), rel=1e-14)


def test_bodies_and_sites_are_where_mujoco_has_them(mjcf):
    """Every frame that a task can name is at MuJoCo's place."""
    model, robot = mjcf
    data = next(_states(model, seed=3, count=1))
    q = ca.SX(ca.DM(_configuration(model, robot, data.qpos)))
    places = {model.body(k).name: data.xpos[k] for k in range(1, model.nbody) if model.body(k).name}
    places |= {model.site(k).name: data.site_xpos[k] for k in range(model.nsite)}
    for name, place in places.items():
        assert ca.evalf(frame_placement(robot, q, name)[1]).full().ravel() == pytest.approx(place, abs=1e-12)


def test_motors_push_as_in_mujoco(mjcf):
    """The bounds of every joint's force are MuJoCo's at the ends of the motors' ranges, gears included."""
    model, robot = mjcf
    data = mujoco.MjData(model)
    motors = np.flatnonzero(
        (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT))
        & (model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_NONE))
    )
    for limits, end in ((robot.lower_effort, 0), (robot.upper_effort, 1)):
        data.ctrl[motors] = model.actuator_ctrlrange[motors, end]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdActuation(model, data)
        joints = model.actuator_trnid[motors, 0]
        driven = {_names(model)[joint]: data.qfrc_actuator[model.jnt_dofadr[joint]] for joint in joints}
        own = dict(zip(robot.velocity_names, limits, strict=True))
        assert {name: own[name] for name in driven} == pytest.approx(driven)


def test_servos_and_tendons_are_motors_with_limits():
    """A servo gives any force in its range, a motor on a fixed tendon pushes its joints by their coefficients."""
    robot = load_robot(MODELS / "gripper.xml")
    efforts = zip(robot.velocity_names, robot.lower_effort, robot.upper_effort, strict=True)
    assert {name: (low, high) for name, low, high in efforts} == {"lift": (-20, 60), "turn": (0, 0), "left": (-8, 8)}
    pull = robot.drives["pull"]
    assert (dict(pull.force), pull.lower, pull.upper) == ({"lift": 0.5, "turn": -2.0}, -4, 4)
    assert any("servos (servo)" in note for note in robot.notes)


def test_keyframes_are_postures():
    """Keyframes and the positions of the file itself are postures of the joints that have coordinates."""
    robot = load_robot(MODELS / "gripper.xml")
    assert robot.postures["open"] == {"lift": 0.3, "turn": 0.5, "left": 0.08}
    assert robot.postures["qpos0"] == pytest.approx({"lift": 0.2, "turn": np.pi / 6, "left": 0.0})


def test_springs_of_coupled_joints_add_up(tmp_path):
    """Two springs on joints in unison are one: the force is theirs together, whichever way their axes point."""
    thigh = '<body name="{0}" pos="0 {1} 0"><joint name="{0}" axis="0 {2} 0" stiffness="{3}" springref="{4}"/>' + MASS
    thighs = thigh.format("left", 0.1, 1, 2, 0.3), thigh.format("right", -0.1, -1, 3, 0.5)
    file = tmp_path / "robot.xml"
    content = f'<body name="base">{MASS}{thighs[0]}</body>{thighs[1]}</body></body>'
    file.write_text(f'<mujoco><compiler angle="radian"/><worldbody>{content}</worldbody></mujoco>')
    robot = load_robot(file, root="sagittal", coupled={"right": "left"})
    index = robot.configuration_names.index("left")
    for angle in (-1.0, 0.2):
        q = robot.neutral.copy()
        q[index] = angle
        force = ca.evalf(spring_force(robot, ca.SX(ca.DM(q)))).full().ravel()[index]
        assert force == pytest.approx(2 * (angle - 0.3) + 3 * (angle + 0.5))


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
    """Free and ball joints are unlimited, and ranges are read."""
    robot = load_robot(MODELS / "crawler.xml")
    lower = dict(zip(robot.configuration_names, robot.lower_position, strict=True))
    upper = dict(zip(robot.configuration_names, robot.upper_position, strict=True))
    assert (lower["elbow"], upper["elbow"], lower["rail"], upper["rail"]) == (-1.0, 1.0, -0.5, 0.2)
    for name in ("floating.x", "floating.qw", "wrist.qx", "shoulder"):
        assert (lower[name], upper[name]) == (-np.inf, np.inf)


def test_what_is_left_out_is_noted():
    """Shapes of the world and servos are in the notes; dry friction is not, as it enters the motion."""
    robot = load_robot(MODELS / "gripper.xml")
    notes = " ".join(robot.notes)
    for words in ("world's shapes (floor)", "servos (servo)", "follows 'left' exactly"):
        assert words in notes
    assert "friction" not in notes and robot.dry_friction == {"turn": 0.4}


MASS = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
HINGE = '<joint name="j" axis="0 1 0"/>'


def _body(inside: str = "", name: str = "b", attributes: str = "") -> str:
    return f'<body name="{name}" {attributes}>{MASS}{inside}</body>'


ARM = f"<worldbody>{_body(HINGE)}</worldbody>"
OTHER = _body(HINGE.replace('"j"', '"k"'), "c")
TWO = f"<worldbody>{_body(HINGE)}{OTHER}</worldbody>"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<include file="x.xml"/>', "x.xml"),
        (
            '<worldbody><body name="b"><joint type="screw"/></body></worldbody>',
            "cannot be read: element 'joint' in line 1: invalid keyword: 'screw'",
        ),
        (f'<option density="1.2"/>{ARM}', r"found density of a fluid \(1.2 kg/m3\), which is not supported"),
        (ARM.replace('name="b"', 'name="b" gravcomp="1"'), r"found gravity compensation \(1 of body 'b'\)"),
        (f'{TWO}<equality><joint joint1="j"/></equality>', "holds joint 'j', expected it in the task's 'locked'"),
        (
            f'{TWO}<equality><joint joint1="j" joint2="k" polycoef="0 1 2 0 0"/></equality>',
            "found polycoef 0 1 2 0 0 between joints 'j' and 'k', expected a line",
        ),
        (
            f'{TWO}<equality><weld name="w" body1="b" body2="c"/></equality>',
            "found <weld> 'w' in <equality>, which closes a loop",
        ),
        (
            f'{ARM}<tendon><fixed name="t" stiffness="3"><joint joint="j" coef="1"/></fixed></tendon>',
            "found tendon 't' with stiffness, which is not supported",
        ),
        (
            ARM.replace(HINGE, '<joint name="ball" type="ball" stiffness="2"/>'),
            r"the spring of a free or ball joint \(2 of joint 'ball'\)",
        ),
    ],
)
def test_physics_that_would_be_left_out_are_refused(tmp_path, content, message):
    """What changes the motion and is not supported is a RobotError that names it with its size."""
    file = tmp_path / "robot.xml"
    file.write_text(f'<mujoco model="m">{content}</mujoco>')
    with pytest.raises(RobotError, match=message):
        load_robot(file)


def test_a_root_of_the_task_replaces_a_free_joint():
    """A robot that floats in its file moves in the plane where the task says so, and keeps its keyframes' poses."""
    robot = load_robot(MODELS / "crawler.xml", root="sagittal", locked={"shoulder": 0.1, "rail": 0.0})
    assert robot.velocity_names[:3] == ["root_x", "root_z", "root_pitch"]
    pose = robot.postures["qpos0"]
    assert (pose["root_x"], pose["root_z"]) == (0.2, 1.0)
    assert "floating.x" not in robot.configuration_names and "shoulder" not in pose


def test_a_root_of_the_task_needs_one_robot(tmp_path):
    """Two bodies that move on the world leave open which of them is the robot's first."""
    file = tmp_path / "robot.xml"
    file.write_text(f"<mujoco>{TWO}</mujoco>")
    assert load_robot(file).joint_names == ["j", "k"]
    with pytest.raises(RobotError, match=r"found 2 bodies on the world that move \('b', 'c'\)"):
        load_robot(file, root="sagittal")


LIFTED = _body(_body(HINGE), "base", 'pos="0 0 1"')


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
    visual = load_robot(MODELS / "walker.xml").visual_model
    assert [one.name.partition(" ")[0] for one in visual.geometryObjects] == ["torso", "thigh", "foot"]
    assert all(type(one.geometry).__name__ == "Capsule" for one in visual.geometryObjects)
