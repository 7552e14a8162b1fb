"""Constraints as rows of the problem, against Pinocchio and closed forms."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from fesd_robot.contact import Plane
from fesd_robot.errors import TaskError
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.ocp.constraints import point_rows
from fesd_robot.plans.requirements import violations
from fesd_robot.task import AvoidBox, BodyPoint, Task

from .pinocchio_points import constraint, frame, rows, states

Load = Callable[[str], Task]

ALL = """\
ground: {height: -0.3, slope: 0.1}
constraints:
  high: {type: clearance, frame: body, offset: [0.1, 0, -0.2], distance: 0.05}
  ball: {type: avoid_sphere, frame: foot, center: [2, null, 0.4], radius: 0.3}
  egg: {type: avoid_ellipse, frame: foot, center: {x: 2, z: 1}, semi_axes: {x: 0.4, z: 0.2}}
  box: {type: avoid_box, frame: foot, center: {x: 2, z: 1}, size: {x: 0.4, z: 0.2}, power: 4}
  room: {type: frame_limits, frame: body, x: [-1, 3], z: [null, 1.4]}
"""


def test_rows_are_the_geometry(short: str, load: Load) -> None:
    """Clearance, sphere, ellipse, rounded box and bounds of a frame as Pinocchio's placements give them."""
    motion = formulate(load(short + ALL))
    path = constraint(motion, "constraints")
    assert (path.kind, list(path.intervals)) == ("path", [0, 1, 2, 3])
    np.testing.assert_array_equal(path.lower, [0, 0, 0, 0, -1, -np.inf])
    np.testing.assert_array_equal(path.upper, [np.inf] * 4 + [3, 1.4])
    rest = np.zeros(path.variables.numel() - 10)
    for x in states():
        body, _, rotation = frame(motion.robot, "body", x[:4], x[4:8])
        foot, _, _ = frame(motion.robot, "foot", x[:4], x[4:8])
        corner = body + rotation @ [0.1, 0, -0.2]
        above = (corner[2] + 0.3) * np.cos(0.1) - corner[0] * np.sin(0.1)
        ball = np.hypot(foot[0] - 2, foot[2] - 0.4) - 0.3
        dx, dz = foot[0] - 2, foot[2] - 1
        egg = 0.1 * ((dx / 0.4) ** 2 + (dz / 0.2) ** 2 - 1)
        box = 0.1 * ((((dx / 0.2) ** 4 + (dz / 0.1) ** 4) / 2) ** 0.25 - 1)
        expected = [above - 0.05, ball, egg, box, body[0], body[2]]
        np.testing.assert_allclose(rows(path, x, rest), expected, atol=1e-9)


def test_every_constraint_on_a_point_has_rows() -> None:
    """Each type of constraint on the position of a point has one function for its rows and one that measures it."""
    assert set(BodyPoint.__subclasses__()) == set(point_rows.registry) - {object} == set(violations.registry) - {object}


def test_the_rounded_box_contains_the_box() -> None:
    """No point of the box satisfies its row, its corners are on it, and points just beyond the stated width do."""
    box = AvoidBox(type="avoid_box", frame="f", center=(1.0, None, 2.0), size=(0.6, None, 0.2))
    p = ca.SX.sym("p", 3)
    row = ca.Function("row", [p], [point_rows(box, p, Plane())[0][1]])
    for dx, dz in np.random.default_rng(0).uniform(-1, 1, size=(200, 2)):
        assert float(row([1 + 0.3 * dx, 9, 2 + 0.1 * dz])) < 0
    assert float(row([1.3, 9, 2.1])) == pytest.approx(0, abs=1e-9)
    wider = 2 ** (1 / 8) + 1e-6
    assert float(row([1 + 0.3 * wider, 9, 2])) > 0 and float(row([1, 9, 2 - 0.1 * wider])) > 0


