"""Half of a cycle: the end is the mirror image of the beginning, shifted by one stride."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.explanation.warnings import task_warnings
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.planning.planner import plan
from fesd_robot.task import Task, load_task

from .cart import cart

MODEL = Path(__file__).parents[2] / "models" / "biped" / "biped.urdf"

WALK = """\
name: walk
robot: {model: MODEL, root: sagittal}
ground: {friction: 0.5}
contacts:
  left: {frame: left_foot}
  right: {frame: right_foot}
horizon: {duration: 0.6, intervals: 6}
initial:
  stand_on: [left, right]
  configuration: {left_hip: -0.45, left_knee: 0.4, right_hip: 0.1, right_knee: 0.3}
  velocity: {root_x: 0.5, left_knee: 0.25}
goal:
  periodic:
    mirror: {left_hip: right_hip, left_knee: right_knee}
    stride: {root_x: 0.3}
"""


def walk(folder: Path, old: str = "", new: str = "") -> Task:
    """The task of a walking biped with one change."""
    path = folder / "walk.yaml"
    path.write_text(WALK.replace(old, new).replace("MODEL", str(MODEL)), encoding="utf-8")
    return load_task(path, ["method.grid=uniform"])


def rows_of_period(motion: MotionProblem, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the rows of the period at two states."""
    period = motion.ocp.constraints[-1]
    return np.asarray(ca.Function("rows", [period.variables], [period.rows])(np.append(start, end))).ravel()


SWAPPED = [0, 1, 2, 5, 6, 3, 4]
"""Numbers of the biped's coordinates, left and right leg swapped."""


def test_the_end_is_the_swapped_start_one_stride_further(tmp_path: Path) -> None:
    """Positions and velocities of the legs change places, the root stays or takes its stride; nothing else ends so."""
    motion = formulate(walk(tmp_path))
    generator, n = np.random.default_rng(0), motion.ocp.system.state.numel()
    start = generator.normal(size=n)
    q, v = start[:7], start[7:14]
    start[15:] = numeric_physics(motion).gaps(q)  # the integrated gaps of a free start are the true ones
    end = np.concatenate([q[SWAPPED] + 0.3 * np.eye(7)[0], v[SWAPPED], start[14:]])
    np.testing.assert_allclose(rows_of_period(motion, start, end), 0, atol=1e-9)
    for k in range(14):
        changed = end + 0.1 * np.eye(n)[k]
        assert np.abs(rows_of_period(motion, start, changed)).max() == pytest.approx(0.1)


def test_feet_of_mirrored_states_change_places(tmp_path: Path) -> None:
    """Which foot touches follows from the configuration: the left gap after half a cycle is the right one before."""
    motion = formulate(walk(tmp_path))
    physics = numeric_physics(motion)
    for q in np.random.default_rng(1).normal(size=(5, 7)):
        np.testing.assert_allclose(physics.gaps(q)[::-1], physics.gaps(q[SWAPPED] + 0.3 * np.eye(7)[0]), atol=1e-12)


def test_the_reference_leads_to_the_mirrored_start(tmp_path: Path) -> None:
    """The line from which the solver starts ends in the mirror image, also in velocity, not in the start itself."""
    ends = formulate(walk(tmp_path)).endpoints
    np.testing.assert_allclose(ends.goal_configuration - ends.initial_configuration[SWAPPED], 0.3 * np.eye(7)[0])
    np.testing.assert_allclose(ends.goal_velocity, ends.initial_velocity[SWAPPED])
    assert ends.initial_velocity.tolist() == [0.5, 0, 0, 0, 0.25, 0, 0]


def test_a_swing_is_half_of_an_oscillation(tmp_path: Path) -> None:
    """A cart mirrored with its own negative, 0.5 m away in between, ends on the other side with the opposite velocity.

    What follows is the mirror image, so that the waypoint at T / 2 is at -0.5 m one half cycle later.
    """
    text = (
        "horizon: {duration: 2, intervals: 4}\ngoal: {periodic: {mirror: {x: -x}}}\n"
        "waypoints: [{configuration: {x: 0.5}, tolerance: {configuration: {x: 0}}}]\n"
        "costs: {configuration: {}, velocity: {}, control: {x: 1}}\n"
    )
    swing = plan(cart(tmp_path, text))
    assert swing.status.solved, swing.status.message
    x, v = swing.trajectory.configuration["x"], swing.trajectory.velocity["x"]
    assert x[-1] == pytest.approx(-x[0], abs=1e-6) and v[-1] == pytest.approx(-v[0], abs=1e-6)
    assert np.interp(1.0, swing.trajectory.time, x) == pytest.approx(0.5, abs=1e-6)
    assert abs(v[0]) > 0.1 and swing.outcome is not None
    assert [entry.name for entry in swing.outcome.goal] == ["x, mirrored", "x velocity, mirrored"]
    assert all(entry.met for entry in swing.outcome.goal)


def test_a_mirror_that_is_no_symmetry_is_a_warning(tmp_path: Path) -> None:
    """Swapping hips without their knees is another robot, whose second half cycle is not the mirror of the first."""
    assert not [one for one in task_warnings(formulate(walk(tmp_path))) if "mirror" in one]
    broken = walk(tmp_path, ", left_knee: right_knee", "")
    (warning,) = [one for one in task_warnings(formulate(broken)) if "mirror" in one]
    assert warning.startswith("goal.periodic.mirror is no symmetry of this robot: ")


MIRROR = "{left_hip: right_hip, left_knee: right_knee}"

# (mirror in place of that of the task, key below it, fragment)
ERRORS = [
    ("{left_hip: right_hp}", ".left_hip", "found 'right_hp', expected a configuration coordinate (did you mean"),
    ("{lef_hip: -right_hip}", ".lef_hip", "found 'lef_hip', expected a configuration coordinate"),
    ("{left_hip: right_hip, right_hip: left_hip}", ".right_hip", "found 'right_hip' twice, expected every coordinate"),
    ("{left_hip: right_hip, left_knee: right_hip}", ".left_knee", "found 'right_hip' twice"),
    ("{left_hip: left_hip}", ".left_hip", "found 'left_hip' mirrored with itself, expected another coordinate, or"),
    ('{left_hip: "-"}', ".left_hip", "expected the name of a coordinate behind the '-'"),
    ("{root_z: root_x}", ".root_z", "found 'root_x', which has a stride"),
    ("{root_z: left_hip}", ".root_z", "found 'root_z' in m mirrored with 'left_hip' in rad, expected two lengths"),
]


@pytest.mark.parametrize(("mirror", "key", "fragment"), ERRORS, ids=[error[0] for error in ERRORS])
def test_what_a_mirror_cannot_be(tmp_path: Path, mirror: str, key: str, fragment: str) -> None:
    """Names that do not exist, coordinates twice and units that differ are errors at the line of the mirror."""
    with pytest.raises(TaskError) as caught:
        formulate(walk(tmp_path, MIRROR, mirror))
    assert caught.value.key == f"goal.periodic.mirror{key}" and caught.value.line == 14, caught.value
    assert fragment in caught.value.message
