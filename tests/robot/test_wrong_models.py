"""Model files that are wrong: every one is refused in one sentence with its place, or loaded with a warning."""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path

import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import library, load_robot
from fesd_robot.robot.urdf_elements import check_elements
from fesd_robot.robot.urdf_model import check_model
from fesd_robot.robot.urdf_tree import read_tree
from fesd_robot.robot.xml_file import read_xml, xml_text

LEG = """<robot name="leg">
  <link name="trunk"><inertial><mass value="4"/>
    <inertia ixx="0.04" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.04"/></inertial></link>
  <link name="shank"><inertial><origin xyz="0 0 -0.15" rpy="0 0.1 0"/><mass value="0.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.001"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.3"/></geometry></visual>
    <collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <link name="foot"/>
  <joint name="knee" type="revolute"><parent link="trunk"/><child link="shank"/><origin xyz="0 0 -0.3"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="20" effort="40"/></joint>
  <joint name="ankle" type="fixed"><parent link="shank"/><child link="foot"/><origin xyz="0 0 -0.3"/></joint>
</robot>
"""

MORE_LINKS = '<link name="rod"/><link name="tip"/></robot>'
BAR = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'


def _urdf(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = LEG
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / "leg.urdf"
    file.write_text(text, encoding="utf-8")
    return file


# (name, changes, beginning of the sentence behind the file, what else is in it)
WRONG_URDF: list[tuple[str, list[tuple[str, str]], str, str]] = [
    ("decimal comma", [('"0.5"', '"0,5"')],
     "link 'shank', <inertial><mass> value", "found '0,5', expected a number, wr"),
    ("unit", [('"0.5"', '"0.5 kg"')],
     "link 'shank', <inertial><mass> value", "'0.5 kg', expected a number without unit"),
    ("word", [('"0.5"', '"abc"')], "link 'shank', <inertial><mass> value", "found 'abc', expected a number"),
    ("no mass", [('<mass value="0.5"/>', "")], "link 'shank', <inertial>", "found no <mass>, expected one"),
    ("no moment", [('izz="0.001"', "")], "link 'shank', <inertial><inertia>", "found no izz, expected a number"),
    ("two masses", [('<mass value="0.5"/>', '<mass value="0.5"/>' * 2)], "link 'shank', <inertial>", "2 times <mass>"),
    ("NaN", [('"4"', '"nan"')], "link 'trunk', <inertial><mass> value", "found 'nan', expected a finite number"),
    ("overflow", [('"4"', '"1e400"')], "link 'trunk', <inertial><mass> value", "'1e400', expected a finite number"),
    ("beyond all", [('"4"', '"1e12"')], "link 'trunk', <inertial><mass> value", "expected a number up to 1e+09"),
    ("negative mass", [('"0.5"', '"-0.5"')],
     "link 'shank', <inertial><mass> value", "found -0.5, expected a number of"),
    ("negative moment", [('ixx="0.01"', 'ixx="-1"')], "link 'shank', <inertial><inertia> ixx", "no body has this in"),
    ("large moment", [('ixx="0.01"', 'ixx="100"')], "the inertia of 'shank'", "larger than the sum of the others"),
    ("large product", [('ixy="0" ixz="0" iyy="0.01"', 'ixy="50" ixz="0" iyy="0.01"')],
     "the inertia of 'shank'", "below 0"),
    ("two numbers", [('xyz="0 0 -0.15"', 'xyz="0 0"')], "link 'shank', <inertial><origin> xyz", "expected 3 numbers"),
    ("commas", [('xyz="0 0 -0.3"', 'xyz="0, 0, -0.3"')], "joint 'knee', <origin> xyz", "'0, 0, -0.3', expected 3 num"),
    ("no axis", [('xyz="0 1 0"', 'xyz="0 0 0"')], "joint 'knee', <axis> xyz", "found '0 0 0', expected a direction"),
    ("axis of NaN", [('xyz="0 1 0"', 'xyz="0 nan 0"')], "joint 'knee', <axis> xyz", "expected 3 finite numbers"),
    ("limit", [('lower="-2"', 'lower="-2rad"')],
     "joint 'knee', <limit> lower", "found '-2rad', expected a number without"),
    ("misspelled", [('lower="-2"', 'lowwer="-2"')], "joint 'knee', <limit>: lowwer", "(did you mean 'lower'?)"),
    ("capital", [("<inertial>", "<Inertial>"), ("</inertial>", "</Inertial>")],
     "link 'trunk': <Inertial>", "'<inertial>'"),
    ("no limit", [('<limit lower="-2" upper="2" velocity="20" effort="40"/>', "")], "joint 'knee'", "found no <limit>"),
    ("joint type", [('type="revolute"', 'type="hinge"')],
     "joint 'knee'", "found type 'hinge', expected one of revolute"),
    ("no parent", [('<parent link="trunk"/>', "")], "joint 'knee'", "found no <parent>, expected one"),
    ("unknown link", [('parent link="trunk"', 'parent link="trunc"')], "joint 'knee', <parent> link", "mean 'trunk'?"),
    ("own parent", [('parent link="trunk"', 'parent link="shank"')], "joint 'knee'", "'shank' as parent and child"),
    ("two parents", [("</robot>", BAR.format("rod", "trunk", "foot") + "</robot>")],
     "link 'foot' is the child of joints", "'ankle' and 'rod', which closes a loop"),
    ("ring", [("</robot>", BAR.format("r1", "rod", "tip") + BAR.format("r2", "tip", "rod") + MORE_LINKS)],
     "joints 'r2', 'r1' close a loop", "expected a tree"),
    ("two roots", [("</robot>", MORE_LINKS)], "found 3 links that are the child of no joint", "'trunk', 'rod', 'tip'"),
    ("two links", [('<link name="foot"/>', '<link name="foot"/>' * 2)], "found 2 links called 'foot'", "expected one"),
    ("two joints", [('name="ankle"', 'name="knee"')], "found 2 joints called 'knee'", "expected one"),
    ("no name", [('link name="foot"', "link")], "<link> number 3", "found no name"),
    ("size", [('size="0.1 0.1 0.3"', 'size="0.1 -0.1 0.3"')],
     "link 'shank', <visual><geometry><box> size", "at least 0"),
    ("shape", [('<sphere radius="0.02"/>', '<ball radius="0.02"/>')], "link 'shank', <collision><geometry>", "<ball>"),
    ("scale", [('<sphere radius="0.02"/>', '<mesh filename="a.stl" scale="1 0 1"/>')],
     "link 'shank', <collision><geometry><mesh> scale", "other than 0"),
    ("version", [('name="leg"', 'name="leg" version="3"')],
     "<robot> version", "found '3', expected one of 1.0, 1.1, 1.2"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "place", "sentence"), [case[1:] for case in WRONG_URDF], ids=[c[0] for c in WRONG_URDF]
)
def test_a_wrong_urdf_file_is_refused_with_its_place(tmp_path, capfd, changes, place, sentence):
    """File, link or joint, element and attribute, what was found and what was expected are in one sentence."""
    file = _urdf(tmp_path, *changes)
    for root in ("fixed", "free_flyer"):
        with pytest.raises(RobotError) as error:
            load_robot(file, root=root)
        assert str(error.value).startswith(f"{file}: {place}")
        assert sentence in str(error.value)
        assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


BODY = '<body name="b"><joint name="j"/><geom size="0.1"/>{}</body>'
MESH = '<asset><mesh name="m" file="{}"/></asset>'

# (name, what is before <worldbody>, what is inside of it, words of the sentence)
WRONG_MJCF = [
    ("empty", "", "", "found no body, expected one that moves"),
    ("no body", "", '<geom size="1"/>', "found no body, expected one that moves"),
    ("no joint", "", '<body><geom size="1"/></body>', "no moving joint; if it floats, set root to 'free_flyer'"),
    ("no include", '<include file="no.xml"/>', BODY, "element 'include' in line 1: found no file no.xml, expected one"),
    ("no mesh", MESH.format("no.stl"), BODY, "found no file no.stl, expected one"),
    ("mesh that is none", MESH.format("/etc/passwd"), BODY, "element 'm' in line 1: found mesh file /etc/passwd, exp"),
    ("damaged mesh", MESH.format("damaged.stl"), BODY, "damaged.stl, expected a whole binary STL file"),
    ("decimal comma", "", BODY.format('<inertial mass="0,5" pos="0 0 0" diaginertia="1 1 1"/>'), "numbers in 'mass'"),
    ("negative mass", "", BODY.format('<inertial mass="-1" pos="0 0 0" diaginertia="1 1 1"/>'),
     "'b' in line 1: found a b"),
    ("inertia", "", BODY.format('<inertial mass="1" pos="0 0 0" diaginertia="1 1 5"/>'), "no body has this inertia"),
    ("NaN", "", BODY.format('<body name="c" pos="nan 0 0"/>'), "body 'c': found a number in 'pos' that is not finite"),
    ("no axis", "", BODY.format('<joint axis="0 0 0"/>'), "found an axis without direction"),
    ("misspelled", "", BODY.format('<joint axiss="0 0 1"/>'), "'joint' in line 1: found an unknown attribute 'axiss'"),
    ("two names", "", BODY.format('<body name="b"/>'), "found the name 'b' twice"),
    ("too many", "", BODY.format('<replicate count="1000"><replicate count="1000"/></replicate>'), "1e+06 copies"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("before", "inside", "sentence"), [case[1:] for case in WRONG_MJCF], ids=[c[0] for c in WRONG_MJCF]
)
def test_a_wrong_mujoco_file_is_refused_in_one_sentence(tmp_path, capfd, before, inside, sentence):
    """MuJoCo's errors have the file, and their place first; what it would not notice is noticed."""
    (tmp_path / "damaged.stl").write_bytes(bytes(80) + b"\xff\xff\xff\x7f" + bytes(50))
    file = tmp_path / "robot.xml"
    file.write_text(f"<mujoco>{before}<worldbody>{inside.replace('{}', '')}</worldbody></mujoco>")
    with pytest.raises(RobotError) as error:
        load_robot(file)
    assert str(error.value).startswith(str(file))
    assert sentence in str(error.value)
    assert not re.search(r"\n|Error|id \d", str(error.value))
    assert capfd.readouterr() == ("", "")


# (name, changes, words of the warning)
DOUBTFUL = [
    ("lengths in mm", [('xyz="0 0 -0.3"', 'xyz="0 0 -300"')], "The robot is 300 m large; in millimetres"),
    ("shape in mm", [('radius="0.02"', 'radius="200"')], "The robot is 200 m large; in millimetres"),
    ("masses in g", [('"4"', '"4000"'), ('"0.5"', '"500"')],
     "weighs 4500 kg at a size of 0.6 m; in grams it would be 4.5 kg"),
    ("inertia in kg mm2", [('ixx="0.01"', 'ixx="10000"'), ('iyy="0.01"', 'iyy="10000"')],
     "'shank': 141 m), as in kg mm"),
    ("moment", [('izz="0.001"', 'izz="0.03"')],
     "'shank' has principal moments 0.01, 0.01, 0.03 kg m², expected none larger"),
    ("product", [('ixy="0" ixz="0" iyy="0.01"', 'ixy="0.011" ixz="0" iyy="0.01"'), ('"0.001"', '"0.01"')],
     "expected none below 0"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "warning"), [case[1:] for case in DOUBTFUL], ids=[case[0] for case in DOUBTFUL])
def test_what_looks_wrong_is_loaded_with_a_warning(tmp_path, changes, warning):
    """Other units, and inertias as models have them that are in use, are said and not refused."""
    assert load_robot(_urdf(tmp_path)).warnings == ()
    warnings = load_robot(_urdf(tmp_path, *changes)).warnings
    assert any(warning in sentence for sentence in warnings), warnings


def test_hollow_flat_and_massless_bodies_are_right(tmp_path):
    """Inertias at the bounds of what bodies have are neither refused nor doubted."""
    moments = 'ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"'
    for values in ((0.01, 0.01, 0.02), (0, 0, 0), (0.01, 0.01, 0), (1e-20, -5e-20, 0)):
        change = moments.format(0.01, 0.01, 0.001), moments.format(*values)
        assert load_robot(_urdf(tmp_path, change)).warnings == ()


def test_blanks_around_numbers_are_read(tmp_path):
    """Numbers with blanks, which the reader in C++ does not understand, are those numbers."""
    file = _urdf(tmp_path, ('"0.5"', '" 0.5 "'), ('xyz="0 0 -0.15"', 'xyz=" 0\t0\n -0.15 "'))
    assert load_robot(file).model.inertias[1].mass == 0.5
    assert load_robot(file).model.inertias[1].lever[2] == -0.15


def test_capsules_are_read_in_files_without_version(tmp_path):
    """A capsule, which the reader in C++ leaves out with all shapes behind it, is a collision shape."""
    file = _urdf(tmp_path, ('<sphere radius="0.02"/>', '<capsule radius="0.02" length="0.1"/>'))
    (shape,) = load_robot(file).collision_shapes
    assert type(shape.geometry).__name__ == "Capsule"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "windows-1252", "iso-8859-15"])
