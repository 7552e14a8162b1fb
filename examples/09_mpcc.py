"""Solve a mathematical program with complementarity constraints of one's own, and certify the answer.

Bard's bilevel problem: a leader chooses x, a follower answers with y = argmin (y - 1)^2 - 1.5 x y under three
constraints. The follower's optimality conditions are complementarity pairs of constraints and multipliers.
It is ``bard1`` of the collection MacMPEC, whose optimum is 17 at x = 1, y = 0.

The number: the cost, 17.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.mpcc import Mpcc, solve_by_attempts

x, y, multipliers = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("l", 4)
rows = ca.vertcat(3 * x - y - 3, -x + 0.5 * y + 4, -x - y + 7, y)  # of the follower, all at least zero
answer = (y - 1) ** 2 - 1.5 * x * y

problem = Mpcc.from_expressions(
    w=ca.vertcat(x, y, multipliers),
    f=(x - 5) ** 2 + (2 * y + 1) ** 2,
    g=ca.gradient(answer - ca.dot(multipliers, rows), y),  # zero: the follower's stationarity
    G=rows,
    H=multipliers,
    bounds=(np.array([0.0, -np.inf, *[-np.inf] * 4]), None),
    start=np.ones(6),
)
found = solve_by_attempts(problem)
solution, certificate = found.solution, found.certificate
assert certificate is not None
cost, product = solution.residuals.objective, solution.residuals.complementarity  # recomputed at the point
print(f"x = {solution.w[0]:.6f}, y = {solution.w[1]:.6f}, cost {cost:.6f}, largest product {product:.1e}")
print(f"{certificate.kind}-stationary; B-stationarity {certificate.b_stationary}")
