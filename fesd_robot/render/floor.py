"""The drawn piece of the ground: a slab, block or mesh with grid lines and distance labels, walls and solids."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.block import add_block, add_mesh, add_solids, add_walls
from fesd_robot.render.geometry import mesh
from fesd_robot.render.meshcat.commands import SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.render.window import SceneWindow

GROUND_COLOR = 0xD3D6D2
GRID_COLOR = 0xB9BEBB
LABELLED_COLOR = 0x8A918E
_CELLS = 100
"""Along each axis: cells of the mesh of a ground that varies along x and y."""

LABEL_WIDTH_RATIO = 0.06
"""Half the width of a distance label as a ratio of half the drawn ground's length."""


class Floor(NamedTuple):
    """Extent of the drawn ground, seen from above.

    Args:
        center: x and y of its middle, m.
        half_size: half its extent along x and y, m.
        spacing: distance of the grid lines, m.
        labelled: x of the lines that carry a label, m, shape (k,).
    """

    center: tuple[float, float]
    half_size: tuple[float, float]
    spacing: float
    labelled: np.ndarray


def floor_below(box: np.ndarray) -> Floor:
    """Return a piece of ground that reaches well beyond `box`, m, shape (2, 3)."""
    size = np.maximum(box[1] - box[0], 1e-3)
    span = float(max(size[0], size[1], 0.6 * size[2]))
    x, y = ((box[0] + box[1]) / 2)[:2].tolist()
    spacing = _round_step(span / 12)
    # Labels stand on grid lines: their distance is a round number and a multiple of the spacing.
    steps = [step for step in spacing * np.array([1, 2, 5, 10]) if np.isclose(_round_step(step), step)]
    step = min(steps, key=lambda value: abs(np.log(5 * value / span)))
    reach = 0.55 * float(size[0])
    half_size = (float(size[0] / 2 + 0.35 * span), float(size[1] / 2 + 0.16 * span))
    return Floor((x, y), half_size, spacing, _multiples(x - reach, x + reach, step))


def tick_labels(ground: GroundVisual, floor: Floor) -> list[dict[str, object]]:
    """Return text and place, m, of each distance label on the ground in front of the robot."""
    y, half_width = floor.center[1] - 0.6 * floor.half_size[1], LABEL_WIDTH_RATIO * floor.half_size[0]
    is_straight = _is_straight(ground, floor)
    labels: list[dict[str, object]] = []
    for x in floor.labelled.round(9).tolist():
        z = ground.elevation(x, y)
        if ground.varies_across:
            z = float(ground.levels(np.array([x - half_width, y]), np.array([x + half_width, y])).max())
        elif not is_straight:
            # A label is as wide as it is, and must not be buried in a rise beside it.
            z = float(ground.outline(x - half_width, x + half_width)[:, 1].max())
        # Adding zero turns -0 into 0.
        labels.append({"text": f"{x + 0.0:g} m", "at": [x, y, z]})
    return labels


def add_floor(window: SceneWindow, ground: GroundVisual, floor: Floor, top: float) -> None:
    """Add the ground with grid lines at multiples of `floor.spacing`, walls up to the height `top`, m, and solids."""
    (x, y), (half_x, half_y) = floor.center, floor.half_size
    thickness = 0.024 * max(half_x, half_y)
    if ground.varies_across:
        _add_field(window, ground, floor, 2 * thickness)
    elif _is_straight(ground, floor):
        _add_slab(window, ground, floor, thickness)
    else:
        _add_profile(window, ground, floor, 2 * thickness)
    add_walls(window, ground, (x - half_x, x + half_x), (y - half_y, y + half_y), top, thickness)
    add_solids(window, ground, 2 * half_y)


def _is_straight(ground: GroundVisual, floor: Floor) -> bool:
    """Return whether the drawn piece of ground is one of a plane."""
    (x, _), (half_x, _) = floor.center, floor.half_size
    return ground.is_straight(x - half_x, x + half_x)


