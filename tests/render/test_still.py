"""Pages of a task before it is planned, and of what is in a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import formulate
from fesd_robot.render import still
from fesd_robot.render.marks import Mark
from fesd_robot.render.page import PageContent
from fesd_robot.robot import load_robot
from fesd_robot.task import load_task

from .browser import Browser

MODEL = """\
<mujoco model="arm">
  <worldbody>
    <body name="upper" pos="0 0 1.2">
      <joint name="shoulder" axis="0 -1 0" range="-170 170"/>
      <geom name="rod" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.03" mass="1"/>
      <body name="lower" pos="0 0 -0.5">
        <joint name="elbow" axis="0 -1 0" range="-170 170"/>
        <geom name="ball" type="sphere" pos="0 0 -0.5" size="0.04" mass="1"/>
        <site name="tip" pos="0 0 -0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder" ctrlrange="-30 30"/></actuator>
</mujoco>
"""

TASK = """\
name: arm
robot: {model: arm.xml}
contacts:
  tip: {frame: tip}
  side: {type: circle, frame: lower, offset: [0.1, 0, -0.2], radius: 0.05}
  all: {body: lower}
horizon: {duration: 1, intervals: 10}
initial: {configuration: {shoulder: -0.8, elbow: 0.4}}
goal: {configuration: {shoulder: 0.8, elbow: -0.4}}
constraints:
  stone: {type: obstacle, body: lower, obstacle: {type: sphere, center: [0, 0.1, 0.2], radius: 0.1}}
  egg: {type: avoid_ellipse, frame: tip, center: {x: 2, z: 1}, semi_axes: {x: 0.4, z: 0.2}}
  crate: {type: avoid_box, frame: tip, center: [2, 0, 0], size: [0.4, 1, 0.2]}
  ditch: {type: forbidden_zone, contact: tip, x: [0.5, 0.7]}
"""


@pytest.fixture
def task(tmp_path: Path) -> Path:
    """The task of an arm with three contacts and four obstacles."""
    (tmp_path / "arm.xml").write_text(MODEL, encoding="utf-8")
    (tmp_path / "arm.yaml").write_text(TASK, encoding="utf-8")
    return tmp_path / "arm.yaml"


def shown(monkeypatch: pytest.MonkeyPatch) -> list[PageContent]:
    """What pages are asked to show, in a list that grows."""
    contents: list[PageContent] = []

    def keep(path: Path, content: PageContent) -> Path:
        contents.append(content)
        return path

    monkeypatch.setattr(still, "render_page", keep)
    return contents


def test_a_task_shows_all_that_it_names(task: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start and goal, contacts where they are with their radii, shapes, and the obstacles of all constraints."""
    contents = shown(monkeypatch)
    motion = formulate(load_task(task))
    still.write_task_page(motion, task)
    (content,) = contents
    np.testing.assert_allclose(content.configuration, [[-0.8, 0.4]])
    np.testing.assert_allclose(content.ghost, [0.8, -0.4])
    marks = {(mark.group, mark.name): mark for mark in content.marks}
    names = {group: [name for own, name in marks if own == group] for group in dict.fromkeys(own for own, _ in marks)}
    assert names["contacts"] == ["tip", "side, 0.05 m", "all, 0.04 m"]
    assert names["collision shapes"] == ["rod", "ball"]
    assert names["obstacles"] == ["stone", "egg", "crate", "ditch"]
    elbow = np.array([0.5 * np.sin(-0.8), 0, 1.2 - 0.5 * np.cos(-0.8)])
    tip = elbow + np.array([0.5 * np.sin(-0.4), 0, -0.5 * np.cos(-0.4)])
    along, down = np.array([np.cos(-0.4), 0, np.sin(-0.4)]), np.array([np.sin(-0.4), 0, -np.cos(-0.4)])
    places = {"tip": tip, "side, 0.05 m": elbow + 0.1 * along + 0.2 * down, "all, 0.04 m": tip}
    for name, place in places.items():
        np.testing.assert_allclose(marks["contacts", name].pose.translation, place, atol=1e-9)
    assert "tip" in ", ".join(names["frames"]) and "shoulder, upper" in names["frames"]
    assert marks["obstacles", "stone"].shape.radius == pytest.approx(0.1)
    np.testing.assert_allclose(marks["obstacles", "stone"].pose.translation, [0, 0.1, 0.2])
    np.testing.assert_allclose(np.ravel(marks["obstacles", "crate"].shape.halfSide), [0.2, 0.5, 0.1])
    np.testing.assert_allclose(np.ravel(marks["obstacles", "egg"].shape.radii)[[0, 2]], [0.4, 0.2])
    assert np.ravel(marks["obstacles", "ditch"].shape.halfSide)[0] == pytest.approx(0.1)


def test_a_model_shows_all_that_it_has(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Joints, bodies, other frames and collision shapes are where Pinocchio has them when every joint is at zero."""
    contents = shown(monkeypatch)
    robot = load_robot("example-robot-data:a1")
    still.write_robot_page(robot, tmp_path / "robot.html")
    marks = list(contents[0].marks)

    def names(group: str) -> list[str]:
        return [name for mark in marks if mark.group == group for name in mark.name.split(", ")]

    assert set(robot.joint_names) <= set(names("joints"))
    assert {"trunk", "FL_calf", "RR_foot"} <= set(names("bodies"))
    assert len([mark for mark in marks if mark.group == "collision shapes"]) == len(robot.collision_shapes)
    feet = [mark for mark in marks if "FL_foot" in mark.name.split(", ")]
    assert feet and all(isinstance(mark, Mark) for mark in feet)


def test_the_page_of_a_task_in_a_browser(task: Path, browser: Browser, tmp_path: Path) -> None:
    """It opens without the network or a word on the console; switches hide groups; names stand at their places."""
    page = still.write_task_page(formulate(load_task(task)), tmp_path / "task.html")
    assert page.stat().st_size < 2e6
    browser.console.clear()
    browser.requests.clear()
    browser.open(page)
    groups = browser.run("[...document.querySelectorAll('[data-group]')].map((one) => one.dataset.group)")
    assert groups == ["contacts", "collision shapes", "obstacles", "frames", "ghost"]
    names = "[...document.querySelectorAll('#labels .mark')].map((one) => one.textContent)"
    assert set(browser.run(names)) >= {"stone", "egg", "crate", "ditch"}
    place = browser.run(
        "JSON.parse(document.getElementById('settings').textContent).labels.find((one) => one.text === 'stone').at"
    )
    assert place == pytest.approx([0, 0.1, 0.2])
    before = browser.screenshot()
    browser.run("document.querySelector('[data-group=ghost]').click()")
    browser.run("document.querySelector('[data-group=obstacles]').click()")
    after = browser.screenshot()
    assert browser.run("fesdRobot.viewer.scene_tree.find(['marks', 'obstacles']).object.visible") is False
    assert (np.abs(before.astype(int) - after).max(axis=2) > 20).mean() > 0.002
    assert browser.console == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:", "blob:"))] == []
