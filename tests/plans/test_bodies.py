"""Bodies beside the robot in the files of a plan."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fesd_robot import Plan, export_plan, load_task, read_plan, simulate, write_plan
from fesd_robot.ocp import load_task_robot
from fesd_robot.plans import task_of
from fesd_robot.render.outputs import write_page

MODELS = Path(__file__).parents[2] / "models"


@pytest.fixture(scope="module")
def dropped(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A crate that tilts while it falls beside a gripper with a fixed root, whose own box is locked away."""
    file = tmp_path_factory.mktemp("dropped") / "task.yaml"
    file.write_text(
        "name: dropped\n"
        f"robot: {{model: {MODELS}/gripper/gripper.urdf, locked: {{box_x: 2, box_z: 1, box_pitch: 0}}}}\n"
        "bodies: {crate: {type: box, size: [0.1, 0.3, 0.2], mass: 0.5, root: sagittal, position: {y: 0.4}}}\n"
        "contacts: {floor: {body: crate}}\n"
        "horizon: {duration: 0.1, intervals: 2}\n"
        "initial: {configuration: {lift: 0.1, crate.root_z: 0.5}, velocity: {crate.root_pitch: 3}}\n"
        "goal: {soft: true}\n",
        encoding="utf-8",
    )
    return simulate(load_task(file), {"lift": 0.9 * 9.81, "left": 0.0, "right": 0.0})


def test_it_falls_as_bodies_do(dropped: Plan) -> None:
    """The crate is in free fall and turns evenly, while the motor of the lift carries the weight of the gripper."""
    trajectory = dropped.trajectory
    assert trajectory.configuration["crate.root_z"][-1] == pytest.approx(0.5 - 9.81 * 0.1**2 / 2, abs=1e-9)
    assert trajectory.configuration["crate.root_pitch"][-1] == pytest.approx(0.3, abs=1e-9)
    assert trajectory.configuration["lift"][-1] == pytest.approx(0.1, abs=1e-9)


def test_the_plan_names_its_coordinates(dropped: Plan, tmp_path: Path) -> None:
    """They are in plan.json and in the table; roots of bodies are no joints for a controller."""
    write_plan(dropped, tmp_path / "plan")
    found = read_plan(tmp_path / "plan")
    assert found.units.configuration["crate.root_pitch"] == "rad"
    assert "crate.root_z [m]" in (tmp_path / "plan" / "trajectory.csv").read_text(encoding="utf-8")
    assert found.full_model is not None
    assert set(found.full_model.joints) == {"lift", "left", "right", "box_x", "box_z", "box_pitch"}
    assert found.full_model.base is None


def test_pinocchio_gets_a_free_flyer_for_it(dropped: Plan, tmp_path: Path) -> None:
    """The state of all models in one vector: the robot's joints, then position and quaternion of the body."""
    export_plan(dropped, tmp_path / "plan.npz", "pinocchio")
    with np.load(tmp_path / "plan.npz") as arrays:
        assert list(arrays["joint_names"])[-1] == "crate.root_joint"
        q, v = arrays["q"], arrays["v"]
    pitch, height = (dropped.trajectory.configuration[f"crate.root_{name}"] for name in ("pitch", "z"))
    place = np.column_stack([np.zeros_like(height), np.full_like(height, 0.4), height])
    np.testing.assert_allclose(q[:, -7:-4], place, atol=1e-12)
    np.testing.assert_allclose(q[:, -3], np.sin(pitch / 2), atol=1e-12)
    np.testing.assert_allclose(v[:, -2], 3.0, atol=1e-9)


def test_drake_gets_its_pose(dropped: Plan, tmp_path: Path) -> None:
    """The body has samples under its name; the fixed robot has no base."""
    export_plan(dropped, tmp_path / "plan.json", "drake")
    segment = json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))["segments"][0]
    assert "base_position" not in segment
    np.testing.assert_allclose(segment["crate_position"][2][-1], 0.5 - 9.81 * 0.1**2 / 2, atol=1e-9)


def test_the_page_shows_it(dropped: Plan, tmp_path: Path) -> None:
    """Its shape is drawn where its frame is, from the first sample on."""
    page = write_page(dropped, task_of(dropped), tmp_path / "page.html")
    _, robot = load_task_robot(task_of(dropped))
    assert [one.name for one in robot.visual_model.geometryObjects][-1] == "crate.middle 0 shape"
    assert page.stat().st_size > 1e5
