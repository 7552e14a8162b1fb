"""The page in a real browser, from disk and with every network address unreachable."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import Plane
from fesd_robot.render import GroundVisual, PageContent, render_page

from .browser import Browser
from .conftest import Hop

COLLADA = Path(__file__).with_name("wedge.dae")
SIDE, BAR_TOP = 330, 600
"""Pixels left of the scene and above the bar."""


@pytest.fixture(scope="module")
def page(hop: Hop, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The hop as a page; its clock starts at 10 s."""
    return render_page(
        tmp_path_factory.mktemp("page") / "hop.html",
        PageContent(
            title="hopper_two_hops",
            subtitle="solved",
            model=hop.model,
            visual_model=hop.visual_model,
            time=10.0 + hop.time,
            configuration=hop.configuration,
            ground=GroundVisual(),
            traces={"foot": hop.foot},
        ),
    )


@pytest.fixture
def opened(browser: Browser, page: Path) -> Iterator[Browser]:
    """The browser with the page open; afterwards there must be nothing on its console and no request."""
    browser.console.clear()
    browser.requests.clear()
    browser.resize(1280, 720)
    browser.open(page)
    browser.run("window.element = (id) => document.getElementById(id); true")
    yield browser
    browser.run("fesdRobot.pause()")
    assert browser.console == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def world_position(browser: Browser, name: str) -> np.ndarray:
    """Return where the node called `name` is, m, in the robot's axes (z up), shape (3,)."""
    x, y, z = browser.run(
        f"""(() => {{
          const scene = fesdRobot.viewer.scene;
          scene.updateMatrixWorld(true);
          return scene.getObjectByName({json.dumps(name)}).getWorldPosition(new MeshCat.THREE.Vector3()).toArray();
        }})()"""
    )
    return np.array([x, -z, y])


def body_center(picture: np.ndarray) -> np.ndarray:
    """Return the middle of all pixels in the blue of the hopper's body, (column, row)."""
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    blue[:, :SIDE] = blue[BAR_TOP:] = 0
    rows, columns = np.nonzero((blue - red > 50) & (blue - green > 30))
    assert rows.size > 500, "the body is not visible"
    return np.array([columns.mean(), rows.mean()])


def tick_columns(browser: Browser) -> dict[float, float]:
    """Return where on the screen the middle of every distance label that is shown lies: x, m -> column of pixels."""
    entries = browser.run(
        """[...document.querySelectorAll('#labels .tick')].filter((one) => one.style.visibility === 'visible')
          .map((one) => [one.textContent, one.getBoundingClientRect()])
          .map(([text, at]) => [text, at.x + at.width / 2])"""
    )
    return {float(text.removesuffix(" m")): column for text, column in entries}


@pytest.mark.parametrize("follow", ["true", "false"])
def test_lengths_on_the_screen_are_true(opened: Browser, hop: Hop, follow: str) -> None:
    """From the side the body stands within 1 cm of where the distance labels say, whether the camera follows or not."""
    opened.run(f"fesdRobot.camera.follow({follow})")
    for row in (12, 60, 100):
        opened.run(f"element('slider').value = {hop.time[row]}; element('slider').dispatchEvent(new Event('input'))")
        assert opened.run("fesdRobot.time()") == pytest.approx(10.0 + hop.time[row], abs=1e-6)
        column = body_center(opened.screenshot())[0]
        places, columns = zip(*sorted(tick_columns(opened).items()), strict=True)
        assert len(places) >= 2
        meters, first = np.polyfit(columns, places, 1)
        assert first + meters * column == pytest.approx(hop.configuration[row, 0], abs=0.01)


def test_the_scene_follows_the_samples(opened: Browser, hop: Hop) -> None:
    """At its own uneven time every sample is where Pinocchio says, and halfway the motion is in between."""
    for row in (0, 5, 40, 60, 100, len(hop.time) - 1):
        opened.run(f"fesdRobot.seek({10.0 + hop.time[row]})")
        np.testing.assert_allclose(world_position(opened, "4 leg"), hop.foot[row], atol=2e-6)
    opened.run(f"fesdRobot.seek({10.0 + (hop.time[20] + hop.time[21]) / 2})")
    middle = (hop.foot[20] + hop.foot[21]) / 2
    np.testing.assert_allclose(world_position(opened, "4 leg"), middle, atol=1e-3)


def test_the_camera_sees_the_whole_motion(opened: Browser, hop: Hop) -> None:
    """When it does not follow, the path of the body fits into the scene, wide or narrow."""
    low, high = hop.configuration[:, :2].min(axis=0) - 0.1, hop.configuration[:, :2].max(axis=0) + 0.1
    opened.run("fesdRobot.camera.follow(false)")
    for width, height in ((1280, 720), (600, 900)):
        opened.resize(width, height)
        opened.screenshot()
        for x in (low[0], high[0]):
            for z in (0.0, high[1]):
                column, row = projected(opened, (x, 0.0, z))
                assert 0.0 < column < 1.0
                assert 0.0 < row < 1.0