def test_a_file_is_read_in_the_encoding_that_it_declares(tmp_path, encoding):
    """Names of joints and frames are the file's letters in every encoding that Python knows for XML."""
    declared = encoding.removesuffix("-sig")
    text = f'<?xml version="1.0" encoding="{declared}"?>\n<!-- Länge -->' + LEG.replace("knee", "Hüfte").replace(
        "shank", "Bß"
    )
    file = tmp_path / "bein.urdf"
    file.write_bytes(text.encode(encoding))
    robot = load_robot(file)
    assert robot.configuration_names == ["Hüfte"]
    assert "Bß" in robot.frame_names
    assert robot.collision_shapes[0].body == "Bß"


@pytest.mark.parametrize(
    ("beginning", "sentence"),
    [
        (b"", "is not an XML file: not well-formed (invalid token): line 9"),
        (b'<?xml version="1.0" encoding="martian"?>', "found an encoding that is not known"),
        (b'<?xml version="1.0" encoding="utf-16"?>', "is not an XML file"),
    ],
)
def test_letters_in_another_encoding_are_refused(tmp_path, beginning, sentence):
    """A file that is not in the encoding that it declares, or in an unknown one, is refused in one sentence."""
    file = tmp_path / "bein.urdf"
    file.write_bytes(beginning + LEG.replace("knee", "Hüfte").encode("latin-1"))
    with pytest.raises(RobotError, match=re.escape(sentence)):
        load_robot(file)


