"""Cases with closed forms: switching and sliding of scalars, and dry friction."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from fesd_robot.fesd import Simulation, make_tableau
from scripts.results.reproduce._closed_forms import (
    Case,
    Values,
    both_forms,
    by_sign,
    oscillation_error,
    sliding_weights,
    switches,
)

# -- scalar switching ------------------------------------------------------------------------------------------------


def crossing() -> Case:
    """x' = 2 - sign(x)."""
    x = ca.SX.sym("x")
    return Case(
        name="crossing",
        about="x' in 2 - sign x, x(0) = -1",
        systems=both_forms(x, by_sign(x, ca.SX(1), ca.SX(3))),
        initial=[-1.0],
        duration=2.0,
        steps=7,
        exact={"switch time": 1 / 3, "x(2)": 5 / 3},
        measure=lambda simulation: {**switches(simulation, "switch time"), "x(2)": simulation.states[-1, 0]},
    )


def sliding() -> Case:
    """x' = -sign(x), which stays at 0."""
    x = ca.SX.sym("x")

    def measure(simulation: Simulation) -> Values:
        weights = sliding_weights(simulation)[:, 0]
        worst = weights[np.argmax(np.abs(weights - 0.5))]
        return {**switches(simulation, "reaches 0"), "theta of x > 0 there": worst, "x(2)": simulation.states[-1, 0]}

    return Case(
        name="sliding",
        about="x' in -sign x, x(0) = -0.5",
        systems=both_forms(x, by_sign(x, ca.SX(-1), ca.SX(1))),
        initial=[-0.5],
        duration=2.0,
        steps=7,
        exact={"reaches 0": 0.5, "theta of x > 0 there": 0.5, "x(2)": 0.0},
        measure=measure,
    )


def leaving() -> Case:
    """x' = t - sign(x), whose sliding mode ends."""
    x, t = ca.SX.sym("x"), ca.SX.sym("t")

    def measure(simulation: Simulation) -> Values:
        inside = sliding_weights(simulation)
        worst = inside[np.argmax(np.abs(inside[:, 0] - (1 + inside[:, 2]) / 2))]  # theta_neg(t) = (1 - t) / 2
        weight = 0.85 + worst[0] - (1 + worst[2]) / 2
        return {
            **switches(simulation, "reaches 0", "leaves 0"),
            "theta of x > 0 at 0.7": weight,
            "x(2)": simulation.states[-1, 0],
        }

    above, below = (ca.vertcat(t + sign, 1) for sign in (-1, 1))
    return Case(
        name="leaving a sliding mode",
        about="x' in t - sign x, x(0) = -0.5",
        systems=both_forms(ca.vertcat(x, t), by_sign(x, above, below)),
        initial=[-0.5, 0.0],
        duration=2.0,
        steps=7,
        exact={"reaches 0": math.sqrt(2) - 1, "leaves 0": 1.0, "theta of x > 0 at 0.7": 0.85, "x(2)": 0.5},
        measure=measure,
    )


def two_coordinates() -> Case:
    """x1' = -sign(x1), x2' = -sign(x2): two subsystems, each with multipliers of its own."""
    x = ca.SX.sym("x", 2)
    subsystems = [
        by_sign(x[0], ca.SX([-1, 0]), ca.SX([1, 0]), name="first"),
        by_sign(x[1], ca.SX([0, -1]), ca.SX([0, 1]), name="second"),
    ]
    return Case(
        name="two independent coordinates",
        about="x1' in -sign x1, x2' in -sign x2, x(0) = (0.5, -1), a Cartesian product",
        systems=both_forms(x, subsystems),
        initial=[0.5, -1.0],
        duration=2.0,
        steps=7,
        exact={"x1 reaches 0": 0.5, "x2 reaches 0": 1.0, "x1(2)": 0.0, "x2(2)": 0.0},
        measure=lambda simulation: {
            **switches(simulation, "x1 reaches 0", "x2 reaches 0"),
            "x1(2)": simulation.states[-1, 0],
            "x2(2)": simulation.states[-1, 1],
        },
        curves={"x1": 0, "x2": 1},
    )


# -- dry friction ----------------------------------------------------------------------------------------------------