def projected(browser: Browser, point: tuple[float, float, float]) -> tuple[float, float]:
    """Return where a point of the world is in the scene, from the left and from above, 0 ... 1."""
    x, y, z = point
    column, row = browser.run(
        f"""(() => {{
          const viewer = fesdRobot.viewer;
          viewer.camera.updateMatrixWorld(true);
          const p = new MeshCat.THREE.Vector3({x}, {z}, {-y}).project(viewer.camera);
          return [(p.x + 1) / 2, (1 - p.y) / 2];
        }})()"""
    )
    return column, row


def test_the_camera_follows_and_changes_its_view(opened: Browser, hop: Hop) -> None:
    """A camera that follows keeps the body near the middle; front and top look along their axes; free stays above."""
    opened.run("fesdRobot.camera.follow(true)")
    for row in (5, 80, 120):
        opened.run(f"fesdRobot.seek({10.0 + hop.time[row]})")
        x, z = hop.configuration[row, :2]
        column, height = projected(opened, (x, 0.0, z))
        assert column == pytest.approx(0.5, abs=0.2)
        assert 0.0 < height < 1.0
    direction = """(() => {
      const toward = fesdRobot.viewer.camera.getWorldDirection(new MeshCat.THREE.Vector3());
      return [toward.x, -toward.z, toward.y];
    })()"""
    for key, expected in (("1", (0, 1, 0)), ("2", (-1, 0, 0)), ("3", (0, 0, -1))):
        opened.press(key, f"Digit{key}")
        np.testing.assert_allclose(opened.run(direction), expected, atol=1e-3)
    opened.press("4", "Digit4")
    opened.run("fesdRobot.viewer.camera.position.y = -50; fesdRobot.viewer.controls.update(); true")
    assert opened.run("fesdRobot.viewer.camera.position.y") > 0.0
    opened.press("1", "Digit1")


def test_controls_play_step_and_loop(opened: Browser, hop: Hop) -> None:
    """Space plays and pauses, arrows step, the end loops or stops, and the readout tells the time."""
    end = 10.0 + hop.time[-1]
    opened.run("fesdRobot.seek(10.5)")
    assert opened.run("element('readout').textContent") == f"10.500 / {end:.3f} s"
    opened.press("End", "End")
    assert opened.run("fesdRobot.time()") == pytest.approx(end)
    opened.press("Home", "Home")
    assert opened.run("fesdRobot.time()") == pytest.approx(10.0)
    opened.run("fesdRobot.seek(10.5)")
    opened.press("ArrowRight", "ArrowRight")
    assert opened.run("fesdRobot.time()") == pytest.approx(10.52)
    opened.press("ArrowLeft", "ArrowLeft")
    assert opened.run("fesdRobot.time()") == pytest.approx(10.5)
    assert not opened.run("fesdRobot.playing()")
    opened.press(" ", "Space")
    assert opened.run("fesdRobot.playing()")
    opened.screenshot()
    opened.screenshot()
    opened.press(" ", "Space")
    assert not opened.run("fesdRobot.playing()")
    assert opened.run("fesdRobot.time()") != pytest.approx(10.5, abs=1e-4)

    opened.run("element('loop').checked = false; element('speed').value = '2'")
    opened.run(f"fesdRobot.seek({end - 0.02}); fesdRobot.play()")
    opened.run(
        """new Promise((done) => {
          const look = () => fesdRobot.playing() ? requestAnimationFrame(look) : done(true);
          look();
        })"""
    )
    assert opened.run("fesdRobot.time()") == pytest.approx(end)
    opened.run("element('loop').checked = true; fesdRobot.play()")
    assert opened.run("fesdRobot.time()") < end


def test_an_address_can_name_a_moment(browser: Browser, page: Path) -> None:
    """plan.html#t=10.7 opens paused at 10.7 s; without it the page plays."""
    browser.open(page)
    assert browser.run("fesdRobot.playing()")
    browser.run("location.hash = 't=11.1'")
    browser.run("new Promise((done) => setTimeout(done, 50))")
    assert browser.run("fesdRobot.time()") == pytest.approx(11.1)
    browser.open(page, "#t=10.7")
    assert not browser.run("fesdRobot.playing()")
    assert browser.run("fesdRobot.time()") == pytest.approx(10.7)


def write_wedge(path: Path) -> None:
    """Write a triangle in the x-y plane as binary STL: its box is (0..0.3, 0..0.1, 0..0.2)."""
    corners = ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.1, 0.2))
    triangle = struct.pack("<12fH", 0.0, 0.0, 1.0, *[value for corner in corners for value in corner], 0)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", 1) + triangle)


