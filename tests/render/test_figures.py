"""The figures: what is drawn is what the plan says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import StepPatch
from PIL import Image

from fesd_robot.errors import DimensionError
from fesd_robot.plans.plan import Plan
from fesd_robot.render import build_figures, write_figures
from fesd_robot.render.timeline import mode_spans

from .conftest import FRICTION, NAMES

FIGURES = ["positions", "velocities", "controls", "contacts", "friction_cones", "contact_timeline"]


def drawn(panel: Axes) -> tuple[np.ndarray, np.ndarray]:
    """Return time and values of the first line of a panel, without the gaps at jumps."""
    time, values = (np.asarray(array, dtype=float) for array in panel.lines[0].get_data())
    return time[np.isfinite(time)], values[np.isfinite(values)]


def cones(panel: Axes) -> list[PolyCollection]:
    """Return the areas in a panel in front of its shading."""
    return [area for area in panel.collections if isinstance(area, PolyCollection) and area.get_zorder() >= 0]


def changed(plan: Plan, part: str, **fields: Any) -> Plan:
    """Return the plan with some fields of one of its parts changed."""
    return plan.model_copy(update={part: getattr(plan, part).model_copy(update=fields)})


def test_every_figure_is_written(plan: Plan, tmp_path: Path) -> None:
    """PNG files of a size that a report can show, not blank, and no other file."""
    paths = write_figures(plan, tmp_path / "figures")
    assert paths == [tmp_path / "figures" / f"{name}.png" for name in FIGURES]
    assert sorted((tmp_path / "figures").iterdir()) == sorted(paths)
    for path in paths:
        with Image.open(path) as picture:
            assert picture.format == "PNG"
            assert 1000 < picture.width < 2000 and 200 < picture.height < 2000
            assert np.asarray(picture.convert("L")).std() > 5


@pytest.mark.parametrize(("figure", "part"), [("positions", "configuration"), ("velocities", "velocity")])
def test_coordinates_are_the_plans(plan: Plan, figure: str, part: str) -> None:
    """One panel per coordinate with its name, unit and data."""
    panels = build_figures(plan)[figure].axes
    series, units = getattr(plan.trajectory, part), getattr(plan.units, part)
    assert [panel.get_title(loc="left") for panel in panels] == [f"{name} ({units[name]})" for name in NAMES]
    for panel, values in zip(panels, series.values(), strict=True):
        np.testing.assert_array_equal(drawn(panel), (plan.trajectory.time, values))


def test_velocity_jumps_are_parted(plan: Plan) -> None:
    """At an impact the line stops before and starts again after; a dotted line joins the two."""
    panel = build_figures(plan)["velocities"].axes[0]
    assert np.isnan(panel.lines[0].get_ydata()).sum() == 3
    dotted = next(lines for lines in panel.collections if isinstance(lines, LineCollection) and lines.get_zorder() > 0)
    ((start, end), *_) = [segment[:, 1] for segment in dotted.get_segments()]
    touchdown = int(np.flatnonzero(np.diff(plan.trajectory.time) == 0)[0])
    velocity = plan.trajectory.velocity["root_x"]
    assert (start, end) == (velocity[touchdown], velocity[touchdown + 1])


def test_controls_are_steps(plan: Plan) -> None:
    """Each control holds over its interval; the last interval ends with the trajectory."""
    for panel, name in zip(build_figures(plan)["controls"].axes, ("reaction_torque", "leg_force"), strict=True):
        (steps,) = [patch for patch in panel.patches if isinstance(patch, StepPatch)]
        values, edges, _ = steps.get_data()
        np.testing.assert_array_equal(values, plan.controls[name])
        np.testing.assert_array_equal(edges, [*plan.controls["time"], plan.trajectory.time[-1]])


@pytest.mark.parametrize("own", [None, 0.3])
def test_forces_stand_in_their_cone(plan: Plan, own: float | None) -> None:
    """Gap and forces are the plan's; the cone is mu times the normal force, mu the contact's own or the ground's."""
    task = {"ground": {"friction": FRICTION}, "contacts": {"foot": {"friction": own}}}
    gap, normal, tangential = build_figures(plan.model_copy(update={"task": task}))["contacts"].axes
    contact = plan.contacts["foot"]
    np.testing.assert_array_equal(drawn(gap), (plan.trajectory.time, contact.gap))
    for panel, values in ((normal, contact.normal_force), (tangential, contact.tangential_force)):
        samples = set(zip(*drawn(panel), strict=True))
        assert set(zip(plan.trajectory.time, values, strict=True)) <= samples
    (cone,) = cones(tangential)
    limits = [path.vertices[:, 1] for path in cone.get_paths()]
    assert max(limit.max() for limit in limits) == pytest.approx((own or FRICTION) * contact.normal_force.max())
    assert min(limit.min() for limit in limits) == pytest.approx(-(own or FRICTION) * contact.normal_force.max())


