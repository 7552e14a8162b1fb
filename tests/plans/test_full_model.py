"""Solo12's exported torques replayed on the full robot in space: twelve joints, a free base, a force on each foot."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.planning import planner
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.columns import control_interval
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.refinement import solved_motion
from fesd_robot.robot.paths import locate_robot
from fesd_robot.task import load_task

pytestmark = pytest.mark.slow

TASK = Path(__file__).parents[2] / "tasks" / "solo12_jump.yaml"

PUSH = (
    "horizon.duration=0.12",
    "horizon.intervals=3",
    "waypoints=[]",
    "reference={type: line}",
    "goal.configuration.root_x=0.02",
    "robot.damping={FL_KFE: 0.02}",
    "robot.armature={HL_HFE: 0.004}",
)
"""The robot pushes itself 2 cm forwards, with friction in the front knees and heavy rotors in the hind hips."""

LEGS = ("FL", "FR", "HL", "HR")
ROOT = ("root_x", "root_z", "root_pitch")


class Run(NamedTuple):
    """A plan as it was written, and the motion in physical time that it was made of."""

    plan: Plan
    folder: Path
    motion: PhysicalMotion


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    motions: list[PhysicalMotion] = []
    recover = solved_motion.physical_motion

    def recording(*arguments) -> PhysicalMotion:
        motions.append(recover(*arguments))
        return motions[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solved_motion, "physical_motion", recording)
        solved = planner.plan(load_task(TASK, PUSH))
    assert solved.status.solved
    folder = write_plan(solved, tmp_path_factory.mktemp("solo") / "push")
    return Run(read_plan(folder), folder, motions[-1])


@pytest.fixture(scope="module")
def table(run: Run) -> dict[str, np.ndarray]:
    """The columns of numbers in the CSV file."""
    with (run.folder / "trajectory.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    return {
        name: np.array([float(row[k]) for row in rows]) for k, name in enumerate(header) if not name.endswith("mode")
    }


def full_model() -> pin.Model:
    """Solo12 as its file says, on a free base, with what the task adds divided between left and right."""
    model = pin.buildModelFromUrdf(str(locate_robot("example-robot-data:solo12", None)), pin.JointModelFreeFlyer())
    damping, armature = np.array(model.damping), np.array(model.armature)
    for side in "LR":
        damping[model.joints[model.getJointId(f"F{side}_KFE")].idx_v] = 0.01
        armature[model.joints[model.getJointId(f"H{side}_HFE")].idx_v] = 0.002
    model.damping, model.armature = damping, armature
    return model


def test_inverse_dynamics_in_space_give_the_exported_torques(run: Run, table: dict[str, np.ndarray]) -> None:
    """At every stage the recursive Newton-Euler algorithm needs the exported torque of each of the twelve motors.

    Motion, forces and torques are read from the CSV file, accelerations are the slopes of the collocation polynomials;
    what is left for the base is the boom's: nothing in the plane.
    """
    model = full_model()
    data, joints = model.createData(), list(model.names)[2:]
    assert len(joints) == 12 and set(joints) == set(run.plan.full_model.joints)
    largest = max(np.abs(table[f"joint {name} effort [N m]"]).max() for name in joints)
    names = list(run.plan.trajectory.velocity)
    leaders = {name: ("F" if name[0] == "F" else "H") + "L" + name[2:] for name in joints}
    errors, in_plane = [], []
    for k in np.flatnonzero(run.motion.weight > 0):
        slopes = dict(zip(names, run.motion.acceleration[k], strict=True))
        base = np.array(
            [
                table[f"base {key} [{unit}]"][k]
                for key, unit in zip(("x", "y", "z", "qx", "qy", "qz", "qw"), "mmm1111", strict=True)
            ]
        )
        q = np.append(base, [table[f"joint {name} position [rad]"][k] for name in joints])
        back = pin.XYZQUATToSE3(base).rotation.T
        moved = {name: table[f"{name} velocity [{'rad' if 'pitch' in name else 'm'}/s]"][k] for name in ROOT}
        turn = np.array([0, moved["root_pitch"], 0])
        linear = back @ [moved["root_x"], 0, moved["root_z"]]
        linear_slope = back @ [slopes["root_x"], 0, slopes["root_z"]] - np.cross(turn, linear)
        v = np.concatenate([linear, turn, [table[f"joint {name} velocity [rad/s]"][k] for name in joints]])
        a = np.concatenate(
            [linear_slope, [0, slopes["root_pitch"], 0], [slopes.get(leaders[name], 0) for name in joints]]
        )
        tau = pin.rnea(model, data, q, v, a) + model.damping * v
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for leg in LEGS:
            jacobian = pin.getFrameJacobian(model, data, model.getFrameId(f"{leg}_FOOT"), pin.LOCAL_WORLD_ALIGNED)
            normal, tangential = (table[f"foot {leg}_FOOT {kind} force [N]"][k] for kind in ("normal", "tangential"))
            tau = tau - jacobian[:3].T @ [tangential, 0, normal]
        errors.append(np.abs(tau[6:] - [table[f"joint {name} effort [N m]"][k] for name in joints]).max())
        in_plane.append(np.abs(tau[[0, 2, 4]]).max())
    assert len(errors) > 10
    assert max(errors) <= 1e-6 * largest
    assert max(in_plane) <= 1e-6 * largest


def test_torques_in_unison_add_up_to_the_control(run: Run, table: dict[str, np.ndarray]) -> None:
    """The control under the leader's name is the sum of both motors, and left and right feet share their force."""
    for control in ("FL_HFE", "FL_KFE", "HL_HFE", "HL_KFE"):
        both = [table[f"joint {control[0]}{side}{control[2:]} effort [N m]"] for side in "LR"]
        np.testing.assert_allclose(sum(both), table[f"{control} [N m]"], rtol=0, atol=1e-12)
    for contact, left, right in (("front", "FL_FOOT", "FR_FOOT"), ("hind", "HL_FOOT", "HR_FOOT")):
        for kind in ("normal", "tangential"):
            shares = [table[f"foot {foot} {kind} force [N]"] for foot in (left, right)]
            np.testing.assert_array_equal(*shares)
            np.testing.assert_array_equal(2 * shares[0], table[f"{contact} {kind} force [N]"])
        assert run.plan.full_model.feet[right].contact == contact


def test_locked_joints_are_held(table: dict[str, np.ndarray]) -> None:
    """A locked joint stays at its value, and its motor gives what holds it there against the leg's weight."""
    for leg in LEGS:
        assert (
            not table[f"joint {leg}_HAA position [rad]"].any() and not table[f"joint {leg}_HAA velocity [rad/s]"].any()
        )
        assert np.abs(table[f"joint {leg}_HAA effort [N m]"]).max() > 0.1


def test_controls_of_a_sample_are_those_of_its_stage(run: Run) -> None:
    """The convention at interval ends gives every stage the controls with which it was solved."""
    stages = run.motion.weight > 0
    for k, name in enumerate(name for name in run.plan.controls if name != "time"):
        held = run.plan.controls[name][control_interval(run.plan)]
        np.testing.assert_array_equal(held[stages], run.motion.control[stages, k])
