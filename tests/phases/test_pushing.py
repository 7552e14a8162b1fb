"""Pushes of objects on a table: the place, the way and the guess, and the motion that is found from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Run
from fesd_robot.ocp import MotionProblem, formulate, gap_function
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.phases import PhaseSolver, Pushing, pushings
from fesd_robot.phases.pushing import _Arc
from fesd_robot.task import load_task

FINGER = Path(__file__).parents[2] / "models" / "finger" / "finger.urdf"
LIMITS = np.array([2.0, 2.0, 0.15])

TASK = f"""\
name: push
robot: {{model: {FINGER}}}
gravity: [0, 0, 0]
bodies:
  crate: {{type: box, size: [0.3, 0.1, 0.2], mass: 0.5, root: sagittal, limit_surface: {{force: 2, torque: 0.15}}}}
contacts:
  push: {{type: circle_box, frame: tip, radius: 0.02, other_frame: crate, friction: 0.3}}
horizon: {{duration: 1, intervals: 10}}
initial: {{configuration: {{tip_x: -0.3, tip_z: 0.1}}}}
goal:
  configuration: {{crate.root_x: X, crate.root_z: Z, crate.root_pitch: PITCH}}
  tolerance:
    configuration: {{tip_x: 1, tip_z: 1, crate.root_x: 0.01, crate.root_z: 0.01, crate.root_pitch: 0.05}}
    velocity: {{tip_x: 1, tip_z: 1}}
costs: {{configuration: {{}}, terminal_configuration: {{}}}}
"""
GOALS = [(0.2, 0.0, 0.0), (0.2, 0.0, 0.3), (0.0, 0.15, 0.0), (-0.1, 0.02, 0.2)]


def problem(folder: Path, goal: tuple[float, float, float]) -> MotionProblem:
    text = TASK
    for key, value in zip(("X", "Z", "PITCH"), goal, strict=True):
        text = text.replace(f": {key}", f": {value}")
    (folder / "push.yaml").write_text(text)
    return formulate(load_task(folder / "push.yaml"))


def only(motion: MotionProblem) -> Pushing:
    (found,) = pushings(motion)
    return found


@pytest.mark.parametrize("goal", GOALS, ids=str)
def test_the_finger_pushes_where_the_crate_needs_it(tmp_path: Path, goal: tuple[float, float, float]) -> None:
    """All along the push the finger touches, and its normal is along the friction that the crate has to overcome.

    That is F_k^2 v_k with the velocity of the guess, by the normality rule; the edges of a side leave a few degrees.
    """
    motion = problem(tmp_path, goal)
    pushing, gap = only(motion), gap_function(motion.dynamics, motion.contacts)
    normal = ca.Function("normal", [motion.dynamics.configuration], [ca.densify(motion.contacts[0].normal)])
    for time in (0.4, 0.6, 0.9):
        x = pushing.state(time)
        assert abs(float(gap(x[:5]))) < 2e-3
        given, needed = np.asarray(normal(x[:5])).ravel()[2:] / LIMITS, LIMITS * x[7:10]
        assert given @ needed / np.linalg.norm(given) / np.linalg.norm(needed) > 0.94
    assert pushing.state(1.0)[2:5] == pytest.approx(goal, abs=1e-9)


def test_the_approach_goes_round_the_crate(tmp_path: Path) -> None:
    """From above to below the finger leaves room, and keeps an even pace."""
    motion = problem(tmp_path, GOALS[2])
    pushing, gap = only(motion), gap_function(motion.dynamics, motion.contacts)
    states = np.array([pushing.state(time) for time in np.linspace(0, 0.34, 60)])
    assert min(float(gap(x[:5])) for x in states) > -1e-3
    steps = np.linalg.norm(np.diff(states[:, :2], axis=0), axis=1)
    assert steps.max() < 2.5 * np.median(steps)


def test_an_arc_has_one_velocity_in_the_axes_of_the_body() -> None:
    """Its ends are the poses, its velocity is the derivative of the pose, and turned back it is always the same."""
    begin, end = np.array([0.1, -0.2, 0.7]), np.array([0.5, 0.3, -0.4])
    arc, seen = _Arc.between(begin, end), []
    assert arc.pose(0.0) == pytest.approx(begin) and arc.pose(1.0) == pytest.approx(end)
    for part in (0.1, 0.5, 0.9):
        slope = (arc.pose(part + 1e-6) - arc.pose(part - 1e-6)) / 2e-6
        assert arc.velocity(part) == pytest.approx(slope, abs=1e-8)
        c, s = np.cos(arc.pose(part)[2]), np.sin(arc.pose(part)[2])
        vx, vz, rate = arc.velocity(part)
        seen.append([c * vx - s * vz, s * vx + c * vz, rate])
    assert np.ptp(seen, axis=0) == pytest.approx(0, abs=1e-12)


def test_what_stays_is_not_pushed(tmp_path: Path) -> None:
    """A crate that is at its goal, and one without a limit surface, need no push."""
    assert list(pushings(problem(tmp_path, (0.0, 0.0, 0.0)))) == []
    motion = problem(tmp_path, GOALS[0])
    assert (
        list(
            pushings(replace(motion, parts=replace(motion.parts, dynamics=replace(motion.dynamics, limit_surfaces={}))))
        )
        == []
    )


@pytest.mark.slow
def test_a_push_that_turns_is_found_from_its_guess(tmp_path: Path) -> None:
    """The finger comes to the crate, hits it, and turns it by 0.3 rad on its way: one sequence, exactly."""
    motion = problem(tmp_path, GOALS[1])
    solver = PhaseSolver(motion, Run(homotopy_options(motion.task)))
    pushing = only(motion)
    found = solver.from_guess(pushing.sequences[0], state=pushing.state)
    assert found is not None and str(found.sequence) == "FS !SL" and found.report.exact
