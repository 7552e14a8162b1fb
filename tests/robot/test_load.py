"""Finding and reading robot files; every mistake is a RobotError that says what to change."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import example_robots, library, load_robot, mass_matrix, rnea
from fesd_robot.robot.load import robot_from_model
from fesd_robot.robot.model_file import ModelFile

MODELS = Path(__file__).parent / "models"
HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"

LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
LINK = f'<link name="{{}}"><inertial><mass value="1"/>{INERTIA}</inertial></link>'
AXIS = '<axis xyz="0 0 1"/>'


def _urdf(tmp_path: Path, *joints: str) -> Path:
    links = "".join(LINK.format(name) for name in "abcd"[: len(joints) + 1])
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="r">{links}{"".join(joints)}</robot>')
    return file


def _joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT, axis: str = AXIS) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{axis}{inside}</joint>'


def test_importing_the_package_stays_cheap():
    """Neither fesd_robot nor fesd_robot.robot imports Pinocchio or CasADi before something is used."""
    code = "import sys, fesd_robot, fesd_robot.robot; sys.exit(bool({'pinocchio', 'casadi'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_relative_paths_start_at_the_search_path():
    """A relative path is looked up below search_path."""
    robot = load_robot("hopper/hopper.urdf", search_path=HOPPER.parents[1])
    assert robot.source == HOPPER
    assert robot.name == "hopper"


def test_a_missing_file_is_named():
    """The message names the path that was looked for."""
    with pytest.raises(RobotError, match=r"There is no robot file .*/nowhere/hopper\.urdf"):
        load_robot("nowhere/hopper.urdf")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("garbage", "is not an XML file"),
        ("<world/>", "neither URDF nor MJCF nor SDF: its first element is <world>"),
        (
            '<robot name="r"><link name="a"/><link name="b"/></robot>',
            "2 links that are the child of no joint .*'a', 'b'",
        ),
        ('<robot name="r"><link name="a"/></robot>', "no moving joint; if it floats, set root to 'free_flyer'"),
    ],
)
def test_an_unreadable_file_says_why(tmp_path, text, message):
    """The message says what is missing."""
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    with pytest.raises(RobotError, match=message):
        load_robot(file)


def test_a_joint_without_limits_says_so(tmp_path):
    """A joint that needs limits is named."""
    with pytest.raises(RobotError, match="joint 'j': found no <limit>, expected one for a revolute joint"):
        load_robot(_urdf(tmp_path, _joint("j", "a", "b", inside="")))


@pytest.mark.skipif(pin.WITH_SDFORMAT, reason="this Pinocchio reads SDF")
def test_sdf_needs_a_pinocchio_that_reads_it():
    """Without SDF support the message says so."""
    with pytest.raises(RobotError, match="reads no SDF files; convert it to URDF or MJCF"):
        load_robot("example-robot-data:cassie")


def test_closed_loops_of_an_sdf_file_are_refused(monkeypatch, tmp_path, hopper):
    """Where Pinocchio reads SDF, a tree is taken and a loop is not."""
    loops: list[str] = []
    monkeypatch.setattr(pin, "WITH_SDFORMAT", True)
    monkeypatch.setattr(pin, "buildModelsFromSdf", lambda *_, **__: (pin.Model(hopper.model), loops))
    file = tmp_path / "robot.sdf"
    file.write_text('<sdf version="1.6"/>')
    assert load_robot(file).format == "sdf"
    loops.append("loop")
    with pytest.raises(RobotError, match="closed loops are not supported"):
        load_robot(file)


def test_an_unknown_root_is_refused():
    """The message names the nearest root."""
    with pytest.raises(RobotError, match=r"no root joint 'freeflyer' \(did you mean 'free_flyer'\?\)"):
        load_robot(HOPPER, root="freeflyer")


def test_a_second_free_root_is_refused(tmp_path):
    """A file that floats already takes no other root."""
    file = _urdf(tmp_path, _joint("float", "a", "b", "floating", ""))
    file.write_text(file.read_text().replace(LINK.format("a"), '<link name="a"/>'))
    assert load_robot(file).velocity_names[0] == "float.vx"
    with pytest.raises(RobotError, match="its own free root joint 'float'"):
        load_robot(file, root="free_flyer")


def test_a_tilted_planar_joint_is_refused(tmp_path):
    """Pinocchio ignores the axis of a planar joint, so it must be z."""
    file = _urdf(tmp_path, _joint("p", "a", "b", "planar", "", '<axis xyz="0 1 0"/>'))
    with pytest.raises(RobotError, match="planar joint 'p' must move in the x-y plane"):
        load_robot(file)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (
            [_joint("j", "a", "b"), _joint("k", "a", "c", inside=LIMIT + '<mimic joint="q"/>')],
            "joint 'k' mimics 'q', which is no moving joint",
        ),
        (
            [_joint("j", "a", "b", inside=LIMIT + '<mimic joint="k"/>'), _joint("k", "a", "c")],
            "joint 'j' mimics 'k', but Pinocchio, which sorts the joints on a link by name, reads 'j' first",
        ),
        (
            [
                _joint("i", "a", "b"),
                _joint("j", "a", "c", inside=LIMIT + '<mimic joint="i"/>'),
                _joint("k", "a", "d", inside=LIMIT + '<mimic joint="j"/>'),
            ],
            "joint 'k' mimics 'j', which mimics 'i'; name that one",
        ),
        (
            [_joint("j", "a", "b", "continuous"), _joint("k", "a", "c", inside=LIMIT + '<mimic joint="j"/>')],
            "joint 'k' mimics 'j' and one of them is continuous",
        ),
        (
            [_joint("j", "a", "b"), _joint("k", "a", "c", inside=LIMIT + '<mimic joint="j" multiplier="0"/>')],
            "Joint 'k' mimics another one with multiplier 0",
        ),
    ],
)
def test_mimic_joints_that_cannot_be_built_are_named(tmp_path, joints, message):
    """Follower and leader are in the message."""
    with pytest.raises(RobotError, match=message):
        load_robot(_urdf(tmp_path, *joints))


def test_a_mimic_joint_has_no_coordinate(tmp_path):
    """A follower shares the entry of its leader."""
    file = _urdf(tmp_path, _joint("j", "a", "b"), _joint("k", "a", "c", inside=LIMIT + '<mimic joint="j"/>'))
    assert load_robot(file).configuration_names == ["j"]


def test_unsupported_joints_are_named():
    """A joint type without counterpart is refused by name."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelHX(0.1), pin.SE3.Identity(), "screw")
    with pytest.raises(RobotError, match="Joint 'screw' is of type HX, which is not supported"):
        _from_model(model)


