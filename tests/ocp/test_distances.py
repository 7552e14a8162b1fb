"""Distances of bodies as rows of the problem, against coal."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans.body_distances import BodyDistances
from fesd_robot.task import load_task
from fesd_robot.task.distances import DistanceConstraint

from .arm import write_arm
from .pinocchio_points import constraint

EXACT = """\
  ball: {type: obstacle, body: lower, obstacle: {type: sphere, center: [2, 0.1, 0], radius: 0.3}, minimum: 0.1}
  rod: {type: obstacle, body: lower, obstacle: {type: capsule, ends: [[2, -1, 0], [2.5, 1, 0.3]], radius: 0.1}}
  crate: {type: obstacle, body: hand, obstacle: {type: box, center: [2, 0, 0], size: [1, 2, 0.4], pitch: 0.3}}
  self: {type: distance, bodies: [post, hand], minimum: 0.02}
"""
ENCLOSING = """\
  crate: {type: obstacle, body: lower, shapes: enclosing, obstacle: {type: box, center: [2, 0, 0], size: [1, 2, 0.4]}}
  tool: {type: obstacle, body: tool, shapes: enclosing, obstacle: {type: sphere, center: [2, 0, 0], radius: 0.3}}
  self: {type: distance, bodies: [post, tool], shapes: enclosing}
"""


def distances(motion: MotionProblem) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Name of each constraint -> its least row and coal's distance less the minimum, at 300 random configurations."""
    path = constraint(motion, "constraints")
    evaluate = ca.Function("rows", [path.variables], [path.rows])
    configurations = np.random.default_rng(1).uniform(-2.5, 2.5, size=(300, 3))
    rows = []
    for q in configurations:
        point = np.zeros(path.variables.numel())
        point[:3] = q
        rows.append(np.asarray(evaluate(point)).ravel())
    found = {}
    for name, one in motion.task.constraints.items():
        assert isinstance(one, DistanceConstraint)
        own = [k for k, row in enumerate(path.row_names) if row.startswith(f"constraint '{name}',")]
        measure = BodyDistances(motion.robot, one)
        found[name] = (
            np.array(rows)[:, own].min(axis=1),
            np.array([measure.least(q) for q in configurations]) - one.minimum,
        )
    return found


def test_rows_are_the_distances(tmp_path: Path) -> None:
    """Spheres and capsules against every kind of obstacle, and a box against a sphere: coal's distances to 1e-9 m."""
    motion = formulate(load_task(write_arm(tmp_path, EXACT), ["method.grid=uniform"]))
    for name, (rows, expected) in distances(motion).items():
        apart = expected > 1e-3 - motion.task.constraints[name].minimum  # type: ignore[union-attr]
        assert apart.sum() > 100
        np.testing.assert_allclose(rows[apart], expected[apart], atol=1e-9, err_msg=name)


def test_what_encloses_is_never_farther(tmp_path: Path) -> None:
    """With enclosing shapes no row is larger than the distance, and not by more than these are thicker."""
    motion = formulate(load_task(write_arm(tmp_path, ENCLOSING), ["method.grid=uniform"]))
    for name, (rows, expected) in distances(motion).items():
        apart = expected > 1e-3
        assert apart.sum() > 100
        assert (rows[apart] <= expected[apart] + 1e-9).all() and (rows[apart] >= expected[apart] - 0.14).all(), name


ERRORS = [
    ("{type: distance, bodies: [upper, hnd]}", "one.bodies.1", "found 'hnd', expected a frame (did you mean 'hand'?)"),
    ("{type: distance, bodies: [upper]}", "one.bodies", "expected two names of bodies"),
    ("{type: distance, bodies: [upper, upper]}", "one.bodies", "expected two names of bodies that differ"),
    (
        "{type: distance, bodies: [upper, tip]}",
        "one.bodies.1",
        "found body 'tip' without collision shapes",
    ),
    ("{type: distance, bodies: [hand, tool], shapes: enclosing}", "one.bodies", "which never move against each other"),
    ("{type: distance, bodies: [upper, tool]}", "one.bodies.1", "a cylinder, whose distance has no closed form"),
    ("{type: distance, bodies: [post, lower]}", "one", "a box, and shape 'lower' of body 'lower', a capsule"),
    (
        "{type: obstacle, body: lower, obstacle: {type: box, center: [2, 0, 0], size: [1, 1, 1]}}",
        "one",
        "the obstacle, a box",
    ),
    (
        "{type: obstacle, body: hand, obstacle: {type: box, center: [2, 0, 0], size: [1, 0, 1]}}",
        "one.obstacle.size",
        "greater than 0",
    ),
    ("{type: obstacle, body: hand, obstacle: {type: cone, radius: 1}}", "one.obstacle.type", "'cone'"),
    (
        "{type: obstacle, body: hand, obstacle: {type: sphere, center: [0, 0], radius: 1}}",
        "one.obstacle.center",
        "three numbers [x, y, z]",
    ),
    (
        "{type: obstacle, body: hand, obstacle: {type: capsule, ends: [[0, 0, 1], [0, 0, 1]], radius: 1}}",
        "one.obstacle.ends",
        "the same place twice",
    ),
    (
        "{type: obstacle, body: hand, minimum: 0.1, obstacle: {type: sphere, center: [-1.02, 0, 0.3], radius: 0.3}}",
        "one",
        "found a start that violates this by",
    ),
]


@pytest.mark.parametrize(("text", "key", "fragment"), ERRORS, ids=[error[0][:45] for error in ERRORS])
def test_mistakes(tmp_path: Path, text: str, key: str, fragment: str) -> None:
    """A wrong name, shape or place is one error at its line and key that says what would be valid."""
    with pytest.raises(TaskError) as caught:
        formulate(load_task(write_arm(tmp_path, f"  one: {text}\n"), ["method.grid=uniform"]))
    assert (caught.value.line, caught.value.key) == (9, f"constraints.{key}"), caught.value
    assert fragment in caught.value.message and "expected" in caught.value.message
