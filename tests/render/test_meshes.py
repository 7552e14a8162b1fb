"""Meshes of pages: small, near to their originals, sharp where these are sharp."""

from __future__ import annotations

import base64
import io
import struct
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from PIL import Image

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render import GroundVisual, PageContent, render_page
from fesd_robot.render.collada import TEXTURE_PIXELS, read_collada
from fesd_robot.render.meshcat.commands import SetObject
from fesd_robot.render.meshcat.path import Path as ScenePath
from fesd_robot.render.meshes import DEVIATION, ENOUGH, Mesh, Meshes, read_mesh, sharpened, simplified
from fesd_robot.render.window import SceneWindow
from fesd_robot.robot import load_robot


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    """The same triangles."""
    return Mesh(np.array(shape.vertices), np.array(shape.faces))


def test_a_simplified_sphere_is_a_sphere() -> None:
    """A ball of 82 thousand triangles becomes one of 3000 that stays within the deviation, 99 of 100 points."""
    ball, deviation = mesh_of(trimesh.creation.icosphere(6, radius=0.5)), 1e-3
    small = simplified(ball, deviation)
    assert len(ball.faces) == 81920 and len(small.faces) <= ENOUGH
    corners = small.vertices[small.faces]
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=50)
    points = np.einsum("pk,fkd->fpd", weights, corners).reshape(-1, 3)
    apart = np.abs(np.linalg.norm(points, axis=1) - 0.5)
    assert np.quantile(apart, 0.99) <= deviation and apart.max() <= 4 * deviation


def test_what_cannot_be_simplified_stays() -> None:
    """A surface of noise would move by more than the deviation: it keeps its triangles."""
    ball = mesh_of(trimesh.creation.icosphere(5, radius=0.5))
    rough = Mesh(ball.vertices * np.random.default_rng(1).uniform(0.9, 1, size=(len(ball.vertices), 1)), ball.faces)
    assert simplified(rough, 1e-3) is rough


def test_edges_are_sharp_where_the_surface_turns() -> None:
    """The corners of a cube belong to three flat sides; a ball has no edge; both keep their surface."""
    cube, ball = mesh_of(trimesh.creation.box((1, 1, 1))), mesh_of(trimesh.creation.icosphere(4))
    sharp, smooth = sharpened(cube), sharpened(ball)
    assert (len(sharp.vertices), len(smooth.vertices)) == (24, len(ball.vertices))
    for before, after in ((cube, sharp), (ball, smooth)):
        np.testing.assert_array_equal(before.vertices[before.faces], after.vertices[after.faces])


def test_a_mirrored_mesh_keeps_its_outside(tmp_path: Path) -> None:
    """A file scaled by -1 along an axis encloses the same volume, with its sides turned outwards."""
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.stl")
    plain, mirrored = (read_mesh(tmp_path / "box.stl", np.array([1.0, side, 1.0])) for side in (1, -1))
    assert plain is not None and mirrored is not None
    volumes = [trimesh.Trimesh(*one, process=False).volume for one in (plain, mirrored)]
    assert volumes == pytest.approx([6, 6])


def test_a_file_is_simplified_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second page takes the mesh from the cache; a broken file there is made again, another deviation is another
    mesh."""
    monkeypatch.setenv("FESD_ROBOT_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "ball.stl"
    trimesh.creation.icosphere(5, radius=0.5).export(file)
    shape = pin.GeometryObject("ball", 0, 0, pin.SE3.Identity(), coal.Sphere(0.1), str(file), np.ones(3))
    first = Meshes(1.0).drawn(shape)
    (kept,) = (tmp_path / "cache" / "meshes").iterdir()
    time = kept.stat().st_mtime_ns
    assert first is not None
    np.testing.assert_array_equal(Meshes(1.0).drawn(shape).vertices, first.vertices)  # type: ignore[union-attr]
    assert kept.stat().st_mtime_ns == time
    kept.write_bytes(b"broken")
    np.testing.assert_array_equal(Meshes(1.0).drawn(shape).vertices, first.vertices)  # type: ignore[union-attr]
    assert len(Meshes(16.0).drawn(shape).faces) <= len(first.faces)  # type: ignore[union-attr]
    assert len(list((tmp_path / "cache" / "meshes").iterdir())) == 2


def test_a_collision_shape_is_simplified_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles that are drawn without their file, as collision shapes are, come from the cache the second time."""
    monkeypatch.setenv("FESD_ROBOT_CACHE", str(tmp_path / "cache"))
    trimesh.creation.icosphere(5, radius=0.5).export(tmp_path / "ball.stl")
    surface = coal.MeshLoader().load(str(tmp_path / "ball.stl"), np.ones(3))
    shape = pin.GeometryObject("mark", 0, 0, pin.SE3.Identity(), surface)
    first = Meshes(1.0).drawn(shape)
    assert first is not None and len(first.faces) < surface.num_tris
    with monkeypatch.context() as patched:
        patched.delattr("fesd_robot.render.meshes.simplified")
        again = Meshes(1.0).drawn(shape)
    assert again is not None
    np.testing.assert_array_equal(again.vertices, first.vertices)