def _add_slab(window: SceneWindow, ground: GroundVisual, floor: Floor, thickness: float) -> None:
    (x, y), (half_x, half_y) = floor.center, floor.half_size
    pose = ground.frame(x, y)
    along = 1.0 / pose[0, 0]
    window.send(SetTransform(pose, Path(("ground",))))
    slab = mesh("slab", mg.Box([2 * half_x * along, 2 * half_y, thickness]), mg.MeshLambertMaterial(color=GROUND_COLOR))
    window.send(SetObject(slab, path=Path(("ground", "slab"))))
    below = np.eye(4)
    below[2, 3] = -thickness / 2
    window.send(SetTransform(below, Path(("ground", "slab"))))

    lift = _lift(floor)
    across, is_labelled = _across(floor)
    ends = (-half_y, half_y)
    grid = [[(c - x) * along, end, lift] for c in across[~is_labelled] for end in ends]
    grid += [
        [e * half_x * along, c - y, lift] for c in _multiples(y - half_y, y + half_y, floor.spacing) for e in (-1, 1)
    ]
    _add_lines(window, grid, [[(c - x) * along, end, lift] for c in across[is_labelled] for end in ends])


def _add_profile(window: SceneWindow, ground: GroundVisual, floor: Floor, depth: float) -> None:
    (x, y), (half_x, half_y) = floor.center, floor.half_size
    outline = ground.outline(x - half_x, x + half_x, tolerance=1e-4 * half_x)
    add_block(window, outline, (y - half_y, y + half_y), depth, GROUND_COLOR)

    lift = _lift(floor)
    across, is_labelled = _across(floor)
    ends = (y - half_y, y + half_y)
    pairs = np.stack([outline[:-1], outline[1:]], axis=1).reshape(-1, 2).tolist()
    grid = [[c, end, ground.elevation(c) + lift] for c in across[~is_labelled] for end in ends]
    grid += [
        [along, c, height + lift] for c in _multiples(y - half_y, y + half_y, floor.spacing) for along, height in pairs
    ]
    _add_lines(window, grid, [[c, end, ground.elevation(c) + lift] for c in across[is_labelled] for end in ends])


def _add_field(window: SceneWindow, ground: GroundVisual, floor: Floor, depth: float) -> None:
    """Add a mesh of the ground, with grid lines that follow it."""
    (x, y), (half_x, half_y) = floor.center, floor.half_size
    along, across = (np.linspace(at - half, at + half, _CELLS + 1) for at, half in ((x, half_x), (y, half_y)))
    add_mesh(window, along, across, ground.elevations(along, across), depth, GROUND_COLOR)

    lift = 2 * _lift(floor)
    places, is_labelled = _across(floor)

    def lines(xs: np.ndarray, ys: np.ndarray) -> list[list[float]]:
        """Return the pieces of lines along whichever of x and y has more places."""
        points = np.stack([*np.meshgrid(xs, ys, indexing="ij"), ground.elevations(xs, ys) + lift], axis=-1)
        points = points if len(ys) == _CELLS + 1 else points.transpose(1, 0, 2)
        return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 3).tolist()

    grid = lines(places[~is_labelled], across) + lines(along, _multiples(y - half_y, y + half_y, floor.spacing))
    _add_lines(window, grid, lines(places[is_labelled], across))


def _lift(floor: Floor) -> float:
    """Return the height of the lines above the ground, m: without it the two would flicker."""
    return 0.0008 * max(floor.half_size)


def _across(floor: Floor) -> tuple[np.ndarray, np.ndarray]:
    """Return x of the grid lines that run across, and which of them are labelled."""
    across = _multiples(floor.center[0] - floor.half_size[0], floor.center[0] + floor.half_size[0], floor.spacing)
    return across, np.isclose(across[:, None], floor.labelled[None, :], atol=floor.spacing / 10).any(axis=1)


def _add_lines(window: SceneWindow, grid: list[list[float]], labelled: list[list[float]]) -> None:
    """Add separate lines, each given by two points that follow each other."""
    for name, points, color in (("grid", grid, GRID_COLOR), ("labelled", labelled, LABELLED_COLOR)):
        geometry = mg.PointsGeometry(np.array(points, dtype=np.float32).reshape(-1, 3).T)
        element = mesh(name, geometry, mg.LineBasicMaterial(color=color), mg.LineSegments)
        window.send(SetObject(element, path=Path(("ground", name))))


def _round_step(step: float) -> float:
    """Return the number 1, 2 or 5 times a power of ten nearest to `step` by ratio."""
    candidates = np.array([1.0, 2.0, 5.0, 10.0]) * 10.0 ** np.floor(np.log10(step))
    return float(candidates[np.argmin(np.abs(np.log(candidates / step)))])


def _multiples(low: float, high: float, spacing: float) -> np.ndarray:
    """Return all multiples of `spacing` in [low, high]."""
    return spacing * np.arange(np.ceil(low / spacing), np.floor(high / spacing) + 1)
