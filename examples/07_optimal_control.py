"""Solve an optimal control problem with switches, without a robot: the least time of a car with a turbocharger.

Above 10 m/s it accelerates and brakes three times as hard. It goes 200 m from rest to rest, at most at 25 m/s.

The number: the least time with 10 control intervals, 12.0166 s; the end time is free.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.fesd import OptimalControlProblem
from fesd_robot.optimal_control import EndTime, optimize

x, u = ca.SX.sym("x", 2), ca.SX.sym("u")  # position and speed, acceleration
car = stewart(
    Model(x, u, state_names=["position", "speed"]),
    Subsystem(
        switching=x[1] - 10,
        sign_matrix=np.array([[-1], [1]]),  # region 1: below 10 m/s, region 2: above
        fields=ca.horzcat(ca.vertcat(x[1], u), ca.vertcat(x[1], 3 * u)),
        region_names=["normal", "turbo"],
    ),
)
race = OptimalControlProblem(
    car,
    duration=20,  # only a guess: the end time is free
    intervals=10,
    initial_lower=np.zeros(2),
    initial_upper=np.zeros(2),
    state_lower=np.array([-np.inf, -25]),
    state_upper=np.array([np.inf, 25]),
    terminal_lower=np.array([200.0, 0.0]),
    terminal_upper=np.array([200.0, 0.0]),
    control_lower=np.array([-5.0]),
    control_upper=np.array([5.0]),
)
solution = optimize(race, end_time=EndTime(shortest=1, longest=100))
time = solution.times[-1]
print(solution.message)
for phase in solution.phases:
    print(f"{phase.start:.6f} to {phase.end:.6f} s: {phase.regions}")
print(f"least time: {time:.4f} s")
