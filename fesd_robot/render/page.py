"""One self-contained web page that plays a motion, built on Meshcat's viewer; needs no server and no network."""

from __future__ import annotations

import base64
import gzip
import html
import json
import logging
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from fesd_robot.contact import ContactMode
from fesd_robot.errors import DimensionError, FesdRobotError
from fesd_robot.instants import SAME_EVENT
from fesd_robot.render.animation import sample_motion
from fesd_robot.render.circles import BoxVisual, CircleVisual, add_circles
from fesd_robot.render.floor import add_floor, floor_below, tick_labels
from fesd_robot.render.follow import followed
from fesd_robot.render.marks import Mark, add_marks, corners
from fesd_robot.render.meshes import Meshes
from fesd_robot.render.palette import BLACK, GREEN, GREY, MODES, series_color
from fesd_robot.render.scene import add_animation, add_robot, add_traces, view_box
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.render.verdict import Verdict
from fesd_robot.render.window import SceneWindow
from fesd_robot.writing import write_atomically

logger = logging.getLogger(__name__)

LARGE_PAGE = 25e6
"""Bytes above which a page is slow to open and send; a warning says so."""

LARGEST = 1e9
"""m, rad or s; what is larger cannot be drawn in the single precision of a page."""

SHOWN_MARKS = 12
"""Marks of a group that are shown at first; more would hide the robot."""

VIEWER = Path(__file__).parent / "meshcat" / "viewer"
"""Meshcat's viewer, with its licences."""

SCRIPTS = ("scene", "camera", "labels", "contacts", "controls", "timeline", "plot", "player", "page")
"""Parts of the page's script, in their order; they share one scope."""


@dataclass(frozen=True)
class Ghost:
    """Another motion to compare with, drawn transparent.

    Args:
        name: of the motion.
        model: its robot.
        visual_model: the shapes of that robot.
        time: s, non-decreasing, shape (n,); its first sample is shown with the first one of the page.
        configuration: shape (n, nq), m and rad.
    """

    name: str
    model: pin.Model
    visual_model: pin.GeometryModel
    time: np.ndarray
    configuration: np.ndarray


@dataclass(frozen=True)
class PageContent:
    """Content of a page: a robot in motion, the ground and paths.

    Args:
        title: heading of the page.
        model: the robot.
        visual_model: its shapes and colours.
        time: s, non-decreasing, shape (n,); of samples at the same time only the first is shown.
        configuration: shape (n, nq), m and rad.
        ground: the ground to draw, with its walls.
        traces: name -> path to draw as a line, e.g. of a foot, m, shape (n, 3).
        circles: name -> circle of the robot to draw, e.g. of a wheel.
        subtitle: a line below the title, e.g. the status of the plan.
        facts: what the motion does, shown as a small table below: of what, and in words.
        goal: rows of the table of what the goal lists: name, goal, end, missed by.
        verdict: whether the motion is a solved plan, and a sentence about it.
        story: contacts, events, controls and curves of a plan, from `fesd_robot.render.story`.
        planar: the robot moves in the x-z plane, so that it is seen from the side.
        ghost: another configuration, in which the robot is drawn transparent, (nq), or another motion.
        marks: named things in the world, beside a robot that stands still.
    """

    title: str
    model: pin.Model
    visual_model: pin.GeometryModel
    time: np.ndarray
    configuration: np.ndarray
    ground: GroundVisual
    traces: Mapping[str, np.ndarray]
    circles: Mapping[str, CircleVisual | BoxVisual] = field(default_factory=dict)
    subtitle: str = ""
    facts: Sequence[tuple[str, str]] = ()
    goal: Sequence[tuple[str, str, str, str]] = ()
    verdict: Verdict | None = None
    story: Mapping[str, Any] | None = None
    planar: bool = True
    ghost: np.ndarray | Ghost | None = None
    marks: Sequence[Mark] = ()


