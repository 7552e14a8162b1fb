"""References through waypoints and from files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.task import Task

Load = Callable[[str], Task]

THROUGH = """\
waypoints:
  - {time: 0.25, configuration: {leg: 0.3}}
  - {time: 0.5, configuration: {leg: 0.4, root_z: 0.9}}
reference: {type: waypoints}
"""


def test_splines_through_the_waypoints(short: str, load: Load) -> None:
    """The spline passes start, waypoints and goal, starts and ends at rest, and is smooth in between."""
    motion = formulate(load(short + THROUGH))
    at, speed = motion.reference.configuration, motion.reference.velocity
    np.testing.assert_allclose(at(0), [0, 0.6, 0, 0.5], atol=1e-12)
    assert at(0.25)[3] == pytest.approx(0.3) and at(0.5)[[1, 3]] == pytest.approx([0.9, 0.4])
    np.testing.assert_allclose(at(1), [1, 0.6, 0, 0.5], atol=1e-12)
    np.testing.assert_allclose([speed(0), speed(1)], 0, atol=1e-4)
    assert at(0.3)[0] == pytest.approx(0.3**2 * (3 - 2 * 0.3))  # the cubic from rest to rest
    for time in (0.1, 0.25, 0.5, 0.8):
        rate = (at(time + 1e-5) - at(time - 1e-5)) / 2e-5
        np.testing.assert_allclose(speed(time), rate, atol=1e-3)
    np.testing.assert_allclose(motion.ocp.parameters[3, :2], [0.3, 0.4])


def test_splines_stay_within_the_limits(short: str, load: Load) -> None:
    """Where a spline would swing beyond a limit the reference stays on it."""
    motion = formulate(load(short + THROUGH.replace("leg: 0.4", "leg: 0.5").replace("leg: 0.3", "leg: 0.1")))
    legs = [motion.reference.configuration(time)[3] for time in np.linspace(0, 1, 101)]
    assert min(legs) == 0.1 and max(legs) == 0.5


CSV = "time [s],leg [m],root_x [m],leg [N],root_pitch [rad],root_z [m],mode\n"
ROWS = "0,0.5,0,7,0,0.6,flight\n0.5,0.3,1,7,0.2,0.8,flight\n0.5,0.3,1,7,0.2,0.8,impact\n"


def with_file(short: str, tmp_path: Path, content: str, more: str = "") -> str:
    (tmp_path / "motion.csv").write_text(content, encoding="utf-8")
    return short + f"reference: {{type: file, path: motion.csv{more}}}\n"


def test_a_file_is_resampled(short: str, load: Load, tmp_path: Path) -> None:
    """Columns are found by name, rows are joined by lines, and the last one holds, or the file is stretched."""
    text = with_file(short, tmp_path, CSV + ROWS)
    motion = formulate(load(text))
    at = motion.reference.configuration
    np.testing.assert_allclose(at(0.25), [0.5, 0.7, 0.1, 0.4], atol=1e-12)
    np.testing.assert_allclose(at(0.9), [1, 0.8, 0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(motion.reference.velocity(0.1), [2, 0.4, 0.4, -0.4], atol=1e-6)
    np.testing.assert_allclose(motion.ocp.parameters[0], [0.5, 1, 1, 1])
    stretched = formulate(load(with_file(short, tmp_path, CSV + ROWS, ", stretch: true")))
    np.testing.assert_allclose(stretched.ocp.parameters[0], [0.25, 0.5, 0.75, 1])


ERRORS = [
    (CSV.replace("leg [m],", "knee [m],").replace("leg [N]", "k") + ROWS, "no column 'leg'"),
    (CSV.replace("time", "tme") + ROWS, "did you mean 'tme'?"),
    (CSV, "found no rows"),
    (CSV + ROWS.replace("0.8", "high"), "not finite"),
    (CSV + ROWS.replace("\n0.5", "\n-0.5", 1), "times that decrease"),
    (CSV + "1,2\n", "row 2 has 2 values for 7 columns"),
]


@pytest.mark.parametrize(("content", "fragment"), ERRORS, ids=[error[1] for error in ERRORS])
def test_files_that_are_no_reference(short: str, load: Load, tmp_path: Path, content: str, fragment: str) -> None:
    """What a file lacks is reported at the line of its path."""
    with pytest.raises(TaskError) as caught:
        formulate(load(with_file(short, tmp_path, content)))
    assert (caught.value.line, caught.value.key) == (11, "reference.path"), caught.value
    assert fragment in caught.value.message


def test_a_missing_file(short: str, load: Load, tmp_path: Path) -> None:
    """A path without a file, or a folder without a plan, is an error at its line."""
    for path, fragment in (("lost.csv", "there is no file"), (".", "cannot be read as a motion")):
        with pytest.raises(TaskError, match=fragment) as caught:
            formulate(load(f"{short}reference: {{type: file, path: {path}}}\n"))
        assert caught.value.key == "reference.path"