def test_constraints_are_held_at_every_stage(short: str, load: Load) -> None:
    """The transcription has the rows of each constraint at each of the 4 x 3 x 2 stages, and reads the stage's q."""
    motion = formulate(load(short + ALL))
    problem = Transcription(motion.ocp, motion.fesd).problem
    plain = formulate(load(short + ALL.splitlines(keepends=True)[0]))
    block = problem.blocks[-1]
    assert (block.copies, len(block.constraints)) == (24, 6)
    assert str(block.places[3]) == "interval 0, element 1, stage 2"
    assert problem.size == Transcription(plain.ocp, plain.fesd).problem.size
    w = np.random.default_rng(1).normal(size=problem.size)
    values = block.evaluate(w)[1]
    for k in (0, 7, 23):
        body, _, _ = frame(motion.robot, "body", w[block.index[:4, k]], np.zeros(4))
        assert values[4, k] == pytest.approx(body[0])


def test_contact_windows(short: str, load: Load) -> None:
    """A forbidden contact keeps its clearance at the stages of its window, a required one closes at interval ends."""
    text = short + (
        "constraints:\n"
        "  up: {type: contact_window, contact: foot, times: [0.25, 0.75], touch: forbidden, clearance: 0.02}\n"
        "  down: {type: contact_window, contact: foot, times: [0.75, 1], touch: required}\n"
    )
    motion = formulate(load(text))
    up, down = constraint(motion, "up"), constraint(motion, "down")
    assert (up.kind, list(up.intervals), up.lower[0], up.upper[0]) == ("path", [1, 2], 0.02, np.inf)
    assert (down.kind, list(down.intervals), down.lower[0], down.upper[0]) == ("interval_end", [2, 3], -np.inf, 1e-3)
    for x in states():
        foot, _, _ = frame(motion.robot, "foot", x[:4], x[4:8])
        rest = np.zeros(up.variables.numel() - 10)
        assert rows(up, x, rest) == pytest.approx([foot[2]]) and rows(down, x) == pytest.approx([foot[2]])


def test_a_forbidden_zone_is_one_more_vanishing_constraint(short: str, load: Load) -> None:
    """Inside the zone the depth is positive and excludes the contact's multipliers, outside it is negative."""
    text = short + "constraints: {ditch: {type: forbidden_zone, contact: foot, x: [0.4, 0.6]}}\n"
    motion, plain = formulate(load(text)), formulate(load(short))
    system = motion.contact_system.system
    assert len(system.vanishing) == len(plain.contact_system.system.vanishing) + 1
    added = system.complementarities[-1]
    assert added.vanishing
    values = ca.Function("added", [system.state, system.algebraic], [added.G, added.H])
    for x in np.linspace(0.2, 0.8, 13):
        state = np.array([x, 0.6, 0, 0.5, 0, 0, 0, 0, 0, 0.1])
        depth, multipliers = (float(value) for value in values(state, [0.3, 0.2, 0.5]))
        assert depth == pytest.approx((x - 0.4) * (0.6 - x) / 0.2) and multipliers == pytest.approx(0.5)


ERRORS = [
    ("{type: clearance, frame: body, distance: 0.7}", "violates this by 0.1 m"),
    ("{type: avoid_sphere, frame: foot, center: {x: 0, z: 0}, radius: 0.25}", "violates this by 0.15 m"),
    ("{type: frame_limits, frame: foot, z: [0.3, null]}", "violates this by 0.2 m"),
    ("{type: contact_window, contact: foot, times: [0, 0.5], touch: required}", "violates this by 0.099 m"),
]


@pytest.mark.parametrize(("constraint", "fragment"), ERRORS, ids=[error[0][7:20] for error in ERRORS])
def test_a_start_that_violates_a_constraint(short: str, load: Load, constraint: str, fragment: str) -> None:
    """A start outside a constraint is an error at its line that says by how much."""
    with pytest.raises(TaskError) as caught:
        formulate(load(short + f"constraints:\n  one: {constraint}\n"))
    assert (caught.value.line, caught.value.key) == (12, "constraints.one"), caught.value
    assert fragment in caught.value.message


def test_a_start_that_touches_in_a_zone(short: str, load: Load) -> None:
    """A contact that touches inside its forbidden zone at the start is an error; above the zone it is none."""
    zone = "constraints:\n  one: {type: forbidden_zone, contact: foot, x: [null, 0.5]}\n"
    formulate(load(short + zone))
    with pytest.raises(TaskError, match="touching at x = 0 m") as caught:
        formulate(load(short.replace("root_z: 0.6", "root_z: 0.5") + zone))
    assert caught.value.key == "constraints.one"
