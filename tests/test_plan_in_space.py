"""Plans in space: Coulomb's law in every direction, without a polygon."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import Plan, export_plan, load_task, plan, read_plan, write_plan
from tests.bodies_in_space import MASS, written

FRICTION, GRAVITY = 0.5, 9.81


@pytest.fixture(
    scope="module", params=[(0.5, 0.3, 0), (0.0, 0.583095, 0), (0.5, 0.3, -0.6)], ids=["askew", "sideways", "curved"]
)
def pushed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A mass that is pushed over the floor and comes to rest at x and y, from a speed along y."""
    x, y, speed = request.param
    task = written(
        tmp_path_factory.mktemp("pushed"),
        MASS,
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{type: plane, friction: {FRICTION}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 1, intervals: 8}\n"
        f"initial: {{configuration: {{x: 0, y: 0, z: 0}}, velocity: {{y: {speed}}}}}\n"
        f"goal: {{configuration: {{x: {x}, y: {y}, z: 0}}}}\n"
        "solver: {effort: quick}\n",
    )
    return plan(load_task(task))


def test_it_is_solved_and_true(pushed: Plan) -> None:
    """The motion is exact, its first-order optimality is certified, and the audit with its replay passes."""
    assert pushed.status.solved and pushed.status.exact and pushed.status.audit_passed
    assert pushed.status.complementarity <= 1e-9
    assert pushed.status.b_stationary == "certified"
    assert pushed.outcome.contacts["foot"].slides


def test_friction_is_on_the_cone_and_against_the_slide(pushed: Plan) -> None:
    """Where the mass slides the angle between friction and velocity is pi to 1e-8, and its size mu times the weight.

    The very first sample is no stage: its force is that of the polynomial through those of the first element.
    """
    velocity = np.column_stack([pushed.trajectory.velocity[name] for name in "xy"])
    force, mode = pushed.contacts["foot"].force, np.array(pushed.contacts["foot"].mode)
    slides = (np.linalg.norm(velocity, axis=1) > 1e-3) & (mode == "slip")
    slides[0] = False
    assert slides.sum() > 10
    along, friction = velocity[slides], force[slides, 1:]
    sizes = np.linalg.norm(along, axis=1) * np.linalg.norm(friction, axis=1)
    across = along[:, 0] * friction[:, 1] - along[:, 1] * friction[:, 0]
    assert np.abs(across / sizes).max() <= 1e-8
    assert (along * friction).sum(axis=1).max() < 0
    np.testing.assert_allclose(np.linalg.norm(friction, axis=1), FRICTION * GRAVITY, atol=1e-8)
    assert (np.linalg.norm(force[:, 1:], axis=1) <= FRICTION * force[:, 0] + 1e-8).all()


@pytest.fixture(scope="module", params=[0.08, 0.12], ids=["straight", "curved"])
def stopped(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A mass that friction stops whatever its controls do: these are too weak to keep it moving, and bend its way."""
    task = written(
        tmp_path_factory.mktemp("stopped"),
        MASS,
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{type: plane, friction: {FRICTION}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 1, intervals: 8}\n"
        "initial: {configuration: {x: 0, y: 0, z: 0}, velocity: {x: 0.5, y: 1.5}}\n"
        f"goal: {{configuration: {{x: {request.param}, y: 0.24, z: 0}}}}\n"
        "limits: {effort: {x: 2, y: 2}}\n"
        "solver: {effort: quick}\n",
    )
    return plan(load_task(task))


def test_friction_at_the_end_of_a_slide_is_against_the_last_velocity(stopped: Plan) -> None:
    """Where the mass stops, its velocity vanishes along its acceleration, and so friction is parallel to the push."""
    stops = [one for one in stopped.switches if one.kind == "slip_to_stick"]
    assert stopped.status.solved and stops
    for stop in stops:
        last = stopped.at(stop.time, "before")
        push = np.array([last.controls["x"], last.controls["y"]])
        friction = np.array([last.contacts["foot"].tangential, last.contacts["foot"].lateral])
        across = push[0] * friction[1] - push[1] * friction[0]
        assert abs(across) <= 1e-7 * (1 + np.linalg.norm(push)) * np.linalg.norm(friction)
        assert np.linalg.norm(friction) == pytest.approx(FRICTION * GRAVITY, abs=1e-7)


def test_the_force_explains_the_motion_between_samples(pushed: Plan) -> None:
    """At any time mass times acceleration is control plus friction, and the parts of the force have their names."""
    at = pushed.at(np.linspace(0.01, 0.99, 37))
    foot = at.contacts["foot"]
    assert foot.lateral is not None
    for name, friction in (("x", foot.tangential), ("y", foot.lateral)):
        np.testing.assert_allclose(at.acceleration[name], at.controls[name] + friction, atol=1e-6)


def test_files_have_the_lateral_force(pushed: Plan, tmp_path: Path) -> None:
    """plan.json, CSV and NPZ have it under its name, and reading the plan gives it back."""
    write_plan(pushed, tmp_path / "plan")
    lateral = pushed.contacts["foot"].lateral_force
    found = read_plan(tmp_path / "plan")
    np.testing.assert_array_equal(found.contacts["foot"].lateral_force, lateral)
    export_plan(found, tmp_path / "plan.npz", "npz")
    with np.load(tmp_path / "plan.npz") as arrays:
        np.testing.assert_array_equal(arrays["lateral_force"][:, 0], lateral)
    export_plan(found, tmp_path / "plan.csv", "csv")
    header = (tmp_path / "plan.csv").read_text(encoding="utf-8").split("\n")
    assert any("foot lateral force [N]" in line for line in header[:3])
