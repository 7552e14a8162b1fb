"""Plan for a robot of a MuJoCo file: a sled on rough ground that a spring pulls and a weak motor helps.

Spring, damping, motor and the start are those of the file; MuJoCo's own compiler reads it.

The number: what friction takes, relative to mu m g times the way: 1.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fesd_robot import load_task, plan

SLED = """
<mujoco>
  <worldbody>
    <body name="sled">
      <joint name="x" type="slide" axis="1 0 0" stiffness="80" springref="0.2" damping="1"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.05" mass="2"/>
    </body>
  </worldbody>
  <actuator><motor joint="x" gear="5" ctrlrange="-1 1"/></actuator>
  <keyframe><key name="released" qpos="0 0.05"/></keyframe>
</mujoco>
"""

TASK = """
name: sled
robot: {model: sled.xml}
ground: {friction: 0.2}
contacts:
  runner: {frame: sled, offset: [0, 0, -0.05]}
horizon: {duration: 0.6, intervals: 8}
initial: {posture: released}
goal: {configuration: {x: 0.3}}
solver: {effort: quick}
"""

Path("sled.xml").write_text(SLED, encoding="utf-8")
Path("sled.yaml").write_text(TASK, encoding="utf-8")
ride = plan(load_task("sled.yaml"))
print(ride.status.message)

x, duration = ride.trajectory.configuration["x"], ride.trajectory.time[-1]
state = ride.at((np.arange(1000) + 0.5) * duration / 1000)  # in the middles of a thousand equal times
power = -state.contacts["runner"].tangential * state.velocity["x"]
lost = np.mean(power) * duration
share = lost / (0.2 * 2 * 9.81 * (x[-1] - x[0]))
print(f"friction takes {lost:.3f} J on {x[-1] - x[0]:.3f} m, {share:.5f} of mu m g times the way")
