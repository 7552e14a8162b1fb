"""Cases with closed forms: impacts by time freezing, inelastic with friction and elastic."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from fesd_robot.dcs import Model, StepFunctions, Subsystem, heaviside, stewart
from fesd_robot.fesd import Simulation
from scripts.results.reproduce._closed_forms import Case, Values, both_forms, by_sign, oscillation_error


def frictional_mass(acceleration: float) -> Case:
    """A point mass that falls on a floor with dry friction, inelastic, in the published time-freezing form."""
    state = ca.SX.sym("y", 5)
    _, y, v_x, v_y, _ = ca.vertsplit(state)
    gravity, friction, duration = 10.0, 0.3, 3.0
    flight = ca.vertcat(v_x, v_y, 0, -gravity, 1)
    forward, backward = (ca.vertcat(0, 0, side * friction * acceleration, acceleration, 0) for side in (-1, 1))
    switching = ca.vertcat(y, v_y, v_x)
    regions = Subsystem(
        switching=switching,
        sign_matrix=np.array([[1, 0, 0], [-1, 1, 0], [-1, -1, 1], [-1, -1, -1]]),
        fields=ca.horzcat(flight, flight, forward, backward),
        region_names=["flight", "lifting off", "floor, v_x > 0", "floor, v_x < 0"],
    )
    alpha, beta = ca.SX.sym("alpha", 3), ca.SX.sym("beta")
    steps = heaviside(
        Model(state),
        StepFunctions(alpha, switching, names=["gap", "v_y", "v_x"]),
        (1 - beta) * flight + beta * (alpha[2] * forward + (1 - alpha[2]) * backward),
        lifted=[("beta", beta, (1 - alpha[0]) * (1 - alpha[1]))],
    )
    impact, speed = math.sqrt(0.2), math.sqrt(20)  # y = 1 - 5 t^2, v_y = -10 t
    rate = acceleration / (acceleration + gravity)
    exact = {
        "impact at": impact,  # 0.447213595499957939
        "v_y before": -speed,
        "frozen for": speed / acceleration,
        "v_x after": 4 - friction * speed,  # 2.65835921350012618
        "v_y after": 0.0,
        "clock rate, slipping": rate,
        "clock rate, sticking": rate,
        "sticks at": 4 / 3,
        "x(3)": 89 / 30,
        "clock at the end": duration,
    }

    def measure(simulation: Simulation) -> Values:
        lasting = [element for element in simulation.elements if element.step > 1e-9]
        frozen = [i for i, e in enumerate(lasting) if abs(e.x[-1, 4] - e.x_left[4]) < 1e-3 * e.step]
        stuck = [i for i, e in enumerate(lasting) if abs(e.x[-1, 2]) < 1e-9 and abs(e.x_left[2]) < 1e-9]
        end = {"x(3)": simulation.states[-1, 0], "clock at the end": simulation.states[-1, 4]}
        if not frozen or not stuck:
            return {**dict.fromkeys(exact, math.nan), **end}
        begin, after = lasting[frozen[0]], lasting[frozen[-1] + 1]
        rest, last = lasting[stuck[0]], lasting[-1]
        return {
            "impact at": begin.x_left[4],
            "v_y before": begin.x_left[3],
            "frozen for": after.start - begin.start,
            "v_x after": after.x_left[2],
            "v_y after": after.x_left[3],
            "clock rate, slipping": (rest.x_left[4] - after.x_left[4]) / (rest.start - after.start),
            "clock rate, sticking": (last.x[-1, 4] - rest.x_left[4]) / (last.end - rest.start),
            "sticks at": rest.x_left[4],
            **end,
        }

    return Case(
        name=f"inelastic frictional mass, a_n = {acceleration:g}",
        about=f"m = 1, q(0) = (0, 1), v(0) = (4, 0), g = 10, mu = 0.3; floor as an auxiliary force of "
        f"{acceleration:g} in frozen time",
        systems={"Stewart": stewart(Model(state), regions), "step functions": steps},
        initial=[0.0, 1.0, 4.0, 0.0, 0.0],
        duration=impact + speed / acceleration + (duration - impact) / rate,
        steps=33,
        exact=exact,
        measure=measure,
        elements=3,
        clock=4,
        curves={"x": 0, "y": 1, "v_x": 2, "v_y": 3},
    )


def ball_flight(
    height: float, restitution: float, end: float, gravity: float = 9.81
) -> tuple[list[float], float, float]:
    """Return impact times, q and v at the end of a ball dropped from rest."""
    time = math.sqrt(2 * height / gravity)
    speed, impacts = gravity * time, []
    while time <= end:
        impacts.append(time)
        speed *= restitution
        time += 2 * speed / gravity
    since = end - impacts[-1]
    return impacts, speed * since - gravity * since**2 / 2, speed - gravity * since


def bouncing_ball(height: float, restitution: float, end: float) -> Case:
    """A ball on a floor that is a damped spring in frozen time; half a swing returns it with -e times its speed."""
    state = ca.SX.sym("y", 3)
    q, v, _ = ca.vertsplit(state)
    gravity, stiffness = 9.81, 10.0
    logarithm = abs(math.log(restitution))
    damping = 2 * logarithm * math.sqrt(stiffness / (math.pi**2 + logarithm**2))
    swing = math.pi / math.sqrt(stiffness - damping**2 / 4)
    impacts, q_end, v_end = ball_flight(height, restitution, end)
    duration = end + len(impacts) * swing
    steps = round(10 * duration)
    names = [f"impact {i}" for i in range(1, len(impacts) + 1)]
    exact = {
        **dict(zip(names, impacts, strict=True)),
        "q at the end": q_end,
        "v at the end": v_end,
        "clock at the end": end,
    }

    def measure(simulation: Simulation) -> Values:
        times = simulation.switch_times
        clocks = simulation.at(times)[:, 2] if len(times) == 2 * len(names) else np.full(2 * len(names), math.nan)
        return {
            **dict(zip(names, clocks[::2].tolist(), strict=True)),
            "q at the end": simulation.states[-1, 0],
            "v at the end": simulation.states[-1, 1],
            "clock at the end": simulation.states[-1, 2],
        }

    def estimate(scheme: str, stages: int) -> Values:
        # Flights are parabolas, exact; swings err in speed and length. A change of speed dv changes a flight by
        # 2 dv / g, so that what follows is late.
        frequency = math.sqrt(stiffness)
        error = oscillation_error(scheme, stages, swing, frequency, duration / steps / 2)
        speed = math.sqrt(2 * gravity * height)
        values: dict[str, float] = {names[0]: 0.0}  # nothing but a parabola before
        for bounce, name in enumerate([*names[1:], "clock at the end"], start=1):
            values[name] = bounce**2 * error * (2 * speed / gravity + 1 / frequency)
        values["v at the end"] = len(names) * error * speed + gravity * values["clock at the end"]
        values["q at the end"] = speed * values["v at the end"] / gravity
        return values

    falling, swinging = ca.vertcat(v, -gravity, 1), ca.vertcat(v, -stiffness * q - damping * v, 0)
    return Case(
        name=f"bouncing ball, e = {restitution:g}",
        about=f"g = 9.81, dropped from {height:g}, restitution {restitution:g}, until {end:g} s; floor as a spring "
        f"with k = {stiffness:g} in frozen time",
        systems=both_forms(state, by_sign(q, falling, swinging)),
        initial=[height, 0.0, 0.0],
        duration=duration,
        steps=steps,
        exact=exact,
        measure=measure,
        estimate=estimate,
        clock=2,
        curves={"q": 0, "v": 1},
    )
