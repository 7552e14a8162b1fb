"""Simulate a system with switches: a mass on a spring with dry friction. Every switch is located to round-off.

The mass swings about 0.15 m and -0.15 m in turn and turns round after pi seconds each time, until friction holds it.

The number: the last switch, at 3 pi s, to 1e-9 s.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.fesd import simulate

x = ca.SX.sym("x", 2)  # position, m, and velocity, m/s
system = stewart(
    Model(state=x, state_names=["position", "velocity"]),
    Subsystem(
        switching=x[1],
        sign_matrix=np.array([[-1], [1]]),  # region 1: velocity < 0, region 2: velocity > 0
        fields=ca.horzcat(ca.vertcat(x[1], -x[0] + 0.15), ca.vertcat(x[1], -x[0] - 0.15)),
        region_names=["leftwards", "rightwards"],
    ),
)
motion = simulate(system, np.array([1.0, 0.0]), (0.0, 12.0), rtol=1e-10)
for phase in motion.phases:
    print(f"{phase.start:.9f} to {phase.end:.9f} s: {phase.regions}")
error = abs(motion.switch_times[-1] - 3 * np.pi)
print(f"it sticks at {motion.at([12.0])[0, 0]:.6f} m from {motion.switch_times[-1]:.9f} s on, 3 pi to {error:.0e} s")
