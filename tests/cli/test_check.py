"""`fesd-robot check` explains a task without solving it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.explanation.problem import capacity
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task
from tests.bodies_in_space import MASS, written


def test_check_explains_robot_contacts_horizon_and_sizes(run: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """Every part of the problem is named, with the sizes that the solver will see; nothing is written."""
    outcome = run("check", task)
    assert (outcome.code, outcome.err) == (0, "")
    text = " ".join(outcome.out.split())
    assert "this is what will be solved." in text and "Warnings" not in text
    motion = formulate(load_task(task))
    problem = Transcription(motion.ocp, motion.fesd).problem
    for words in (
        "'hopper' from ../models/hopper/hopper.urdf, root fixed; 1.1 kg",
        "4 configuration and 4 velocity coordinates",
        "root_x m 0.1 1 [0, 1.1]",
        "Armature: leg 0.1",
        "reaction_torque N m [-50, 50]",
        "Driven: root_x, root_z, root_pitch, leg, 4 of 4 degrees of freedom.",
        "foot: the origin of frame 'foot', friction 0.45, inelastic; touching at the start, touching at the goal.",
        "a_n = 100 N, as given",
        "1 s in 20 intervals of 0.05 s; 3 finite elements each",
        "Radau IIA with 2 stages, of order 3",
        "With 3, an interval can hold 1 impact, or up to 2 other switches, besides switches at its ends.",
        "The whole goal is soft",
        "1 jump over the line from start to goal, at their middle root_z 1, leg 0.1.",
        f"{problem.size} variables, {problem.constraints} constraints and {problem.pairs} complementarity pairs",
    ):
        assert words in text
    assert max(map(len, outcome.out.splitlines())) <= 120
    assert not list((tmp_path / "work").iterdir())


def test_check_sees_the_overrides(run: Callable[..., Any], task: Path) -> None:
    """Goal tolerances, heights and defaults given with --set appear in the explanation."""
    values = [
        "goal.tolerance={configuration: {root_x: 0.01}, velocity: {leg: 0.2}}",
        "initial.configuration.root_z=0.7",
        "method.auxiliary_force=auto",
        "method.elements=2",
        "reference={type: line}",
        "ground.slope=-0.1",
        "costs={}",
    ]
    outcome = run("check", task, *[word for value in values for word in ("--set", value)])
    assert outcome.code == 0
    text = " ".join(outcome.out.split())
    for words in (
        "Hard: root_x within 0.01 m, velocity of leg within 0.2 m/s; all else is soft",
        "0.209 m above the ground at the start",
        "chosen from the weight",
        "With 2, an interval can hold an impact only at its start or its end",
        "The line from start to goal.",
        "rising by -0.1 rad",
        "velocity: root_x 0.0204, root_z 0.0204, root_pitch 0.0051, leg 0.0204 (default)",
        "work of friction (not squared): foot 1.85 (default)",
        "Defaults count in units of the robot: 1.1 kg, 0.5 m, 0.226 s, 10.8 N, 5.4 N m.",
    ):
        assert words in text


def test_check_describes_ground_and_contacts(run: Callable[..., Any], task: Path) -> None:
    """Steps, walls, circles and their gaps at the start are described in words."""
    values = [
        "ground={type: steps, steps: [{x: 0.6, height: 0.2}], walls: {end: {x: 2, side: left, friction: 0}}}",
        "contacts.body={type: circle, frame: body, radius: 0.1, surface: end}",
        "contacts.knee={type: circle_circle, frame: body, radius: 0.1, other_frame: foot, other_radius: 0.05}",
        "goal.configuration.root_z=0.9",
    ]
    outcome = run("check", task, *[word for value in values for word in ("--set", value)])
    assert outcome.code == 0
    text = " ".join(outcome.out.split())
    for words in (
        "Steps: 0 m high, then 0.2 m from x = 0.6 m; every edge smoothed over 0.1 m; friction 0.8",
        "Wall 'end' at x = 2 m, the robot on its left; friction 0.",
        "body: the circle of 0.1 m about frame 'body' against wall 'end', friction 0, inelastic; 1.8 m from the wall",
        "knee: the circle of 0.1 m about frame 'body' against that of 0.05 m about frame 'foot', friction 0.8",
        "0.35 m apart at the start",
    ):
        assert words in text


def test_check_describes_a_height_map(run: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """A height map is described by its extent and its heights."""
    path = tmp_path / "hills.csv"
    path.write_text("x,z\n-1,-0.1\n1,-0.1\n2,-0.2\n3,-0.1\n", encoding="utf-8")
    outcome = run("check", task, "--set", f"ground={{type: height_map, file: {path}}}")
    assert outcome.code == 0, outcome.err
    text = " ".join(outcome.out.split())
    assert f"Heightmap{path};friction0.8" in "".join(text.split())  # a long path may be broken anywhere
    assert re.search(r"For x from -1.4 to 3.4 m its heights are -0\.2\d* to -0\.\d+ m; level beyond\.", text)


def test_check_describes_surfaces_in_space(run: Callable[..., Any], tmp_path: Path) -> None:
    """A map over x and y by its extent and heights; walls, boxes and cylinders by place and size, with contacts."""
    (tmp_path / "hills.csv").write_text("x,y,z\n0,0,0.1\n0,1,0.1\n1,0,0.2\n1,1,0.2\n", encoding="utf-8")
    lines = (
        "robot: {model: model.urdf, root: fixed}\n"
        "ground: {type: height_map, file: hills.csv, walls: {end: {place: [1, 2], facing: 0.3}}}\n"
        "surfaces:\n"
        "  step: {type: box, center: [2, 0, 0.3], size: [0.4, null, 0.6], pitch: 0.2, yaw: 0.1, friction: 0.5}\n"
        "  log: {type: cylinder, axis: x, center: [0, 0, 0.5], radius: 0.1, length: 0.3}\n"
        "contacts: {foot: {frame: mass}, top: {frame: mass, surface: log}}\n"
        "horizon: {duration: 1, intervals: 2}\n"
        "initial: {configuration: {z: 0.2}}\ngoal: {configuration: {z: 0.45}}\n"
    )
    outcome = run("check", written(tmp_path, MASS, lines))
    text = " ".join(f"{outcome.out} {outcome.err}".split())
    for words in (
        "0.05 m inside 'log', expected it outside",
        "goal.configuration",
    ):
        assert words in text
    outcome = run("check", written(tmp_path, MASS, lines.replace("z: 0.45", "z: 0.7")))
    assert outcome.code == 0, outcome.err
    text = " ".join(outcome.out.split())
    for words in (
        "Height map hills.csv; friction 0.8",
        "For x from -2 to 3 m and y from -2 to 3 m its heights are 0 to 0.3 m; it goes on level beyond.",
        "Wall 'end' through x = 1, y = 2 m, facing 0.3 rad from +x towards +y; friction 0.8.",
        "Surface 'step': Box 0.4 m x 0.6 m, without ends along y, around x 2, y 0, z 0.3 m, turned by 0.2 rad about y, "
        "turned by 0.1 rad about z; friction 0.5.",
        "Surface 'log': Cylinder of radius 0.1 m, 0.3 m long, along x around x 0, y 0, z 0.5 m; friction 0.8.",
        "top: the origin of frame 'mass' on 'log', friction 0.8",
        "0.2 m from 'log' at the start, 0.1 m from 'log' at the goal.",
        "Along it top gets",
        "m inside 'log'; the planned motion will not.",
    ):
        assert words in text, text


@pytest.mark.parametrize(
    ("elements", "words"),
    [
        (1, "no impact is possible"),
        (2, "only at its start or its end"),
        (3, "1 impact, or up to 2 other switches"),
        (5, "2 impacts, or up to 4 other switches"),
    ],
)
def test_an_impact_takes_an_element_of_its_own(elements: int, words: str) -> None:
    """Three elements hold one impact inside an interval, five hold two."""
    assert words in capacity(elements)


def test_check_shows_which_joints_are_left(run: Callable[..., Any], tmp_path: Path) -> None:
    """Root, locked and coupled joints, damping and what nothing drives are listed before the coordinates."""
    path = tmp_path / "bolt.yaml"
    path.write_text(
        "name: bolt\nrobot:\n  model: example-robot-data:bolt\n  root: sagittal\n  locked: {FL_HAA: 0, FR_HAA: 0}\n"
        "  coupled: {FR_HFE: FL_HFE, FR_KFE: FL_KFE}\n  damping: {FL_KFE: 0.1}\n  passive: [FL_KFE]\n"
        "contacts: {foot: {frame: FL_FOOT}}\nhorizon: {duration: 0.1, intervals: 1}\n"
        "initial: {configuration: {root_z: 1}}\noutput: {page: false}\n",
        encoding="utf-8",
    )
    outcome = run("check", path)
    assert outcome.code == 0, outcome.err
    text = " ".join(outcome.out.split())
    for words in (
        "root sagittal; ",
        "Locked: FL_HAA 0, FR_HAA 0 (rad or m). Coupled, as one body each: FR_HFE with FL_HFE, FR_KFE with FL_KFE.",
        "Damping: FL_KFE 0.1 (N s/m or N m s/rad).",
        "1 control, constant",
        "Driven: FL_HFE, 1 of 5 degrees of freedom. Not driven: root_x, root_z, root_pitch, FL_KFE; gravity,",
    ):
        assert words in text


def test_check_warns_of_old_keys(run: Callable[..., Any], task_text: str, tmp_path: Path) -> None:
    """A key under an old name is one line on stderr with file, line and both names, and changes nothing else."""
    path = tmp_path / "task.yaml"
    path.write_text(task_text, encoding="utf-8")
    plain = run("check", path)
    path.write_text(task_text.replace("auxiliary_force:", "auxiliary_acceleration:"), encoding="utf-8")
    outcome = run("check", path)
    line = task_text[: task_text.index("auxiliary_force:")].count("\n") + 1
    sentence = "the key 'method.auxiliary_acceleration' is now called 'method.auxiliary_force'"
    assert outcome == (0, plain.out, f"warning: {path}:{line}: {sentence}\n")


def test_check_draws_the_task(run: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """With --page it writes the page into a file or a folder and says where; the explanation stays the same."""
    plain, page = run("check", task).out, tmp_path / "hop.html"
    outcome = run("check", task, "--page", page)
    assert (outcome.code, outcome.out) == (0, f"{plain}\nwritten to {page}\n")
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    outcome = run("check", task, "--page", tmp_path / "drawn")
    assert outcome.code == 0 and (tmp_path / "drawn" / "task.html").is_file()
    (tmp_path / "file").write_text("", encoding="utf-8")
    outcome = run("check", task, "--page", tmp_path / "file" / "task.html")
    assert outcome.code == 2 and "cannot be written" in outcome.err


BARE_BLOCK = """<robot name="block"><link name="world"/><link name="slide"/>
<link name="block"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="slide"/><axis xyz="1 0 0"/>
<limit lower="-10" upper="10" velocity="20" effort="20"/></joint>
<joint name="z" type="prismatic"><parent link="slide"/><child link="block"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="10" velocity="20" effort="0"/></joint></robot>"""

SLIDE = """\
name: slide
robot: {model: block.urdf}
contacts: {under: {frame: block}}
horizon: {duration: 0.2, intervals: 4}
initial: {configuration: {x: 0, z: 0}, velocity: {x: 1}}
goal: {configuration: {x: 0.1}, soft: true}
"""


@pytest.mark.parametrize(
    "ground", ["{type: plane}", "{type: plane, height: -0.5}", "{type: plane, walls: {w: {x: 2, side: left}}}"]
)
def test_the_page_of_a_robot_without_shapes(run: Callable[..., Any], ground: str) -> None:
    """It has the ground, the contact and the frames, and a warning says that there is no robot to see."""
    Path("block.urdf").write_text(BARE_BLOCK, encoding="utf-8")
    Path("slide.yaml").write_text(f"{SLIDE}ground: {ground}\n", encoding="utf-8")
    outcome = run("check", "slide.yaml", "--page", "task.html")
    assert outcome.code == 0 and outcome.err.count("has no visual geometry, the page shows no robot") == 1
    assert '"under' in Path("task.html").read_text(encoding="utf-8")
