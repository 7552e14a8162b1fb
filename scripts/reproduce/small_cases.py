"""Small systems whose solutions have closed forms: switching, sliding, dry friction, impacts by time freezing.

    python scripts/reproduce/small_cases.py
    python scripts/reproduce/small_cases.py --quick

Every case is written down once, as regions with a vector field each, and integrated in the form of Stewart and with
set-valued step functions. Where solutions are polynomials that the schemes represent, what is left is round-off;
elsewhere the difference is that of the scheme, for which an estimate is printed beside it.
"""

from __future__ import annotations

from _common import Report, markdown_table, number, plt  # isort: skip  # sets OMP_NUM_THREADS before numpy is imported

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from fesd_robot.dcs import ComplementaritySystem, Subsystem, heaviside, heaviside_from_regions, stewart
from fesd_robot.fesd import FesdOptions, Simulation, SimulationError, make_tableau, simulate

ROUND_OFF = 1e-9
"""Largest difference where the scheme is exact."""
FORMS_AGREE = 1e-10
"""Largest difference between the two forms."""
MARGIN = 3.0
"""Where the scheme is not exact, a difference may be this many times its estimated error."""
SCHEMES = (("radau_iia", 2), ("radau_iia", 3), ("gauss_legendre", 2), ("gauss_legendre", 3))
TITLES = {"radau_iia": "Radau IIA", "gauss_legendre": "Gauss–Legendre"}
FORMS = ("Stewart", "step functions")

Values = Mapping[str, float]
Systems = Mapping[str, ComplementaritySystem]


def order(scheme: str, stages: int) -> int:
    """Return the order of a scheme of the two families used here."""
    return 2 * stages - (scheme == "radau_iia")


def oscillation_error(scheme: str, stages: int, time: float, frequency: float, step: float) -> float:
    """Estimate the relative error after integrating x' = i w x over a time with steps h.

    The stability function differs from exp(z) by C z^(p+1), in time/h steps: time w C (w h)^p.

    Source: Hairer & Wanner, Solving ODEs II, IV.3 (Pade approximations and their error constants).
    """
    s, factorial = stages, math.factorial
    if scheme == "radau_iia":
        constant = factorial(s) * factorial(s - 1) / (factorial(2 * s - 1) * factorial(2 * s))
    else:
        constant = factorial(s) ** 2 / (factorial(2 * s) * factorial(2 * s + 1))
    return time * frequency * constant * (frequency * step) ** order(scheme, stages)


@dataclass(frozen=True)
class Case:
    """A system with closed forms.

    Attributes:
        name: heading and panel title.
        about: the system in a line.
        systems: the system in each form.
        initial: x(0).
        duration: numerical time.
        steps: simulation steps.
        exact: name -> closed form of every quantity that is compared.
        measure: the same quantities of a simulation.
        estimate: (scheme, stages) -> name -> estimated error; names left out, or no estimate, are exact.
        elements: finite elements a step.
        clock: index of the state that is physical time, if time is frozen in some phases.
        curves: label -> index of the states in the figure.
    """

    name: str
    about: str
    systems: Systems
    initial: Sequence[float]
    duration: float
    steps: int
    exact: Values
    measure: Callable[[Simulation], Values]
    estimate: Callable[[str, int], Values] = field(default=lambda scheme, stages: {})
    elements: int = 2
    clock: int | None = None
    curves: Mapping[str, int] = field(default_factory=lambda: {"x": 0})


def both_forms(state: ca.SX, subsystems: Subsystem | list[Subsystem]) -> dict[str, ComplementaritySystem]:
    """Return a system given by regions in both forms."""
    return {
        "Stewart": stewart(state=state, subsystems=subsystems),
        "step functions": heaviside_from_regions(state=state, subsystems=subsystems),
    }


def by_sign(switching: ca.SX, positive: ca.SX, negative: ca.SX, name: str = "regions") -> Subsystem:
    """Return the two regions on both sides of a switching function."""
    return Subsystem(
        switching=switching,
        sign_matrix=np.array([[1], [-1]]),
        fields=ca.horzcat(positive, negative),
        region_names=["positive", "negative"],
        name=name,
    )