def shapes(folder: Path) -> pin.GeometryModel:
    """Return one of each shape, turned and shifted; meshes also mirrored."""
    write_wedge(folder / "wedge.stl")
    (folder / "wedge.obj").write_text("v 0 0 0\nv 0.3 0 0\nv 0 0.1 0.2\nf 1 2 3\n")
    loader = coal.MeshLoader()
    visual_model = pin.GeometryModel()
    scale = np.array([1.0, -2.0, 1.0])
    simple = {
        "sphere": coal.Sphere(0.1),
        "box": coal.Box(0.1, 0.2, 0.3),
        "cylinder": coal.Cylinder(0.05, 0.4),
        "capsule": coal.Capsule(0.05, 0.4),
        "cone": coal.Cone(0.1, 0.3),
        "ellipsoid": coal.Ellipsoid(0.1, 0.2, 0.05),
    }
    meshes = {name: (folder / f"wedge.{name}", scale) for name in ("stl", "obj")}
    meshes |= {"dae": (COLLADA, scale), "gone": (folder / "wedge.stl", scale)}
    turn = pin.utils.rotate("x", 0.4) @ pin.utils.rotate("y", 0.3)
    for index, (name, shape) in enumerate(simple.items()):
        placement = pin.SE3(turn, np.array([0.5 * index, 0.0, 0.0]))
        visual_model.addGeometryObject(pin.GeometryObject(name, 1, placement, shape))
    for index, (name, (path, factor)) in enumerate(meshes.items()):
        placement = pin.SE3(turn, np.array([0.5 * index, 1.0, 0.0]))
        geometry = loader.load(str(path), factor)
        # A mesh whose file is not there is drawn from the vertices that Pinocchio holds.
        file = "" if name == "gone" else str(path)
        entry = pin.GeometryObject(name, 1, placement, geometry, file, factor)
        entry.meshColor = np.array([0.8, 0.2, 0.1, 1.0])
        visual_model.addGeometryObject(entry)
    return visual_model


def test_every_shape_is_where_it_belongs(browser: Browser, tmp_path: Path) -> None:
    """The box around each drawn shape is the box around Pinocchio's, while its joint moves."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root/joint")
    visual_model = shapes(tmp_path)
    time = np.array([0.0, 0.5, 2.0])
    start = pin.neutral(model)
    motion = np.array([pin.integrate(model, start, rate * np.array([1.0, 0.5, 0.2, 0.3, 0.4, 0.5])) for rate in time])
    page = render_page(
        tmp_path / "shapes.html",
        PageContent(
            title="shapes",
            model=model,
            visual_model=visual_model,
            time=time,
            configuration=motion,
            ground=GroundVisual(Plane(-0.4, 0.1)),
            traces={},
        ),
    )
    browser.console.clear()
    browser.open(page)
    data, visual_data = model.createData(), visual_model.createData()
    for row in (0, 1, 2):
        browser.run(f"fesdRobot.seek({time[row]})")
        pin.updateGeometryPlacements(model, data, visual_model, visual_data, motion[row])
        for index, entry in enumerate(visual_model.geometryObjects):
            pose = visual_data.oMg[index]
            drawn = browser.run(
                f"""(() => {{
                  const node = fesdRobot.viewer.scene.getObjectByName("shape {index} {entry.name}");
                  fesdRobot.viewer.scene.updateMatrixWorld(true);
                  const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9], point = new MeshCat.THREE.Vector3();
                  node.traverse((object) => {{
                    const places = object.geometry && object.geometry.attributes.position;
                    for (let k = 0; places && k < places.count; k++) {{
                      point.fromBufferAttribute(places, k).applyMatrix4(object.matrixWorld);
                      [point.x, -point.z, point.y].forEach((value, axis) => {{
                        low[axis] = Math.min(low[axis], value);
                        high[axis] = Math.max(high[axis], value);
                      }});
                    }}
                  }});
                  return [low, high];
                }})()"""
            )
            np.testing.assert_allclose(drawn, exact_box(entry, pose), atol=4e-3, err_msg=f"{entry.name}, sample {row}")
    assert browser.console == []


def exact_box(entry: pin.GeometryObject, pose: pin.SE3) -> np.ndarray:
    """Return the corners of the box around a shape at a pose, m, shape (2, 3), from its support function."""
    shape, rotation = entry.geometry, pose.rotation
    directions = rotation.T  # column k is world axis k seen from the shape
    if isinstance(shape, coal.BVHModelBase):
        # The Collada file is in decimetres, which Pinocchio ignores.
        unit = 0.1 if entry.meshPath.endswith(".dae") else 1.0
        reach = unit * np.asarray(shape.vertices()) @ directions
        return np.array([reach.min(axis=0), reach.max(axis=0)]) + pose.translation
    flat = np.linalg.norm(directions[:2], axis=0)
    if isinstance(shape, coal.Sphere):
        reach = np.full(3, shape.radius)
    elif isinstance(shape, coal.Ellipsoid):
        reach = np.linalg.norm(np.asarray(shape.radii)[:, None] * directions, axis=0)
    elif isinstance(shape, coal.Box):
        reach = np.asarray(shape.halfSide) @ np.abs(directions)
    elif isinstance(shape, coal.Cylinder):
        reach = shape.radius * flat + shape.halfLength * np.abs(directions[2])
    elif isinstance(shape, coal.Capsule):
        reach = shape.radius + shape.halfLength * np.abs(directions[2])
    else:
        up = shape.halfLength * directions[2]
        reach = np.maximum(up, shape.radius * flat - up)
        return np.array([-np.maximum(-up, shape.radius * flat + up), reach]) + pose.translation
    return np.array([-reach, reach]) + pose.translation
