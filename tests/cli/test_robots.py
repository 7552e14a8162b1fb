"""`fesd-robot robots` lists the robots of example-robot-data."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from fesd_robot.robot import example_robots, load_robot


def test_the_table_names_every_robot_once(run: Callable[..., Any]) -> None:
    """Names, degrees of freedom, drives and masses stand in columns; what cannot be read says why."""
    outcome = run("robots")
    assert (outcome.code, outcome.err) == (0, "")
    table, _, unread = outcome.out.partition("\n\n")
    header, *rows = table.splitlines()
    assert [row.split()[0] for row in rows] == list(example_robots())
    assert all(row[header.index("mass") :].strip() for row in rows)
    solo = next(row for row in rows if row.startswith("solo12 "))
    assert solo.split() == ["solo12", "12", "12", "2.5", "solo_description/robots/solo12.urdf"]
    assert "cassie: this build of Pinocchio reads no SDF files" in unread


@pytest.mark.parametrize(
    ("pattern", "names"),
    [("SOLO", ["solo", "solo12", "solo8"]), ("s?lo", ["solo"]), ("*12", ["solo12"]), ("hector", ["hector"])],
)
def test_json_of_a_pattern(run: Callable[..., Any], pattern: str, names: list[str]) -> None:
    """A pattern is a part of the name, or with * and ? all of it; JSON holds full paths that load."""
    outcome = run("robots", pattern, "--json")
    entries = json.loads(outcome.out)
    assert [entry["name"] for entry in entries] == names
    for entry in entries:
        robot = load_robot(entry["file"], root="free_flyer")
        assert entry["degrees_of_freedom"] == robot.model.nv - 6 == entry["driven"]
        assert entry["mass"] == pytest.approx(sum(inertia.mass for inertia in robot.model.inertias))


def test_an_unknown_pattern_names_the_nearest(run: Callable[..., Any]) -> None:
    """Nothing found is bad input."""
    outcome = run("robots", "talso")
    assert (outcome.code, outcome.out) == (2, "")
    assert "no robot 'talso'" in outcome.err and "did you mean 'talos'?" in outcome.err


def test_the_shell_completes_names() -> None:
    """What a bash completion asks for lists the names that begin so."""
    asked = {"_FESD_ROBOT_COMPLETE": "complete_bash", "COMP_WORDS": "fesd-robot robots so", "COMP_CWORD": "2"}
    code = "import sys; sys.argv = ['fesd-robot']; from fesd_robot.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **asked}, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == [name for name in example_robots() if name.startswith("so")]


MODEL = """
<mujoco model="lamp">
  <worldbody>
    <body name="arm" pos="0 0 0.4">
      <joint name="hinge" axis="0 1 0" range="-90 90" stiffness="2" springref="30" damping="0.1" frictionloss="0.3"/>
      <geom name="bar" type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor joint="hinge" gear="3" ctrlrange="-1 2"/></actuator>
  <keyframe><key name="up" qpos="-1.5"/></keyframe>
</mujoco>
"""


def test_what_is_in_a_model(run: Callable[..., Any], tmp_path: Any) -> None:
    """Of a model its coordinates with limits, motors and springs, its postures, and last what is left out."""
    (tmp_path / "lamp.xml").write_text(MODEL)
    outcome = run("robots", str(tmp_path / "lamp.xml"))
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.startswith("lamp: 1 degrees of freedom, 1 kg\n")
    header, row = (outcome.out.split("Coordinates:\n")[1].splitlines()[k] for k in (0, 1))
    assert header.split("  ")[0] == "name" and row.split()[:4] == ["hinge", "rad", "[-1.571,", "1.571]"]
    for cell in ("[-3, 6]", "[2, 0.5236]", "0.3"):
        assert cell in row
    assert "up     hinge -1.5" in outcome.out
    assert "Left out:" not in outcome.out


def test_frames_and_shapes_of_a_model(run: Callable[..., Any], tmp_path: Any) -> None:
    """Frames and shapes are listed where they are in the neutral configuration, as a table and as JSON."""
    (tmp_path / "lamp.xml").write_text(MODEL)
    outcome = run("robots", str(tmp_path / "lamp.xml"), "--frames", "--shapes", "--json")
    tables = json.loads(outcome.out)
    assert {row["name"]: row["position"] for row in tables["frames"]} == {"hinge": [0, 0, 0.4], "arm": [0, 0, 0.4]}
    assert tables["shapes"] == [
        {
            "body": "arm",
            "name": "bar",
            "kind": "capsule",
            "size": [0.02, 0.3],
            "position": [0.15, 0, 0.4],
            "friction": 1.0,
        }
    ]
    text = run("robots", str(tmp_path / "lamp.xml"), "--shapes").out
    assert "capsule  [0.02, 0.3]  [0.15, 0, 0.4]" in text and "Coordinates" not in text


def test_the_page_of_a_model(run: Callable[..., Any], tmp_path: Any) -> None:
    """With --page a model is drawn, too; the tables stay the same, and JSON stays JSON."""
    (tmp_path / "lamp.xml").write_text(MODEL)
    plain = run("robots", tmp_path / "lamp.xml").out
    outcome = run("robots", tmp_path / "lamp.xml", "--page", tmp_path / "lamp.html")
    assert (outcome.code, outcome.out) == (0, f"{plain}\nwritten to {tmp_path / 'lamp.html'}\n")
    assert 'data-group="collision shapes"' in (tmp_path / "lamp.html").read_text(encoding="utf-8")
    outcome = run("robots", tmp_path / "lamp.xml", "--json", "--page", tmp_path)
    assert "coordinates" in json.loads(outcome.out) and (tmp_path / "robot.html").is_file()


@pytest.mark.parametrize("options", [["solo", "--frames"], ["--shapes"], ["--page", "solo.html"]])
def test_frames_need_a_model(run: Callable[..., Any], options: list[str]) -> None:
    """A pattern of names has no frames: the error says what would be valid."""
    outcome = run("robots", *options)
    assert outcome.code == 2
    assert "expected a file, package://NAME/PATH or example-robot-data:NAME" in " ".join(outcome.err.split())


def test_the_proposal_of_a_plane_is_a_section_of_a_task(run: Callable[..., Any]) -> None:
    """What --sagittal prints can be pasted into a task; JSON says the same."""
    from ruamel.yaml import YAML

    printed = YAML(typ="safe").load(run("robots", "example-robot-data:solo12", "--sagittal").out)
    assert printed == json.loads(run("robots", "example-robot-data:solo12", "--sagittal", "--json").out)
    robot = printed["robot"]
    assert robot["root"] == "sagittal" and robot["coupled"]["FR_KFE"] == "FL_KFE" and robot["locked"]["HR_HAA"] == 0
    load_robot(robot["model"], root=robot["root"], locked=robot["locked"], coupled=robot["coupled"])
