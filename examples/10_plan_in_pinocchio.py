"""Read a plan in Pinocchio, and in Drake where it is installed.

It takes the plan of 01_first_plan.py, or of `fesd-robot plan hopper_one_jump`. Pinocchio, which knows nothing of the
planner, computes the efforts that the motion needs, from the model file and the forces at the foot.

The number: the largest difference from the efforts of the plan in the air, where no force of the ground acts, in N.
"""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot import export_plan, read_plan
from fesd_robot.examples import shipped_folder

jump = read_plan("runs/hopper_one_jump")
export_plan(jump, "jump.npz", kind="pinocchio", rate=100)  # q, v, a, tau in Pinocchio's order
arrays = np.load("jump.npz")
model = pin.buildModelFromUrdf(str(shipped_folder() / "models/hopper/hopper.urdf"))
model.armature[model.getJointId("leg") - 1] = 0.1  # as the task says
data = model.createData()
foot = model.getFrameId("foot", pin.FrameType.BODY)

worst = 0.0
for q, v, a, effort, force in zip(*(arrays[name] for name in ("q", "v", "a", "tau", "foot_force")), strict=True):
    J = pin.computeFrameJacobian(model, data, q, foot, pin.LOCAL_WORLD_ALIGNED)[:3]
    needed = pin.rnea(model, data, q, v, a) - J.T @ force[0]
    worst = max(worst, float(np.abs(needed - effort).max()))
print(f"{len(arrays['time'])} samples, efforts differ by at most {worst:.1e} N or N m")

if importlib.util.find_spec("pydrake"):
    from pydrake.trajectories import PiecewisePolynomial

    export_plan(jump, "jump.json", kind="drake")
    for segment in json.loads(Path("jump.json").read_text())["segments"]:
        breaks, samples, rates = (np.array(segment[name]) for name in ("breaks", "samples", "samples_dot"))
        curve = PiecewisePolynomial.CubicHermite(breaks, samples, rates)
        print(f"Drake: {curve.start_time():.3f} to {curve.end_time():.3f} s, ends at {curve.value(breaks[-1]).T}")
