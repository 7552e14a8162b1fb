"""Uneven grounds, walls and circles as the page draws them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import umsgpack

from fesd_robot.contact import Ground, Plane, Profile, Terrain
from fesd_robot.contact.ground import HeightField, tilted_plane
from fesd_robot.ocp.scene import surfaces_of
from fesd_robot.render import (
    CircleVisual,
    FacingWallVisual,
    GroundVisual,
    PageContent,
    SolidVisual,
    WallVisual,
    render_page,
)
from fesd_robot.render.floor import add_floor, floor_below, tick_labels
from fesd_robot.render.meshcat.tree import find_node
from fesd_robot.render.outputs import circle_visuals, ground_visual
from fesd_robot.render.window import SceneWindow
from fesd_robot.robot import load_robot
from fesd_robot.task import load_task
from tests.bodies_in_space import MASS, written

from .browser import Browser
from .conftest import Hop

TASK = Path(__file__).parents[2] / "tasks" / "hopper_stairs.yaml"
HILL_X = np.linspace(-3, 3, 13)
HILLS = HeightField.through(HILL_X, HILL_X, 0.1 * np.sin(HILL_X)[:, None] * np.cos(HILL_X)[None, :])
CORNERS = np.array([[-1.0, 0.0], [0.2, 0.0], [0.4, 0.3], [2.0, 0.3]])


def polyline(points: np.ndarray) -> Terrain:
    """Return the ground of straight lines between points x, z, (n, 2)."""
    return Terrain(Profile(points[:, 0], np.stack([points[:-1, 1], np.diff(points[:, 1]) / np.diff(points[:, 0])])))


@dataclass(frozen=True)
class Ripples(Plane):
    """z = sin(x), a ground that the package does not have; the page asks for heights and where it bends only."""

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.sin(x)

    def bends(self, low: float, high: float) -> np.ndarray:
        return np.linspace(low, high, 103)[1:-1]


@pytest.mark.parametrize("ground", [Plane(0.1, 0.3), polyline(CORNERS), HILLS, tilted_plane(0.1, 0.3, -0.4)])
def test_heights_are_where_the_gap_is_zero(ground: Ground) -> None:
    """z = h(x, y) lies on the surface, and lines between its bends are nowhere far from it."""
    x, y = np.random.default_rng(1).uniform(-1.5, 2.5, size=(2, 50))
    z = ground.heights(x, y)
    assert [ground.distance(np.array(at)) for at in zip(x, y, z, strict=True)] == pytest.approx(np.zeros(50), abs=1e-9)
    places = np.array([-1.5, *ground.bends(-1.5, 2.5), 2.5])
    assert (np.diff(places) > 0).all()
    between = np.linspace(-1.5, 2.5, 1001)
    drawn = np.interp(between, places, ground.heights(places, np.zeros_like(places)))
    assert drawn == pytest.approx(ground.heights(between, np.zeros_like(between)), abs=1e-3)


def test_a_ground_is_drawn_by_its_heights() -> None:
    """Also one of a class of its own is drawn as uneven as it is."""
    ground, floor = GroundVisual(Ripples()), floor_below(np.array([[-3.0, -0.1, 0.0], [3.0, 0.1, 1.0]]))
    window = SceneWindow()
    add_floor(window, ground, floor, 1.0)
    block = umsgpack.unpackb(find_node(window.tree, ["ground", "block"]).object)
    (geometry,) = block["object"]["geometries"]
    x, _, z = np.frombuffer(geometry["data"]["attributes"]["position"]["array"].data, np.float32).reshape(-1, 3).T
    top = z > z.min()
    assert x.min() < -3 < 3 < x.max() and z[top] == pytest.approx(np.sin(x[top]), abs=1e-6)


def test_an_outline_keeps_its_corners() -> None:
    """Points on straight lines are left out, corners stay, and beyond its ends a profile is level."""
    x = np.linspace(-1, 2, 301)
    ground = GroundVisual(polyline(CORNERS))
    assert ground.outline(-5, 5, 1e-9) == pytest.approx(np.array([[-5, 0], *CORNERS[1:3], [5, 0.3]]))
    assert ground.outline(0.25, 0.35, 1e-9) == pytest.approx(np.array([[0.25, 0.075], [0.35, 0.225]]))
    fine = GroundVisual(Ripples()).outline(-1, 2, 1e-3)
    assert len(fine) < 60
    assert np.abs(np.interp(x, *fine.T) - np.sin(x)).max() <= 1e-3


def test_labels_stand_on_the_ground() -> None:
    """Distance labels stand at least as high as the ground, also beside a rise."""
    ground = GroundVisual(polyline(CORNERS))
    labels = tick_labels(ground, floor_below(np.array([[-1.0, -0.1, 0.0], [2.0, 0.1, 1.0]])))
    assert len(labels) > 3
    for label in labels:
        x, _, z = label["at"]  # type: ignore[misc]
        assert z >= ground.elevation(x)  # type: ignore[has-type]


def test_a_task_is_drawn_as_it_computes() -> None:
    """Steps, walls and circles of a task have the heights, places and radii that the planner computes with."""
    task = load_task(TASK)
    robot = load_robot(task.locate_model(), root=task.robot.root)
    ground = ground_visual(task)
    assert [ground.elevation(x) for x in (0, 0.4, 0.6, 2)] == pytest.approx([0, 0.075, 0.15, 0.3], abs=1e-9)
    assert ground.walls == {"end": WallVisual(1.4, "left")}
    assert circle_visuals(task, robot) == {"body": CircleVisual(robot.frame_id("body"), 0.1, 1)}


def test_stairs_walls_and_circles_stand_in_the_browser(browser: Browser, hop: Hop, tmp_path: Path) -> None:
    """The drawn block reaches up to the profile, the wall stands on its far side, and the rim goes with the body."""
    body = hop.model.getFrameId("body", pin.FrameType.BODY)
    page = render_page(
        tmp_path / "stairs.html",
        PageContent(
            title="stairs",
            model=hop.model,
            visual_model=hop.visual_model,
            time=hop.time,
            configuration=hop.configuration,
            ground=GroundVisual(polyline(CORNERS), walls={"end": WallVisual(1.5, "left")}),
            traces={"foot": hop.foot},
            circles={"body": CircleVisual(body, 0.25, 0)},
        ),
    )
    browser.console.clear()
    browser.open(page)
    block, wall = drawn_box(browser, "block"), drawn_box(browser, "wall 0 end")
    assert block[1, 2] == pytest.approx(0.3, abs=1e-6) and block[0, 2] < 0
    assert wall[0, 0] == pytest.approx(1.5, abs=1e-6)
    assert wall[1, 0] > 1.51
    assert wall[0, 2] == pytest.approx(0.3, abs=1e-6)
    row = 20
    browser.run(f"fesdRobot.seek({hop.time[row]})")
    rim = drawn_box(browser, "rim 0 body")
    center = np.array([hop.configuration[row, 0], 0.0, hop.configuration[row, 1]])
    assert rim == pytest.approx(center + np.array([[-0.25, 0, -0.25], [0.25, 0, 0.25]]), abs=0.01)
    assert browser.console == []


def test_a_task_in_space_is_drawn_as_it_computes(tmp_path: Path) -> None:
    """Tilted planes, height maps, walls, boxes and cylinders have the places that the planner computes with."""
    lines = (
        "robot: {model: model.urdf, root: fixed}\ncontacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 1, intervals: 2}\n"
        "surfaces:\n"
        "  table: {type: box, center: [1, 2, 0.3], size: [0.4, 0.2, 0.6], yaw: 0.5, pitch: 0.2}\n"
        "  log: {type: cylinder, axis: x, center: [0, 0, 0.1], radius: 0.1, length: 2, yaw: 0.3}\n"
    )
    walls = "walls: {end: {place: [1, 2], facing: 0.3}}"
    tilted = load_task(
        written(tmp_path, MASS, f"{lines}ground: {{height: 0.1, slope: 0.2, lateral_slope: -0.3, {walls}}}")
    )
    ground = ground_visual(tilted)
    assert ground.elevation(2, 3) == pytest.approx(0.1 + 2 * math.tan(0.2) - 3 * math.tan(0.3), abs=1e-12)
    assert ground.walls == {"end": FacingWallVisual((1, 2), 0.3)}
    surfaces = surfaces_of(tilted)
    for name, solid in ground.solids.items():
        for corner in solid.corners():
            # Sharp edges are drawn where rounded ones are: (sqrt(3) - 1) r further out; around a cylinder is a box.
            assert 0 < surfaces[name].distance(corner) < (0.005 if name == "table" else 0.05)
    (tmp_path / "map.csv").write_text("x,y,z\n0,0,0\n0,1,0.1\n1,0,0.2\n1,1,0.4\n", encoding="utf-8")
    field = ground_visual(load_task(written(tmp_path, MASS, f"{lines}ground: {{type: height_map, file: map.csv}}")))
    assert [field.elevation(*at) for at in ((0, 0), (0, 1), (1, 0), (1, 1))] == pytest.approx([0, 0.1, 0.2, 0.4])
    assert np.interp([0.0, 0.5, 1.0], *field.outline(-1, 2).T) == pytest.approx([0, 0.1, 0.2], abs=1e-9)


def test_hills_boxes_and_slanted_walls_stand_in_the_browser(browser: Browser, hop: Hop, tmp_path: Path) -> None:
    """The mesh reaches as high as the hills, boxes and cylinders have their lengths, a wall its place and direction."""
    lying, turned = np.eye(4), np.eye(4)
    lying[:3, :3], lying[:3, 3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]], [0.5, 0.4, 0.3]
    turned[:3, 3] = [0.2, -0.3, 0.1]
    ground = GroundVisual(
        HILLS,
        walls={"end": FacingWallVisual((0.4, 0.3), np.pi / 2)},
        solids={
            "log": SolidVisual(lying, (0.2, 0.2, 0.6), is_round=True),
            "table": SolidVisual(turned, (0.3, np.inf, 0.1), is_round=False),
        },
    )
    page = render_page(
        tmp_path / "hills.html",
        PageContent(
            title="hills",
            model=hop.model,
            visual_model=hop.visual_model,
            time=hop.time,
            configuration=hop.configuration,
            ground=ground,
            traces={"foot": hop.foot},
        ),
    )
    browser.console.clear()
    browser.open(page)
    block, wall, log, table = (
        drawn_box(browser, name) for name in ("block", "wall 0 end", "surface 0 log", "surface 1 table")
    )
    heights = ground.elevations(np.linspace(*block[:, 0], 200), np.linspace(*block[:, 1], 200))
    assert block[1, 2] == pytest.approx(heights.max(), abs=1e-3)
    assert block[0, 2] < heights.min()
    assert wall[:, 1].max() == pytest.approx(0.3, abs=1e-6)
    assert wall[:, 0] == pytest.approx(block[:, 0], abs=1e-6)
    assert log == pytest.approx(np.array([[0.2, 0.3, 0.2], [0.8, 0.5, 0.4]]), abs=1e-3)
    assert table[:, [0, 2]] == pytest.approx(np.array([[0.05, 0.05], [0.35, 0.15]]), abs=1e-6)
    assert np.ptp(table[:, 1]) == pytest.approx(np.ptp(block[:, 1]), abs=1e-6)
    assert browser.console == []


def test_a_wall_on_a_slope_stands_where_it_is(browser: Browser, hop: Hop, tmp_path: Path) -> None:
    """A wall on a plane away from x = 0 is drawn upright at its own x, from the plane's height there."""
    page = render_page(
        tmp_path / "slope.html",
        PageContent(
            title="slope",
            model=hop.model,
            visual_model=hop.visual_model,
            time=hop.time,
            configuration=hop.configuration,
            ground=GroundVisual(Plane(slope=0.1), walls={"end": WallVisual(1.5, "left")}),
            traces={"foot": hop.foot},
        ),
    )
    browser.open(page)
    wall = drawn_box(browser, "wall 0 end")
    assert wall[0, 0] == pytest.approx(1.5, abs=1e-6)
    assert wall[1, 0] < 1.6
    assert wall[0, 2] == pytest.approx(1.5 * math.tan(0.1), abs=1e-6)


