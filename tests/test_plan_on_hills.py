"""A plan over a ground that varies along x and y."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot import Plan, load_task, plan
from tests.bodies_in_space import MASS, written

FRICTION, GRAVITY = 0.5, 9.81


def height(x: float, y: float) -> float:
    """The hills of the map, 3 cm high."""
    return float(0.03 * np.sin(4 * x) * np.cos(3 * y))


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A mass that is pushed from a flank of a hill to a place askew."""
    folder = tmp_path_factory.mktemp("hills")
    places = np.linspace(-0.5, 1.0, 20).tolist()
    rows = [f"{x!r},{y!r},{height(x, y)!r}" for x in places for y in places]
    (folder / "map.csv").write_text("x,y,z\n" + "\n".join(rows), encoding="utf-8")
    task = written(
        folder,
        MASS,
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{type: height_map, file: map.csv, friction: {FRICTION}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 0.6, intervals: 3}\n"
        "initial: {configuration: {x: 0, y: 0}, stand_on: {contacts: [foot], adjust: [z]}}\n"
        "goal: {configuration: {x: 0.2, y: 0.1}, stand_on: {contacts: [foot], adjust: [z]}}\n"
        "solver: {effort: quick}\n",
    )
    return plan(load_task(task, ["method.grid=uniform"]))


def test_it_is_solved_and_true(pushed: Plan) -> None:
    """The motion is exact, and the audit with its replay passes."""
    assert pushed.status.solved and pushed.status.exact and pushed.status.audit_passed


def test_it_slides_over_the_hills(pushed: Plan) -> None:
    """The mass keeps to the heights of the formula, to what the spline through 20 x 20 points misses of them."""
    x, y, z = (pushed.trajectory.configuration[name] for name in "xyz")
    assert (x[-1], y[-1]) == pytest.approx((0.2, 0.1), abs=0.0101)
    assert z == pytest.approx([height(*at) for at in zip(x, y, strict=True)], abs=1e-5)


def test_the_forces_are_those_of_newton(pushed: Plan) -> None:
    """Mass times acceleration is weight, control and a force along n, t_1 and t_2 of the hills, inside the cone."""
    at = pushed.at(np.linspace(0.02, 0.58, 29))
    foot = at.contacts["foot"]
    assert foot.lateral is not None
    acceleration = np.column_stack([at.acceleration[name] for name in "xyz"])
    control = np.column_stack([at.controls["x"], at.controls["y"], np.zeros(len(at.controls["x"]))])
    force = acceleration - control + [0, 0, GRAVITY]
    slope = np.array(
        [
            [0.12 * np.cos(4 * x) * np.cos(3 * y), -0.09 * np.sin(4 * x) * np.sin(3 * y)]
            for x, y in zip(at.configuration["x"], at.configuration["y"], strict=True)
        ]
    )
    normal = np.column_stack([-slope, np.ones(len(slope))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along = (force * normal).sum(axis=1)
    assert np.asarray(foot.normal) == pytest.approx(along, abs=2e-3)
    across = np.linalg.norm(force - along[:, None] * normal, axis=1)
    assert np.hypot(foot.tangential, foot.lateral) == pytest.approx(across, abs=2e-3)
    assert (across <= FRICTION * along + 2e-3).all()
