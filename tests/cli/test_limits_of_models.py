"""What `robots` and `check` say about the limits, followers and axes of a model file."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.legs_on_a_slide import STANDING, leg, task_of

LIMIT = '<limit lower="-2.5" upper="0" velocity="20" effort="40"/>'
STANDS = f"{{configuration: {{hip: 0.5, knee: -1.0}}, {STANDING}}}"
SAME = f"initial: {STANDS}\ngoal: {STANDS}\n"
FOLLOWS = '<mimic joint="hip" multiplier="1" offset="1"/>'
NONE = '<limit velocity="20" effort="40"/>'

Run = Callable[..., Any]


def both(run: Run, folder: Path, model: str, lines: str = SAME) -> tuple[str, Any]:
    """Return what `robots` prints of a model, and the outcome of `check` of a task of it, without line breaks."""
    path = task_of(folder, model, lines)
    robots = run("robots", folder / "robot.urdf")
    check = run("check", path)
    return robots.out + robots.err, check._replace(out=" ".join(check.out.split()), err=" ".join(check.err.split()))


def problem(text: str) -> tuple[str, ...]:
    """Return the numbers of variables, constraints and pairs that `check` prints."""
    found = re.search(r"(\d+) variables, (\d+) constraints and (\d+) complementarity", text)
    assert found is not None, text
    return found.groups()


def test_the_limits_of_a_follower_are_its_leaders(run: Run, tmp_path: Path) -> None:
    """The narrower limits are listed, with the joint that they are from, and hold for the start."""
    start = "initial: {configuration: {slide: 0.6, hip: 0.5}}\ngoal: {configuration: {slide: 0.6, hip: 0.6}}\n"
    robots, check = both(run, tmp_path, leg(LIMIT + FOLLOWS), start)
    assert re.search(r"hip +rad +\[-2, -1\] +20", robots)
    assert "'knee', which follows as 1 hip + 1, has [-2.5, 0]" in robots
    assert check.code == 2
    assert "initial.configuration.hip: found 0.5, expected a value in [-2, -1], the limits in the robot" in check.err
    assert "'knee', which follows as 1 hip + 1, has [-2.5, 0]" in check.err
    inside = start.replace("0.5}", "-1.2}").replace("0.6}}\n", "-1.3}}\n")
    _, check = both(run, tmp_path, leg(LIMIT + FOLLOWS), inside)
    assert check.code == 0 and "hip rad -1.2 -1.3 [-2, -1]" in check.out and "'knee', which follows" in check.out


@pytest.mark.parametrize("replaced", ["", "limits: {position: {knee: [-2.5, 0]}}\n"])
def test_a_joint_without_range_is_said_to_have_none(run: Run, tmp_path: Path, replaced: str) -> None:
    """`robots` and `check` agree on [0, 0] and say whose limit that is; the task's own replaces it, and the note."""
    robots, check = both(run, tmp_path, leg(NONE), SAME + replaced)
    note = "the file gives 'knee' no range, which URDF takes as [0, 0]; limits.position.knee gives it one"
    assert re.search(r"knee +rad +\[0, 0\]", robots) and note[4:] in robots
    if replaced:
        assert check.code == 0 and "no range" not in check.out and "Warnings" not in check.out
    else:
        assert (
            check.code == 2 and f"found -1, expected a value in [0, 0], the limits in the robot ({note})" in check.err
        )


@pytest.mark.parametrize(
    ("knee", "words"),
    [
        (
            '<limit lower="0" upper="-2.5" velocity="20" effort="40"/>',
            "limits [0, -2.5] of joint 'knee', lower > upper",
        ),
        ('<limit lower="-2.5" upper="0" velocity="-1" effort="40"/>', "velocity -1 in the <limit> of joint 'knee'"),
    ],
)
def test_contradicting_limits_are_errors_of_both(run: Run, tmp_path: Path, knee: str, words: str) -> None:
    """One sentence with the joint."""
    robots, check = both(run, tmp_path, leg(knee))
    assert words in robots and words in check.err and check.code == 2


