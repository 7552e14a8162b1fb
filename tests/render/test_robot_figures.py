"""Figures that need the robot of a plan, on a real plan: snapshots, limits, energy, centre of mass, and the GIF."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from fesd_robot import TaskError, render_plan
from fesd_robot.errors import FesdRobotError
from fesd_robot.plans import Plan, read_plan, task_of, write_plan
from fesd_robot.render import build_figures, write_figures
from fesd_robot.render.figures import Look, robot_motion, write_animation
from fesd_robot.render.figures.lines import edges_of, with_steps
from fesd_robot.render.figures.look import TEXT, WIDTHS, set_range
from fesd_robot.render.figures.robot_motion import RobotMotion
from fesd_robot.render.figures.snapshots import chosen_samples, few_places
from fesd_robot.render.outputs import write_drawings
from fesd_robot.render.palette import GREEN

NAMES = [
    *("snapshots", "positions", "velocities", "controls", "contacts"),
    *("friction_cones", "contact_timeline", "energy", "center_of_mass"),
]


@pytest.fixture(scope="module")
def robot(short_plan: Plan) -> RobotMotion:
    """The robot of the short plan."""
    return robot_motion(short_plan, task_of(short_plan))


@pytest.mark.parametrize("width", list(WIDTHS))
def test_figures_have_the_width_of_a_journal(short_plan: Plan, robot: RobotMotion, width: str) -> None:
    """All figures are as wide as asked for, no higher than a page, with type of 8 points or more inside of them."""
    figures = build_figures(short_plan, robot, Look(width=width))
    assert list(figures) == NAMES
    for name, figure in figures.items():
        inches = figure.get_size_inches()
        assert inches[0] == WIDTHS[width] and inches[1] < 9.5, name
        figure.canvas.draw()
        for text in shown_texts(figure):
            assert text.get_fontsize() >= TEXT
            if text.axes is None or text is text.axes.title:
                box = text.get_window_extent()
                assert box.x0 > -2 and box.x1 < figure.bbox.x1 + 2, (name, text.get_text())


def shown_texts(figure: Figure) -> list[Text]:
    """Return every text of a figure that says something."""
    return [each for each in figure.findobj(Text) if isinstance(each, Text) and each.get_visible() and each.get_text()]


def test_formats_are_those_asked_for(short_plan: Plan, tmp_path: Path) -> None:
    """Each figure is written in every format, with its own signature, the same bytes for the same plan."""
    look, names = Look(("svg", "pdf")), ("controls", "contacts", "friction_cones", "contact_timeline")
    trajectory = short_plan.trajectory.model_copy(update={"configuration": {}, "velocity": {}})
    few = short_plan.model_copy(update={"trajectory": trajectory})
    paths = write_figures(few, tmp_path, None, look)
    assert [path.name for path in paths] == [f"{name}.{kind}" for name in names for kind in look.formats]
    assert all(path.read_bytes()[:5] == {".svg": b"<?xml", ".pdf": b"%PDF-"}[path.suffix] for path in paths)
    again = write_figures(few, tmp_path / "again", None, Look(("svg",)))
    assert all(path.read_bytes() == (tmp_path / path.name).read_bytes() for path in again)


@pytest.mark.parametrize("look", [{"formats": ("tif",)}, {"formats": ()}, {"width": "three_columns"}])
def test_unknown_formats_are_refused(look: dict[str, object]) -> None:
    """The error names what there is."""
    with pytest.raises(FesdRobotError, match=r"expected one of (png, svg, pdf|one_column, two_columns)"):
        Look(**look)  # type: ignore[arg-type]


def test_an_override_chooses_formats(short_plan: Plan, tmp_path: Path) -> None:
    """`render_plan` takes keys of `output` and no others; a wrong value is refused with the right ones."""
    files = render_plan(short_plan, tmp_path, overrides=["output.figure_formats=[svg]", "output.animation=true"])
    assert {file.suffix for file in files[1:]} == {".svg", ".gif"}
    with pytest.raises(TaskError, match="'png', 'svg' or 'pdf'"):
        render_plan(short_plan, tmp_path, overrides=["output.figure_formats=[tif]"])
    with pytest.raises(TaskError, match="expected a key of 'output'"):
        render_plan(short_plan, tmp_path, overrides=["goal.soft=true"])


def test_snapshots_show_robot_and_ground(short_plan: Plan, robot: RobotMotion) -> None:
    """Start and end are among them; every panel has the robot's bodies, at one scale, with its foot where it is."""
    panels = build_figures(short_plan, robot)["snapshots"].axes
    assert len(panels) == 6
    assert [panel.get_title() for panel in panels][:: len(panels) - 1] == ["0 s", "0.2 s"]
    assert len({round(float(np.ptp(panel.get_xlim())), 9) for panel in panels}) == 1
    for panel in panels:
        bodies = [each for each in panel.collections if isinstance(each, PolyCollection) and each.get_zorder() == 2]
        assert len(bodies) == 1 and len(bodies[0].get_paths()) == len(robot.robot.visual_model.geometryObjects)
        width, height = panel.get_window_extent().size
        assert width / height == pytest.approx(np.ptp(panel.get_xlim()) / np.ptp(panel.get_ylim()), rel=0.02)


def test_moments_of_snapshots() -> None:
    """Start, end and events that are apart; else the middle of the longest time between."""
    time = np.linspace(0.0, 1.0, 101)
    assert len(chosen_samples(time, [0.3, 0.31], 4)) == 4 and not {30, 31} <= set(chosen_samples(time, [0.3, 0.31], 4))
    assert {0, 30, 80, 100} <= set(chosen_samples(time, [0.3, 0.8], 5))
    assert all(0.2 <= place <= 0.8 for place in few_places(0.0, 1.0)) and few_places(0.0, 1.0)