def drawn_box(browser: Browser, name: str) -> np.ndarray:
    """Return the corners of the box around a node's vertices, m, in the robot's axes, shape (2, 3)."""
    points = browser.run(
        f"""(() => {{
          const node = fesdRobot.viewer.scene.getObjectByName({json.dumps(name)});
          fesdRobot.viewer.scene.updateMatrixWorld(true);
          const found = [], point = new MeshCat.THREE.Vector3();
          node.traverse((object) => {{
            const places = object.geometry && object.geometry.attributes.position;
            for (let k = 0; places && k < places.count; k++) {{
              point.fromBufferAttribute(places, k).applyMatrix4(object.matrixWorld);
              found.push([point.x, -point.z, point.y]);
            }}
          }});
          return found;
        }})()"""
    )
    return np.array([np.min(points, axis=0), np.max(points, axis=0)])


def test_a_ground_that_nothing_touches_is_below_all_that_moves() -> None:
    """On a table, which lies in the plane of the motion, it is a scale below; under a foot it stays where it is."""
    public = Path(__file__).parents[2] / "tasks" / "public"
    boxes = [np.array([[-1.0, -0.1, -2.0], [1.0, 0.1, 0.5]]), np.array([[0.0, 0.0, -2.5]]), np.full((2, 3), np.inf)]
    table = ground_visual(load_task(public / "impact_push_t.yaml")).below(boxes)
    assert table.elevation(0.3) == pytest.approx(-2.5 - 0.1 * 3.0)
    standing = ground_visual(load_task(public.parent / "hopper_one_jump.yaml"))
    assert standing.below(boxes) is standing and standing.elevation(0.3) == 0.0