def test_joints_that_cannot_move_are_warned_of(run: Run, tmp_path: Path) -> None:
    """A velocity limit of 0 is a warning of both, until the task replaces it; nothing is called -0."""
    still = '<limit lower="-2.5" upper="2.5" velocity="0" effort="40"/>'
    words = "The velocity limit of 'hip' and 'knee' is 0, so that they cannot move; limits.velocity gives them others."
    robots, check = both(run, tmp_path, leg(still, hip=still))
    assert words in robots and words in check.out and "with 1 warning" in check.out
    assert "hip rad/s 0 0 [0, 0]" in check.out and "-0]" not in check.out and "[-0" not in check.out
    assert re.search(r"hip +rad +\[-2.5, 2.5\] +0 ", robots)
    _, check = both(run, tmp_path, leg(still, hip=still), SAME + "limits: {velocity: {hip: 20, knee: 20}}\n")
    assert "cannot move" not in check.out
    tables = json.loads(run("robots", tmp_path / "robot.urdf", "--json").out)
    assert [row["velocity"] for row in tables["coordinates"]] == [10, 0, 0] and tables["warnings"] == [words]


def test_round_off_of_an_axis_leaves_a_leg_in_its_plane(run: Run, tmp_path: Path) -> None:
    """With round-off the problem has the size of that without; `check` says that it is gone."""
    (_, clean), (robots, noisy) = (both(run, tmp_path, leg(LIMIT, axis=axis)) for axis in ("0 1 0", "1e-7 1 -1e-8"))
    assert problem(noisy.out) == problem(clean.out)
    assert "The last digits of the axes of knee" in noisy.out and "The last digits of the axes of knee" in robots
    assert "in space" not in clean.out + noisy.out


def test_check_says_which_axis_leads_into_space(run: Run, tmp_path: Path) -> None:
    """A slanted axis puts contacts in space, and is named."""
    _, check = both(run, tmp_path, leg(LIMIT, axis="1e-4 1 0"))
    assert (
        "Contacts are in space and slip in two directions: knee about (0.0001, 1, 0) leads out of the x-z plane."
        in check.out
    )


def test_the_angle_of_a_continuous_joint_is_shown(run: Run, tmp_path: Path) -> None:
    """`robots` lists the angle by which a task writes it, and `check` shows it."""
    robots, check = both(run, tmp_path, leg(NONE, "continuous"))
    assert re.search(r"knee +rad +- +20", robots) and ".cos" not in robots
    assert "knee rad -1 -1 none" in check.out and "hip and knee within 0.01 rad" in check.out


MJCF = """
<mujoco model="hand">
  <worldbody>
    <body name="hand" pos="0 0 0.3">
      <joint name="lift" type="slide" axis="0 0 1" range="-0.3 0.5"/><geom type="box" size="0.05 0.03 0.02" mass="0.5"/>
      <body name="left">
        <joint name="left" type="slide" axis="1 0 0" range="0 0.04"/><geom type="box" size="0.01 0.01 0.03" mass="0.1"/>
      </body>
      <body name="right">
        <joint name="right" type="slide" axis="-1 0 0" range="0 0.04"/>
        <geom type="box" size="0.01 0.01 0.03" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="split"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="left" joint2="right"/></equality>
  <actuator>
    <motor joint="lift" ctrlrange="-20 20"/>
    <position name="grip" tendon="split" kp="100" ctrlrange="0 0.04" forcerange="-30 30"/>
  </actuator>
</mujoco>
"""


def test_a_tendon_motor_over_a_follower_pushes_its_leader(run: Run, tmp_path: Path) -> None:
    """`robots` lists 0.5 + 0.5 on the one coordinate; `check` and `new` know no other."""
    path = task_of(
        tmp_path, "", "initial: {configuration: {lift: 0, left: 0}}\ngoal: {configuration: {lift: 0.05, left: 0.03}}\n"
    )
    path.write_text(path.read_text().replace("robot.urdf", "robot.xml").replace("frame: foot", "frame: left"))
    (tmp_path / "robot.xml").write_text(MJCF)
    assert re.search(r"grip +left 1 ", run("robots", tmp_path / "robot.xml").out)
    check = run("check", path)
    assert check.code == 0 and "Driven: lift, left, 2 of 2" in check.out
    assert run("new", tmp_path / "robot.xml", "--root", "fixed", "--out", tmp_path / "first.yaml").code == 0