def sliding_weights(simulation: Simulation) -> np.ndarray:
    """Return the weight of the field of the positive side and the state at all stages on x = 0, (m, 1 + n_x)."""
    names = list(simulation.system.algebraic_names)
    index = names.index("theta[positive]" if "theta[positive]" in names else "alpha[c1]")
    stages = simulation.tableau.stages
    rows = [
        np.append(z[index], x)
        for element in simulation.elements
        for x, z in zip(element.x[:stages], element.z[:stages], strict=True)
        if element.step > 0 and max(abs(element.x_left[0]), *np.abs(element.x[:, 0])) < 1e-9
    ]
    return np.array(rows)


def switches(simulation: Simulation, *names: str) -> dict[str, float]:
    """Return the switch times under the names they should have; NaN throughout if there are more or fewer."""
    times = simulation.switch_times
    if len(times) != len(names):
        return dict.fromkeys(names, math.nan)
    return dict(zip(names, times.tolist(), strict=True))


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
        return {**switches(simulation, "reaches 0"), "weight of x > 0 there": worst, "x(2)": simulation.states[-1, 0]}

    return Case(
        name="sliding",
        about="x' in -sign x, x(0) = -0.5",
        systems=both_forms(x, by_sign(x, ca.SX(-1), ca.SX(1))),
        initial=[-0.5],
        duration=2.0,
        steps=7,
        exact={"reaches 0": 0.5, "weight of x > 0 there": 0.5, "x(2)": 0.0},
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
            "weight of x > 0 at 0.7": weight,
            "x(2)": simulation.states[-1, 0],
        }

    fields = (ca.vertcat(t + sign, 1) for sign in (-1, 1))
    return Case(
        name="leaving a sliding mode",
        about="x' in t - sign x, x(0) = -0.5",
        systems=both_forms(ca.vertcat(x, t), by_sign(x, *fields)),
        initial=[-0.5, 0.0],
        duration=2.0,
        steps=7,
        exact={"reaches 0": math.sqrt(2) - 1, "leaves 0": 1.0, "weight of x > 0 at 0.7": 0.85, "x(2)": 0.5},
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

    return Case(
        name="mass–spring with dry friction",
        about="q'' in -q - 0.15 sign q', q(0) = 1, at rest",
        systems=both_forms(ca.vertcat(q, v), by_sign(v, *(ca.vertcat(v, -q - friction) for friction in (0.15, -0.15)))),
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
        """Return the way from rest at ``begin`` to ``end`` under sin t - friction."""
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
        # The weights at the stages, carried on to the end of the element, decide when a sliding mode ends. That is
        # exact where the end is a stage; v and x feel it squared only.
        c = make_tableau(scheme, stages).c
        carried = h**stages * float(np.prod(1 - c)) / math.factorial(stages) / math.cos(slip)
        return {
            **dict.fromkeys(exact, duration * error),
            names[0]: carried,
            names[1]: error / 0.825708059676336,  # the force there
            names[2]: error / 0.760358941414317,
        }

    fields = (ca.vertcat(v, ca.sin(t) - friction, 1) for friction in (0.4, -0.4))
    return Case(
        name="forced stick-slip",
        about="v' in sin t - 0.4 sign v, x' = v, at rest; time is a state",
        systems=both_forms(ca.vertcat(x, v, t), by_sign(v, *fields)),
        initial=[0.0, 0.0, 0.0],
        duration=duration,
        steps=steps,
        exact=exact,
        measure=measure,
        estimate=estimate,
        curves={"x": 0, "v": 1},
    )


# -- impacts by time freezing ----------------------------------------------------------------------------------------


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
        state=state,
        alpha=alpha,
        switching=switching,
        right_hand_side=(1 - beta) * flight + beta * (alpha[2] * forward + (1 - alpha[2]) * backward),
        lifted=[("beta", beta, (1 - alpha[0]) * (1 - alpha[1]))],
        step_names=["gap", "v_y", "v_x"],
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
        about=f"m = 1, q(0) = (0, 1), v(0) = (4, 0), g = 10, mu = 0.3; floor as an acceleration {acceleration:g} in "
        "frozen time",
        systems={"Stewart": stewart(state=state, subsystems=regions), "step functions": steps},
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


def cases() -> list[Case]:
    """Return all cases."""
    return [
        crossing(),
        sliding(),
        leaving(),
        two_coordinates(),
        mass_spring(),
        stick_slip(),
        frictional_mass(10.0),
        frictional_mass(100.0),
        bouncing_ball(0.8, 1.0, 3.0),
        bouncing_ball(0.5, 0.9, 2.0),
        bouncing_ball(1.0, 0.8, 2.0),
    ]


# -- running and reporting -------------------------------------------------------------------------------------------


def run(case: Case, form: str, scheme: str, stages: int) -> Simulation:
    """Simulate a case."""
    return simulate(
        case.systems[form],
        np.array(case.initial),
        case.steps,
        case.duration,
        # One element may take a whole step: in a step with several switches the lengths are far from equal.
        options=FesdOptions(make_tableau(scheme, stages), elements=case.elements, step_freedom=case.elements - 1.0),
    )


def label(scheme: str, stages: int) -> str:
    """Return the name of a scheme with its order."""
    return f"{TITLES[scheme]} {order(scheme, stages)}"


def shown(difference: float) -> str:
    """Return a difference for a table; a dash where there is nothing to compare."""
    return number(difference if math.isfinite(difference) else None, 1)


def try_all(case: Case, schemes: Sequence[tuple[str, int]]) -> Iterator[tuple[str, str, int, Simulation | str]]:
    """Run a case in all forms and schemes; a step that is not solved gives its message."""
    for scheme, stages in schemes:
        for form in FORMS:
            try:
                yield form, scheme, stages, run(case, form, scheme, stages)
            except SimulationError as error:
                yield form, scheme, stages, str(error)


def study(case: Case, schemes: Sequence[tuple[str, int]], report: Report) -> Simulation | None:
    """Compare a case with its closed forms; return a simulation for the figure."""
    simulations: dict[tuple[str, str, int], Simulation] = {}
    notes = []
    for form, scheme, stages, result in try_all(case, schemes):
        which = f"{form}, {label(scheme, stages)}"
        if isinstance(result, str):
            notes.append(f"{which}: {result}.")
            continue
        simulations[form, scheme, stages] = result
        others = [f"step {r.step} by {r.method}" for r in result.reports if r.method != "modes"]
        if others:
            notes.append(f"{which}: {', '.join(others)}.")
    measured = {key: case.measure(simulation) for key, simulation in simulations.items()}
    estimates = {pair: case.estimate(*pair) for pair in schemes}

    def worst(name: str, scheme: str, stages: int) -> float:
        values = [measured[form, scheme, stages][name] for form in FORMS if (form, scheme, stages) in measured]
        return max((math.inf if v != v else abs(v - case.exact[name]) for v in values), default=math.inf)

    def allowed(name: str, scheme: str, stages: int) -> float:
        return ROUND_OFF + MARGIN * estimates[scheme, stages].get(name, 0.0)

    def between_forms(name: str) -> float:
        pairs = [[measured.get((form, *pair), {}).get(name, math.nan) for form in FORMS] for pair in schemes]
        return max(abs(a - b) for a, b in pairs) if np.isfinite(pairs).all() else math.inf

    best = next((key for key in measured if key[1:] == ("radau_iia", 3)), next(iter(measured), None))
    rows = [
        [
            name,
            f"{value:.15g}",
            f"{measured[best][name]:.15g}".replace("nan", "not found") if best else "–",
            *(shown(worst(name, *pair)) for pair in schemes),
            shown(between_forms(name)),
        ]
        for name, value in case.exact.items()
    ]
    inexact = any(any(values.values()) for values in estimates.values())
    if inexact:
        largest = [max(estimates[pair].values()) for pair in schemes]
        rows.append(["largest estimated error", "", "", *(shown(value) for value in largest), ""])
    header = [
        "quantity",
        "closed form",
        f"ours, {label(*best[1:])}" if best else "ours",
        *(label(*pair) for pair in schemes),
        "Stewart – steps",
    ]
    report.add(f"## {case.name}\n\n{case.about}; {case.steps} steps of {case.elements} elements.")
    report.add(markdown_table(header, rows))
    if notes:
        report.add("\n".join(f"- {note}" for note in notes))

    late = [
        (worst(name, *pair), name, pair)
        for pair in schemes
        for name in case.exact
        if not worst(name, *pair) <= allowed(name, *pair)
    ]
    bound = f"{MARGIN:g} times the estimated error" if inexact else f"{ROUND_OFF:g}"
    more = ""
    if late:
        size, name, pair = max(late)
        found_out = f"differs by {size:.1e}" if math.isfinite(size) else "was not found"
        more = f" ({len(late)} are not: {name} {found_out} with {label(*pair)})"
    report.check(f"{case.name}: every difference is within {bound}{more}", not late)
    apart = [
        np.abs(simulations[(FORMS[0], *pair)].states - simulations[(FORMS[1], *pair)].states).max()
        for pair in schemes
        if all((form, *pair) in simulations for form in FORMS)
    ]
    gap = max(*(between_forms(name) for name in case.exact), *apart)
    report.check(f"{case.name}: both forms agree to {FORMS_AGREE:g}, found {gap:.0e}", gap <= FORMS_AGREE)
    return simulations[best] if best else None


def draw(chosen: Sequence[tuple[Case, Simulation]], report: Report) -> None:
    """Draw one panel a case."""
    columns = 3
    lines = math.ceil(len(chosen) / columns)
    figure, axes = plt.subplots(lines, columns, figsize=(11, 2.3 * lines), layout="constrained", squeeze=False)
    for axis in axes.flat[len(chosen) :]:
        axis.remove()
    for axis, (case, simulation) in zip(axes.flat, chosen, strict=False):
        times = np.unique(np.concatenate([np.linspace(0, case.duration, 800), simulation.switch_times]))
        states = simulation.at(times)
        physical, switch = times, simulation.switch_times
        if case.clock is not None:
            physical = states[:, case.clock]
            switch = simulation.at(switch)[:, case.clock]
            moving = np.append(True, np.diff(physical) > 1e-9)
            for index in case.curves.values():  # what happens in frozen time is a jump in physical time
                if index < case.clock // 2:
                    states[~moving, index] = np.interp(physical[~moving], physical[moving], states[moving, index])
        for i, (name, index) in enumerate(case.curves.items()):
            axis.plot(physical, states[:, index], label=name.replace("_", ""), color=f"C{i}", zorder=3)
        for time in np.unique(switch.round(9)):
            axis.axvline(time, color="0.55", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        axis.set_title(case.name, fontsize=9, loc="left")
        axis.set_xlabel("physical time" if case.clock is not None else "time")
        axis.margins(x=0.01)
        if len(case.curves) > 1:
            outside = {"loc": "lower right", "bbox_to_anchor": (1.02, 0.97)} if len(case.curves) == 2 else {}
            axis.legend(ncols=2, handlelength=1.2, columnspacing=0.8, fontsize=8, **outside)
    report.figure(
        figure, "States over time, physical time where it is frozen in between; dashed lines are the switches found."
    )


def main() -> None:
    """Run all cases."""
    report = Report("small_cases", "Small systems with closed forms", __doc__ or "")
    arguments = report.parse()
    schemes = [SCHEMES[1], SCHEMES[2]] if arguments.quick else list(SCHEMES)
    report.add(
        "Every case is one set of regions with a vector field each, integrated in the form of Stewart and with "
        "set-valued step functions. Columns of a scheme (named with its order) show the larger of the two forms' "
        "absolute differences to the closed form; the last column how far the forms are apart, over all schemes.\n\n"
        "Piecewise polynomial solutions are represented by the schemes, and only round-off is left. Otherwise the "
        "difference is that of the scheme, and its estimate from the leading error term stands below. The end of a "
        "sliding mode is found from the weights at the stages, carried on to the end of the element: exactly where "
        "that is a stage, else with an order equal to the number of stages (stick-slip with Gauss–Legendre).\n\n"
        "Impacts are made by time freezing: a phase of numerical time in which the clock stands still and the floor "
        "turns the velocity. Elastic impacts have a damped spring for a floor then, and the error of integrating its "
        "swing, which Gauss–Legendre makes without damping in its length alone; impulses at element boundaries would "
        "have none."
    )
    chosen = []
    for case in cases():
        simulation = study(case, schemes, report)
        if simulation is not None:
            chosen.append((case, simulation))
    draw(chosen, report)
    report.finish()


if __name__ == "__main__":
    main()