def test_large_values_are_in_a_scene_once() -> None:
    """Two objects with the same vertices take the place of one, and every command can be put together again."""
    ball = trimesh.creation.icosphere(4)
    sizes, commands = [], []
    for count in (1, 2):
        window = SceneWindow()
        for number in range(count):
            element = mg.Mesh(mg.TriangularMeshGeometry(ball.vertices, ball.faces))
            element.uuid, element.geometry.uuid, element.material.uuid = f"{number}", f"g{number}", f"m{number}"
            window.send(SetObject(element, path=ScenePath((f"ball{number}",))))
        payload = window.payload()
        sizes.append(len(payload))
        commands = _commands(payload)
    assert sizes[1] < sizes[0] + 4000
    assert len(commands) == 2 and commands[1].replace(b"ball1", b"ball0") != commands[1]
    assert all(ball.vertices.astype("<f4").tobytes() in command for command in commands)


def _commands(payload: bytes) -> list[bytes]:
    """Put the commands together as the page does."""
    (count,), at = struct.unpack_from("<I", payload), 4
    pieces, commands = [], []
    for _ in range(count):
        (length,) = struct.unpack_from("<I", payload, at)
        pieces.append(payload[at + 4 : at + 4 + length])
        at += 4 + length
    while at < len(payload):
        (own,) = struct.unpack_from("<I", payload, at)
        numbers = struct.unpack_from(f"<{own}I", payload, at + 4)
        commands.append(b"".join(pieces[number] for number in numbers))
        at += 4 + 4 * own
    return commands


def test_images_are_no_larger_than_one_sees(tmp_path: Path) -> None:
    """An image of 3000 pixels is in the page with 1024; a small one as it is."""
    noise = np.random.default_rng(2).integers(0, 255, size=(1500, 3000, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "large.png")
    Image.fromarray(noise[:8, :8]).save(tmp_path / "small.png")
    text = "<COLLADA><init_from>large.png</init_from><init_from>small.png</init_from></COLLADA>"
    (tmp_path / "shape.dae").write_text(text)
    resources = read_collada(tmp_path / "shape.dae").resources
    large, small = (base64.b64decode(resources[name].partition(",")[2]) for name in ("large.png", "small.png"))
    assert Image.open(io.BytesIO(large)).size == (TEXTURE_PIXELS, TEXTURE_PIXELS // 2)
    assert small == (tmp_path / "small.png").read_bytes()


@pytest.mark.parametrize("name", ["talos", "solo12", "anymal_c"])
def test_pages_of_robots_are_small(name: str, tmp_path: Path) -> None:
    """Pages of robots whose meshes and images have up to 17 MB stay below 5 MB."""
    robot = load_robot(f"example-robot-data:{name}", root="free_flyer")
    content = PageContent(
        title=name,
        model=robot.model,
        visual_model=robot.visual_model,
        time=np.zeros(1),
        configuration=robot.neutral[None, :],
        ground=GroundVisual(),
        traces={},
    )
    assert render_page(tmp_path / "page.html", content).stat().st_size < 5e6


def test_the_stated_deviation() -> None:
    """What the documentation says about the deviation is what is used."""
    text = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")
    assert f"1/{round(1 / DEVIATION)} of the robot's size" in " ".join(text.split())