def test_the_cone_of_a_wall(plan: Plan) -> None:
    """A contact that touches a wall has the wall's friction, not the ground's."""
    ground = {"friction": FRICTION, "walls": {"end": {"x": 1, "friction": 0.2}}}
    task = {"ground": ground, "contacts": {"foot": {"surface": "end", "friction": None}}}
    tangential = build_figures(plan.model_copy(update={"task": task}))["contacts"].axes[2]
    assert tangential.get_title(loc="right") == "µ = 0.2"


def test_no_friction_no_cone(plan: Plan) -> None:
    """A task that names no friction gives forces without a cone."""
    axes = build_figures(plan.model_copy(update={"task": {}}))["contacts"].axes
    assert not cones(axes[2])


def test_spans_of_one_mode_tile_the_time(plan: Plan) -> None:
    """Flight and stance follow each other without a gap, whatever the samples at the switches say."""
    expected = [("flight", 0.0, 0.5), ("stick", 0.5, 0.7), ("flight", 0.7, 1.2), ("stick", 1.2, 1.4)]
    modes = list(plan.contacts["foot"].mode)
    modes[40] = "impact"
    for mode in (plan.contacts["foot"].mode, modes):
        spans = mode_spans(plan.trajectory.time, mode)
        assert [span.mode for span in spans] == [mode for mode, _, _ in expected]
        np.testing.assert_allclose([span[1:] for span in spans], [entry[1:] for entry in expected])


def test_timeline_shows_impulses(plan: Plan) -> None:
    """Every impact has a tick at its time and its normal impulse beside it."""
    panel = build_figures(plan)["contact_timeline"].axes[0]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["foot"]
    assert [(text.get_text(), text.xy[0]) for text in panel.texts] == [("2.7", 0.5), ("2.9", 1.2)]


def test_only_what_there_is(plan: Plan) -> None:
    """A plan without contacts or controls has no empty figures, and one that failed says so."""
    bare = plan.model_copy(update={"contacts": {}, "controls": {}, "impulses": [], "switches": []})
    figures = build_figures(changed(bare, "status", solved=False))
    assert list(figures) == ["positions", "velocities"]
    assert "NOT SOLVED" in figures["positions"].get_suptitle()


def test_many_contacts_and_joints_fit(plan: Plan, tmp_path: Path) -> None:
    """Five contacts and nineteen coordinates give figures of moderate size with all panels."""
    coordinates = {f"joint_{index}": plan.trajectory.configuration["leg"] for index in range(19)}
    many = changed(plan, "trajectory", configuration=coordinates)
    many = many.model_copy(update={"contacts": {f"foot_{index}": plan.contacts["foot"] for index in range(5)}})
    figures = build_figures(many)
    assert len(figures["positions"].axes) == 19
    assert len(figures["contacts"].axes) == 15
    assert max(max(figure.get_size_inches()) for figure in figures.values()) < 14


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda p: changed(p, "trajectory", time=np.zeros((2, 2))), r"trajectory.time has shape \(2, 2\)"),
        (
            lambda p: changed(p, "trajectory", velocity={"leg": np.zeros(3)}),
            r"trajectory.velocity\['leg'\] has shape \(3,\), expected \(164,\) as trajectory.time",
        ),
        (
            lambda p: p.model_copy(update={"controls": {"time": np.zeros(4), "leg_force": np.zeros(5)}}),
            r"controls\['leg_force'\] has shape \(5,\), expected \(4,\) as controls\['time'\]",
        ),
        (
            lambda p: p.model_copy(
                update={"contacts": {"foot": p.contacts["foot"].model_copy(update={"mode": ["flight"]})}}
            ),
            r"contacts\['foot'\].mode has shape \(1,\), expected \(164,\)",
        ),
    ],
)
def test_wrong_lengths_are_named(plan: Plan, tmp_path: Path, wrong: Any, message: str) -> None:
    """A length that does not fit is an error that says which, what and what instead; nothing is written."""
    with pytest.raises(DimensionError, match=message):
        write_figures(wrong(plan), tmp_path / "figures")
    assert not (tmp_path / "figures").exists()
