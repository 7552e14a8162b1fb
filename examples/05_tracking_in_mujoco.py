"""Run a plan in MuJoCo, with and without feedback: a hopper that is 5 % heavier than its model.

It takes the plan of 01_first_plan.py, or of `fesd-robot plan hopper_one_jump`.

The number: how far from its planned place the body ends with feedback, in cm.
"""

from __future__ import annotations

from fesd_robot import read_plan
from fesd_robot.in_mujoco import Perturbation, replay

jump = read_plan("runs/hopper_one_jump")
runs = replay(jump, ["open-loop", "lqr"], different=Perturbation("heavier", mass=1.05)).runs
ends = {run.controller: run.deviation.bodies["body"].end for run in runs}
for controller, end in ends.items():
    print(f"{controller}: ends {100 * end:.1f} cm from its place")

touchdowns = [1000 * each.error for each in runs[-1].deviation.touchdowns if each.error is not None]
print("touchdowns with feedback, later than planned: " + ", ".join(f"{error:.1f} ms" for error in touchdowns))