def mass_spring() -> Case:
    """q'' = -q - 0.15 sign(q'): half waves about -0.15 and 0.15, sticking where |q| <= 0.15 at a turning point."""
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    duration, steps = 12.0, 60
    names = ("turns at pi", "turns at 2 pi", "sticks at 3 pi")
    exact = {
        **dict(zip(names, (math.pi, 2 * math.pi, 3 * math.pi), strict=True)),
        "q there": -0.7,
        "q at 2 pi": 0.4,
        "q(5)": -0.15 + 0.55 * math.cos(5),  # 0.00601420200477444546
        "v(5)": -0.55 * math.sin(5),  # 0.527408351064726158
        "q(12)": -0.1,
        "v(12)": 0.0,
    }

    def measure(simulation: Simulation) -> Values:
        times = switches(simulation, *names)
        five = simulation.states[int(np.argmin(np.abs(simulation.times - 5)))]
        turning = [simulation.at([t])[0, 0] if t == t else math.nan for t in times.values()]
        return {
            **times,
            "q there": turning[0],
            "q at 2 pi": turning[1],
            "q(5)": five[0],
            "v(5)": five[1],
            "q(12)": simulation.states[-1, 0],
            "v(12)": simulation.states[-1, 1],
        }

    def estimate(scheme: str, stages: int) -> Values:
        error = oscillation_error(scheme, stages, 3 * math.pi, 1.0, duration / steps / 2)
        # A turning time is where v vanishes; its error is that of v over the acceleration, 0.25 at the last one.
        return {**dict.fromkeys(exact, error), **dict.fromkeys(names, error / 0.25), "v(12)": 0.0}

    above, below = (ca.vertcat(v, -q - friction) for friction in (0.15, -0.15))
    return Case(
        name="mass–spring with dry friction",
        about="q'' in -q - 0.15 sign q', q(0) = 1, at rest",
        systems=both_forms(ca.vertcat(q, v), by_sign(v, above, below)),
        initial=[1.0, 0.0],
        duration=duration,
        steps=steps,
        exact=exact,
        measure=measure,
        estimate=estimate,
        curves={"q": 0, "v": 1},
    )


def stick_slip() -> Case:
    """v' = sin t - 0.4 sign(v) from rest: sticks while sin t < 0.4, slips, reverses."""
    x, v, t = ca.SX.sym("x"), ca.SX.sym("v"), ca.SX.sym("t")
    duration, steps = 8.0, 50
    slip = math.asin(0.4)  # 0.411516846067488019
    zero = brentq(lambda t: math.cos(slip) - math.cos(t) - 0.4 * (t - slip), 3, 5, xtol=1e-15)  # 4.11304891039567806
    again = brentq(lambda t: math.cos(zero) - math.cos(t) + 0.4 * (t - zero), 6, 8, xtol=1e-15)  # 7.14705088360020846

    def distance(begin: float, end: float, friction: float) -> float:
        """Return the distance travelled from rest at ``begin`` until ``end`` under sin t - friction."""
        return math.cos(begin) * (end - begin) - math.sin(end) + math.sin(begin) - friction * (end - begin) ** 2 / 2

    names = ("begins to slip", "v = 0, reverses", "v = 0 again")
    exact = {
        **dict(zip(names, (slip, zero, again), strict=True)),
        "x at the reversal": distance(slip, zero, 0.4),  # 1.87795030944440929
        "x at v = 0 again": distance(slip, zero, 0.4) + distance(zero, again, -0.4),  # 0.421443408385954844
    }

    def measure(simulation: Simulation) -> Values:
        times = switches(simulation, *names)
        places = [simulation.at([t])[0, 0] if t == t else math.nan for t in times.values()]
        return {**times, "x at the reversal": places[1], "x at v = 0 again": places[2]}

    def estimate(scheme: str, stages: int) -> Values:
        # sin t oscillates with frequency 1; two integrations over the duration take it to x.
        h = duration / steps / 2
        error = oscillation_error(scheme, stages, duration, 1.0, h)
        # The Filippov multipliers at the stages, extrapolated to the end of the element, decide when a sliding mode
        # ends. That is exact where the end is a stage; v and x feel it squared only.
        c = make_tableau(scheme, stages).c
        carried = h**stages * float(np.prod(1 - c)) / math.factorial(stages) / math.cos(slip)
        return {
            **dict.fromkeys(exact, duration * error),
            names[0]: carried,
            names[1]: error / 0.825708059676336,  # the force there
            names[2]: error / 0.760358941414317,
        }

    above, below = (ca.vertcat(v, ca.sin(t) - friction, 1) for friction in (0.4, -0.4))
    return Case(
        name="forced stick-slip",
        about="v' in sin t - 0.4 sign v, x' = v, at rest; time is a state",
        systems=both_forms(ca.vertcat(x, v, t), by_sign(v, above, below)),
        initial=[0.0, 0.0, 0.0],
        duration=duration,
        steps=steps,
        exact=exact,
        measure=measure,
        estimate=estimate,
        curves={"x": 0, "v": 1},
    )