def render_page(path: str | os.PathLike[str], content: PageContent) -> Path:
    """Write a page that plays a motion.

    The motion passes through every sample at its own time; samples may be spaced unevenly.

    Args:
        path: the HTML file to write; replaced in one step if it exists.
        content: what to show.

    Returns:
        `path`.

    Raises:
        DimensionError: an array has the wrong shape.
        FesdRobotError: time decreases, or a value is not finite.
    """
    model, visual_model, ground = content.model, content.visual_model, content.ground
    time = np.asarray(content.time, dtype=float)
    configuration = np.asarray(content.configuration, dtype=float)
    paths = {name: np.asarray(points, dtype=float) for name, points in content.traces.items()}
    _check(model, time, configuration, paths)
    time = np.maximum.accumulate(time)

    motion = sample_motion(model, visual_model, time, configuration)
    other = _ghost(content)
    ghost = other and sample_motion(other.model, other.visual_model, other.time, other.configuration)
    around = [corners(content.marks)] if content.marks else []
    ground = ground.below([motion.box, *([ghost.box] if ghost else []), *paths.values(), *around])
    box = view_box([motion, *([ghost] if ghost else [])], [*paths.values(), *around], ground)
    floor = floor_below(box)
    if not visual_model.ngeoms:
        logger.warning("%s: %r has no visual geometry, the page shows no robot", Path(path).name, model.name)
    window = SceneWindow()
    size = motion.size if np.isfinite(motion.size) else 1.0
    thickness = 0.0013 * float(np.linalg.norm(box[1] - box[0]))
    add_floor(window, ground, floor, top=float(box[1, 2]))
    add_traces(window, paths, radius=min(thickness, 0.005 * size))
    add_circles(window, model, configuration[0], content.circles, thickness)
    meshes = Meshes(motion.size)
    clips = add_robot(window, model, visual_model, motion, meshes)
    if other and ghost:
        clips |= add_robot(window, other.model, other.visual_model, ghost, meshes, root="ghost")
    add_animation(window, clips)

    settings: dict[str, object] = {
        "start": float(time[0]),
        "duration": max(float(motion.time[-1]), float(ghost.time[-1]) if ghost else 0.0),
        "box": box.tolist(),
        "size": size,
        "planar": content.planar,
        "follow": followed(motion, ground),
        "ticks": tick_labels(ground, floor),
        "labels": add_marks(window, content.marks, meshes, size),
        "story": content.story,
        "modes": {**MODES, ContactMode.FLIGHT: GREY},
        "colors": {"force": BLACK, "cone": GREEN},
    }
    page = _fill(
        title=html.escape(content.title),
        badge=_badge(content.verdict),
        subtitle=html.escape(content.verdict.sentence if content.verdict else content.subtitle),
        goal=_goal(content.goal),
        facts=_facts(content.facts),
        legend=_legend(content, list(paths), floor.spacing),
        groups=_groups(content.marks, ghost is not None),
        settings=json.dumps(settings, separators=(",", ":")),
        scene=base64.b64encode(gzip.compress(window.payload(), compresslevel=6, mtime=0)).decode("ascii"),
    )
    encoded = page.encode("utf-8")
    if len(encoded) > LARGE_PAGE:
        logger.warning(
            "%s: %.0f MB is a large page; simpler meshes or fewer samples make it smaller",
            Path(path).name,
            len(encoded) / 1e6,
        )
    return write_atomically(Path(path), encoded)


def _check(model: pin.Model, time: np.ndarray, configuration: np.ndarray, traces: Mapping[str, np.ndarray]) -> None:
    """Raise unless all arrays fit the model and each other."""
    if time.ndim != 1 or time.size == 0:
        raise DimensionError(f"time has shape {time.shape}, expected (n,) with n >= 1")
    count = time.size
    if configuration.shape != (count, model.nq):
        raise DimensionError(
            f"configuration has shape {configuration.shape}, expected {(count, model.nq)}: one row per entry of time, "
            f"one column per configuration coordinate of {model.name!r}"
        )
    for name, points in traces.items():
        if points.shape != (count, 3):
            raise DimensionError(f"trace {name!r} has shape {points.shape}, expected {(count, 3)}")
    for name, array in {"time": time, "configuration": configuration, **traces}.items():
        drawable = np.abs(array) <= LARGEST
        if not drawable.all():
            row = int(np.argwhere(~drawable)[0][0])
            raise FesdRobotError(f"{name} has a value in row {row} that is not finite, or too large to be drawn")
    if (np.diff(time) < -SAME_EVENT).any():
        row = int(np.flatnonzero(np.diff(time) < -SAME_EVENT)[0])
        raise FesdRobotError(f"time decreases from {time[row]} to {time[row + 1]} s at row {row + 1}")