def test_energy_is_work_less_what_is_lost(short_plan: Plan, robot: RobotMotion) -> None:
    """What the controls put in is what the energy gains and friction takes: never less than nothing is taken."""
    time = short_plan.trajectory.time
    edges = edges_of(short_plan.controls["time"], [each.time for each in short_plan.switches])
    powers = [with_steps(time, values, edges, short_plan.statistics.stages or 1) for values in robot.power.values()]
    work = sum(float(np.sum(0.5 * (p[1:] + p[:-1]) * np.diff(t))) for t, p in powers)
    contact = short_plan.contacts["foot"]
    slip = np.gradient(np.array([robot.touching("foot", k)[0][0] for k in range(len(time))]), time)
    t, rub = with_steps(time, contact.tangential_force * slip, edges, 1)
    lost = -float(np.sum(0.5 * (rub[1:] + rub[:-1]) * np.diff(t)))
    gained = float(robot.energies["total"][-1] - robot.energies["total"][0])
    assert lost > 0 and gained + lost == pytest.approx(work, abs=0.02 * max(abs(work), lost) + 2e-3)


def test_goals_limits_and_reference_are_drawn(short_plan: Plan, robot: RobotMotion) -> None:
    """The goal is a sign at the end; a reference is drawn where leaving it costs; a far limit is written down."""
    figure = build_figures(short_plan, robot)["positions"]
    panel = figure.axes[0]
    assert short_plan.outcome is not None
    goal = short_plan.outcome.goal[0]
    signs = [line for line in panel.lines if line.get_marker() == "D"]
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in signs] == [(0.2, goal.goal)]
    legend = {text.get_text() for each in figure.legends for text in each.get_texts()}
    assert {"goal", "reference"} <= legend
    bounds = [float(robot.actuation.upper[i]) for i in range(2)]
    controls = build_figures(short_plan, robot)["controls"].axes
    for axis, bound in zip(controls, bounds, strict=True):
        drawn = any(abs(line.get_ydata()[0]) == bound for line in axis.lines)
        assert drawn or f"{bound:.3g}" in axis.get_title(loc="right")


def test_round_off_is_flat() -> None:
    """What differs by 1e-17 is drawn over a range that does not show it, about zero; real ranges are kept."""
    panel: Axes = Figure().subplots()
    set_range(panel, [np.array([0.0, 1e-17, -3e-17])], "m")
    low, high = panel.get_ylim()
    assert high - low >= 1e-2 and low == -high
    set_range(panel, [np.array([0.0, 3.0])], "m")
    assert panel.get_ylim() == pytest.approx((-0.21, 3.21))


def test_forces_step_where_controls_do() -> None:
    """The value behind an edge is that of the polynomial through the stages behind it; samples stay as they are."""
    time = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    values = np.array([1.0, 1.0, 1.0, 4.0, 5.0])
    stepped, forces = with_steps(time, values, np.array([1.0]), 2)
    np.testing.assert_allclose(stepped, [0.0, 0.5, 1.0, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(forces, [1.0, 1.0, 1.0, 3.0, 4.0, 5.0])
    _, held = with_steps(time, values, np.array([1.0]), 1)
    assert held[3] == 4.0


def test_the_animation_plays_in_real_time(robot: RobotMotion, tmp_path: Path) -> None:
    """A GIF whose frames last as long as the motion, and differ."""
    path = write_animation(robot, tmp_path)
    with Image.open(io.BytesIO(path.read_bytes())) as picture:
        assert picture.format == "GIF" and picture.n_frames >= 5
        lasting, frames = 0, []
        for number in range(picture.n_frames):
            picture.seek(number)
            lasting += picture.info["duration"] if number < picture.n_frames - 1 else 0
            frames.append(np.asarray(picture.convert("RGB"), dtype=float))
    assert lasting == pytest.approx(200, abs=20)
    assert np.abs(frames[0] - frames[-1]).max() > 50
    arrow = np.array([int(GREEN[k : k + 2], 16) for k in (1, 3, 5)])
    assert max(int((np.abs(frame - arrow).max(axis=2) < 30).sum()) for frame in frames) > 20, (
        "no green arrow of a force"
    )
    assert path.stat().st_size < 200_000


def test_a_robot_that_cannot_be_drawn_costs_its_figures_only(
    short_plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """An iterate with numbers that are none leaves the other figures, with a warning."""
    broken = {name: values + np.nan for name, values in short_plan.trajectory.velocity.items()}
    trajectory = short_plan.trajectory.model_copy(update={"velocity": broken})
    bad = short_plan.model_copy(update={"trajectory": trajectory})
    files = write_drawings(bad, task_of(short_plan), tmp_path)
    assert "left out: the trajectory is not finite" in caplog.text
    assert {file.stem for file in files} == set(NAMES) - {"snapshots", "energy", "center_of_mass"}


def test_an_earlier_plan_is_drawn_and_reported(short_plan: Plan, tmp_path: Path) -> None:
    """A plan file without what later versions write still has all its figures."""
    folder = write_plan(short_plan.model_copy(update={"outcome": None, "control_limits": None}), tmp_path / "old")
    file = folder / "plan.json"
    text = file.read_text(encoding="utf-8")
    for key in ("figure_formats", "figure_width", "animation"):
        assert key in text
    old = read_plan(folder)
    task = {**old.task, "output": {"page": True, "figures": True}}
    files = render_plan(old.model_copy(update={"task": task}), tmp_path / "drawn")
    assert [each.stem for each in files[1:]] == NAMES