def test_a_mujoco_file_is_in_utf_8(tmp_path):
    """MuJoCo knows no other encoding, so that letters in another one are refused, also in files that are included."""
    file = tmp_path / "robot.xml"
    text = f'<?xml version="1.0" encoding="ISO-8859-1"?><mujoco><worldbody>{BODY.format("")}</worldbody></mujoco>'
    file.write_text(text)
    assert load_robot(file).joint_names == ["j"]
    file.write_bytes(text.replace('"j"', '"ü"').encode("latin-1"))
    with pytest.raises(RobotError, match="found letters that are not in UTF-8"):
        load_robot(file)
    (tmp_path / "part.xml").write_bytes(
        f"<mujoco><worldbody>{BODY.format('')}</worldbody></mujoco>".replace('"j"', '"ü"').encode("latin-1")
    )
    file.write_text('<mujoco><include file="part.xml"/></mujoco>')
    with pytest.raises(RobotError, match="found names that are not in UTF-8"):
        load_robot(file)


BOMB = '<!DOCTYPE robot [<!ENTITY a "{0}"><!ENTITY b "{1}"><!ENTITY c "{2}">]><robot name="&c;"/>'


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("<robot>" * 100_000, "is not an XML file"),
        ("<robot>" * 1000 + "</robot>" * 1000, "elements inside each other 451 deep, expected at most 450"),
        (BOMB.format("x" * 100_000, "&a;" * 300, "&b;" * 300), "limit on input amplification"),
        ('<!DOCTYPE robot [<!ENTITY a SYSTEM "/etc/passwd">]><robot name="&a;"/>', "is not an XML file"),
    ],
    ids=["not closed", "deep", "entities", "file"],
)
def test_files_that_are_made_to_harm_are_refused(tmp_path, text, sentence):
    """Depth and entities of XML end with a sentence before they cost time or memory."""
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    with pytest.raises(RobotError, match=sentence):
        load_robot(file)


