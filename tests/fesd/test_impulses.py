"""Contact with impulses at the boundaries of finite elements: simulation, orders, and optimal control."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot.dcs import ComplementaritySystem, Mechanism, UnilateralContact, state_of, with_contacts
from fesd_robot.errors import ModelError
from fesd_robot.fesd import (
    FesdOptions,
    OptimalControlProblem,
    Simulation,
    StepEquilibration,
    Transcription,
    make_tableau,
    simulate,
)
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, Run, solve

BALLS = [
    (0.8, 1.0, 3.0, (0.53862635070246415, 2.26454211690082138), 4),
    (0.5, 0.9, 2.0, (0.17880625592345556, 0.84540202796172778), 4),
    (1.0, 0.8, 2.0, (0.26074172832705720, -0.16586913583647140), 3),
]
"""Height, restitution, duration, end by closed form, impacts."""
TWO_BALLS = {
    ("gauss_legendre", 2): {100: 0.03854810127571623, 200: 0.0024151021257800905},
    ("gauss_legendre", 4): {100: 3.077948649918795e-07},
    ("radau_iia", 3): {100: 0.0007222962754610232, 200: 2.8460829682932267e-05},
    ("radau_iia", 4): {200: 2.153337498465343e-08},
}
"""Errors of the two balls in exact arithmetic with exact switch detection, by scheme and number of steps."""


def _simulated(
    system: ComplementaritySystem, start: np.ndarray, steps: int, duration: float, scheme: tuple[str, int]
) -> Simulation:
    return simulate(system, start, steps, duration, options=FesdOptions(make_tableau(*scheme), elements=2))


@pytest.mark.parametrize(("height", "restitution", "duration", "end", "impacts"), BALLS)
def test_bouncing_ball(
    height: float, restitution: float, duration: float, end: tuple[float, float], impacts: int
) -> None:
    """A ball that bounces ends where its closed form says, with every impact located."""
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    mechanism = Mechanism(q, v, ca.SX.eye(1), ca.SX(-9.81))
    contacts = [UnilateralContact("ball", q, ca.SX(1), restitution=restitution)]
    start = state_of(mechanism, contacts, np.array([height]), np.zeros(1))
    simulation = _simulated(with_contacts(mechanism, contacts), start, 20, duration, ("radau_iia", 2))
    assert len(simulation.switch_times) == impacts
    assert simulation.switch_times[0] == pytest.approx(np.sqrt(2 * height / 9.81), abs=1e-13)
    assert np.abs(simulation.states[-1][:2] - end).max() < 1e-12
    assert {report.method for report in simulation.reports} == {"modes"}


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "errors"), TWO_BALLS.items())
def test_two_balls_with_a_spring(scheme: tuple[str, int], errors: dict[int, float]) -> None:
    """Two elastic impacts leave the error at what the scheme has in exact arithmetic (arXiv 2305.17003, Fig. 6)."""
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    spring = 1e4 * (q[1] - q[0] - 1)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.vertcat(spring - 9.81, -spring - 9.81))
    contacts = [UnilateralContact("ball", q[0] - 0.2, ca.SX([1, 0]), restitution=0.8)]
    system, start = with_contacts(mechanism, contacts), np.array([1.0, 2.0, 0.0, 0.0, 0.8])
    exact = np.array([0.24684188672883527, 1.2282103120085011, -2.3798395214664336, -3.1140923936237557])
    for steps, ideal in errors.items():
        simulation = _simulated(system, start, steps, 1.0, scheme)
        assert np.abs(simulation.states[-1][:4] - exact).max() == pytest.approx(ideal, rel=2e-2)


def _bead(gap: str) -> tuple[ComplementaritySystem, np.ndarray]:
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    distance = ca.norm_2(q)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.SX([0, -9.81]))
    contacts = [UnilateralContact("bead", 1 - distance, -q / distance)]
    start = state_of(mechanism, contacts, np.array([np.sin(1.0), -np.cos(1.0)]), np.zeros(2))
    system = with_contacts(mechanism, contacts, gap=gap)  # type: ignore[arg-type]
    return system, start[: system.state.numel()]


@pytest.mark.slow
def test_lasting_contact_keeps_the_order_of_the_velocity() -> None:
    """Along a curved gap the integrated gap gives the velocity the order 2s - 1, the true gap only s."""
    pendulum = solve_ivp(lambda _, y: [y[1], -9.81 * np.sin(y[0])], (0, 1.5), [1, 0], rtol=1e-12, atol=1e-12)
    angle, rate = pendulum.y[:, -1]
    velocity = rate * np.array([np.cos(angle), np.sin(angle)])
    orders = {}
    for gap in ("integrated", "true"):
        system, start = _bead(gap)
        errors = []
        for steps in (20, 40):
            x = _simulated(system, start, steps, 1.5, ("radau_iia", 2)).states[-1]
            errors.append(np.abs(x[2:4] - velocity).max())
        orders[gap] = np.log2(errors[0] / errors[1])
    assert orders["integrated"] > 2.8
    assert orders["true"] < 2.2


def test_impact_on_a_body_that_rests() -> None:
    """A body that falls on one at rest on the ground stops, and both contacts take the same impulse, m v."""
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    mechanism = Mechanism(q, v, 2 * ca.SX.eye(2), ca.SX([-20, -20]))
    contacts = [
        UnilateralContact("ground", q[0], ca.SX([1, 0])),
        UnilateralContact("upper", q[1] - q[0] - 1, ca.SX([-1, 1])),
    ]
    start = state_of(mechanism, contacts, np.array([0.0, 2.0]), np.zeros(2))
    simulation = _simulated(with_contacts(mechanism, contacts), start, 10, 1.0, ("radau_iia", 2))
    assert simulation.switch_times == pytest.approx([np.sqrt(0.2)], abs=1e-12)
    assert simulation.states[-1][:4] == pytest.approx([0.0, 1.0, 0.0, 0.0], abs=1e-12)
    impulses = sum(element.jump[2:] for element in simulation.elements)
    assert impulses == pytest.approx(2 * 10 * np.sqrt(0.2) * np.ones(2), abs=1e-10)
    assert simulation.phases[1].regions == "ground closed, upper closed, after an impact of ground, upper"


def _thrown_mass() -> ComplementaritySystem:
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.SX([0, -10]))
    return with_contacts(mechanism, [UnilateralContact("mass", q[1], ca.SX([0, 1]), ca.SX([1, 0]), friction=0.3)])


def test_thrown_mass_lands_slides_and_stops() -> None:
    """Impulsive friction takes mu times the normal impulse, friction the rest; relaxed NLPs find both."""
    options = FesdOptions(make_tableau("radau_iia", 2), elements=3)
    simulation = simulate(_thrown_mass(), np.array([0.0, 1.0, 4.0, 0.0, 1.0]), 3, 3.0, options=options)
    assert simulation.states[-1][:2] == pytest.approx([89 / 30, 0.0], abs=1e-7)
    hit = max(simulation.elements, key=lambda element: float(element.jump[2:].sum()))
    assert hit.start == pytest.approx(np.sqrt(0.2), abs=1e-7)
    assert hit.x_left[2] == pytest.approx(4 - 0.3 * np.sqrt(20), abs=1e-6)


def test_throw_that_ends_at_a_distance() -> None:
    """The velocity of the throw that ends at 89/30 m is 4 m/s; polishing finds it to round-off."""
    free = [np.inf] * 4
    problem = OptimalControlProblem(
        _thrown_mass(), 3.0, intervals=3, initial_lower=[0, 1, 0, 0, 1], initial_upper=[0, 1, 10, 0, 1],
        terminal_lower=[89 / 30, *(-np.inf for _ in free)], terminal_upper=[89 / 30, *free],
    )  # fmt: skip
    transcription = Transcription(problem, FesdOptions(elements=3))
    branches = BranchTranscription(transcription)
    solution = solve(transcription.problem, Run(HomotopyOptions(sigma_start=1.0)), polisher=branches)
    elements = transcription.unpack(solution.w)
    assert solution.branch is not None
    assert solution.residuals.complementarity < 1e-12
    assert elements[0].x_left[2] == pytest.approx(4.0, abs=1e-9)
    hit = max(elements, key=lambda element: float(element.jump[2:].sum()))
    assert hit.start == pytest.approx(np.sqrt(0.2), abs=1e-9)
    assert transcription.pack(elements) == pytest.approx(solution.w, abs=1e-12)


@pytest.mark.parametrize("mode", ["direct", "linear_complementarity"])
def test_bounce_is_not_equalised(mode: StepEquilibration) -> None:
    """The exact step equilibrations let an elastic impact between two flights lie where it is."""
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    mechanism = Mechanism(q, v, ca.SX.eye(1), ca.SX(-9.81))
    system = with_contacts(mechanism, [UnilateralContact("ball", q, ca.SX(1), restitution=0.8)])
    start = np.array([0.3, 0.0, 0.3])
    problem = OptimalControlProblem(system, 0.4, initial_lower=start, initial_upper=start)
    options = FesdOptions(elements=2, step_equilibration=mode, form="integral")
    transcription = Transcription(problem, options)
    simulation = simulate(system, start, 1, 0.4, options=options)
    residuals = transcription.problem.residuals(transcription.pack(simulation.elements))
    assert simulation.elements[0].step == pytest.approx(np.sqrt(0.6 / 9.81), abs=1e-12)
    assert abs(simulation.elements[0].step - simulation.elements[1].step) > 0.05
    assert residuals.complementarity < 1e-12
    assert residuals.constraint_violation < 1e-12


def test_a_span_of_time_refuses_jumps() -> None:
    """Steps of their own choice are for states that are continuous."""
    with pytest.raises(ModelError, match="continuous"):
        simulate(_thrown_mass(), np.array([0.0, 1.0, 4.0, 0.0, 1.0]), (0.0, 1.0))