def _facts(facts: Sequence[tuple[str, str]]) -> str:
    """Return the rows of the table of the motion."""
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(words)}</td></tr>" for name, words in facts)


def _ghost(content: PageContent) -> Ghost | None:
    """Return the transparent ghost as a motion; a configuration stands still."""
    if content.ghost is None or isinstance(content.ghost, Ghost):
        return content.ghost
    still = np.asarray(content.ghost, dtype=float)[None, :]
    return Ghost("goal", content.model, content.visual_model, np.zeros(1), still)


def _badge(verdict: Verdict | None) -> str:
    """Return the badge of a plan, green or red."""
    if verdict is None:
        return ""
    kind = "solved" if verdict.solved else "unsolved"
    return f'<span id="badge" class="{kind}">{html.escape(verdict.badge)}</span>'


def _goal(rows: Sequence[tuple[str, str, str, str]]) -> str:
    """Return the table of the goal."""
    if not rows:
        return ""
    header = "<tr><th></th><th>goal</th><th>end</th><th>missed by</th></tr>"
    cells = ("".join(f"<td>{html.escape(cell)}</td>" for cell in row[1:]) for row in rows)
    body = "".join(f"<tr><th>{html.escape(row[0])}</th>{cell}</tr>" for row, cell in zip(rows, cells, strict=True))
    return f'<table id="goal"><thead>{header}</thead><tbody>{body}</tbody></table>'


def _legend(content: PageContent, names: list[str], spacing: float) -> str:
    """Return the list entries that explain the coloured paths, modes and arrows, the grid and the ghost."""
    colors = [(f"path of {name}", series_color(index)) for index, name in enumerate(names)]
    if content.story is not None:
        shown = {span[0] for row in content.story["rows"] for span in row["spans"]}
        modes = [ContactMode.FLIGHT, ContactMode.STICK, ContactMode.SLIP]
        modes += [ContactMode.TOUCH] if ContactMode.TOUCH in shown else []
        colors += [(str(mode), MODES[mode]) for mode in modes]
        colors += [("force", BLACK), ("friction cone", GREEN), ("impulse", MODES[ContactMode.IMPACT])]
    entries = [f'<li><i style="background:{color}"></i>{html.escape(name)}</li>' for name, color in colors]
    entries += [f"<li>transparent: {html.escape(content.ghost.name)}</li>"] if isinstance(content.ghost, Ghost) else []
    return "".join([*entries, f"<li>grid {spacing:g} m</li>"])


def _groups(marks: Sequence[Mark], has_ghost: bool) -> str:
    """Return a switch for every group of marks; those of many marks are hidden at first."""
    counts = Counter(mark.group for mark in marks)
    switches = [(group, f"{group} ({count})", count <= SHOWN_MARKS) for group, count in counts.items()]
    switches += [("ghost", "ghost", True)] if has_ghost else []
    return "".join(
        f'<label><input type="checkbox" data-group="{html.escape(group)}"{" checked" if shown else ""}> '
        f"{html.escape(text)}</label>"
        for group, text, shown in switches
    )


def _fill(**values: str) -> str:
    """Return the page with its viewer, style and the given values in place."""
    here = resources.files("fesd_robot.render") / "viewer"
    texts = [file.read_text(encoding="utf-8") for file in sorted(VIEWER.glob("*LICENSE*"))]
    texts.append("uPlot\n" + (here / "uplot" / "LICENSE").read_text(encoding="utf-8"))
    bundles = [VIEWER / "main.min.js", here / "uplot" / "uPlot.iife.min.js"]
    styles = [here / "uplot" / "uPlot.min.css", here / "page.css"]
    values = {
        **values,
        # JSON and JavaScript strings may spell these characters so that no text can end the script element.
        "settings": values["settings"].replace("<", "\\u003c"),
        "bundle": "\n".join(file.read_text(encoding="utf-8") for file in bundles).replace("</script", "<\\/script"),
        "licences": "\n".join(texts).replace("</", "< /"),
        "style": "\n".join(file.read_text(encoding="utf-8").strip() for file in styles),
        "viewer": "\n".join((here / f"{name}.js").read_text(encoding="utf-8").strip() for name in SCRIPTS),
    }
    template = (here / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: values[match.group(1)], template)