def test_negative_masses_are_refused():
    """A body with negative mass is refused, naming its joint."""
    model = pin.Model()
    index = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "j")
    model.appendBodyToJoint(index, pin.Inertia(-1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    with pytest.raises(RobotError, match="the body of joint 'j' has a negative or infinite mass"):
        _from_model(model)


def test_translation_joints():
    """A joint with three translations has coordinates x, y, z and the dynamics of Pinocchio."""
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "turn")
    index = model.addJoint(first, pin.JointModelTranslation(), pin.SE3.Random(), "move")
    for joint in (first, index):
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    robot = _from_model(model)
    assert robot.configuration_names == ["turn", "move.x", "move.y", "move.z"]
    assert robot.velocity_names == ["turn", "move.vx", "move.vy", "move.vz"]
    q, v, a = np.random.default_rng(0).normal(size=(3, 4))
    expected = pin.rnea(model, model.createData(), q, v, a)
    assert ca.evalf(rnea(robot, ca.SX(q), ca.SX(v), ca.SX(a))).full().ravel() == pytest.approx(expected, rel=1e-12)


def _from_model(model: pin.Model):
    return robot_from_model(ModelFile(model, "urdf"), source=HOPPER, package_directories=())


def test_armature_is_set_by_joint_and_by_coordinate():
    """A joint's armature goes to all its coordinates, a coordinate's to itself alone."""
    robot = load_robot(
        "example-robot-data:solo12", root="free_flyer", armature={"root_joint": 0.2, "root_joint.wz": 0.5}
    )
    assert robot.model.armature[:7].tolist() == [0.2, 0.2, 0.2, 0.2, 0.2, 0.5, 0.0]


def test_armature_of_an_unknown_joint_is_refused():
    """The message names the nearest joint."""
    with pytest.raises(RobotError, match=r"no joint 'legs' to set the armature of \(did you mean 'leg'\?\)"):
        load_robot(HOPPER, armature={"legs": 0.1})


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_armature_must_be_finite_and_not_negative(value):
    """The message names joint and value."""
    with pytest.raises(RobotError, match=f"armature of joint 'leg' must be finite and not negative, but is {value}"):
        load_robot(HOPPER, armature={"leg": value})


def test_massless_links_are_allowed():
    """Without armature the hopper's mass matrix is singular, which is no error of the model."""
    mass = mass_matrix(load_robot(HOPPER), ca.SX.sym("q", 4))
    assert ca.evalf(mass).full().diagonal().tolist() == [1.1, 1.1, 0.275, 0.0]


def test_example_names_resolve_like_their_own_loaders():
    """The names of example-robot-data's loaders point at the files they load."""
    robots = example_robots()
    for name, file in {
        "solo12": "solo12.urdf",
        "solo8": "solo.urdf",
        "talos": "talos_reduced.urdf",
        "ur5": "ur5_robot.urdf",
        "anymal": "anymal.urdf",
        "hyq": "hyq_no_sensors.urdf",
    }.items():
        assert robots[name].name == file
    assert all(path.is_file() for path in robots.values())
    assert load_robot("example-robot-data:ur_description/urdf/ur5_robot.urdf").name == "ur5"


def test_most_example_robots_load():
    """All URDF files of example-robot-data load except those whose mimic joints Pinocchio cannot build."""
    failed = {}
    for name, path in example_robots().items():
        if path.suffix == ".urdf":
            try:
                load_robot(path, root="free_flyer")
            except RobotError as error:
                failed[name] = str(error)
    assert all("mimics" in message for message in failed.values())
    assert len(failed) < 8


def test_an_unknown_example_is_refused():
    """The message names the nearest robot."""
    with pytest.raises(RobotError, match=r"no robot 'solo_12' in example-robot-data \(did you mean 'solo12'\?\)"):
        load_robot("example-robot-data:solo_12")


def test_an_ambiguous_example_lists_the_choices(monkeypatch):
    """Two files of the same name need their folder."""
    monkeypatch.setattr(library, "_FILES", {})
    with pytest.raises(RobotError, match=r"ambiguous; write one of anymal_b_simple.*, anymal_c_simple.*anymal\.urdf"):
        load_robot("example-robot-data:anymal")


def test_missing_example_data_says_what_to_install(monkeypatch, tmp_path):
    """Without the data the message names the extra."""
    monkeypatch.setattr(library.sys, "prefix", str(tmp_path))
    monkeypatch.setattr(library.metadata, "distribution", _not_found)
    with pytest.raises(RobotError, match=r"pip install 'fesd-robot\[robots\]'"):
        load_robot("example-robot-data:solo12")


def _not_found(name: str):
    raise library.metadata.PackageNotFoundError(name)


def _transmission(name: str, *joints: str) -> str:
    inside = "".join(f'<joint name="{joint}"/>' for joint in joints)
    return f'<transmission name="{name}"><type>t</type>{inside}<actuator name="m"/></transmission>'


def _with(file: Path, *elements: str) -> Path:
    file.write_text(file.read_text().replace("</robot>", f"{''.join(elements)}</robot>"))
    return file


def test_transmissions_and_effort_limits_are_compared(tmp_path):
    """An effort limit drives a joint, with or without a transmission; where the two differ the notes name the joint."""
    free = '<limit lower="-1" upper="1" velocity="1" effort="0"/>'
    joints = _joint("one", "a", "b"), _joint("two", "b", "c", inside=free), _joint("three", "c", "d")
    file = _with(_urdf(tmp_path, *joints), _transmission("first", "one"), _transmission("second", "two"))
    robot = load_robot(file)
    assert robot.driven.tolist() == [True, False, True]
    without, weak = robot.notes
    assert without.startswith("Joints without <transmission>, unlike others of the file,") and ": three; " in without
    assert weak.startswith("Joints with <transmission> have no effort limit and are not driven: two; ")


def test_transmissions_that_couple_motors_are_named(tmp_path):
    """A differential of two joints is in the notes with both; a reduction is not, limits are those of the joints."""
    joints = _joint("one", "a", "b"), _joint("two", "b", "c")
    (sentence,) = load_robot(_with(_urdf(tmp_path, *joints), _transmission("wrist", "one", "two"))).notes
    assert sentence.startswith("Transmissions of several joints couple their motors: wrist (one, two); ")
    geared = _transmission("gear", "one", "two").replace("<act", "<mechanicalReduction>50</mechanicalReduction><act")
    assert load_robot(_with(_urdf(tmp_path, *joints), geared)).upper_effort.tolist() == [1, 1]


@pytest.mark.parametrize("transmissions", [(), ("elsewhere",)])
def test_a_file_without_transmissions_of_its_joints_has_nothing_to_say(tmp_path, transmissions):
    """Without transmissions, or with those of joints that are not there, effort limits alone count."""
    file = _with(_urdf(tmp_path, _joint("one", "a", "b")), *(_transmission("t", name) for name in transmissions))
    assert load_robot(file).notes == ()


def test_a_mimic_joint_needs_no_transmission(tmp_path):
    """A joint that follows another has no motor, so that its missing transmission is not worth a word."""
    follower = _joint("two", "b", "c", inside=LIMIT + '<mimic joint="one" multiplier="2"/>')
    file = _with(_urdf(tmp_path, _joint("one", "a", "b"), follower), _transmission("t", "one"))
    assert load_robot(file).notes == ()


@pytest.mark.parametrize(
    ("path", "joint"),
    [
        ("anymal_b_simple_description/robots/anymal-kinova.urdf", "LF_HAA"),
        ("baxter_description/urdf/baxter.urdf", "right_s0"),
    ],
)
def test_motors_of_robots_that_were_put_together(path, joint):
    """Legs of ANYmal and arms of Baxter have motors and no transmission, unlike arm and grippers in their files."""
    robot = load_robot(library.examples_folder() / path)
    assert robot.driven[robot.velocity_names.index(joint)]
    assert any("without <transmission>" in sentence and joint in sentence for sentence in robot.notes)


def test_a_size_that_a_shape_does_not_have_is_left_alone(tmp_path: Path) -> None:
    """An attribute of another shape is no number of the model, whatever it says."""
    file = tmp_path / "hopper.urdf"
    text = (Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf").read_text(encoding="utf-8")
    file.write_text(text.replace('<sphere radius="0.1"/>', '<sphere radius="0.1" size="0,6"/>'), encoding="utf-8")
    assert load_robot(file).joint_names
