"""Two switches whose surfaces must be followed: the sliding-mode problem of the FESD paper, as its authors solve it.

q_i' in -sign(phi_i(q)) + v_i, v' = 2 u, from (2 pi/3, pi/3) to (-pi/6, -pi/4) in 4 s, min int |v|^2 dt, with
phi_1 = q_1 + 0.15 q_2^2 and phi_2 = q_2 - 0.05 q_1^3. The paper prints v' = u and other costs; its figures, and
nosnoc's example, are of this variant.

Source: arXiv 2205.05337, section 5.3; settings of nosnoc's example sliding_mode_ocp.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from scripts.benchmarks.compare import switched


def describe() -> switched.SwitchedProblem:
    """Return the problem."""
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u", 2)
    q, v = x[:2], x[2:]
    surfaces = (q[0] + 0.15 * q[1] ** 2, q[1] - 0.05 * q[0] ** 3)
    axes = (ca.DM([1, 0]), ca.DM([0, 1]))
    return switched.SwitchedProblem(
        name="sliding_mode",
        state=x,
        control=u,
        sides=[
            switched.Side(phi, *(ca.vertcat(axis * (v + sign), u) for sign in (-1, 1)))
            for phi, axis in zip(surfaces, axes, strict=True)
        ],
        running=ca.sumsqr(v),
        terminal=ca.SX(0),
        initial=np.array([2 * np.pi / 3, np.pi / 3, 0, 0]),
        target=np.array([-np.pi / 6, -np.pi / 4, np.nan, np.nan]),
        state_limit=np.full(4, np.inf),
        control_limit=10.0,
        duration=4.0,
        intervals=6,
        elements=6,
        form="differential",
        equilibration="mean",
        weight=10.0,
        comp_tol=1e-9,
    )
