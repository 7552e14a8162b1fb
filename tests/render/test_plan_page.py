"""The page of real plans in a browser without a network: contacts, timeline, plot and camera follow the slider."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from fesd_robot.actions import render_comparison
from fesd_robot.plans import Plan, read_plan, task_of
from fesd_robot.render.outputs import write_page

from .browser import Browser

PLANS = Path(__file__).with_name("plans")
TASKS = Path(__file__).parents[2] / "tasks"
LARGEST = {"hopper_one_jump": 1.5e6, "solo12_jump": 3e6, "block_push": 1.5e6}


class Shown(NamedTuple):
    """A plan and its page."""

    plan: Plan
    page: Path


def read(name: str) -> Plan:
    return read_plan(PLANS / f"{name}.json")


@pytest.fixture(scope="module", params=list(LARGEST))
def shown(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Shown:
    """Hopper, Solo12 and block."""
    plan = read(request.param)
    page = tmp_path_factory.mktemp(request.param) / "plan.html"
    return Shown(plan, write_page(plan, task_of(plan, TASKS), page))


@pytest.fixture
def opened(browser: Browser, shown: Shown) -> Iterator[Browser]:
    """The browser at the start of the motion; afterwards its console is empty, and nothing was asked of a network."""
    browser.console.clear()
    browser.requests.clear()
    browser.resize(1280, 720)
    browser.open(shown.page, "#t=0")
    yield browser
    assert browser.console == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def slide(browser: Browser, moment: float) -> None:
    """Put the slider to a moment, s."""
    browser.run(
        f"(() => {{ const one = document.getElementById('slider'); one.value = {moment}; "
        "one.dispatchEvent(new Event('input')); return true; })()"
    )


ARROW = """fesdRobot.viewer.scene_tree.find(['contacts']).object.children.filter((one) => one.isGroup && one.visible)
  .map((one) => [one.position.toArray(), one.quaternion.toArray(), one.children[0].scale.y])"""


def test_pages_are_small(shown: Shown) -> None:
    """Hopper and block are below 1.5 MB, Solo12 below 3 MB."""
    assert shown.page.stat().st_size < LARGEST[shown.plan.name]


def test_everything_follows_the_slider(opened: Browser, shown: Shown) -> None:
    """Two moments differ in the arrows, the playheads of timeline and plot, the bars and the camera."""
    seen: list[dict[str, Any]] = []
    end = float(shown.plan.trajectory.time[-1])
    for moment in (0.12 * end, 0.9 * end):
        slide(opened, moment)
        seen.append(
            {
                "arrows": opened.run(ARROW),
                "timeline": opened.run("document.querySelector('#timeline b').style.left"),
                "plot": opened.run("document.querySelector('#plot .playhead').style.left"),
                "controls": opened.run("document.getElementById('efforts').textContent"),
                "camera": opened.run("fesdRobot.viewer.camera.position.toArray()"),
            }
        )
        share = 100 * moment / end
        assert float(seen[-1]["timeline"].rstrip("%")) == pytest.approx(share, abs=1e-3)
        assert float(seen[-1]["plot"].rstrip("%")) == pytest.approx(share, abs=1e-3)
        assert seen[-1]["arrows"]
    for key, value in seen[0].items():
        assert value != seen[1][key], key


TICKS = """(() => {
  const viewer = fesdRobot.viewer, box = viewer.renderer.domElement.getBoundingClientRect();
  viewer.camera.updateMatrixWorld(true);
  const shown = [...document.querySelectorAll('#labels .tick')].filter((one) => one.style.visibility === 'visible');
  return shown.map((one) => {
    const at = one.getBoundingClientRect(), x = parseFloat(one.textContent);
    const [here, further] = [0, 1].map((more) => {
      const column = new MeshCat.THREE.Vector3(x + more, 0, 0).project(viewer.camera).x;
      return box.x + box.width * (column + 1) / 2;
    });
    return [at.x + at.width / 2 - here, further - here];
  });
})()"""
"""Pixels by which a label stands beside its place in the scene, and pixels of a metre there."""


def test_labels_stand_where_the_scene_has_them(opened: Browser, shown: Shown) -> None:
    """Every distance label that is shown is within 1 cm of the place it names, wherever the camera has followed to."""
    for moment in (0.1, 0.5, 0.9):
        slide(opened, moment * shown.plan.trajectory.time[-1])
        opened.screenshot()
        ticks = opened.run(TICKS)
        assert len(ticks) >= 2
        for beside, metre in ticks:
            assert abs(beside) <= 0.01 * metre


def test_arrows_are_the_forces_of_the_plan(opened: Browser, shown: Shown) -> None:
    """At every sample that touches, the arrows of a contact add up to its force, in direction and in proportion."""
    plan = shown.plan
    scales = []
    for sample in np.linspace(1, len(plan.trajectory.time) - 2, 12).astype(int):
        moment = float(plan.trajectory.time[sample])
        if (np.abs(np.delete(plan.trajectory.time, sample) - moment) < 1e-9).any():
            continue  # an impact has two samples; the page shows the second
        states = opened.run(f"fesdRobot.contacts.states({moment})")
        for name, contact in plan.contacts.items():
            feet = [one for one in states if one["contact"] == name]
            assert feet
            if feet[0]["mode"] == contact.mode[sample] != "flight":
                force = np.sum([foot["force"] for foot in feet], axis=0)
                # The ground of the three tasks is level: x is the tangent, z the normal.
                expected = [contact.tangential_force[sample], 0.0, contact.normal_force[sample]]
                np.testing.assert_allclose(force, expected, atol=1e-4)
                scales.append(force)
    assert scales


def test_feet_have_the_colour_of_their_mode(opened: Browser, shown: Shown) -> None:
    """In the middle of every stretch of one mode the foot is in that mode; flight has no arrow."""
    rows = opened.run("JSON.parse(document.getElementById('settings').textContent).story.rows")
    for row in rows:
        for mode, first, last in row["spans"]:
            states = opened.run(f"fesdRobot.contacts.states({(first + last) / 2})")
            foot = next(one for one in states if one["contact"] == row["name"])
            assert foot["mode"] == mode
            if mode == "flight":
                assert foot["force"] == [0, 0, 0]


def test_events_are_visited_one_after_the_other(opened: Browser, shown: Shown) -> None:
    """The keys n and p, and the buttons, go through all switches and impacts to the end and back."""
    plan = shown.plan
    found = sorted([one.time for one in plan.switches] + [one.time for one in plan.impulses])
    moments = [t for k, t in enumerate(found) if k == 0 or t - found[k - 1] > 1e-6]
    opened.run("fesdRobot.seek(0)")
    for moment in [*moments, float(plan.trajectory.time[-1])]:
        opened.press("n", "KeyN")
        assert opened.run("fesdRobot.time()") == pytest.approx(moment, abs=1e-6)
    for moment in [*moments[::-1], 0.0]:
        opened.run("document.getElementById('previous').click()")
        assert opened.run("fesdRobot.time()") == pytest.approx(moment, abs=1e-6)


def test_an_impulse_flashes(browser: Browser, tmp_path: Path) -> None:
    """At the touchdown of the hopper its impulse stands on the screen, just before and long after it does not."""
    plan = read("hopper_one_jump")
    browser.open(write_page(plan, task_of(plan, TASKS), tmp_path / "plan.html"), "#t=0")
    hit = plan.impulses[0]
    words = """[...document.querySelectorAll('#labels .impulse')]
      .filter((one) => one.style.visibility === 'visible').map((one) => one.textContent)"""
    for moment, expected in ((hit.time - 0.01, 0), (hit.time + 0.001, 1), (hit.time + 0.19, 0)):
        slide(browser, moment)
        browser.screenshot()
        assert len(browser.run(words)) == expected
    slide(browser, hit.time)
    browser.screenshot()
    assert browser.run(words) == [f"{np.hypot(hit.normal, hit.tangential):.3g} N s"]


def test_the_plot_shows_every_curve(opened: Browser, shown: Shown) -> None:
    """Coordinates, velocities, forces, gaps and controls can be chosen, and each is drawn."""
    plan = shown.plan
    groups = opened.run(
        "[...document.querySelectorAll('#curve optgroup')].map((one) => [one.label, one.children.length])"
    )
    trajectory = plan.trajectory
    assert dict(groups) == {
        "position": len(trajectory.configuration),
        "velocity": len(trajectory.velocity),
        "contact force": len(plan.contacts),
        "gap": len(plan.contacts),
        "control": len(plan.controls) - 1,
    }
    count = opened.run("document.querySelectorAll('#curve option').length")
    for choice in range(count):
        opened.run(
            f"(() => {{ const one = document.getElementById('curve'); one.value = '{choice}'; "
            "one.dispatchEvent(new Event('change')); return true; })()"
        )
        assert opened.run("document.querySelectorAll('#plot canvas').length") == 1


BOXES = """(() => {
  const seen = (one) => one.offsetHeight > 0 && getComputedStyle(one).visibility === 'visible';
  const names = '#caption, #more, #plot-panel, #time, #bar, #labels span';
  const elements = [...document.querySelectorAll(names)].filter(seen);
  const bar = [...document.querySelectorAll('#bar > *')].filter(seen);
  const box = (one) => {
    const at = one.getBoundingClientRect();
    return [one.id || one.textContent, at.left, at.top, at.right, at.bottom];
  };
  return [elements.map(box), bar.map(box)];
})()"""


@pytest.mark.parametrize("size", [(1280, 720), (390, 844)], ids=["desktop", "phone"])
def test_nothing_covers_anything(opened: Browser, shown: Shown, size: tuple[int, int]) -> None:
    """Caption with badge, bar, plot and labels are all on the screen, apart from each other, and the bar is one row."""
    opened.resize(*size)
    opened.screenshot()
    for moment in np.linspace(0.0, float(shown.plan.trajectory.time[-1]), 7):
        slide(opened, float(moment))
        opened.screenshot()
        elements, bar = opened.run(BOXES)
        for one, other in (*combinations(elements, 2), *combinations(bar, 2)):
            apart = one[1] >= other[3] - 1 or one[3] <= other[1] + 1 or one[2] >= other[4] - 1 or one[4] <= other[2] + 1
            inside = (
                {"more", "plot-panel", "caption"} & {one[0], other[0]} and size[0] > 720 and one[1] < 330 > other[1]
            )
            assert apart or inside, (one, other)
        for name, left, top, right, bottom in [*elements, *bar]:
            assert left >= 0, name
            assert top >= 0, name
            assert right <= size[0], name
            assert bottom <= size[1] or size[0] > 720, name
        assert max(entry[2] for entry in bar) < min(entry[4] for entry in bar)
    badge = opened.run("document.getElementById('badge').getBoundingClientRect().toJSON()")
    assert badge["left"] >= 0
    assert badge["right"] <= size[0]


def test_a_plan_that_is_not_solved_says_so_at_once(browser: Browser, tmp_path: Path) -> None:
    """Badge, frame and sentence say it; the badge is red."""
    plan = read("block_push")
    status = plan.status.model_copy(update={"solved": False, "message": "No motion was found that reaches the goal."})
    broken = plan.model_copy(update={"status": status})
    browser.resize(1280, 720)
    browser.open(write_page(broken, task_of(broken, TASKS), tmp_path / "plan.html"))
    assert browser.run("document.getElementById('badge').textContent") == "not solved"
    assert browser.run("getComputedStyle(document.getElementById('badge')).backgroundColor") == "rgb(198, 40, 40)"
    assert browser.run("document.getElementById('subtitle').textContent") == status.message
    assert browser.run("document.getElementById('scene').classList.contains('unsolved')")


def test_two_plans_move_in_one_page(browser: Browser, tmp_path: Path) -> None:
    """The second plan is a transparent robot that moves by itself and can be hidden."""
    plan = read("hopper_one_jump")
    x = {**plan.trajectory.configuration, "root_x": plan.trajectory.configuration["root_x"] + 0.25}
    other = plan.model_copy(
        update={"name": "other", "trajectory": plan.trajectory.model_copy(update={"configuration": x})}
    )
    page = render_comparison(plan, other, tmp_path, task_folder=TASKS, other_folder=TASKS)
    assert page.name == "comparison.html"
    browser.console.clear()
    browser.open(page, "#t=0.5")
    place = """(() => {{
      fesdRobot.viewer.scene.updateMatrixWorld(true);
      return fesdRobot.viewer.scene_tree.find(['{0}']).object.getObjectByName('4 leg')
        .getWorldPosition(new MeshCat.THREE.Vector3()).x;
    }})()"""
    apart = browser.run(place.format("ghost")) - browser.run(place.format("robot"))
    assert apart == pytest.approx(0.25, abs=1e-4)
    browser.run("document.querySelector('[data-group=ghost]').click()")
    assert not browser.run("fesdRobot.viewer.scene_tree.find(['ghost']).object.visible")
    assert "transparent: other" in browser.run("document.getElementById('legend').textContent")
    assert browser.console == []