def test_a_chain_of_links_has_an_end(tmp_path):
    """A chain on which the reader in C++ would run out of stack is refused."""
    links = "".join(f'<link name="l{number}"/>' for number in range(5001))
    joints = "".join(BAR.format(f"j{number}", f"l{number}", f"l{number + 1}") for number in range(5000))
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="chain">{links}{joints}</robot>')
    with pytest.raises(RobotError, match="found 5001 links behind each other, expected at most 1000"):
        load_robot(file)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('"0.5"', '"0.5001"'), "0.5001 kg on joint 'knee', but Pinocchio's model has 0.5 kg"),
        (('ixx="0.01"', 'ixx="0.0100001"'), "a body on joint 'knee', but Pinocchio's model has one with"),
        (('xyz="0 0 -0.15"', 'xyz="0 0 -0.1500001"'), "a body on joint 'knee'"),
        (('rpy="0 0.1 0"', 'rpy="0 0.1000001 0"'), "a body on joint 'knee'"),
        (('xyz="0 0 -0.3"', 'xyz="0 1e-6 -0.3"'), "joint 'knee' at "),
        (("knee", "hip"), "it has joint 'hip', but Pinocchio's model has nothing"),
        (('link name="foot"/>', 'link name="toe"/>'), "it has link 'toe', but Pinocchio's model has nothing"),
        (("</robot>", '<link name="rod"/>' + BAR.format("r", "foot", "rod").replace("fixed", "floating") + "</robot>"),
         "it has joint 'r', but Pinocchio's model has nothing"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("root", [(), (pin.JointModelFreeFlyer(), "root_joint")], ids=["fixed", "free"])
def test_a_model_that_is_not_the_file_is_noticed(tmp_path, change, sentence, root):
    """Links, joints, places, masses and inertias of Pinocchio's model are held against the file."""
    file = _urdf(tmp_path)
    built = pin.buildModelFromXML(xml_text(read_xml(file)), *root)
    file = _urdf(tmp_path, change, *([('child link="foot"', 'child link="toe"')] if "toe" in change[1] else []))
    document = read_xml(file)
    check_elements(file, document)
    with pytest.raises(RobotError, match=sentence):
        check_model(file, read_tree(file, document), built)


def _triangles(count: int, claimed: int | None = None) -> bytes:
    one = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return bytes(80) + struct.pack("<I", count if claimed is None else claimed) + count * one


ASCII_STL = (
    b"solid a\n" + b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n" * 2
)
COLLADA = (library.examples_folder() / "panda_description/meshes/visual/finger.dae").read_bytes()

# (name of the file, its content, words of the sentence)
WRONG_MESHES = [
    ("absent.stl", None, "found no such file"),
    ("/nowhere/absent.stl", None, "found no file of this name"),
    ("/etc/passwd", None, "found a file that ends in '', expected one of .stl, .dae, .obj"),
    ("/dev/zero", None, "expected a file"),
    ("http://example.org/a.stl", None, "begins with http://, expected package://, file:// or a path"),
    ("folder.stl", "folder", "found a folder, expected a file"),
    ("mesh.stp", b"ISO-10303-21;", "found a file that ends in '.stp'"),
    ("mesh.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n", "found a file that ends in '.ply'"),
    ("text.stl", b"hello world" * 20, "cut off or no STL"),
    ("short.stl", b"hello", "found a file that is no STL"),
    ("cut.stl", _triangles(12)[:-70], "cut off or no STL, with 10 of 12 triangles"),
    ("huge.stl", _triangles(2, claimed=2**32 - 1), "with 2 of 4294967295 triangles"),
    ("none.stl", _triangles(0), "expected"),
    ("ascii.stl", ASCII_STL[:-40], "cut off, expected 'endsolid'"),
    ("text.dae", b"hello world", "no DAE"),
    ("cut.dae", COLLADA[:-3000], "cut off or damaged"),
    ("wrong.dae", re.sub(rb"(<p>[\d\s]*)", rb"\1 nan ", COLLADA, count=1), "found something else than numbers in <p>"),
    ("text.obj", b"hello world", "no OBJ"),
    ("wrong.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 300\n", "damaged or no OBJ"),
    ("nan.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "expected"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "sentence"), WRONG_MESHES, ids=[case[0] for case in WRONG_MESHES])
def test_a_mesh_that_is_none_is_told_in_one_sentence(tmp_path, capfd, name, content, sentence):
    """Robot file, link and mesh are named, whether it is drawn or may collide, without words of the reader."""
    if content == "folder":
        (tmp_path / name).mkdir()
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    for old in ('<sphere radius="0.02"/>', '<box size="0.1 0.1 0.3"/>'):
        file = _urdf(tmp_path, (old, f'<mesh filename="{name}"/>'))
        robot = load_robot(file)
        with pytest.raises(RobotError) as error:
            robot.visual_model if "box" in old else robot.collision_shapes  # noqa: B018
        assert str(error.value).startswith(f"{file}: link 'shank', mesh {name}: ")
        assert sentence in str(error.value)
        assert not re.search(r"\n|std::|message:|Hint|\.cpp|\.hpp", str(error.value))
    assert capfd.readouterr() == ("", "")


def test_whole_meshes_are_read(tmp_path):
    """Binary and ASCII STL, OBJ and Collada are read, from a package, a path and beside the file."""
    meshes = {"a.stl": _triangles(2), "b.STL": ASCII_STL + b"endsolid a\n", "c.dae": COLLADA}
    meshes["d.obj"] = b"# a triangle\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    for name, content in meshes.items():
        (tmp_path / name).write_bytes(content)
        for address in (name, f"package://{tmp_path.name}/{name}", f"file://{tmp_path / name}", str(tmp_path / name)):
            file = _urdf(tmp_path, ('<sphere radius="0.02"/>', f'<mesh filename="{address}"/>'))
            assert len(load_robot(file).collision_shapes) == 1


@pytest.mark.skipif(os.name != "posix", reason="file modes")
@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root reads every file")
def test_a_file_that_may_not_be_read_is_named(tmp_path):
    """The reason of the operating system is in the message."""
    file = _urdf(tmp_path)
    file.chmod(0)
    with pytest.raises(RobotError, match="cannot be read: Permission denied"):
        load_robot(file)
