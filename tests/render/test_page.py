"""The page as a file: self-contained, small, reproducible, and honest about what it cannot draw."""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.contact import Plane
from fesd_robot.errors import DimensionError, FesdRobotError
from fesd_robot.render import GroundVisual, PageContent, render_page
from fesd_robot.render import page as page_module
from fesd_robot.render.animation import key_samples, sample_motion

from . import browser as browser_module
from .conftest import Hop


def content(hop: Hop, **changes: Any) -> PageContent:
    """Return the content of a valid page, some of it changed."""
    known: dict[str, Any] = {
        "title": "hop",
        "model": hop.model,
        "visual_model": hop.visual_model,
        "time": hop.time,
        "configuration": hop.configuration,
        "ground": GroundVisual(),
        "traces": {"foot": hop.foot},
    }
    return PageContent(**{**known, **changes})


def test_page_is_small_and_self_contained(hop: Hop, tmp_path: Path) -> None:
    """The file is below 5 MB and refers to nothing outside itself."""
    path = render_page(tmp_path / "new" / "plan.html", content(hop))
    assert path == tmp_path / "new" / "plan.html"
    assert path.stat().st_size < 5e6
    text = path.read_text(encoding="utf-8")
    loads = re.findall(
        r"(?:\bsrc|\bhref|\baction)\s*=\s*[\"']?([^\"'\s>]+)|@import|url\(([^)]*)\)", text.split("<body>")[0]
    )
    assert [load for load in loads if not load[0].startswith("data:")] == []
    assert not re.search(r"(?:src|href|url|fetch|import)\s*[=(]\s*[\"'`]https?:", text)
    assert list(path.parent.iterdir()) == [path]


def test_page_carries_the_licences_of_its_viewer(hop: Hop, tmp_path: Path) -> None:
    """The notices that the viewer's licence asks for travel with it."""
    text = render_page(tmp_path / "plan.html", content(hop)).read_text(encoding="utf-8")
    assert "Permission is hereby granted, free of charge" in text
    assert "Three.js Authors" in text


def test_page_is_reproducible(hop: Hop, tmp_path: Path) -> None:
    """The same motion gives the same bytes."""
    first = render_page(tmp_path / "a.html", content(hop)).read_bytes()
    assert render_page(tmp_path / "b.html", content(hop)).read_bytes() == first


def test_title_is_text(hop: Hop, tmp_path: Path) -> None:
    """Markup in titles and trace names is shown, not obeyed."""
    evil = "<script>alert(1)</script>"
    changed = content(hop, title=evil, subtitle=evil, facts=[(evil, evil)], traces={evil: hop.foot})
    assert evil not in render_page(tmp_path / "plan.html", changed).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "wrong", "message"),
    [
        ("time", np.zeros((3, 1)), r"time has shape \(3, 1\)"),
        ("time", np.zeros(0), r"time has shape \(0,\)"),
        ("configuration", np.zeros((5, 4)), r"configuration has shape \(5, 4\), expected \(164, 4\)"),
        ("configuration", np.zeros((164, 3)), r"configuration has shape \(164, 3\), expected \(164, 4\)"),
        ("traces", {"toe": np.zeros((164, 2))}, r"trace 'toe' has shape \(164, 2\), expected \(164, 3\)"),
    ],
)
def test_wrong_shapes_are_named(hop: Hop, tmp_path: Path, name: str, wrong: Any, message: str) -> None:
    """A wrong shape is an error that says which, what and what instead; nothing is written."""
    with pytest.raises(DimensionError, match=message):
        render_page(tmp_path / "plan.html", content(hop, **{name: wrong}))
    assert not list(tmp_path.iterdir())


def test_values_that_cannot_be_shown_are_named(hop: Hop, tmp_path: Path) -> None:
    """NaN and a clock that runs backwards are errors with the row; rounding noise of the clock is not."""
    broken = hop.configuration.copy()
    broken[7, 1] = np.nan
    with pytest.raises(FesdRobotError, match="configuration has a value in row 7 that is not finite"):
        render_page(tmp_path / "plan.html", content(hop, configuration=broken))
    with pytest.raises(FesdRobotError, match="time decreases from"):
        render_page(tmp_path / "plan.html", content(hop, time=hop.time[::-1]))
    noisy = hop.time.copy()
    noisy[41] -= 1e-10
    render_page(tmp_path / "plan.html", content(hop, time=noisy))


def test_key_times_increase_strictly() -> None:
    """Both sides of an impact become one key, also when they differ by less than single precision."""
    time = np.array([5.0, 5.1, 5.1, 5.1 + 1e-12, 5.3])
    assert key_samples(time).tolist() == [0, 1, 4]
    assert key_samples(np.array([2.0])).tolist() == [0]


def test_quaternions_do_not_flip(tmp_path: Path) -> None:
    """A rotation by many turns never changes the sign of its quaternion between neighbours."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "wheel")
    time = np.linspace(0.0, 1.0, 200)
    motion = sample_motion(model, pin.GeometryModel(), time, (25.0 * time)[:, None])
    quaternion = motion.placement[:, 1, 3:]
    assert (np.einsum("ij,ij->i", quaternion[1:], quaternion[:-1]) > 0.9).all()


def test_large_page_warns(
    hop: Hop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Above the limit the log says how large the page is and what makes it smaller."""
    assert page_module.LARGE_PAGE == 25e6
    monkeypatch.setattr(page_module, "LARGE_PAGE", 1e5)
    with caplog.at_level(logging.WARNING):
        render_page(tmp_path / "plan.html", content(hop))
    assert "simpler meshes or fewer samples" in caplog.text


def test_robot_without_shapes_warns(hop: Hop, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A page without a visible robot says so in the log."""
    with caplog.at_level(logging.WARNING):
        render_page(tmp_path / "plan.html", content(hop, visual_model=pin.GeometryModel()))
    assert "shows no robot" in caplog.text


def test_ground_is_a_plane_that_rises_along_x() -> None:
    """z = height + tan(slope) x, and the frame's third axis is the normal."""
    ground = GroundVisual(Plane(0.2, np.pi / 4))
    assert ground.elevation(3.0) == pytest.approx(3.2)
    frame = ground.frame(3.0, 1.0)
    np.testing.assert_allclose(frame[:3, 3], [3.0, 1.0, 3.2])
    np.testing.assert_allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(frame[:3, 2], [-np.sqrt(0.5), 0.0, np.sqrt(0.5)])


@pytest.mark.parametrize(("required", "outcome"), [("", pytest.skip.Exception), ("1", pytest.fail.Exception)])
def test_without_a_browser(monkeypatch: pytest.MonkeyPatch, required: str, outcome: type[BaseException]) -> None:
    """Tests of pages are skipped, or fail where a browser is required."""
    monkeypatch.setattr(browser_module.shutil, "which", lambda name: None)
    monkeypatch.setenv(browser_module.REQUIRED, required)
    with pytest.raises(outcome, match="Chromium not found"):
        browser_module.chromium()
