"""A task in space whose sides are asked for the same, and its twin in the x-z plane."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.sagittal import SagittalTwin, sagittal_twin, space_configuration, space_velocity
from fesd_robot.task import load_task
from tests.quadruped_in_space import LEGS, standing

JUMP = (
    standing("jump", "{duration: 0.5, intervals: 4}") + "goal: {configuration: {root_joint.x: 0.2}}\n"
    "reference: {type: jumps, count: 1, apex: {root_joint.z: 0.32}}\n"
)


def problem(folder: Path, text: str) -> MotionProblem:
    """Formulate a task."""
    file = folder / "task.yaml"
    file.write_text(text, encoding="utf-8")
    return formulate(load_task(file, ["method.grid=uniform"]))


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> tuple[MotionProblem, MotionProblem, SagittalTwin]:
    """A jump of Solo12 in space, its twin as a problem, and how they belong together."""
    motion = problem(tmp_path_factory.mktemp("sagittal"), JUMP)
    twin = sagittal_twin(motion)
    assert twin is not None
    return motion, formulate(twin.task), twin


def lifted(twins: tuple[MotionProblem, MotionProblem, SagittalTwin], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return configuration and velocity in space of a state in the plane."""
    motion, planar, twin = twins
    n = len(planar.robot.configuration_names)
    q = dict(zip(planar.robot.configuration_names, x[:n], strict=True))
    v = dict(zip(planar.robot.velocity_names, x[n:], strict=True))
    return space_configuration(twin, motion.robot, q), space_velocity(twin, motion.robot, v, q["root_pitch"])


def test_feet_are_where_they_are_in_the_plane(twins: tuple[MotionProblem, MotionProblem, SagittalTwin]) -> None:
    """Pinocchio's feet of the robot in space have the place and the velocity of the contact that stands for them."""
    motion, planar, twin = twins
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.7, 0.7, 14)
    places = []
    q_v = (lifted(twins, x), (x[:7], x[7:]))
    for (q, v), robot, frames in zip(
        q_v, (motion.robot, planar.robot), (LEGS, [twin.contacts[leg] for leg in LEGS]), strict=True
    ):
        data = robot.model.createData()
        pin.forwardKinematics(robot.model, data, q, v)
        pin.updateFramePlacements(robot.model, data)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        places.append(
            [
                np.concatenate(
                    [
                        data.oMf[robot.frame_id(f"{leg}_FOOT")].translation[[0, 2]],
                        pin.getFrameVelocity(robot.model, data, robot.frame_id(f"{leg}_FOOT"), axes).linear[[0, 2]],
                    ]
                )
                for leg in frames
            ]
        )
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)


def test_a_motion_costs_the_same(twins: tuple[MotionProblem, MotionProblem, SagittalTwin]) -> None:
    """Running costs of the twin are those in space, at random states and controls, with legs sharing their control."""
    motion, planar, twin = twins
    rng, costs = np.random.default_rng(1), []
    x, u = rng.uniform(-0.3, 0.3, 14), rng.uniform(-1, 1, 4)
    parts = {name: value / 2 for name, value in zip(planar.actuation.names, u, strict=True)}
    efforts = twin.joints(parts, at_rest=True)
    in_space = np.array([efforts[name] for name in motion.actuation.names])
    for own, state, control in ((planar, x, u), (motion, np.concatenate(lifted(twins, x)), in_space)):
        system, ocp = own.ocp.system, own.ocp
        terms = ca.Function(
            "cost",
            [system.state, system.control, system.algebraic, system.parameters],
            [ocp.running_cost[name] for name in ("configuration", "velocity", "control")],
        )
        full = np.concatenate([state, np.zeros(system.state.numel() - len(state))])
        flying = system.guess(full, np.append(control, 1.0), ocp.parameters[:, 0])
        values = terms(full, np.append(control, 1.0), flying, ocp.parameters[:, 0])
        costs.append(np.array([float(value) for value in values]))
    np.testing.assert_allclose(costs[0], costs[1], rtol=1e-9)
    assert (costs[0] > 0).all()


@pytest.mark.parametrize(
    "goal",
    [
        "{configuration: {root_joint.y: 0.1}}",
        "{configuration: {root_joint.yaw: 0.4}}",
        "{configuration: {FL_HFE: 0.9, FR_HFE: 0.5}}",
    ],
)
def test_what_leaves_the_plane_has_no_twin(goal: str, tmp_path: Path) -> None:
    """A goal sideways, turned, or with one leg ahead of the other cannot be asked for in the plane."""
    assert sagittal_twin(problem(tmp_path, JUMP.replace("{configuration: {root_joint.x: 0.2}}", goal))) is None
