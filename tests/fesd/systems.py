"""Small systems with known solutions that the discretisation is tried on."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.dcs import (
    ComplementaritySystem,
    Model,
    StepFunctions,
    Subsystem,
    heaviside,
    heaviside_from_regions,
    stewart,
)

OMEGA = 2 * np.pi


def scalar(right_hand_side: str) -> ComplementaritySystem:
    """x' = 2 - sign(x) (``crossing``) or x' = -sign(x) (``sliding``), sign(x) = 2 alpha - 1."""
    x, alpha = ca.SX.sym("x"), ca.SX.sym("alpha")
    sign = 2 * alpha - 1
    value = {"crossing": 2 - sign, "sliding": -sign}[right_hand_side]
    return heaviside(Model(x, state_names=["x"]), StepFunctions(alpha, x), value)


def leaving() -> ComplementaritySystem:
    """x' = t - sign(x) with the time t as second state."""
    x, t, alpha = ca.SX.sym("x"), ca.SX.sym("t"), ca.SX.sym("alpha")
    return heaviside(Model(ca.vertcat(x, t)), StepFunctions(alpha, x), ca.vertcat(t - (2 * alpha - 1), 1))


def pressed() -> ComplementaritySystem:
    """x' = 2 t^2 - 1 - sign(x) with the time t as second state: from x = 0 it stays there, with alpha = t^2."""
    x, t, alpha = ca.SX.sym("x"), ca.SX.sym("t"), ca.SX.sym("alpha")
    rate = ca.vertcat(2 * t**2 - 1 - (2 * alpha - 1), 1)
    return heaviside(Model(ca.vertcat(x, t)), StepFunctions(alpha, x), rate)


def oscillator() -> ComplementaritySystem:
    """The planar oscillator of arXiv 2205.05337, section 4.4: x' = A x, turning left inside the unit circle."""
    x, alpha = ca.SX.sym("x", 2), ca.SX.sym("alpha")
    inside, outside = ca.DM([[1, -OMEGA], [OMEGA, 1]]), ca.DM([[1, OMEGA], [-OMEGA, 1]])
    rate = ca.mtimes(alpha * outside + (1 - alpha) * inside, x)
    return heaviside(Model(x), StepFunctions(alpha, ca.sumsqr(x) - 1), rate)


def driven() -> ComplementaritySystem:
    """Two states, a control, a parameter, two steps of which one product is lifted, and a mass matrix."""
    x, u, p, alpha = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p"), ca.SX.sym("alpha", 2)
    both = ca.SX.sym("both")
    model = Model(
        state=x,
        control=u,
        parameters=p,
        mass_matrix=ca.diag(ca.vertcat(2, 1 + x[0] ** 2)),
        state_names=["a", "b"],
        control_names=["push"],
    )
    return heaviside(
        model,
        StepFunctions(alpha, ca.vertcat(x[0], x[1] - p)),
        ca.vertcat(u + both, p - alpha[0]),
        lifted=[("both", both, alpha[0] * alpha[1])],
        regularisation_weight=1e-2,
    )


def by_regions(
    form: str, model: Model, subsystems: list[Subsystem], drift: ca.SX | None = None
) -> ComplementaritySystem:
    """A piecewise smooth system in the form of Stewart (``stewart``) or with step functions (``heaviside``)."""
    return {"stewart": stewart, "heaviside": heaviside_from_regions}[form](model, subsystems, drift)


SIGNS = np.array([[-1], [1]])


def relay(form: str, below: ca.SX | float, above: ca.SX | float) -> ComplementaritySystem:
    """x' = below where x < 0 and above where x > 0, with the time as second state."""
    x = ca.SX.sym("x", 2)
    substituted = [ca.substitute(ca.SX(part), TIME, x[1]) for part in (below, above)]
    fields = ca.vertcat(ca.horzcat(*substituted), ca.DM.ones(1, 2))
    return by_regions(form, Model(x), [Subsystem(fields=fields, switching=x[0], sign_matrix=SIGNS)])


TIME = ca.SX.sym("time")


def planar_oscillator(form: str) -> ComplementaritySystem:
    """The oscillator of `oscillator`, inside and outside the unit circle as two regions."""
    x = ca.SX.sym("x", 2)
    inside, outside = ca.DM([[1, -OMEGA], [OMEGA, 1]]), ca.DM([[1, OMEGA], [-OMEGA, 1]])
    fields = ca.horzcat(ca.mtimes(inside, x), ca.mtimes(outside, x))
    return by_regions(form, Model(x), [Subsystem(fields=fields, switching=ca.sumsqr(x) - 1, sign_matrix=SIGNS)])


def relays(form: str, count: int, below: float, above: float) -> ComplementaritySystem:
    """Independent x_i' = below where x_i < 0, above where x_i > 0."""
    x = ca.SX.sym("x", count)
    subsystems = []
    for i in range(count):
        fields = ca.SX.zeros(count, 2)
        fields[i, :] = ca.DM([[below, above]])
        subsystems.append(Subsystem(fields=fields, switching=x[i], sign_matrix=SIGNS, name=f"relay {i + 1}"))
    return by_regions(form, Model(x), subsystems)
