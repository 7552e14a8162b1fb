"""Push a hopper in MuJoCo and solve the rest of its plan again, every 10 ms.

It takes the plan of 01_first_plan.py, or of `fesd-robot plan hopper_one_jump`.

The number: how far from its planned place the body ends, in cm, and the median time of an answer to a measurement.
"""

from __future__ import annotations

from fesd_robot import Replanner, read_plan
from fesd_robot.in_mujoco import Deviation, Disturbance, Push, mujoco_scene, run
from fesd_robot.ocp import formulate
from fesd_robot.plans import task_of
from fesd_robot.replanning import ReplanningController

jump = read_plan("runs/hopper_one_jump")
replanner = Replanner(jump, period=0.01)  # s
scene = mujoco_scene(formulate(task_of(jump), driven=False))
push = Push(0.05, (0.1, 0.0, 0.0))  # changes the velocity by 0.1 m/s at 0.05 s
record = run(scene, jump, ReplanningController(replanner), disturbance=Disturbance(pushes=[push]))

end = Deviation(scene, jump, record).bodies["body"].end
median, slow = replanner.statistics.seconds()
print(f"ends {100 * end:.1f} cm from its place")
print(f"half of the updates took {1000 * median:.1f} ms at most, 99 % of them {1000 * slow:.1f} ms")
